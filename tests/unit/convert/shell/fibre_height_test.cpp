#include <relief/convert/shell/fibre_direction.h>
#include <relief/convert/shell/fibre_height.h>

#include <gtest/gtest.h>
#include <unit/convert/shell/shell_support.h>

#include <algorithm>
#include <vector>

namespace relief::detail {
namespace {

TEST(HeightInterval, KeepsOffItsEnds) {
  const HeightInterval interval = {10, 20};
  EXPECT_DOUBLE_EQ(interval.nearest(15), 15);
  EXPECT_GT(interval.nearest(3), 10);
  EXPECT_LT(interval.nearest(300), 20);
  EXPECT_LT(interval.nearest(3), 10.5);
  EXPECT_GT(interval.nearest(300), 19.5);
  EXPECT_DOUBLE_EQ(HeightInterval{}.nearest(7), 7);
}

// Against the Jacobian itself at both ends of the neighbours' fibres, height by height.
TEST(HeightsAlong, AreThoseAtWhichTheJacobianIsPositiveAtTheNeighbours) {
  const ThinShell thin(testing::torus(30, 18));
  const LinkedDraft draft(coarse(thin, 100));
  Star star;
  int bounded = 0, none = 0;
  for (std::uint32_t v = 0; v < draft.out.size(); ++v) {
    star.set_fibre(draft, v);
    const Vec3d at = draft.at[v];
    // Its own direction, and one that leans far aside.
    const Vec3d own = normalized(draft.fibre(v));
    for (const Vec3d d : {own, normalized(own + normalized(to_double(draft.ends[star.faces[0][1]][kOuter]) - at))}) {
      const auto heights = heights_along(draft, star, at, d);
      const auto is_positive = [&](Side side, double height) {
        const Vec3d end = at + d * (side == kOuter ? height : -height);
        for (const Face& f : star.faces) {
          const Vec3d n = cross(to_double(draft.ends[f[1]][side]) - end, to_double(draft.ends[f[2]][side]) - end);
          if (!(dot(n, draft.fibre(f[1])) > 0) || !(dot(n, draft.fibre(f[2])) > 0)) return false;
        }
        return true;
      };
      if (!heights) {
        ++none;
        continue;
      }
      for (const Side side : {kInner, kOuter}) {
        const HeightInterval& interval = (*heights)[side];
        bounded += interval.most < thin.longest;
        for (double share = 0.01; share < 1; share += 0.07) {
          const double height = thin.longest * share;
          if (std::abs(height - interval.least) < 1 || std::abs(height - interval.most) < 1) continue;  // rounding
          EXPECT_EQ(is_positive(side, height), height > interval.least && height < interval.most)
              << v << ", side " << side << " at " << height;
        }
      }
    }
  }
  EXPECT_GT(bounded, 20);
  EXPECT_GT(none, 0);
}

TEST(StartGrowth, GrowsOnTheSideThatTheSourceMetAndForgets) {
  StartGrowth growth;
  growth.learn(Fault::Outer);
  EXPECT_GT(growth.of(kOuter), 1);
  EXPECT_EQ(growth.of(kInner), 1);
  for (int k = 0; k < 100; ++k) growth.learn(Fault::Inner);
  EXPECT_LE(growth.of(kInner), 1.5);
  EXPECT_GT(growth.of(kInner), 1.4);
  for (int k = 0; k < 100; ++k) growth.learn(Fault::None);
  EXPECT_EQ(growth.of(kInner), 1);
  EXPECT_EQ(growth.of(kOuter), 1);
}

TEST(HeightSearch, StaysWhereTheJacobianCanBePositiveAndBelowTheLongest) {
  const ThinShell thin(testing::torus(30, 18));
  const LinkedDraft draft(coarse(thin, 100));
  Star star;
  const StartGrowth growth;
  int searches = 0;
  for (std::uint32_t h = 0; h < draft.twins.size(); ++h) {
    if (!draft.is_free_edge(h) || !draft.link_allows(h)) continue;
    star.set_edge(draft, h);
    const std::uint32_t u = draft.origin(h), v = draft.target(h);
    const Vec3d at = (draft.at[u] + draft.at[v]) * 0.5;
    const std::vector<Vec3d> directions = {normalized(draft.fibre(u)), star_direction(star.link(draft), at).d};
    HeightSearch search(draft, star, u, v, at, directions, growth, thin.longest);
    bool found = search.start();
    for (std::size_t choice = found ? 1 : 2; found; found = search.next(), ++choice) {
      ++searches;
      const Ends ends = search.ends();
      const Vec3d d = normalized(to_double(ends[kOuter] - ends[kInner]));
      const auto intervals = heights_along(draft, star, at, d);
      ASSERT_TRUE(intervals);
      const auto expect_inside = [&] {
        for (const Side side : {kInner, kOuter}) {
          EXPECT_GE(search.heights()[side], (*intervals)[side].least * (1 - 1e-3) - 1);
          EXPECT_LE(search.heights()[side], (*intervals)[side].most * (1 + 1e-3) + 1);
        }
      };
      for (int k = 0; k < 5; ++k) {
        const double before = search.heights()[kOuter];
        const bool grew = search.grow(kOuter);
        EXPECT_EQ(grew, search.heights()[kOuter] > 1.02 * before);
        expect_inside();
      }
      const double grown = search.heights()[kInner];
      const bool shrank = search.shrink(kInner, 0.6);
      EXPECT_EQ(shrank, search.heights()[kInner] < 0.98 * grown);
      expect_inside();
      const bool fitted = search.fit();
      const double sum = search.heights()[kInner] + search.heights()[kOuter];
      EXPECT_LE(sum, thin.longest);
      if (!fitted) {
        EXPECT_NEAR(sum, thin.longest, 0.01 * thin.longest);
      }
    }
  }
  EXPECT_GT(searches, 50);
}

}  // namespace
}  // namespace relief::detail
