#include <relief/haptics/guard.h>
#include <relief/haptics/readings.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relief {
namespace {

// Bounds (OfPlaceAndTime).
constexpr double kReach = 10;        // m from the device's origin; no device's arm is longer
constexpr double kFarModel = 1e100;  // model units; squares of it are still finite
constexpr double kFarTime = 1e12;    // s; beyond it a millisecond is lost in the rounding
// Radii of the stated workspace. That is where forces are good; arms reach two to three times as far, and simulated
// hands and our own recordings stay within 2.8 (FurtherThanFourRadiiIsASafeState).
constexpr double kReachOfRadius = 4;
// s, by which a device's clock may run back and still tell nothing new (LongerStepsBackAndBadPositionsAreFaults).
constexpr double kJitter = 2e-3 + 1e-9;
constexpr double kMaxSpeed = ForceGuard::kFastest;
// m/s and s: a hand goes a millimetre in that time, many steps of any encoder (OfAVelocityThatGoesNowhere).
constexpr double kFrozenSpeed = 0.05, kFrozenTime = 20e-3;
constexpr double kSensorStep = 1e-4;  // m, what an encoder may jump by in no time at all (OfSpeed)
// s, time constant: a step of 0.1 mm in one tick is no 0.1 m/s (FollowsWithThreeMilliseconds).
constexpr double kVelocityFilter = 3e-3;
// The next two: LateTicksLowerTheStiffnessThatIsAllowed.
constexpr double kInTime = 1.25e-3;  // s; a device's max_stiffness is good for ticks that come no later
constexpr double kSlowStep = 2e-4;   // s, by which one late tick may move the estimate: five make a millisecond
// Share of ticks that may be later: the estimate is the 99.9 % quantile (OneLateTickInAThousandIsNone).
constexpr double kRare = 1e-3;
// Of the device's stiffness, per tick: it takes 0.2 s for all of it, which is no step
// (TheStiffnessThatIsGoodForItMovesByHalfAPercentPerTick).
constexpr double kSoften = 5e-3;
// The next two: APositionThatStandsStillWhileThePenTurns.
constexpr double kStill = 2;              // s without a step of the encoders; hands tremble by more
constexpr double kTurned = 0.1;           // rad of the pen in that time, which no wrist does without moving the arm
constexpr std::uint32_t kButtons = 0xff;  // of the word of buttons; above it stands a number

bool denormal(Vec3d v) noexcept {
  return std::fpclassify(v.x) == FP_SUBNORMAL || std::fpclassify(v.y) == FP_SUBNORMAL ||
         std::fpclassify(v.z) == FP_SUBNORMAL;
}

bool near(Vec3d v, double limit) noexcept {
  return is_finite(v) && std::abs(v.x) <= limit && std::abs(v.y) <= limit && std::abs(v.z) <= limit;
}

/// Returns the rotation from one orientation to another as a vector along its axis, rad; good for small ones.
Vec3d turn_between(Quatd from, Quatd to) noexcept {
  const Vec3d a = {from.x, from.y, from.z}, b = {to.x, to.y, to.z};
  const Vec3d half = from.w * b - to.w * a - cross(b, a);
  return half * (dot(from, to) < 0 ? -2.0 : 2.0);
}

}  // namespace

Readings::Readings(const DeviceInfo& device) noexcept
    : radius_(device.workspace_radius), box_(device.workspace), tick_(tick_of(device)), absolute_(device.absolute) {}

void Readings::judge_period(double dt) noexcept {
  period_ += dt > period_ ? std::min(kSlowStep, dt - period_) * (1 - kRare) : -kSlowStep * kRare;
  period_ = std::max(period_, kInTime);
  // A single late tick is none. What a spring makes of many grows with stiffness times period: less of the one, and
  // damping for the rest.
  late_ = std::max(0.0, period_ - kInTime - kSlowStep);
  softer_ += std::clamp(kInTime / (kInTime + late_) - softer_, -kSoften, kSoften);
}

bool Readings::judge_time(double t, Judged& now) noexcept {
  now.dt = tick_;
  if (!(std::abs(t) <= kFarTime) || std::fpclassify(t) == FP_SUBNORMAL) {
    now.faults |= bit(ServoFault::BadTime);
    has_time_ = false;
    return false;
  }
  const double dt = t - last_t_;
  if (has_time_ && dt <= 0 && dt >= -kJitter) {
    now.news = false;
    now.warnings |= bit(ServoFault::NoNews);
    silent_ += tick_;
    if (silent_ > kSilence + 0.5 * tick_) now.faults |= bit(ServoFault::BadTime);
    return false;
  }
  silent_ = 0;
  last_t_ = t;
  if (!std::exchange(has_time_, true)) return false;
  if (!(dt > 0 && dt <= kMaxGap)) {
    now.faults |= bit(ServoFault::BadTime);
    return false;
  }
  now.dt = dt;
  judge_period(dt);
  return true;
}

