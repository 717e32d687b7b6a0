// The 1 kHz loop: what it counts, what it sends, and that its last word is an explicit zero.
#include "support/shells.h"

#include <relief/haptics/servo_thread.h>

#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <deque>
#include <string>
#include <thread>
#include <vector>

namespace relief {
namespace {

using testing::displaced;
using testing::sphere_shell;

/// Presses in and out of the sphere, 20 ticks each way; may vanish or end at a tick. Written by the servo thread, read
/// after it.
class PressingDevice final : public HapticDevice {
 public:
  explicit PressingDevice(std::uint64_t lives = ~std::uint64_t{0}) : lives_(lives) {}
  const DeviceInfo& info() const noexcept override { return info_; }
  bool read(DeviceState& state) noexcept override {
    if (ticks_.load() == lives_) return false;
    const std::uint64_t tick = ticks_.fetch_add(1);
    state.t = 1e-3 * static_cast<double>(tick);
    if (waits) first_ = tick;
    state.position = {0, 0, 0.1 * (1.03 - 0.03 * (1 - std::cos(0.15 * static_cast<double>(tick - first_))))};
    return true;
  }
  bool ended() const noexcept override { return ends && ticks_.load() == lives_; }
  bool write(const Wrench& wrench) noexcept override {
    last = wrench.force;
    most = std::max(most, length(wrench.force));
    ++writes;
    return true;
  }
  [[nodiscard]] std::uint64_t ticks() const { return ticks_.load(); }

  std::atomic<bool> waits{false};  ///< in the air
  std::atomic<bool> ends{false};   ///< does not vanish
  Vec3d last = {9, 9, 9};
  double most = 0;
  std::uint64_t writes = 0;

