// The normal that leads to a point below a triangle, where the interpolated normals lean little, much, and over.
#include <relief/haptics/contact/leading_normal.h>

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace relief {
namespace {

/// A triangle that lies flat, over whose middle normals lean by so much along x, and more by 1 / radius per length.
struct Leaning {
  double slope, radius;
  [[nodiscard]] Vec3d at(double x) const { return {slope + x / radius, 1, 0}; }
  /// What leads to a point so deep below the middle.
  [[nodiscard]] Vec3d leading(double depth) const {
    SurfacePlace place;
    place.triangle.positions = {{{-1, 0, -1}, {0, 0, 2}, {1, 0, -1}}};
    place.weights = {1.0 / 3, 1.0 / 3, 1.0 / 3};
    return detail::leading_normal(place, {at(-1), at(0), at(1)}, normalized(at(0)), {0, -depth, 0});
  }
  /// At which place along x that is the normal.
  [[nodiscard]] double led_to(double depth) const {
    const Vec3d n = leading(depth);
    return (n.x / n.y - slope) * radius;
  }
};

TEST(LeadingNormal, ComesFromThePlaceWhoseOwnNormalLeadsToThePoint) {
  for (const double radius : {1.0, -2.0, 30.0})
    for (const double slope : {0.0, 0.1, -0.5, 1.0})
      for (const double depth : {1e-6, 1e-3, 0.03}) {
        const double place = depth * slope / (1 - depth / radius);  // where n(x) goes through the point
        const double twice = depth / radius * (depth / radius);     // after two steps towards it
        EXPECT_NEAR(Leaning(slope, radius).led_to(depth), place, 1.1 * twice * std::abs(place) + 1e-12) << slope;
      }
}

/// It would be at the end of the world for a normal that lies flat.
TEST(LeadingNormal, ThatPlaceIsNoFartherAwayThanTwiceTheDepth) {
  for (const double degrees : {61.0, 70.0, 80.0, 89.0, 89.99, -75.0})
    for (const double radius : {10.0, -10.0})
      for (const double depth : {1e-3, 0.02}) {
        const double slope = std::tan(degrees * std::numbers::pi / 180);
        const double far = std::abs(Leaning(slope, radius).led_to(depth));
        EXPECT_LE(far, 2 * depth * (1 + 1e-9)) << degrees;
        EXPECT_GE(far, 2 * depth * std::sin(60 * std::numbers::pi / 180)) << degrees;
      }
}

}  // namespace
}  // namespace relief
