// The plant's parts one by one; what it does as a whole is acceptance test S1.
#include "support/bits.h"
#include "support/plants.h"

#include <relief/devices/simulated_hand.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace relief {
namespace {

using testing::at_origin;
using testing::bare;
using testing::kNobody;

TEST(Plant, CoulombFrictionStopsAfterTheClosedForm) {
  PlantPreset preset = bare(0.045, 0);
  preset.plant.coulomb = 0.26;
  SimulatedHand hand(preset, kNobody, at_origin);
  hand.set_state({}, {0.3, 0, 0});
  for (int k = 0; k < 200; ++k) ASSERT_TRUE(hand.write({}));
  EXPECT_EQ(hand.handle_velocity(), Vec3d{});
  EXPECT_NEAR(hand.handle_position().x, 0.045 * 0.3 * 0.3 / (2 * 0.26), 1e-6);
  // And below the break-away force nothing moves.
  const Vec3d rest = hand.handle_position();
  for (int k = 0; k < 1000; ++k) ASSERT_TRUE(hand.write({.force = {0, 0.259, 0}, .torque = {}}));
  EXPECT_EQ(hand.handle_position(), rest);
  for (int k = 0; k < 100; ++k) ASSERT_TRUE(hand.write({.force = {0, 0.27, 0}, .torque = {}}));
  EXPECT_GT(hand.handle_position().y, rest.y);
}

TEST(Plant, EncoderRoundsTheReadingOnly) {
  PlantPreset preset = bare(0.045, 0);
  preset.plant.encoder_step = 55e-6;
  SimulatedHand hand(preset, kNobody, at_origin);
  hand.set_state({1.234e-3, -7e-6, 0}, {});
  DeviceState state;
  ASSERT_TRUE(hand.read(state));
  EXPECT_DOUBLE_EQ(state.position.x, 22 * 55e-6);
  EXPECT_EQ(state.position.y, 0);
  EXPECT_EQ(hand.handle_position().x, 1.234e-3);
  EXPECT_FALSE(state.has_velocity);
}

TEST(Plant, AmplifierSaturatesRoundsAndLags) {
  PlantPreset preset = bare(1e6, 0);  // so heavy that only the amplifier moves
  preset.plant.max_force = 3.3;
  SimulatedHand saturated(preset, kNobody, at_origin);
  ASSERT_TRUE(saturated.write({.force = {6, 8, 0}, .torque = {}}));
  EXPECT_NEAR(saturated.motor_force().x, 3.3 * 0.6, 1e-12);
  EXPECT_NEAR(saturated.motor_force().y, 3.3 * 0.8, 1e-12);

  preset.plant.dac_step = 0.25;
  SimulatedHand coarse(preset, kNobody, at_origin);
  ASSERT_TRUE(coarse.write({.force = {1.1, -0.1, 0.13}, .torque = {}}));
  EXPECT_EQ(coarse.motor_force(), (Vec3d{1.0, 0, 0.25}));

  preset.plant.dac_step = 0;
  preset.plant.slew = 1000;
  SimulatedHand slow(preset, kNobody, at_origin);
  ASSERT_TRUE(slow.write({.force = {3, 0, 0}, .torque = {}}));
  EXPECT_NEAR(slow.motor_force().x, 1, 1e-12);

  preset.plant.slew = 0;
  preset.plant.lag = 0.5e-3;
  SimulatedHand lagging(preset, kNobody, at_origin);
  ASSERT_TRUE(lagging.write({.force = {1, 0, 0}, .torque = {}}));
  EXPECT_NEAR(lagging.motor_force().x, 1 - std::exp(-2.0), 1e-12);
  ASSERT_TRUE(lagging.write({.force = {std::numeric_limits<double>::infinity(), 0, 0}, .torque = {}}));
  EXPECT_TRUE(is_finite(lagging.motor_force()));
}

TEST(Plant, DelayAndJitterHoldTheNewestCommandThatArrived) {
  PlantPreset preset = bare(1e6, 0);
  for (int delay = 0; delay <= 3; ++delay) {
    preset.plant.delay_ticks = delay;
    SimulatedHand hand(preset, kNobody, at_origin);
    for (int k = 1; k <= 10; ++k) {
      ASSERT_TRUE(hand.write({.force = {double(k), 0, 0}, .torque = {}}));
      EXPECT_EQ(hand.motor_force().x, std::max(0, k - delay));
    }
  }
  preset.plant.delay_ticks = 1;
  preset.plant.jitter = {0, 2, 0, 0};
  SimulatedHand hand(preset, kNobody, at_origin);
  // Command k is given at tick k - 1 and arrives at k + jitter[k - 1]: the second is overtaken by the third.
  const double expected[] = {0, 1, 1, 3, 4, 5, 5, 7};
  for (int k = 1; k <= 8; ++k) {
    ASSERT_TRUE(hand.write({.force = {double(k), 0, 0}, .torque = {}}));
    EXPECT_EQ(hand.motor_force().x, expected[k - 1]) << k;
  }
}

TEST(Plant, ResonanceRingsAtItsFrequency) {
  PlantPreset preset = bare(0.1, 0);
  preset.plant.resonance = 80;
  preset.plant.resonance_damping = 0.02;
  SimulatedHand hand(preset, kNobody, at_origin);
  ASSERT_TRUE(hand.write({.force = {5, 0, 0}, .torque = {}}));  // a knock on the motor
  // The sum moves on evenly; the difference between handle and motor rings. The reading is the motor.
  int crossings = 0;
  double last = 0, first_at = 0, last_at = 0;
  DeviceState state;
  for (int k = 0; k < 500; ++k) {
    ASSERT_TRUE(hand.write({}));
    ASSERT_TRUE(hand.read(state));
    const double bent = hand.handle_position().x - state.position.x;
    if (k > 0 && (bent > 0) != (last > 0)) {
      const double when = k - bent / (bent - last);
      if (crossings == 0) first_at = when;
      last_at = when;
      ++crossings;
    }
    last = bent;
  }
  ASSERT_GT(crossings, 20);
  EXPECT_NEAR((crossings - 1) / (2e-3 * (last_at - first_at)), 80 * std::sqrt(1 - 0.02 * 0.02), 0.4);
}

TEST(Hand, APumpPushesOnAlongTheMotorsLineAndOnlyWhileItPushes) {
  const Hand pump = {.stiffness = 0, .damping = 0, .max_force = 0, .pump = 0.5};
  PlantPreset preset = bare(0.1, 0);
  for (const double speed : {0.2, -0.2}) {
    SimulatedHand hand(preset, pump, at_origin);
    hand.set_state({}, {speed, 0.3, 0});
    ASSERT_TRUE(hand.write({}));
    EXPECT_NEAR(hand.handle_velocity().x, speed, 1e-12) << "a motor at rest";
    const double start = hand.energy();
    ASSERT_TRUE(hand.write({.force = {1, 0, 0}, .torque = {}}));
    EXPECT_NEAR(hand.handle_velocity().x, speed + (1 + (speed > 0 ? 0.5 : -0.5)) / 0.1 * 1e-3, 1e-9);
    EXPECT_NEAR(hand.handle_velocity().y, 0.3, 1e-12);
    EXPECT_GT(hand.work().hand, 0) << "it helps both ways";
    EXPECT_NEAR(hand.work().hand + hand.work().motor, hand.energy() - start, 1e-12);
  }
}

/// With all that it has from 1 cm/s on, and less in proportion below; and not where the motor hardly pushes.
TEST(Hand, APumpPushesLessWhereTheHandleIsSlow) {
  const Hand pump = {.stiffness = 0, .damping = 0, .max_force = 0, .pump = 0.5};
  for (const double force : {0.9e-3, 1.1e-3}) {  // N, of the motor
    const PlantPreset preset = bare(0.1, 0);
    SimulatedHand hand(preset, pump, at_origin);
    double speed = 0.002;
    hand.set_state({}, {speed, 0, 0});
    ASSERT_TRUE(hand.write({}));
    ASSERT_TRUE(hand.write({.force = {force, 0, 0}, .torque = {}}));
    const int steps = std::max(preset.plant.substeps, 20);
    for (int k = 0; k < steps; ++k) speed += (force + (force > 1e-3 ? 0.5 * speed / 0.01 : 0)) / 0.1 * 1e-3 / steps;
    EXPECT_NEAR(hand.handle_velocity().x, speed, 1e-6) << force;
  }
}

TEST(Hand, APumpDrawsEnergyOutOfASpringThatComesLate) {
  const auto drawn = [](double pump) {
    PlantPreset preset = bare(0.05, 0.5);
    preset.plant.delay_ticks = 1;
    SimulatedHand hand(preset, {.stiffness = 200, .damping = 2, .max_force = 1, .pump = pump},
                       [](double) { return HandTarget{{-0.01, 0, 0}, 0}; });
    hand.set_state({0.01, 0, 0}, {});
    DeviceState state;
    for (int k = 0; k < 5000; ++k) {
      EXPECT_TRUE(hand.read(state));
      EXPECT_TRUE(hand.write({.force = {std::max(0.0, -500 * state.position.x), 0, 0}, .torque = {}}));
    }
    return hand.work().motor;
  };
  EXPECT_LT(drawn(0), 2e-3) << "the hand comes to rest";
  EXPECT_GT(drawn(1), 0.05);
}

TEST(Hand, ComesToTheTargetAndTrembles) {
  SimulatedHand hand(bare(0.045, 0.1), {.stiffness = 300, .damping = 3, .tremor = 1e-3},
                     [](double t) { return HandTarget{{0.02, t > 0.5 ? 0.01 : 0.0, 0}, t > 0.5 ? 1U : 0U}; });
  EXPECT_EQ(hand.handle_velocity(), Vec3d{});
  DeviceState state;
  double low = 1, high = -1;
  for (int k = 0; k < 2000; ++k) {
    ASSERT_TRUE(hand.write({}));
    ASSERT_TRUE(hand.read(state));
    EXPECT_EQ(state.buttons, state.t > 0.5 ? 1U : 0U);
    EXPECT_NEAR(state.t, 1e-3 * (k + 1), 1e-12);
    if (k > 1000) {
      low = std::min(low, state.position.x);
      high = std::max(high, state.position.x);
    }
  }
  EXPECT_NEAR(hand.handle_position().y, 0.01, 2e-3);
  EXPECT_NEAR((low + high) / 2, 0.02, 2e-4);
  // The answer of mass, damper and spring to a shake of 1 mm at 10 Hz.
  const double w = 2 * std::numbers::pi * 10, through = 300 / std::hypot(300 - 0.045 * w * w, 3.1 * w);
  EXPECT_NEAR((high - low) / 2, through * 1e-3, 2e-5);
}

TEST(Hand, NeverPullsHarderThanItWill) {
  SimulatedHand hand(bare(0.045, 0), {.stiffness = 300, .damping = 0, .max_force = 2, .tremor = 0},
                     [](double) { return HandTarget{{1, 0, 0}, 0}; });
  hand.set_state({}, {});
  for (int k = 0; k < 100; ++k) ASSERT_TRUE(hand.write({}));
  EXPECT_NEAR(hand.handle_velocity().x, 2 / 0.045 * 0.1, 1e-9);
  EXPECT_NEAR(hand.work().hand, hand.energy(), 1e-12);
}

TEST(Hand, IsDeterministic) {
  const auto run = [] {
    SimulatedHand hand(plant_presets().front(), {.tremor = 1e-3},
                       [](double t) { return HandTarget{{0.02 * std::sin(9 * t), 0, 0.01 * t}, 0}; });
    std::vector<DeviceState> path(500);
    for (DeviceState& state : path) {
      EXPECT_TRUE(hand.read(state));
      EXPECT_TRUE(hand.write({.force = {0, 2 * std::sin(500 * state.t), 0}, .torque = {}}));
    }
    return path;
  };
  const auto a = run(), b = run();
  for (std::size_t k = 0; k < a.size(); ++k) EXPECT_EQ(testing::bits(a[k].position), testing::bits(b[k].position)) << k;
}

TEST(Presets, AreCompleteAndSafe) {
  ASSERT_EQ(plant_presets().size(), 4U);
  for (const PlantPreset& preset : plant_presets()) {
    EXPECT_TRUE(preset.name.ends_with("-like")) << preset.name;
    EXPECT_EQ(preset.info.max_force, preset.plant.max_force) << preset.name;
    EXPECT_GE(preset.info.max_stiffness, 400) << preset.name << " must take the default stiffness";
    EXPECT_GE(preset.plant.substeps, 20);
  }
}

TEST(SimulatedHand, AnswersWhileItIsOpenAndFeelsWhileItsForcesAreOn) {
  SimulatedHand hand(bare(0.045, 0.1), kNobody, at_origin);
  const auto pushed_by = [&](double force) {
    EXPECT_TRUE(hand.write({.force = {0, force, 0}, .torque = {}}));
    for (int k = 0; k < 10; ++k) EXPECT_TRUE(hand.write({.force = {0, force, 0}, .torque = {}}));
    return hand.motor_force().y;
  };
  DeviceState state;
  EXPECT_TRUE(hand.status().connected && hand.status().powered && hand.status().forces_on);
  EXPECT_TRUE(hand.calibrate(ArmMotion::Forbidden)) << "it knows where it is";
  EXPECT_NEAR(pushed_by(1), 1, 1e-3);
  ASSERT_TRUE(hand.enable(false));
  EXPECT_FALSE(hand.status().forces_on);
  EXPECT_NE(hand.status().force_off, "");
  EXPECT_NEAR(pushed_by(1), 0, 1e-3);
  hand.close();
  EXPECT_FALSE(hand.status().connected);
  EXPECT_FALSE(hand.read(state));
  EXPECT_FALSE(hand.write({}));
  const Status enabled = hand.enable(true);
  ASSERT_FALSE(enabled);
  EXPECT_EQ(enabled.error().code, Errc::DeviceUnavailable);
  ASSERT_TRUE(hand.open());
  EXPECT_TRUE(hand.read(state));
  EXPECT_FALSE(hand.status().forces_on) << "until somebody switches them on";
  ASSERT_TRUE(hand.enable(true));
  EXPECT_NEAR(pushed_by(-1), -1, 1e-3);
  ASSERT_TRUE(hand.open());
  EXPECT_TRUE(hand.status().forces_on) << "it was open";
}

TEST(SimulatedHand, IsSilentWhenItsPlantSaysSoAndItsTimeGoesOn) {
  PlantPreset preset = bare(0.045, 0.1);
  preset.plant.silent_at = 0.01;
  preset.plant.silent_for = 0.02;
  SimulatedHand hand(preset, kNobody, at_origin);
  DeviceState state;
  int unanswered = 0;
  double t = -1;
  for (int k = 0; k < 50; ++k) {
    if (!hand.read(state)) {
      ++unanswered;
      EXPECT_FALSE(hand.write({}));
      EXPECT_NE(hand.status().trouble, "");
      EXPECT_FALSE(hand.status().connected);
      continue;
    }
    EXPECT_NEAR(state.t - t, unanswered == 20 && k == 30 ? 0.021 : 1e-3, k == 0 ? 2 : 1e-9);
    t = state.t;
    EXPECT_TRUE(hand.write({}));
    EXPECT_EQ(hand.status().trouble, "");
  }
  EXPECT_EQ(unanswered, 20);
}

}  // namespace
}  // namespace relief
