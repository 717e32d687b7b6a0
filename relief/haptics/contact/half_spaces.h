// The point of an intersection of half-spaces that is nearest to a goal.
#pragma once

#include <relief/base/vec.h>

#include <optional>
#include <span>

namespace relief::detail {

/// The points x with dot(normal, x) >= offset; the normal has unit length.
struct HalfSpace {
  Vec3d normal;
  double offset = 0;

  [[nodiscard]] double room(Vec3d x) const noexcept { return dot(normal, x) - offset; }
};

/// Returns the point of the intersection nearest to the goal, at most `slack` beyond any half-space. Empty where there
/// is none, or where doubles cannot tell. Those that bar the goal most come to the front. Incremental over planes,
/// lines and points (after Seidel 1991). The cost grows with the half-spaces times the few that bar the goal most.
[[nodiscard]] std::optional<Vec3d> nearest_in(std::span<HalfSpace> spaces, Vec3d goal, double slack) noexcept;

}  // namespace relief::detail
