#include <relief/base/triangle.h>
#include <relief/convert/measure.h>
#include <relief/convert/parallel.h>
#include <relief/core/query.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace relief::detail {
namespace {

constexpr std::size_t kPoints = 12000;

/// The k-th of points that fill a triangle evenly, as weights of its second and third corner.
std::pair<double, double> spread(std::size_t k) noexcept {
  const double u = std::fmod(0.5 + double(k) * 0.7548776662466927, 1.0);
  const double v = std::fmod(0.5 + double(k) * 0.5698402909980532, 1.0);
  return u + v > 1 ? std::pair{1 - u, 1 - v} : std::pair{u, v};
}

template <typename DistanceOf>
std::vector<double> each(const std::vector<Vec3d>& points, const Progress& progress, DistanceOf&& distance_of) {
  std::vector<double> distances(points.size());
  for_all(points.size(), 64, progress, [&](std::size_t k) { distances[k] = distance_of(points[k]); });
  return distances;
}

Distance over(const std::vector<double>& distances) {
  Distance result;
  for (const double d : distances) {
    result.rms += d * d;
    result.max = std::max(result.max, d);
  }
  if (!distances.empty()) result.rms = std::sqrt(result.rms / double(distances.size()));
  return result;
}

}  // namespace

Distance MeasuredSurface::to(const SourceSurface& other, const Progress& progress) const {
  const SlabMesh& mesh = model_.slab_mesh();
  // As many points in a slab as its middle has of the area, each inside a micro-triangle.
  std::vector<double> areas;
  double all = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const SlabCorners c = mesh.corners(s);
    const Vec3d a = c.point({1, 0, 0}, 0.5);
    areas.push_back(length(cross(c.point({0, 1, 0}, 0.5) - a, c.point({0, 0, 1}, 0.5) - a)));
    all += areas.back();
  }
  std::vector<Vec3d> points;
  double sum = 0;
  std::size_t counter = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const int n = mesh.intervals(s);
    const double share = all / double(kPoints);
    for (sum += areas[s]; sum >= share && share > 0; sum -= share) {
      const auto [u, v] = spread(counter++);
      const int i = std::min(static_cast<int>(u * n), n - 1), j = std::min(static_cast<int>(v * n), n - 1);
      const double x = u * n - i, y = v * n - j;
      const bool upright = x + y <= 1 || i + j + 1 >= n;
      const std::array<GridPoint, 3> cell = upright
                                                ? std::array<GridPoint, 3>{{{i, j}, {i + 1, j}, {i, j + 1}}}
                                                : std::array<GridPoint, 3>{{{i + 1, j + 1}, {i, j + 1}, {i + 1, j}}};
      if (i + j >= n || model_.is_hole(s, cell)) continue;
      const double right = upright ? x : 1 - x, up = upright ? y : 1 - y;
      points.push_back(sample_position(model_, s, cell[0]) * (1 - right - up) +
                       sample_position(model_, s, cell[1]) * right + sample_position(model_, s, cell[2]) * up);
    }
  }
  return over(each(points, progress, [&](Vec3d p) { return other.nearest(lattice_.to_lattice(p)).distance; }));
}

Distance MeasuredSurface::from(std::span<const Vec3d> points, std::span<const Face> faces,
                               const Progress& progress) const {
  double area = 0;
  const auto twice_area = [&](const Face& f) {
    const double size = length(cross(points[f[1]] - points[f[0]], points[f[2]] - points[f[0]]));
    return std::isfinite(size) ? size : 0;
  };
  for (const Face& f : faces) area += twice_area(f);
  // One point per equal share of the area.
  const double share = area / double(kPoints);
  std::vector<Vec3d> chosen;
  double sum = 0.5 * share;
  for (const Face& f : faces) {
    sum += twice_area(f);
    for (; sum >= share && share > 0; sum -= share) {
      const auto [u, v] = spread(chosen.size());
      chosen.push_back(points[f[0]] + (points[f[1]] - points[f[0]]) * u + (points[f[2]] - points[f[0]]) * v);
    }
  }
  std::vector<double> distances = each(chosen, progress, [&](Vec3d p) { return distance_within(p); });
  // Points outside all slabs are compared with everything, which takes time; where there are many, some stand for all.
  constexpr std::size_t kMostOutside = 1500;
  std::vector<std::size_t> outside;
  for (std::size_t k = 0; k < distances.size(); ++k)
    if (distances[k] < 0) outside.push_back(k);
  const std::size_t stride = (outside.size() + kMostOutside - 1) / kMostOutside;
  std::vector<Vec3d> some;
  for (std::size_t k = 0; k < outside.size(); k += stride) some.push_back(chosen[outside[k]]);
  const std::vector<double> far = each(some, progress, [&](Vec3d p) {
    const SurfacePoint nearest = closest_point(model_, p);
    return nearest.slab == kNoSlab ? 0 : length(nearest.position - p);
  });
  for (std::size_t k = 0; k < outside.size(); ++k) distances[outside[k]] = far[k / stride];
  for (double& d : distances) d /= lattice_.step;
  return over(distances);
}

double MeasuredSurface::distance_within(Vec3d p) const {
  constexpr int kReach = 2;  // cells
  constexpr int kAcross = 2 * kReach + 2;
  const SlabMesh& mesh = model_.slab_mesh();
  LocateHint hint;
  const auto at = locate(mesh, p, hint);
  if (!at) return -1;
  const int n = mesh.intervals(at->slab);
  const int left = static_cast<int>(at->u * n) - kReach, low = static_cast<int>(at->v * n) - kReach;
  const auto on_grid = [&](GridPoint g) { return g.i >= 0 && g.j >= 0 && g.i + g.j <= n; };
  std::array<std::array<Vec3d, kAcross>, kAcross> places;  // by row
  const auto place = [&](GridPoint g) -> Vec3d& {
    return places[static_cast<std::size_t>(g.j - low)][static_cast<std::size_t>(g.i - left)];
  };
  for (int j = low; j < low + kAcross; ++j)
    for (int i = left; i < left + kAcross; ++i)
      if (const GridPoint g = {i, j}; on_grid(g)) place(g) = sample_position(model_, at->slab, g);
  double best2 = Box3d::kFar;
  const auto add = [&](const std::array<GridPoint, 3>& cell) {
    if (!std::all_of(cell.begin(), cell.end(), on_grid) || model_.is_hole(at->slab, cell)) return;
    const Vec3d a = place(cell[0]), b = place(cell[1]), c = place(cell[2]);
    const auto w = nearest_in_triangle(p, a, b, c);
    const Vec3d away = a * w[0] + b * w[1] + c * w[2] - p;
    best2 = std::min(best2, dot(away, away));
  };
  for (int y = low; y + 1 < low + kAcross; ++y)
    for (int x = left; x + 1 < left + kAcross; ++x) {
      add({{{x, y}, {x + 1, y}, {x, y + 1}}});
      add({{{x + 1, y}, {x + 1, y + 1}, {x, y + 1}}});
    }
  return best2 < Box3d::kFar ? std::sqrt(best2) : -1;
}

}  // namespace relief::detail
