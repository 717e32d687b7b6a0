#include "room_support.h"

#include <relief/convert/room/root_split.h>
#include <relief/core/detail.h>
#include <relief/core/query.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <utility>
#include <vector>

namespace relief::detail {
namespace {

constexpr double kStep = 1.0 / (1 << 20);  // on multiples of which the fibres of these balls end

Capsule ball_at(const Snapshot& model, SlabId slab, double radius) {
  const SurfacePoint on = surface_point(model, slab, 0.3, 0.3);
  const Vec3d centre = on.position + on.normal * (0.3 * radius);
  return {centre, centre, radius, on.normal};
}

SplitRoots split_at(const Snapshot& model, SlabId slab, double radius) {
  std::optional<SplitRoots> split = split_roots(model, {.cut = {ball_at(model, slab, radius)}, .fill = {}});
  EXPECT_TRUE(split);
  return split ? *std::move(split) : SplitRoots{};
}

double off(const Snapshot& surface, Vec3d p) {
  PickHint hint;
  return length(closest_point(surface, p, hint).position - p);
}

template <typename Visit>
void for_each_sample(const Snapshot& model, SlabId s, Visit&& visit) {
  const int n = model.slab_mesh().intervals(s);
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i + j <= n; ++i) visit(sample_position(model, s, {i, j}));
}

TEST(SplitRoots, KeepTheOldSamplesAndAddNoneThatIsOffTheSurface) {
  // The ends of new fibres are rounded to the step, with each halving again; there are up to eight.
  constexpr double kRounding = 8 * kStep;
  constexpr double kTwist = 0.2;  // triangles are flat, between fibres that are not parallel
  for (const auto& [levels, n] : {std::pair{1, 15}, {1, 32}, {1, 63}, {2, 16}, {2, 31}, {1, 128}}) {
    SCOPED_TRACE(n);
    const SnapshotPtr model = bumpy_ball(levels, n);
    const SplitRoots split = split_at(*model, 17, 0.5);
    ASSERT_TRUE(split.model);
    expect_sound(*split.model);
    for (const SlabId root : split.halved.numbers)
      for_each_sample(*model, root, [&](Vec3d p) { EXPECT_LT(off(*split.model, p), kRounding); });
    for (SlabId s = 0; s < split.model->slab_mesh().slab_count(); ++s)
      if (s >= split.halved.first || split.halved.now(s) == kNoSlab)
        for_each_sample(*split.model, s, [&](Vec3d p) { EXPECT_LT(off(*model, p), kRounding + kTwist / (n * n)); });
  }
}

TEST(SplitRoots, AreHalvedUntilNoEdgeInTheSolidIsTooLong) {
  constexpr double kRadius = 0.4;
  const SnapshotPtr model = bumpy_ball(1, 32);
  const Capsule ball = ball_at(*model, 17, kRadius);
  const SplitRoots split = split_at(*model, 17, kRadius);
  ASSERT_TRUE(split.model);
  std::size_t in_the_ball = 0;
  for (SlabId s = 0; s < split.model->slab_mesh().slab_count(); ++s) {
    double nearest = 1;
    for_each_sample(*split.model, s, [&](Vec3d p) { nearest = std::min(nearest, length(p - ball.a)); });
    if (nearest > kRadius) continue;
    ++in_the_ball;
    const int n = split.model->slab_mesh().intervals(s);
    const std::array corners = {sample_position(*split.model, s, {0, 0}), sample_position(*split.model, s, {n, 0}),
                                sample_position(*split.model, s, {0, n})};
    for (std::size_t k = 0; k < 3; ++k) EXPECT_LE(length(corners[(k + 1) % 3] - corners[k]), kSplitEdge * kRadius) << s;
  }
  EXPECT_GT(in_the_ball, 8U);
}

TEST(SplitRoots, LeaveAllElseBitForBitUnderNumbersThatTheyTell) {
  const SnapshotPtr whole = bumpy_ball(2, 16);
  // Of a slab far away, and of a part of it.
  const auto cut = with_detail(whole, {.cuts = {100, 100}, .grids = {{Layer::Displacement, 60, 32}}});
  ASSERT_TRUE(cut) << cut.error().message;
  const SlabMesh& before = (*cut)->slab_mesh();
  const SplitRoots split = split_at(**cut, 17, 0.5);
  ASSERT_TRUE(split.model);
  expect_sound(*split.model);
  const SlabMesh& after = split.model->slab_mesh();
  EXPECT_EQ(after.slab_count(), before.slab_count() + split.halved.added);
  EXPECT_EQ(split.halved.first, before.roots().size());
  std::size_t halved = 0;
  for (SlabId s = 0; s < before.slab_count(); ++s) {
    const SlabId now = split.halved.now(s);
    if (now == kNoSlab) {
      ++halved;
      continue;
    }
    EXPECT_EQ((*cut)->shared_tile(Layer::Displacement, s), split.model->shared_tile(Layer::Displacement, now)) << s;
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(before.corners(s).inner[k], after.corners(now).inner[k]);
      EXPECT_EQ(before.corners(s).outer[k], after.corners(now).outer[k]);
    }
  }
  EXPECT_EQ(halved, split.halved.numbers.size());
  EXPECT_GT(halved, 4U);
  EXPECT_LT(halved, 40U);
  EXPECT_TRUE(has_slabs_of(after, before));
  EXPECT_TRUE(has_slabs_of(after, whole->slab_mesh()));
  EXPECT_FALSE(has_slabs_of(before, after));
}

