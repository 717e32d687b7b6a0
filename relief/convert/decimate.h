// From the source to the coarse base triangles that the slabs stand on.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/lattice.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

using Face = std::array<std::uint32_t, 3>;

/// An oriented manifold triangle mesh on the lattice, open or closed, in one or more parts.
struct BaseMesh {
  std::vector<LatticePoint> points;
  std::vector<Face> faces;
};

/// Quadric edge collapse [Garland and Heckbert 1997] down to `target` faces, in two stages. Far above the target only
/// link condition, flipped normals and shape are guarded. Near it each collapse must also leave every vertex a
/// direction that sees its faces, wind once around it, and bring no two faces to meet (exact). The topology never
/// changes: closed parts stay closed, no part vanishes; where the guards leave no way down, more faces than the target
/// remain. Points are in lattice coordinates. Deterministic; O(n log n). Empty when cancelled.
[[nodiscard]] BaseMesh decimate(std::span<const Vec3d> points, std::span<const Face> faces, std::size_t target,
                                const Progress& progress);

}  // namespace relief::detail
