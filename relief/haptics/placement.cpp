#include <relief/haptics/placement.h>

#include <algorithm>
#include <utility>

namespace relief {
namespace {

// s, in which the clutch takes hold of the damping, or lets it go: five ticks are no step, and nobody waits for them
// (TakesHoldOfTheDampingInFiveMilliseconds).
constexpr double kLoosen = 5e-3;

}  // namespace

Placement::Placement(const Workspace& workspace, const Clutch& clutch) noexcept
    : set_(workspace.with_unit_rotation()), applied_(set_), space_(set_), clutch_(clutch) {}

void Placement::set(const Workspace& workspace, const Clutch& clutch) noexcept {
  set_ = workspace.with_unit_rotation();
  recentre_due_ = recentre_due_ || clutch_.recentre != clutch.recentre;
  clutch_ = clutch;
  due_ = true;
}

Workspace Placement::wanted() const noexcept {
  Workspace space = set_;
  space.device_origin += drift_;
  return space;
}

void Placement::stay(const Readings::Judged& now, Vec3d device) noexcept {
  space_ = space_.through(device, cursor_);
  drift_ = space_.device_origin - applied_.device_origin;
  grip_ = now.orientation.conjugate() * space_.rotation.conjugate() * orientation_;
  device_ = device;
}

Placement::Place Placement::place(const Readings::Judged& now, Vec3d device) noexcept {
  Place place;
  if (now.has_position) {
    place.clutched = known_ && (clutch_.held || (now.buttons & clutch_.buttons) != 0);
    loose_ = std::clamp(loose_ + (place.clutched ? now.dt : -now.dt) / kLoosen, 0.0, 1.0);
    if (!std::exchange(known_, true)) device_ = device;
    if (place.clutched) stay(now, device);
    if (std::exchange(due_, false)) {
      const bool recentred = std::exchange(recentre_due_, false);
      Workspace next = wanted();
      if (recentred || place.clutched) {
        next = next.through(device_, recentred ? clutch_.centre : cursor_);
        drift_ = next.device_origin - set_.device_origin;
      }
      if (next != space_) place.change = Change{space_, device_};
      space_ = next;
      applied_ = set_;
    }
    // Held to the last bit, except for what was requested.
    if (!place.clutched || place.change) cursor_ = space_.to_model(device);
    device_ = device;
  }
  place.cursor = cursor_;
  if (!place.clutched) {
    const Quatd held = space_.orientation_to_model(now.orientation);
    orientation_ = grip_ == Quatd{} ? held : held * grip_;
  }
  place.orientation = orientation_;
  place.loose = loose_;
  place.hand = space_.turned_to_model(device);
  place.step = space_.turned_to_model(now.step);
  place.turn = space_.turned_to_model(now.turn);
  place.velocity = space_.turned_to_model(now.velocity);
  return place;
}

}  // namespace relief
