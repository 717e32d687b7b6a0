#include "room_support.h"
#include "support/cuts.h"

#include <relief/convert/room/root_split.h>
#include <relief/core/detail.h>
#include <relief/core/query.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
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

/// How far the surface of a slab moves at most where one diagonal of two micro-triangles is changed for the other,
/// model units: a quarter of the largest second difference along the longest fibre; and, as fibres are not parallel, a
/// quarter of what they and alpha differ by from sample to sample, for new samples are means of alphas.
double most_moved_by_diagonals(const Snapshot& model, SlabId s) {
  const int n = model.slab_mesh().intervals(s);
  const auto at = [&](int i, int j) { return double(model.displacement(s)[sample_index(n, {i, j})]); };
  const SlabCorners corners = model.slab_mesh().corners(s);
  double longest = 0, apart = 0, bent = 0, step = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    longest = std::max(longest, length(corners.fibre(k)));
    apart = std::max(apart, length(corners.fibre((k + 1) % 3) - corners.fibre(k)) / n);
  }
  for (int j = 0; j < n; ++j)
    for (int i = 0; i + j < n; ++i) {
      std::array<double, 3> bends{};
      if (i + j + 1 < n) bends[0] = at(i, j) + at(i + 1, j + 1) - at(i + 1, j) - at(i, j + 1);
      if (j > 0) bends[1] = at(i, j + 1) + at(i + 1, j - 1) - at(i, j) - at(i + 1, j);
      if (i > 0) bends[2] = at(i + 1, j) + at(i - 1, j + 1) - at(i, j) - at(i, j + 1);
      for (const double bend : bends) bent = std::max(bent, std::abs(bend));
      step = std::max({step, std::abs(at(i + 1, j) - at(i, j)), std::abs(at(i, j + 1) - at(i, j)),
                       std::abs(at(i + 1, j) - at(i, j + 1))});
    }
  return (bent * longest + step * apart) / 4;
}

/// Of what a slab is a half, a quarter and so on, and how often that was halved.
struct Piece {
  SlabId root = kNoSlab;
  int generations = 0;
};
Piece piece_of(const SlabMesh& was, const SlabMesh& is, SlabId s) {
  const SlabCorners piece = is.corners(s);
  LocateHint hint;
  const auto at = locate(was, piece.point({1. / 3, 1. / 3, 1. / 3}, 0.5), hint);
  if (!at) return {};
  const auto area = [](const SlabCorners& c) {
    return length(cross(c.inner[1] - c.inner[0], c.inner[2] - c.inner[0]));
  };
  return {at->slab, static_cast<int>(std::lround(std::log2(area(was.corners(at->slab)) / area(piece))))};
}

TEST(SplitRoots, TellHowFarTheSurfaceMovesOutsideTheSolid) {
  for (const int n : {15, 16, 31, 64}) {
    SCOPED_TRACE(n);
    const SnapshotPtr model = bumpy_ball(1, n);
    const Capsule ball = ball_at(*model, 17, 0.4);
    const SplitRoots split = split_at(*model, 17, 0.4);
    ASSERT_TRUE(split.model);
    double most = 0;
    double nearest = 0;
    std::size_t halved_once = 0;
    const SlabMesh& mesh = split.model->slab_mesh();
    std::mt19937 random(5);
    std::uniform_real_distribution<double> share(0, 1);
    for (SlabId s = 0; s < mesh.slab_count(); ++s) {
      double here = 0;
      for (int k = 0; k < 400; ++k) {
        double u = share(random), v = share(random);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        const Vec3d p = surface_point(*split.model, s, u, v).position;
        if (length(p - ball.a) > ball.radius) here = std::max(here, off(*model, p));
      }
      most = std::max(most, here);
      const Piece piece = piece_of(model->slab_mesh(), mesh, s);
      if (piece.generations != 1) continue;
      // One of the ring that lets slabs meet along whole edges.
      ++halved_once;
      const double bar = most_moved_by_diagonals(*model, piece.root) + 2 * kStep;
      EXPECT_LE(here, bar) << s;
      nearest = std::max(nearest, here / bar);
    }
    EXPECT_GT(halved_once, 0U);
    EXPECT_GT(nearest, 0.3) << "the bar is not far off";
    EXPECT_GT(most, 1e-5);
    EXPECT_LE(most, split.surface_moved + 2 * kStep);
    EXPECT_LT(split.surface_moved, 4 * most);
  }
}

TEST(SplitRoots, KeepTheirShapeOverTwentyGenerations) {
  const SnapshotPtr model = bumpy_ball(1, 32);
  const Vec3d place = surface_point(*model, 17, 0.3, 0.3).position;
  SnapshotPtr split = model;
  for (const double radius : {0.05, 0.0015}) {
    // So fine that samples lie in the ball.
    Detail finest;
    finest.grids.push_back({Layer::Displacement, closest_point(*split, place).slab, kMaxIntervals});
    split = split_at(**with_detail(split, finest), finest.grids[0].slab, radius).model;
    ASSERT_TRUE(split);
  }
  const SlabMesh &was = model->slab_mesh(), &is = split->slab_mesh();
  int generations = 0;
  double worst = 1;
  for (SlabId s = 0; s < is.slab_count(); ++s) {
    const Piece piece = piece_of(was, is, s);
    ASSERT_NE(piece.root, kNoSlab);
    generations = std::max(generations, piece.generations);
    worst = std::min(worst, testing::least_angle(is.corners(s)) / testing::least_angle(was.corners(piece.root)));
  }
  EXPECT_GE(generations, 20);
  // The ends of new fibres are rounded: by a thousandth of the smallest edges here.
  EXPECT_GE(worst, 0.5 - 1e-3);
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
