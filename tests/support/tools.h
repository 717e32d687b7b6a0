// Rigid tools made of points.
#pragma once

#include <relief/base/vec.h>

#include <cmath>
#include <cstddef>
#include <vector>

namespace relief::testing {

/// Points evenly all over a sphere around the origin.
inline std::vector<Vec3d> sphere_points(std::size_t count, double radius) {
  std::vector<Vec3d> points;
  points.reserve(count);
  for (std::size_t k = 0; k < count; ++k) {
    const double y = 1 - 2 * (static_cast<double>(k) + 0.5) / static_cast<double>(count);
    const double round = std::sqrt(1 - y * y), turn = 2.399963229728653 * static_cast<double>(k);
    points.push_back(Vec3d{round * std::cos(turn), y, round * std::sin(turn)} * radius);
  }
  return points;
}

}  // namespace relief::testing
