// The safe state: whatever a device says, the force is finite, within the limits, and zero after a fault until
// lift-off.
#include "support/bad_readings.h"
#include "support/held_tools.h"
#include "support/shells.h"

#include <relief/haptics/servo.h>
#include <relief/haptics/touch.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <string>

namespace relief {
namespace {

using testing::displaced;
using testing::plane_shell;
using testing::sphere_shell;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

const Workspace kSpace = {.metres_per_unit = 0.1};
const ServoSettings kSettings = {.workspace = kSpace, .force = {.stiffness = 400, .damping = 1, .friction = 0.3}};

SnapshotPtr unit_sphere() {
  static const SnapshotPtr model = displaced(sphere_shell(2, 16), [](Vec3d p) { return (1 / length(p) - 0.8) / 0.4; });
  return model;
}

DeviceState reading(double t, Vec3d cursor) {
  DeviceState state;
  state.t = t;
  state.position = kSpace.to_device(cursor);
  return state;
}

class SafeState : public ::testing::TestWithParam<testing::BadReading> {};

/// A touch at a distance from the origin of a device that states a radius; both in m.
ServoSample felt_at(double distance, double stated_radius) {
  const SnapshotPtr model = unit_sphere();
  DeviceInfo device;
  device.workspace_radius = stated_radius;
  // The ball is moved so that its top is there.
  Servo servo({.workspace = {.metres_per_unit = 0.1, .device_origin = {0, 0, distance - 0.1}}}, device);
  ServoSample felt;
  for (int k = 0; k <= 20; ++k) {
    DeviceState state;
    state.t = 1 + 1e-3 * k;
    state.position = {0, 0, distance + 2e-3 - 2e-4 * k};
    felt = servo.step(*model, state);
  }
  return felt;
}

TEST(StatedWorkspace, FurtherThanFourRadiiIsASafeState) {
  for (const double radius : {0.02, 0.04, 0.075, 0.12, 0.15, 1.0}) {
    for (const double inside : {0.5, 1.0, 3.0, 3.9}) {
      const ServoSample felt = felt_at(inside * radius, radius);
      EXPECT_EQ(felt.flags & bit(ServoFault::BadPosition), 0U) << radius << " * " << inside;
      EXPECT_GT(length(felt.force), 0.1) << radius << " * " << inside;
    }
    for (const double outside : {4.2, 6.0}) {
      const ServoSample felt = felt_at(outside * radius, radius);
      EXPECT_NE(felt.flags & bit(ServoFault::BadPosition), 0U) << radius << " * " << outside;
      EXPECT_EQ(felt.force, Vec3d{}) << radius << " * " << outside;
    }
  }
  for (const double unknown : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_GT(length(felt_at(9, unknown).force), 0.1) << "10 m hold where no radius is stated";
  }
}

/// Where neither the device nor the settings know a limit, numbers stay numbers.
TEST(StatedLimits, WithoutAnyTheForceIsFiniteStill) {
  const SnapshotPtr model = unit_sphere();
  DeviceInfo device;
  for (double* limit : {&device.max_stiffness, &device.max_damping, &device.max_force, &device.max_force_rate,
                        &device.max_torque, &device.continuous_force, &device.max_work, &device.max_speed})
    *limit = kInf;
  ServoSettings settings = kSettings;
  settings.force.stiffness = settings.force.damping = settings.force.max_force = kInf;
  for (const bool guard : {true, false}) {
    settings.force.guard = guard;
    Servo servo(settings, device);
    double most = 0;
    for (int k = 0; k <= 60; ++k) {
      const ServoSample felt = servo.step(*model, reading(1 + 1e-3 * k, {0, 0, 1.02 - 1e-3 * std::min(k, 40)}));
      ASSERT_TRUE(std::isfinite(length(felt.force))) << guard << ' ' << k;
      most = std::max(most, felt.force.z);
    }
    EXPECT_GT(most, 1) << guard;
  }
}

TEST_P(SafeState, ZeroAtOnceAndUntilLiftOff) {
  const SnapshotPtr model = unit_sphere();
  Servo servo(kSettings, DeviceInfo{});
  const Vec3d above = {0, 0, 1.02}, pressed = {0, 0, 0.97};
  static_cast<void>(servo.step(*model, reading(0.999, above)));
  static_cast<void>(servo.step(*model, reading(1.000, above)));
  ServoSample felt;
  for (int k = 1; k <= 10; ++k) felt = servo.step(*model, reading(1 + 1e-3 * k, {0, 0, 1.02 - 5e-3 * k}));
  ASSERT_GT(felt.force.z, 0.5);
  ASSERT_EQ(felt.flags & bit(ServoFault::Latched), 0U);

  DeviceState bad = reading(1.011, pressed);
  GetParam().spoil(bad);
  felt = servo.step(*model, bad);
  EXPECT_EQ(felt.force, Vec3d{});
  EXPECT_NE(felt.flags & bit(GetParam().expected), 0U);
  EXPECT_NE(felt.flags & bit(ServoFault::Latched), 0U);
  EXPECT_TRUE(is_finite(felt.cursor) && is_finite(felt.contact_point) && is_finite(felt.normal));
  EXPECT_TRUE(is_finite(felt.velocity) && std::isfinite(felt.depth));

  // Still inside: good readings, no force. Times go on from wherever the bad one went.
  double t = std::isfinite(bad.t) && std::abs(bad.t) < 1e6 ? bad.t : 1.02;
  for (int k = 0; k < 50; ++k) {
    t += 1e-3;
    felt = servo.step(*model, reading(t, pressed));
    EXPECT_EQ(felt.force, Vec3d{}) << k;
    EXPECT_NE(felt.flags & bit(ServoFault::Latched), 0U) << k;
  }
  // Lift off, and it feels again.
  for (int k = 0; k < 10; ++k) felt = servo.step(*model, reading(t += 1e-3, {0, 0, 0.97 + 5e-3 * (k + 1)}));
  EXPECT_FALSE(felt.contact);
  EXPECT_EQ(felt.flags, 0U);
  for (int k = 0; k < 10; ++k) felt = servo.step(*model, reading(t += 1e-3, {0, 0, 1.02 - 5e-3 * (k + 1)}));
  EXPECT_GT(felt.force.z, 0.5);
}

INSTANTIATE_TEST_SUITE_P(Readings, SafeState, ::testing::ValuesIn(testing::bad_readings()),
                         [](const auto& test) { return test.param.name; });

TEST(Safety, StartInsideGivesNoForceUntilTheToolHasLeft) {
  const SnapshotPtr model = unit_sphere();
  // In a slab below the surface, and in the middle where no slab is.
  for (const Vec3d start : {Vec3d{0, 0, 0.95}, Vec3d{0, 0, 0.5}, Vec3d{0.1, -0.2, 0.1}, Vec3d{}}) {
    Servo servo(kSettings, DeviceInfo{});
    double t = 0;
    ServoSample felt;
    bool left = false;
    for (double z = start.z; z < 1.05; z += 0.01) {
      felt = servo.step(*model, reading(t += 1e-3, {start.x, start.y, z}));
      EXPECT_EQ(felt.force, Vec3d{}) << z;
      left = length(felt.cursor) > 1.001;
      if (!left && length(felt.cursor) < 0.999) {
        EXPECT_NE(felt.flags & bit(ServoFault::StartInside), 0U) << z;
      }
    }
    ASSERT_TRUE(left);
    EXPECT_EQ(felt.flags, 0U);
    for (double z = 1.05; z > 0.95; z -= 0.005) felt = servo.step(*model, reading(t += 1e-3, {start.x, start.y, z}));
    EXPECT_GT(length(felt.force), 0.5) << "and then it feels";
  }
}

TEST(Safety, BelowTheSlabsTheToolIsStillPushedOutTheWayItCameIn) {
  const SnapshotPtr model = unit_sphere();
  ServoSettings bare = kSettings;
  bare.force.guard = false;  // it goes in and out at 0.5 m/s
  Servo servo(bare, DeviceInfo{});
  double t = 0;
  for (const double step : {-0.005, 0.005})
    for (double z = step < 0 ? 1.05 : 0.3; step < 0 ? z > 0.3 : z < 1.05; z += step) {
      const ServoSample felt = servo.step(*model, reading(t += 1e-3, {0, 0, z}));
      EXPECT_EQ(felt.flags & (bit(ServoFault::SurfaceJumped) | bit(ServoFault::Latched)), 0U) << z;
      if (z < 0.97) {
        EXPECT_GT(felt.force.z, 0.5) << z;
        EXPECT_NEAR(felt.contact_point.z, 1, 0.01) << z;
      }
      if (z > 1.001) {
        EXPECT_EQ(felt.force, Vec3d{}) << z;
      }
    }
}

TEST(Safety, InThePapersContactComingUpThroughTheFloorGivesNoForce) {
  const SnapshotPtr model = unit_sphere();
  ServoSettings settings = kSettings;
  settings.force.paper_contact = true;
  Servo servo(settings, DeviceInfo{});
  double t = 0;
  for (double z = 1.05; z > 0.6; z -= 0.005) {
    const ServoSample felt = servo.step(*model, reading(t += 1e-3, {0, 0, z}));
    if (z > 0.85 && z < 0.95) {
      EXPECT_GT(felt.force.z, 1);
    }
    if (z < 0.75) {
      EXPECT_EQ(felt.force, Vec3d{}) << "below the slabs nothing holds the tool";
    }
  }
  std::uint32_t seen = 0;
  for (double z = 0.6; z < 0.99; z += 0.005) {
    const ServoSample felt = servo.step(*model, reading(t += 1e-3, {0, 0, z}));
    EXPECT_EQ(felt.force, Vec3d{}) << z;
    seen |= felt.flags;
  }
  EXPECT_NE(seen & bit(ServoFault::SurfaceJumped), 0U);
}

/// However far the hand goes in a tick: what it has come to through the surface is a contact, what it has come to from
/// below the slabs is none where it is deeper than a jump may be.
TEST(Safety, ThePapersContactKnowsAboveFromBelow) {
  const SnapshotPtr model = unit_sphere();  // of slabs from 0.8 to 1.2
  const auto jumped = [&](double from, double to, double jump) {
    const std::unique_ptr<Touch> paper = make_paper_touch();
    static_cast<void>(paper->step(*model, {{0, 0, from}, {}}, jump));
    const Touched felt = paper->step(*model, {{0, 0, to}, {}}, jump);
    EXPECT_TRUE(felt.touching) << from << " to " << to;
    EXPECT_NEAR(felt.depth, 1 - to, 0.01);
    return felt.jumped;
  };
  for (const double to : {0.82, 0.9, 0.96}) {
    EXPECT_FALSE(jumped(1.25, to, 0.01)) << to;
    for (const double from : {0.1, 0.7, 0.79}) {
      EXPECT_TRUE(jumped(from, to, 0.01)) << from << " to " << to;
      EXPECT_FALSE(jumped(from, to, 0.25)) << from << " to " << to;
    }
  }
}

TEST(Safety, AModelReplacedUnderTheToolLatches) {
  const SnapshotPtr full = unit_sphere();
  const SnapshotPtr carved = displaced(sphere_shell(2, 16), [](Vec3d p) { return (0.9 / length(p) - 0.8) / 0.4; });
  Servo servo(kSettings, DeviceInfo{});
  double t = 0;
  for (double z = 1.0; z > 0.89; z -= 0.002) static_cast<void>(servo.step(*carved, reading(t += 1e-3, {0, 0, z})));
  EXPECT_GT(servo.step(*carved, reading(t += 1e-3, {0, 0, 0.89})).force.z, 0.1);
  const ServoSample felt = servo.step(*full, reading(t += 1e-3, {0, 0, 0.89}));
  EXPECT_EQ(felt.force, Vec3d{}) << "10 mm of material appeared at once";
  EXPECT_NE(felt.flags & bit(ServoFault::SurfaceJumped), 0U);
  EXPECT_EQ(servo.step(*full, reading(t += 1e-3, {0, 0, 0.89})).force, Vec3d{});
}

/// As an edit does.
TEST(Safety, AnotherCageUnderAPressedToolLatchesOnlyWhereItsSurfaceHasRisenFar) {
  constexpr double kRadius = 0.1;
  const auto ball = [](const std::shared_ptr<const SlabMesh>& mesh, double radius) {
    return displaced(mesh, [=](Vec3d p) { return (radius / length(p) - 0.8) / 0.4; });
  };
  const auto mesh = sphere_shell(2, 16);
  enum class End { GoesOn, LetsGo, Latches, LatchesForGood };
  struct Case {
    std::string name;
    SnapshotPtr next;
    End end;
  };
  const Case cases[] = {
      {"the same", ball(mesh, 1), End::GoesOn},
      {"an edit, 1 mm higher", ball(mesh, 1.01), End::GoesOn},
      {"an edit, 2 mm lower", ball(mesh, 0.98), End::GoesOn},
      {"same shape, other cage", ball(sphere_shell(2, 16), 1), End::GoesOn},
      {"same shape, other n", ball(sphere_shell(2, 32), 1), End::GoesOn},
      {"same shape, other slabs", ball(sphere_shell(1, 16), 1), End::GoesOn},
      {"2.9 mm higher", ball(sphere_shell(2, 16), 1.029), End::GoesOn},
      {"3.1 mm higher", ball(sphere_shell(2, 16), 1.031), End::Latches},
      {"the same but 3.1 mm higher", ball(mesh, 1.031), End::Latches},
      {"2 mm lower", ball(sphere_shell(2, 16), 0.98), End::GoesOn},
      {"an edit, out of reach below", ball(mesh, 0.9), End::GoesOn},
      {"out of reach below", ball(sphere_shell(2, 16), 0.9), End::GoesOn},
      {"beside it", displaced(sphere_shell(2, 16, 0.8, 1.2, {0, 0, 3}), [](Vec3d) { return 0.5; }), End::LetsGo},
      {"all around it", displaced(sphere_shell(2, 16, 2.8, 3.2), [](Vec3d) { return 0.5; }), End::LatchesForGood}};
  for (const testing::HeldTool& held : testing::held_tools(kRadius))
    for (const Case& now : cases) {
      SCOPED_TRACE(now.name + held.name);
      const SnapshotPtr model = ball(mesh, 1);
      Servo servo({.workspace = kSpace, .tool = held.tool()}, DeviceInfo{});
      double t = 1;
      ServoSample felt;
      const auto to = [&](const SnapshotPtr& where, double z) {
        felt = servo.step(*where, reading(t += 1e-3, {0, 0, z + held.radius}));
      };
      for (int k = 0; k <= 50; ++k) to(model, 1.02 - 1e-3 * k);
      ASSERT_GT(felt.force.z, 0.5);
      to(now.next, 0.97);
      if (now.end == End::GoesOn || now.end == End::LetsGo) {
        for (int k = 0; k < 200; ++k) {
          ASSERT_EQ(felt.flags & (bit(ServoFault::SurfaceJumped) | bit(ServoFault::Latched)), 0U);
          ASSERT_TRUE(!felt.contact || felt.at.slab < now.next->slab_mesh().slab_count());
          const Vec3d before = felt.force;
          to(now.next, 0.97);
          ASSERT_LE(length(felt.force - before), 0.15) << "N, with what was damped";
          ASSERT_TRUE(now.end == End::GoesOn || felt.force == Vec3d{});
        }
        continue;
      }
      ASSERT_EQ(felt.force, Vec3d{});
      ASSERT_EQ(felt.flags, bit(ServoFault::SurfaceJumped) | bit(ServoFault::Latched));
      for (int k = 0; k < 50; ++k) {
        to(now.next, 0.97);
        ASSERT_EQ(felt.force, Vec3d{});
      }
      if (now.end == End::LatchesForGood) continue;
      for (int k = 0; k <= 30; ++k) to(now.next, 0.97 + 5e-3 * k);
      for (int k = 0; k <= 60; ++k) to(now.next, 1.12 - 5e-3 * k);
      EXPECT_GT(felt.force.z, 0.3);
      EXPECT_EQ(felt.flags & bit(ServoFault::Latched), 0U);
    }
}

TEST(Safety, AnotherCageAroundAFreeToolIsAStartInside) {
  // The tool is in the air of a smaller ball, and in the middle of the material of the next one.
  const SnapshotPtr small = displaced(sphere_shell(2, 16, 0.3, 0.5), [](Vec3d) { return 0.5; });
  for (const testing::HeldTool& held : testing::held_tools(0.05)) {
    Servo servo({.workspace = kSpace, .tool = held.tool()}, DeviceInfo{});
    ServoSample felt;
    for (int k = 0; k < 20; ++k) felt = servo.step(*small, reading(1e-3 * k, {0, 0, 0.7}));
    EXPECT_EQ(felt.flags, 0U) << held.name;
    felt = servo.step(*unit_sphere(), reading(0.02, {0, 0, 0.7}));
    EXPECT_EQ(felt.flags, bit(ServoFault::StartInside)) << held.name;
    for (int k = 1; k < 40; ++k) felt = servo.step(*unit_sphere(), reading(0.02 + 1e-3 * k, {0, 0, 0.7 + 5e-3 * k}));
    EXPECT_EQ(felt.force, Vec3d{}) << held.name;
  }
  // One whose next model is elsewhere goes on: a point, and a bar of which a ball around it would meet the surface.
  const std::array bar = {Vec3d{-0.6, 0, 0}, Vec3d{0.6, 0, 0}};
  for (const TouchTool& tool : {TouchTool{}, TouchTool{.points = bar}}) {
    Servo servo({.workspace = kSpace, .tool = tool}, DeviceInfo{});
    for (int k = 0; k < 20; ++k) static_cast<void>(servo.step(*small, reading(1e-3 * k, {0, 0, 1.3})));
    EXPECT_EQ(servo.step(*unit_sphere(), reading(0.02, {0, 0, 1.3})).flags, 0U);
  }
}

TEST(Safety, ACliffIsFelt) {
  // 8 mm at the hand from one sample to the next, crossed at 0.8 m/s: geometry, no fault.
  const SnapshotPtr model = displaced(plane_shell(4, 32), [](Vec3d p) { return p.x < 0.5 ? 0.1 : 0.9; });
  Servo servo(kSettings, DeviceInfo{});
  ServoSample felt;
  for (int k = 0; k < 100; ++k) {
    felt = servo.step(*model, reading(1e-3 * k, {0.4 + 8e-3 * std::min(k, 15), 0, 0.3}));
    EXPECT_EQ(felt.flags & (bit(ServoFault::SurfaceJumped) | bit(ServoFault::Latched)), 0U) << k;
  }
  EXPECT_GT(length(felt.force), 0.8) << "the nearest way out is sideways through the cliff, 2.4 mm";
}

TEST(Safety, MaterialThatGrowsSlowlyIsFelt) {
  // A deposit raises the surface under a resting tool by 0.1 mm at a time: that is feeling, no fault.
  Servo servo(kSettings, DeviceInfo{});
  const auto mesh = sphere_shell(1, 8, 0.6);
  double t = 0, last = 0;
  for (int k = 0; k < 20; ++k) {
    const double radius = 0.9 + 1e-3 * k;
    const SnapshotPtr model = displaced(mesh, [&](Vec3d p) { return (radius / length(p) - 0.6 / 0.9) / (0.6 / 0.9); });
    const ServoSample felt = servo.step(*model, reading(t += 1e-3, {0, 0, 0.9005}));
    EXPECT_EQ(felt.flags, 0U);
    EXPECT_GE(felt.force.z, last);
    last = felt.force.z;
  }
  EXPECT_GT(last, 0.3);
}

TEST(Safety, AnotherWorkspaceStartsAnew) {
  const SnapshotPtr model = unit_sphere();
  Servo servo(kSettings, DeviceInfo{});
  static_cast<void>(servo.step(*model, reading(0.001, {0, 0, 1.05})));
  ServoSettings moved = kSettings;
  moved.workspace.model_origin = {0, 0, -0.1};
  servo.set(moved);
  const ServoSample felt = servo.step(*model, reading(0.002, {0, 0, 1.05}));
  EXPECT_TRUE(felt.contact);
  EXPECT_EQ(felt.force, Vec3d{});
  EXPECT_NE(felt.flags & bit(ServoFault::StartInside), 0U);
}

TEST(Safety, SettingsThatAreNoNumbersGiveNoForce) {
  const SnapshotPtr model = unit_sphere();
  const auto press = [&](const ServoSettings& settings, const DeviceInfo& device) {
    Servo servo(settings, device);
    static_cast<void>(servo.step(*model, reading(0, {0, 0, 1.01})));
    return servo.step(*model, reading(0.001, {0, 0, 0.98}));
  };
  EXPECT_GT(press(kSettings, DeviceInfo{}).force.z, 0.5);
  for (const double bad : {kNan, -kInf, -5.0}) {
    ServoSettings settings = kSettings;
    settings.force.stiffness = settings.force.damping = settings.force.friction = bad;
    EXPECT_EQ(press(settings, DeviceInfo{}).force, Vec3d{});
    settings = kSettings;
    settings.force.max_force = bad;
    EXPECT_EQ(press(settings, DeviceInfo{}).force, Vec3d{});
    settings = kSettings;
    settings.workspace.metres_per_unit = bad;
    EXPECT_EQ(press(settings, DeviceInfo{}).force, Vec3d{});
    DeviceInfo device;
    device.max_force = bad;
    EXPECT_EQ(press(kSettings, device).force, Vec3d{});
  }
  ServoSettings settings = kSettings;
  settings.force.stiffness = kInf;
  EXPECT_LE(length(press(settings, DeviceInfo{}).force), DeviceInfo{}.max_force);
}

TEST(Safety, LimitsHoldThroughAMillionHostileReadings) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  constexpr int kSteps = 50'000;
#else
  constexpr int kSteps = 1'000'000;
#endif
  const SnapshotPtr model = unit_sphere();
  const SnapshotPtr other = displaced(sphere_shell(1, 5), [](Vec3d p) { return 0.3 + 0.2 * p.x; });
  const DeviceInfo device;
  Servo servo(kSettings, device);
  std::mt19937_64 random(2026);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto chance = [&](std::uint64_t one_in) { return random() % one_in == 0; };
  const auto any_double = [&] {
    const std::uint64_t bits = random();
    double value = 0;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  };
  double t = 0, last = 0;
  Vec3d cursor = {0, 0, 1.1};
  int forces = 0, faults = 0, changed = -kSteps;
  for (int k = 0; k < kSteps; ++k) {
    const double dt = chance(4) ? 1e-3 * (1 + unit(random)) : 1e-3;
    cursor += Vec3d{unit(random), unit(random), unit(random)} * (chance(10) ? 0.05 : 5e-3);
    if (length(cursor) > 1.2 || chance(200)) cursor = normalized(cursor) * 1.02;
    if (length(cursor) < 0.8) cursor = normalized(cursor + Vec3d{0, 0, 1e-9}) * 0.95;
    DeviceState state = reading(t += dt, cursor);
    state.has_velocity = chance(5);
    state.velocity = Vec3d{unit(random), unit(random), unit(random)} * 8.0;
    if (chance(300)) {
      double& victim = chance(3) ? state.t : chance(3) ? state.velocity[random() % 3] : state.position[random() % 3];
      victim = chance(2) ? any_double() : chance(2) ? kNan : kInf;
    }
    if (chance(5000)) {
      ServoSettings settings = kSettings;
      settings.force = {.stiffness = any_double(),
                        .damping = any_double(),
                        .friction = any_double(),
                        .static_friction = any_double(),
                        .max_force = chance(2) ? 3 * std::abs(unit(random)) : any_double()};
      servo.set(settings);
    } else if (chance(300)) {
      servo.set(kSettings);
    }
    const bool in_other = chance(5000);
    if (in_other) changed = k;
    const ServoSample felt = servo.step(in_other ? *other : *model, state);
    const double force = length(felt.force);
    ASSERT_TRUE(std::isfinite(force)) << k;
    const double most = servo.settings().force.max_force;
    ASSERT_LE(force, std::min(device.max_force, most > 0 ? most : 0)) << k;
    const double rate = device.max_force_rate * (felt.flags == 0 ? std::min(dt, 0.05) : 0.05);
    ASSERT_LE(force, last + rate + 1e-12) << k;
    // What is led over from one surface to another may have pushed another way.
    ASSERT_TRUE(dot(felt.force, felt.normal) >= -1e-12 || k - changed < 200) << k;
    ASSERT_TRUE(is_finite(felt.cursor) && is_finite(felt.contact_point) && is_finite(felt.velocity)) << k;
    if ((felt.flags & (bit(ServoFault::Latched) | bit(ServoFault::StartInside))) != 0) {
      ASSERT_EQ(felt.force, Vec3d{}) << k;
      ++faults;
    }
    if (!felt.contact) {
      ASSERT_EQ(felt.force, Vec3d{}) << k;
      ASSERT_EQ(felt.at.slab, kNoSlab) << k;
    }
    forces += force > 0 ? 1 : 0;
    last = force;
  }
  EXPECT_GT(forces, kSteps / 20) << "the readings must not be all bad";
  EXPECT_GT(faults, kSteps / 1000);
}

}  // namespace
}  // namespace relief
