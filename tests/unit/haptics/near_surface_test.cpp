// The search for what is near a point, by the bounds of the tiles.
#include "support/cuts.h"
#include "support/shells.h"

#include <relief/core/sweep.h>
#include <relief/haptics/contact/neighbourhood.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

namespace relief {
namespace {

using testing::displaced;
using testing::mixed_shell;
using testing::torus_shell;
using testing::with_hole;

using Key = std::tuple<SlabId, int, int, int, int, int, int>;
Key key(SlabId slab, const std::array<GridPoint, 3>& c) {
  return {slab, c[0].i, c[0].j, c[1].i, c[1].j, c[2].i, c[2].j};
}

/// Calls visit(slab, corners, the triangle's own point nearest to p) for all micro-triangles, one after the other.
template <typename Visit>
void for_each_nearest(const Snapshot& model, Vec3d p, Visit&& visit) {
  const SlabMesh& mesh = model.slab_mesh();
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    for_each_cell(mesh.intervals(s), mesh.edge_intervals(s), [&](const std::array<GridPoint, 3>& c) {
      if (model.is_hole(s, c)) return;
      std::array<Vec3d, 3> v;
      for (std::size_t k = 0; k < 3; ++k) v[k] = sample_position(model, s, c[k]);
      const auto w = nearest_in_triangle(p, v[0], v[1], v[2]);
      visit(s, c, v[0] * w[0] + v[1] * w[1] + v[2] * w[2]);
    });
}

/// Every micro-triangle within reach, the slow way.
std::set<Key> all_near(const Snapshot& model, Vec3d p, double reach) {
  std::set<Key> found;
  for_each_nearest(model, p, [&](SlabId s, const std::array<GridPoint, 3>& c, Vec3d nearest) {
    if (length(nearest - p) < reach) found.insert(key(s, c));
  });
  return found;
}

double rough(Vec3d p) { return 0.5 + 0.2 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.1 * std::sin(31 * p.y); }

/// Coarse, stitched, stitched over many squares, and stitched with a hole.
std::vector<SnapshotPtr> rough_tori() {
  const auto plain = torus_shell(12, 8, 13);
  return {displaced(plain, rough), displaced(mixed_shell(*plain, 3, 3), rough),
          displaced(mixed_shell(*torus_shell(8, 6, 13), 4, 4), rough),
          with_hole(displaced(mixed_shell(*plain, 2, 2), rough),
                    [](Vec3d p) { return length(p - Vec3d{2, 0.8, 0}) < 0.4; })};
}

TEST(VisitNear, FindsWhatASlowSearchFindsAlsoAtStitchedEdgesAndHoles) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const SnapshotPtr& model : rough_tori()) {
    std::size_t most = 0;
    for (int k = 0; k < 60; ++k) {
      const Vec3d p = closest_point(*model, Vec3d{unit(random), unit(random), unit(random)} * 3.0).position +
                      Vec3d{unit(random), unit(random), unit(random)} * 0.2;
      const double reach = 0.02 + 0.3 * std::abs(unit(random));
      MicroTriangles surface(*model);
      std::set<Key> found;
      double reach2 = reach * reach;
      detail::visit_near(surface, p, 0, reach2, [&](const detail::NearTriangle& t) {
        EXPECT_NEAR(length(t.nearest), std::sqrt(t.distance2), 1e-12);
        EXPECT_TRUE(found.insert(key(t.slab, t.corners)).second) << "the same triangle twice";
      });
      const std::set<Key> all = all_near(*model, p, reach);
      EXPECT_EQ(found, all);
      most = std::max(most, all.size());
      EXPECT_EQ(detail::nothing_near(surface, p, reach), all.empty());
    }
    EXPECT_GT(most, 40U);
  }
}

/// Of the model's micro-triangles, the slow way.
double distance_to(const Snapshot& model, Vec3d p) {
  double least2 = 1e300;
  for_each_nearest(model, p, [&](SlabId, const std::array<GridPoint, 3>&, Vec3d nearest) {
    least2 = std::min(least2, dot(nearest - p, nearest - p));
  });
  return std::sqrt(least2);
}

/// The samples around a place moved along their fibres, as a dab does it.
SnapshotPtr dabbed(const SnapshotPtr& model, Vec3d at, double radius, double by) {
  SnapshotDraft draft(model);
  const SlabMesh& mesh = model->slab_mesh();
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const int n = mesh.intervals(s);
    bool touched = false;
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) {
        const double off = length(sample_position(*model, s, {i, j}) - at) / radius;
        if (off >= 1) continue;
        float& alpha = draft.edit(Layer::Displacement, s).plane()[sample_index(n, {i, j})];
        alpha = static_cast<float>(std::clamp(double{alpha} + by * (1 - off * off), 0.0, 1.0));
        touched = true;
      }
    if (touched) constrain(mesh, Layer::Displacement, s, draft.edit(Layer::Displacement, s));
  }
  return draft.finish();
}

