#include <relief/base/compact.h>
#include <relief/convert/geometry/components.h>
#include <relief/convert/prepare/small_components.h>
#include <relief/convert/prepare/strays.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

namespace relief::detail {
namespace {

constexpr double kHolds = 0.999;  // share of the area that sets the scale
constexpr double kFar = 10;       // diagonals of what holds it: the lattice still has 20,000 steps across the rest

}  // namespace

ConvertReport::Strays leave_out_strays(TriangleMesh& mesh) {
  const Components components = find_components(mesh.positions.size(), mesh.triangles);
  if (components.count < 2) return {};
  std::vector<Box3d> boxes(components.count);
  std::vector<double> areas(components.count, 0);
  std::vector<std::size_t> sizes(components.count, 0);
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const std::uint32_t c = components.of_face[f];
    const Triangle& t = mesh.triangles[f];
    for (const std::uint32_t v : t) boxes[c].add(mesh.positions[v]);
    areas[c] += length(cross(mesh.positions[t[1]] - mesh.positions[t[0]], mesh.positions[t[2]] - mesh.positions[t[0]]));
    ++sizes[c];
  }
  std::vector<std::uint32_t> order(components.count);
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, std::ranges::greater(), [&](std::uint32_t c) { return areas[c]; });
  const double all = std::accumulate(areas.begin(), areas.end(), 0.0);
  Box3d core;
  double held = 0;
  for (const std::uint32_t c : order) {
    if (held >= kHolds * all) break;
    core.add(boxes[c]);
    held += areas[c];
  }
  ConvertReport::Strays strays;
  std::vector<std::uint32_t> gone;
  for (std::uint32_t c = 0; c < components.count; ++c) {
    const Vec3d middle = boxes[c].centre();
    const double away = std::sqrt(core.distance2(middle)) / diagonal(core);
    if (!(away > kFar)) continue;
    gone.push_back(c);
    strays.triangles += sizes[c];
    if (away > strays.away) strays.away = away, strays.near = middle;
  }
  strays.components = gone.size();
  if (gone.empty()) return strays;
  mesh = without_components(mesh, components, gone);
  drop_unused_points(mesh.triangles, mesh.positions);  // they would still count for the box
  return strays;
}

}  // namespace relief::detail
