// What a point and a ball have in common: how far they may go in a tick, and by what they are held past the middle of a
// part. docs/decisions/0009-contact.md has the principle.
#pragma once

#include <relief/base/vec.h>

#include <algorithm>
#include <cmath>

namespace relief::detail {

// What is held may go so many lengths of the cursor's way in a tick. So it catches up round edges, and the force
// changes by 0.06 N per tick at most at 0.1 diagonals/s (0.15 m, 400 N/m).
constexpr double kFollow = 10;
constexpr double kRelax = 0.02;  // or this share of the depth: under a cursor at rest it settles within 50 ticks
// Depths from it within which the line through the cursor comes out of the body: the ball of that radius around the
// cursor lies in the body where what is held is the nearest place. With less, round parts roll over; with 3, a tool
// that circles in a rod sticks.
constexpr double kMiddle = 2;
// Past the middle it goes so many lengths of the hand's own way in a tick to a minimum. That of a ball of radius R goes
// R / (R - depth) times as far as the hand, so it follows down to two thirds of R
// (PastTheMiddleThePointGoesNoFartherThanThreeTimesTheHandsSidewaysWay).
constexpr double kToMinimum = 3;
// And so many along with the hand: once, and once more to make up for what is owed. With 1, presses through a scan slip
// (HoldOnScans); with 3 it goes farther than to a minimum.
constexpr double kAlong = 2;

[[nodiscard]] inline double distance2(Vec3d a, Vec3d b) noexcept { return dot(a - b, a - b); }

/// Returns how far what is held may go in a tick.
[[nodiscard]] inline double budget(double travel, double depth) noexcept {
  return std::max(kFollow * travel, kRelax * depth);
}
/// Returns whether a minimum is near by, after such a way along the surface: as on a dome or in a bowl that is thinner
/// than the tool is deep. One that is twice as far off lies on the other side of a finger (Finger in middle_test).
[[nodiscard]] inline bool is_near_by(double way, double depth) noexcept { return way <= depth; }
/// Returns the part of a move that is perpendicular to a way.
[[nodiscard]] inline Vec3d square_to(Vec3d way, Vec3d move) noexcept {
  const double way2 = dot(way, way);
  return way2 > 0 ? move - way * (dot(move, way) / way2) : move;
}

/// Returns the hand's way past a surface with the normal `up`: the part of its move that is perpendicular to that, as
/// far as it is longer than the move into the surface. Pressed on, also aslant, or at rest, it is none.
[[nodiscard]] inline Vec3d past(Vec3d up, Vec3d move) noexcept {
  const Vec3d sideways = square_to(up, move);
  const double aside = length(sideways), in = std::max(0.0, -dot(move, up));
  return aside > in ? sideways * (1 - in / aside) : Vec3d{};
}

/// Keeps what is held past the middle from generating energy. Its own moves take it no farther from the cursor than
/// they brought it nearer before, seen from the middle of the cursor's way in the tick. All of them together only take
/// from the spring.
class Ledger {
 public:
  void clear() noexcept { *this = {}; }
  /// Returns whether it may go from one place to another.
  [[nodiscard]] bool allows(Vec3d from, Vec3d to, Vec3d middle) const noexcept {
    return distance2(to, middle) <= distance2(from, middle) + nearer2_;
  }
  /// It went.
  void book(Vec3d from, Vec3d to, Vec3d middle) noexcept {
    const double before2 = distance2(from, middle);
    nearer2_ = std::clamp(nearer2_ + before2 - distance2(to, middle), 0.0, before2);
  }
  /// Returns what of the hand's own way could not be followed, and is made up for when the hand comes back.
  [[nodiscard]] Vec3d owed() const noexcept { return owed_; }
  void settle() noexcept { owed_ = {}; }
  /// `missing`: from where it is to where the hand has gone; `out`: unit.
  void owe(Vec3d missing, Vec3d out, double depth) noexcept {
    owed_ = missing - out * dot(missing, out);
    if (const double far = length(owed_); far > depth) owed_ *= depth / far;
  }

 private:
  double nearer2_ = 0;
  Vec3d owed_;
};

}  // namespace relief::detail
