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

/// The point of the intersection nearest to the goal, on no half-space's wrong side by more than `slack`; empty where
/// there is none, or it cannot be told in doubles. By increments over planes, lines and points (after Seidel 1991),
/// among those half-spaces that were the most in the way of what was nearest among the others before; the cost grows
/// with the number of all times those.
[[nodiscard]] std::optional<Vec3d> nearest_in(std::span<const HalfSpace> spaces, Vec3d goal, double slack) noexcept;

}  // namespace relief::detail
