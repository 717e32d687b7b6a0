// The servo with a ball and with a rigid tool: forces, torque, limits, start inside, a changed radius.
#include "support/driver.h"

#include <relief/haptics/contact/ball_proxy.h>

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <span>
#include <vector>

namespace relief {
namespace {

using testing::Driver;
using testing::fine_sphere;
using testing::flat_plane;
using testing::settings_with;
using testing::strong_device;

ServoSettings ball(double radius, double stiffness = 500, double friction = 0) {
  ServoSettings settings = settings_with(stiffness, 0, friction);
  settings.tool.radius = radius;
  return settings;
}

TEST(Tool, ABallFeelsThePlaneAtItsRadius) {
  const SnapshotPtr model = flat_plane();
  Driver drive(ball(0.03), strong_device());
  for (double y = 0.1; y > 0.0301; y -= 1e-3) EXPECT_EQ(length(drive.at(*model, {0.5, y, 0.5}).force), 0) << y;
  ServoSample s;
  for (double y = 0.03; y > 0.02; y -= 1e-4) s = drive.at(*model, {0.5, y, 0.5});
  ASSERT_TRUE(s.contact);
  EXPECT_NEAR(s.depth, 0.03 - s.cursor.y, 1e-5);
  EXPECT_NEAR(s.force.y, 500 * 0.1 * s.depth, 1e-6);
  EXPECT_NEAR(s.contact_point.y, 0, 1e-9);
  EXPECT_EQ(s.torque, Vec3d{});
}

TEST(Tool, ForceOfABallOnASphereIsThatOfTheLargerSphere) {
  const SnapshotPtr model = fine_sphere();
  Driver drive(ball(0.2), strong_device());
  for (double r = 1.4; r > 1.15; r -= 1e-3) static_cast<void>(drive.at(*model, {0, r, 0}));
  for (double angle = 0; angle < 1; angle += 1e-3) {
    const Vec3d out = {std::sin(angle), std::cos(angle), 0};
    const ServoSample s = drive.at(*model, out * 1.15);
    ASSERT_NEAR(length(s.force), 500 * 0.1 * 0.05, 0.01 * 500 * 0.1 * 0.05) << angle;
    ASSERT_GT(dot(s.normal, out), std::cos(0.01)) << angle;
  }
}

TEST(Tool, ABallThatStartsInTheSurfaceGivesNoForceUntilItIsOut) {
  const SnapshotPtr model = flat_plane();
  Driver drive(ball(0.03), strong_device());
  // The hand is above the surface, the ball reaches into it.
  ServoSample s = drive.at(*model, {0.5, 0.01, 0.5});
  EXPECT_TRUE(s.flags & bit(ServoFault::StartInside));
  EXPECT_EQ(s.force, Vec3d{});
  for (double y = 0.01; y < 0.04; y += 1e-3) s = drive.at(*model, {0.5, y, 0.5});
  EXPECT_EQ(s.flags, 0U);
  for (double y = 0.04; y > 0.02; y -= 1e-3) s = drive.at(*model, {0.5, y, 0.5});
  EXPECT_GT(s.force.y, 0);
}

/// A quick hand over rough ground: the ball is held back before it has come to the surface.
TEST(Tool, ABallIsFeltFromTheFirstTickInWhichItIsHeldBack) {
  const SnapshotPtr model = testing::displaced(testing::plane_shell(4, 32), [](Vec3d p) {
    return 0.5 + 0.05 * std::sin(20 * p.x) * std::cos(17 * p.z) + 0.01 * std::sin(90 * p.x + 40 * p.z);
  });
  for (int start = 0; start < 20; ++start) {
    Driver drive(ball(0.05), strong_device());
    int pressed = 0;
    for (int k = 0; k < 16; ++k) {
      const ServoSample s = drive.at(*model, {0.3 + 0.01 * start + 0.012 * k, 0.1 - 0.01 * k, 0.6 - 0.005 * k});
      if (BallProxy::clear(*model, s.cursor, 0.04)) continue;  // it may have come by the side of the ball
      ++pressed;
      ASSERT_TRUE(s.contact) << "way " << start << ", tick " << k;
      ASSERT_GT(length(s.force), 0);
      ASSERT_LT(s.at.slab, model->slab_mesh().slab_count());
    }
    EXPECT_GT(pressed, 6);
  }
}

TEST(Tool, ABallThatIsLateOnAFreeWayIsNotFelt) {
  const SnapshotPtr model = flat_plane();
  ServoSettings settings = ball(1e-3);
  settings.workspace.metres_per_unit = 0.01;
  Driver drive(settings, strong_device());
  for (const double y : {2e-3, 5e-4, 1.2e-3}) static_cast<void>(drive.at(*model, {0.1, y, 0.5}));
  // So fast along the plane, just above it, that a tick is not enough.
  const ServoSample s = drive.at(*model, {0.9, 1.2e-3, 0.5});
  EXPECT_EQ(s.flags, 0U);
  EXPECT_FALSE(s.contact);
  EXPECT_EQ(s.force, Vec3d{});
}

TEST(Tool, AnotherRadiusStartsAnew) {
  const SnapshotPtr model = flat_plane();
  Driver drive(ball(0.01), strong_device());
  ServoSample s;
  for (double y = 0.05; y > 0.02; y -= 1e-3) s = drive.at(*model, {0.5, y, 0.5});
  drive.servo().set(ball(0.04));
  s = drive.at(*model, {0.5, 0.02, 0.5});
  EXPECT_TRUE(s.flags & bit(ServoFault::StartInside));
  EXPECT_EQ(s.force, Vec3d{});
}

TEST(Tool, FrictionHoldsABall) {
  const SnapshotPtr model = flat_plane();
  Driver drive(ball(0.03, 500, 0.5), strong_device());
  for (double y = 0.1; y > 0.02; y -= 1e-3) static_cast<void>(drive.at(*model, {0.5, y, 0.5}));
  ServoSample s;
  for (double x = 0.5; x < 0.502; x += 1e-4) s = drive.at(*model, {x, 0.02, 0.5});
  EXPECT_LT(s.force.x, 0);
  EXPECT_GT(s.force.x, -0.5 * s.force.y);
  for (double x = 0.502; x < 0.6; x += 1e-3) s = drive.at(*model, {x, 0.02, 0.5});
  EXPECT_NEAR(s.force.x, -0.5 * s.force.y, 1e-3 * s.force.y);
}

struct Bar {
  std::vector<Vec3d> points;
  ServoSettings settings = settings_with(500);
  Bar() {
    for (int k = -5; k <= 5; ++k) points.push_back({0.04 * k, 0, 0});
    settings.tool.points = points;
  }
};

/// Heights and steps that binary numbers hold: one tick has the points on the surface, not in it.
TEST(Tool, PointsThatLandRightOnTheSurfaceAreNoFault) {
  const SnapshotPtr model = flat_plane();
  for (const std::size_t count : {1, 2}) {
    const std::vector<Vec3d> points = {{0, 0, 0}, {0, 0, 0.125}};
    ServoSettings settings = settings_with(500);
    settings.tool.points = std::span(points).first(count);
    Driver drive(settings, strong_device());
    ServoSample s;
    for (int k = 128; k >= -32; --k) {
      s = drive.at(*model, {0.375, k / 1024.0, 0.375});
      ASSERT_EQ(s.flags, 0U) << count << " points, height " << k << "/1024";
      if (k >= 0) {
        ASSERT_EQ(s.force, Vec3d{}) << k;
      }
      if (k == 0) {  // and stays there
        for (int tick = 0; tick < 10; ++tick) ASSERT_EQ(drive.at(*model, {0.375, 0, 0.375}).flags, 0U);
      }
    }
    EXPECT_GE(s.force.y, 0.99 * 500 * 0.1 * 32 / 1024.0) << count;
  }
}

TEST(Tool, ATiltedBarIsTurnedBackByItsTorque) {
  const SnapshotPtr model = flat_plane();
  const Bar bar;
  Driver drive(bar.settings, strong_device());
  const double half = 0.1;
  const Quatd q = {std::cos(half), 0, 0, std::sin(half)};
  ServoSample s;
  for (double y = 0.2; y > 0.03; y -= 5e-4) s = drive.at(*model, {0.5, y, 0.5}, q);
  ASSERT_TRUE(s.contact);
  EXPECT_GT(s.force.y, 0);
  // The left end alone touches: arm times force, in metres.
  const double arm = 0.2 * std::cos(2 * half) * 0.1;
  EXPECT_NEAR(s.torque.z, -arm * s.force.y, 0.05 * arm * s.force.y);
}

TEST(Tool, FrictionHoldsAPlateAgainstTurningOnTheSpot) {
  const SnapshotPtr model = flat_plane();
  std::vector<Vec3d> ring;  // of radius 0.1, lying flat
  for (int k = 0; k < 24; ++k)
    ring.push_back({0.1 * std::cos(k * std::numbers::pi / 12), 0, 0.1 * std::sin(k * std::numbers::pi / 12)});
  ServoSettings settings = settings_with(400, 0, 0.5);
  settings.tool.points = ring;
  Driver drive(settings, strong_device());
  for (double y = 0.05; y > -0.01; y -= 5e-4) static_cast<void>(drive.at(*model, {0.5, y, 0.5}));
  const auto turned = [&](double angle) {
    return drive.at(*model, {0.5, -0.01, 0.5}, {std::cos(angle / 2), 0, std::sin(angle / 2), 0});
  };
  // 0.1 units are 0.01 m.
  const double normal_force = turned(0).force.y, most = 0.5 * normal_force * 0.01;
  EXPECT_GT(normal_force, 0.3);
  ServoSample s;
  for (double angle = 0; angle < 0.5; angle += 1e-4) {
    s = turned(angle);
    ASSERT_LE(s.torque.y, 0) << angle;
    ASSERT_GE(s.torque.y, -most * (1 + 1e-6)) << angle;
  }
  EXPECT_NEAR(s.torque.y, -most, 1e-3 * most) << "it slides";
  // Where the hand turns back, the spring gives way at once and holds the other way.
  for (double angle = 0.5; angle > 0.3; angle -= 1e-4) s = turned(angle);
  EXPECT_NEAR(s.torque.y, most, 1e-3 * most);
  // A hand at rest: no drift.
  const double before = s.torque.y;
  for (int k = 0; k < 5000; ++k) s = turned(0.3);
  EXPECT_NEAR(s.torque.y, before, 1e-3 * most);
  EXPECT_NEAR(s.force.x, 0, 1e-3 * normal_force);
}

TEST(Tool, TorqueStaysWithinTheDevicesLimitAndBadOrientationsLatch) {
  const SnapshotPtr model = flat_plane();
  Bar bar;
  DeviceInfo device = strong_device();
  device.max_torque = 1e-4;
  Driver drive(bar.settings, device);
  const Quatd q = {std::cos(0.1), 0, 0, std::sin(0.1)};
  for (double y = 0.2; y > 0.02; y -= 5e-4) EXPECT_LE(length(drive.at(*model, {0.5, y, 0.5}, q).torque), 1e-4);
  const ServoSample s = drive.at(*model, {0.5, 0.02, 0.5}, {0, 0, 0, 0});
  EXPECT_TRUE(s.flags & bit(ServoFault::BadPosition));
  EXPECT_EQ(s.force, Vec3d{});
  EXPECT_EQ(s.torque, Vec3d{});
}

TEST(Tool, ARigidToolIsNeverStifferThanTheDeviceAllows) {
  const SnapshotPtr model = flat_plane();
  Bar bar;
  bar.settings.force.stiffness = 1e9;
  DeviceInfo device = strong_device();
  device.max_stiffness = 1000;
  Driver drive(bar.settings, device);
  ServoSample s;
  double before = 0, stiffest = 0;
  for (double y = 0.02; y > -0.02; y -= 1e-4) {
    s = drive.at(*model, {0.5, y, 0.5});
    stiffest = std::max(stiffest, (s.force.y - before) / (1e-4 * 0.1));
    before = s.force.y;
  }
  EXPECT_LE(stiffest, 1000 * (1 + 1e-6));
  EXPECT_GT(stiffest, 900);
  EXPECT_TRUE(s.flags & bit(ServoFault::StiffnessClamped));
}

/// The points of a rigid tool are for good, so settings that name none of them are those of the same tool.
TEST(Tool, SettingsWithADefaultToolLeaveARigidToolAsItWas) {
  const SnapshotPtr model = testing::displaced(
      testing::plane_shell(4, 32), [](Vec3d p) { return 0.5 + 0.05 * std::sin(20 * p.x) * std::cos(17 * p.z); });
  Bar bar;
  bar.settings.force.friction = 0.4;
  bar.settings.force.guard = true;
  Driver left_alone(bar.settings, strong_device()), set_anew(bar.settings, strong_device());
  bar.settings.tool = {};
  int felt = 0, turned = 0;
  for (int k = 0; k < 600; ++k) {
    if (k % 50 == 25) set_anew.servo().set(bar.settings);
    const Vec3d cursor = {0.4 + 2e-4 * k, std::max(-0.01, 0.1 - 1e-3 * k), 0.5 - 1e-4 * k};
    const double half = 2e-4 * k;
    const Quatd q = {std::cos(half), 0, std::sin(half), 0};
    const ServoSample a = left_alone.at(*model, cursor, q), b = set_anew.at(*model, cursor, q);
    ASSERT_EQ(a.contact, b.contact) << k;
    ASSERT_EQ(a.depth, b.depth) << k;
    ASSERT_EQ(a.contact_point, b.contact_point) << k;
    ASSERT_EQ(a.force, b.force) << k;
    ASSERT_EQ(a.torque, b.torque) << k;
    ASSERT_EQ(a.flags, b.flags) << k;
    felt += length(a.force) > 0 ? 1 : 0;
    turned += length(a.torque) > 0 ? 1 : 0;
  }
  EXPECT_GT(felt, 400);
  EXPECT_GT(turned, 400);
}

}  // namespace
}  // namespace relief
