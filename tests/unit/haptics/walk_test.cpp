// Ways over the surface: downhill on the distance to a goal, from triangle to triangle, beside all triangles one after
// another.
#include "support/bare_triangles.h"
#include "support/shells.h"

#include <relief/base/triangle.h>
#include <relief/core/query.h>
#include <relief/core/tessellate.h>
#include <relief/haptics/contact/walk.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

namespace relief {
namespace {

using detail::distance2;
using detail::kAnywhere;
using testing::BareTriangles;
using testing::displaced;
using testing::mixed_shell;
using testing::plane_shell;
using testing::torus_shell;
using testing::with_hole;

double rough(Vec3d p) { return 0.5 + 0.2 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.1 * std::sin(31 * p.y); }

/// Closed, of different n, open, and with holes.
std::vector<SnapshotPtr> rough_models() {
  const auto torus = torus_shell(12, 8, 13);
  return {displaced(torus, rough), displaced(mixed_shell(*torus, 3, 3), rough),
          displaced(plane_shell(4, 8), [](Vec3d p) { return 0.5 + 0.3 * std::sin(20 * p.x) * std::cos(17 * p.z); }),
          with_hole(displaced(torus, rough), [](Vec3d p) { return std::sin(6 * p.x) * std::sin(5 * p.z) > 0.6; })};
}

/// A model, its bare triangles, and places of it by chance.
struct Ground {
  SnapshotPtr model;
  Tessellation bare;
  BareTriangles triangles;
  MicroTriangles surface;
  std::mt19937 random{5};
  std::normal_distribution<double> normal;

