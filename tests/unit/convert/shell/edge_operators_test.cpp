#include <relief/convert/shell/edge_operators.h>

#include <gtest/gtest.h>
#include <unit/convert/shell/shell_support.h>

#include <algorithm>
#include <random>
#include <vector>

namespace relief::detail {
namespace {

std::vector<TriangleMesh> models() {
  return {testing::ball(14, 0.1), testing::torus(20, 12), noisy_field(10, 0.03), testing::box({1, 2, 3})};
}

TEST(EdgeOperators, CollapseAsLongAsAllConditionsHold) {
  for (const TriangleMesh& mesh : models()) {
    const ThinShell thin(mesh);
    ShellPatch patch = thin.patch();
    StartGrowth growth;
    const std::ptrdiff_t euler = recount(patch.draft().faces).euler;
    const std::size_t start = patch.slab_count();
    std::size_t done = 0;
    for (std::uint32_t h = 0; h < patch.draft().twins.size(); ++h) {
      if (!patch.draft().is_free_edge(h)) continue;
      const std::uint32_t u = patch.draft().origin(h), v = patch.draft().target(h);
      const Ends ends = patch.draft().ends[u];
      const std::size_t before = patch.slab_count();
      if (!patch.edges(growth, {}).collapse(h)) {
        EXPECT_EQ(patch.slab_count(), before);
        EXPECT_EQ(patch.draft().ends[u], ends);
        continue;
      }
      EXPECT_EQ(patch.slab_count(), before - 2);
      EXPECT_EQ(patch.draft().out[v], kNone);
      EXPECT_LE(length(patch.draft().fibre(u)), thin.longest);
      if (++done % 40 == 1) expect_certified(patch.draft(), thin.source);
    }
    EXPECT_EQ(patch.slab_count(), start - 2 * done);
    if (start > 12) {
      EXPECT_GT(done, 50U);
    }
    expect_certified(patch.draft(), thin.source);
    const Recount found = recount(patch.draft().faces);
    EXPECT_TRUE(found.is_manifold);
    EXPECT_EQ(found.euler, euler);
  }
}

TEST(EdgeOperators, AHalfEdgeCollapseLeavesTheOtherFibreAsItIs) {
  for (const TriangleMesh& mesh : models()) {
    const ThinShell thin(mesh);
    ShellPatch patch = thin.patch();
    StartGrowth growth;
    std::size_t done = 0;
    for (std::uint32_t h = 0; h < patch.draft().twins.size(); ++h) {
      if (!patch.draft().is_free_edge(h)) continue;
      const std::uint32_t u = patch.draft().origin(h), v = patch.draft().target(h);
      const std::array<Ends, 2> ends = {patch.draft().ends[u], patch.draft().ends[v]};
      const std::array<Vec3d, 2> at = {patch.draft().at[u], patch.draft().at[v]};
      EXPECT_FALSE(patch.edges(growth, {}).half_edge_collapse(h, -1)) << "dearer than it may be";
      if (!patch.edges(growth, {}).half_edge_collapse(h, 1e300)) continue;
      ++done;
      const std::uint32_t kept = patch.draft().out[u] != kNone ? u : v;
      EXPECT_EQ(patch.draft().out[kept == u ? v : u], kNone);
      EXPECT_EQ(patch.draft().ends[kept], ends[kept == u ? 0 : 1]);
      EXPECT_EQ(patch.draft().at[kept], at[kept == u ? 0 : 1]);
    }
    if (mesh.triangles.size() > 12) {
      EXPECT_GT(done, 20U);
    }
    expect_certified(patch.draft(), thin.source);
  }
}

TEST(EdgeOperators, FlipGivesBetterShapesOrMoreEvenValences) {
  const ThinShell thin(testing::ball(20, 0.05));
  ShellPatch patch = coarse_patch(thin, 200);
  StartGrowth growth;
  int flips = 0;
  for (std::uint32_t h = 0; h < patch.draft().twins.size(); ++h) {
    const LinkedDraft before = patch.draft();
    const std::array<std::uint32_t, 4> corners = {before.origin(h), before.target(h), before.target(next_of(h)),
                                                  before.target(next_of(before.twins[h]))};
    const auto worst = [&](const LinkedDraft& d) {
      return std::min(d.shape(d.faces[h / 3]), d.shape(d.faces[before.twins[h] / 3]));
    };
    const auto unevenness = [&](const LinkedDraft& d) {
      int sum = 0;
      for (const std::uint32_t v : corners) sum += std::abs(d.valences[v] - 6);
      return sum;
    };
    if (!patch.edges(growth, {}).flip(h)) continue;
    ++flips;
    EXPECT_TRUE(worst(patch.draft()) > worst(before) || unevenness(patch.draft()) <= unevenness(before) - 2);
    EXPECT_EQ(patch.draft().ends, before.ends);
  }
  EXPECT_GT(flips, 3);
  EXPECT_TRUE(recount(patch.draft().faces).is_manifold);
  expect_certified(patch.draft(), thin.source);
}

TEST(CollapseCost, OfAnEdgeInAPlaneIsSmallAndAcrossACornerIsNot) {
  const ThinShell thin(noisy_field(8, 0));
  const LinkedDraft draft(thin.draft());
  double flat = 0, sharp = Box3d::kFar;
  for (std::uint32_t h = 0; h < draft.twins.size(); ++h) {
    const std::uint32_t u = draft.origin(h), v = draft.target(h);
    const auto planes = [&](std::uint32_t w) { return draft.quadrics[w].trace() - draft.quadrics[w].zz; };
    const double cost = collapse_cost(draft, u, v).cost;
    // Upright normals alone around both ends: the top's inside; the corners of the box have three walls.
    if (planes(u) == 0 && planes(v) == 0) flat = std::max(flat, cost);
    int walls = 0;
    for (const std::uint32_t w : {u, v})
      walls += draft.quadrics[w].xx > 0 && draft.quadrics[w].yy > 0 && draft.quadrics[w].zz > 0;
    if (walls == 2) sharp = std::min(sharp, cost);
  }
  EXPECT_GT(flat, 0) << "longer edges cost more";
  EXPECT_GT(sharp, flat);
}

}  // namespace
}  // namespace relief::detail