/// Where the straight way from one place to another first goes in, as a share of the way; 2 where it does not.
double first_entry_of_all(const Snapshot& model, Vec3d from, Vec3d to) {
  const SlabMesh& mesh = model.slab_mesh();
  const Vec3d way = to - from;
  double first = 2;
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    for_each_cell(mesh.intervals(s), mesh.edge_intervals(s), [&](const std::array<GridPoint, 3>& c) {
      const Vec3d a = sample_position(model, s, c[0]), ab = sample_position(model, s, c[1]) - a,
                  ac = sample_position(model, s, c[2]) - a, area = cross(ab, ac);
      const double speed = dot(area, way);
      if (!(speed < 0)) return;
      const double t = dot(area, a - from) / speed;
      const Vec3d at = from + way * t - a;
      const double area2 = dot(area, area), v = dot(area, cross(ab, at)) / area2, u = dot(area, cross(at, ac)) / area2;
      if (t >= 0 && t <= 1 && u >= 0 && v >= 0 && u + v <= 1) first = std::min(first, t);
    });
  return first;
}

/// Compares all searches with slow ones, after edits on either side of edges at which samples give way to those of a
/// coarser slab across.
void compare_after_edits(SnapshotPtr model, int edits) {
  std::mt19937 random(12);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto aside = [&] { return Vec3d{unit(random), unit(random), unit(random)}; };
  std::vector<std::pair<SlabId, int>> edges;
  for (SlabId s = 0; s < model->slab_mesh().slab_count(); ++s)
    for (int k = 0; k < 3; ++k)
      if (model->slab_mesh().edge_intervals(s)[static_cast<std::size_t>(k)] < model->slab_mesh().intervals(s))
        edges.emplace_back(s, k);
  ASSERT_GT(edges.size(), 20U);
  detail::Neighbourhood list;
  const auto patches = std::make_unique<detail::Patches>();
  PickHint hint;
  std::size_t found_in_all = 0, crossed = 0;
  for (int edit = 0; edit < edits; ++edit) {
    const auto [s, k] = edges[random() % edges.size()];
    const int n = model->slab_mesh().intervals(s);
    const GridPoint beside = edge_point(n, k, static_cast<int>(random() % static_cast<unsigned>(n + 1)));
    const Vec3d place = sample_position(*model, s, beside);
    model = dabbed(model, place + aside() * 0.1, 0.2, 0.3 * unit(random));
    MicroTriangles surface(*model);
    list.forget();
    patches->forget();
    const double least = 0.05 + 0.1 * std::abs(unit(random));
    ASSERT_TRUE(list.gather(surface, place, least, 2 * least, 0, detail::kAnyWork));
    for (int look = 0; look < 4; ++look) {
      const Vec3d p = place + aside() * (0.3 * least);
      const double truth = distance_to(*model, p), reach = std::min(0.9 * list.reach_at(p), truth + 0.5 * least);
      const std::set<Key> all = all_near(*model, p, reach);
      std::set<Key> found, listed;
      double reach2 = reach * reach;
      detail::visit_near(surface, p, 0, reach2,
                         [&](const detail::NearTriangle& t) { found.insert(key(t.slab, t.corners)); });
      EXPECT_EQ(found, all);
      list.visit_near(surface, *patches, p, reach2, detail::kAnyWork,
                      [&](const detail::NearTriangle& t) { listed.insert(key(t.slab, t.corners)); });
      EXPECT_EQ(listed, all);
      EXPECT_NEAR(length(closest_point(*model, p).position - p), truth, 1e-12);
      EXPECT_NEAR(length(closest_point(*model, p, hint).position - p), truth, 1e-12);
      SlabId nearest = s;
      EXPECT_LE(detail::clear_around(surface, p, 0, 1, nearest), truth * (1 + 1e-9));
      const Vec3d to = p + aside() * 0.3;
      const double entry = first_entry_of_all(*model, p, to);
      const auto hit = first_entry(*model, p, to);
      EXPECT_NEAR(hit ? hit->distance : 2, entry, 1e-9);
      found_in_all += all.size();
      crossed += hit ? 1 : 0;
    }
  }
  EXPECT_GT(found_in_all, 1000U);
  EXPECT_GT(crossed, 10U);
}