  explicit Ground(const SnapshotPtr& like)
      : model(like), bare(tessellate(*like)), triangles(bare.positions, bare.triangles), surface(*model) {}
  double unit() { return std::uniform_real_distribution<double>(0, 1)(random); }
  Vec3d anywhere() { return Vec3d{normal(random), normal(random), normal(random)}; }
  /// How long a triangle is there.
  [[nodiscard]] static double side(const SurfacePlace& at) {
    return length(at.triangle.positions[1] - at.triangle.positions[0]);
  }
  /// In a triangle, on an edge, or at a sample, by turns.
  SurfacePlace next(int kind) {
    for (;;) {
      const auto slab = static_cast<SlabId>(random() % model->slab_mesh().slab_count());
      double u = unit(), v = unit();
      if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
      }
      auto place = surface.place_at(slab, u, v);
      if (!place) continue;
      std::array<double, 3>& w = place->weights;
      const std::size_t k = random() % 3;
      if (kind % 3 == 1) w = {k == 0 ? 0 : 0.25, k == 1 ? 0 : 0.25, k == 2 ? 0 : 0.25}, w[(k + 1) % 3] = 0.75;
      if (kind % 3 == 2) w = {}, w[k] = 1;
      place->position = place->triangle.point(w);
      return *place;
    }
  }
  /// Whether it lies on an open edge.
  [[nodiscard]] bool on_rim(Vec3d place) const {
    const std::vector<Vec3d>& rims = triangles.rims();
    for (std::size_t k = 0; k + 1 < rims.size(); k += 2) {
      const Vec3d edge = rims[k + 1] - rims[k], to = place - rims[k];
      const double share = std::clamp(dot(to, edge) / dot(edge, edge), 0.0, 1.0);
      if (length(to - edge * share) < 1e-10) return true;
    }
    return false;
  }
  /// Below a place, by a few triangles.
  Vec3d goal(const SurfacePlace& at) {
    const Vec3d in = normalized(at.triangle.area()) * -1.0;
    return at.position + (in * unit() + anywhere() * 0.7) * (3 * side(at));
  }
  /// The least distance to the goal on the triangles that touch the place.
  [[nodiscard]] double least_around(Vec3d place, Vec3d goal) const {
    double least = kAnywhere;
    triangles.each_within(place, 1e-10, [&](const BareTriangles::Place& touching, double) {
      const auto [a, b, c] = triangles.corners(touching.triangle);
      const auto w = nearest_in_triangle(goal, a, b, c);
      least = std::min(least, length(a * w[0] + b * w[1] + c * w[2] - goal));
    });
    return least;
  }
};

TEST(Walk, EndsAtAMinimumOfAllTrianglesThatTouchThePlace) {
  for (const SnapshotPtr& model : rough_models()) {
    Ground ground(model);
    int ended = 0, moved = 0, at_edges = 0;
    for (int k = 0; k < 2000; ++k) {
      SurfacePlace place = ground.next(k);
      const Vec3d goal = ground.goal(place), from = place.position;
      int tries = detail::kTries;
      const double way = detail::walk(ground.surface, place, goal, kAnywhere, tries);
      ASSERT_LE(length(place.position - goal), length(from - goal)) << k;
      ASSERT_GE(way, length(place.position - from) * (1 - 1e-12)) << k;
      ASSERT_LT(length(place.position - place.triangle.point(place.weights)), 1e-13);
      moved += way > 0 ? 1 : 0;
      if (tries <= 0) continue;
      ++ended;
      at_edges += std::ranges::count(place.weights, 0.0) > 0 ? 1 : 0;
      ASSERT_GE(ground.least_around(place.position, goal), length(place.position - goal) * (1 - 1e-9)) << k;
    }
    EXPECT_GT(ended, 1700);
    EXPECT_GT(moved, 1500);
    EXPECT_GT(at_edges, 500);
  }
}

TEST(Walk, GoesOverTheSurfaceOnlyAndComesNearerAllTheWay) {
  for (const SnapshotPtr& model : rough_models()) {
    Ground ground(model);
    for (int k = 0; k < 100; ++k) {
      SurfacePlace place = ground.next(k);
      const Vec3d goal = ground.goal(place);
      const double step = 0.03 * Ground::side(place);
      int steps = 0;
      for (; steps < 2000; ++steps) {
        const Vec3d before = place.position;
        int tries = detail::kTries;
        const double went = detail::walk(ground.surface, place, goal, step, tries);
        ASSERT_LE(went, step * (1 + 1e-12));
        ASSERT_LE(length(place.position - before), went + 1e-13);
        if (went == 0) break;
        ASSERT_LT(length(place.position - goal), length(before - goal)) << k << " " << steps;
        // So short a way cannot lead through the air from one triangle to another: what is between is on the surface.
        const Vec3d middle = (place.position + before) * 0.5;
        ASSERT_TRUE(ground.triangles.nearest_within(middle, 0.6 * step)) << k << " " << steps;
        ASSERT_TRUE(ground.triangles.nearest_within(place.position, 1e-12)) << k << " " << steps;
      }
      ASSERT_LT(steps, 2000) << k;
    }
  }
}

TEST(Walk, IsStraightWhereTheSurfaceIsFlat) {
  // Grids of several n, some of them cut: the way leads over their triangles and seams as if there were none.
  for (const SnapshotPtr& model : {displaced(plane_shell(3, 5), [](Vec3d) { return 0.5; }),
                                   displaced(mixed_shell(*plane_shell(3, 8), 3, 3), [](Vec3d) { return 0.5; })}) {
    Ground ground(model);
    int far = 0;
    for (int k = 0; k < 1000; ++k) {
      const SurfacePlace from = ground.next(k);
      const SurfacePlace over = ground.next(k + 1);
      const Vec3d goal = over.position - Vec3d{0, 0.3 * ground.unit(), 0}, way = over.position - from.position;
      SurfacePlace place = from;
      int tries = 10 * detail::kTries;
      ASSERT_NEAR(detail::walk(ground.surface, place, goal, kAnywhere, tries), length(way), 1e-8) << k;
      ASSERT_LT(length(place.position - over.position), 1e-8) << k;
      const double share = ground.unit();
      place = from;
      tries = 10 * detail::kTries;
      detail::walk(ground.surface, place, goal, share * length(way), tries);
      ASSERT_LT(length(place.position - (from.position + way * share)), 1e-8) << k;
      far += length(way) > 5 * Ground::side(from) ? 1 : 0;
    }
    EXPECT_GT(far, 300);
  }
}

TEST(Walk, OnAnEdgeItEndsInTheSameTriangleFromEitherSide) {
  for (const SnapshotPtr& model : rough_models()) {
    Ground ground(model);
    int edges = 0;
    for (int k = 0; k < 3000; ++k) {
      SurfacePlace place = ground.next(k);
      const Vec3d goal = ground.goal(place);
      int tries = 100'000;
      detail::walk(ground.surface, place, goal, kAnywhere, tries);
      if (std::ranges::count(place.weights, 0.0) != 1) continue;
      const auto opposite = static_cast<std::size_t>(std::ranges::find(place.weights, 0.0) - place.weights.begin());
      SurfacePlace other = place;
      other.triangle = ground.surface.across(place.triangle, opposite);
      if (other.triangle.slab == kNoSlab) continue;
      ++edges;
      const auto& [a, b, c] = other.triangle.positions;
      other.weights = nearest_in_triangle(place.position, a, b, c);
      other.position = other.triangle.point(other.weights);
      EXPECT_LT(detail::walk(ground.surface, other, goal, kAnywhere, tries), 1e-12) << k;
      EXPECT_EQ(other.triangle.slab, place.triangle.slab) << k;
      EXPECT_LT(length(other.triangle.area() - place.triangle.area()), 1e-12) << k;
    }
    EXPECT_GT(edges, 300);
  }
}

TEST(Walk, LooksAtNoMoreTrianglesThanItMay) {
  Ground ground(displaced(torus_shell(12, 8, 64), rough));
  int cut = 0;
  for (int k = 0; k < 500; ++k) {
    SurfacePlace place = ground.next(k);
    const Vec3d goal = place.position + ground.anywhere() * 0.5;
    SurfacePlace cut_short = place;
    int tries = detail::kTries;
    detail::walk(ground.surface, cut_short, goal, kAnywhere, tries);
    ASSERT_GT(tries, -12) << "of the last ring";
    if (tries > 0) continue;
    ++cut;
    // It goes on from there as one that had more time.
    int more = 100'000, many = 100'000;
    detail::walk(ground.surface, cut_short, goal, kAnywhere, more);
    detail::walk(ground.surface, place, goal, kAnywhere, many);
    ASSERT_GT(std::min(more, many), 0);
    EXPECT_NEAR(length(cut_short.position - goal), length(place.position - goal), 1e-9);
  }
  EXPECT_GT(cut, 200);
}

TEST(Descent, GetsNearerOrStaysAndEndsAtAMinimum) {
  for (const SnapshotPtr& model : rough_models()) {
    Ground ground(model);
    int ended = 0;
    for (int k = 0; k < 2000; ++k) {
      const SurfacePlace place = ground.next(k);
      const Vec3d goal = ground.goal(place);
      const detail::Descent descent = detail::descend(ground.surface, place, goal);
      const double rest = length(descent.rest.position - goal);
      ASSERT_LE(rest, length(place.position - goal)) << k;
      ASSERT_EQ(descent.way == 0, descent.rest.position == place.position) << k;
      if (!descent.ended) continue;
      ++ended;
      ASSERT_GE(ground.least_around(descent.rest.position, goal), rest * (1 - 1e-9)) << k;
      // From its end nothing leads on.
      ASSERT_EQ(detail::descend(ground.surface, descent.rest, goal).way, 0) << k;
    }
    EXPECT_GT(ended, 1600);
  }
}

TEST(Descent, FollowedInShortStepsItComesAsFar) {
  for (const SnapshotPtr& model : rough_models()) {
    Ground ground(model);
    int same = 0, all = 0;
    for (int k = 0; k < 300; ++k) {
      SurfacePlace place = ground.next(k);
      const Vec3d goal = ground.goal(place);
      const double step = 0.07 * Ground::side(place);
      const detail::Descent whole = detail::descend(ground.surface, place, goal);
      if (!whole.ended) continue;
      int steps = 0;
      for (; steps < 1000; ++steps) {
        const detail::Descent descent = detail::descend(ground.surface, place, goal);
        if (descent.ended && descent.way == 0) break;
        const Vec3d before = place.position;
        detail::follow(ground.surface, place, descent, goal, step);
        ASSERT_LE(length(place.position - before), step * (1 + 1e-12));
        ASSERT_LT(length(place.position - goal), length(before - goal)) << k << " " << steps;
      }
      ASSERT_LT(steps, 1000) << k;
      ++all;
      // On rough ground a short step may lead into another valley.
      same += length(place.position - whole.rest.position) < 1e-9 ? 1 : 0;
    }
    EXPECT_GT(all, 200);
    EXPECT_GT(same, all * 8 / 10);
  }
}

TEST(AboveAndBelow, AreAHairOffOnTheFibre) {
  Ground ground(displaced(torus_shell(12, 8, 13), rough));
  for (int k = 0; k < 300; ++k) {
    const SurfacePlace place = ground.next(k);
    const Vec3d up = detail::above(ground.surface, place) - place.position,
                down = detail::below(ground.surface, place) - place.position;
    const double fibre = length(ground.surface.fibre(place));
    EXPECT_LT(length(up + down), 1e-3 * length(up));
    EXPECT_NEAR(length(up), 1e-7 * fibre, 1e-9 * fibre);
    EXPECT_GT(dot(up, place.triangle.area()), 0);
  }
}

TEST(LeadsIntoAir, AsAStepThereDoes) {
  for (const SnapshotPtr& model : rough_models()) {
    Ground ground(model);
    std::array<int, 3> into_air{}, into_body{};
    for (int k = 0; k < 6000; ++k) {
      const SurfacePlace place = ground.next(k);
      const double side = Ground::side(place), step = 1e-4 * side;
      const Vec3d way = normalized(ground.anywhere());
      // Where a short step comes to, as told by the nearest bare triangle.
      const Vec3d there = place.position + way * step;
      const auto nearest = ground.triangles.nearest_within(there, 2 * step);
      ASSERT_TRUE(nearest);
      const Vec3d off = there - nearest->position;
      if (ground.on_rim(place.position)) continue;  // see below
      const double height = dot(ground.triangles.pseudo_normal(*nearest), off) / step;
      if (std::abs(height) < 0.02) continue;  // along the surface
      const bool air = height > 0;
      ++(air ? into_air : into_body)[static_cast<std::size_t>(k % 3)];
      ASSERT_EQ(detail::leads_into_air(ground.surface, place, place.position + way * side), air)
          << k << " " << height << " " << std::ranges::count(place.weights, 0.0);
    }
    for (std::size_t kind = 0; kind < 3; ++kind) {
      EXPECT_GT(into_air[kind], 500);
      EXPECT_GT(into_body[kind], 500);
    }
  }
}

TEST(LeadsIntoAir, PastAnOpenEdgeItDoes) {
  const SnapshotPtr model = displaced(plane_shell(4, 8), [](Vec3d) { return 0.5; });
  MicroTriangles surface(*model);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> unit(-1, 1);
  LocateHint hint;
  for (int k = 0; k < 500; ++k) {
    const auto at = locate(model->slab_mesh(), {1, 0, k % 5 == 0 ? 0.5 : 0.5 + 0.4 * unit(random)}, hint);
    ASSERT_TRUE(at);
    SurfacePlace place = *surface.place_at(at->slab, at->u, at->v);
    for (std::size_t c = 0; c < 3; ++c)  // right on the edge, not within rounding of it
      if (place.weights[c] < 1e-9) place.weights[c] = 0;
    place.position = place.triangle.point(place.weights);
    const Vec3d way = {unit(random), unit(random), unit(random)};
    if (std::abs(way.x) < 1e-3 || std::abs(way.y) < 1e-3) continue;
    EXPECT_EQ(detail::leads_into_air(surface, place, place.position + way), way.y > 0 || way.x > 0)
        << way.x << " " << way.y;
  }
}

}  // namespace
}  // namespace relief
