// Which faces meet, beside every pair of them one by one.
#include "skin_support.h"

#include <relief/convert/geometry/triangle_contact.h>
#include <relief/convert/skin/face_meetings.h>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <numeric>
#include <set>

namespace relief::detail {
namespace {

using ::relief::testing::append;
using ::relief::testing::scaled;

constexpr Vec3d kShift = {2e5, 2e5, 2e5};  // the lattice begins at 0

LatticeTriangle corners(const ClosedSource& s, const Face& f) {
  return {s.points[f[0]], s.points[f[1]], s.points[f[2]]};
}

/// Every pair, with nothing but the exact test.
FacePairs all_pairs(const ClosedSource& s) {
  FacePairs pairs;
  for (std::uint32_t f = 0; f < s.faces.size(); ++f)
    for (std::uint32_t g = f + 1; g < s.faces.size(); ++g) {
      const LatticeTriangle a = corners(s, s.faces[f]), b = corners(s, s.faces[g]);
      if (has_area(a) && has_area(b) && meet_beyond_corners(a, b)) pairs.emplace_back(f, g);
    }
  return pairs;
}

FacePairs meetings_of(const ClosedSource& s) { return find_meetings(FaceTree(s.points, s.faces), {}); }

// 1,500 triangles: more than one piece that a thread takes, with thin and flat ones among them.
TEST(FaceMeetings, AreThoseOfAllPairs) {
  std::mt19937 random(5);
  std::uniform_int_distribution<int> place(0, 4000), size(-400, 400), flat(0, 19);
  ClosedSource source;
  for (std::uint32_t f = 0; f < 1500; ++f) {
    const Vec3d a{double(place(random)), double(place(random)), double(place(random))};
    const Vec3d b = a + Vec3d{double(size(random)), double(size(random)), double(size(random))};
    const Vec3d c = flat(random) == 0 ? a + (b - a) * 2.0  // without area
                                      : a + Vec3d{double(size(random)), double(size(random)), double(size(random))};
    for (const Vec3d p : {a, b, c}) source.points.push_back(snap(p));
    source.faces.push_back({3 * f, 3 * f + 1, 3 * f + 2});
  }
  const FacePairs wanted = all_pairs(source);
  ASSERT_GT(wanted.size(), 300U);
  EXPECT_EQ(meetings_of(source), wanted);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(meetings_of(source), wanted);
}

TEST(FaceMeetings, OfBoxesInOneAnotherAndOfSolidsThatTouch) {
  TriangleMesh boxes;
  for (int k = 0; k < 6; ++k) append(boxes, box_at({100.0 * k, 30.0 * k, 0}, {200, 200, 200}));
  append(boxes, box_at({100, 30, 0}, {200, 200, 200}));  // one twice
  append(boxes, box_at({2000, 0, 0}, {100, 100, 100}));  // apart
  append(boxes, box_at({2100, 0, 0}, {100, 100, 100}));  // and one that has its face
  const ClosedSource source = source_of(boxes);
  const FacePairs found = meetings_of(source);
  EXPECT_EQ(found, all_pairs(source));
  EXPECT_FALSE(found.empty());
}

TEST(FaceMeetings, ASoundSurfaceHasNoneAlthoughItsFacesShareCorners) {
  EXPECT_TRUE(meetings_of(source_of(scaled(::relief::testing::ball(20, 0.1), 1e5, kShift))).empty());
  // Neighbours by place, but not by number.
  const TriangleMesh ball = scaled(::relief::testing::ball(12), 1e5, kShift);
  TriangleMesh loose;
  for (const Triangle& t : ball.triangles) {
    const auto first = static_cast<std::uint32_t>(loose.positions.size());
    for (const std::uint32_t v : t) loose.positions.push_back(ball.positions[v]);
    loose.triangles.push_back({first, first + 1, first + 2});
  }
  EXPECT_TRUE(meetings_of(source_of(loose)).empty());
}

TEST(FaceMeetings, AQueryVisitsEachFaceWhoseBoxMeetsUntilToldToStop) {
  const ClosedSource source = source_of(soup(3, 60, 200));
  const FaceTree tree(source.points, source.faces);
  for (std::uint32_t f = 0; f < source.faces.size(); f += 7) {
    const Box3d box = tree.box_of(f);
    std::multiset<std::uint32_t> visited;
    std::size_t wanted = 0;
    tree.query(box, [&](std::uint32_t g) {
      visited.insert(g);
      return true;
    });
    for (std::uint32_t g = 0; g < source.faces.size(); ++g) {
      const Box3d other = tree.box_of(g);
      bool meets = true;
      for (std::size_t k = 0; k < 3; ++k) meets = meets && other.low[k] <= box.high[k] && box.low[k] <= other.high[k];
      if (!meets) continue;
      ++wanted;
      EXPECT_EQ(visited.count(g), 1U) << f << ' ' << g;
    }
    int stopped = 0;
    tree.query(box, [&](std::uint32_t) { return ++stopped < 2; });
    EXPECT_EQ(stopped, static_cast<int>(std::min<std::size_t>(2, wanted)));
  }
}

TEST(FaceMeetings, TheOrderInSpaceKeepsNeighboursTogether) {
  const ClosedSource source = source_of(scaled(::relief::testing::ball(40), 1e5, kShift));
  const std::vector<std::uint32_t> order = order_in_space(source.points, source.faces);
  std::vector<std::uint32_t> sorted = order;
  std::ranges::sort(sorted);
  for (std::uint32_t f = 0; f < sorted.size(); ++f) ASSERT_EQ(sorted[f], f);
  ASSERT_EQ(sorted.size(), source.faces.size());
  const auto way = [&](const std::vector<std::uint32_t>& faces) {
    double sum = 0;
    for (std::size_t k = 1; k < faces.size(); ++k)
      sum += length(to_double(source.points[source.faces[faces[k]][0]]) -
                    to_double(source.points[source.faces[faces[k - 1]][0]]));
    return sum;
  };
  std::vector<std::uint32_t> shuffled = sorted;
  std::mt19937 random(1);
  std::ranges::shuffle(shuffled, random);
  EXPECT_LT(way(order), 0.15 * way(shuffled));
}

TEST(FaceMeetings, StopWhenCancelled) {
  const ClosedSource source = source_of(soup(4, 60, 200));
  ASSERT_FALSE(meetings_of(source).empty());
  const std::atomic<bool> stop = true;
  EXPECT_TRUE(find_meetings(FaceTree(source.points, source.faces), {.report = {}, .cancel = &stop}).empty());
}

}  // namespace
}  // namespace relief::detail
