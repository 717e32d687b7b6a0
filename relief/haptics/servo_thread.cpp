#include <relief/base/cpu_time.h>
#include <relief/base/try.h>
#include <relief/haptics/servo_thread.h>

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <time.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <exception>
#include <fstream>
#include <system_error>
#include <utility>

namespace relief {
namespace {

constexpr std::uint64_t kPeriod = 1'000'000;  // ns
constexpr double kLook = 1e-9 * kPeriod;      // s
// A clock of the device's own may not show that it stood still.
constexpr auto kStandstill = static_cast<std::uint64_t>(1e9 * Readings::kMaxGap);  // ns
constexpr int kPriority = 80;              // below the kernel's own threads for USB
constexpr std::size_t kNotedLosses = 100;  // a device that drops out all day must not fill the memory

std::uint64_t monotonic_ns() noexcept { return detail::clock_ns(CLOCK_MONOTONIC); }

void sleep_until(std::uint64_t due) noexcept {
  timespec at{};
  at.tv_sec = static_cast<time_t>(due / 1'000'000'000U);
  at.tv_nsec = static_cast<long>(due % 1'000'000'000U);
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) == EINTR) {
  }
}

std::uint32_t as_u32(std::uint64_t ns) noexcept {
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(ns, 0xffffffffU));
}

/// Writes to each page of the stack that the loop may use, so that no tick pays for a page fault.
[[gnu::noinline]] void touch_stack() noexcept {
  volatile char pages[256 * 1024];
  for (std::size_t k = 0; k < sizeof pages; k += 4096) pages[k] = 0;
}

/// With a limit on locked memory, locking the future would make later allocations of the whole program fail.
bool may_lock_everything() {
  rlimit limit{};
  if (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY) return true;
  constexpr std::uint64_t kIpcLock = 1U << 14U;  // CAP_IPC_LOCK
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;)
    if (word == "CapEff:" && status >> word)
      return word.size() <= 16 && word.find_first_not_of("0123456789abcdef") == std::string::npos &&
             (std::stoull(word, nullptr, 16) & kIpcLock) != 0;
  return false;
}

/// Asks the system for what a 1 kHz thread wants, for the calling thread; memory stays locked until the program ends.
void prepare_thread(ServoTimes& times) noexcept {
  try {
    touch_stack();
    sched_param priority{};
    priority.sched_priority = kPriority;
    times.realtime = pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority) == 0;
    if (!times.realtime) {
      prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
      times.note =
          "no real-time priority (allow rtprio 80 in limits.conf): ticks may come late when the machine is busy";
    }
    times.memory_locked = may_lock_everything() && mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0;
    if (!times.memory_locked) {
      if (!times.note.empty()) times.note += "; ";
      times.note += "memory is not locked (allow memlock unlimited in limits.conf): a tick may wait for the disk";
    }
  } catch (const std::exception&) {
    times.note.clear();  // no memory for a note: go on without it
  }
}

/// Counts a tick, `period` ns after the one before and `late` ns after its due time.
void count_tick(ServoTimes& times, std::uint64_t period, std::uint64_t late) noexcept {
  times.period.add(period);
  times.late.add(late);
  times.overruns += late / kPeriod;
  ++times.ticks;
}

/// The absolute schedule: when each tick is due.
class Schedule {
 public:
  /// When the thread last woke, CLOCK_MONOTONIC in ns.
  [[nodiscard]] std::uint64_t woken() const noexcept { return woken_; }
  /// From the wake-up before to the last one, ns.
  [[nodiscard]] std::uint64_t period() const noexcept { return period_; }
  /// Sleeps to the next due time. Returns how late the thread woke, in ns; whole periods of it are skipped.
  std::uint64_t wait() noexcept {
    due_ += kPeriod;
    sleep_until(due_);
    const std::uint64_t now = monotonic_ns();
    const std::uint64_t late = now > due_ ? now - due_ : 0;
    due_ += late / kPeriod * kPeriod;
    period_ = now - std::exchange(woken_, now);
    return late;
  }

