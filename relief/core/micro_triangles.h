// Slabs and micro-triangles as the sources of core see them.
#pragma once

#include <relief/core/snapshot.h>

#include <algorithm>
#include <array>

namespace relief::detail {

/// Weights of the point of triangle abc nearest to p (Ericson, Real-Time Collision Detection, 5.1.5: the seven
/// regions). A weight is exactly zero where the point lies on the edge opposite its corner.
[[nodiscard]] std::array<double, 3> nearest_in_triangle(Vec3d p, Vec3d a, Vec3d b, Vec3d c) noexcept;

/// Unit normal in a cell, interpolated from its three samples.
[[nodiscard]] Vec3d cell_normal(const Snapshot& model, SlabId slab, const GridCell& cell) noexcept;

/// Where one stored sample lies, for a slab whose corners are known.
[[nodiscard]] Vec3d sample_position(const SlabCorners& corners, int n, GridPoint at, double alpha) noexcept;

/// The slab as p = A + B u + C v + (D + E u + F v) alpha, relative to the point that is asked for, so that nothing is
/// lost far from the origin.
struct LinearForm {
  Vec3d a, b, c, d, e, f;
  double size2;  ///< squared length scale of the slab

  LinearForm(const SlabCorners& k, Vec3d point) noexcept
      : a(k.inner[0] - point),
        b(k.inner[1] - k.inner[0]),
        c(k.inner[2] - k.inner[0]),
        d(k.outer[0] - k.inner[0]),
        e((k.outer[1] - k.inner[1]) - d),
        f((k.outer[2] - k.inner[2]) - d),
        size2(std::max({dot(b, b), dot(c, c), dot(d, d)})) {}
};

}  // namespace relief::detail
