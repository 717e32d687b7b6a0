#include <relief/mesh/triangle_mesh.h>

namespace relief {

Box3d bounds(const TriangleMesh& mesh) noexcept {
  Box3d box;
  for (const Vec3d& p : mesh.positions) box.add(p);
  return box;
}

double signed_volume(const TriangleMesh& mesh) noexcept {
  const Box3d box = bounds(mesh);
  if (box.empty()) return 0.0;
  const Vec3d centre = box.centre();
  double six = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    six += dot(mesh.positions[a] - centre, cross(mesh.positions[b] - centre, mesh.positions[c] - centre));
  }
  return six / 6.0;
}

}  // namespace relief
