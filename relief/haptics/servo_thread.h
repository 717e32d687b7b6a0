// Runs a Servo at 1 kHz against a device, and counts what the clock did.
#pragma once

#include <relief/base/spsc_queue.h>
#include <relief/core/snapshot_channel.h>
#include <relief/haptics/device.h>
#include <relief/haptics/servo.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace relief {

/// One tick as the telemetry carries it: all that Servo::step() was given, and what it made of that. Trivially
/// copyable.
struct ServoTick {
  std::uint64_t number = 0;    ///< 0 for the first; a number that never comes was dropped
  std::uint64_t clock_ns = 0;  ///< CLOCK_MONOTONIC at the wake-up
  std::uint32_t settings = 0;  ///< how many of set() had been taken over
  /// Compared only, never followed; null when the device gave no reading: the first such tick of a loss, whose number
  /// the next reading's tick has again.
  const Snapshot* model = nullptr;
  DeviceState reading;  ///< what the device said
  ServoSample sample;   ///< what the servo made of it
};

/// Logarithmic histogram of nanoseconds: 32 bins per power of two (2 % wide) from 64 ns to about 17 s.
class TimeHistogram {
 public:
  static constexpr int kBinsPerOctave = 32;          ///< bins per power of two
  static constexpr int kBins = kBinsPerOctave * 28;  ///< bins in all
  /// Counts a duration, ns.
  void add(std::uint64_t ns) noexcept;
  /// Returns how many were counted.
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  /// Returns the longest, ns.
  [[nodiscard]] std::uint64_t max() const noexcept { return max_; }
  /// Returns the value below which the share q of all values lies, 0..1, within a bin's width; 0 when empty.
  [[nodiscard]] std::uint64_t quantile(double q) const noexcept;
  /// Returns how many fell into a bin.
  [[nodiscard]] std::uint64_t bin_count(int bin) const noexcept { return bins_[static_cast<std::size_t>(bin)]; }
  /// Lower border of a bin, ns.
  [[nodiscard]] static double bin_low(int bin) noexcept;

 private:
  std::array<std::uint64_t, kBins> bins_{};
  std::uint64_t count_ = 0, max_ = 0;
};

/// Filled by the thread, read after stop().
struct ServoTimes {
  TimeHistogram period;        ///< from wake-up to wake-up
  TimeHistogram late;          ///< wake-up after the due time
  TimeHistogram compute;       ///< thread CPU time of device read + step + write
  std::uint64_t ticks = 0;     ///< ticks since the start
  std::uint64_t overruns = 0;  ///< whole periods skipped
  std::uint64_t dropped = 0;   ///< telemetry samples that found the queue full
  std::uint64_t losses = 0;    ///< times that the device did not answer
  bool realtime = false;       ///< SCHED_FIFO was granted
  bool memory_locked = false;  ///< mlockall was granted
  std::string note;            ///< what was not granted, and why it matters; empty when all was
};

/// Holds what is done about a device that does not answer: a pull device whose read() or write() fails, a push device
/// that has not called for a period and Readings::kSilence. It gets zero force at once, and is read or started again.
struct LossSettings {
  /// s without an answer, after which it is closed and opened again, each time; so long a push device may take to begin
  double reopen_after = 1;
  double give_up_after = 30;  ///< s without an answer, after which the loop ends; infinite: never
};

/// A time in which a device did not answer.
struct DeviceLoss {
  std::uint64_t tick = 0;  ///< the number of the tick in which it began
  double seconds = 0;      ///< how long, when it was over
  bool over = false;       ///< it answered again
  int reopened = 0;        ///< how often it was closed and opened again
  std::string reason;      ///< in the device's words, the last ones that it had
};

/// Owns the loop of one device: a thread on an absolute schedule of 1 ms that skips whole periods on overrun. It reads
/// a pull device, with SCHED_FIFO and locked memory where the system grants them, and looks whether a push device has
/// called. Forces are switched on before the first tick, once the device is ready (make_ready()), and off after an
/// explicit zero. A device that does not answer gets no force and is tried again.
class ServoThread {
 public:
  /// `device`, which is open, and `channel` must outlive the thread; `telemetry` may be null.
  ServoThread(HapticDevice& device, SnapshotChannel& channel, const ServoSettings& settings,
              SpscQueue<ServoTick>* telemetry, const LossSettings& loss = {});
  ServoThread(const ServoThread&) = delete;
  ServoThread& operator=(const ServoThread&) = delete;
  ~ServoThread();

