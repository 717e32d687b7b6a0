// How a device's workspace lies over the model, and that moving it in contact is not felt as a step.
#include "support/driver.h"
#include "support/held_tools.h"

#include <relief/haptics/placement.h>
#include <relief/haptics/workspace.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <utility>

namespace relief {
namespace {

using testing::flat_plane;
using testing::shaped;
using testing::sphere_field;
using testing::sphere_shell;

Quatd about(Vec3d axis, double angle) {
  const Vec3d v = normalized(axis) * std::sin(angle / 2);
  return {std::cos(angle / 2), v.x, v.y, v.z};
}

// ---- There and back

TEST(Workspace, TurnsScalesAndMovesThereAndBack) {
  const Workspace space = {.metres_per_unit = 0.01,
                           .device_origin = {0.1, 0.2, 0.3},
                           .model_origin = {5, 6, 7},
                           .rotation = about({0, 0, 1}, std::numbers::pi / 2)};
  EXPECT_LT(length(space.to_model({0.11, 0.2, 0.3}) - Vec3d{5, 7, 7}), 1e-12) << "the device's x is the model's y";
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int k = 0; k < 100; ++k) {
    Workspace any = space;
    any.rotation = about({unit(random), unit(random), 0.1 + unit(random)}, 3 * unit(random));
    const Vec3d place = {unit(random), unit(random), unit(random)}, other = {unit(random), unit(random), unit(random)};
    EXPECT_LT(length(any.to_device(any.to_model(place)) - place), 1e-12);
    EXPECT_LT(length(any.turned_to_model(place) - (any.to_model(place) - any.to_model({})) * 0.01), 1e-12);
    const Wrench wrench = any.command_to_device({any.turned_to_model(place), any.turned_to_model(other), 3});
    EXPECT_LT(length(wrench.force - place) + length(wrench.torque - other), 1e-12);
    EXPECT_EQ(wrench.gripper, 3);
    EXPECT_LT(length(any.through(place, other).to_model(place) - other), 1e-12);
    Workspace longer = any;
    longer.rotation = {5 * any.rotation.w, 5 * any.rotation.x, 5 * any.rotation.y, 5 * any.rotation.z};
    EXPECT_LT(length(longer.with_unit_rotation().to_model(place) - any.to_model(place)), 1e-9);
  }
}

TEST(Workspace, FitsTheModelAndGoesThereAndBack) {
  Box3d box;
  box.add(Vec3d{100, 200, 300});
  box.add(Vec3d{130, 240, 420});
  const Workspace fit = fit_workspace(DeviceInfo{}, box);
  EXPECT_NEAR(fit.metres_per_unit * diagonal(box), 0.15, 1e-12);
  EXPECT_EQ(fit.to_device(box.centre()), Vec3d{});
  EXPECT_LT(length(fit.to_model(fit.to_device({101, 239, 310})) - Vec3d{101, 239, 310}), 1e-9);
  const DeviceInfo falcon = {.workspace_radius = 0.04};
  EXPECT_NEAR(fit_workspace(falcon, box).metres_per_unit * diagonal(box), 0.08, 1e-12);
  const DeviceInfo large = {.workspace_radius = 0.5};
  EXPECT_NEAR(fit_workspace(large, box).metres_per_unit * diagonal(box), 0.15, 1e-12) << "no farther than a hand goes";
  EXPECT_NEAR(fit_workspace(DeviceInfo{}, box, 100).metres_per_unit, 0.15 / 100, 1e-12) << "the model's own size";
  EXPECT_GT(fit_workspace(DeviceInfo{}, Box3d{}).metres_per_unit, 0);
}

TEST(Workspace, FitsTheModelsBoxIntoTheDevices) {
  Box3d model;
  model.add(Vec3d{0, 0, 0});
  model.add(Vec3d{10, 20, 40});
  DeviceInfo flat;
  flat.workspace.add(Vec3d{-0.2, 0.1, -0.03});
  flat.workspace.add(Vec3d{0.2, 0.3, 0.03});
  const Workspace fit = fit_workspace(flat, model);
  EXPECT_NEAR(fit.metres_per_unit, 0.06 / 40, 1e-12) << "what is deep has the least room";
  EXPECT_LT(length(fit.to_device({5, 10, 20}) - Vec3d{0, 0.2, 0}), 1e-12);
  // The model's z along the device's x: there is more room, and the hand's reach is the limit.
  const auto turned = rotation_of_axes("y,z,x");
  ASSERT_TRUE(turned);
  const Workspace across = fit_workspace(flat, model, 0, *turned);
  EXPECT_NEAR(across.metres_per_unit, std::min({0.15 / diagonal(model), 0.4 / 40, 0.2 / 10, 0.06 / 20}), 1e-12);
  for (const Vec3d corner : {model.low, model.high})
    for (const auto& space : {fit, across}) {
      const Vec3d at = space.to_device(corner);
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_GE(at[k], flat.workspace.low[k] - 1e-12);
        EXPECT_LE(at[k], flat.workspace.high[k] + 1e-12);
      }
    }
}

