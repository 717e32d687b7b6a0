// Places of the shell and of the surface, and where samples lie and which way they face.
#pragma once

#include <relief/core/snapshot.h>

#include <array>
#include <cstdint>

namespace relief {

/// A place in the shell: weights of the slab's corners are (1-u-v, u, v); alpha is 0 on the inner triangle, 1 on the
/// outer.
struct SlabCoord {
  SlabId slab = kNoSlab;  ///< which slab, or kNoSlab
  /// place in its triangle, 0 to 1, and along the fibre, 0 inside to 1 outside
  double u = 0, v = 0, alpha = 0;
};

/// A point of the displaced surface.
struct SurfacePoint {
  SlabId slab = kNoSlab;  ///< which slab
  /// place in its triangle, 0 to 1
  double u = 0, v = 0;
  double alpha = 0;  ///< the displacement there
  Vec3d position;    ///< paper, eq. 3: on the fibre at (u, v); on the micro-triangle for closest_point and raycast
  Vec3d normal;      ///< unit, outwards, interpolated from the three nearest samples
};

/// Returns where one stored sample lies in space; bit-identical for all copies of a shared sample.
[[nodiscard]] Vec3d sample_position(const Snapshot& model, SlabId slab, GridPoint at) noexcept;
/// Returns the position a sample of the slab's displacement grid would have with the given alpha.
[[nodiscard]] Vec3d sample_position(const SlabMesh& mesh, SlabId slab, int n, GridPoint at, double alpha) noexcept;
/// Returns the unit normal at a sample: the area-weighted average over the micro-triangles around it in all slabs
/// (paper, Sec. 3.4). Finer slabs count as if they were as coarse as their neighbours. All copies of a sample get the
/// same bits. A constrained sample gets the mean of its ends; inside a hole it is zero.
[[nodiscard]] Vec3d sample_normal(const Snapshot& model, SlabId slab, GridPoint at) noexcept;

namespace detail {
/// The unit normals at the samples of one cell of one snapshot.
struct CellNormals {
  std::uint64_t model = 0;  ///< the snapshot's number
  SlabId slab = kNoSlab;
  std::array<GridPoint, 3> corners;
  std::array<Vec3d, 3> normals;
};

/// Returns the normals at a cell's samples, as sample_normal() (but see shading_normal() for constrained ones): those
/// known where they are of the same snapshot. Then they are the known ones.
[[nodiscard]] const std::array<Vec3d, 3>& corner_normals(const Snapshot& model, SlabId slab,
                                                         const std::array<GridPoint, 3>& cell,
                                                         CellNormals& known) noexcept;

/// Returns the unit normal in a cell, from those at its samples.
[[nodiscard]] inline Vec3d normal_in(const std::array<Vec3d, 3>& normals,
                                     const std::array<double, 3>& weights) noexcept {
  return normalized(normals[0] * weights[0] + normals[1] * weights[1] + normals[2] * weights[2]);
}

/// Returns sample_normal() from the triangles around alone, new samples or not.
[[nodiscard]] Vec3d triangle_normal(const Snapshot& model, SlabId slab, GridPoint at) noexcept;

/// Returns where one stored sample lies, for a slab whose corners are known.
[[nodiscard]] inline Vec3d sample_position(const SlabCorners& corners, int n, GridPoint at, double alpha) noexcept {
  const auto w = weights(n, at);
  return corners.point({double(w[0]) / n, double(w[1]) / n, double(w[2]) / n}, alpha);
}

}  // namespace detail

}  // namespace relief
