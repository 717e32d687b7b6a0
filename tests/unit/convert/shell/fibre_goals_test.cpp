#include <relief/convert/convert.h>
#include <relief/convert/shell/fibre_goals.h>
#include <relief/mesh/samples.h>

#include <gtest/gtest.h>
#include <unit/convert/shell/shell_support.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

namespace relief::detail {
namespace {

/// A thin shell made coarse, then with goals for its fibres. All numbers by fibre.
struct Lengthened {
  ThinShell thin;
  BoxTree tree;
  ShellPatch patch;
  std::vector<double> below, above;  ///< of the surface, shares of the longest fibre
  std::vector<double> depth;         ///< of the body along the fibre, the same, up to 4

  Lengthened(const TriangleMesh& mesh, std::size_t slabs)
      : thin(mesh), tree(tree_of(thin.source)), patch(coarse_patch(thin, slabs)) {
    const double longest = 2 * thin.longest;
    patch.allow(longest);
    EXPECT_TRUE(lengthen_to_goals(patch, {}));
    expect_certified(patch.draft(), thin.source);
    for (std::uint32_t v = 0; v < patch.draft().ends.size(); ++v) {
      const Ends ends = patch.draft().ends[v];
      const Vec3d surface = surface_on(ends, thin.source, tree), d = normalized(patch.draft().fibre(v));
      below.push_back(dot(surface - to_double(ends[kInner]), d) / longest);
      above.push_back(dot(to_double(ends[kOuter]) - surface, d) / longest);
      depth.push_back(depth_below(surface, -d, 4 * longest, thin.source, tree) / longest);
      EXPECT_LE(below.back() + above.back(), 1);
    }
  }
};

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

/// A ball pressed flat.
TriangleMesh lens(double height) {
  TriangleMesh mesh = testing::ball(24);
  for (Vec3d& p : mesh.positions) p.z *= height;
  return mesh;
}

TEST(FibreGoals, BothSidesAreReachedAndTheRestIsSpent) {
  const Lengthened ball(testing::ball(24), 100);
  // 0.4 and 0.3 first; then the upper side, which lacks more of 0.7, takes a quarter of 0.7, and the lower the rest.
  EXPECT_NEAR(median(ball.below), 0.525, 0.003);
  EXPECT_NEAR(median(ball.above), 0.475, 0.003);
}

TEST(FibreGoals, ThinBodiesAreSharedBetweenTheirSides) {
  const Lengthened thin(lens(0.12), 100);
  std::vector<double> share;
  for (std::size_t v = 0; v < thin.below.size(); ++v)
    if (thin.depth[v] < 0.7) share.push_back(thin.below[v] / thin.depth[v]);
  ASSERT_GT(share.size(), 20U);
  EXPECT_GT(median(share), 0.44);
  EXPECT_LE(median(share), 0.451);
  // What the lower side cannot have, the upper one takes, but no more than its greatest share.
  EXPECT_NEAR(std::ranges::max(thin.above), 0.7, 0.003);
}

TEST(FibreGoals, FibresThatStandAgainstOthersAreTurnedAndMoved) {
  const Lengthened head(*make_sample("head", 20000), 200);
  std::size_t fallen_short = 0;
  for (const double below : head.below) fallen_short += below < 0.39;
  EXPECT_LE(fallen_short, 2U);
  EXPECT_GT(std::ranges::min(head.below), 0.35);
}

/// A conversion tells where fibres have less than 1 % of the diagonal below the surface, and only then.
TEST(FibreGoals, AreMetByDefaultAndLittleClayIsTold) {
  for (const double height : {0.02, 0.2, 1.0}) {
    const auto made = convert(lens(height), {.slabs = 60});
    ASSERT_TRUE(made) << made.error().message;
    const ConvertReport& report = made->report;
    const Clay& clay = report.clay;
    const bool is_told = std::ranges::any_of(
        report.notes, [](const std::string& note) { return note.starts_with("tools find little clay"); });
    EXPECT_EQ(is_told, clay.below.least < 0.01) << height << ": " << clay.below.least;
    if (height == 1.0) {
      EXPECT_GE(clay.below.tenth, 0.08);
    }
    if (height == 1.0) {
      EXPECT_GE(clay.above.tenth, 0.06);
    }
    if (height == 0.02) {
      EXPECT_TRUE(is_told);
    }
    // The longest fibre is 0.2 of the diagonal.
    for (const Fibre& f : made->model.head->slab_mesh().fibres())
      EXPECT_LE(length(f.direction()), 0.2 * made->model.info.source_diagonal);
  }
}

TEST(FibreGoals, StopsWhenItIsCancelled) {
  const ThinShell thin(testing::ball(16));
  ShellPatch patch = coarse_patch(thin, 50);
  const std::atomic<bool> cancel = true;
  EXPECT_FALSE(lengthen_to_goals(patch, {.report = {}, .cancel = &cancel}));
}

TEST(FibreGoals, PlacesAndDepthsAreThoseOfTheSource) {
  const ThinShell thin(testing::ball(24));
  const BoxTree tree = tree_of(thin.source);
  Box3d box;
  for (const LatticePoint p : thin.source.points) box.add(to_double(p));
  const double radius = box.extent().x / 2, flat = 0.01 * radius;  // facets lie within that of the ball
  const Vec3d centre = box.centre();
  for (const Vec3d towards : {Vec3d{1, 2, 3}, Vec3d{-3, 1, 0.5}, Vec3d{0.1, -1, 0.2}, Vec3d{-1, -1, -2}}) {
    const Vec3d d = normalized(towards);
    const Ends fibre = {snap(centre + d * (0.9 * radius)), snap(centre + d * (1.3 * radius))};
    const Vec3d surface = surface_on(fibre, thin.source, tree);
    EXPECT_NEAR(length(surface - centre), radius, flat);
    EXPECT_NEAR(depth_below(surface, -d, 3 * radius, thin.source, tree), 2 * radius, 2 * flat);
    EXPECT_EQ(depth_below(surface, -d, radius, thin.source, tree), radius);
    const Ends beside = {snap(centre + d * (1.1 * radius)), snap(centre + d * (1.3 * radius))};
    EXPECT_NEAR(length(surface_on(beside, thin.source, tree) - centre), 1.2 * radius, 2);
  }
}

}  // namespace
}  // namespace relief::detail
