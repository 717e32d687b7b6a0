#include <relief/haptics/friction.h>

#include <algorithm>
#include <utility>

namespace relief {

Friction::Given Friction::step(const Setting& now, Vec3d hand, Vec3d normal, Vec3d arm, double spread,
                               Vec3d turn) noexcept {
  if (!std::exchange(holds_, true)) {
    anchor_ = hand;
    spin_ = 0;
    sliding_ = false;
  } else {
    // It is where the tool touches that moves over the surface.
    anchor_ -= cross(turn, arm);
    spin_ += dot(turn, normal);
  }
  Given given;
  const double kinetic = now.kinetic * now.normal_force, still = now.still * now.normal_force;
  if (spread > 0) {
    const double most = kinetic / (now.stiffness * spread);  // rad
    spin_ = std::clamp(spin_, -most, most);
    given.torque = normal * (-now.stiffness * spread * spread * spin_);
    given.stored = 0.5 * now.stiffness * spread * spread * spin_ * spin_;
  }
  const Vec3d gap = hand - anchor_;
  Vec3d stretch = gap - normal * dot(gap, normal);
  const double pull = now.stiffness * length(stretch);
  sliding_ = pull > (sliding_ ? kinetic : still);
  if (sliding_) {
    stretch *= kinetic / pull;
    anchor_ = hand - stretch;
  }
  given.force = stretch * -now.stiffness;
  given.stored += 0.5 * now.stiffness * dot(stretch, stretch);
  return given;
}

}  // namespace relief
