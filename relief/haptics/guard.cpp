#include <relief/haptics/fault.h>
#include <relief/haptics/guard.h>

#include <algorithm>
#include <cmath>

namespace relief {
namespace {

constexpr double kHair = 1 - 1e-12;  // keeps rounded forces below their limit
constexpr double kTick = 1e-3;       // s
// The next four: DampsByItsLeakInTwentyMicrojoules.
constexpr double kLeak = 2e-5;       // J lately that call for all the damping there is: 0.04 N over half a millimetre
constexpr double kSmallLeak = 1e-7;  // J that call for none: 0.01 N over 10 micrometres
constexpr double kDamping = 5;       // N*s/m; more only kicks, through the lag of the velocity
constexpr double kLately = 0.5;      // s: some periods of a hand's tremor, 8 to 12 Hz
// Of the greatest force: damping that is reported; hands feel differences of 7 % (DampingIsToldWhereItIsFelt).
constexpr double kNoticed = 0.01;
// s, and of the greatest force: the first contact after a start, when nobody knows yet what the hand is in
// (TheFirstContactIsGentle).
constexpr double kFirstContact = 20e-3, kFirstShare = 0.5;
// Of the share of the last force that may stay: to 1/4,096 of it, 3 mN of 12 N
// (WhereTheSurfaceTurnsAsMuchStaysAsDoesNotPullIn).
constexpr int kHalvings = 12;

}  // namespace

void ForceGuard::set(const GuardLimits& limits, bool guarding) noexcept {
  limits_ = limits;
  limits_.delay_ticks = std::clamp(limits.delay_ticks, 0, static_cast<int>(given_.size()) - 1);
  guarding_ = guarding;
}

void ForceGuard::restart() noexcept {
  moving_ = false;
  given_ = {};
  done_ = leak_ = 0;
  energy_.set(0);
  first_contact_ = true;
  in_contact_ = 0;
}

void ForceGuard::observe(const Motion& now) noexcept {
  if (moving_) {
    const Wrench& acting = given_[static_cast<std::size_t>(limits_.delay_ticks)];
    done_ = dot(acting.force, now.position - motion_.position) + dot(acting.torque, now.turn);
    // A bucket that holds half of what is allowed in a second and leaks the other half.
    work_ = std::max(0.0, work_ - 0.5 * limits_.max_work * now.dt) + std::max(0.0, done_);
    warmth_ += -std::expm1(-now.dt / kWarmUp) * (dot(given_[0].force, given_[0].force) - warmth_);
  }
  motion_ = now;
  moving_ = true;
}

void ForceGuard::command(const Wrench& wrench) noexcept {
  std::shift_right(given_.begin(), given_.end(), 1);
  given_[0] = wrench;
}

void ForceGuard::turn(Quatd axes) noexcept {
  motion_.position = axes.turn(motion_.position);
  for (Wrench& given : given_) given = {axes.turn(given.force), axes.turn(given.torque), given.gripper};
}

void ForceGuard::book(double stored, double gift, bool judged) noexcept {
  const double made = energy_.book(done_, stored, gift);
  leak_ = std::min(leak_ * std::exp(-motion_.dt / kLately) + (judged ? std::max(0.0, made) : 0.0), kLeak);
}

void ForceGuard::rest() noexcept {
  book(0, 0, !motion_.moved);
  command({});
  if (in_contact_ > 0) first_contact_ = false;
}

double ForceGuard::most_now() const noexcept {
  double most = limits_.max_force;
  if (!guarding_) return most;
  // Falls from the greatest to the continuous force as the motors warm up, so that the mean square never passes it.
  const double lasting = limits_.continuous_force * limits_.continuous_force;
  const double steep = std::max(0.0, most * most / std::max(lasting, 1e-300) - 1);
  most = std::min(most, std::sqrt(std::max(0.0, lasting + (lasting - warmth_) * steep)));
  // Whatever the hand does in the next millisecond, the bucket does not run over.
  most = std::min(most, std::max(0.0, 0.5 * limits_.max_work - work_) / (kFastest * kTick));
  return most;
}

Wrench ForceGuard::wrench(const Wish& wish, std::uint32_t& flags) noexcept {
  book(wish.stored, wish.gift, !motion_.moved && !wish.moved);
  in_contact_ += motion_.dt;
  Wrench given;
  given.force = force(wish, flags);
  given.torque = torque(wish, given.force);
  command(given);
  return given;
}

Vec3d ForceGuard::torque(const Wish& wish, Vec3d force) const noexcept {
  const double asked = length(wish.force);
  Vec3d wanted = asked > 0 ? wish.torque * std::min(1.0, length(force) / asked) : wish.torque;
  if (const double size = length(wanted); size > limits_.max_torque) wanted *= limits_.max_torque / size * kHair;
  // It grows as quickly as the force, as a share of what is allowed.
  Vec3d start = given_[0].torque;
  if (const double had = length(start), want = length(wanted); had > want) start *= want / had;
  const Vec3d change = wanted - start;
  const double far =
      limits_.max_force > 0 ? limits_.max_force_rate / limits_.max_force * limits_.max_torque * motion_.dt * kHair : 0;
  const double size = length(change);
  return size > far ? start + change * (far / size) : wanted;
}

Vec3d ForceGuard::force(const Wish& wish, std::uint32_t& flags) const noexcept {
  Vec3d wanted = wish.force;
  const Vec3d normal = wish.normal;
  if (guarding_) {
    const double speed = length(motion_.velocity);
    // Neither brake ever pulls inwards: each takes from the push only.
    const double push = std::max(0.0, dot(wanted, normal));
    if (leak_ > kSmallLeak) {
      const double damping = leak_ / kLeak * std::min(limits_.max_damping, kDamping);
      const double taken = std::min(push, damping * dot(motion_.velocity, normal));
      wanted -= normal * taken;
      if (std::abs(taken) > kNoticed * limits_.max_force) flags |= bit(ServoFault::Passivity);
    }
    if (const double too_fast = speed - limits_.max_speed; too_fast > 0) {
      const Vec3d way = motion_.velocity / speed;
      wanted -= way * (std::max(0.0, dot(wanted, way)) * std::min(1.0, too_fast / limits_.max_speed) +
                       limits_.max_damping * too_fast);
      if (const double pull = dot(wanted, normal); pull < 0) wanted -= normal * pull;
      flags |= bit(ServoFault::SpeedLimited);
    }
  }
  double most = most_now();
  if (most < limits_.max_force && length(wanted) > most) flags |= bit(ServoFault::LoadLimited);
  if (guarding_ && first_contact_ && in_contact_ <= kFirstContact)
    most = std::min(most, kFirstShare * limits_.max_force);
  if (const double size = length(wanted); size > most) {
    wanted *= most / size * kHair;
    flags |= bit(ServoFault::ForceClamped);
  }
  // As near to what is wanted as it comes from a share of the last force.
  const double far = limits_.max_force_rate * motion_.dt * kHair;
  const auto from = [&](double share) noexcept {
    const Vec3d start = given_[0].force * share, change = wanted - start;
    const double size = length(change);
    return size > far ? start + change * (far / size) : wanted;
  };
  const double had = length(given_[0].force), want = length(wanted);
  double most_share = had > want ? want / had : 1;
  Vec3d given = from(most_share);
  // Where the surface has turned, the last force may pull inwards: then less of it stays.
  if (dot(given, normal) < 0) {
    double share = 0;
    for (int k = 0; k < kHalvings; ++k) {
      const double middle = (share + most_share) / 2;
      (dot(from(middle), normal) < 0 ? most_share : share) = middle;
    }
    given = from(share);
  }
  if (given != wanted) flags |= bit(ServoFault::RateClamped);
  return given;
}

}  // namespace relief
