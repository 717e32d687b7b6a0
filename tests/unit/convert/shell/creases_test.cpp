#include <relief/convert/convert.h>
#include <relief/convert/shell/crease_levels.h>
#include <relief/convert/shell/creases.h>
#include <relief/convert/shell/fibre_goals.h>

#include <gtest/gtest.h>
#include <support/bodies.h>
#include <unit/convert/shapes.h>
#include <unit/convert/shell/shell_support.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace relief::detail {
namespace {

/// A solid on a lattice and its creases.
struct Creased {
  LatticeMesh mesh;
  SourceIndex source;
  Creases creases;

  explicit Creased(const TriangleMesh& of) : mesh(of), source(mesh.points, mesh.faces), creases(source) {}
  [[nodiscard]] Vec3d at(Vec3d p) const { return mesh.lattice.to_lattice(p); }
};

TEST(Creases, OfABoxAreItsTwelveEdges) {
  const Creased box(testing::box({1, 2, 3}));
  ASSERT_FALSE(box.creases.empty());
  const auto coordinate = [](int k, double far) { return (k & 1) != 0 ? far : 0; };
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d p = {coordinate(corner, 1), coordinate(corner >> 1, 2), coordinate(corner >> 2, 3)};
    EXPECT_TRUE(box.creases.hold_corner(box.at(p)));
    for (int other = corner + 1; other < 8; ++other) {
      const Vec3d q = {coordinate(other, 1), coordinate(other >> 1, 2), coordinate(other >> 2, 3)};
      const int differ = corner ^ other;
      const bool is_edge = differ == 1 || differ == 2 || differ == 4;
      EXPECT_EQ(box.creases.hold_edge(box.at(p), box.at(q)), is_edge) << corner << " " << other;
      EXPECT_EQ(box.creases.hold((box.at(p) + box.at(q)) * 0.5), is_edge) << corner << " " << other;
    }
  }
}

TEST(Creases, WhatIsOnOneStaysThere) {
  const Creased box(testing::box({1, 1, 1}));
  const Vec3d corner = box.at({0, 0, 0}), on = box.at({0.4, 0, 0}), further = box.at({0.6, 0, 0}),
              face = box.at({0.4, 0.3, 0});
  EXPECT_TRUE(box.creases.allow(on, further));
  EXPECT_TRUE(box.creases.allow(on, corner));
  EXPECT_FALSE(box.creases.allow(on, face));
  EXPECT_FALSE(box.creases.allow(corner, on)) << "a corner stays";
  EXPECT_TRUE(box.creases.allow(corner, corner));
  EXPECT_TRUE(box.creases.allow(face, on));
  EXPECT_TRUE(box.creases.allow(face, box.at({0.5, 0.5, 0})));
}

/// Two rims that lie near each other: what stands on one of them must not go to the other.
TEST(Creases, WhatIsOnOneDoesNotGoToAnother) {
  const Creased plate(testing::box({1, 1, 0.05}));
  const Vec3d below = plate.at({0.4, 0, 0}), above = plate.at({0.4, 0, 0.05});
  EXPECT_TRUE(plate.creases.hold(below) && plate.creases.hold(above));
  EXPECT_FALSE(plate.creases.allow(below, above));
  EXPECT_TRUE(plate.creases.allow(below, plate.at({0.6, 0, 0})));
}

/// A rim of 24 sides is one crease all round, however it is turned; on it no place is a corner.
TEST(Creases, ARimGoesOnAllRound) {
  const auto turned = [](Vec3d p) {
    return Vec3d{0.6 * p.x - 0.8 * p.y, 0.48 * p.x + 0.36 * p.y - 0.8 * p.z, 0.64 * p.x + 0.48 * p.y + 0.6 * p.z};
  };
  TriangleMesh drum = testing::extruded(testing::regular_polygon(24, 1), 0.5);
  for (Vec3d& p : drum.positions) p = turned(p);
  const Creased rims(drum);
  const auto at = [&](double turn, double z) { return rims.at(turned({std::cos(turn), std::sin(turn), z})); };
  const double side = 2 * testing::kPi / 24;
  for (int k = 0; k < 24; ++k) {
    EXPECT_TRUE(rims.creases.hold(at(k * side, 0.5))) << k;
    EXPECT_FALSE(rims.creases.hold_corner(at(k * side, 0.5))) << k;
    EXPECT_TRUE(rims.creases.allow(at(0, 0.5), at(k * side, 0.5))) << k;
    EXPECT_FALSE(rims.creases.allow(at(0, 0.5), at(k * side, -0.5))) << k;
  }
}