std::uint32_t Readings::judge_buttons(const DeviceState& reading, double dt) noexcept {
  if (((reading.buttons | reading.pressed | down_) & kButtons) == 0) return reading.buttons;
  for (std::size_t k = 0; k < up_.size(); ++k) {
    const std::uint32_t button = 1U << k;
    // What is down now and was up in between counts as up for this tick, where that is long enough.
    const bool let_go = (down_ & reading.released & button) != 0 && !(settings_.debounce > 0);
    if (!let_go && ((reading.buttons | reading.pressed) & button) != 0) {
      down_ |= button;
      up_[k] = 0;
    } else {
      up_[k] += dt;
      if (let_go || !(up_[k] < settings_.debounce)) down_ &= ~button;
    }
  }
  return (reading.buttons & ~kButtons) | down_;
}

bool Readings::usable(Vec3d position, const Workspace& space) const noexcept {
  if (!(space.metres_per_unit > 0 && std::isfinite(space.metres_per_unit))) return false;
  if (denormal(position) || !near(position, kReach) || !near(space.to_model(position), kFarModel)) return false;
  if (box_.empty()) return !(radius_ > 0) || length(position) <= kReachOfRadius * radius_;
  const Vec3d half = box_.extent() * 0.5, off = position - box_.centre();
  for (std::size_t k = 0; k < 3; ++k)
    if (half[k] > 0 && std::abs(off[k]) > kReachOfRadius * half[k]) return false;
  return true;
}

void Readings::judge_motion(const DeviceState& reading, bool timed, Judged& now) noexcept {
  if (has_position_) now.step = reading.position - last_position_;
  const double travel = length(now.step);
  if (timed && travel > kMaxSpeed * now.dt + kSensorStep) now.faults |= bit(ServoFault::TooFast);
  if (!reading.has_velocity) return;
  if (!is_finite(reading.velocity))
    now.faults |= bit(ServoFault::BadPosition);
  else if (length(reading.velocity) > kMaxSpeed)
    now.faults |= bit(ServoFault::TooFast);
  // A sensor that says it moves and stays where it is.
  frozen_ = has_position_ && travel == 0 && length(reading.velocity) > kFrozenSpeed ? frozen_ + now.dt : 0;
  if (frozen_ > kFrozenTime) now.faults |= bit(ServoFault::BadPosition);
}

void Readings::judge_orientation(const DeviceState& reading, Judged& now) noexcept {
  if (!reading.has_orientation) {
    orientation_ = {};
    return;
  }
  if (const auto q = unit(reading.orientation))
    orientation_ = *q;
  else
    now.faults |= bit(ServoFault::BadPosition);
}

bool Readings::looks_uncalibrated(const DeviceState& reading, const Judged& now) noexcept {
  if (!absolute_ || !reading.has_orientation || !has_position_ || now.step != Vec3d{}) {
    still_ = 0;
    still_from_ = orientation_;
    turned_ = false;
    return false;
  }
  still_ += now.dt;
  // For small angles the quaternions are half of it apart.
  const double same = dot(still_from_, orientation_);
  turned_ = turned_ || 4 * (1 - same * same) > kTurned * kTurned;
  return turned_ && still_ > kStill;
}

Readings::Judged Readings::judge(const DeviceState& reading, const Workspace& space) noexcept {
  Judged now;
  now.faults = std::exchange(interrupted_, 0U);
  if (reading.forces_off) now.faults |= bit(ServoFault::ForcesOff);
  const bool timed = judge_time(reading.t, now);
  now.buttons = judge_buttons(reading, now.dt);
  now.has_position = usable(reading.position, space);
  if (!now.has_position) {
    now.faults |= bit(ServoFault::BadPosition);
    has_position_ = false;
    velocity_ = {};
    now.orientation = orientation_;
    return now;
  }
  if (now.news || now.faults != 0) {
    judge_motion(reading, timed, now);
    judge_orientation(reading, now);
    if (looks_uncalibrated(reading, now)) now.warnings |= bit(ServoFault::Uncalibrated);
    if (now.faults != 0)
      velocity_ = {};
    else if (reading.has_velocity)
      velocity_ = reading.velocity;
    else  // an implicit step of the filter: right for any dt, and never a division by it
      velocity_ = (velocity_ * kVelocityFilter + now.step) / (kVelocityFilter + now.dt);
    last_position_ = reading.position;
    has_position_ = true;
    if (now.faults == 0) now.turn = turn_between(std::exchange(last_orientation_, orientation_), orientation_);
  }
  now.velocity = velocity_;
  now.orientation = orientation_;
  return now;
}

}  // namespace relief
