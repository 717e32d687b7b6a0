#include <relief/haptics/force_blend.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relief {
namespace {

// The first and last: ComesToTheLawWithFifteenMilliseconds.
constexpr double kTime = 15e-3;   // s: over within 50 ms; a change of 0.5 N begins with 0.03 N per tick
constexpr double kMost = 0.045;   // N per tick: below what is noticed, 0.05 (ChangesByLessThanAFingerNotices)
constexpr double kUnfelt = 1e-3;  // N: a fiftieth of what a finger notices; then it is over

}  // namespace

void ForceBlend::moved(const Wrench& last) noexcept {
  pending_ = true;
  last_ = last;
}

Wrench ForceBlend::step(const Wrench& law, Vec3d by_hand, double dt) noexcept {
  from_ = last_.force + by_hand;
  if (std::exchange(pending_, false)) lacking_ = from_ - law.force;
  const double size = length(lacking_), left = size * std::exp(-dt / kTime);
  const double share = left > kUnfelt ? left / size : 0;
  lacking_ *= share;
  const Vec3d change = law.force + lacking_ - from_;
  if (const double most = length(change); most > kMost) lacking_ -= change * (1 - kMost / most);
  // A hand that goes out is not pulled in by what is not yet taken over: against the law goes no more than before.
  const double against = -dot(law.force + lacking_, law.force), before = std::max(0.0, -dot(last_.force, law.force));
  if (against > before) lacking_ += law.force * ((against - before) / dot(law.force, law.force));
  last_ = {law.force + lacking_, law.torque + (last_.torque - law.torque) * share};
  return last_;
}

}  // namespace relief
