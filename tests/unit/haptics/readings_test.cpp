// Which readings a force can be made of, and what a servo does with the others.
#include "support/driver.h"

#include <relief/haptics/readings.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace relief {
namespace {

using testing::flat_plane;

const Workspace kSpace = {.metres_per_unit = 0.1};

DeviceState reading(double t, Vec3d cursor) {
  DeviceState state;
  state.t = t;
  state.position = kSpace.to_device(cursor);
  return state;
}

/// Pressed 1 mm into a plane at t = 0.05; the next reading is due at 0.051.
class Pressed {
 public:
  explicit Pressed(const DeviceInfo& device = {}) : servo({.workspace = kSpace, .force = {.guard = false}}, device) {
    for (int k = 0; k <= 50; ++k) felt = servo.step(*model, reading(1e-3 * k, {0.5, 0.005 - 3e-4 * k, 0.5}));
  }
  ServoSample at(double t, double y = -0.01) { return felt = servo.step(*model, reading(t, {0.5, y, 0.5})); }

  SnapshotPtr model = flat_plane();
  Servo servo;
  ServoSample felt;
};

constexpr std::uint32_t kLatched = bit(ServoFault::Latched), kNoNews = bit(ServoFault::NoNews);

// ---- Readings that come twice

TEST(NoNews, HoldsTheLastForceForTwentyMilliseconds) {
  for (const double older : {0.0, 1e-6, 1e-3, 2e-3}) {
    Pressed hand;
    const Vec3d force = hand.felt.force;
    ASSERT_GT(force.y, 0.3);
    for (int k = 1; k <= 20; ++k) {
      hand.at(0.05 - older, -0.03);
      ASSERT_EQ(hand.felt.force, force) << older << ' ' << k << ": what it says is the last reading's";
      ASSERT_EQ(hand.felt.flags, kNoNews);
      ASSERT_TRUE(hand.felt.contact);
      ASSERT_EQ(hand.servo.command().force, force);
    }
    hand.at(0.05 - older);
    EXPECT_EQ(hand.felt.force, Vec3d{}) << older;
    EXPECT_EQ(hand.felt.flags, kNoNews | kLatched | bit(ServoFault::BadTime));
    hand.at(0.072);
    EXPECT_EQ(hand.felt.flags, kLatched) << "until the hand has lifted off";
    EXPECT_EQ(hand.felt.force, Vec3d{});
    for (int k = 0; k < 20; ++k) hand.at(0.073 + 1e-3 * k, -0.01 + 1e-3 * k);
    EXPECT_EQ(hand.felt.flags, 0U);
  }
}

TEST(NoNews, TheNextReadingIsOneTickLonger) {
  Pressed straight, held;
  const ServoSample expected = straight.at(0.054, -0.011);
  for (int k = 0; k < 3; ++k) held.at(0.05);
  EXPECT_EQ(held.at(0.054, -0.011).force, expected.force);
  EXPECT_EQ(held.felt.velocity, expected.velocity);
  EXPECT_EQ(held.felt.flags, 0U);
}

TEST(NoNews, OneInTenChangesNothing) {
  const SnapshotPtr model = testing::fine_sphere();
  const ServoSettings settings = {.workspace = kSpace, .force = {.friction = 0.3}};
  Servo once(settings, {}), again(settings, {});
  int held = 0;
  for (int k = 0; k < 3000; ++k) {
    const double turn = 5e-4 * k, r = 1.02 - 0.06 * std::sin(3e-3 * k);
    const DeviceState now = reading(1e-3 * k, {r * std::sin(turn), 0, r * std::cos(turn)});
    const ServoSample felt = once.step(*model, now);
    ASSERT_EQ(again.step(*model, now).force, felt.force) << k;
    if (k % 10 != 0) continue;
    DeviceState older = now;
    older.t -= k % 20 == 0 ? 1e-6 : 0;
    const ServoSample same = again.step(*model, older);
    ASSERT_EQ(same.force, felt.force) << k;
    ASSERT_EQ(same.flags & ~kNoNews, 0U) << k;
    held += (same.flags & kNoNews) != 0 ? 1 : 0;
  }
  EXPECT_EQ(held, 300);
}

TEST(NoNews, LongerStepsBackAndBadPositionsAreFaults) {
  for (const double back : {2.1e-3, 0.01, 1.0}) {
    Pressed hand;
    EXPECT_EQ(hand.at(0.05 - back).force, Vec3d{}) << back;
    EXPECT_EQ(hand.felt.flags, bit(ServoFault::BadTime) | kLatched);
  }
  Pressed hand;
  EXPECT_EQ(hand.at(0.05, std::numeric_limits<double>::quiet_NaN()).force, Vec3d{});
  EXPECT_NE(hand.felt.flags & bit(ServoFault::BadPosition), 0U);
}

TEST(NoNews, IsCountedInTheTicksOfAPushDevice) {
  Pressed hand(DeviceInfo{.rate = 4000, .pull = false});
  for (int k = 1; k <= 80; ++k) ASSERT_EQ(hand.at(0.05).flags, kNoNews) << k;
  EXPECT_NE(hand.at(0.05).flags & kLatched, 0U) << "20 ms at 4 kHz";
}

TEST(NoNews, AHeldForceIsACommandThatADelayedDeviceGets) {
  // One tick late: the motor pushes with the first force once that has been held for a tick, so the hand, going in,
  // puts in what the spring then holds, and nothing comes from nowhere.
  const SnapshotPtr model = flat_plane();
  DeviceInfo device = testing::strong_device();
  device.delay_ticks = 1;
  Servo servo({.workspace = kSpace, .force = {.damping = 0}}, device);
  static_cast<void>(servo.step(*model, reading(0, {0.5, 1e-3, 0.5})));
  static_cast<void>(servo.step(*model, reading(1e-3, {0.5, -5e-4, 0.5})));
  const double leak = servo.step(*model, reading(1e-3, {0.5, -5e-4, 0.5})).leak;
  const ServoSample felt = servo.step(*model, reading(2e-3, {0.5, -1e-3, 0.5}));
  const double pressed = 400 * 5e-5 * 5e-5;  // J, the first force times the way
  EXPECT_LT(felt.leak - leak, 0.7 * pressed);
}

TEST(NoNews, AHeldForceIsWithinLimitsThatWereLoweredMeanwhile) {
  Pressed hand;
  ServoSettings gentle = hand.servo.settings();
  gentle.force.max_force = 0.1;
  hand.servo.set(gentle);
  hand.at(0.05);
  EXPECT_EQ(hand.felt.flags, kNoNews);
  EXPECT_NEAR(length(hand.felt.force), 0.1, 1e-12);
}

// ---- Buttons

/// How often button 0 goes down while a device says these words, one a millisecond.
int presses(const std::vector<std::uint32_t>& words, double debounce) {
  Readings readings(DeviceInfo{});
  readings.set({.debounce = debounce});
  int count = 0;
  bool down = false;
  for (std::size_t k = 0; k < words.size(); ++k) {
    DeviceState state = reading(1e-3 * static_cast<double>(k), {});
    state.buttons = words[k];
    const bool now = (readings.judge(state, kSpace).buttons & 1U) != 0;
    count += now && !down ? 1 : 0;
    down = now;
  }
  return count;
}

TEST(Buttons, OneThatDropsOutIsOnePress) {
  std::vector<std::uint32_t> words(3000, 1);
  for (std::size_t k = 50; k < words.size(); k += 100) words[k] = 0;  // 1 ms in each 100
  EXPECT_EQ(presses(words, ReadingSettings{}.debounce), 1);
  EXPECT_EQ(presses(words, 0), 31);
}

TEST(Buttons, APressCountsAtOnceAndAReleaseOnceItHasLasted) {
  Readings readings(DeviceInfo{});
  const auto at = [&](int tick, std::uint32_t buttons) {
    DeviceState state = reading(1e-3 * tick, {});
    state.buttons = buttons;
    return readings.judge(state, kSpace).buttons;
  };
  EXPECT_EQ(at(0, 0), 0U);
  EXPECT_EQ(at(1, 5), 5U) << "at once";
  EXPECT_EQ(at(2, 4), 5U);
  for (int k = 3; k <= 20; ++k) ASSERT_EQ(at(k, 4), 5U) << k;
  EXPECT_EQ(at(22, 4), 4U) << "up since the tick at 2 ms, at least 20 ms";
  EXPECT_EQ(at(23, 0x704), 0x704U) << "what stands above the buttons is a number";
  EXPECT_EQ(at(24, 0x200), 0x204U) << "and is taken as it comes";
}

TEST(Buttons, GoOnWhereThereIsNoNews) {
  Readings readings(DeviceInfo{});
  DeviceState state = reading(1, {});
  state.buttons = 1;
  EXPECT_EQ(readings.judge(state, kSpace).buttons, 1U);
  state.buttons = 0;
  std::uint32_t last = 1;
  for (int k = 0; k < 21; ++k) last = readings.judge(state, kSpace).buttons;
  EXPECT_EQ(last, 0U) << "the ticks count, where the device's clock stands";
}

TEST(Buttons, AClickBetweenTwoReadingsIsNotLost) {
  for (const double debounce : {0.0, 20e-3}) {
    Readings readings(DeviceInfo{});
    readings.set({.debounce = debounce});
    DeviceState state = reading(0, {});
    EXPECT_EQ(readings.judge(state, kSpace).buttons, 0U);
    state = reading(1e-3, {});
    state.pressed = state.released = 2;
    EXPECT_EQ(readings.judge(state, kSpace).buttons, 2U) << debounce;
    EXPECT_EQ(readings.judge(reading(2e-3, {}), kSpace).buttons, debounce > 0 ? 2U : 0U);
    // And one that was let go and pressed again: two presses, where nothing is debounced.
    state = reading(3e-3, {});
    state.buttons = 2;
    static_cast<void>(readings.judge(state, kSpace));
    state.t = 4e-3;
    state.pressed = state.released = 2;
    EXPECT_EQ(readings.judge(state, kSpace).buttons, debounce > 0 ? 2U : 0U) << debounce;
    state.t = 5e-3;
    state.pressed = state.released = 0;
    EXPECT_EQ(readings.judge(state, kSpace).buttons, 2U);
  }
}

// ---- An arm that does not know where it is

/// The first tick, if any, in which an arm looks uncalibrated that turns its pen by `turn` rad per tick.
int first_doubt(DeviceInfo device, double turn, double drift, int ticks = 4000) {
  Readings readings(device);
  for (int k = 0; k < ticks; ++k) {
    DeviceState state = reading(1e-3 * k, {0.3, drift * k, 0});
    const double angle = turn * k;
    state.orientation = {std::cos(angle / 2), 0, std::sin(angle / 2), 0};
    state.has_orientation = turn != 0;
    const Readings::Judged now = readings.judge(state, kSpace);
    EXPECT_EQ(now.faults, 0U);
    if ((now.warnings & bit(ServoFault::Uncalibrated)) != 0) return k;
  }
  return -1;
}

TEST(Uncalibrated, APositionThatStandsStillWhileThePenTurns) {
  EXPECT_EQ(first_doubt({}, 1e-3, 0), 2001);
  EXPECT_EQ(first_doubt({}, 0, 0), -1) << "no orientation to compare with";
  EXPECT_EQ(first_doubt({}, 2.4e-5, 0), -1) << "the pen rests, too: 0.096 rad in 4 s";
  EXPECT_NEAR(first_doubt({}, 3e-5, 0), 0.1 / 3e-5, 3) << "once it has turned by 0.1 rad";
  EXPECT_EQ(first_doubt({}, 1e-3, 1e-9), -1) << "a hand trembles";
  EXPECT_EQ(first_doubt({.absolute = false}, 1e-3, 0), -1) << "a mouse rests while it is turned";
}

TEST(Uncalibrated, IsAWarningAndForcesGoOn) {
  Pressed hand;
  const auto turned = [&](int k, double y) {
    DeviceState state = reading(0.05 + 1e-3 * k, {0.5, y, 0.5});
    state.orientation = {std::cos(5e-4 * k), 0, std::sin(5e-4 * k), 0};
    state.has_orientation = true;
    return hand.servo.step(*hand.model, state);
  };
  for (int k = 1; k <= 2100; ++k) hand.felt = turned(k, -0.01);
  EXPECT_EQ(hand.felt.flags, bit(ServoFault::Uncalibrated));
  EXPECT_NEAR(hand.felt.force.y, 0.4, 1e-6);
  EXPECT_EQ(turned(2101, -0.0101).flags, 0U) << "until it moves";
}

// ---- What a reading may say

/// What is wrong with the second of two readings, `gap` apart.
std::uint32_t faults_of(Vec3d first, Vec3d second, double gap, const Workspace& space = {}) {
  Readings readings({.workspace_radius = 0});
  DeviceState state;
  state.position = first;
  EXPECT_EQ(readings.judge(state, space).faults, 0U);
  state.t = gap;
  state.position = second;
  return readings.judge(state, space).faults;
}

TEST(Bounds, OfPlaceAndTime) {
  const auto faults = [&](double t, double x, double metres_per_unit) {
    DeviceState state;
    state.t = t;
    state.position = {x, 0, 0};
    return Readings({.workspace_radius = 0}).judge(state, {.metres_per_unit = metres_per_unit}).faults;
  };
  EXPECT_EQ(faults(0, 9.99, 1), 0U);
  EXPECT_EQ(faults(0, 10.01, 1), bit(ServoFault::BadPosition)) << "m";
  EXPECT_EQ(faults(0, 0.99, 1e-100), 0U);
  EXPECT_EQ(faults(0, 1.01, 1e-100), bit(ServoFault::BadPosition)) << "whose square is no number";
  EXPECT_EQ(faults(0.99e12, 0, 1), 0U);
  EXPECT_EQ(faults(1.01e12, 0, 1), bit(ServoFault::BadTime));
}

TEST(Bounds, OfSpeed) {
  // 10 m/s, and a tenth of a millimetre in no time.
  for (const double gap : {1e-6, 1e-3, 0.04}) {
    EXPECT_EQ(faults_of({}, {10 * gap + 0.99e-4, 0, 0}, gap), 0U) << gap;
    EXPECT_EQ(faults_of({}, {10 * gap + 1.01e-4, 0, 0}, gap), bit(ServoFault::TooFast)) << gap;
  }
  const auto said = [&](double speed) {
    DeviceState state;
    state.velocity = {0, speed, 0};
    state.has_velocity = true;
    return Readings({.workspace_radius = 0}).judge(state, {}).faults;
  };
  EXPECT_EQ(said(9.99), 0U);
  EXPECT_EQ(said(10.01), bit(ServoFault::TooFast));
}

TEST(Bounds, OfAVelocityThatGoesNowhere) {
  for (const double speed : {0.049, 0.051}) {
    Readings readings({});
    int first = -1;
    for (int k = 0; k < 100; ++k) {
      DeviceState state = reading(1e-3 * k, {0.3, 0, 0});
      state.velocity = {0, 0, speed};
      state.has_velocity = true;
      if (readings.judge(state, kSpace).faults != 0 && first < 0) first = k;
    }
    if (speed < 0.05)
      EXPECT_EQ(first, -1) << "what a sensor says at rest";
    else
      EXPECT_NEAR(first, 21, 1) << "20 ms on";
  }
}

TEST(Velocity, FollowsWithThreeMilliseconds) {
  Readings readings({});
  for (int k = 0; k < 10; ++k) {
    const Readings::Judged now = readings.judge(reading(1e-3 * k, {0, 1e-2 * k, 0}), kSpace);
    EXPECT_NEAR(now.velocity.y, 1 - std::pow(0.75, k), 1e-9) << k;
  }
}

TEST(Period, OneLateTickInAThousandIsNone) {
  for (const int every : {700, 1500}) {
    Readings readings({});
    double t = 0, late = 0;
    for (int k = 1; k <= 6000; ++k) {
      t += k % every == 0 ? 5e-3 : 1e-3;
      static_cast<void>(readings.judge(reading(t, {}), kSpace));
      late = std::max(late, readings.late());
    }
    EXPECT_EQ(late > 0, every < 1000) << every;
  }
}

TEST(Period, TheStiffnessThatIsGoodForItMovesByHalfAPercentPerTick) {
  Readings readings({});
  double t = 0, last = 1;
  int moved = 0;
  for (int k = 0; k < 400; ++k) {
    t += k < 100 || k >= 200 ? 1e-3 : 3e-3;
    static_cast<void>(readings.judge(reading(t, {}), kSpace));
    const double change = std::abs(readings.softer() - std::exchange(last, readings.softer()));
    EXPECT_LT(change, 5.001e-3) << k;
    moved += change > 4.999e-3 ? 1 : 0;
  }
  EXPECT_GT(moved, 80) << "down to what is good for 3 ms, which is less than half";
}

TEST(Buttons, AreEightAndAboveThemStandsANumber) {
  Readings readings({});
  readings.set({.debounce = 5e-3});
  DeviceState state = reading(0, {});
  state.buttons = 0x5'80;
  EXPECT_EQ(readings.judge(state, kSpace).buttons, 0x5'80U);
  state = reading(1e-3, {});
  state.buttons = 0x6'00;
  EXPECT_EQ(readings.judge(state, kSpace).buttons, 0x6'80U) << "the eighth drops out, and the number is another";
}

// ---- What was between two readings

TEST(Interruptions, AreFaultsUntilLiftOff) {
  for (const bool lost : {false, true}) {
    Pressed hand;
    lost ? hand.servo.reconnected() : hand.servo.stalled();
    hand.at(0.051);
    EXPECT_EQ(hand.felt.force, Vec3d{});
    EXPECT_EQ(hand.felt.flags, bit(lost ? ServoFault::Reconnected : ServoFault::Stalled) | kLatched);
    EXPECT_EQ(hand.at(0.052).flags, kLatched);
    for (int k = 0; k < 20; ++k) hand.at(0.053 + 1e-3 * k, -0.01 + 1e-3 * k);
    for (int k = 0; k < 20; ++k) hand.at(0.073 + 1e-3 * k, 0.01 - 1e-3 * k);
    EXPECT_GT(hand.felt.force.y, 0.3);
  }
}

TEST(StatedWorkspace, ABoxHoldsAxisByAxis) {
  DeviceInfo device;
  device.workspace.add(Vec3d{-0.1, 0.05, 0});
  device.workspace.add(Vec3d{0.1, 0.15, 0});
  device.workspace_radius = 1e-3;
  Readings readings(device);
  double t = 0;
  const auto is_bad = [&](Vec3d position) {
    DeviceState state;
    state.t = t += 1;
    state.position = position;
    return (readings.judge(state, kSpace).faults & bit(ServoFault::BadPosition)) != 0;
  };
  EXPECT_FALSE(is_bad({0.39, 0.1, 0}));
  EXPECT_TRUE(is_bad({0.41, 0.1, 0})) << "four times the box, about its middle";
  EXPECT_FALSE(is_bad({0, 0.29, 0}));
  EXPECT_TRUE(is_bad({0, 0.31, 0}));
  EXPECT_FALSE(is_bad({0, -0.09, 0}));
  EXPECT_TRUE(is_bad({0, -0.11, 0}));
  EXPECT_FALSE(is_bad({0, 0.1, 5})) << "an axis that the box does not limit";
}

}  // namespace
}  // namespace relief
