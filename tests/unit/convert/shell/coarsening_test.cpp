#include <relief/convert/shell/coarsening.h>

#include <gtest/gtest.h>
#include <unit/convert/shell/shell_support.h>

#include <algorithm>
#include <atomic>
#include <vector>

namespace relief::detail {
namespace {

TEST(Coarsening, ReachesItsTargetAndKeepsAllConditions) {
  TriangleMesh pair = testing::ball(20);
  testing::append(pair, testing::torus(24, 14), {4.5, 0, 0});
  for (const TriangleMesh& mesh : {testing::ball(24, 0.1), testing::torus(30, 18), noisy_field(16, 0.03), pair}) {
    const ThinShell thin(mesh);
    Coarsening coarsening(thin.source, *thin.tree, thin.longest, thin.draft(), everywhere(), {});
    EXPECT_EQ(coarsening.free_count(), thin.source.faces.size());
    ASSERT_TRUE(coarsening.sweep(300, {}));
    expect_certified(coarsening.draft(), thin.source);
    ASSERT_TRUE(coarsening.reduce(80, {}));
    EXPECT_LE(coarsening.slab_count(), 80U);
    EXPECT_GE(coarsening.slab_count(), 78U);
    expect_certified(coarsening.draft(), thin.source);
    EXPECT_EQ(coarsening.lost(), 0);
    double before = 0, after = 0;
    for (std::uint32_t v = 0; v < coarsening.draft().out.size(); ++v)
      if (coarsening.draft().out[v] != kNone) before += length(coarsening.draft().fibre(v));
    ASSERT_TRUE(coarsening.thicken(2 * thin.longest, Creases(thin.source), {}));
    for (std::uint32_t v = 0; v < coarsening.draft().out.size(); ++v)
      if (coarsening.draft().out[v] != kNone) after += length(coarsening.draft().fibre(v));
    EXPECT_GT(after, 1.2 * before);
    expect_certified(coarsening.draft(), thin.source);
  }
}

TEST(Coarsening, ChangesNothingOutsideItsRoom) {
  const ThinShell thin(testing::ball(24));
  Box3d room = everywhere();
  room.low.x = 0.5 * Lattice::kSpan;
  Coarsening coarsening(thin.source, *thin.tree, thin.longest, thin.draft(), room, {});
  EXPECT_GT(coarsening.free_count(), 0U);
  EXPECT_LT(coarsening.free_count(), coarsening.slab_count());
  ASSERT_TRUE(coarsening.sweep(0, {}));
  EXPECT_LT(coarsening.slab_count(), 0.75 * double(thin.source.faces.size()));
  for (std::uint32_t v = 0; v < thin.ends.size(); ++v) {
    const bool inside = thin.ends[v][kInner].x > room.low.x && thin.ends[v][kOuter].x > room.low.x;
    if (!inside) {
      EXPECT_EQ(coarsening.draft().ends[v], thin.ends[v]);
      EXPECT_FALSE(coarsening.has_changed(v));
    }
    if (coarsening.draft().out[v] != kNone && coarsening.draft().ends[v] != thin.ends[v]) {
      EXPECT_TRUE(coarsening.has_changed(v));
    }
  }
  expect_certified(coarsening.draft(), thin.source);
}

// Slabs of the first of two balls only: what is lost is the share of the second.
TEST(Coarsening, LostIsTheShareOfTheAreaInNoSlab) {
  TriangleMesh pair = testing::ball(20);
  testing::append(pair, testing::ball(10), {3, 0, 0}, 0.5);
  const ThinShell thin(pair);
  ShellDraft draft = thin.draft();
  std::vector<Face> faces;
  double all = 0, second = 0;
  for (std::uint32_t t = 0; t < thin.source.faces.size(); ++t) {
    const double area = length(thin.source.cross_of(t));
    all += area;
    if (draft.component[t] == draft.component[0])
      faces.push_back(draft.faces[t]);
    else
      second += area;
  }
  ASSERT_GT(second, 0);
  draft.faces = faces;
  draft.component.clear();
  draft.from.resize(faces.size());
  draft.lists = {};
  draft.lists.resize(faces.size());
  const Coarsening coarsening(thin.source, *thin.tree, thin.longest, std::move(draft), everywhere(), {});
  EXPECT_NEAR(coarsening.lost(), second / all, 1e-9);
}

TEST(Coarsening, MakesFewerSlabsWhereMoreMayBeGivenUp) {
  const ThinShell thin(testing::ball(30, 0.25));
  Coarsening strict(thin.source, *thin.tree, thin.longest, thin.draft(), everywhere(), {});
  ASSERT_TRUE(strict.sweep(100, {}));
  ASSERT_TRUE(strict.reduce(20, {}));
  Coarsening lax = strict;
  lax.tolerate({.folds = 1});
  ASSERT_TRUE(lax.reduce(20, {}));
  EXPECT_LT(lax.slab_count(), strict.slab_count());
  EXPECT_EQ(lax.lost(), 0);
  const verify::Certificate c = judge(lax.draft(), thin.source);
  for (const verify::Condition held : {verify::Condition::C0, verify::Condition::C1, verify::Condition::C2,
                                       verify::Condition::C3, verify::Condition::C4, verify::Condition::C5})
    EXPECT_TRUE(c.holds[static_cast<std::size_t>(held)]) << verify::name(held);
}

TEST(Coarsening, StopsWhenItIsCancelled) {
  const ThinShell thin(testing::ball(16));
  const std::atomic<bool> cancel = true;
  const Progress cancelled = {.report = {}, .cancel = &cancel};
  Coarsening coarsening(thin.source, *thin.tree, thin.longest, thin.draft(), everywhere(), {});
  EXPECT_FALSE(coarsening.sweep(10, cancelled));
  EXPECT_FALSE(coarsening.reduce(10, cancelled));
  EXPECT_FALSE(coarsening.thicken(thin.longest, Creases(thin.source), cancelled));
}

}  // namespace
}  // namespace relief::detail