TEST(Creases, ARoundSurfaceHasNone) {
  EXPECT_TRUE(Creased(testing::ball(20)).creases.empty());
  EXPECT_TRUE(Creased(testing::ball(20, 0.1)).creases.empty());
  // Beside a little cube: a scan with a flat speck.
  TriangleMesh both = testing::round_sphere_mesh(4);
  testing::append(both, testing::box({1, 1, 1}), {2, 0, 0}, 0.1);
  EXPECT_TRUE(Creased(both).creases.empty());
}

/// By how much the levels of the two ends of edges on creases differ at most.
double uneven(const ShellPatch& patch, const Creases& creases, std::size_t& edges) {
  const LinkedDraft& draft = patch.draft();
  const auto level = [&](std::uint32_t v) {
    const ShellPatch::Reach reach = patch.reach(v);
    return reach[kInner] / (reach[kInner] + reach[kOuter]);
  };
  double most = 0;
  edges = 0;
  for (std::uint32_t h = 0; h < draft.twins.size(); ++h) {
    if (!draft.alive(h / 3) || h > draft.twins[h]) continue;
    if (!creases.hold_edge(draft.at[draft.origin(h)], draft.at[draft.target(h)])) continue;
    ++edges;
    most = std::max(most, std::abs(level(draft.origin(h)) - level(draft.target(h))));
  }
  return most;
}

TEST(CreaseLevels, FibresThatACreaseJoinsStandOutByOneShare) {
  const ThinShell thin(testing::box({1, 0.7, 0.4}));
  const BoxTree tree = tree_of(thin.source);
  const Creases creases(thin.source);
  ShellPatch patch = thin.patch();
  patch.follow(creases);
  patch.allow(2 * thin.longest);
  patch.place_on_source(tree);
  // One stands out by more than the others.
  ASSERT_TRUE(patch.moves().reach_to(0, {0.2 * thin.longest, 0.05 * thin.longest}));
  std::size_t edges = 0;
  ASSERT_GT(uneven(patch, creases, edges), 0.1);
  EXPECT_EQ(edges, 12U);
  EXPECT_EQ(level_creases(patch, creases, tree, {}), 12U);
  EXPECT_LT(uneven(patch, creases, edges), 1e-5);
  expect_certified(patch.draft(), thin.source);
}

TEST(CreaseLevels, MovesKeepFibresOnCreases) {
  const ThinShell thin(testing::box({1, 0.7, 0.4}));
  const BoxTree tree = tree_of(thin.source);
  const Creases creases(thin.source);
  ShellPatch patch = thin.patch();
  patch.follow(creases);
  FibreMoves moves = patch.moves();
  for (std::uint32_t v = 0; v < patch.draft().out.size(); ++v) {
    moves.improve(v);
    moves.settle(v);
    moves.even_out(v);
  }
  patch.place_on_source(tree);
  for (std::uint32_t v = 0; v < patch.draft().out.size(); ++v) EXPECT_TRUE(creases.hold_corner(patch.draft().at[v]));
}

TEST(CreaseLevels, TwoBoxesThatOverlapAreExact) {
  TriangleMesh boxes = testing::box({2, 1, 1});
  testing::append(boxes, testing::box({2, 0.9, 0.5}), {1, 0.5, 0.3}, 1);
  for (const TriangleMesh& mesh : {boxes, testing::rotated(boxes, {0.8, 0.5, -0.3}, {0.1, 0.2, 1})}) {
    const auto made = convert(mesh, {});
    ASSERT_TRUE(made) << made.error().message;
    EXPECT_EQ(made->model.info.mode, Mode::Certified);
    EXPECT_LT(std::max(made->report.to_source.max, made->report.from_mended.max), 1e-6);
  }
}

// At the feet of letters an end mostly cannot move alone: its fibre would no longer face its triangles.
TEST(CreaseLevels, LettersOnAPlateAreExact) {
  ConvertSettings settings;
  for (const int slabs : {140, 160, 180}) {
    settings.slabs = slabs;
    const auto made = convert(testing::sign(), settings);
    ASSERT_TRUE(made) << made.error().message;
    EXPECT_EQ(made->model.info.mode, Mode::Certified);
    EXPECT_LT(made->report.from_mended.max, 1e-6) << slabs;
    EXPECT_LT(made->report.to_mended.max, 1e-4) << "edges within slabs, as far as their samples lie apart";
  }
}

// Fewer slabs than triangles: those along the creases are merged along them.
TEST(CreaseLevels, AFineBoxIsExactWithFewSlabs) {
  TriangleMesh fine = testing::box({1, 1, 1});
  fine = testing::subdivided(std::move(fine), 2);
  ConvertSettings settings;
  settings.slabs = 60;
  const auto made = convert(fine, settings);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->report.slabs, 60U);
  EXPECT_LT(std::max(made->report.to_source.max, made->report.from_mended.max), 1e-4);
}

}  // namespace
}  // namespace relief::detail