  /// From one other thread; takes effect within a tick or two. False when the settings queue is full.
  bool set(const ServoSettings& settings) noexcept;
  /// False: from the next tick on no force, as if the device had switched its forces off itself; true again: forces
  /// come back through the safe state. Any thread, wait-free.
  void set_forces(bool on) noexcept { forces_.store(on, std::memory_order_release); }
  /// Returns whether the thread runs.
  [[nodiscard]] bool running() const noexcept { return running_.load(std::memory_order_acquire); }
  /// Ends the thread after a command of zero. Waits for it.
  void stop() noexcept;
  /// When the device did not answer, the first hundred times. Any thread; waits for the loop only while it is lost.
  [[nodiscard]] std::vector<DeviceLoss> losses() const;
  /// After stop(), or once running() is false.
  [[nodiscard]] const ServoTimes& times() const noexcept { return times_; }

 private:
  /// A wake-up of the loop, CLOCK_MONOTONIC in ns, and how much after its due time it came.
  struct Wake {
    std::uint64_t clock = 0, late = 0;
  };
  void run() noexcept;
  /// Pull: a tick.
  void ask(const Wake& wake) noexcept;
  /// Push: looks whether the device has called.
  void listen(const Wake& wake) noexcept;
  /// Returns a push device's tick. Between a start() of the device and its stop() the servo, the tick in hand, the
  /// telemetry and the times are those of its thread, else the loop's.
  [[nodiscard]] Wrench pushed(const DeviceState& reading) noexcept;
  /// What is due before the reading: settings, and what the clock says.
  void begin(const Wake& wake) noexcept;
  /// The servo's step with tick_.reading.
  void feel() noexcept;
  /// Completes the tick and sends it.
  void finish(bool answered, std::uint64_t compute, std::uint64_t late) noexcept;
  /// An explicit zero, also to a device that seems gone; a push device calls no more.
  void halt() noexcept;
  /// Switches the forces of an open device on, and has a push device call.
  [[nodiscard]] Status go();
  /// In a tick in which the device did not answer; `why` where that is known.
  void lose(std::uint64_t clock, const char* why = nullptr) noexcept;
  /// Starts or opens the lost device again, where that is due.
  void try_again(std::uint64_t clock) noexcept;
  /// It answers again.
  void recover(std::uint64_t clock) noexcept;
  [[nodiscard]] bool given_up(std::uint64_t clock) const noexcept;
  [[nodiscard]] double lost_for(std::uint64_t clock) const noexcept;
  /// Returns whether it is time to close and open a lost device.
  [[nodiscard]] bool reopen_due(std::uint64_t clock) const noexcept;
  /// Changes the loss that goes on, if it is noted.
  template <typename Change>
  void note(Change&& change) noexcept;
  HapticDevice& device_;
  Servo servo_;
  SnapshotChannel::Reader reader_;
  SpscQueue<ServoTick>* telemetry_;
  SpscQueue<ServoSettings> settings_;
  std::atomic<bool> stop_{false}, running_{true};
  std::atomic<bool> forces_{true};  ///< set_forces()
  ServoTimes times_;
  ServoTick tick_;               ///< the one in hand
  std::uint32_t carried_ = 0;    ///< flags that belong to the next sample
  std::uint64_t pushed_at_ = 0;  ///< CLOCK_MONOTONIC of a push device's last tick, ns; 0 before the first
  bool returning_ = false;       ///< the next reading is the first after a loss
  const bool pull_;
  std::atomic<std::uint64_t> calls_{0};  ///< of a push device
  std::atomic<bool> halted_{true};       ///< it is told zero, whatever it calls with
  // The loop's alone.
  std::uint64_t heard_ = 0;  ///< of these calls
  double silent_ = 0;        ///< s of the loop in which a push device has not called
  LossSettings loss_;
  bool open_ = false;                 ///< as far as the loop knows, with its forces on
  bool lost_ = false, told_ = false;  ///< the device does not answer; the telemetry has it
  std::uint64_t lost_at_ = 0;         ///< ns, since then
  double reopen_at_ = 0;              ///< s of the loss, when the device is due to be opened
  mutable std::mutex losses_mutex_;
  std::vector<DeviceLoss> losses_;
  std::thread thread_;
};

/// Returns the same loop with nothing in it, for comparison: sleeps to each due time for `seconds`, or until `stop`, on
/// a thread of its own.
[[nodiscard]] ServoTimes null_loop(double seconds, const std::atomic<bool>* stop = nullptr);

}  // namespace relief