TEST(Workspace, AMapOfAxesIsARotationOrRefused) {
  int rotations = 0;
  std::string order = "xyz";
  do {
    for (unsigned signs = 0; signs < 8; ++signs) {
      std::string map;
      std::array<Vec3d, 3> rows;
      for (std::size_t k = 0; k < 3; ++k) {
        const bool back = (signs >> k & 1U) != 0;
        map += std::string(k > 0 ? "," : "") + (back ? "-" : "") + order[k];
        rows[k][static_cast<std::size_t>(order[k] - 'x')] = back ? -1 : 1;
      }
      const auto rotation = rotation_of_axes(map);
      ASSERT_EQ(rotation.has_value(), dot(cross(rows[0], rows[1]), rows[2]) > 0) << map;
      if (!rotation) {
        EXPECT_NE(rotation.error().message.find("mirror"), std::string::npos);
        continue;
      }
      ++rotations;
      const Vec3d hand = {1, 2, 3}, model = rotation->turn(hand);
      for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(model[k], dot(rows[k], hand), 1e-14) << map;
    }
  } while (std::ranges::next_permutation(order).found);
  EXPECT_EQ(rotations, 24);
  EXPECT_EQ(*rotation_of_axes("+x,y,z"), Quatd{});
  for (const char* map : {"", "x", "x,y", "x,y,z,x", "x,y,z,", "x,y,w", "x,x,z", "xy,z", "-,y,z", "x,--y,z", "x y z"})
    EXPECT_FALSE(rotation_of_axes(map)) << map;
}

TEST(Workspace, ForcesGoBackAlongTheDevicesAxes) {
  const SnapshotPtr model = flat_plane();
  const auto rotation = rotation_of_axes("y,-x,z");  // the hand's left is the model's up
  ASSERT_TRUE(rotation);
  ServoSettings settings = testing::settings_with(400, 1, 0.3);
  testing::Driver straight(settings, testing::strong_device());
  settings.workspace.rotation = {3 * rotation->w, 3 * rotation->x, 3 * rotation->y, 3 * rotation->z};  // of any length
  testing::Driver turned(settings, testing::strong_device());
  settings.workspace.rotation = *rotation;
  ServoSample a, b;
  for (int k = 0; k < 200; ++k) {
    const Vec3d cursor = {0.3 + 5e-4 * k, 0.0105 - 1e-3 * std::min(k, 30), 0.5};
    a = straight.at(*model, cursor);
    DeviceState state;
    state.t = 1e-3 * (k + 1);
    state.position = settings.workspace.to_device(cursor);
    b = turned.servo().step(*model, state);
    ASSERT_LT(length(a.force - b.force), 1e-9) << k;
    ASSERT_LT(length(a.velocity - b.velocity), 1e-9);
    ASSERT_LT(length(rotation->turn(turned.servo().command().force) - b.force), 1e-12);
  }
  ASSERT_GT(a.force.y, 0.5);
  EXPECT_LT(turned.servo().command().force.x, -0.5) << "pushed to the left, which is up in the model";
  settings.workspace.rotation = {0, 0, 0, 0};
  turned.servo().set(settings);
  EXPECT_EQ(turned.at(*model, {0.5, -0.01, 0.5}).force, Vec3d{}) << "what is no rotation leads nowhere";
}

// ---- Moved in contact

