#include <relief/convert/geometry/quadric.h>

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace relief::detail {
namespace {

TEST(Quadric, IsTheWeightedSumOfSquaredDistances) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> some(-1, 1);
  const auto point = [&] { return Vec3d{some(random), some(random), some(random)}; };
  for (int trial = 0; trial < 100; ++trial) {
    Quadric sum;
    const Vec3d p = point() * 3.0;
    double expected = 0, weights = 0;
    for (int k = 0; k < 7; ++k) {
      const Vec3d n = normalized(point()), on = point();
      const double weight = 0.1 + std::abs(some(random)), distance = dot(n, p - on);
      Quadric one;
      one.add_plane(n, on, weight);
      sum += one;
      expected += weight * distance * distance;
      weights += weight;
    }
    EXPECT_NEAR(sum.error(p), expected, 1e-12 * weights * 10);
    EXPECT_NEAR(sum.trace(), weights, 1e-12 * weights);
    sum *= 2;
    EXPECT_NEAR(sum.error(p), 2 * expected, 1e-12 * weights * 20);
  }
}

TEST(Quadric, OptimumOfThreePlanesIsTheirPoint) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> some(-1, 1);
  for (int trial = 0; trial < 100; ++trial) {
    // Three planes square to each other through one point, turned at random.
    const Vec3d corner = {some(random), some(random), some(random)};
    const Vec3d e = normalized(Vec3d{some(random), some(random), some(random)});
    const Vec3d f = normalized(cross(e, Vec3d{some(random), some(random), some(random)})), g = cross(e, f);
    Quadric q;
    for (const Vec3d n : {e, f, g}) q.add_plane(n, corner, 1);
    // The pull is 1e-3 of the trace, 3: so it is drawn by 0.003 / 1.003 of the way towards `near`, along each axis.
    const Vec3d near = corner + Vec3d{some(random), some(random), some(random)};
    const Vec3d expected = corner + (near - corner) * (0.003 / 1.003);
    EXPECT_LT(length(q.optimum(near) - expected), 1e-9);
    EXPECT_LT(length(q.optimum(corner) - corner), 1e-9);
  }
}

TEST(Quadric, OptimumStaysAlongWhatThePlanesLeaveOpen) {
  Quadric flat;
  flat.add_plane({0, 0, 1}, {0, 0, 5}, 2);
  const Vec3d p = flat.optimum({7, 8, 9});
  EXPECT_NEAR(p.x, 7, 1e-9);
  EXPECT_NEAR(p.y, 8, 1e-9);
  EXPECT_NEAR(p.z, 5, 0.01);
  EXPECT_EQ(Quadric{}.optimum({1, 2, 3}), (Vec3d{1, 2, 3}));
}

TEST(MergeEnds, StaysNearTheEdge) {
  // Two planes that nearly are one: their line is far off.
  Quadric q;
  q.add_plane(normalized(Vec3d{0.02, 0, 1}), {0, 0, 0}, 1000);
  q.add_plane(normalized(Vec3d{-0.02, 0, 1}), {0, 0, 3}, 1000);
  q.add_plane({0, 1, 0}, {0, 0, 0}, 1);
  const Vec3d a = {0, 0, 0}, b = {1, 0, 0};
  const Merge merge = merge_ends(q, a, b);
  EXPECT_LE(length(merge.place - (a + b) * 0.5), 1.5);
  EXPECT_DOUBLE_EQ(merge.cost, merge_cost(q, merge.place, 1));
  Quadric plane;
  plane.add_plane({0, 0, 1}, a, 1);
  EXPECT_GT(merge_cost(plane, a, 4), merge_cost(plane, a, 1)) << "in a plane the shorter edge goes first";
}

TEST(ShapeOf, IsOneForEqualSidesAndZeroForNone) {
  const auto shape = [](Vec3d a, Vec3d b, Vec3d c) { return shape_of(a, b, c, length(cross(b - a, c - a))); };
  EXPECT_NEAR(shape({0, 0, 0}, {2, 0, 0}, {1, std::sqrt(3.0), 0}), 1, 1e-12);
  EXPECT_EQ(shape({0, 0, 0}, {1, 0, 0}, {2, 0, 0}), 0);
  EXPECT_EQ(shape({1, 1, 1}, {1, 1, 1}, {1, 1, 1}), 0);
  EXPECT_LT(shape({0, 0, 0}, {10, 0, 0}, {5, 0.1, 0}), 0.05);
}

}  // namespace
}  // namespace relief::detail
