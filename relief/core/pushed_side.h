// The side of a part to which a held tool is pushed out.
#pragma once

#include <relief/base/vec.h>

#include <algorithm>
#include <cmath>

namespace relief::detail {

constexpr double kFollow = 10;       // lengths of the cursor's way that a held point may go in a tick
constexpr double kRelax = 0.02;      // and this share of the depth, so that it settles under a resting cursor
constexpr double kSameSide = 0.707;  // cosine between two ways out of the same side of a part
constexpr double kRound = 0.5;       // of the cursor's way along the side over the depth, by which the side turns, rad
constexpr double kSettle = 1e-3;     // rad per tick that it may turn besides while the surface changes

/// Whether two ways have an angle of at most 45 degrees between them.
[[nodiscard]] inline bool same_side(Vec3d a, Vec3d b) noexcept {
  return dot(a, b) >= kSameSide * std::sqrt(dot(a, a) * dot(b, b));
}

/// The part of a move of the cursor square to the way out.
[[nodiscard]] inline Vec3d square_to(Vec3d out, Vec3d cursor_move) noexcept {
  return cursor_move - out * (dot(cursor_move, out) / dot(out, out));
}

/// By how much a move of the cursor led more past the held point, square to the way out, than towards it or away from
/// it: 0 where the tool is pressed straight on, comes back straight or rests.
[[nodiscard]] inline double way_past(Vec3d cursor_move, Vec3d out) noexcept {
  if (!(dot(out, out) > 0)) return 0;
  return std::max(0.0, length(square_to(out, cursor_move)) - std::abs(dot(cursor_move, out)) / length(out));
}

/// How a move of the cursor looks from the held point: the part of it square to the way out, and by how much it lets
/// the side turn, rad: only as far as it goes along the part's side. Pressed straight on or pulled straight back, or at
/// rest, a tool stays on its side for as long as it likes, where the surface does not change.
struct Aside {
  Vec3d move;
  double turn = 0;

  Aside(Vec3d cursor_move, Vec3d out, Vec3d side, bool surface_changes) noexcept
      : move(square_to(out, cursor_move)),
        turn(kRound * length(square_to(side, cursor_move)) / length(out) + (surface_changes ? kSettle : 0)) {}
};

}  // namespace relief::detail