 private:
  std::uint64_t due_ = monotonic_ns(), woken_ = due_, period_ = 0;
};

}  // namespace

void TimeHistogram::add(std::uint64_t ns) noexcept {
  std::size_t bin = 0;
  if (ns >= 64) {
    const auto power = static_cast<unsigned>(std::bit_width(ns)) - 1U;
    // The five bits below the highest one, which there are from 64 on.
    bin = std::min<std::size_t>(std::size_t{power - 6U} * kBinsPerOctave + ((ns >> (power - 5U)) & 31U), kBins - 1);
  }
  ++bins_[bin];
  ++count_;
  max_ = std::max(max_, ns);
}

double TimeHistogram::bin_low(int bin) noexcept {
  return std::ldexp(1 + (bin % kBinsPerOctave) / double{kBinsPerOctave}, 6 + bin / kBinsPerOctave);
}

std::uint64_t TimeHistogram::quantile(double q) const noexcept {
  if (count_ == 0) return 0;
  const double wanted = std::clamp(q, 0.0, 1.0) * static_cast<double>(count_);
  double seen = 0;
  for (int bin = 0; bin < kBins; ++bin) {
    const auto here = static_cast<double>(bin_count(bin));
    if (here > 0 && seen + here >= wanted) {
      // The values of a bin are taken to lie evenly in it; the last bin ends at the greatest value.
      const double low = bin_low(bin), high = std::min(bin_low(bin + 1), static_cast<double>(max_));
      return static_cast<std::uint64_t>(low + (std::max(high, low) - low) * std::max(0.0, wanted - seen) / here);
    }
    seen += here;
  }
  return max_;
}

ServoThread::ServoThread(HapticDevice& device, SnapshotChannel& channel, const ServoSettings& settings,
                         SpscQueue<ServoTick>* telemetry, const LossSettings& loss)
    : device_(device),
      servo_(settings, device.info()),
      reader_(channel.reader()),
      telemetry_(telemetry),
      settings_(16),
      pull_(device.info().pull),
      loss_(loss) {
  losses_.reserve(16);
  if (!pull_) times_.note = "the device has its own thread, at its own priority";
  try {
    thread_ = std::thread([this] { run(); });
  } catch (const std::system_error&) {
    times_.note = "the system gave no thread for the servo";
    running_.store(false, std::memory_order_release);
  }
}

ServoThread::~ServoThread() { stop(); }

bool ServoThread::set(const ServoSettings& settings) noexcept { return settings_.push(settings); }

void ServoThread::stop() noexcept {
  stop_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
}

void ServoThread::begin(const Wake& wake) noexcept {
  if (wake.late >= kPeriod) carried_ |= bit(ServoFault::Overrun);
  if (wake.late > kStandstill) servo_.stalled();
  if (std::exchange(returning_, false)) servo_.reconnected();
  for (ServoSettings changed; settings_.pop(changed); ++tick_.settings) servo_.set(changed);
  tick_.clock_ns = wake.clock;
  tick_.model = nullptr;
  tick_.reading = {};
  tick_.sample = {};
}

void ServoThread::feel() noexcept {
  // As part of the reading, so that a recording of it gives the same forces again.
  tick_.reading.forces_off = tick_.reading.forces_off || !forces_.load(std::memory_order_acquire);
  // What was begun is seen to its end, however often somebody changes the model; but what they do is felt.
  const Snapshot& model = servo_.is_looking() ? reader_.current() : reader_.latest();
  tick_.model = &model;
  tick_.sample = servo_.step(model, tick_.reading);
}

