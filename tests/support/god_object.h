// The oracle of contact for a point: a plain god-object (Zilles and Salisbury 1995) on bare triangles, which knows none
// of the product's rules.
#pragma once

#include "support/bare_triangles.h"

#include <optional>

namespace relief::testing {

/// What an oracle says of one tick.
struct OracleTick {
  bool held = false;
  Vec3d point;       ///< the contact point, or the centre of a ball; the cursor where nothing is held
  double depth = 0;  ///< from there to the cursor
  /// It landed, let go, or went farther than ten times the cursor's way and 2 % of the depth: a step that the hand did
  /// not make.
  bool jumped = false;
};

/// Whether a contact point that was held at `from` has jumped, and went farther than the hand can follow.
[[nodiscard]] inline bool is_jump(Vec3d from, Vec3d to, Vec3d last_cursor, Vec3d cursor) {
  return length(to - from) > 10 * length(cursor - last_cursor) + 0.02 * length(cursor - from);
}

/// The contact point of a cursor. A free one follows the cursor and is held where that first goes in through the
/// surface. A held one goes downhill on its distance to the cursor, over shared edges, until no triangle that it
/// touches leads nearer; then straight to the cursor where that way leads into the air, and lands where it goes in
/// again. There is no limit on its way and no memory of a side.
class GodObject {
 public:
  /// `parts`: of the cursor's straight way in a tick, each of which is a step of its own.
  explicit GodObject(const BareTriangles& surface, int parts = 20) : surface_(surface), parts_(parts) {}

  /// It is held at a place of the surface, under a cursor.
  void hold(const BareTriangles::Place& place, Vec3d cursor) {
    held_ = place;
    cursor_ = cursor;
  }
  /// The cursor has moved straight to `cursor`; it begins in the air, or where it is held.
  [[nodiscard]] OracleTick move(Vec3d cursor) {
    const bool begins = !cursor_;
    const Vec3d start = cursor_.value_or(cursor), from = held_ ? held_->position : start;
    bool changed = false;
    for (int k = 1; k <= parts_; ++k) changed = step(start + (cursor - start) * (double(k) / parts_)) || changed;
    OracleTick tick{held_.has_value(), held_ ? held_->position : cursor, 0, false};
    tick.depth = length(tick.point - cursor);
    tick.jumped = !begins && (changed || (held_ && is_jump(from, tick.point, start, cursor)));
    return tick;
  }

 private:
  using Place = BareTriangles::Place;

  /// Says whether it has landed or let go.
  bool step(Vec3d cursor) {
    const Vec3d last = cursor_.value_or(cursor);
    cursor_ = cursor;
    bool changed = false;
    if (!held_) {
      // The cursor may have come to rest on the surface, to within rounding, and be past it for this segment.
      const Vec3d from = last - normalized(cursor - last) * (1e-10 * surface_.diagonal());
      const auto in = surface_.entry(from, cursor);
      if (!in) return false;
      land(*in, from, cursor);
      changed = true;
    }
    for (int leg = 0; leg < kMostLegs && held_; ++leg) {
      go_downhill(cursor);
      if (!leads_into_air(cursor)) break;
      const Vec3d from = held_->position;
      const auto in = surface_.entry(from, cursor, [&](std::uint32_t t) { return touches(t); });
      if (!in)
        held_.reset();
      else
        land(*in, from, cursor);
      changed = true;
    }
    return changed;
  }

  void land(const BareTriangles::Entry& in, Vec3d from, Vec3d to) {
    held_ = surface_.nearest(in.triangle, from + (to - from) * in.share);
  }
  void go_downhill(Vec3d cursor) {
    for (;;) {
      Place best = *held_;
      double least = squared(best.position - cursor) * (1 - 1e-12);  // rounding must not make it go in circles
      surface_.each_touching(*held_, [&](std::uint32_t t) {
        const Place place = surface_.nearest(t, cursor);
        if (squared(place.position - cursor) >= least) return;
        least = squared(place.position - cursor);
        best = place;
      });
      if (best.position == held_->position) return;
      held_ = best;
    }
  }
  /// At a place from which nothing leads nearer.
  [[nodiscard]] bool leads_into_air(Vec3d cursor) const {
    const Vec3d d = cursor - held_->position;
    return dot(surface_.pseudo_normal(*held_), d) > 0 || surface_.over_open_edge(*held_, d);
  }
  [[nodiscard]] bool touches(std::uint32_t triangle) const {
    bool touching = false;
    surface_.each_touching(*held_, [&](std::uint32_t t) { touching = touching || t == triangle; });
    return touching;
  }
  static double squared(Vec3d v) { return dot(v, v); }

  static constexpr int kMostLegs = 1000;

  const BareTriangles& surface_;
  int parts_;
  std::optional<Vec3d> cursor_;
  std::optional<Place> held_;
};

}  // namespace relief::testing