TEST(VisitNear, AndTheOthersFindWhatASlowSearchFindsAfterEditsBesideCoarserSlabs) {
  SnapshotPtr cut = testing::cut_at_random(displaced(torus_shell(4, 3, 16), rough), 8, 2);
  for (SlabId s = 0; s < cut->slab_mesh().slab_count(); s += 3)
    if (const auto finer = with_detail(cut, {.cuts = {}, .grids = {{Layer::Displacement, s, 32}}})) cut = *finer;
  compare_after_edits(cut, 24);
}

// Beside a slab of a sixteenth of the intervals, triangles have corners that lie in other squares than the samples that
// gave way to them: here one of them rises alone from a plane.
TEST(VisitNear, FindsTrianglesThatRiseToACornerOutsideTheirSquare) {
  const auto plain = testing::plane_shell(1, 128);
  const std::vector<Fibre> fibres = {plain->fibres().begin(), plain->fibres().end()};
  const std::vector<SlabMesh::Face> faces = {{plain->slabs()[0].fibres, 128}, {plain->slabs()[1].fibres, 8}};
  const auto mesh = std::make_shared<const SlabMesh>(*SlabMesh::make(fibres, faces));
  const Vec3d foot = {0.5, 0, 0.5};  // on the edge that both share
  const SnapshotPtr model = displaced(mesh, [&](Vec3d p) { return length(p - foot) < 1e-9 ? 0.8 : 0.3; });
  MicroTriangles surface(*model);
  const Vec3d above = foot + Vec3d{0, 0.065, 0};  // the tip lies 0.06 above the middle of the slabs
  const double reach = 0.01;
  std::set<Key> found;
  double reach2 = reach * reach;
  detail::visit_near(surface, above, 0, reach2,
                     [&](const detail::NearTriangle& t) { found.insert(key(t.slab, t.corners)); });
  EXPECT_EQ(found, all_near(*model, above, reach));
  EXPECT_GT(found.size(), 10U);
}

TEST(VisitNear, ACoarserNeighbourCostsAlongItsEdgeOnly) {
  const auto plain = testing::plane_shell(1, 32);
  const std::vector<Fibre> fibres = {plain->fibres().begin(), plain->fibres().end()};
  std::array<std::size_t, 2> visited{};
  for (const bool coarser : {false, true}) {
    std::vector<SlabMesh::Face> faces;
    for (const Slab& slab : plain->slabs()) faces.push_back({slab.fibres, coarser && faces.size() == 1 ? 16 : 32});
    const auto mesh = std::make_shared<const SlabMesh>(*SlabMesh::make(fibres, faces));
    const SnapshotPtr model = displaced(mesh, [](Vec3d) { return 0.5; });
    MicroTriangles surface(*model);
    double reach2 = 0.2 * 0.2;
    // At the corner across from the edge that the two slabs share; flat squares count as two triangles.
    detail::visit_near(surface, {0.02, 0.01, 0.98}, 1e-3, reach2,
                       [&](const detail::NearTriangle&) { ++visited[coarser ? 1 : 0]; });
  }
  EXPECT_GT(visited[0], 3U);
  EXPECT_EQ(visited[1], visited[0]);
}

TEST(ClearAround, IsNeverMoreThanTheDistanceAndSeldomLessThanHalfOfIt) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const SnapshotPtr& model : rough_tori()) {
    MicroTriangles surface(*model);
    int tight = 0, tries = 0;
    SlabId nearest = kNoSlab;
    for (int k = 0; k < 200; ++k) {
      const Vec3d foot = closest_point(*model, Vec3d{unit(random), unit(random), unit(random)} * 3.0).position;
      const Vec3d p = foot + Vec3d{unit(random), unit(random), unit(random)} * std::pow(10, -1.5 + 1.5 * unit(random));
      const double truth = distance_to(*model, p);
      for (const double reach : {1e9, 1.5 * truth, 0.5 * truth}) {
        const double clear = detail::clear_around(surface, p, 0, reach, nearest);
        // By the bounds alone it says no more than is so.
        EXPECT_LE(detail::clear_around(surface, p, 0, reach, nearest, 0), std::min(reach, truth) * (1 + 1e-9));
        ASSERT_LE(clear, std::min(reach, truth * (1 + 1e-9)));
        tight += clear > 0.49 * std::min(reach, truth) ? 1 : 0;
        ++tries;
      }
      EXPECT_LE(detail::clear_around(surface, p, truth * 1.01, 2 * truth, nearest), truth * 1.01);
      EXPECT_GT(detail::clear_around(surface, p, truth * 0.99, 2 * truth, nearest), truth * 0.99);
    }
    EXPECT_GT(tight, tries * 9 / 10);
  }
}

