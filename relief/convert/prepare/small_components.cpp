#include <relief/convert/prepare/small_components.h>

#include <algorithm>
#include <numeric>

namespace relief::detail {

std::size_t drop_small_components(const std::vector<Vec3d>& points, std::vector<Face>& faces, std::size_t most) {
  const Components components = find_components(points.size(), faces);
  if (kLeastSlabs * components.count <= most) return 0;
  std::vector<double> areas(components.count, 0);  // twice
  std::vector<std::size_t> sizes(components.count, 0);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const Vec3d a = points[faces[f][0]];
    areas[components.of_face[f]] += length(cross(points[faces[f][1]] - a, points[faces[f][2]] - a));
    ++sizes[components.of_face[f]];
  }
  std::vector<std::uint32_t> order(components.count);
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return areas[a] > areas[b]; });
  std::vector<std::uint8_t> stays(components.count, 0);
  std::size_t used = 0, dropped = 0;
  for (const std::uint32_t c : order) {
    used += std::min(kLeastSlabs, sizes[c]);
    stays[c] = used <= most || c == order.front();
    dropped += stays[c] == 0;
  }
  std::size_t kept = 0;
  for (std::size_t f = 0; f < faces.size(); ++f)
    if (stays[components.of_face[f]] != 0) faces[kept++] = faces[f];
  faces.resize(kept);
  return dropped;
}

TriangleMesh without_components(const TriangleMesh& mesh, const Components& components,
                                std::span<const std::uint32_t> gone) {
  TriangleMesh rest;
  rest.positions = mesh.positions;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f)
    if (!std::ranges::binary_search(gone, components.of_face[f])) rest.triangles.push_back(mesh.triangles[f]);
  return rest;
}

}  // namespace relief::detail
