#include <relief/base/place.h>
#include <relief/base/vec.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace relief {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Vec3, ArithmeticIsPerComponent) {
  constexpr Vec3d kA = {1, 2, 3}, kB = {10, 20, 40};
  static_assert(kA + kB == Vec3d{11, 22, 43});
  static_assert(kB - kA == Vec3d{9, 18, 37});
  static_assert(-kA == Vec3d{-1, -2, -3});
  static_assert(kA * 2.0 == 2.0 * kA);
  static_assert(kB / 10.0 == Vec3d{1, 2, 4});
  static_assert(dot(kA, kB) == 170);
  static_assert(cross(Vec3d{1, 0, 0}, Vec3d{0, 1, 0}) == Vec3d{0, 0, 1});
  Vec3d c = kA;
  c += kB;
  c -= kA;
  c *= 0.5;
  EXPECT_EQ(c, (Vec3d{5, 10, 20}));
  c[1] = 7;
  EXPECT_EQ(c.y, 7);
  EXPECT_EQ(c[2], c.z);
  EXPECT_EQ(length(Vec3d{2, 3, 6}), 7);
}

TEST(Vec3, NormalizedIsUnitOrLeavesWhatHasNoDirection) {
  EXPECT_NEAR(length(normalized(Vec3d{1e-150, 2e-150, -3e-150})), 1, 1e-12);
  EXPECT_EQ(normalized(Vec3d{0, 0, 5}), (Vec3d{0, 0, 1}));
  EXPECT_EQ(normalized(Vec3d{}), Vec3d{});
  EXPECT_EQ(normalized(Vec3d{kInfinity, 0, 0}).x, kInfinity);
  EXPECT_TRUE(std::isnan(normalized(Vec3d{kNan, 1, 1}).x));
}

TEST(Vec3, IsFiniteLooksAtEachComponent) {
  EXPECT_TRUE(is_finite(Vec3d{1e308, -1e308, 0}));
  for (const double bad : {kInfinity, -kInfinity, kNan}) {
    EXPECT_FALSE(is_finite(Vec3d{bad, 0, 0}));
    EXPECT_FALSE(is_finite(Vec3d{0, bad, 0}));
    EXPECT_FALSE(is_finite(Vec3d{0, 0, bad}));
  }
}

TEST(Box, IsEmptyUntilSomethingIsAdded) {
  Box3d box;
  EXPECT_TRUE(box.empty());
  EXPECT_EQ(diagonal(box), 0);
  EXPECT_FALSE(box.contains({0, 0, 0}));
  box.add(Vec3d{1, 2, 3});
  EXPECT_FALSE(box.empty());
  EXPECT_EQ(diagonal(box), 0);
  EXPECT_TRUE(box.contains({1, 2, 3}));
  box.add(Vec3d{-2, 2, 7});
  EXPECT_EQ(diagonal(box), 5);
  EXPECT_EQ(box.centre(), (Vec3d{-0.5, 2, 5}));
  EXPECT_EQ(box.extent(), (Vec3d{3, 0, 4}));
}

TEST(Box, MeetsWhenTheyShareAPoint) {
  const Box3d box = {{0, 0, 0}, {1, 1, 1}};
  EXPECT_TRUE(box.meets(Box3d{{1, 1, 1}, {2, 2, 2}}));
  EXPECT_TRUE(box.meets(Box3d{{0.2, 0.2, 0.2}, {0.3, 0.3, 0.3}}));
  EXPECT_FALSE(box.meets(Box3d{{1.1, 0, 0}, {2, 1, 1}}));
  EXPECT_FALSE(box.meets(Box3d{{0, 0, -2}, {1, 1, -0.1}}));
  EXPECT_FALSE(box.meets(Box3d{}));
}

TEST(Box, DistanceIsZeroInsideAndEuclideanOutside) {
  const Box3d box = {{0, 0, 0}, {1, 1, 1}};
  EXPECT_EQ(box.distance2({0.5, 1, 0}), 0);
  EXPECT_EQ(box.distance2({3, 0.5, 0.5}), 4);
  EXPECT_EQ(box.distance2({4, -4, 0.5}), 25);
}

TEST(Box, AnEmptyBoxAddsNothing) {
  Box3d box;
  box.add(Box3d{});
  EXPECT_TRUE(box.empty());
  box.add(Vec3d{1, 2, 3});
  box.add(Box3d{});
  EXPECT_EQ(box.low, box.high);
  EXPECT_EQ(box.low, (Vec3d{1, 2, 3}));
}

TEST(Place, HasTheDigitsThatFindItInWhatItLiesIn) {
  EXPECT_EQ(rounded_place({123456.789, -0.0004, 5.25}, 200), (Vec3d{123456.8, 0, 5.3}));
  EXPECT_FALSE(std::signbit(rounded_place({1, -0.0004, 1}, 200).y));
  EXPECT_EQ(rounded_place({123456.789, 1234.5, 0.4}, 5e5), (Vec3d{123457, 1235, 0}));
  EXPECT_NEAR(rounded_place({0.0123456, 0, 0}, 0.02).x, 0.01235, 1e-12);
  EXPECT_NEAR(rounded_place({12.3456, 0.00001, 0}, 0).x, 12.35, 1e-12) << "of the largest coordinate";
  EXPECT_EQ(rounded_place({}, 0), Vec3d{});
}

}  // namespace
}  // namespace relief
