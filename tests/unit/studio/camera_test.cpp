// How a hand moves the camera: what must stay in its place does.
#include <gtest/gtest.h>
#include <studio/camera_control.h>

#include <cmath>
#include <numbers>

namespace relief::studio {
namespace {

constexpr double kWidth = 1600, kHeight = 900;

Camera camera(bool parallel = false) {
  Camera c{.eye = {3, 2, 10}, .target = {0.5, 1, 0}, .up = {0, 1, 0}, .field_of_view = 30};
  c.parallel = parallel;
  c.view_height = 4;
  return c;
}

double distance_of(QPointF a, QPointF b) { return std::hypot(a.x() - b.x(), a.y() - b.y()); }

TEST(Camera, ZoomingKeepsThePointUnderTheMouse) {
  for (const bool parallel : {false, true})
    for (const double factor : {0.8, 1.3}) {
      const Vec3d kept{1.2, 0.4, 0.7};
      const auto before = seen_at(camera(parallel), kept, kWidth, kHeight);
      const Camera nearer = zoom(camera(parallel), factor, kept, 5);
      const auto after = seen_at(nearer, kept, kWidth, kHeight);
      ASSERT_TRUE(before && after);
      EXPECT_LT(distance_of(*before, *after), 1e-6);
      EXPECT_NEAR(height_at_target(nearer) / height_at_target(camera(parallel)), factor, 1e-9);
    }
}

TEST(Camera, ZoomingEndsBeforeTheModelIsAPointOrAWall) {
  Camera c = camera();
  for (int k = 0; k < 400; ++k) c = zoom(c, 0.8, std::nullopt, 5);
  EXPECT_NEAR(height_at_target(c), 0.05, 1e-9);
  for (int k = 0; k < 400; ++k) c = zoom(c, 1.25, std::nullopt, 5);
  EXPECT_NEAR(height_at_target(c), 150, 1e-6);
}

TEST(Camera, PanningMovesTheTargetByTheHandsWay) {
  const auto before = seen_at(camera(), camera().target, kWidth, kHeight);
  const auto after = seen_at(pan(camera(), 0.1, -0.2), camera().target, kWidth, kHeight);
  ASSERT_TRUE(before && after);
  EXPECT_NEAR(after->x() - before->x(), 0.1 * kHeight, 1e-6);
  EXPECT_NEAR(after->y() - before->y(), -0.2 * kHeight, 1e-6);
}

TEST(Camera, TheTurntableKeepsDistanceAndUpAndStopsAtThePole) {
  Camera c = camera();
  const double reach = length(c.eye - c.target);
  for (int k = 0; k < 50; ++k) {
    c = orbit(c, 0.3, 0.2, true);
    EXPECT_NEAR(length(c.eye - c.target), reach, 1e-9);
    EXPECT_EQ(c.up, camera().up);
  }
  EXPECT_GT(dot(normalized(c.eye - c.target), c.up), 0.999);
  EXPECT_LT(dot(normalized(c.eye - c.target), c.up), 1.0) << "there is always a way back";
  // A turn to the right and back again is none.
  const Camera back = orbit(orbit(camera(), 0.7, 0, true), -0.7, 0, true);
  EXPECT_LT(length(back.eye - camera().eye), 1e-9);
}

TEST(Camera, ATurnToTheRightMovesTheModelsFrontToTheRight) {
  // The point of the model that is nearest to the eye goes with the hand, as if one held it.
  for (const bool turntable : {true, false}) {
    const Camera c = camera();
    const Vec3d front = c.target + normalized(c.eye - c.target);
    const auto before = seen_at(c, front, kWidth, kHeight);
    const auto right = seen_at(orbit(c, 0.2, 0, turntable), front, kWidth, kHeight);
    const auto down = seen_at(orbit(c, 0, 0.2, turntable), front, kWidth, kHeight);
    ASSERT_TRUE(before && right && down);
    EXPECT_GT(right->x(), before->x() + 5);
    EXPECT_GT(down->y(), before->y() + 5);
  }
}

TEST(Camera, AFreeTurnGoesOverThePole) {
  Camera c = camera();
  for (int k = 0; k < 40; ++k) c = orbit(c, 0, 2 * std::numbers::pi / 40, false);
  EXPECT_LT(length(c.eye - camera().eye), 1e-6) << "all the way round";
}

TEST(Camera, AnAxisViewLooksAlongItWithTheSamePicture) {
  for (const Vec3d up : {Vec3d{0, 1, 0}, Vec3d{0, 0, 1}}) {
    const Camera front = look_along(camera(), AxisView::Front, up);
    EXPECT_NEAR(height_at_target(front), height_at_target(camera()), 1e-9);
    EXPECT_EQ(front.up, up);
    const Vec3d back = picture_axes(front).back;
    EXPECT_NEAR(dot(back, up), 0, 1e-9);
    EXPECT_GT(dot(picture_axes(look_along(camera(), AxisView::Top, up)).back, up), 0.999);
    EXPECT_GT(dot(picture_axes(look_along(camera(), AxisView::Right, up)).back, Vec3d{1, 0, 0}), 0.999);
    EXPECT_NEAR(dot(picture_axes(look_along(camera(), AxisView::Back, up)).back, back), -1, 1e-9);
  }
}

TEST(Camera, TheLensChangesNothingAtTheTarget) {
  const Camera parallel = with_lens(camera(), true), again = with_lens(parallel, false);
  EXPECT_NEAR(height_at_target(parallel), height_at_target(camera()), 1e-9);
  EXPECT_LT(length(again.eye - camera().eye), 1e-9);
}

TEST(Camera, ARollTurnsThePictureAroundItsMiddle) {
  const Camera rolled = roll(camera(), 0.5);
  const auto middle = seen_at(rolled, camera().target, kWidth, kHeight);
  ASSERT_TRUE(middle);
  EXPECT_LT(distance_of(*middle, {kWidth / 2, kHeight / 2}), 1e-6);
  EXPECT_NEAR(dot(picture_axes(rolled).right, picture_axes(camera()).right), std::cos(0.5), 1e-9);
}

TEST(Camera, WhatIsSeenAtAPixelLiesOnItsRay) {
  for (const bool parallel : {false, true}) {
    const Camera c = camera(parallel);
    const Ray3d ray = pixel_ray(c, static_cast<int>(kWidth), static_cast<int>(kHeight), 1234, 321);
    const auto seen = seen_at(c, ray.origin + ray.direction * 7.0, kWidth, kHeight);
    ASSERT_TRUE(seen);
    EXPECT_LT(distance_of(*seen, {1234, 321}), 1e-6);
  }
}

}  // namespace
}  // namespace relief::studio
