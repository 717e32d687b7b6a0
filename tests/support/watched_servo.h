// A real ServoThread, and what it calls in its ticks.
#pragma once

#include "support/forbidden_calls.h"

#include <relief/devices/simulated_hand.h>
#include <relief/haptics/servo_thread.h>

#include <sys/resource.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>
#include <utility>
#include <vector>

namespace relief::testing {

/// A simulated hand, pull or push, that watches the thread of its servo: from one reading to another one some hundred
/// ticks later all that is called, in the servo, in the loop around it and in the hand. In the middle it stands still
/// for once, so long that a pull device's watchdog sees it, and a push device is stopped and started again.
class WatchedHand final : public HapticDevice {
 public:
  static constexpr int kWarmUp = 200;                          // ticks before the watch begins
  static constexpr std::chrono::milliseconds kStandstill{60};  // longer than is let pass

  /// `breach` is called in one of the ticks that are watched.
  WatchedHand(bool pull, SimulatedHand hand, int ticks, std::function<void()> breach)
      : hand_(std::move(hand)), info_(hand_.info()), ticks_(ticks), breach_(std::move(breach)) {
    info_.pull = pull;
  }
  WatchedHand(const WatchedHand&) = delete;
  WatchedHand& operator=(const WatchedHand&) = delete;
  ~WatchedHand() override { stop(); }

  [[nodiscard]] const DeviceInfo& info() const noexcept override { return info_; }
  [[nodiscard]] bool read(DeviceState& state) noexcept override {
    const int at = tick_++ - kWarmUp;
    if (at == 0) watch();
    if (at == ticks_) {
      leave();
      done_.store(true);
    }
    if (at == ticks_ / 2) pause_for(kStandstill);
    if (at == ticks_ / 4 && breach_) breach_();
    return hand_.read(state);
  }
  [[nodiscard]] bool write(const Wrench& wrench) noexcept override { return hand_.write(wrench); }
  [[nodiscard]] bool start(PushTick tick) noexcept override {
    stop();
    stop_.store(false);
    thread_ = std::thread([this, tick] {
      if (tick_ > kWarmUp && !done_.load()) watch();  // again
      while (!stop_.load()) {
        DeviceState state;
        static_cast<void>(read(state));
        static_cast<void>(write(tick(state)));
        pause_for(std::chrono::microseconds(200));
      }
      leave();  // how a thread ends is not the servo's
    });
    return true;
  }
  void stop() noexcept override {
    stop_.store(true);
    if (thread_.joinable()) thread_.join();
  }

  /// Readings so far.
  [[nodiscard]] int ticks() const noexcept { return tick_.load(); }
  [[nodiscard]] bool done() const noexcept { return done_.load(); }
  /// Once done() or the servo has stopped.
  [[nodiscard]] const ForbiddenCalls& calls() const noexcept { return calls_; }
  [[nodiscard]] bool saw_system_calls() const noexcept { return saw_system_calls_; }
  [[nodiscard]] long minor_faults() const noexcept { return minor_faults_; }
  [[nodiscard]] long major_faults() const noexcept { return major_faults_; }

 private:
  /// On the servo's thread, as is leave().
  void watch() noexcept {
    saw_system_calls_ = watch_system_calls();
    getrusage(RUSAGE_THREAD, &before_);
    watched_calls = &calls_;
  }
  void leave() noexcept {
    if (std::exchange(watched_calls, nullptr) == nullptr) return;
    rusage now{};
    getrusage(RUSAGE_THREAD, &now);
    minor_faults_ += now.ru_minflt - before_.ru_minflt;
    major_faults_ += now.ru_majflt - before_.ru_majflt;
  }
  /// The device's own waits are not the servo's.
  static void pause_for(std::chrono::microseconds time) noexcept {
    ForbiddenCalls* const watched = std::exchange(watched_calls, nullptr);
    std::this_thread::sleep_for(time);
    watched_calls = watched;
  }

  SimulatedHand hand_;
  DeviceInfo info_;
  int ticks_;
  std::atomic<int> tick_{0};
  std::function<void()> breach_;
  ForbiddenCalls calls_;
  bool saw_system_calls_ = false;
  rusage before_{};
  long minor_faults_ = 0, major_faults_ = 0;
  std::atomic<bool> done_{false}, stop_{false};
  std::thread thread_;
};

/// What happened while a thread's ticks were watched.
struct WatchedRun {
  ForbiddenCalls calls;
  bool saw_system_calls = false;
  long minor_faults = 0, major_faults = 0;
  int touched = 0, models = 0, settings = 0;  ///< ticks in contact; changes
  int stalled = 0, lost = 0, dropped = 0;     ///< ticks so flagged
};

/// Lets a ServoThread feel `models` in turn while its settings change, its telemetry runs full, and its loop stands
/// still for once.
inline WatchedRun watched_run(bool pull, const std::vector<SnapshotPtr>& models, const ServoSettings& settings,
                              SimulatedHand hand, int ticks, std::function<void()> breach = {}) {
  SnapshotChannel channel(models.front());
  WatchedHand device(pull, std::move(hand), ticks, std::move(breach));
  SpscQueue<ServoTick> telemetry(256);
  ServoThread servo(device, channel, settings, &telemetry);
  WatchedRun run;
  ServoTick tick;
  const Snapshot* model = nullptr;
  for (std::size_t k = 0; !device.done() && servo.running(); ++k) {
    channel.publish(models[k % models.size()]);
    ServoSettings other = settings;
    other.force.stiffness -= static_cast<double>(k % 2);
    other.workspace.device_origin.z += 1e-5 * static_cast<double>(k % 3);
    other.clutch.held = k % 50 > 45;
    static_cast<void>(servo.set(other));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    // At first nobody takes the telemetry, until it has been full for a while.
    if (device.ticks() < static_cast<int>(telemetry.capacity()) + 20) continue;
    while (telemetry.pop(tick)) {
      run.touched += tick.sample.contact ? 1 : 0;
      run.models += tick.model != std::exchange(model, tick.model) ? 1 : 0;
      run.stalled += (tick.sample.flags & bit(ServoFault::Stalled)) != 0 ? 1 : 0;
      run.lost += (tick.sample.flags & bit(ServoFault::DeviceLost)) != 0 ? 1 : 0;
      run.dropped += (tick.sample.flags & bit(ServoFault::SampleDropped)) != 0 ? 1 : 0;
      run.settings = static_cast<int>(tick.settings);
    }
  }
  servo.stop();
  run.calls = device.calls();
  run.saw_system_calls = device.saw_system_calls();
  run.minor_faults = device.minor_faults();
  run.major_faults = device.major_faults();
  return run;
}

}  // namespace relief::testing
