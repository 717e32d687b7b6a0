#include "support/shells.h"

#include <relief/devices/pointer_device.h>
#include <relief/haptics/servo.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <thread>
#include <vector>

namespace relief {
namespace {

/// On the plane z = 0, seen from +z.
PointerPlace on_plane(double x, double depth, std::uint32_t buttons = 0) {
  return {.over = true,
          .surface = {x, 0, 0},
          .normal = {0, 0, 1},
          .towards_eye = {0, 0, 1},
          .rise = 0.03,
          .depth = depth,
          .buttons = buttons};
}

DeviceState tick(PointerDevice& device) {
  DeviceState state;
  EXPECT_TRUE(device.read(state));
  return state;
}

/// A device whose tool has come to the place.
void settle(PointerDevice& device, int ticks = 200) {
  for (int k = 0; k < ticks; ++k) tick(device);
}

/// m/s per tick along x of a tool that follows a mouse at 0.2 m/s, events `period` ticks apart and up to `jitter` of
/// that late, after half a second.
std::vector<double> speeds(int period, double jitter) {
  constexpr double kSpeed = 0.2;
  PointerDevice device(on_plane(0, -1e-3));
  settle(device);
  std::vector<double> all;
  unsigned random = 7;
  double last = 0;
  int due = 1;
  for (int k = 1; k <= 1500; ++k) {
    if (k >= due) {
      device.point(on_plane(kSpeed * k * 1e-3, -1e-3));
      random = random * 1664525U + 1013904223U;
      due = k + period + static_cast<int>(jitter * period * ((random >> 8U) / 16777216.0) + 0.5);
    }
    const double x = tick(device).position.x;
    if (k > 500) all.push_back((x - last) * 1e3);
    last = x;
  }
  return all;
}

TEST(PointerDevice, AnEvenMouseGivesAnEvenWayWhateverItsRate) {
  for (const int period : {1, 2, 4, 8, 16}) {
    const std::vector<double> all = speeds(period, 0);
    const auto [least, most] = std::ranges::minmax(all);
    EXPECT_NEAR(least, 0.2, 1e-3) << "events every " << period << " ms";
    EXPECT_NEAR(most, 0.2, 1e-3) << "events every " << period << " ms";
  }
}

TEST(PointerDevice, UnevenEventsStillGiveAnEvenWay) {
  for (const int period : {4, 8, 16}) {
    const std::vector<double> all = speeds(period, 0.5);
    const auto [least, most] = std::ranges::minmax(all);
    EXPECT_GT(least, 0.2 * 0.8) << "events every " << period << " ms";
    EXPECT_LT(most, 0.2 * 1.2) << "events every " << period << " ms";
  }
}

TEST(PointerDevice, OneStepIsAStraightLineThatTakesItsLag) {
  PointerDevice device(on_plane(0, -1e-3));
  settle(device);
  device.point(on_plane(0.006, -1e-3));
  // The mouse had rested: the longest lag, 30 ticks.
  for (int k = 1; k <= 40; ++k) {
    const Vec3d at = tick(device).position;
    EXPECT_NEAR(at.x, 0.006 * std::min(k, 30) / 30, 1e-12) << "tick " << k;
    EXPECT_NEAR(at.z, 1e-3, 1e-12);
  }
}

/// The tool's lag after so many events, so many ticks apart, of a mouse that had rested before.
int lag_after(int events, int period) {
  PointerDevice device(on_plane(0, -1e-3));
  settle(device);
  for (int k = 0; k < events; ++k) {
    device.point(on_plane(0, -1e-3));
    for (int wait = 0; wait < period; ++wait) tick(device);
  }
  device.point(on_plane(0.006, -1e-3));
  int ticks = 1;
  while (tick(device).position.x < 0.006 - 1e-12 && ticks < 100) ++ticks;
  return ticks;
}

/// One and a half event intervals, from 4 ms to 30: the longest interval lately, a fiftieth less with each event.
TEST(PointerDevice, AFiftiethOfALateEventIsForgottenWithEachThatFollows) {
  EXPECT_EQ(lag_after(0, 4), 30);
  for (const int events : {10, 20, 30, 40})
    EXPECT_EQ(lag_after(events, 4), std::ceil(1.5 * 20 * std::pow(0.98, events))) << events;
  EXPECT_EQ(lag_after(200, 8), 12);
  EXPECT_EQ(lag_after(300, 1), 4);
}

/// Down to 5 mm above the surface at 2.5 m/s, and on as slowly as it follows a mouse that had rested.
TEST(PointerDevice, LandsFromFiveMillimetresAbove) {
  PointerPlace start = on_plane(0, -1e-3);
  start.rise = 0.031;
  PointerDevice device(start);
  for (int k = 1; k <= 50; ++k) {
    const double fast = std::max(0.031 - 2.5e-3 * k, 0.005), slow = std::clamp((k - 11) / 30.0, 0.0, 1.0);
    EXPECT_NEAR(tick(device).position.z, fast - 0.004 * slow, 1e-12) << k;
  }
}

/// A step away from the eye is a silhouette from 2 mm on, and three times what it goes aside.
TEST(PointerDevice, RisesOverWhatIsSteeperThanThreeToOne) {
  for (const double aside : {0.0, 0.004})
    for (const double more : {-2e-4, 2e-4}) {
      PointerDevice device(on_plane(0, -1e-3));
      settle(device);
      PointerPlace behind = on_plane(aside, -1e-3);
      behind.surface.z = -(2e-3 + 3 * aside + more);
      device.point(behind);
      double highest = 0;
      for (int k = 0; k < 50; ++k) highest = std::max(highest, tick(device).position.z);
      EXPECT_EQ(highest > 0.02, more > 0) << aside;
    }
}

TEST(PointerDevice, IsNeverFasterThanAContactFollows) {
  PointerDevice device(on_plane(0, -1e-3));
  Vec3d last = tick(device).position;
  for (int k = 0; k < 600; ++k) {
    if (k % 100 == 50) device.point(on_plane(k % 200 == 50 ? 0.1 : -0.1, 5e-3));
    const Vec3d at = tick(device).position;
    EXPECT_LE(length(at - last), 2.5e-3 * (1 + 1e-12)) << "tick " << k;
    last = at;
  }
}

TEST(PointerDevice, RisesOverASilhouetteAndComesDownBehindIt) {
  const PointerPlace near = on_plane(0, 2e-3);
  PointerPlace far = on_plane(0.004, 2e-3);
  far.surface.z = -0.06;
  far.rise = near.rise + 0.06;
  PointerDevice device(near);
  settle(device);
  device.point(far);
  double highest = -1;
  for (int k = 0; k < 300; ++k) {
    const Vec3d at = tick(device).position;
    const bool between = at.x > 1e-9 && at.x < 0.004 - 1e-9;
    EXPECT_TRUE(!between || at.z >= near.rise - 1e-9) << "tick " << k;
    highest = std::max(highest, at.z);
  }
  EXPECT_GE(highest, near.rise);
  EXPECT_NEAR(length(tick(device).position - Vec3d{0.004, 0, -0.062}), 0, 1e-12);
  // And a slope of the surface is none.
  PointerPlace slope = far;
  slope.surface += Vec3d{0.01, 0, 0.02};
  device.point(slope);
  for (int k = 0; k < 100; ++k) EXPECT_LE(tick(device).position.z, slope.surface.z) << "tick " << k;
}

TEST(PointerDevice, AClickBetweenTwoReadingsIsSeen) {
  PointerDevice device(on_plane(0, -1e-3));
  tick(device);
  device.point(on_plane(0, -1e-3, 1));
  device.point(on_plane(0, -1e-3, 0));
  const DeviceState state = tick(device);
  EXPECT_EQ(state.buttons, 0U);
  EXPECT_EQ(state.pressed, 1U);
  EXPECT_EQ(state.released, 1U);
  EXPECT_EQ(tick(device).pressed, 0U);
}

TEST(PointerDevice, TakesNoPlaceThatIsNone) {
  PointerDevice device(on_plane(0, -1e-3));
  settle(device);
  const Vec3d before = tick(device).position;
  PointerPlace bad = on_plane(0.01, 0);
  bad.surface.y = std::numeric_limits<double>::quiet_NaN();
  device.point(bad);
  EXPECT_EQ(tick(device).position, before);
  bad = on_plane(0, 1);
  bad.pressure = std::numeric_limits<double>::infinity();
  device.point(bad);
  settle(device);
  EXPECT_NEAR(tick(device).position.z, -0.02, 1e-12);
  EXPECT_EQ(tick(device).pressure, 0);
}

TEST(PointerResistance, TakesAShareOfTheMousesWayThatGrowsWithTheForce) {
  EXPECT_EQ(PointerResistance::gain(0), 1);
  EXPECT_NEAR(PointerResistance::gain(1.5), (1 + 0.35) / 2, 1e-12);
  EXPECT_NEAR(PointerResistance::gain(1e9), 0.35, 1e-6);
  EXPECT_EQ(PointerResistance::gain(std::numeric_limits<double>::quiet_NaN()), 1);
  PointerResistance resistance;
  const auto mouse = [](double x) { return Ray3d{{x, 0, 5}, {0.1 * x, 0, -1}}; };
  EXPECT_EQ(resistance.step(mouse(3), false, 2).origin.x, 3) << "free";
  EXPECT_EQ(resistance.step(mouse(4), true, 2).origin.x, 4) << "the press itself";
  const double share = PointerResistance::gain(2);
  const Ray3d held = resistance.step(mouse(6), true, 2);
  EXPECT_NEAR(held.origin.x, 4 + 2 * share, 1e-12);
  EXPECT_NEAR(held.direction.x, 0.1 * (4 + 2 * share), 1e-12);
  EXPECT_NEAR(resistance.step(mouse(7), true, 0).origin.x, 5 + 2 * share, 1e-12) << "no force, the whole way";
  EXPECT_EQ(resistance.step(mouse(7.5), false, 0).origin.x, 7.5) << "let go, it is where the mouse is";
}

// ---- With a model and the servo

SnapshotPtr ball(double radius) {
  return testing::displaced(testing::sphere_shell(3, 16), [=](Vec3d p) { return (radius / length(p) - 0.8) / 0.4; });
}

TEST(PointerPlace, LiesWhereTheRayMeetsTheModel) {
  const SnapshotPtr model = ball(1);
  const Workspace space = {.metres_per_unit = 0.05, .device_origin = {0.01, 0, 0}};
  PickHint hint;
  const PointerPlace hit = pointer_place(*model, {{0.3, 0.2, 5}, {0, 0, -2}}, space, hint);
  ASSERT_TRUE(hit.over);
  const Vec3d expected = {0.3, 0.2, std::sqrt(1 - 0.3 * 0.3 - 0.2 * 0.2)};
  EXPECT_LT(length(hit.surface - (expected * 0.05 + Vec3d{0.01, 0, 0})), 0.05 * 2e-3);
  EXPECT_GT(dot(hit.normal, expected), 0.999);
  EXPECT_EQ(hit.towards_eye, (Vec3d{0, 0, 1}));
  EXPECT_NEAR(hit.surface.z + hit.rise, 1.2 * 0.05 + 5e-3, 1e-9) << "in front of the shell, whose radius is 1.2";
  const PointerPlace beside = pointer_place(*model, {{3, 0, 5}, {0, 0, -1}}, space, hint);
  EXPECT_FALSE(beside.over);
  EXPECT_LT(length(beside.surface - Vec3d{3 * 0.05 + 0.01, 0, 0}), 1e-9);
}

TEST(PointerDevice, TheForceOfItsSpringIsStiffnessTimesDepth) {
  const SnapshotPtr model = ball(1);
  const Workspace space = {.metres_per_unit = 0.05};
  PickHint hint;
  PointerPlace place = pointer_place(*model, {{0, 0, 5}, {0, 0, -1}}, space, hint);
  place.depth = -1e-3;
  PointerDevice device(place);
  Servo servo({.workspace = space, .force = {.stiffness = 400, .damping = 0}}, device.info());
  const auto press = [&](double depth) {
    place.depth = depth;
    device.point(place);
    ServoSample felt;
    for (int k = 0; k < 400; ++k) {
      felt = servo.step(*model, tick(device));
      EXPECT_TRUE(device.write({felt.force, felt.torque}));
      EXPECT_EQ(felt.flags & bit(ServoFault::Latched), 0U);
    }
    return felt;
  };
  PointerFeel feel;
  EXPECT_FALSE(press(-1e-3).contact);
  ASSERT_TRUE(device.felt(feel));
  EXPECT_EQ(feel.force, Vec3d{});
  for (const double depth : {0.5e-3, 2e-3, 5e-3}) {
    const ServoSample felt = press(depth);
    ASSERT_TRUE(felt.contact);
    ASSERT_TRUE(device.felt(feel));
    EXPECT_EQ(feel.force, felt.force);
    EXPECT_NEAR(length(feel.force), 400 * depth, 0.02 * 400 * depth);
    EXPECT_GT(feel.force.z, 0.99 * length(feel.force));
  }
  ASSERT_TRUE(device.enable(false));
  press(5e-3);
  ASSERT_TRUE(device.felt(feel));
  EXPECT_EQ(feel.force, Vec3d{}) << "switched off";
}

TEST(PointerDevice, IsPointedAtFromAnotherThread) {
  PointerDevice device(on_plane(0, -1e-3));
  std::atomic<bool> over{false};
  std::thread hand([&] {
    for (int k = 0; k < 50'000; ++k) device.point(on_plane(1e-6 * k, 1e-6 * k));
    over = true;
  });
  while (!over) {
    const Vec3d at = tick(device).position;
    ASSERT_TRUE(is_finite(at));
    ASSERT_TRUE(device.write({at, {}}));
    PointerFeel feel;
    ASSERT_TRUE(device.felt(feel));
    ASSERT_EQ(feel.force, feel.position);
  }
  hand.join();
  settle(device);
  EXPECT_NEAR(tick(device).position.x, 1e-6 * 49'999, 1e-12);
}

}  // namespace
}  // namespace relief
