#include <relief/session/hand_control.h>

#include <algorithm>
#include <cmath>

namespace relief {

HandControl::HandControl(Session& session, const DeviceInfo& device, const ServoSettings& settings)
    : session_(session),
      device_force_(device.max_force),
      fitted_(settings.workspace.metres_per_unit),
      settings_(settings) {
  settings_.force.max_force = std::min(settings_.force.max_force, device_force_);
}

bool HandControl::flush() {
  if (due_) due_ = !session_.set_servo(settings_);
  return !due_;
}

void HandControl::limit_force(double most) {
  settings_.force.max_force = most > 0 ? std::min(most, device_force_) : 0.0;
  due_ = true;
  flush();
}

void HandControl::clutch(bool held) {
  settings_.clutch.held = held;
  due_ = true;
  flush();
}

void HandControl::recentre(Vec3d place) {
  if (!is_finite(place)) return;
  settings_.clutch.centre = place;
  ++settings_.clutch.recentre;
  due_ = true;
  flush();
}

void HandControl::scale(double factor, Vec3d tool) {
  if (!std::isfinite(factor)) return;
  scale_ = std::clamp(factor, kLeastScale, kMostScale);
  settings_.workspace.metres_per_unit = fitted_ * scale_;
  recentre(tool);
}

void HandControl::touch_with(const ForceSettings& force) {
  const double limit = settings_.force.max_force;
  settings_.force = force;
  settings_.force.max_force = limit;
  due_ = true;
  flush();
}

void HandControl::forces(bool on) noexcept {
  forces_.store(on, std::memory_order_relaxed);
  session_.set_forces(on);
}

}  // namespace relief
