#include "support/shells.h"

#include <relief/core/query.h>

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace relief {
namespace {

using testing::displaced;
using testing::plane_shell;
using testing::sphere_shell;
using testing::torus_shell;

/// A random place well spread over a slab, edges and corners included now and then.
struct Places {
  std::mt19937_64 random{7};
  double unit() { return std::uniform_real_distribution<double>(0, 1)(random); }
  std::array<double, 3> weights() {
    const double a = unit(), b = unit();
    const double u = 1 - std::sqrt(a), v = b * std::sqrt(a);
    return {1 - u - v, u, v};
  }
  SlabId slab(const SlabMesh& mesh) { return static_cast<SlabId>(random() % mesh.slab_count()); }
};

std::vector<std::shared_ptr<const SlabMesh>> shells() {
  return {sphere_shell(2, 8), torus_shell(14, 9, 8, 0.3), plane_shell(6, 8),
          sphere_shell(2, 8, 0.8e-3, 1.2e-3, {1e3, -2e3, 5e2}), sphere_shell(2, 8, 0.8e6, 1.2e6, {1e7, 0, 0})};
}

TEST(Locate, FindsTheSlabAndPlaceOfPointsInside) {
  for (const auto& mesh : shells()) {
    Places places;
    LocateHint hint;
    for (int k = 0; k < 20000; ++k) {
      const SlabId slab = places.slab(*mesh);
      const auto w = places.weights();
      const double alpha = places.unit();
      const Vec3d p = mesh->corners(slab).point(w, alpha);
      if (std::min({w[0], w[1], w[2]}) < 1e-4) continue;
      const auto at = locate(*mesh, p, hint);
      ASSERT_TRUE(at);
      ASSERT_EQ(at->slab, slab);
      EXPECT_NEAR(at->u, w[1], 1e-7);
      EXPECT_NEAR(at->v, w[2], 1e-7);
      EXPECT_NEAR(at->alpha, alpha, 1e-7);
      const Vec3d back = mesh->corners(slab).point({1 - at->u - at->v, at->u, at->v}, at->alpha);
      EXPECT_LT(length(back - p), 1e-9 * diagonal(mesh->box(slab)));
      LocateHint none;
      EXPECT_EQ(locate(*mesh, p, none)->slab, slab);
    }
  }
}

TEST(Locate, PointsOutsideAllSlabsAreOutside) {
  const auto mesh = sphere_shell(3, 8);
  LocateHint hint;
  for (const Vec3d p : {Vec3d{0, 0, 0}, Vec3d{0.5, 0.1, 0.2}, Vec3d{1.3, 0, 0}, Vec3d{1e300, 0, 0}, Vec3d{NAN, 0, 0},
                        Vec3d{INFINITY, 0, 0}})
    EXPECT_FALSE(locate(*mesh, p, hint));
}

// Points exactly on shared walls and fibres, as far as doubles go: one owner, the same one from every hint.
TEST(Locate, AWallPointBelongsToExactlyOneSlab) {
  for (const auto& mesh : {sphere_shell(2, 8), torus_shell(14, 9, 8, 0.3)}) {
    Places places;
    for (int k = 0; k < 20000; ++k) {
      const SlabId slab = places.slab(*mesh);
      const auto edge = static_cast<std::size_t>(places.random() % 3);
      const double s = k % 10 == 0 ? 0.0 : k % 10 == 1 ? places.unit() * 1e-6 : places.unit();
      const double alpha = 0.05 + 0.9 * places.unit();
      std::array<double, 3> w{};
      w[(edge + 1) % 3] = 1 - s;
      w[(edge + 2) % 3] = s;
      Vec3d p = mesh->corners(slab).point(w, alpha);
      if (k % 3 == 0) p += Vec3d{places.unit() - 0.5, places.unit() - 0.5, places.unit() - 0.5} * 1e-12;
      const SlabId other = mesh->slabs()[slab].neighbours[edge];
      const auto& fibres = mesh->slabs()[slab].fibres;
      const FibreId a = fibres[(edge + 1) % 3], b = fibres[(edge + 2) % 3];
      EXPECT_NE(wall_side(*mesh, a, b, p), wall_side(*mesh, b, a, p));
      if (s > 1e-4 && s < 1 - 1e-4) {
        EXPECT_NE(owns(*mesh, slab, p), owns(*mesh, other, p)) << "both or neither of two slabs own the point";
      }
      LocateHint none;
      const auto owner = locate(*mesh, p, none);
      ASSERT_TRUE(owner);
      for (const SlabId start : {slab, other}) {
        LocateHint hint{{start, 1.0 / 3, 1.0 / 3, 0.5}};
        const auto again = locate(*mesh, p, hint);
        ASSERT_TRUE(again);
        EXPECT_EQ(again->slab, owner->slab) << "the owner depends on the hint";
      }
    }
  }
}

TEST(Locate, BeyondAnOpenRimIsOutside) {
  const auto mesh = plane_shell(2, 4);
  LocateHint hint;
  EXPECT_TRUE(locate(*mesh, {1e-9, 0, 0.3}, hint));
  EXPECT_FALSE(locate(*mesh, {-1e-9, 0, 0.3}, hint));
}

TEST(Samples, SharedSamplesHaveOnePositionAndOneNormal) {
  for (const auto& mesh : {sphere_shell(2, 6), torus_shell(14, 9, 15, 0.3), plane_shell(3, 7)}) {
    const SnapshotPtr model = displaced(mesh, [](Vec3d p) { return 0.5 + 0.2 * std::sin(9 * p.x + 5 * p.y * p.z); });
    ASSERT_TRUE(validate(*model)) << validate(*model).error().message;
    for (SlabId s = 0; s < mesh->slab_count(); ++s)
      for (int edge = 0; edge < 3; ++edge)
        for (int t = 0; t < mesh->intervals(s); ++t) {
          const int n = mesh->intervals(s);
          const GridPoint at = edge_point(n, edge, t);
          mesh->for_each_copy(s, n, at, [&](const SampleCopy& copy) {
            EXPECT_EQ(sample_position(*model, copy.slab, copy.at), sample_position(*model, s, at));
            EXPECT_EQ(sample_normal(*model, copy.slab, copy.at), sample_normal(*model, s, at));
          });
        }
  }
}

TEST(Samples, NormalsOfASphereAreRadial) {
  const auto mesh = sphere_shell(4, 16);
  // The radius 1 is where 0.8 + 0.4 alpha, scaled by the chord's length, reaches it.
  SnapshotDraft draft(Snapshot::make(mesh));
  for (SlabId s = 0; s < mesh->slab_count(); ++s)
    for (int j = 0; j <= 16; ++j)
      for (int i = 0; i + j <= 16; ++i) {
        const double in = length(sample_position(*mesh, s, 16, {i, j}, 0));
        const double out = length(sample_position(*mesh, s, 16, {i, j}, 1));
        draft.edit(Layer::Displacement, s).plane()[sample_index(16, {i, j})] =
            static_cast<float>((1 - in) / (out - in));
      }
  const SnapshotPtr model = draft.finish();
  double worst = 0;
  for (SlabId s = 0; s < mesh->slab_count(); s += 7)
    for (int j = 0; j <= 16; ++j)
      for (int i = 0; i + j <= 16; ++i) {
        const Vec3d p = sample_position(*model, s, {i, j});
        ASSERT_NEAR(length(p), 1, 1e-7);
        worst = std::max(worst, length(cross(sample_normal(*model, s, {i, j}), normalized(p))));
      }
  EXPECT_LT(worst, 2e-3);
}

TEST(SurfacePoint, NormalIsContinuousAcrossSlabEdges) {
  const auto mesh = torus_shell(14, 9, 8, 0.3);
  const SnapshotPtr model = displaced(mesh, [](Vec3d p) { return 0.5 + 0.2 * std::sin(7 * p.x) * std::cos(6 * p.z); });
  for (SlabId s = 0; s < mesh->slab_count(); ++s)
    for (int edge = 0; edge < 3; ++edge)
      for (double t = 0.03; t < 1; t += 0.07) {
        const auto k = static_cast<std::size_t>(edge);
        const SlabId other = mesh->slabs()[s].neighbours[k];
        const auto m = static_cast<std::size_t>(mesh->mirror_edge(s, edge));
        std::array<double, 3> here{}, there{};
        here[(k + 1) % 3] = 1 - t;
        here[(k + 2) % 3] = t;
        there[(m + 1) % 3] = t;
        there[(m + 2) % 3] = 1 - t;
        const SurfacePoint a = surface_point(*model, s, here[1], here[2]);
        const SurfacePoint b = surface_point(*model, other, there[1], there[2]);
        EXPECT_LT(length(a.position - b.position), 1e-12);
        EXPECT_LT(length(a.normal - b.normal), 1e-12);
      }
}

TEST(Probe, DepthIsTheDistanceAlongTheFibre) {
  const SnapshotPtr model = displaced(plane_shell(4, 8, 0.25), [](Vec3d) { return 0.75; });  // the plane y = 0.125
  LocateHint hint;
  const auto above = probe(*model, {0.4, 0.2, 0.3}, hint);
  ASSERT_TRUE(above);
  EXPECT_FALSE(above->touching());
  const auto below = probe(*model, {0.4, 0.1, 0.3}, hint);
  ASSERT_TRUE(below);
  EXPECT_TRUE(below->touching());
  EXPECT_NEAR(below->depth, 0.025, 1e-12);
  EXPECT_LT(length(below->surface.position - Vec3d{0.4, 0.125, 0.3}), 1e-12);
  EXPECT_LT(length(below->surface.normal - Vec3d{0, 1, 0}), 1e-12);
  EXPECT_FALSE(probe(*model, {0.4, 0.3, 0.3}, hint));
}

TEST(ClosestPoint, AgreesWithTryingEverySample) {
  const auto mesh = torus_shell(14, 9, 12, 0.3);
  const SnapshotPtr model = displaced(mesh, [](Vec3d p) { return 0.5 + 0.2 * std::sin(7 * p.x) * std::cos(6 * p.z); });
  Places places;
  for (int k = 0; k < 200; ++k) {
    const Vec3d p = {places.unit() * 6 - 3, places.unit() * 3 - 1.5, places.unit() * 6 - 3};
    const SurfacePoint near = closest_point(*model, p);
    double nearest_sample = 1e30;
    for (SlabId s = 0; s < mesh->slab_count(); ++s)
      for (int j = 0; j <= 12; ++j)
        for (int i = 0; i + j <= 12; ++i)
          nearest_sample = std::min(nearest_sample, length(sample_position(*model, s, {i, j}) - p));
    const double distance = length(near.position - p);
    EXPECT_LE(distance, nearest_sample + 1e-12);
    EXPECT_GT(distance, nearest_sample - 0.15) << "micro-edges are shorter than that";
    // The place it names is on the surface there.
    const SurfacePoint there = surface_point(*model, near.slab, near.u, near.v);
    EXPECT_LT(length(there.position - near.position), 5e-3);
  }
}

TEST(Raycast, HitsTheSphereWhereItMust) {
  const SnapshotPtr model = displaced(sphere_shell(3, 8), [](Vec3d) { return 0.5; });
  Places places;
  for (int k = 0; k < 500; ++k) {
    const Vec3d direction = normalized(Vec3d{places.unit() - 0.5, places.unit() - 0.5, places.unit() - 0.5});
    const auto hit = raycast(*model, {direction * 5.0, direction * -2.0});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(length(hit->point.position), 1, 0.02);
    EXPECT_NEAR(hit->distance * 2, 5 - length(hit->point.position), 1e-9);
    EXPECT_GT(dot(hit->point.normal, direction), 0.95);
    EXPECT_FALSE(raycast(*model, {direction * 5.0, direction}));
  }
}

TEST(Layers, ColourInterpolatesOnItsOwnGrid) {
  SnapshotDraft draft(Snapshot::make(plane_shell(1, 4)));
  draft.add_layer(Layer::Colour, 2, 0);
  draft.edit(Layer::Colour, 0).plane(0)[sample_index(2, {1, 0})] = 1;
  draft.edit(Layer::Colour, 0).plane(2)[sample_index(2, {2, 0})] = 1;
  const SnapshotPtr model = draft.finish();
  EXPECT_NEAR(double{colour_at(*model, 0, 0.5, 0).x}, 1, 1e-6);
  EXPECT_NEAR(double{colour_at(*model, 0, 0.75, 0).x}, 0.5, 1e-6);
  EXPECT_NEAR(double{colour_at(*model, 0, 0.75, 0).z}, 0.5, 1e-6);
  EXPECT_EQ(layer_at(*model, Layer::Stiffness, 0, 0.2, 0.2, 0.625), 0.625);
}

}  // namespace
}  // namespace relief
