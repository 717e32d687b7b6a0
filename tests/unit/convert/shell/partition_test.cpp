// A shell that was made coarse in cells is judged by the verifier, which knows no cells.
#include <relief/convert/shell/partition.h>

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <unit/convert/shell/shell_support.h>

#include <cmath>

namespace relief::detail {
namespace {

/// More slabs than are reduced as a whole.
TriangleMesh large() {
  TriangleMesh mesh = testing::ball(116, 0.05);
  testing::append(mesh, testing::ball(60), {3, 0, 0}, 0.5);
  return mesh;
}

Shell reduced(ThinShell&& thin, std::size_t target) {
  Partition partition(thin.source, std::move(thin.ends), std::move(thin.tree), target, thin.longest);
  EXPECT_TRUE(partition.reduce({}));
  EXPECT_LE(partition.slab_count(), target);
  return std::move(partition).shell();
}

TEST(Partition, InCellsIsCertifiedAndTheSameOnOneThread) {
  ThinShell thin(large());
  ASSERT_GT(thin.source.faces.size(), 60'000U);
  const SourceIndex source = thin.source;
  const Shell shell = reduced(std::move(thin), 300);
  ShellDraft draft;
  draft.faces = shell.faces;
  for (std::size_t v = 0; v < shell.ends[kInner].size(); ++v)
    draft.ends.push_back({shell.ends[kInner][v], shell.ends[kOuter][v]});
  expect_certified(draft, source);
  EXPECT_TRUE(recount(shell.faces).is_manifold);
  EXPECT_EQ(recount(shell.faces).euler, 4) << "two balls";
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Shell again = reduced(ThinShell(large()), 300);
  EXPECT_EQ(again.faces, shell.faces);
  EXPECT_EQ(again.ends, shell.ends);
}

// Components keep their numbers from level to level: by these a slab knows what it must not swallow whole.
TEST(Partition, InCellsSwallowsNoSpecks) {
  TriangleMesh mesh = testing::ball(124, 0.05);
  ASSERT_GT(mesh.triangles.size(), 60'000U);
  constexpr int kSpecks = 60;
  for (int k = 0; k < kSpecks; ++k) {  // on a spiral around the ball, off its bumps
    const double z = 1 - (2 * k + 1.0) / kSpecks, turn = 2.4 * k, r = std::sqrt(1 - z * z);
    testing::append(mesh, testing::ball(4), Vec3d{r * std::cos(turn), r * std::sin(turn), z} * 1.08, 0.002);
  }
  ThinShell thin(mesh);
  const SourceIndex source = thin.source;
  Partition partition(thin.source, std::move(thin.ends), std::move(thin.tree), 600, thin.longest);
  ASSERT_TRUE(partition.reduce({}));
  const Shell shell = std::move(partition).shell();
  ShellDraft draft;
  draft.faces = shell.faces;
  for (std::size_t v = 0; v < shell.ends[kInner].size(); ++v)
    draft.ends.push_back({shell.ends[kInner][v], shell.ends[kOuter][v]});
  expect_certified(draft, source);
  EXPECT_EQ(recount(shell.faces).euler, 2 * (kSpecks + 1));
}

TEST(Partition, GoesBackToWhatItKept) {
  ThinShell thin(testing::torus(40, 24));
  Partition partition(thin.source, std::move(thin.ends), std::move(thin.tree), 400, thin.longest);
  ASSERT_TRUE(partition.reduce({}));
  const std::size_t before = partition.slab_count();
  EXPECT_FALSE(partition.has_kept());
  partition.keep();
  EXPECT_TRUE(partition.has_kept());
  ASSERT_TRUE(partition.reduce_further({1, 0.3}, {}));
  EXPECT_LE(partition.slab_count(), before);
  partition.go_back();
  EXPECT_FALSE(partition.has_kept());
  EXPECT_EQ(partition.slab_count(), before);
  EXPECT_EQ(std::move(partition).shell().faces.size(), before);
}

}  // namespace
}  // namespace relief::detail
