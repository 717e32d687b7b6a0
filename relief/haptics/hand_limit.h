// How fast a contact follows the hand.
#pragma once

#include <relief/haptics/touch.h>

#include <algorithm>
#include <cmath>

namespace relief {

/// Limits the hand's step: a contact tests the whole segment of each tick, which costs more the longer it is. The
/// cursor follows the hand by at most kMost of the model's diagonal per tick (3 m/s where that is 0.15 m). No hand is
/// as fast; a reading that leaps is caught up with in a few ticks.
class HandLimit {
 public:
  static constexpr double kMost = 0.02;  ///< of the diagonal, where the hand moves
  static constexpr double kLed = 0.005;  ///< and where a program has put the tool elsewhere: it is led, not hurried

  /// Forgets the hand; the next reading is taken as it is.
  void reset() noexcept { known_ = false; }
  /// Returns the pose to which the tool goes in this tick. `reach`: of the tool from its origin; `diagonal`: of the
  /// model; `led`: it is on its way to where a program has put it.
  [[nodiscard]] ToolPose follow(const ToolPose& hand, double reach, double diagonal, bool led = false) noexcept {
    const Vec3d from = known_ ? at_.origin : hand.origin;
    if (!known_) at_ = hand;
    known_ = true;
    const double cosine = std::min(1.0, std::abs(dot(at_.orientation, hand.orientation)));
    const double turned = reach > 0 ? reach * 2 * std::acos(cosine) : 0;
    const double way = length(hand.origin - at_.origin) + turned, most = (led ? kLed : kMost) * diagonal;
    late_ = way > most;
    at_ = late_ ? between(at_, hand, most / way) : hand;
    move_ = at_.origin - from;
    return at_;
  }
  /// The hand is farther away than where the tool has come to.
  [[nodiscard]] bool late() const noexcept { return late_; }
  /// By how much the tool's origin went in the last tick, model units.
  [[nodiscard]] Vec3d move() const noexcept { return move_; }

 private:
  [[nodiscard]] static ToolPose between(const ToolPose& a, const ToolPose& b, double share) noexcept {
    const double sign = dot(a.orientation, b.orientation) < 0 ? -1 : 1, rest = 1 - share, more = share * sign;
    const Quatd q = {rest * a.orientation.w + more * b.orientation.w, rest * a.orientation.x + more * b.orientation.x,
                     rest * a.orientation.y + more * b.orientation.y, rest * a.orientation.z + more * b.orientation.z};
    return {a.origin + (b.origin - a.origin) * share, unit(q).value_or(b.orientation)};
  }

  bool known_ = false, late_ = false;
  ToolPose at_;
  Vec3d move_;
};

}  // namespace relief