/// A ball of radius 1 model unit, 0.1 m, under a tool at its top that is pressed with about 1 N; what happens to the
/// force while the workspace is moved.
class MovedInContact : public ::testing::TestWithParam<testing::HeldTool> {
 protected:
  MovedInContact()
      : servo_({.workspace = {.metres_per_unit = 0.1}, .force = {.friction = 0.3}, .tool = GetParam().tool()}, {}) {
    const double radius = GetParam().radius, down = GetParam().points.empty() ? 0.025 : 0.021;
    for (int k = 0; k <= 400; ++k) step({0, 0, 0.1 * (1.01 + radius - (0.01 + down) * std::min(1.0, k / 200.0))});
    EXPECT_NEAR(length(last_.force), 1, 0.35);
    most_ = 0;
  }
  /// A tick with the hand there, in m.
  const ServoSample& step(Vec3d hand) {
    DeviceState state;
    state.t = 1e-3 * ++tick_;
    state.position = hand_ = hand;
    const ServoSample now = servo_.step(*model_, state);
    most_ = std::max(most_, length(now.force - last_.force));
    flags_ |= now.flags;
    return last_ = now;
  }
  void set(const std::function<void(ServoSettings&)>& change) {
    ServoSettings settings = servo_.settings();
    change(settings);
    servo_.set(settings);
  }
  void expect_no_step() const {
    EXPECT_LE(most_, 0.05) << "N in a tick";
    EXPECT_EQ(flags_ & (bit(ServoFault::Latched) | bit(ServoFault::StartInside)), 0U);
  }

  SnapshotPtr model_ = shaped(sphere_shell(2, 16), sphere_field());
  Servo servo_;
  int tick_ = 0;
  Vec3d hand_;
  ServoSample last_;
  double most_ = 0;  ///< N, by which the force changed in a tick
  std::uint32_t flags_ = 0;
};
INSTANTIATE_TEST_SUITE_P(Tools, MovedInContact, ::testing::ValuesIn(testing::held_tools(0.04)),
                         [](const auto& test) { return "Tool" + std::to_string(test.index); });

TEST_P(MovedInContact, ByAHundredthOfAMillimetreInEachTick) {
  for (const Vec3d way : {Vec3d{1e-5, 0, 0}, Vec3d{0, 0, 1e-5}, Vec3d{0, 0, -1e-5}, Vec3d{-1e-5, 0, 0}})
    for (int k = 0; k < 200; ++k) {
      set([&](ServoSettings& s) { s.workspace.device_origin += way; });
      step(hand_);
    }
  expect_no_step();
  EXPECT_GT(length(last_.force), 0.5) << "it is back where it was";
}

TEST_P(MovedInContact, TheClutchHoldsCursorAndForce) {
  const ServoSample before = last_;
  const Vec3d from = hand_;
  set([](ServoSettings& s) { s.clutch.held = true; });
  double most_off = 0;
  for (int k = 1; k <= 500; ++k) {  // 30 mm along each axis in half a second, no faster at the ends
    const double share = k / 500.0;
    step(from + Vec3d{0.03, -0.03, 0.03} * (share * share * (3 - 2 * share)));
    ASSERT_EQ(last_.cursor, before.cursor) << k;
    most_off = std::max(most_off, length(last_.force - before.force));
  }
  EXPECT_LE(most_off, 0.02);
  EXPECT_EQ(flags_ & ~bit(ServoFault::RateClamped), 0U);
  set([](ServoSettings& s) { s.clutch.held = false; });
  for (int k = 0; k < 100; ++k) {
    step(hand_);
    ASSERT_LT(length(last_.cursor - before.cursor), 1e-12);
  }
  expect_no_step();
  step(hand_ + Vec3d{1e-4, 0, 0});
  EXPECT_LT(length(last_.cursor - before.cursor - Vec3d{1e-3, 0, 0}), 1e-12) << "and the hand leads again";
}

TEST_P(MovedInContact, TheClutchHoldsHowTheToolIsTurned) {
  const auto turned = [&](double angle) {
    DeviceState state;
    state.t = 1e-3 * ++tick_;
    state.position = hand_;
    state.orientation = about({0, 1, 0}, angle);
    state.has_orientation = true;
    return servo_.step(*model_, state);
  };
  for (int k = 0; k < 20; ++k) last_ = turned(1e-3 * k);
  const Quatd before = last_.orientation;
  set([](ServoSettings& s) { s.clutch.held = true; });
  for (int k = 20; k < 200; ++k) {
    const ServoSample now = turned(1e-3 * k);
    ASSERT_EQ(now.orientation, before);
    ASSERT_LT(length(now.force - last_.force) + length(now.torque - last_.torque), 1e-6);
    last_ = now;
  }
  set([](ServoSettings& s) { s.clutch.held = false; });
  const auto apart = [&](Quatd a, Quatd b) { return 2 * std::acos(std::min(1.0, std::abs(dot(a, b)))); };
  EXPECT_LT(apart(turned(0.199).orientation, before), 1e-6) << "and goes on from there";
  EXPECT_NEAR(apart(turned(0.209).orientation, before), 0.01, 1e-6);
}

