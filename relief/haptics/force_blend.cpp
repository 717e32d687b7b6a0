#include <relief/haptics/force_blend.h>

#include <algorithm>
#include <cmath>

namespace relief {
namespace {

constexpr double kTime = 15e-3;   // s, as for a surface that is edited under the tool
constexpr double kMost = 0.045;   // N per tick: below what a finger notices, 0.05
constexpr double kUnfelt = 1e-3;  // N

}  // namespace

void ForceBlend::moved(Quatd turned) noexcept {
  pending_ = true;
  last_.force = turned.turn(last_.force);
  last_.torque = turned.turn(last_.torque);
}

Wrench ForceBlend::step(const Wrench& law, Vec3d by_hand, double dt) noexcept {
  if (!blending()) return last_ = law;
  pending_ = false;
  // From what was given, and felt of the hand since, towards what the law asks for.
  const Vec3d from = last_.force + by_hand, to = law.force - from;
  const double size = length(to);
  const double way = std::min(size * -std::expm1(-dt / kTime), kMost);
  const double left = size - way > kUnfelt ? (size - way) / size : 0;
  lacking_ = to * -left;
  last_ = {law.force + lacking_, law.torque + (last_.torque - law.torque) * left};
  return last_;
}

}  // namespace relief