 private:
  DeviceInfo info_;
  std::uint64_t lives_, first_ = 0;
  std::atomic<std::uint64_t> ticks_{0};
};

SnapshotPtr sphere(double radius = 1) {
  return displaced(sphere_shell(1, 8), [&](Vec3d p) { return (radius / length(p) - 0.8) / 0.4; });
}
const ServoSettings kSettings = {.workspace = {.metres_per_unit = 0.1}, .force = {.stiffness = 400}};

void wait_for(const PressingDevice& device, std::uint64_t ticks) {
  while (device.ticks() < ticks) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

TEST(ServoThread, TouchesAndEndsWithZero) {
  SnapshotChannel channel(sphere());
  PressingDevice device;
  SpscQueue<ServoTick> telemetry(1 << 14);
  ServoThread servo(device, channel, kSettings, &telemetry);
  wait_for(device, 150);
  servo.stop();
  EXPECT_FALSE(servo.running());
  EXPECT_EQ(device.last, Vec3d{});
  EXPECT_GT(device.most, 0.5);
  EXPECT_EQ(device.writes, device.ticks() + 1) << "one command per tick, and the zero";
  const ServoTimes& times = servo.times();
  EXPECT_EQ(times.ticks, device.ticks());
  EXPECT_EQ(times.compute.count(), times.ticks);
  EXPECT_EQ(times.late.count(), times.ticks);
  EXPECT_EQ(times.realtime && times.memory_locked, times.note.empty());
  std::uint64_t popped = 0;
  double last_t = -1;
  for (ServoTick tick; telemetry.pop(tick); ++popped) {
    EXPECT_EQ(tick.number, popped);
    EXPECT_GT(tick.sample.t, last_t);
    EXPECT_EQ(tick.sample.t, tick.reading.t);
    last_t = tick.sample.t;
    EXPECT_GT(tick.sample.compute_ns, 0U);
  }
  EXPECT_EQ(popped, times.ticks);
  EXPECT_EQ(times.dropped, 0U);
}

/// The schedule is absolute: whatever the machine does, ticks are due at whole milliseconds, and only those that have
/// passed are skipped.
TEST(ServoThread, ATickIsDueAtTheNextWholeMillisecond) {
  SnapshotChannel channel(sphere());
  PressingDevice device;
  SpscQueue<ServoTick> telemetry(1 << 14);
  ServoThread servo(device, channel, kSettings, &telemetry);
  wait_for(device, 100);
  servo.stop();
  std::uint64_t expected = 0, ticks = 0;
  for (ServoTick tick; telemetry.pop(tick); ++ticks) {
    const std::uint64_t late = tick.sample.late_ns, due = tick.clock_ns - late;
    if (ticks > 0) {
      ASSERT_EQ(due, expected) << ticks;
    }
    expected = due + (1 + late / 1'000'000) * 1'000'000;
  }
  EXPECT_EQ(ticks, device.ticks());
}

/// Notes how the system runs the thread that reads it.
class WatchingDevice final : public HapticDevice {
 public:
  [[nodiscard]] const DeviceInfo& info() const noexcept override { return info_; }
  bool read(DeviceState& state) noexcept override {
    sched_param given{};
    if (pthread_getschedparam(pthread_self(), &policy, &given) == 0) priority = given.sched_priority;
    state.t = 1e-3 * ++ticks_;
    return true;
  }
  [[nodiscard]] bool ended() const noexcept override { return ticks_ == 5; }
  bool write(const Wrench& /*wrench*/) noexcept override { return true; }
  int policy = -1, priority = -1;  ///< read once the thread has ended

 private:
  DeviceInfo info_;
  int ticks_ = 0;
};

/// It has the priority that the note tells users to allow.
TEST(ServoThread, HasThePriorityThatUsersAreToldToAllow) {
  SnapshotChannel channel(sphere());
  WatchingDevice device;
  ServoThread servo(device, channel, kSettings, nullptr);
  while (servo.running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  if (servo.times().realtime) {
    EXPECT_EQ(device.policy, SCHED_FIFO);
    EXPECT_EQ(device.priority, 80);
  } else {
    EXPECT_NE(servo.times().note.find("rtprio 80"), std::string::npos) << servo.times().note;
  }
}

/// A push device: its own thread presses 3 mm into the ball for 100 ticks, rests outside for 50, and so on. What is not
/// atomic belongs to that thread while it is started, else to the servo's loop, and to the test after stop().
class PushingDevice final : public HapticDevice {
 public:
  PushingDevice() { info_.pull = false; }
  ~PushingDevice() override { stop(); }
  [[nodiscard]] const DeviceInfo& info() const noexcept override { return info_; }
  Status open() override {
    calls += "open ";
    silent_ = false;
    return {};
  }
  DeviceStatus status() const override {
    DeviceStatus status;
    status.trouble = "the scheduler is busy";
    return status;
  }
  Status enable(bool on) override {
    calls += on ? "on " : "off ";
    return {};
  }
  void close() noexcept override { calls += "close "; }
  [[nodiscard]] bool start(PushTick tick) noexcept override {
    if (refuses > 0) {
      --refuses;
      calls += "refused ";
      return false;
    }
    calls += "start ";
    stop_ = false;
    thread_ = std::thread([this, tick] { run(tick); });
    return true;
  }
  void stop() noexcept override {
    calls += "stop ";
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  static DeviceState reading(int k) {
    DeviceState state;
    state.t = 1e-3 * k;
    const int phase = k % 150;
    state.position = {0, 0, 0.1 * (phase < 100 ? 1.005 - 0.0008 * std::min(phase, 50) : 1.01)};
    return state;
  }
  void silent_until_opened() { silent_ = true; }

  int pause_at = -1;                             ///< a tick before which it is silent
  std::chrono::milliseconds pause{0};            ///< for so long
  std::chrono::steady_clock::duration paused{};  ///< how long it was in truth
  int silent_at = -1;                            ///< a tick from which on it is silent until it is opened
  int refuses_then = 0;                          ///< and cannot be started so many times
  int refuses = 0;                               ///< so many more times it cannot be started
  std::vector<Vec3d> forces;                     ///< N, by tick
  std::string calls;
  std::atomic<int> ticks{0};

 private:
  void run(const PushTick& tick) {
    for (; !stop_; std::this_thread::sleep_for(std::chrono::microseconds(200))) {
      if (ticks == silent_at) {
        silent_ = true;
        silent_at = -1;
        refuses = refuses_then;
      }
      if (ticks == pause_at) {
        const auto start = std::chrono::steady_clock::now();
        std::this_thread::sleep_for(pause);
        paused = std::chrono::steady_clock::now() - start;
        pause_at = -1;
      }
      call(tick);
    }
    call(tick);  // one more, while it is being stopped
  }
  void call(const PushTick& tick) {
    if (silent_) return;
    forces.push_back(tick(reading(ticks)).force);
    ++ticks;
  }

  DeviceInfo info_;
  bool silent_ = false;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

void wait_for(const PushingDevice& device, int ticks) {
  while (device.ticks < ticks) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

/// What the telemetry has of a run: that of a loss, and that of each tick of the device.
struct Pushed {
  std::vector<ServoTick> ticks;
  std::vector<std::uint64_t> lost;  ///< numbers of the ticks that would have come next
};
Pushed pushed(SpscQueue<ServoTick>& telemetry) {
  Pushed got;
  for (ServoTick tick; telemetry.pop(tick);) {
    EXPECT_EQ(tick.number, got.ticks.size());
    EXPECT_EQ(tick.model == nullptr, (tick.sample.flags & bit(ServoFault::DeviceLost)) != 0);
    if (tick.model != nullptr)
      got.ticks.push_back(tick);
    else
      got.lost.push_back(tick.number);
  }
  return got;
}
/// After a loss: the first tick says so, no force before the tool has come out, and then force again.
void expect_safe_return(const Pushed& got, std::uint64_t first) {
  ASSERT_LT(first, got.ticks.size());
  EXPECT_NE(got.ticks[first].sample.flags & bit(ServoFault::Reconnected), 0U);
  bool latched = true;
  double most = 0;
  for (std::uint64_t k = first; k < got.ticks.size(); ++k) {
    latched = latched && static_cast<int>(k) % 150 < 100;
    const double force = length(got.ticks[k].sample.force);
    if (latched) {
      EXPECT_EQ(force, 0) << k;
    }
    most = std::max(most, force);
  }
  EXPECT_GT(most, 0.5) << "after lift-off";
}

TEST(ServoThread, APushDeviceCallsItsServoAtItsOwnTimes) {
  const SnapshotPtr model = sphere();
  SnapshotChannel channel(model);
  PushingDevice device;
  SpscQueue<ServoTick> telemetry(1 << 14);
  ServoThread servo(device, channel, kSettings, &telemetry);
  wait_for(device, 210);
  EXPECT_TRUE(servo.running());
  const std::size_t before = static_cast<std::size_t>(device.ticks);
  servo.stop();
  EXPECT_FALSE(servo.running());
  EXPECT_TRUE(device.calls.starts_with("on start stop ")) << device.calls;
  EXPECT_TRUE(device.calls.ends_with("stop off ")) << device.calls;
  EXPECT_EQ(device.forces.back(), Vec3d{}) << "a command after the stop is zero";
  const Pushed got = pushed(telemetry);
  ASSERT_EQ(got.ticks.size(), device.forces.size());
  Servo alone(kSettings, device.info());
  bool same = true;  // until the machine stands still
  double most = 0;
  for (std::size_t k = 0; k < before; ++k) {
    const ServoSample& sample = got.ticks[k].sample;
    same = same && (sample.flags & (bit(ServoFault::Stalled) | bit(ServoFault::Reconnected))) == 0;
    EXPECT_EQ(sample.force, device.forces[k]) << k;
    if (same) {
      EXPECT_EQ(alone.step(*model, PushingDevice::reading(static_cast<int>(k))).force, sample.force) << k;
    }
    most = std::max(most, length(sample.force));
  }
  EXPECT_GT(most, 0.5);
  EXPECT_EQ(servo.times().ticks, device.forces.size());
  EXPECT_EQ(servo.times().compute.count(), device.forces.size());
}

TEST(ServoThread, APushDeviceThatIsSilentForAMomentIsNotLost) {
  int judged = 0;
  for (int run = 0; judged == 0 && run < 20; ++run) {  // where the machine stands still the silence is longer
    SnapshotChannel channel(sphere());
    PushingDevice device;
    device.pause_at = 60;
    device.pause = std::chrono::milliseconds(10);
    ServoThread servo(device, channel, kSettings, nullptr);
    wait_for(device, 70);
    servo.stop();
    if (device.paused > std::chrono::milliseconds(15)) continue;
    ++judged;
    EXPECT_TRUE(servo.losses().empty());
    EXPECT_EQ(device.calls, "on start stop off ");
  }
  EXPECT_EQ(judged, 1);
}

TEST(ServoThread, APushDeviceThatIsSilentForLongerIsLostAndComesBackThroughTheSafeState) {
  SnapshotChannel channel(sphere());
  PushingDevice device;
  device.pause_at = 70;
  device.pause = std::chrono::milliseconds(60);
  SpscQueue<ServoTick> telemetry(1 << 14);
  ServoThread servo(device, channel, kSettings, &telemetry, {.reopen_after = 60, .give_up_after = 600});
  wait_for(device, 550);
  servo.stop();
  EXPECT_TRUE(device.calls.starts_with("on start stop on start stop ")) << device.calls;
  const std::vector<DeviceLoss> losses = servo.losses();
  ASSERT_FALSE(losses.empty());
  EXPECT_EQ(servo.times().losses, losses.size());
  for (const DeviceLoss& loss : losses) {  // the machine may have paused too
    EXPECT_TRUE(loss.over);
    EXPECT_EQ(loss.reopened, 0);
    EXPECT_EQ(loss.reason, "the scheduler is busy");
  }
  EXPECT_LE(losses[0].tick, 72U) << "it called once after the pause, and once while it was stopped";
  const Pushed got = pushed(telemetry);
  ASSERT_EQ(got.lost.size(), losses.size()) << "each is told once";
  EXPECT_EQ(got.lost[0], losses[0].tick);
  expect_safe_return(got, got.lost.back());
}

TEST(ServoThread, APushDeviceThatStaysSilentIsOpenedAgainUntilItCanBeStarted) {
  SnapshotChannel channel(sphere());
  PushingDevice device;
  device.silent_at = 70;
  device.refuses_then = 2;
  SpscQueue<ServoTick> telemetry(1 << 14);
  ServoThread servo(device, channel, kSettings, &telemetry, {.reopen_after = 0.05, .give_up_after = 60});
  wait_for(device, 550);
  servo.stop();
  EXPECT_NE(device.calls.find("stop on refused stop close open on refused stop close open on start "),
            std::string::npos)
      << device.calls;
  EXPECT_TRUE(device.calls.ends_with("stop off ")) << device.calls;
  ASSERT_FALSE(servo.losses().empty());
  const Pushed got = pushed(telemetry);
  EXPECT_EQ(got.lost.size(), servo.losses().size());
  for (const DeviceLoss& loss : servo.losses()) {
    EXPECT_TRUE(loss.over);
    EXPECT_EQ(loss.reason, "the scheduler is busy");
    if (loss.tick == 70) {
      EXPECT_EQ(loss.reopened, 2);
      EXPECT_GE(loss.seconds, 0.1);
    }
  }
  EXPECT_EQ(std::ranges::count(got.lost, 70U), 1);
  expect_safe_return(got, got.lost.back());
}

TEST(ServoThread, APushDeviceThatCannotBeStartedAtFirstIsTriedAgain) {
  SnapshotChannel channel(sphere());
  PushingDevice device;
  device.refuses = 2;
  ServoThread servo(device, channel, kSettings, nullptr, {.reopen_after = 0.03, .give_up_after = 60});
  wait_for(device, 20);
  servo.stop();
  EXPECT_TRUE(device.calls.starts_with("on refused stop stop close open on refused stop close open on start "))
      << device.calls;
  ASSERT_FALSE(servo.losses().empty());
  EXPECT_EQ(servo.losses()[0].tick, 0U);
  EXPECT_EQ(servo.losses()[0].reason, "the scheduler is busy");
  EXPECT_EQ(servo.losses()[0].reopened, 2);
  EXPECT_TRUE(servo.losses()[0].over);
}

TEST(ServoThread, APushDeviceThatNeverCallsEndsTheLoopWhenItIsGivenUp) {
  SnapshotChannel channel(sphere());
  PushingDevice device;
  device.silent_until_opened();
  ServoThread servo(device, channel, kSettings, nullptr, {.reopen_after = 0.05, .give_up_after = 0.03});
  while (servo.running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(device.calls, "on start stop on start stop off ");
  ASSERT_EQ(servo.losses().size(), 1U);
  EXPECT_FALSE(servo.losses()[0].over);
  EXPECT_GE(servo.losses()[0].seconds, 0.03);
  EXPECT_EQ(servo.losses()[0].reason, "the scheduler is busy");
}

TEST(ServoThread, FullTelemetryIsCountedAndFlagged) {
  SnapshotChannel channel(sphere());
  PressingDevice device;
  SpscQueue<ServoTick> telemetry(4);
  ServoThread servo(device, channel, kSettings, &telemetry);
  wait_for(device, 10);
  ServoTick tick;
  for (std::uint64_t k = 0; k < 4; ++k) {
    ASSERT_TRUE(telemetry.pop(tick));
    EXPECT_EQ(tick.number, k);
  }
  wait_for(device, device.ticks() + 3);
  servo.stop();
  EXPECT_GT(servo.times().dropped, 0U);
  ASSERT_TRUE(telemetry.pop(tick));
  EXPECT_NE(tick.sample.flags & bit(ServoFault::SampleDropped), 0U) << "the first one after the gap says so";
  EXPECT_GT(tick.number, 4U) << "and so does its number";
}

TEST(ServoThread, ALostDeviceEndsTheLoopWhenItIsGivenUp) {
  SnapshotChannel channel(sphere());
  PressingDevice device(25);
  SpscQueue<ServoTick> telemetry(64);
  ServoThread servo(device, channel, kSettings, &telemetry, {.give_up_after = 0.02});
  while (servo.running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(device.last, Vec3d{});
  EXPECT_GT(device.writes, 25U + 10U) << "a zero in each tick";
  ServoTick tick;
  int count = 0;
  while (telemetry.pop(tick)) {
    EXPECT_EQ(tick.model == nullptr, count == 25) << "no reading, no step";
    ++count;
  }
  const ServoSample& last = tick.sample;
  EXPECT_EQ(count, 26) << "a loss is told once";
  EXPECT_NE(last.flags & bit(ServoFault::DeviceLost), 0U);
  EXPECT_EQ(last.force, Vec3d{});
  ASSERT_EQ(servo.losses().size(), 1U);
  EXPECT_EQ(servo.losses()[0].tick, 25U);
  EXPECT_FALSE(servo.losses()[0].over);
  EXPECT_GE(servo.losses()[0].seconds, 0.02);
  EXPECT_EQ(servo.losses()[0].reopened, 0);
}

/// Presses 3 mm into the ball for 100 ticks, rests outside for 50, and so on; may stop answering, and be mended by
/// time or by being closed and opened. Its own thread is the servo's; what is not atomic is looked at after it.
class FlakyDevice final : public HapticDevice {
 public:
  enum class Fails : std::uint8_t { Read, Write };
  FlakyDevice(Fails fails, int from, int for_ticks) : fails_(fails), from_(from), to_(from + for_ticks) {}
  const DeviceInfo& info() const noexcept override { return info_; }
  Status open() override {
    calls += "open ";
    if (refuses > 0 && --refuses >= 0) return fail(Errc::DeviceUnavailable, "no device on the bus");
    broken_ = false;
    return {};
  }
  DeviceStatus status() const override {
    DeviceStatus status;
    status.trouble = "the cable is loose";
    return status;
  }
  Status enable(bool on) override {
    calls += on ? "on " : "off ";
    if (on && broken_) return fail(Errc::DeviceUnavailable, "it was never calibrated");
    return {};
  }
  void close() noexcept override { calls += "close "; }
  bool read(DeviceState& state) noexcept override {
    const int tick = ticks++;
    if (broken_ || (fails_ == Fails::Read && tick >= from_ && tick < to_)) return false;
    state.t = 1e-3 * tick;
    const int phase = tick % 150;
    state.position = {0, 0, 0.1 * (phase < 100 ? 1.005 - 0.0008 * std::min(phase, 50) : 1.01)};
    return true;
  }
  bool write(const Wrench& wrench) noexcept override {
    const int tick = ticks - 1;
    if (broken_ || (fails_ == Fails::Write && tick >= from_ && tick < to_)) {
      if (length(wrench.force) > 0) ++refused;
      return false;
    }
    forces.push_back(wrench.force.z);
    return true;
  }
  void break_until_opened() { broken_ = true; }

  std::atomic<int> ticks{0};
  std::atomic<int> refuses{0};  ///< so many more times it cannot be opened
  std::string calls;
  std::vector<double> forces;  ///< N, that were commanded
  int refused = 0;             ///< commands of a force that did not arrive

 private:
  DeviceInfo info_;
  Fails fails_;
  int from_, to_;
  bool broken_ = false;
};

TEST(ServoThread, ADeviceThatFailsForAMomentGoesOnThroughTheSafeState) {
  for (const auto fails : {FlakyDevice::Fails::Read, FlakyDevice::Fails::Write}) {
    const SnapshotPtr model = sphere();
    SnapshotChannel channel(model);
    FlakyDevice device(fails, 70, 3);
    SpscQueue<ServoTick> telemetry(1 << 14);
    ServoThread servo(device, channel, kSettings, &telemetry);
    while (device.ticks < 550) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_TRUE(servo.running());
    servo.stop();
    EXPECT_EQ(device.calls, "on off ");
    ASSERT_EQ(servo.losses().size(), 1U);
    EXPECT_EQ(servo.times().losses, 1U);
    EXPECT_EQ(servo.losses()[0].tick, 70U);
    EXPECT_TRUE(servo.losses()[0].over);
    EXPECT_EQ(servo.losses()[0].reason, "the cable is loose");
    std::uint64_t number = 0, told = 0, back = 0, felt_again = 0;
    for (ServoTick tick; telemetry.pop(tick);) {
      EXPECT_EQ(tick.number, number);
      number += tick.model != nullptr ? 1U : 0U;
      const auto flagged = [&](ServoFault fault) { return (tick.sample.flags & bit(fault)) != 0; };
      told += flagged(ServoFault::DeviceLost) ? 1U : 0U;
      back += flagged(ServoFault::Reconnected) ? 1U : 0U;
      if (flagged(ServoFault::DeviceLost) || flagged(ServoFault::Reconnected) || flagged(ServoFault::Latched)) {
        EXPECT_EQ(tick.sample.force, Vec3d{});
      }
      if (back > 0 && tick.sample.force.z > 0.5) ++felt_again;
    }
    // A read that fails has no tick of its own; a step whose command does not arrive has.
    EXPECT_EQ(told, fails == FlakyDevice::Fails::Read ? 1U : 3U);
    EXPECT_EQ(back, fails == FlakyDevice::Fails::Read ? 1U : 3U);
    EXPECT_GT(felt_again, 10U) << "after lift-off";
    EXPECT_EQ(device.refused, fails == FlakyDevice::Fails::Read ? 0 : 1) << "from the next tick on all are zero";
  }
}

/// Answers every other time.
class HalfDevice final : public HapticDevice {
 public:
  const DeviceInfo& info() const noexcept override { return info_; }
  bool read(DeviceState& state) noexcept override {
    state.t = 1e-3 * ++ticks;
    return ticks % 2 == 0;
  }
  bool write(const Wrench&) noexcept override { return true; }
  std::atomic<int> ticks{0};

 private:
  DeviceInfo info_;
};

TEST(ServoThread, OnlyTheFirstHundredLossesAreNoted) {
  SnapshotChannel channel(sphere());
  HalfDevice device;
  ServoThread servo(device, channel, kSettings, nullptr);
  while (device.ticks < 250) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  servo.stop();
  EXPECT_GE(servo.times().losses, 124U);
  const std::vector<DeviceLoss> noted = servo.losses();
  EXPECT_EQ(noted.size(), 100U);
  EXPECT_TRUE(noted.back().over);
}

TEST(ServoThread, ADeviceThatStaysAwayIsOpenedAgain) {
  SnapshotChannel channel(sphere());
  FlakyDevice device(FlakyDevice::Fails::Read, 60, 1 << 20);
  device.refuses = 1;
  ServoThread servo(device, channel, kSettings, nullptr, {.reopen_after = 0.03, .give_up_after = 60});
  while (device.refuses > 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const std::vector<DeviceLoss> meanwhile = servo.losses();
  ASSERT_EQ(meanwhile.size(), 1U);
  EXPECT_FALSE(meanwhile[0].over);
  EXPECT_EQ(meanwhile[0].reason, "no device on the bus");
  const int before = device.ticks;
  while (device.ticks < before + 20) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  servo.stop();
  EXPECT_TRUE(device.calls.starts_with("on close open close open on ")) << device.calls;
  EXPECT_TRUE(device.calls.ends_with("on off ")) << device.calls;
  EXPECT_GE(servo.losses()[0].reopened, 2);
}

TEST(ServoThread, BetweenTwoTriesToOpenADeviceIsAsMuchTimeAsBeforeTheFirst) {
  SnapshotChannel channel(sphere());
  FlakyDevice device(FlakyDevice::Fails::Read, 5, 1 << 20);
  device.refuses = 1 << 20;
  ServoThread servo(device, channel, kSettings, nullptr, {.reopen_after = 0.02, .give_up_after = 0.15});
  while (servo.running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  const DeviceLoss loss = servo.losses().at(0);
  EXPECT_GT(loss.reopened, 0);
  EXPECT_LE(loss.reopened * 0.02, loss.seconds);
}

TEST(ServoThread, ADeviceThatCannotBeSwitchedOnGivesNoForceUntilItCan) {
  SnapshotChannel channel(sphere());
  FlakyDevice device(FlakyDevice::Fails::Read, 1 << 20, 0);
  device.break_until_opened();
  ServoThread servo(device, channel, kSettings, nullptr, {.reopen_after = 0.01, .give_up_after = 60});
  while (device.ticks < 150 + 80) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  servo.stop();
  EXPECT_EQ(device.calls, "on close open on off ");
  ASSERT_EQ(servo.losses().size(), 1U);
  EXPECT_TRUE(servo.losses()[0].over);
  EXPECT_EQ(servo.losses()[0].reason, "it was never calibrated");
  EXPECT_GT(*std::ranges::max_element(device.forces), 0.5);
}

/// Knows where its arm is once a person has put it into its place, and it has been asked after that.
class UncalibratedDevice final : public HapticDevice {
 public:
  const DeviceInfo& info() const noexcept override { return info_; }
  DeviceStatus status() const override {
    DeviceStatus status;
    if (!known_) status.calibration = Calibration::ByPerson;
    if (!known_) status.to_do = "put the pen into the inkwell";
    return status;
  }
  Status calibrate(ArmMotion motion) override {
    EXPECT_EQ(motion, ArmMotion::Forbidden) << "nobody has said that it may move";
    known_ = placed;
    return {};
  }
  Status enable(bool on) override {
    EXPECT_TRUE(known_ || !on) << "forces without a place";
    return {};
  }
  void close() noexcept override { known_ = false; }
  bool read(DeviceState& state) noexcept override {
    state.t = 1e-3 * ++ticks;
    return true;
  }
  bool write(const Wrench&) noexcept override { return true; }
  std::atomic<int> ticks{0};
  std::atomic<bool> placed{false};

 private:
  DeviceInfo info_ = {.name = "pen"};
  bool known_ = false;
};

TEST(ServoThread, ADeviceThatDoesNotKnowWhereItIsGetsNoForceUntilItDoes) {
  SnapshotChannel channel(sphere());
  UncalibratedDevice device;
  ServoThread servo(device, channel, kSettings, nullptr, {.reopen_after = 0.01, .give_up_after = 60});
  while (servo.losses().empty() || servo.losses()[0].reopened < 2)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(device.ticks, 0);
  EXPECT_EQ(servo.losses()[0].reason, "pen: put the pen into the inkwell");
  device.placed = true;
  while (device.ticks < 5) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  servo.stop();
  EXPECT_EQ(servo.losses().size(), 1U);
  EXPECT_TRUE(servo.losses()[0].over);
}

TEST(ServoThread, ADeviceThatEndsIsNotLost) {
  SnapshotChannel channel(sphere());
  PressingDevice device(25);
  device.ends = true;
  SpscQueue<ServoTick> telemetry(64);
  ServoThread servo(device, channel, kSettings, &telemetry);
  while (servo.running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(device.last, Vec3d{});
  EXPECT_EQ(servo.times().ticks, 25U);
  ServoTick tick;
  int count = 0;
  for (; telemetry.pop(tick); ++count) EXPECT_EQ(tick.sample.flags & bit(ServoFault::DeviceLost), 0U);
  EXPECT_EQ(count, 25);
}

TEST(ServoThread, TakesNewSettings) {
  SnapshotChannel channel(sphere());
  PressingDevice device;
  device.waits = true;
  ServoThread servo(device, channel, kSettings, nullptr);
  ServoSettings off = kSettings;
  off.force.stiffness = 0;
  off.force.damping = 0;
  ASSERT_TRUE(servo.set(off));
  device.waits = false;
  wait_for(device, device.ticks() + 60);
  servo.stop();
  EXPECT_LT(device.most, 0.5) << "a whole press without stiffness";
}

TEST(ServoThread, FeelsWhileAWriterPublishesAtFullSpeed) {
  SnapshotChannel channel(sphere());
  const SnapshotPtr first = sphere(1), second = sphere(1.002);
  PressingDevice device;
  SpscQueue<ServoTick> telemetry(1 << 14);
  ServoThread servo(device, channel, kSettings, &telemetry);
  std::uint64_t published = 0;
  while (device.ticks() < 200)
    channel.publish(std::make_shared<const Snapshot>(++published % 2 == 0 ? *first : *second));
  servo.stop();
  EXPECT_GT(published, 100U);
  EXPECT_EQ(device.last, Vec3d{});
  int touched = 0;
  std::deque<Vec3d> way;  // of the cursor, over the 45 ms in which what changed is blended
  for (ServoTick tick; telemetry.pop(tick);) {
    const ServoSample& sample = tick.sample;
    ASSERT_TRUE(is_finite(sample.force));
    way.push_back(sample.cursor);
    if (way.size() > 46) way.pop_front();
    double leap = 0;  // a thread that had no core wakes up late, and the hand has gone on meanwhile
    for (std::size_t k = 1; k < way.size(); ++k) leap = std::max(leap, length(way[k] - way[k - 1]));
    const double to_first = 1 - length(sample.cursor);
    if (!sample.contact || to_first < -0.002) continue;  // off both, what was felt fades
    ++touched;
    EXPECT_NEAR(sample.depth, to_first + 0.001, 0.004 + leap) << "the one surface or the other";
  }
  EXPECT_GT(touched, 20);
}

/// Presses a ball into the ground and goes along it, while somebody publishes another model in every tick.
class ChangingDevice final : public HapticDevice {
 public:
  ChangingDevice(SnapshotChannel& channel, const std::array<SnapshotPtr, 2>& models, double radius)
      : channel_(channel), models_(models), radius_(radius) {}
  const DeviceInfo& info() const noexcept override { return info_; }
  bool read(DeviceState& state) noexcept override {
    if (tick_ == kTicks) return false;
    channel_.publish(models_[static_cast<std::size_t>(++tick_ % 2)]);
    state.t = 1e-3 * tick_;
    const double along = 1e-4 * std::max(0, tick_ - 400);
    state.position = Vec3d{0.4 + along, radius_ * std::max(0.9, 1.5 - 2e-3 * tick_), 0.5} * 0.1;
    return true;
  }
  bool ended() const noexcept override { return tick_ == kTicks; }
  bool write(const Wrench&) noexcept override { return true; }
  static constexpr int kTicks = 1500;

 private:
  SnapshotChannel& channel_;
  const std::array<SnapshotPtr, 2>& models_;
  double radius_;
  int tick_ = 0;
  DeviceInfo info_;
};

/// A tool that looks for what is around it does so on one model, or it would begin anew in each tick for good.
TEST(ServoThread, ALookIsSeenToItsEndOnTheModelOnWhichItBegan) {
  const auto mesh = testing::plane_shell(64, 32);
  const auto ground = [&](double height) {
    return displaced(mesh, [&](Vec3d p) { return height + 0.05 * std::sin(900 * p.x) * std::cos(700 * p.z); });
  };
  const std::array<SnapshotPtr, 2> models = {ground(0.5), ground(0.501)};
  const double radius = BallRange::kMost * std::sqrt(2);
  int felt = 0, same = 0, other = 0;
  double behind = 1;
  bool stalled = true;
  for (int run = 0; stalled && run < 20; ++run) {  // where the machine stands still the hand has to lift off
    stalled = false;
    felt = same = other = 0;
    SnapshotChannel channel(models[0]);
    ChangingDevice device(channel, models, radius);
    SpscQueue<ServoTick> telemetry(1 << 14);
    ServoSettings settings = {.workspace = {.metres_per_unit = 0.1}, .force = {.guard = false}};
    settings.tool.radius = radius;
    ServoThread servo(device, channel, settings, &telemetry);
    while (servo.running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    servo.stop();
    const Snapshot* last = nullptr;
    for (ServoTick tick; telemetry.pop(tick);) {
      stalled = stalled || (tick.sample.flags & bit(ServoFault::Latched)) != 0;
      if (tick.model == nullptr) continue;
      (tick.model == last ? same : other) += 1;
      last = tick.model;
      felt += tick.sample.contact ? 1 : 0;
      behind = tick.sample.cursor.x - tick.sample.contact_point.x;
    }
  }
  EXPECT_GT(felt, ChangingDevice::kTicks / 2);
  EXPECT_GT(same, 10) << "there is something to see";
  EXPECT_GT(other, ChangingDevice::kTicks / 100);
  EXPECT_LT(std::abs(behind), 0.2 * radius);
}

TEST(TimeHistogram, QuantilesAreWithinOneBin) {
  TimeHistogram histogram;
  EXPECT_EQ(histogram.quantile(0.5), 0U);
  for (std::uint64_t ns = 1; ns <= 100'000; ++ns) histogram.add(ns);
  EXPECT_EQ(histogram.count(), 100'000U);
  EXPECT_EQ(histogram.max(), 100'000U);
  for (const double q : {0.1, 0.5, 0.9, 0.99, 1.0}) {
    EXPECT_GE(static_cast<double>(histogram.quantile(q)), q * 1e5 * 0.97 - 65);
    EXPECT_LE(static_cast<double>(histogram.quantile(q)), q * 1e5 * 1.03 + 65);
  }
  for (int bin = 1; bin < TimeHistogram::kBins; ++bin) {
    TimeHistogram one;
    one.add(static_cast<std::uint64_t>(std::ceil(TimeHistogram::bin_low(bin))));
    EXPECT_EQ(one.bin_count(bin), 1U) << bin;
  }
  histogram.add(~std::uint64_t{0});
  EXPECT_EQ(histogram.bin_count(TimeHistogram::kBins - 1), 1U);
}

TEST(NullLoop, CountsItsTicks) {
  const ServoTimes times = null_loop(0.05);
  EXPECT_GT(times.ticks, 0U);
  EXPECT_EQ(times.period.count(), times.ticks);
  EXPECT_EQ(times.late.count(), times.ticks);
  const std::atomic<bool> stop{true};
  EXPECT_EQ(null_loop(3600, &stop).ticks, 0U) << "stops when asked";
}

}  // namespace
}  // namespace relief
