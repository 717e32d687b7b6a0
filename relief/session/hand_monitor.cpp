#include <relief/session/hand_monitor.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace relief {
namespace {

/// What may begin a time without force, what people should hear of first before the rest.
constexpr std::array kStops = {ServoFault::DeviceLost,  ServoFault::ForcesOff, ServoFault::Reconnected,
                               ServoFault::Stalled,     ServoFault::TooFast,   ServoFault::SurfaceJumped,
                               ServoFault::BadPosition, ServoFault::BadTime,   ServoFault::StartInside};
/// Of these an explicit end is still to come: the device answers again, somebody switches forces on.
constexpr std::uint32_t kLasting = bit(ServoFault::DeviceLost) | bit(ServoFault::ForcesOff);
/// What takes force away and leaves the rest, and what people should know of. A force that grows at its greatest rate
/// is each first contact, and the passivity controller works unseen.
constexpr std::array kLimits = {ServoFault::Uncalibrated, ServoFault::LateTicks, ServoFault::LoadLimited,
                                ServoFault::SpeedLimited, ServoFault::ForceClamped};
constexpr std::uint32_t kSafeState = bit(ServoFault::Latched) | bit(ServoFault::StartInside) | kLasting;

template <std::size_t N>
ServoFault first_of(const std::array<ServoFault, N>& faults, std::uint32_t flags) noexcept {
  for (const ServoFault fault : faults)
    if ((flags & bit(fault)) != 0) return fault;
  return ServoFault::None;
}

}  // namespace

void SafetyWatch::tick(const ServoSample& sample) noexcept {
  // A device that does not answer tells no time.
  const double t = std::isfinite(sample.t) ? sample.t : last_stop_.t + last_stop_.seconds;
  judge(sample, t);
  count_alarm((sample.flags & bit(ServoFault::DeviceLost)) != 0, t);
}

void SafetyWatch::judge(const ServoSample& sample, double t) noexcept {
  if (std::exchange(first_, false)) touched_ = limited_ = t - 2 * kHold;
  if (sample.contact) touched_ = t;
  if (const ServoFault limit = first_of(kLimits, sample.flags); limit != ServoFault::None) {
    limit_ = limit;
    limited_ = t;
  }
  const bool was_stopped = now_.state == HandState::NoForce;
  if ((sample.flags & kSafeState) == 0) {
    if (was_stopped) last_stop_.over = true;
    const auto lately = [&](double when) { return t - when >= 0 && t - when <= kHold; };
    if (lately(limited_))
      now_ = {.state = HandState::Limited, .cause = limit_};
    else
      now_ = {.state = lately(touched_) ? HandState::Touching : HandState::Free};
    return;
  }
  const ServoFault cause = first_of(kStops, sample.flags);
  if (!was_stopped) {
    ++stops_;
    last_stop_ = {.cause = cause, .t = t};
    untold_ = true;
  } else if (cause != ServoFault::None && cause != ServoFault::StartInside) {
    untold_ = untold_ || cause != last_stop_.cause;
    last_stop_.cause = cause;  // the newest one is what people must know to go on
  }
  last_stop_.seconds = std::max(last_stop_.seconds, t - last_stop_.t);
  now_ = {.state = HandState::NoForce, .cause = last_stop_.cause, .lift_off = (sample.flags & kLasting) == 0};
}

void SafetyWatch::count_alarm(bool lost, double t) noexcept {
  const bool was_unsteady = unsteady_;
  answers_since_ = lost ? std::numeric_limits<double>::infinity() : std::min(answers_since_, t);
  unsteady_ = lost || (was_unsteady && t - answers_since_ < kSteady);
  const bool of_line = last_stop_.cause == ServoFault::DeviceLost || last_stop_.cause == ServoFault::Reconnected;
  // Whoever was told of the loss hears no more of the line before it is steady.
  if (!untold_ || (of_line && was_unsteady && unsteady_ && told_loss_)) return;
  untold_ = false;
  const ServoFault cause = last_stop_.cause;
  // These say nothing to anybody, so the loss is still what was heard last.
  if (cause != ServoFault::ForcesOff && cause != ServoFault::StartInside && cause != ServoFault::None)
    told_loss_ = cause == ServoFault::DeviceLost;
  alarm_ = last_stop_;
  ++alarms_;
}

HandMonitor::HandMonitor(std::size_t capacity) : queue_(kWaiting), capacity_(std::max<std::size_t>(capacity, 1)) {
  ring_.reserve(capacity_);
}

void HandMonitor::tick(const ServoTick& tick) noexcept {
  // A full queue drops it; the gap in the numbers tells.
  static_cast<void>(queue_.push({tick.number, tick.clock_ns, tick.sample}));
}

std::size_t HandMonitor::drain() {
  std::size_t count = 0;
  for (Waiting waiting; queue_.pop(waiting); ++count) keep(waiting);
  return count;
}

void HandMonitor::keep(const Waiting& tick) {
  const ServoSample& sample = tick.sample;
  // The first tick of a loss has no sample of its own: what was last is still where the hand was.
  const bool lost = (sample.flags & bit(ServoFault::DeviceLost)) != 0;
  if (!lost) {
    missing_ += tick.number > next_ ? tick.number - next_ : 0;
    next_ = tick.number + 1;
  }
  const double period = clock_ns_ > 0 ? static_cast<double>(tick.clock_ns - clock_ns_) * 1e-9 : 0;
  clock_ns_ = tick.clock_ns;
  if (lost) {
    last_.flags = sample.flags;
    last_.force = last_.torque = {};
  } else {
    last_ = sample;
  }
  const HandTick kept = {.t = last_.t,
                         .position = to_float(last_.cursor),
                         .contact_point = to_float(last_.contact_point),
                         .force = to_float(last_.force),
                         .depth = static_cast<float>(last_.depth),
                         .period = static_cast<float>(period),
                         .late = static_cast<float>(sample.late_ns) * 1e-9F,
                         .compute = static_cast<float>(sample.compute_ns) * 1e-9F,
                         .flags = last_.flags,
                         .contact = last_.contact};
  safety_.tick(last_);
  ++taken_;
  if (ring_.size() < capacity_) {
    ring_.push_back(kept);
    return;
  }
  ring_[oldest_] = kept;
  oldest_ = (oldest_ + 1) % capacity_;
}

std::vector<HandTick> HandMonitor::freeze() const {
  std::vector<HandTick> copy;
  copy.reserve(ring_.size());
  for (std::size_t k = 0; k < ring_.size(); ++k) copy.push_back((*this)[k]);
  return copy;
}

void HandMonitor::clear() {
  for (Waiting waiting; queue_.pop(waiting);) {
  }
  ring_.clear();
  oldest_ = 0;
  last_ = {};
  safety_ = {};
  taken_ = missing_ = next_ = clock_ns_ = 0;
}

}  // namespace relief
