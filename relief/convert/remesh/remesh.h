// A solid made again from a source of any kind: closed, its sharp edges kept, on the source's own skin.
#pragma once

#include <relief/base/error.h>
#include <relief/base/progress.h>
#include <relief/convert/remesh/contour_fit.h>
#include <relief/mesh/triangle_mesh.h>

#include <cstddef>

namespace relief::detail {

struct Remeshed {
  TriangleMesh mesh;       ///< closed, oriented, two triangles at each edge, without colours
  double voxel = 0;        ///< its edge, model units
  std::size_t parts = 0;   ///< of the mesh
  std::size_t rims = 0;    ///< of the mesh: none, unless something is wrong
  std::size_t sheets = 0;  ///< parts of the source that close nothing off, made two voxels thick
  std::size_t crumbs = 0;  ///< parts of a few voxels, left out
  double lost = 0;         ///< share of the area of the solid's skin from which the mesh is a voxel away or more: what
                           ///< is thinner than a voxel
  Vec3d lost_at;           ///< the place of the skin farthest from the mesh, model units
  double on_skin = 0;      ///< share of the vertices that lie on the skin; others close holes or keep folds out
  double to_skin = 0;      ///< greatest distance from a vertex that closes no hole to the skin, model units
  double from_skin = 0;    ///< greatest distance from 20,000 places spread over what of the skin parts inside from
                           ///< outside to the mesh, model units
  double undecided = 0;  ///< area, square model units, of the skin beside which winding is too near one half to decide
  Vec3d undecided_at;    ///< a place of it, model units, where there is some
};

/// Returns the surface around what the source winds around more than half (generalised winding number), by dual
/// contouring. docs/explanation/conversion.md says what is lost. `voxel`: model units; 0 chooses, fine enough for thin
/// parts where these take no more than 300,000 voxels. Deterministic.
/// Memory: about 500 bytes per voxel on the surface; may throw std::bad_alloc. Errors: InvalidArgument (over two
/// million voxels), Corrupt (nothing as large as a voxel), Cancelled.
[[nodiscard]] Result<Remeshed> remesh(const TriangleMesh& source, double voxel, Follow follow,
                                      const Progress& progress);

}  // namespace relief::detail