void ServoThread::finish(bool answered, std::uint64_t compute, std::uint64_t late) noexcept {
  ServoSample& sample = tick_.sample;
  const bool stepped = tick_.model != nullptr;
  if (!answered) {
    sample.force = sample.torque = {};
    sample.flags |= bit(ServoFault::DeviceLost);
    if (!stepped && std::exchange(told_, true)) return;
  }
  sample.flags |= carried_;
  sample.compute_ns = as_u32(compute);
  sample.late_ns = as_u32(late);
  carried_ = 0;
  if (telemetry_ != nullptr && !telemetry_->push(tick_)) {
    ++times_.dropped;
    carried_ = bit(ServoFault::SampleDropped);
  }
  if (stepped) ++tick_.number;
}

template <typename Change>
void ServoThread::note(Change&& change) noexcept {
  try {
    const std::scoped_lock lock(losses_mutex_);
    if (!losses_.empty() && !losses_.back().over) change(losses_.back());
  } catch (const std::exception&) {  // no memory for words: the loop goes on without them
    return;
  }
}

double ServoThread::lost_for(std::uint64_t clock) const noexcept {
  return lost_ ? static_cast<double>(clock - lost_at_) * 1e-9 : 0;
}

bool ServoThread::given_up(std::uint64_t clock) const noexcept {
  return lost_ && lost_for(clock) >= loss_.give_up_after;
}

bool ServoThread::reopen_due(std::uint64_t clock) const noexcept { return lost_for(clock) >= reopen_at_; }

void ServoThread::halt() noexcept {
  // Nobody can act on a refusal here.
  if (pull_) {
    static_cast<void>(device_.write({}));
  } else {
    halted_.store(true, std::memory_order_release);
    device_.stop();
  }
}

Status ServoThread::go() {
  RELIEF_CHECK(device_.enable(true));
  if (pull_) return {};
  const auto call = [](void* servo, const DeviceState& reading) noexcept {
    return static_cast<ServoThread*>(servo)->pushed(reading);
  };
  halted_.store(false, std::memory_order_release);
  if (device_.start({this, call})) return {};
  return fail(Errc::DeviceUnavailable, device_.status().trouble);
}

void ServoThread::lose(std::uint64_t clock, const char* why) noexcept {
  returning_ = true;
  if (std::exchange(lost_, true)) return;
  lost_at_ = clock;
  reopen_at_ = loss_.reopen_after;
  told_ = false;
  ++times_.losses;
  try {
    DeviceLoss loss;
    loss.tick = tick_.number;
    loss.reason = why != nullptr ? why : device_.status().trouble;
    const std::scoped_lock lock(losses_mutex_);
    if (losses_.size() < kNotedLosses) losses_.push_back(std::move(loss));
  } catch (const std::exception&) {  // no memory for words: the loop goes on without them
    return;
  }
}

void ServoThread::try_again(std::uint64_t clock) noexcept {
  const bool reopens = reopen_due(clock);
  if (!reopens && (pull_ || !open_)) return;
  Status up;
  if (reopens) {
    device_.close();
    up = bring_up(device_);
  }
  if (up) up = go();
  open_ = up.has_value();
  note([&](DeviceLoss& loss) {
    loss.reopened += reopens ? 1 : 0;
    if (!up && !up.error().message.empty()) loss.reason = up.error().message;
  });
  if (reopens) reopen_at_ = lost_for(monotonic_ns()) + loss_.reopen_after;
}

void ServoThread::recover(std::uint64_t clock) noexcept {
  note([&](DeviceLoss& loss) {
    loss.seconds = lost_for(clock);
    loss.over = true;
  });
  lost_ = false;
}

std::vector<DeviceLoss> ServoThread::losses() const {
  const std::scoped_lock lock(losses_mutex_);
  return losses_;
}