TEST(ClearAround, CostsLittleMoreWhereEdgesAreStitched) {
  const auto shell = torus_shell(12, 8, 64);
  const auto placed = [](const Snapshot& model) {
    std::mt19937 random(6);
    std::uniform_real_distribution<double> unit(0, 1);
    MicroTriangles surface(model);
    for (int k = 0; k < 1000; ++k) {
      auto slab = static_cast<SlabId>(unit(random) * model.slab_mesh().slab_count());
      const SurfacePoint at = surface_point(model, slab, unit(random) / 2, unit(random) / 2);
      static_cast<void>(
          detail::clear_around(surface, at.position + at.normal * (0.05 * unit(random)), 1e-3, 0.1, slab));
    }
    return surface.placed();
  };
  EXPECT_LT(placed(*displaced(mixed_shell(*shell, 16, 2), rough)), 3 * placed(*displaced(shell, rough)));
}

TEST(ClearAround, CostsLittleWhereThousandsOfSlabsAreEquallyNear) {
  for (const int levels : {3, 6}) {
    const SnapshotPtr model = displaced(testing::hollow_shell(levels, 2), [](Vec3d) { return 0.5; });
    MicroTriangles surface(*model);
    SlabId nearest = kNoSlab;
    EXPECT_LT(detail::clear_around(surface, {}, 0.95, 10, nearest, 0), 1);
    EXPECT_LT(surface.placed(), 1000) << levels;
  }
}