TEST(SplitRoots, WhatIsCutInFourStaysAndWhatItNeedsToo) {
  const SnapshotPtr whole = bumpy_ball(2, 16);
  std::vector<SlabId> all;
  for (SlabId s = 0; s < whole->slab_mesh().slab_count(); ++s) all.push_back(s);
  const auto cut = with_detail(whole, {.cuts = all, .grids = {}});
  ASSERT_TRUE(cut) << cut.error().message;
  EXPECT_FALSE(split_roots(**cut, {.cut = {ball_at(**cut, 17, 0.5)}, .fill = {}}));
  // One in the middle.
  const auto one = with_detail(whole, {.cuts = {17}, .grids = {}});
  ASSERT_TRUE(one) << one.error().message;
  const SplitRoots split = split_at(**one, 17, 0.5);
  ASSERT_TRUE(split.model);
  expect_sound(*split.model);
  EXPECT_FALSE(std::ranges::binary_search(split.halved.numbers, 17U));
}

TEST(SplitRoots, TellHowFarTheSurfaceMovesOutsideTheSolid) {
  const SnapshotPtr model = bumpy_ball(1, 16);
  const Capsule ball = ball_at(*model, 17, 0.4);
  const SplitRoots split = split_at(*model, 17, 0.4);
  ASSERT_TRUE(split.model);
  double most = 0;
  const SlabMesh& mesh = split.model->slab_mesh();
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(0, 1);
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    for (int k = 0; k < 400; ++k) {
      double u = share(random), v = share(random);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const Vec3d p = surface_point(*split.model, s, u, v).position;
      if (length(p - ball.a) > ball.radius) most = std::max(most, off(*model, p));
    }
  EXPECT_GT(most, 1e-5);
  EXPECT_LE(most, split.surface_moved + 2 * kStep);
  EXPECT_LT(split.surface_moved, 4 * most);
}

TEST(SplitRoots, AreNoMoreThanToolsWaitFor) {
  const SnapshotPtr model = bumpy_ball(2, 4);
  std::vector<Capsule> dots;
  for (SlabId s = 0; s < model->slab_mesh().slab_count(); ++s) dots.push_back(ball_at(*model, s, 0.06));
  const std::optional<SplitRoots> split = split_roots(*model, {.cut = dots, .fill = {}});
  ASSERT_TRUE(split);
  // The last one is halved with what stands in its way.
  EXPECT_GE(split->halved.added, kMostAdded);
  EXPECT_LT(split->halved.added, kMostAdded + 20);
}

TEST(SplitRoots, AreThoseThatFaceTheToolAndNoneWhereThatIsFar) {
  const SnapshotPtr model = bumpy_ball(1, 16);
  Capsule ball = ball_at(*model, 17, 0.5);
  EXPECT_TRUE(split_roots(*model, {.cut = {}, .fill = {ball}}));
  ball.axis = ball.axis * -1.0;
  EXPECT_FALSE(split_roots(*model, {.cut = {ball}, .fill = {}}));
  ball.a = ball.b = {9, 9, 9};
  ball.axis = {};
  EXPECT_FALSE(split_roots(*model, {.cut = {ball}, .fill = {}}));
}

}  // namespace
}  // namespace relief::detail
