#include "document_support.h"
#include "session_support.h"

#include <relief/devices/simulated_hand.h>
#include <relief/session/hand_control.h>
#include <relief/session/hand_monitor.h>

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

namespace relief {
namespace {

using testing::ball;
using testing::kMetres;
using testing::settings;

/// A tool that follows `way` (model units) at each reading, without a body, and keeps what it was commanded.
class ScriptedDevice final : public HapticDevice {
 public:
  explicit ScriptedDevice(std::function<Vec3d(int)> way) : way_(std::move(way)) { info_.name = "scripted"; }
  const DeviceInfo& info() const noexcept override { return info_; }
  bool read(DeviceState& state) noexcept override {
    const int k = reads.fetch_add(1);
    if (on_read) on_read(k);
    state = {.t = k * 1e-3, .position = way_(k) * kMetres, .velocity = {}, .buttons = buttons.load()};
    return true;
  }
  bool write(const Wrench& wrench) noexcept override {
    const auto k = static_cast<std::size_t>(writes.load());
    if (k < forces.size()) forces[k] = length(wrench.force);
    writes.store(static_cast<int>(k) + 1, std::memory_order_release);
    return true;
  }

  std::atomic<int> reads{0}, writes{0};
  std::atomic<std::uint32_t> buttons{0};
  std::function<void(int)> on_read;
  std::vector<double> forces = std::vector<double>(20'000);  ///< N, by command

 private:
  DeviceInfo info_;
  std::function<Vec3d(int)> way_;
};

/// Down to 0.05 below the surface in 400 ticks.
Vec3d pressed(int k) { return {0, 0, std::max(0.95, 1.35 - 1e-3 * k)}; }

void wait_until(const std::function<bool()>& done) {
  for (int k = 0; k < 4000 && !done(); ++k) std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

// ---- Forces off

TEST(ForcesOff, NoCommandAfterTheCallHasAForce) {
  ScriptedDevice device(pressed);
  Document document(ball());
  std::atomic<Session*> session{nullptr};
  device.on_read = [&](int k) {
    if (k == 700 && session.load() != nullptr) session.load()->set_forces(false);
  };
  Session made(device, document, settings());
  session = &made;
  wait_until([&] { return device.writes.load(std::memory_order_acquire) > 900; });
  ASSERT_TRUE(made.stop());
  ASSERT_GT(device.writes.load(), 900);
  EXPECT_GT(device.forces[699], 0.5);
  for (std::size_t k = 700; k < 900; ++k) ASSERT_EQ(device.forces[k], 0) << "command " << k;
  EXPECT_NE(made.stats().flags & bit(ServoFault::ForcesOff), 0U);
}

TEST(ForcesOff, FromAnotherThreadWithinATickAndBackAfterLiftingOff) {
  std::atomic<bool> lifted{false};
  ScriptedDevice device([&lifted, reach = 1.35](int) mutable -> Vec3d {
    reach += std::clamp((lifted.load() ? 1.2 : 0.95) - reach, -1e-3, 1e-3);
    return {0, 0, reach};
  });
  Document document(ball());
  Session session(device, document, settings());
  const auto writes = [&] { return device.writes.load(std::memory_order_acquire); };
  wait_until([&] { return writes() > 600; });
  HandControl control(session, device.info(), settings().servo);
  control.forces(false);
  const int at = writes();
  EXPECT_FALSE(control.forces());
  wait_until([&] { return writes() > at + 100; });
  control.forces(true);
  const int on = writes();
  wait_until([&] { return writes() > on + 100; });
  const int still_in = writes();
  lifted = true;
  wait_until([&] { return writes() > still_in + 400; });
  lifted = false;
  const int again = writes();
  wait_until([&] { return writes() > again + 400; });
  ASSERT_TRUE(session.stop());
  EXPECT_GT(device.forces[static_cast<std::size_t>(at - 1)], 0.5);
  for (int k = at + 1; k < still_in; ++k) ASSERT_EQ(device.forces[static_cast<std::size_t>(k)], 0) << "command " << k;
  EXPECT_GT(device.forces[static_cast<std::size_t>(again + 390)], 0.5) << "it came back";
}

// ---- Settings

TEST(HandControl, TheForceLimitHoldsAndIsNeverAboveTheDevices) {
  ScriptedDevice device(pressed);
  Document document(ball());
  Session session(device, document, settings());
  HandControl control(session, device.info(), settings().servo);
  EXPECT_EQ(control.force_limit(), device.info().max_force);
  control.limit_force(100);
  EXPECT_EQ(control.force_limit(), device.info().max_force);
  control.limit_force(0.4);
  EXPECT_TRUE(control.flush());
  wait_until([&] { return device.writes.load(std::memory_order_acquire) > 700; });
  ASSERT_TRUE(session.stop());
  EXPECT_NEAR(device.forces[690], 0.4, 1e-9);
  for (std::size_t k = 100; k < 700; ++k) ASSERT_LE(device.forces[k], 0.4) << "command " << k;
}

TEST(HandControl, ScaleRecentreAndClutchKeepTheToolWhereTheyShould) {
  ScriptedDevice device([](int) -> Vec3d { return {0, 0, 1.3}; });
  Document document(ball());
  HandMonitor monitor;
  Session::Settings with = settings();
  with.on_tick = [&](const ServoTick& tick) { monitor.tick(tick); };
  Session session(device, document, with);
  HandControl control(session, device.info(), with.servo);
  const auto next = [&](int ticks) {
    const std::uint64_t start = monitor.taken();
    wait_until([&] { return monitor.drain(), monitor.taken() > start + static_cast<std::uint64_t>(ticks); });
    return monitor.last();
  };
  const Vec3d before = next(50).cursor;
  EXPECT_NEAR(length(before - Vec3d{0, 0, 1.3}), 0, 1e-9);
  control.scale(2, before);
  EXPECT_NEAR(length(next(50).cursor - before), 0, 1e-9) << "the tool stays";
  control.recentre({0, 1.25, 0});
  EXPECT_NEAR(length(next(50).cursor - Vec3d{0, 1.25, 0}), 0, 1e-9);
  control.scale(1e9, {0, 1.25, 0});
  EXPECT_EQ(control.scale(), HandControl::kMostScale);
  control.clutch(true);
  EXPECT_TRUE(control.clutched());
  EXPECT_NEAR(length(next(50).cursor - Vec3d{0, 1.25, 0}), 0, 1e-9);
  ASSERT_TRUE(session.stop());
  EXPECT_EQ(monitor.missing(), session.stats().servo.dropped);
}

TEST(Session, TheHandAndTheMouseNeverMix) {
  // The hand presses and slides with the button down while another source draws strokes at the other side.
  ScriptedDevice device([](int k) -> Vec3d {
    const double side = std::max(0, k - 450) * 2e-4;
    return Vec3d{std::sin(side), 0, std::cos(side)} * length(pressed(k));
  });
  testing::Events events;
  Document document(ball(), events.settings());
  Session session(device, document, settings());
  session.set_brush({.tool = Tool::Paint, .radius = 0.15});  // so that the contact never ends
  int posted = 0;
  for (; posted < 6; ++posted) {
    const int start = device.writes.load(std::memory_order_acquire);
    if (posted == 3) device.buttons = 1;
    wait_until([&] { return device.writes.load(std::memory_order_acquire) > start + 300; });
    testing::post(document, testing::stroke_over_ball(posted), 2);
  }
  device.buttons = 0;
  const int start = device.writes.load(std::memory_order_acquire);
  wait_until([&] { return device.writes.load(std::memory_order_acquire) > start + 100; });
  ASSERT_TRUE(session.stop());
  document.settle();
  int by_hand = 0, by_mouse = 0;
  for (const StrokeFinished& stroke : events.of<StrokeFinished>()) (stroke.source == 1 ? by_hand : by_mouse)++;
  EXPECT_EQ(by_hand, 1);
  EXPECT_EQ(by_mouse, 3) << "those before the hand began";
  EXPECT_EQ(events.of<StrokeRefused>().size(), 3U);
  EXPECT_TRUE(validate(*document.head()));
}

// ---- The monitor

ServoTick tick(int k, std::uint32_t flags = 0, bool contact = false) {
  ServoTick t;
  t.number = static_cast<std::uint64_t>(k);
  t.clock_ns = 5'000'000'000U + static_cast<std::uint64_t>(k) * 1'000'000U;
  t.sample.t = k * 1e-3;
  t.sample.force = {0, 0, 0.5 * k};
  t.sample.depth = 0.25 * k;
  t.sample.compute_ns = 20'000;
  t.sample.late_ns = 70'000;
  t.sample.flags = flags;
  t.sample.contact = contact;
  return t;
}

TEST(HandMonitor, KeepsTheNewestTicksInOrder) {
  HandMonitor monitor(100);
  EXPECT_EQ(monitor.safety().now().state, HandState::Waiting);
  for (int k = 0; k < 250; ++k) {
    monitor.tick(tick(k));
    if (k % 60 != 59) continue;
    EXPECT_EQ(monitor.drain(), 60U);
  }
  EXPECT_EQ(monitor.drain(), 10U);
  ASSERT_EQ(monitor.size(), 100U);
  const std::vector<HandTick> frozen = monitor.freeze();
  monitor.tick(tick(250));
  monitor.drain();
  for (std::size_t k = 0; k < 100; ++k) {
    EXPECT_DOUBLE_EQ(frozen[k].t, (150 + static_cast<double>(k)) * 1e-3);
    EXPECT_DOUBLE_EQ(monitor[k].t, (151 + static_cast<double>(k)) * 1e-3);
    EXPECT_FLOAT_EQ(frozen[k].depth, 0.25F * (150 + static_cast<float>(k)));
    EXPECT_FLOAT_EQ(frozen[k].period, 1e-3F);
    EXPECT_FLOAT_EQ(frozen[k].compute, 20e-6F);
    EXPECT_FLOAT_EQ(frozen[k].late, 70e-6F);
  }
  EXPECT_EQ(monitor.taken(), 251U);
  EXPECT_EQ(monitor.missing(), 0U);
  EXPECT_EQ(monitor.last().force, (Vec3d{0, 0, 125}));
}

TEST(HandMonitor, CountsWhatItHadNoRoomFor) {
  HandMonitor monitor;
  const int more = static_cast<int>(HandMonitor::kWaiting) + 100;
  for (int k = 0; k < more; ++k) monitor.tick(tick(k));
  EXPECT_EQ(monitor.drain(), HandMonitor::kWaiting);
  monitor.tick(tick(more));
  EXPECT_EQ(monitor.drain(), 1U);
  EXPECT_EQ(monitor.missing(), 100U);
  monitor.clear();
  EXPECT_EQ(monitor.size(), 0U);
  EXPECT_EQ(monitor.missing(), 0U);
  EXPECT_EQ(monitor.safety().now(), HandSafety{});
}

TEST(HandMonitor, IsFedFromAnotherThread) {
  HandMonitor monitor(1000);
  constexpr int kTicks = 100'000;
  std::atomic<bool> over{false};
  std::thread feeder([&] {
    for (int k = 0; k < kTicks; ++k) monitor.tick(tick(k));
    over = true;
  });
  std::size_t taken = 0;
  while (!over) {
    const double before = monitor.last().t;
    taken += monitor.drain();
    ASSERT_GE(monitor.last().t, before);
  }
  feeder.join();
  taken += monitor.drain();
  EXPECT_EQ(taken, monitor.taken());
  EXPECT_LE(monitor.taken() + monitor.missing(), static_cast<std::uint64_t>(kTicks));
}

// ---- What the hand is told

constexpr std::uint32_t kLatched = bit(ServoFault::Latched);

HandSafety after(SafetyWatch& watch, int from, int ticks, std::uint32_t flags, bool contact = false) {
  for (int k = from; k < from + ticks; ++k) watch.tick(tick(k, flags, contact).sample);
  return watch.now();
}

TEST(SafetyWatch, TellsTouchingFromFreeWithoutFlicker) {
  SafetyWatch watch;
  EXPECT_EQ(after(watch, 0, 10, 0), (HandSafety{.state = HandState::Free}));
  EXPECT_EQ(after(watch, 10, 1, 0, true), (HandSafety{.state = HandState::Touching}));
  EXPECT_EQ(after(watch, 11, 200, 0), (HandSafety{.state = HandState::Touching})) << "0.2 s later";
  EXPECT_EQ(after(watch, 211, 200, 0), (HandSafety{.state = HandState::Free}));
  EXPECT_EQ(watch.stops(), 0U);
}

TEST(SafetyWatch, TheCauseStaysUntilTheHandHasLiftedOff) {
  for (const ServoFault cause : {ServoFault::TooFast, ServoFault::BadPosition, ServoFault::BadTime, ServoFault::Stalled,
                                 ServoFault::SurfaceJumped, ServoFault::Reconnected}) {
    SafetyWatch watch;
    after(watch, 0, 10, 0, true);
    const HandSafety told = {.state = HandState::NoForce, .cause = cause, .lift_off = true};
    EXPECT_EQ(after(watch, 10, 1, bit(cause) | kLatched, true), told) << name(cause);
    EXPECT_EQ(after(watch, 11, 500, kLatched, true), told) << name(cause);
    EXPECT_EQ(after(watch, 511, 1, 0, true), (HandSafety{.state = HandState::Touching})) << name(cause);
    EXPECT_EQ(watch.stops(), 1U);
    EXPECT_TRUE(watch.last_stop().over);
    EXPECT_NEAR(watch.last_stop().t, 0.010, 1e-12);
    EXPECT_NEAR(watch.last_stop().seconds, 0.5, 1e-9);
  }
}

TEST(SafetyWatch, TheNewestCauseIsToldAndALastingOneHasNoLiftOff) {
  SafetyWatch watch;
  after(watch, 0, 1, bit(ServoFault::TooFast) | kLatched);
  EXPECT_EQ(after(watch, 1, 5, bit(ServoFault::ForcesOff) | kLatched),
            (HandSafety{.state = HandState::NoForce, .cause = ServoFault::ForcesOff, .lift_off = false}));
  EXPECT_EQ(after(watch, 6, 5, kLatched),
            (HandSafety{.state = HandState::NoForce, .cause = ServoFault::ForcesOff, .lift_off = true}));
  EXPECT_EQ(after(watch, 11, 5, bit(ServoFault::DeviceLost)),
            (HandSafety{.state = HandState::NoForce, .cause = ServoFault::DeviceLost, .lift_off = false}));
  EXPECT_EQ(after(watch, 16, 5, bit(ServoFault::StartInside)).cause, ServoFault::DeviceLost);
  EXPECT_EQ(watch.stops(), 1U);
  SafetyWatch inside;
  EXPECT_EQ(after(inside, 0, 5, bit(ServoFault::StartInside)).cause, ServoFault::StartInside);
}

constexpr int kSteady = static_cast<int>(1000 * SafetyWatch::kSteady);  // ticks

/// A device that is lost for a tick from `from` on, answers again, and has its force back after `stopped` ticks.
HandSafety lost_once(SafetyWatch& watch, int from, int stopped, int ticks) {
  after(watch, from, 1, bit(ServoFault::DeviceLost));
  after(watch, from + 1, 1, bit(ServoFault::Reconnected) | kLatched);
  after(watch, from + 2, stopped, kLatched);
  return after(watch, from + 2 + stopped, ticks - 2 - stopped, 0);
}

TEST(SafetyWatch, ALineThatComesAndGoesAlarmsOnce) {
  SafetyWatch watch;
  after(watch, 0, 10, 0);
  EXPECT_EQ(watch.alarms(), 0U);
  int k = 10;
  for (const int period : {50, 500, kSteady - 100, 50}) {
    const int stopped = period / 2;
    EXPECT_EQ(lost_once(watch, k, stopped, period).state, HandState::Free) << "the state is that of the moment";
    EXPECT_EQ(watch.alarms(), 1U) << period;
    EXPECT_EQ(watch.alarm().cause, ServoFault::DeviceLost);
    k += period;
  }
  EXPECT_EQ(watch.stops(), 4U);
  after(watch, k, kSteady, 0);
  EXPECT_EQ(watch.alarms(), 2U) << "it answers";
  EXPECT_EQ(watch.alarm().cause, ServoFault::Reconnected);
  EXPECT_TRUE(watch.alarm().over);
  lost_once(watch, k + kSteady, 10, 20);
  EXPECT_EQ(watch.alarms(), 3U) << "the next loss is another one";
  EXPECT_EQ(watch.alarm().cause, ServoFault::DeviceLost);
}

TEST(SafetyWatch, ADeviceThatAnswersIsToldWhenItHasDoneSoForAWhile) {
  SafetyWatch watch;
  lost_once(watch, 0, kSteady - 1, kSteady + 1);
  EXPECT_EQ(watch.alarms(), 1U);
  after(watch, kSteady + 1, 2, kLatched);
  EXPECT_EQ(watch.alarms(), 2U);
  EXPECT_EQ(watch.alarm().cause, ServoFault::Reconnected);
  EXPECT_FALSE(watch.alarm().over);
  // Its clock may begin anew with its connection.
  SafetyWatch anew;
  after(anew, 5000, 10, 0);
  lost_once(anew, 5010, 10, 20);
  after(anew, 0, kSteady, 0);
  EXPECT_EQ(anew.alarms(), 1U);
  after(anew, kSteady, 2, 0);
  EXPECT_EQ(anew.alarms(), 2U);
}

TEST(SafetyWatch, ForcesThatSomebodySwitchesOffDoNotMakeTheLineALoudOne) {
  SafetyWatch watch;
  lost_once(watch, 0, 10, 20);
  after(watch, 20, 5, bit(ServoFault::ForcesOff) | kLatched);
  const auto so_far = watch.alarms();
  lost_once(watch, 25, 10, 20);
  EXPECT_EQ(watch.alarms(), so_far) << "the loss is still what was heard last";
}

TEST(SafetyWatch, WhatElseHappensWhileTheLineIsUnsteadyIsToldAtOnce) {
  SafetyWatch watch;
  lost_once(watch, 0, 10, 20);
  after(watch, 20, 1, bit(ServoFault::TooFast) | kLatched);
  EXPECT_EQ(watch.alarms(), 2U);
  EXPECT_EQ(watch.alarm().cause, ServoFault::TooFast);
  lost_once(watch, 21, 10, 20);
  EXPECT_EQ(watch.alarms(), 3U) << "nobody would know else";
  EXPECT_EQ(watch.alarm().cause, ServoFault::DeviceLost);
  after(watch, 41, 2 * kSteady, 0);
  EXPECT_EQ(watch.alarms(), 4U);
  EXPECT_EQ(watch.alarm().cause, ServoFault::Reconnected);
}

TEST(SafetyWatch, LimitsAreToldWhileTheyLastAndNormalWorkIsNot) {
  for (const ServoFault limit : {ServoFault::ForceClamped, ServoFault::LoadLimited, ServoFault::SpeedLimited,
                                 ServoFault::LateTicks, ServoFault::Uncalibrated}) {
    SafetyWatch watch;
    EXPECT_EQ(after(watch, 0, 10, bit(limit), true), (HandSafety{.state = HandState::Limited, .cause = limit}));
    EXPECT_EQ(after(watch, 10, 100, 0, true).state, HandState::Limited) << name(limit);
    EXPECT_EQ(after(watch, 110, 400, 0, true), (HandSafety{.state = HandState::Touching})) << name(limit);
  }
  for (const ServoFault usual : {ServoFault::RateClamped, ServoFault::Passivity, ServoFault::StiffnessClamped,
                                 ServoFault::NoNews, ServoFault::SampleDropped, ServoFault::Overrun}) {
    SafetyWatch watch;
    EXPECT_EQ(after(watch, 0, 10, bit(usual), true), (HandSafety{.state = HandState::Touching})) << name(usual);
  }
}

}  // namespace
}  // namespace relief
