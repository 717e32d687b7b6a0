// Points that are spread evenly over triangles.
#pragma once

#include <relief/base/vec.h>
#include <relief/convert/geometry/half_edges.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace relief::detail {

/// Steps of the R2 sequence (Roberts 2018), which fills the unit square evenly: 1 / g and 1 / g^2, g^3 = g + 1.
inline constexpr double kFirstStep = 0.7548776662466927, kSecondStep = 0.5698402909980532;

/// Returns the k-th of points that fill a triangle evenly, as weights of its second and third corner.
[[nodiscard]] inline std::pair<double, double> spread(std::size_t k) noexcept {
  const double u = std::fmod(0.5 + double(k) * kFirstStep, 1.0);
  const double v = std::fmod(0.5 + double(k) * kSecondStep, 1.0);
  return u + v > 1 ? std::pair{1 - u, 1 - v} : std::pair{u, v};
}

struct SpreadPoint {
  Vec3d at;
  std::uint32_t face = 0;
};

/// About `count` points, one for each equal share of the area. Triangles that are not finite have none.
[[nodiscard]] inline std::vector<SpreadPoint> spread_over(std::span<const Vec3d> points, std::span<const Face> faces,
                                                          std::size_t count) {
  const auto twice_area = [&](const Face& f) {
    const double size = length(cross(points[f[1]] - points[f[0]], points[f[2]] - points[f[0]]));
    return std::isfinite(size) ? size : 0;
  };
  double area = 0;
  for (const Face& f : faces) area += twice_area(f);
  const double share = area / double(count);
  std::vector<SpreadPoint> chosen;
  double sum = 0.5 * share;
  for (std::uint32_t k = 0; k < faces.size(); ++k) {
    const Face& f = faces[k];
    sum += twice_area(f);
    for (; sum >= share && share > 0; sum -= share) {
      const auto [u, v] = spread(chosen.size());
      chosen.push_back({points[f[0]] + (points[f[1]] - points[f[0]]) * u + (points[f[2]] - points[f[0]]) * v, k});
    }
  }
  return chosen;
}

}  // namespace relief::detail
