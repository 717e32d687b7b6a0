#include <relief/base/triangle.h>
#include <relief/convert/measure.h>
#include <relief/convert/parallel.h>
#include <relief/core/query.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace relief::detail {
namespace {

constexpr std::size_t kPoints = 12000;

template <typename DistanceOf>
Distance over(const std::vector<Vec3d>& points, DistanceOf&& distance_of) {
  std::vector<double> distances(points.size());
  for_all(points.size(), 64, {}, [&](std::size_t k) { distances[k] = distance_of(points[k]); });
  Distance result;
  for (const double d : distances) {
    result.rms += d * d;
    result.max = std::max(result.max, d);
  }
  if (!distances.empty()) result.rms = std::sqrt(result.rms / double(distances.size()));
  return result;
}

}  // namespace

Distance MeasuredSurface::to(const SourceSurface& other) const {
  const SlabMesh& mesh = model_.slab_mesh();
  std::size_t total = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    total += static_cast<std::size_t>(mesh.intervals(s)) * static_cast<std::size_t>(mesh.intervals(s));
  const std::size_t stride = std::max<std::size_t>(1, total / kPoints);
  std::vector<Vec3d> points;
  std::size_t counter = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    for_each_cell(mesh.intervals(s), mesh.edge_intervals(s), [&](const std::array<GridPoint, 3>& cell) {
      if (counter++ % stride != 0 || model_.is_hole(s, cell)) return;
      const std::array<Vec3d, 3> p = {sample_position(model_, s, cell[0]), sample_position(model_, s, cell[1]),
                                      sample_position(model_, s, cell[2])};
      points.push_back(points.size() % 2 == 0 ? p[0] : (p[0] + p[1] + p[2]) / 3.0);
    });
  }
  return over(points, [&](Vec3d p) { return other.nearest(lattice_.to_lattice(p)).distance; });
}

Distance MeasuredSurface::from(std::span<const Vec3d> points, std::span<const Face> faces) const {
  double area = 0;
  const auto twice_area = [&](const Face& f) {
    return length(cross(points[f[1]] - points[f[0]], points[f[2]] - points[f[0]]));
  };
  for (const Face& f : faces) area += twice_area(f);
  // One point per equal share of the area, at places in the triangle that a low-discrepancy sequence names.
  const double share = area / double(kPoints);
  std::vector<Vec3d> chosen;
  double sum = 0.5 * share;
  for (const Face& f : faces) {
    sum += twice_area(f);
    for (; sum >= share && share > 0; sum -= share) {
      const double k = double(chosen.size());
      double u = std::fmod(0.5 + k * 0.7548776662466927, 1.0), v = std::fmod(0.5 + k * 0.5698402909980532, 1.0);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      chosen.push_back(points[f[0]] + (points[f[1]] - points[f[0]]) * u + (points[f[2]] - points[f[0]]) * v);
    }
  }
  return over(chosen, [&](Vec3d p) { return distance_from(lattice_.origin + p * lattice_.step) / lattice_.step; });
}

double MeasuredSurface::distance_from(Vec3d p) const {
  constexpr int kReach = 2;  // cells
  const SlabMesh& mesh = model_.slab_mesh();
  LocateHint hint;
  double best2 = Box3d::kFar;
  if (const auto at = locate(mesh, p, hint)) {
    const int n = mesh.intervals(at->slab);
    const int i = static_cast<int>(at->u * n), j = static_cast<int>(at->v * n);
    const auto add = [&](const std::array<GridPoint, 3>& cell) {
      for (const GridPoint& corner : cell)
        if (corner.i < 0 || corner.j < 0 || corner.i + corner.j > n) return;
      if (model_.is_hole(at->slab, cell)) return;
      const Vec3d a = sample_position(model_, at->slab, cell[0]), b = sample_position(model_, at->slab, cell[1]),
                  c = sample_position(model_, at->slab, cell[2]);
      const auto w = nearest_in_triangle(p, a, b, c);
      const Vec3d away = a * w[0] + b * w[1] + c * w[2] - p;
      best2 = std::min(best2, dot(away, away));
    };
    for (int y = j - kReach; y <= j + kReach; ++y)
      for (int x = i - kReach; x <= i + kReach; ++x) {
        add({{{x, y}, {x + 1, y}, {x, y + 1}}});
        add({{{x + 1, y}, {x + 1, y + 1}, {x, y + 1}}});
      }
  }
  if (best2 < Box3d::kFar) return std::sqrt(best2);
  const SurfacePoint nearest = closest_point(model_, p);
  return nearest.slab == kNoSlab ? 0 : length(nearest.position - p);
}

}  // namespace relief::detail