void ServoThread::run() noexcept {
  if (pull_) prepare_thread(times_);
  Status up = make_ready(device_);
  if (up) up = go();
  open_ = up.has_value();
  if (!open_) lose(monotonic_ns(), up.error().message.c_str());
  Schedule schedule;
  while (!(pull_ && device_.ended()) && !stop_.load(std::memory_order_acquire) && !given_up(schedule.woken())) {
    const std::uint64_t late = schedule.wait();
    if (pull_) count_tick(times_, schedule.period(), late);
    const Wake wake = {.clock = schedule.woken(), .late = late};
    if (pull_)
      ask(wake);
    else
      listen(wake);
  }
  note([&](DeviceLoss& loss) { loss.seconds = lost_for(schedule.woken()); });
  halt();
  static_cast<void>(device_.enable(false));
  running_.store(false, std::memory_order_release);
}

void ServoThread::ask(const Wake& wake) noexcept {
  const std::uint64_t start = thread_cpu_ns();
  begin(wake);
  bool answered = open_ && device_.read(tick_.reading);
  if (answered) {
    feel();
    answered = device_.write(servo_.command());
  }
  if (answered) {
    if (lost_) recover(wake.clock);
  } else {
    halt();
    lose(wake.clock);
  }
  const std::uint64_t compute = thread_cpu_ns() - start;
  times_.compute.add(compute);
  finish(answered, compute, wake.late);
  if (!answered) try_again(wake.clock);
}

void ServoThread::listen(const Wake& wake) noexcept {
  const std::uint64_t calls = calls_.load(std::memory_order_acquire);
  if (calls != std::exchange(heard_, calls)) {
    silent_ = 0;
    if (lost_) recover(wake.clock);
    return;
  }
  silent_ += kLook;  // of the loop's own time: a machine that stood still does not count
  double patience = Readings::kSilence + tick_of(device_.info());
  if (calls == 0) patience = std::max(patience, loss_.reopen_after);
  const bool waits = lost_ && told_ ? !reopen_due(wake.clock) : open_ && silent_ < patience;
  if (waits) return;
  halt();
  heard_ = calls_.load(std::memory_order_acquire);
  pushed_at_ = 0;
  begin({.clock = wake.clock});
  lose(wake.clock);
  finish(false, 0, 0);
  try_again(wake.clock);
}

Wrench ServoThread::pushed(const DeviceState& reading) noexcept {
  const std::uint64_t clock = monotonic_ns(), start = thread_cpu_ns();
  calls_.fetch_add(1, std::memory_order_release);
  // Its schedule is not ours to know: late is what the period has over a millisecond.
  const std::uint64_t period = pushed_at_ > 0 ? clock - pushed_at_ : kPeriod;
  const std::uint64_t late = period > kPeriod ? period - kPeriod : 0;
  pushed_at_ = clock;
  count_tick(times_, period, late);
  begin({.clock = clock, .late = late});
  tick_.reading = reading;
  feel();
  const Wrench felt = halted_.load(std::memory_order_acquire) ? Wrench{} : servo_.command();
  const std::uint64_t compute = thread_cpu_ns() - start;
  times_.compute.add(compute);
  finish(true, compute, late);
  return felt;
}

ServoTimes null_loop(double seconds, const std::atomic<bool>* stop) {
  ServoTimes times;
  const auto ticks = static_cast<std::uint64_t>(std::clamp(seconds, 0.0, 3600.0) * 1000);
  const auto loop = [&times, ticks, stop] {
    prepare_thread(times);
    Schedule schedule;
    const std::uint64_t end = monotonic_ns() + ticks * kPeriod;
    while (monotonic_ns() + kPeriod <= end && (stop == nullptr || !stop->load(std::memory_order_relaxed))) {
      const std::uint64_t late = schedule.wait();
      count_tick(times, schedule.period(), late);
      const std::uint64_t start = thread_cpu_ns();
      times.compute.add(thread_cpu_ns() - start);
    }
  };
  try {
    std::thread(loop).join();
  } catch (const std::system_error&) {
    times.note = "the system gave no thread for the null loop";
  }
  return times;
}

}  // namespace relief