TEST_P(MovedInContact, TheClutchTakesHoldOfAMovingHandWithoutAJerk) {
  // At 0.05 m/s outwards damping gives 0.05 N, and the spring changes by 0.02 N in a tick until then.
  for (const bool held : {true, false}) {
    for (int k = 0; k < 10; ++k) step(hand_ + Vec3d{0, 0, held ? 5e-5 : -5e-5});
    most_ = 0;
    set([&](ServoSettings& s) { s.clutch.held = held; });
    for (int k = 0; k < 10; ++k) step(hand_ + Vec3d{0, 0, held ? 5e-5 : -5e-5});
    EXPECT_LE(most_, held ? 0.025 : 0.045) << held;
  }
}

TEST_P(MovedInContact, TurnedAboutTheToolTheHandFeelsNoStep) {
  // By a right angle at once, with an amplifier that is slower than that.
  DeviceInfo slow;
  slow.max_force_rate = 100;
  ServoSettings settings = servo_.settings();
  servo_ = Servo(settings, slow);
  for (int k = 0; k < 300; ++k) step(hand_ + Vec3d{0, 0, k < 150 ? 5e-5 : -5e-5});
  for (int k = 0; k < 30; ++k) step(hand_);  // what damping gave goes with the hand's way
  Vec3d command = servo_.command().force;
  ASSERT_GT(length(command), 0.5);
  settings.workspace.rotation = about({0, 1, 0}, std::numbers::pi / 2);
  settings.workspace = settings.workspace.through(hand_, last_.cursor);
  servo_.set(settings);
  for (int k = 0; k < 100; ++k) {
    step(hand_);
    ASSERT_LT(length(servo_.command().force - command), 0.05) << k;
    command = servo_.command().force;
  }
  EXPECT_LT(command.x, -0.5) << "the model's z is against the device's x now";
}

TEST_P(MovedInContact, AButtonIsAClutch) {
  set([](ServoSettings& s) { s.clutch.buttons = 4; });
  const Vec3d cursor = last_.cursor;
  DeviceState state;
  for (int k = 0; k < 100; ++k) {
    state.t = 1e-3 * ++tick_;
    state.position = hand_ += Vec3d{0, 0, 1e-4};
    state.buttons = 5;
    ASSERT_EQ(servo_.step(*model_, state).cursor, cursor);
  }
}

TEST_P(MovedInContact, RecentredByTwentyMillimetres) {
  // Along the surface, off it, and into it: the device's present place becomes another one of the model.
  const double at = length(last_.cursor);
  for (const Vec3d centre :
       {Vec3d{std::sin(0.2), 0, std::cos(0.2)} * at, Vec3d{0, 0, at + 0.2}, Vec3d{0, 0, at}, Vec3d{0, 0, at - 0.2}}) {
    set([&](ServoSettings& s) {
      ++s.clutch.recentre;
      s.clutch.centre = centre;
    });
    step(hand_);
    EXPECT_LT(length(last_.cursor - centre), 1e-12);
    for (int k = 0; k < 300; ++k) step(hand_);
    EXPECT_EQ(length(last_.force) > 0.3, length(centre) < 1 + GetParam().radius);
    if (length(last_.force) == 0) {  // back in through the surface
      for (int k = 0; k < 1200; ++k) step(hand_ - Vec3d{0, 0, 2e-5});
      for (int k = 0; k < 30; ++k) step(hand_);  // what damping gave goes with the hand's way, on top of the next one
      EXPECT_GT(length(last_.force), 0.3);
    }
  }
  expect_no_step();
}

