// The direction in which a vertex sees all the faces around it.
#pragma once

#include <relief/base/vec.h>

#include <span>

namespace relief::detail {

/// A unit direction and its visibility: the least n.d over the given unit normals, as large as possible. Where it is
/// not positive, no smooth field of fibres runs through the vertex (docs/explanation/conversion.md).
struct Direction {
  Vec3d d;
  double visibility = -1;
};

/// Returns the centre of the smallest cap that holds all normals, exact up to rounding; where they fit in no open half
/// space, the normalised mean. The order of the normals decides only between equals. Expected O(normals).
[[nodiscard]] Direction best_direction(std::span<const Vec3d> normals) noexcept;

}  // namespace relief::detail
