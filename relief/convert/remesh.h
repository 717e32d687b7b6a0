// A solid made anew from a source of any kind: one voxel size, closed, no two sheets in one place.
#pragma once

#include <relief/base/error.h>
#include <relief/base/progress.h>
#include <relief/mesh/triangle_mesh.h>

#include <cstddef>

namespace relief::detail {

struct Remeshed {
  TriangleMesh mesh;       ///< closed, repaired, without colours
  double voxel = 0;        ///< its edge, model units
  std::size_t parts = 0;   ///< of the mesh
  std::size_t rims = 0;    ///< of the mesh: none, unless something is wrong
  std::size_t sheets = 0;  ///< parts of the source that close nothing off, made two voxels thick
  std::size_t crumbs = 0;  ///< parts of a few voxels, left out
};

/// The surface around what the source winds around more than half (generalised winding number), so that sheets which
/// meet, double and cross count as one solid and holes are closed by a membrane. Parts that no such solid lies behind
/// become sheets two voxels thick. `voxel` is the edge of a voxel in model units; 0 chooses about the median edge, not
/// finer than 150,000 voxels on the surface and not coarser than 1/150 of the diagonal. What is thinner than a
/// voxel is lost. `source` must be repaired. Deterministic. Errors: InvalidArgument (a voxel so small that the surface
/// has more than two million), Corrupt (nothing of it is as large as a voxel), Cancelled.
[[nodiscard]] Result<Remeshed> remesh(const TriangleMesh& source, double voxel, const Progress& progress);

}  // namespace relief::detail