TEST_P(MovedInContact, ScaledToTwiceTheSizeInASecond) {
  // About the tool's own place, as one zooms in on what one touches, and about the model's middle.
  for (const bool about_tool : {true, false}) {
    if (about_tool) set([&](ServoSettings& s) { s.workspace = {0.1, hand_, last_.cursor, {}}; });
    for (int k = 1; k <= 1000; ++k) {
      set([&](ServoSettings& s) { s.workspace.metres_per_unit = (about_tool ? 0.1 : 0.2) * (1 + 1e-3 * k); });
      step(hand_);
    }
    expect_no_step();
    if (about_tool) {
      EXPECT_GT(length(last_.force), 1.2) << "the same depth is twice as long at the hand";
    }
  }
}

TEST_P(MovedInContact, Turned) {
  for (int k = 1; k <= 500; ++k) {
    set([&](ServoSettings& s) { s.workspace.rotation = about({0, 1, 0}, 2e-3 * k); });
    step(hand_);
  }
  expect_no_step();
  EXPECT_GT(length(last_.force), 0.5) << "the tool went round the ball";
  EXPECT_GT(last_.force.x, 0.4);
  EXPECT_LT(std::abs(servo_.command().force.x), 0.2) << "and the hand is pushed as before";
}

TEST_P(MovedInContact, TheHandIsFeltAtOnceMeanwhile) {
  // While the workspace goes along the surface, a hand that presses 0.1 mm further feels 0.04 N more in that tick.
  for (int k = 0; k < 60; ++k) {
    set([&](ServoSettings& s) { s.workspace.device_origin += Vec3d{0, 1e-5, 0}; });
    step(hand_);
  }
  const double before = last_.force.z;
  set([&](ServoSettings& s) { s.workspace.device_origin += Vec3d{0, 1e-5, 0}; });
  step(hand_ - Vec3d{0, 0, 1e-4});
  EXPECT_GT(last_.force.z - before, 0.03);
}

TEST(Clutch, TakesHoldOfTheDampingInFiveMilliseconds) {
  Placement placement({}, {});
  Readings::Judged now;
  now.has_position = true;
  EXPECT_EQ(placement.place(now, {}).loose, 0);
  for (const bool held : {true, false}) {
    placement.set({}, {.held = held});
    for (int k = 1; k < 8; ++k) {
      const double gone = std::min(1.0, k / 5.0);
      EXPECT_NEAR(placement.place(now, {}).loose, held ? gone : 1 - gone, 1e-12) << k;
    }
  }
}

TEST(MovedInTheAir, TheClutchHoldsTheCursorToTheBitAtAnyScale) {
  ServoSettings settings = testing::settings_with(400);
  settings.workspace = {.metres_per_unit = 0.0371, .model_origin = {0.3, 0.7, 0.1}, .rotation = about({1, 2, 3}, 0.7)};
  Servo servo(settings, {});
  DeviceState state;
  state.position = {0.011, 0.017, -0.013};
  const Vec3d cursor = servo.step(*flat_plane(), state).cursor;
  settings.clutch.held = true;
  servo.set(settings);
  for (int k = 1; k < 200; ++k) {
    state.t = 1e-3 * k;
    state.position = {0.03 * std::sin(0.1 * k), 0.02 * std::cos(0.17 * k), 0.0123 * std::sin(0.23 * k)};
    ASSERT_EQ(servo.step(*flat_plane(), state).cursor, cursor) << k;
  }
}

TEST(MovedInContact, WhatTheSpringGainsIsNotChargedToTheShadedNormal) {
  // Put 10 mm deeper, the spring holds more without the hand's doing. The normal stays the shaded one, which is not the
  // straight way out here.
  const SnapshotPtr model = shaped(sphere_shell(1, 4), sphere_field());
  const Vec3d way = normalized(Vec3d{0.31, 0.17, 1});
  const auto press = [&](testing::Driver& hand, double depth) {
    ServoSample felt;
    for (int k = 0; k <= 400; ++k) felt = hand.at(*model, way * (1.03 - (0.03 + depth) * std::min(1.0, k / 300.0)));
    return felt;
  };
  testing::Driver deep(testing::settings_with(400), testing::strong_device());
  testing::Driver moved(testing::settings_with(400), testing::strong_device());
  const ServoSample expected = press(deep, 0.13);
  ASSERT_GT(length(expected.normal - normalized(expected.contact_point - expected.cursor)), 5e-3);
  static_cast<void>(press(moved, 0.03));
  ServoSettings settings = moved.servo().settings();
  settings.clutch = {.recentre = 1, .centre = way * 0.87};
  moved.servo().set(settings);
  DeviceState state;
  state.position = settings.workspace.to_device(way * 0.97);
  ServoSample felt;
  for (int k = 1; k <= 200; ++k) {
    state.t = 0.401 + 1e-3 * k;
    felt = moved.servo().step(*model, state);
  }
  EXPECT_LT(length(felt.contact_point - expected.contact_point), 1e-6);
  EXPECT_LT(length(felt.normal - expected.normal), 1e-6);
}

