#include <relief/convert/shell/star.h>

#include <gtest/gtest.h>
#include <unit/convert/shell/shell_support.h>

#include <algorithm>
#include <set>

namespace relief::detail {
namespace {

/// That the faces run once around their first corner.
void expect_ring(const Star& star) {
  for (std::size_t k = 0; k < star.faces.size(); ++k) {
    EXPECT_EQ(star.faces[k][0], star.moved);
    EXPECT_EQ(star.faces[k][2], star.faces[(k + 1) % star.faces.size()][1]) << k;
  }
}

TEST(Star, OfAFibreIsTheFacesAroundIt) {
  const ThinShell thin(testing::ball(8));
  const LinkedDraft draft(thin.draft());
  Star star;
  for (std::uint32_t v = 0; v < draft.out.size(); ++v) {
    star.set_fibre(draft, v);
    expect_ring(star);
    std::set<std::uint32_t> expected;
    for (std::uint32_t f = 0; f < draft.faces.size(); ++f)
      if (std::ranges::count(draft.faces[f], v) > 0) expected.insert(f);
    EXPECT_EQ(std::set(star.slots.begin(), star.slots.end()), expected);
    EXPECT_TRUE(star.vanished.empty());
    EXPECT_DOUBLE_EQ(star.quality(draft, draft.at[v]).least, star.quality_now(draft).least);
    EXPECT_NEAR(star.quality(draft, draft.at[v]).mean, star.quality_now(draft).mean, 1e-12);
  }
}

TEST(Star, OfAnEdgeIsWhatACollapseLeaves) {
  const ThinShell thin(testing::ball(8));
  const LinkedDraft draft(thin.draft());
  Star star;
  int edges = 0;
  for (std::uint32_t h = 0; h < draft.twins.size(); ++h) {
    if (!draft.link_allows(h)) continue;
    ++edges;
    star.set_edge(draft, h);
    expect_ring(star);
    LinkedDraft after = draft;
    after.collapse(h);
    EXPECT_EQ(star.faces.size(), after.valences[draft.origin(h)]);
    for (std::size_t k = 0; k < star.faces.size(); ++k) {
      const Face& now = after.faces[star.slots[k]];
      EXPECT_EQ(std::set(now.begin(), now.end()), std::set(star.faces[k].begin(), star.faces[k].end()));
      // The first faces are those of the origin: a half-edge collapse leaves them as they are.
      EXPECT_EQ(draft.faces[star.slots[k]] == now, k < star.second);
    }
    EXPECT_EQ(star.vanished, (std::vector<std::uint32_t>{h / 3, draft.twins[h] / 3}));
  }
  EXPECT_GT(edges, 100);
}

TEST(Star, OfAFlipIsWhatItMakes) {
  const ThinShell thin(testing::ball(6));
  const LinkedDraft draft(thin.draft());
  Star star;
  for (std::uint32_t h = 0; h < draft.twins.size(); h += 5) {
    star.set_flip(draft, h);
    LinkedDraft after = draft;
    after.flip(h);
    for (std::size_t k = 0; k < 2; ++k) EXPECT_EQ(after.faces[star.slots[k]], star.faces[k]);
    EXPECT_EQ(star.moved, kNone);
  }
}

TEST(Star, LinkRunsOnceAroundOnBothSides) {
  const ThinShell thin(testing::torus(10, 8));
  const LinkedDraft draft(thin.draft());
  Star star;
  star.set_fibre(draft, 7);
  const std::vector<LinkEdge> link = star.link(draft);
  ASSERT_EQ(link.size(), 2 * star.faces.size());
  for (const Side side : {kInner, kOuter}) {
    Vec3d sum;
    std::set<double> from, to;
    for (const LinkEdge& edge : link) {
      if (edge.side != side) continue;
      sum += edge.to - edge.from;
      from.insert(edge.from.x + 3 * edge.from.y + 7 * edge.from.z);
      to.insert(edge.to.x + 3 * edge.to.y + 7 * edge.to.z);
    }
    EXPECT_EQ(sum, Vec3d{});
    EXPECT_EQ(from.size(), star.faces.size());
    EXPECT_EQ(from, to);
  }
}

}  // namespace
}  // namespace relief::detail
