// What a point and a ball have in common: how far they may go in a tick, and by what they are held past the middle of a
// part. docs/haptics.md has the principle.
#pragma once

#include <relief/haptics/contact/blend.h>

#include <algorithm>
#include <cmath>

namespace relief::detail {

constexpr double kFollow = 10;   // lengths of the cursor's way that what is held may go in a tick,
constexpr double kRelax = 0.02;  // or this share of the depth, so that it settles under a resting cursor
constexpr double kMiddle = 2;    // depths from it within which the line through the cursor comes out of the body
// Past the middle, in lengths of the hand's own way: that it goes to a minimum near by, that such a one may be off
// where the hand has gone, and that it goes with the hand.
constexpr double kToMinimum = 3, kOffMinimum = 2, kAlong = 2;
constexpr double kNear = 0.5;  // depths of way within which a minimum is near by

/// How far what is held may go in a tick.
[[nodiscard]] inline double budget(double travel, double depth) noexcept {
  return std::max(kFollow * travel, kRelax * depth);
}
/// The part of a move that is square to a way.
[[nodiscard]] inline Vec3d square_to(Vec3d way, Vec3d move) noexcept {
  const double way2 = dot(way, way);
  return way2 > 0 ? move - way * (dot(move, way) / way2) : move;
}

/// The hand's way past a surface with the normal `up`: the part of its move that is square to that, as far as it is
/// longer than the move into the surface. Pressed on, also aslant, or at rest, it is none.
[[nodiscard]] inline Vec3d past(Vec3d up, Vec3d move) noexcept {
  const Vec3d sideways = square_to(up, move);
  const double aside = length(sideways), in = std::max(0.0, -dot(move, up));
  return aside > in ? sideways * (1 - in / aside) : Vec3d{};
}

/// Keeps what is held past the middle from making energy, and over the hand. Its own moves may take it no farther from
/// the cursor than they have brought it nearer before: at a cursor at rest, all of them together only take from the
/// spring.
class Ledger {
 public:
  void clear() noexcept { *this = {}; }
  /// Whether it may go, the squared distances from the cursor before and after being these.
  [[nodiscard]] bool allows(double before2, double after2) const noexcept { return after2 <= before2 + nearer2_; }
  /// It went.
  void book(double before2, double after2) noexcept {
    nearer2_ = std::clamp(nearer2_ + before2 - after2, 0.0, before2);
  }
  /// What of the hand's own way could not be followed, and is made up for when the hand comes back.
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

/// What a contact gives to feel: its own vector, from the cursor to what is held, and the blend.
class Feeling {
 public:
  void reset() noexcept { *this = {}; }
  [[nodiscard]] Blend& blend() noexcept { return blend_; }
  [[nodiscard]] const Blend& blend() const noexcept { return blend_; }
  /// It was not the hand that has changed the contact's own vector by so much, in a tick that began with `offset`.
  void absorb(Vec3d change, Vec3d& offset) noexcept {
    blend_.absorb(change);
    offset -= change;
  }
  /// The end of a tick that began with `offset`. `own`: of what is held, zero where nothing is.
  void tell(bool held, Vec3d own, Vec3d offset) noexcept {
    // What is not yet taken over never turns the force round: a hand that goes out is not pulled in.
    if (const Vec3d all = own + blend_.offset(); blend_.fading() && dot(all, way_out_) < 0) {
      if (held)
        blend_.absorb(all);
      else
        blend_.reset();
    }
    const Vec3d felt = own + blend_.offset();
    depth_ = length(felt);
    if (depth_ > 0) way_out_ = felt / depth_;
    grown_ = blend_.offset() == offset ? 0 : depth_ - length(own + offset);
  }
  [[nodiscard]] double depth() const noexcept { return depth_; }
  [[nodiscard]] Vec3d way_out() const noexcept { return way_out_; }
  [[nodiscard]] double grown() const noexcept { return grown_; }

 private:
  Blend blend_;
  Vec3d way_out_;
  double depth_ = 0, grown_ = 0;
};

}  // namespace relief::detail