TEST(MovedInTheAir, RecentredBeforeTheFirstReadingTheDeviceIsThereWithIt) {
  ServoSettings settings = testing::settings_with(400);
  Servo servo(settings, {});
  settings.clutch = {.recentre = 7, .centre = {0.5, 0.2, 0.5}};
  servo.set(settings);
  DeviceState state;
  state.position = {0.03, -0.02, 0.01};
  EXPECT_LT(length(servo.step(*flat_plane(), state).cursor - Vec3d{0.5, 0.2, 0.5}), 1e-12);
  EXPECT_LT(length(servo.workspace().to_model(state.position) - Vec3d{0.5, 0.2, 0.5}), 1e-12);
}

TEST(MovedInTheAir, ALeapIntoTheSolidIsAStartInside) {
  const SnapshotPtr model = flat_plane();
  testing::Driver hand(testing::settings_with(400), {});
  static_cast<void>(hand.at(*model, {0.5, 0.1, 0.5}));
  ServoSettings settings = hand.servo().settings();
  settings.clutch = {.recentre = 1, .centre = {0.5, -0.05, 0.5}};
  hand.servo().set(settings);
  DeviceState state;
  state.t = 0.002;
  state.position = {0.05, 0.01, 0.05};
  ServoSample felt = hand.servo().step(*model, state);
  EXPECT_EQ(felt.flags, bit(ServoFault::StartInside));
  EXPECT_EQ(felt.force, Vec3d{});
  for (int k = 0; k < 250; ++k) {
    state.t += 1e-3;
    state.position.y += k < 100 ? 1e-4 : -1e-4;
    felt = hand.servo().step(*model, state);
  }
  EXPECT_EQ(felt.flags & bit(ServoFault::StartInside), 0U) << "felt again, once it has left";
  EXPECT_GT(felt.force.y, 0.5);
}

TEST(MovedInTheAir, SlowlyOntoTheSurfaceIsATouch) {
  const SnapshotPtr model = flat_plane();
  testing::Driver hand(testing::settings_with(400), {});
  static_cast<void>(hand.at(*model, {0.5, 0.01, 0.5}));
  DeviceState state;
  state.t = 0.001;
  state.position = {0.05, 1e-3, 0.05};
  ServoSample felt;
  for (int k = 0; k < 300; ++k) {
    ServoSettings settings = hand.servo().settings();
    settings.workspace.device_origin.y += 1e-5;
    hand.servo().set(settings);
    state.t += 1e-3;
    felt = hand.servo().step(*model, state);
    ASSERT_EQ(felt.flags, 0U) << k;
  }
  EXPECT_NEAR(felt.force.y, 400 * 2e-3, 0.1);
}

TEST(ForceGuard, WhatTheModelWasMovedByIsNotTheHandsEnergy) {
  // A scale that goes up and down in contact, with the guard on: nothing to damp.
  const SnapshotPtr model = flat_plane();
  ServoSettings settings = testing::settings_with(400);
  settings.force.guard = true;
  testing::Driver hand(settings, {});
  for (int k = 0; k < 50; ++k) static_cast<void>(hand.at(*model, {0.5, 0.01 - 4e-4 * k, 0.5}));
  DeviceState state;
  state.t = 0.05;
  state.position = {0.05, -1e-3, 0.05};
  double leak = 1;  // J, what coming in has made
  for (int k = 0; k < 2000; ++k) {
    settings.workspace.metres_per_unit = 0.1 * (1 + 0.5 * std::sin(0.01 * k));
    settings.workspace.device_origin.y = 2e-4 * std::sin(0.03 * k);
    hand.servo().set(settings);
    state.t += 1e-3;
    const ServoSample felt = hand.servo().step(*model, state);
    ASSERT_LE(felt.leak, leak) << k;
    leak = felt.leak;
  }
}

}  // namespace
}  // namespace relief