/// Floats round, bounds must not: what they say is never more than what is so.
TEST(Discs, AreNeverFartherThanTheirTriangles) {
  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  const auto any = [&] { return Vec3d{normal(random), normal(random), normal(random)}; };
  std::size_t tight = 0;
  for (int k = 0; k < 20'000; ++k) {
    const Vec3d middle = any(), one = any() * 0.2, other = any() * 0.2, corner = middle - (one + other) * (1.0 / 3);
    const std::array<Vec3d, 3> triangle = {corner, corner + one, corner + other};
    double radius = 0;
    for (const Vec3d p : triangle) radius = std::max(radius, length(p - middle));
    detail::Discs discs;
    discs.set_never_near(1);
    const Vec3f at = to_float(middle), up = to_float(normalized(cross(one, other)));
    discs.middle.x[0] = at.x, discs.middle.y[0] = at.y, discs.middle.z[0] = at.z;
    discs.normal.x[0] = up.x, discs.normal.y[0] = up.y, discs.normal.z[0] = up.z;
    discs.radius[0] = static_cast<float>(radius);
    // Right above a place of it, and beyond its farthest corner, no bound is left to spare.
    const Vec3d on =
        k % 2 == 0 ? middle : *std::ranges::max_element(triangle, {}, [&](Vec3d p) { return length(p - middle); });
    const Vec3d out = k % 2 == 0 ? normalized(cross(one, other)) : normalized(on - middle);
    const Vec3f place = to_float(on + out * std::pow(10, -k % 4));
    const Vec3d p = {place.x, place.y, place.z};
    const auto w = nearest_in_triangle(p, triangle[0], triangle[1], triangle[2]);
    const Vec3d nearest = triangle[0] * w[0] + triangle[1] * w[1] + triangle[2] * w[2];
    const double truth2 = dot(nearest - p, nearest - p), said2 = double{discs.least2_from(place)[0]};
    ASSERT_LE(said2, truth2) << k;
    tight += said2 > 0.99 * truth2 - 1e-4 ? 1 : 0;
  }
  EXPECT_GT(tight, 15'000U);
}

TEST(Clearances, AreNeverMoreThanWhatIsClear) {
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  const auto any = [&] { return Vec3d{normal(random), normal(random), normal(random)}; };
  for (const double far : {0.0, 1.0, 100.0})
    for (int k = 0; k < 20'000; ++k) {
      // A single place, seen from far off, that the next place comes straight up to.
      const Vec3f centre = to_float(any() * far), before = to_float(any() * std::max(1.0, far));
      const Vec3d at = {centre.x, centre.y, centre.z}, from = {before.x, before.y, before.z};
      const Vec3f now = to_float(from + (at - from) * (k % 2 == 0 ? 1 : 0.99));
      const auto clear = static_cast<float>(length(at - from) * (1 - 1e-7));
      detail::Clearances known;
      known.keep(0, before, clear, static_cast<float>(length(at - from)));
      const double truth = length(at - Vec3d{now.x, now.y, now.z});
      const detail::Four centre_far = detail::Four{} + static_cast<float>(truth);
      ASSERT_LE(double{known.least_from(now, centre_far, detail::Four{})[0]}, truth) << far << ' ' << k;
    }
}

TEST(Neighbourhood, FindsWhereItCoversWhatASearchFinds) {
  // And so fine that the list has no room for all within its longest reach.
  std::vector<SnapshotPtr> models = rough_tori();
  models.push_back(displaced(torus_shell(24, 12, 64), rough));
  // And with whole squares that are nearly flat.
  models.push_back(displaced(torus_shell(24, 12, 32), [](Vec3d p) { return p.x > 0 ? 0.5 : rough(p); }));
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto aside = [&] { return Vec3d{unit(random), unit(random), unit(random)}; };
  detail::Neighbourhood list;
  const auto patches = std::make_unique<detail::Patches>();
  std::size_t uncovered = 0, most = 0, halves = 0;
  for (const SnapshotPtr& model : models) {
    list.forget();
    patches->forget();
    std::size_t covered = 0;
    for (int k = 0; k < 200; ++k) {
      const Vec3d centre = closest_point(*model, aside() * 3.0).position + aside() * 0.1;
      // Also so large that the list has squares of several levels.
      const double least = k % 5 == 0 ? 0.3 : k % 3 == 0 ? 0.05 : 0.02 + 0.1 * std::abs(unit(random));
      const double flat = k % 2 == 0 ? 0 : 1e-3;
      MicroTriangles surface(*model);
      list.gather(surface, centre, least, 2 * least, flat, detail::kAnyWork);
      for (int look = 0; look < 10; ++look) {
        const Vec3d p = centre + aside() * least;
        const double reach = least * (0.3 + 0.7 * std::abs(unit(random)));
        if (!list.covers(p, reach)) {
          ++uncovered;
          continue;
        }
        std::set<Key> found, all;
        double reach2 = reach * reach, nearest2 = reach2;
        list.visit_near(surface, *patches, p, reach2, detail::kAnyWork, [&](const detail::NearTriangle& t) {
          EXPECT_NEAR(length(t.nearest), std::sqrt(t.distance2), 1e-12);
          EXPECT_TRUE(found.insert(key(t.slab, t.corners)).second) << "the same triangle twice";
          const auto [low, high] = std::minmax({t.corners[0].i, t.corners[1].i, t.corners[2].i});
          halves += high - low >= SampleBounds::kSide ? 1 : 0;
        });
        detail::visit_near(surface, p, flat, reach2, [&](const detail::NearTriangle& t) {
          all.insert(key(t.slab, t.corners));
          nearest2 = std::min(nearest2, t.distance2);
        });
        EXPECT_EQ(found, all);
        EXPECT_LE(list.clear_around(p, reach), std::sqrt(nearest2));
        // Lowered by what is found, it comes down to the nearest.
        list.visit_near(surface, *patches, p, reach2, detail::kAnyWork,
                        [&](const detail::NearTriangle& t) { reach2 = t.distance2; });
        EXPECT_NEAR(reach2, nearest2, 1e-12);
        // Where it may do nothing more, it says so instead of looking.
        reach2 = reach * reach;
        const bool finished =
            list.visit_near(surface, *patches, p, reach2, -1, [](const detail::NearTriangle&) { FAIL(); });
        EXPECT_TRUE(!finished || all.empty());
        most = std::max(most, all.size());
        ++covered;
      }
    }
    EXPECT_GT(covered, 50U);
  }
  EXPECT_GT(uncovered, 500U);
  EXPECT_GT(most, 100U);
  EXPECT_GT(halves, 100U);
}

/// A list gives what a search of all the surface finds within the reach; returns how much that is.
std::size_t found_as_by_search(MicroTriangles& surface, detail::Neighbourhood& list, detail::Patches& patches, Vec3d p,
                               double reach) {
  std::set<Key> found, all;
  double reach2 = reach * reach;
  list.visit_near(surface, patches, p, reach2, detail::kAnyWork,
                  [&](const detail::NearTriangle& t) { found.insert(key(t.slab, t.corners)); });
  detail::visit_near(surface, p, 0, reach2, [&](const detail::NearTriangle& t) { all.insert(key(t.slab, t.corners)); });
  EXPECT_EQ(found, all);
  return found.size();
}

/// Any height within a share of the fibre, at each sample another.
double any_height(Vec3d p, double share) {
  const double any = 4e4 * std::sin(1e4 * p.x + 3e4 * p.y + 7e4 * p.z);
  return 0.5 + share * (any - std::floor(any) - 0.5);
}

// One slab alone has several times as many squares near as there is room for: what is covered is whole all the same.
TEST(Neighbourhood, ThatIsCutShortTwiceCoversNoMoreThanAfterTheFirstTime) {
  const SnapshotPtr model = displaced(testing::plane_shell(1, 128, 0.5), [](Vec3d p) { return any_height(p, 0.15); });
  const double least = 2.0 / 128;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto patches = std::make_unique<detail::Patches>();
  MicroTriangles surface(*model);
  detail::Neighbourhood list;
  std::size_t some = 0;
  for (const double far : {2 * least, 4 * least, 8 * least, 16 * least, 40 * least})
    for (int k = 0; k < 40; ++k) {
      const Vec3d centre = {0.5 + 0.3 * unit(random), 0.06 + 0.02 * unit(random), 0.5 + 0.3 * unit(random)};
      list.forget();
      ASSERT_TRUE(list.gather(surface, centre, least, far, 0, detail::kAnyWork));
      const double reach = 0.999 * list.reach_at(centre);
      if (!(reach > 0)) continue;
      some += found_as_by_search(surface, list, *patches, centre, reach);
    }
  EXPECT_GT(some, 1000U);
}

// More squares than there is room for touch the place, the tip of a fan: it is covered, for no list has more; no other
// one is.
TEST(Neighbourhood, CoversThePlaceAroundWhichItWasMade) {
  constexpr FibreId kBlades = 200;
  std::vector<Fibre> fibres = {{{0, -0.1, 0}, {0, 0.1, 0}}};
  std::vector<SlabMesh::Face> slabs;
  for (FibreId k = 0; k < kBlades; ++k) {
    const double turn = 2 * std::numbers::pi * k / kBlades;
    const Vec3d rim = {std::cos(turn), 0, std::sin(turn)};
    fibres.push_back({rim - Vec3d{0, 0.1, 0}, rim + Vec3d{0, 0.1, 0}});
    slabs.push_back({{0, 1 + (k + 1) % kBlades, 1 + k}, 4});
  }
  const auto mesh = std::make_shared<const SlabMesh>(*SlabMesh::make(std::move(fibres), slabs));
  const SnapshotPtr model = displaced(mesh, [](Vec3d) { return 0.5; });
  const double least = 0.01;
  MicroTriangles surface(*model);
  detail::Neighbourhood list;
  for (const double height : {0.0, 1e-4, -1e-4}) {
    const Vec3d centre = {0, height, 0};
    EXPECT_FALSE(list.covers(centre, 0));
    ASSERT_TRUE(list.gather(surface, centre, least, 2 * least, 0, detail::kAnyWork));
    EXPECT_TRUE(list.covers(centre, least));
    EXPECT_EQ(list.reach_at(centre), 0) << "there is something to see";
    EXPECT_FALSE(list.covers(centre + Vec3d{1e-9, 0, 0}, 1e-9));
    list.forget();
    EXPECT_FALSE(list.covers(centre, 0));
  }
}

// For which there is no time in one call, of a hand that moves on meanwhile.
TEST(Neighbourhood, MadeALittleAtATimeItIsWholeInTheEnd) {
  // The second is so fine that the list is cut short on the way.
  for (const SnapshotPtr& model :
       {displaced(torus_shell(48, 24, 16), rough), displaced(torus_shell(24, 12, 64), rough)}) {
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    const auto any = [&] { return Vec3d{normal(random), normal(random), normal(random)}; };
    detail::Neighbourhood list;
    const auto patches = std::make_unique<detail::Patches>();
    std::size_t parts = 0, found_in_all = 0;
    for (int k = 0; k < 60; ++k) {
      const double least = k % 3 == 0 ? 0.2 : 0.05;
      Vec3d p = closest_point(*model, any() * 3.0).position + any() * (0.3 * least);
      MicroTriangles surface(*model);
      constexpr int kTime = 20, kOneSlab = 400;
      for (bool whole = false; !whole; ++parts) {
        p += any() * (1e-5 * least);
        const int before = surface.placed();
        whole = list.gather(surface, p, least, 2 * least, 0, before + kTime);
        ASSERT_LE(surface.placed() - before, kTime + kOneSlab);
        ASSERT_TRUE(whole || !list.covers(p, 0.1 * least));
      }
      const double reach = 0.9 * least;
      if (!list.covers(p, reach)) continue;  // there is no room
      found_in_all += found_as_by_search(surface, list, *patches, p, reach);
      // What is forgotten is not gone on with.
      static_cast<void>(list.gather(surface, any() * 3.0, least, 2 * least, 0, surface.placed() + kTime));
      list.forget();
    }
    EXPECT_GT(parts, 180U) << "of 60 lists";
    EXPECT_GT(found_in_all, 1000U);
  }
}

// The unit is a sample that is placed: a square that is looked into is as long as three, and each of its triangles as
// one.
TEST(Neighbourhood, CountsWhatALookTakes) {
  const SnapshotPtr model = displaced(testing::plane_shell(1, 4), [](Vec3d p) { return 0.5 + 0.1 * p.x; });
  MicroTriangles surface(*model);
  detail::Neighbourhood list;
  const auto patches = std::make_unique<detail::Patches>();
  const Vec3d p = {0.3, 0.07, 0.3};
  const double reach = 5;  // all of both slabs, each of one square with 16 triangles
  list.gather(surface, p, reach, 2 * reach, 0, detail::kAnyWork);
  int found = 0;
  std::array<int, 2> placed{};
  for (int& look : placed) {
    const int before = surface.placed();
    double reach2 = reach * reach;
    found = 0;
    list.visit_near(surface, *patches, p, reach2, detail::kAnyWork, [&](const detail::NearTriangle&) { ++found; });
    look = surface.placed() - before;
  }
  EXPECT_EQ(found, 32);
  EXPECT_EQ(placed[1], 2 * 3 + 32);
  EXPECT_EQ(placed[0] - placed[1], 2 * (8 + 12 + 24));

  // Eight squares that are passed over are as one.
  const SnapshotPtr many = displaced(testing::plane_shell(8, 4), [](Vec3d at) { return 0.5 + 0.1 * at.x; });
  MicroTriangles of_many(*many);
  list.gather(of_many, p, reach, 2 * reach, 0, detail::kAnyWork);
  const int before = of_many.placed();
  double reach2 = 1e-12;
  list.visit_near(of_many, *patches, p + Vec3d{0, 1, 0}, reach2, detail::kAnyWork, [](const detail::NearTriangle&) {});
  EXPECT_EQ(of_many.placed() - before, 128 / 8);
}

// Also triangles that are many times as large as the distance that is asked about: of eight times as large ones only
// those that may be near are looked at.
TEST(Neighbourhood, FindsTrianglesFarLargerThanItsReach) {
  const SnapshotPtr model =
      displaced(testing::plane_shell(2, 4), [](Vec3d p) { return 0.5 + 0.1 * std::sin(5 * p.x) * std::cos(7 * p.z); });
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  constexpr int kLooks = 5000;
  for (const double least : {1e-5, 4e-3, 1e-2}) {
    detail::Neighbourhood list;
    const auto patches = std::make_unique<detail::Patches>();
    MicroTriangles surface(*model);
    int placed = 0;
    for (int k = 0; k < kLooks; ++k) {
      const auto slab = static_cast<SlabId>(unit(random) * model->slab_mesh().slab_count());
      const double u = unit(random);
      const SurfacePoint on = surface_point(*model, slab, u, (1 - u) * unit(random));
      const Vec3d p = on.position + on.normal * (least * (1 - 1e-4 * unit(random)));
      list.gather(surface, p, least, 2 * least, 0, detail::kAnyWork);
      ASSERT_TRUE(list.covers(p, least));
      std::size_t found = 0, all = 0;
      double reach2 = least * least;
      const int before = surface.placed();
      list.visit_near(surface, *patches, p, reach2, detail::kAnyWork, [&](const detail::NearTriangle&) { ++found; });
      placed += surface.placed() - before;
      detail::visit_near(surface, p, 0, reach2, [&](const detail::NearTriangle&) { ++all; });
      ASSERT_EQ(found, all) << k;
    }
    if (least > 5e-3) {
      EXPECT_LT(placed, 15 * kLooks);
    }
  }
}

// Beside waves, just out of reach: what was found a little farther off than asked need not be found again.
TEST(Neighbourhood, LooksIntoFewSquaresAgain) {
  const SnapshotPtr model = displaced(testing::plane_shell(4, 64),
                                      [](Vec3d p) { return 0.5 + 0.02 * std::sin(40 * p.x) * std::cos(30 * p.z); });
  const double least = 0.05;
  detail::Neighbourhood list;
  const auto patches = std::make_unique<detail::Patches>();
  MicroTriangles surface(*model);
  const SurfacePoint at = closest_point(*model, {0.3, 0, 0.3});
  int placed = 0;
  constexpr int kLooks = 400;
  for (int k = 0; k < kLooks; ++k) {
    const Vec3d p = at.position + at.normal * (0.99 * least) + Vec3d{0.7, 0, 0.5} * (0.01 * least * (k + 1));
    if (!list.covers(p, least)) list.gather(surface, p, least, 2 * least, 0, detail::kAnyWork);
    const int before = surface.placed();
    double reach2 = least * least;
    list.visit_near(surface, *patches, p, reach2, detail::kAnyWork, [](const detail::NearTriangle&) {});
    placed += surface.placed() - before;
  }
  EXPECT_LT(placed, 8 * kLooks);
}

// What is kept of a look is right at the places that follow, near and far, in a list and in those after it.
TEST(Neighbourhood, KnowsOnAWalkWhatIsNear) {
  const SnapshotPtr model = displaced(torus_shell(24, 12, 128), [](Vec3d p) {
    return rough(p) + 0.02 * std::sin(400 * p.x) * std::cos(300 * p.y + 200 * p.z);
  });
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto any = [&] { return Vec3d{normal(random), normal(random), normal(random)}; };
  const auto list = std::make_unique<detail::Neighbourhood>();
  const auto patches = std::make_unique<detail::Patches>();
  MicroTriangles surface(*model);
  std::size_t looks = 0, some = 0;
  for (const double least : {0.03, 0.1, 0.3})
    for (int walk = 0; walk < 8; ++walk) {
      const SurfacePoint at = closest_point(*model, any() * 3.0);
      Vec3d p = at.position + at.normal * (1.1 * least);
      for (int k = 0; k < 60; ++k) {
        p += any() * ((k % 10 == 0 ? 0.2 : 0.01) * least) - at.normal * (0.004 * least);
        if (!list->covers(p, least)) list->gather(surface, p, least, 2 * least, 0, detail::kAnyWork);
        if (!list->covers(p, least)) continue;
        std::set<Key> found, all;
        double reach2 = least * least;
        EXPECT_TRUE(list->visit_near(surface, *patches, p, reach2, detail::kAnyWork,
                                     [&](const detail::NearTriangle& t) { found.insert(key(t.slab, t.corners)); }));
        detail::visit_near(surface, p, 0, reach2,
                           [&](const detail::NearTriangle& t) { all.insert(key(t.slab, t.corners)); });
        ASSERT_EQ(found.size(), all.size()) << least << ' ' << walk << ' ' << k;
        EXPECT_EQ(found, all);
        ++looks;
        some += all.empty() ? 0 : 1;
      }
    }
  EXPECT_GT(looks, 1000U);
  EXPECT_GT(some, 300U);
  EXPECT_LT(some, looks);
}

// The patch of a square with a cliff is made where the ball is at one end, and asked where it is at the other.
TEST(Neighbourhood, KnowsBothEndsOfACliff) {
  constexpr int kCells = 128;
  const std::vector<Fibre> fibres = [] {
    // Leaning to all axes, so that no coordinate is round.
    const Vec3d x = normalized(Vec3d{0.8, 0.5, 0.3}), y = normalized(cross(Vec3d{0.2, -0.4, 0.9}, x)), z = cross(x, y);
    std::vector<Fibre> made;
    for (const Vec3d corner : {Vec3d{}, x * 0.02, z * 0.02}) made.push_back({corner, corner + y});
    return made;
  }();
  const SlabMesh::Face face{{0, 2, 1}, kCells};
  const auto mesh = std::make_shared<const SlabMesh>(*SlabMesh::make(fibres, std::span(&face, 1)));
  const Vec3d along = fibres[1].inner / 0.02, out = fibres[0].direction(), aside = fibres[2].inner / 0.02;
  const double cell = 0.02 / kCells, radius = cell, reach = 1.001 * radius;
  const SnapshotPtr model = displaced(mesh, [&](Vec3d p) { return dot(p, along) > 0.51 * 0.02 ? 0.98 : 0.02; });
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  MicroTriangles surface(*model);
  detail::Neighbourhood list;
  const auto patches = std::make_unique<detail::Patches>();
  std::size_t looks = 0;
  for (int k = 0; k < 1000; ++k) {
    patches->forget();
    const double z = (4 * (4 + k % 7) + 0.2 + 3.3 * unit(random)) * cell;
    for (const bool foot : {false, true}) {
      const double x = (foot ? 64 + unit(random) : 66.5 + unit(random)) * cell;
      const double y = (foot ? 0.02 : 0.98) + radius * (foot ? 1.0005 + 5e-4 * unit(random) : 0.95);
      const Vec3d p = along * x + out * y + aside * z;
      list.gather(surface, p, reach, 2 * reach, 0, detail::kAnyWork);
      if (!list.covers(p, reach)) continue;
      found_as_by_search(surface, list, *patches, p, reach);
      ++looks;
    }
  }
  EXPECT_GT(looks, 1500U);
}

}  // namespace
}  // namespace relief
