// Sections 2 and 3: slabs, finding the cursor, the surface, penetration, the response force.
#include "paper/paper_algorithm.h"
#include "support/shells.h"

#include <relief/core/query.h>
#include <relief/haptics/servo.h>

#include <gtest/gtest.h>

#include <random>

namespace relief {
namespace {

using testing::displaced;
using testing::plane_shell;
using testing::sphere_shell;
using testing::torus_shell;

class Paper : public ::testing::Test {
 protected:
  double unit() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  Vec3d place(const SlabMesh& mesh, SlabId& slab, std::array<double, 3>& w, double& alpha) {
    slab = static_cast<SlabId>(random_() % mesh.slab_count());
    const double a = std::sqrt(unit()), b = unit();
    w = {1 - a, a * (1 - b), a * b};
    alpha = unit();
    return mesh.corners(slab).point(w, alpha);
  }
  std::mt19937_64 random_{2002};
  std::shared_ptr<const SlabMesh> mesh_ = torus_shell(16, 10, 15, 0.3);
  SnapshotPtr model_ =
      displaced(mesh_, [](Vec3d p) { return 0.5 + 0.25 * std::sin(5 * p.x) * std::cos(4 * p.z + 3 * p.y); });
};

TEST_F(Paper, Sec2_WallsAreBilinearPatchesSharedByBothSlabs) {
  for (SlabId s = 0; s < mesh_->slab_count(); ++s)
    for (std::size_t k = 0; k < 3; ++k) {
      const SlabId other = mesh_->slabs()[s].neighbours[k];
      const Fibre &a = mesh_->fibres()[mesh_->slabs()[s].fibres[(k + 1) % 3]],
                  &b = mesh_->fibres()[mesh_->slabs()[s].fibres[(k + 2) % 3]];
      const auto m = static_cast<std::size_t>(mesh_->mirror_edge(s, static_cast<int>(k)));
      for (const double t : {0.0, 0.25, 0.6, 1.0})
        for (const double alpha : {0.0, 0.3, 1.0}) {
          const Vec3d patch = (a.inner + a.direction() * alpha) * (1 - t) + (b.inner + b.direction() * alpha) * t;
          std::array<double, 3> here{}, there{};
          here[(k + 1) % 3] = there[(m + 2) % 3] = 1 - t;
          here[(k + 2) % 3] = there[(m + 1) % 3] = t;
          EXPECT_LT(length(mesh_->corners(s).point(here, alpha) - patch), 1e-14);
          EXPECT_EQ(mesh_->corners(s).point(here, alpha), mesh_->corners(other).point(there, alpha));
        }
    }
}

TEST_F(Paper, Sec2_EachDisplacementAlongAnEdgeIsDuplicatedInTheAdjacentSlab) {
  EXPECT_TRUE(validate(*model_));
  const SlabId other = mesh_->slabs()[0].neighbours[0];
  const int mirror = mesh_->mirror_edge(0, 0);
  for (int t = 0; t <= 15; ++t)
    EXPECT_EQ(model_->displacement(0)[sample_index(15, edge_point(15, 0, t))],
              model_->displacement(other)[sample_index(15, edge_point(15, mirror, 15 - t))]);
}

TEST_F(Paper, Sec3_1_TheBoxEnclosesTheSlab) {
  for (int k = 0; k < 5000; ++k) {
    SlabId s = 0;
    std::array<double, 3> w{};
    double alpha = 0;
    const Vec3d p = place(*mesh_, s, w, alpha);
    EXPECT_LT(std::sqrt(mesh_->box(s).distance2(p)), 1e-14);
  }
}

TEST_F(Paper, Sec3_1_TheCubicVanishesOnItsAlphaPlane) {
  for (int k = 0; k < 2000; ++k) {
    SlabId s = 0;
    std::array<double, 3> w{};
    double alpha = 0;
    const Vec3d p = place(*mesh_, s, w, alpha);
    const auto c = paper::coefficients(mesh_->corners(s));
    EXPECT_NEAR(paper::f(c, p, alpha), 0, 1e-12);
    EXPECT_LT(paper::f(c, p, 0) * paper::f(c, p, 1), 1e-12) << "opposite signs at the inner and outer plane";
  }
}

TEST_F(Paper, Sec3_1_FifteenBisectionsAreWithin2ToMinus15AndTheProductIsFarCloser) {
  double paper_worst = 0, product_worst = 0;
  LocateHint hint;
  for (int k = 0; k < 5000; ++k) {
    SlabId s = 0;
    std::array<double, 3> w{};
    double alpha = 0;
    const Vec3d p = place(*mesh_, s, w, alpha);
    if (std::min({w[0], w[1], w[2]}) < 1e-4 || std::min(alpha, 1 - alpha) < 1e-4) continue;
    const auto halved = paper::alpha_by_bisection(paper::coefficients(mesh_->corners(s)), p);
    ASSERT_TRUE(halved);
    paper_worst = std::max(paper_worst, std::abs(*halved - alpha));
    const auto at = locate(*mesh_, p, hint);
    ASSERT_TRUE(at);
    product_worst = std::max(product_worst, std::abs(at->alpha - alpha));
  }
  EXPECT_LT(paper_worst, std::pow(2.0, -15));
  EXPECT_GT(paper_worst, std::pow(2.0, -18)) << "the reference is no longer the paper's";
  EXPECT_LT(product_worst, 1e-6);
}

TEST_F(Paper, Sec3_1_HomogeneousCoordinatesAreTheWeightsTimesN) {
  for (int k = 0; k < 2000; ++k) {
    SlabId s = 0;
    std::array<double, 3> w{};
    double alpha = 0;
    const Vec3d p = place(*mesh_, s, w, alpha);
    const auto h = paper::homogeneous(mesh_->corners(s), p, alpha, 15);
    EXPECT_NEAR(h[0], w[2] * 15, 1e-10);
    EXPECT_NEAR(h[1], w[1] * 15, 1e-10);
  }
}

TEST_F(Paper, Sec3_1_TryingSlabsInSequenceFindsTheSameSlab) {
  LocateHint hint;
  for (int k = 0; k < 3000; ++k) {
    const Vec3d p = {unit() * 6.4 - 3.2, unit() * 2.4 - 1.2, unit() * 6.4 - 3.2};
    const auto theirs = paper::locate(*mesh_, p);
    const auto ours = locate(*mesh_, p, hint);
    ASSERT_EQ(theirs.has_value(), ours.has_value()) << p.x << " " << p.y << " " << p.z;
    if (!ours) continue;
    const double rim = std::min({ours->u, ours->v, 1 - ours->u - ours->v});
    if (rim > 1e-3) {
      EXPECT_EQ(theirs->slab, ours->slab);
      EXPECT_NEAR(theirs->alpha, ours->alpha, std::pow(2.0, -15));
      EXPECT_NEAR(theirs->u, ours->u, 1e-3);
    }
  }
}

TEST_F(Paper, Sec3_2_DisplacementIsTheWeightedAverageOfTheThreeNearest) {
  const int n = 15;
  const float* d = model_->displacement(5);
  const double u = (4 + 0.3) / n, v = (6 + 0.25) / n;  // in the micro-triangle (4,6), (5,6), (4,7)
  const double expected = 0.45 * double{d[sample_index(n, {4, 6})]} + 0.3 * double{d[sample_index(n, {5, 6})]} +
                          0.25 * double{d[sample_index(n, {4, 7})]};
  EXPECT_NEAR(displacement_at(*model_, 5, u, v), expected, 1e-12);
}

TEST_F(Paper, Sec3_2_Eq3_GivesThePointOnTheSurface) {
  for (int k = 0; k < 500; ++k) {
    SlabId s = 0;
    std::array<double, 3> w{};
    double alpha = 0;
    place(*mesh_, s, w, alpha);
    const double delta = displacement_at(*model_, s, w[1], w[2]);
    const SlabCorners c = mesh_->corners(s);
    Vec3d expected;
    for (std::size_t i = 0; i < 3; ++i) expected += (c.inner[i] + (c.outer[i] - c.inner[i]) * delta) * w[i];
    EXPECT_LT(length(surface_point(*model_, s, w[1], w[2]).position - expected), 1e-13);
  }
}

TEST_F(Paper, Sec3_3_TheCursorHasPenetratedExactlyWhereAlphaIsBelowTheDisplacement) {
  LocateHint hint;
  int above = 0, below = 0;
  for (int k = 0; k < 3000; ++k) {
    SlabId s = 0;
    std::array<double, 3> w{};
    double alpha = 0;
    const Vec3d p = place(*mesh_, s, w, alpha);
    if (std::min({w[0], w[1], w[2]}) < 1e-4 || std::min(alpha, 1 - alpha) < 1e-4) continue;
    const auto contact = probe(*model_, p, hint);
    ASSERT_TRUE(contact);
    const double delta = displacement_at(*model_, s, w[1], w[2]);
    if (std::abs(alpha - delta) < 1e-9) continue;
    EXPECT_EQ(contact->touching(), alpha < delta);
    if (contact->touching()) {
      const Vec3d surface = mesh_->corners(s).point(w, delta);
      EXPECT_NEAR(contact->depth, length(surface - p), 1e-9) << "the distance to the corresponding surface point";
      ++below;
    } else {
      ++above;
    }
  }
  EXPECT_GT(above, 500);
  EXPECT_GT(below, 500);
}

TEST_F(Paper, Sec3_4_NormalsAreAveragesOverTheAdjacentTriangles) {
  // A roof: left of the ridge the surface rises, right of it it falls; on the ridge the normals of both sides average.
  const SnapshotPtr roof = displaced(plane_shell(2, 8), [](Vec3d p) { return 0.5 + std::min(p.x, 1 - p.x); });
  const Vec3d left = surface_point(*roof, 0, 0.5, 0.2).normal;
  for (SlabId s = 0; s < roof->slab_mesh().slab_count(); ++s)
    for (int j = 0; j <= 8; ++j)
      for (int i = 0; i + j <= 8; ++i) {
        const Vec3d p = sample_position(*roof, s, {i, j});
        if (std::abs(p.x - 0.5) > 1e-12 || p.z < 0.1 || p.z > 0.9) continue;
        const Vec3d n = sample_normal(*roof, s, {i, j});
        EXPECT_NEAR(n.x, 0, 1e-6);
        EXPECT_GT(n.y, 0.99);
      }
  EXPECT_LT(left.x, -0.1) << "away from the ridge the normal is the slope's";
}

TEST_F(Paper, Sec3_4_ForceIsSmoothOverAPeakAndProportionalToDepth) {
  // Fig. 6: slide over a peak at a constant height; with piecewise normals the direction would jump there.
  const SnapshotPtr peak = displaced(plane_shell(4, 15, 0.2), [](Vec3d p) { return 0.7 - std::abs(p.x - 0.5); });
  DeviceInfo device;
  device.max_force_rate = 1e9;
  Servo servo({.workspace = {.metres_per_unit = 0.1, .device_origin = {}, .model_origin = {}},
               .force = {.stiffness = 400, .damping = 0, .friction = 0, .paper_contact = true, .guard = false}},
              device);
  Vec3d before;
  double worst_turn = 0;
  int touching = 0;
  for (int k = 0; k <= 2000; ++k) {
    // From outside onto the slope, then over the ridge.
    const double x = 0.35 + 0.3 * k / 2000.0;
    const double y = k < 100 ? 0.19 - 0.17 * k / 100.0 : 0.02;
    const ServoSample s = servo.step(*peak, {.t = k * 1e-3, .position = Vec3d{x, y, 0.4} * 0.1, .velocity = {}});
    EXPECT_NEAR(length(s.force), std::min(400 * s.depth * 0.1, device.max_force), 1e-6);
    EXPECT_LT(length(s.contact_point - (s.cursor + s.normal * s.depth)), 1e-9);
    if (s.contact && k > 110) {
      if (touching > 0) worst_turn = std::max(worst_turn, length(normalized(s.force) - before));
      before = normalized(s.force);
      ++touching;
    }
  }
  EXPECT_GT(touching, 1500);
  EXPECT_LT(worst_turn, 0.02) << "radians per step of 1.5e-4 of the model";
}

}  // namespace
}  // namespace relief
