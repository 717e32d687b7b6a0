#include <relief/core/micro_triangles.h>

namespace relief {

SurfacePoint point_of(MicroTriangles& surface, const SurfacePlace& place, detail::CellNormals& known) noexcept {
  const SlabCoord at = surface.coordinates(place);
  const auto& normals = detail::corner_normals(surface.model(), at.slab, place.triangle.corners, known);
  return {at.slab, at.u, at.v, at.alpha, place.position, detail::normal_in(normals, place.weights)};
}

}  // namespace relief
