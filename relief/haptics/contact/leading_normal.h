// The normal along which a point is pushed out: the surface's, interpolated, and going evenly.
#pragma once

#include <relief/core/micro_triangles.h>
#include <relief/haptics/contact/principle.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace relief::detail {

constexpr double kFacing = 0.5;  // cosine from a normal to the way out, at least: so much of its force pushes out

/// Returns the interpolated normal at the place beside the given one whose own normal leads to the goal. The nearest
/// place stands still at samples and leaps from triangle to triangle; this one goes evenly. It turns no further from
/// the normal at the place than the way out does, and that place is no farther away than 1 / kFacing times the depth.
[[nodiscard]] inline Vec3d leading_normal(const SurfacePlace& place, const std::array<Vec3d, 3>& normals, Vec3d normal,
                                          Vec3d goal) noexcept {
  const auto& [a, b, c] = place.triangle.positions;
  const Vec3d area = place.triangle.area(), out = place.position - goal;
  const double area2 = dot(area, area), height = dot(out, area), depth2 = dot(out, out);
  if (!(height > 0)) return normal;
  // The weights of b and c grow along these.
  const Vec3d to_b = cross(c - a, area) / area2, to_c = cross(area, b - a) / area2;
  const Vec3d by_b = normals[1] - normals[0], by_c = normals[2] - normals[0], start = goal - a;
  Vec3d n = normal;
  for (int step = 0; step < 2; ++step) {
    // In the plane of the triangle; a normal that leans farther than a felt one may leads no farther than that.
    const Vec3d p = start + n * (height / std::max(dot(n, area), kFacing * std::sqrt(dot(n, n) * area2)));
    n = normals[0] + by_b * dot(p, to_b) + by_c * dot(p, to_c);
  }
  n = normalized(n);
  const double turn2 = distance2(n, normal), most2 = distance2(out / std::sqrt(depth2), normal);
  return turn2 <= most2 ? n : normalized(normal + (n - normal) * std::sqrt(most2 / turn2));
}

/// Returns a normal, led towards the way out where it does not face it. All are unit.
[[nodiscard]] inline Vec3d facing(Vec3d way_out, Vec3d normal) noexcept {
  const double cosine = dot(normal, way_out);
  if (cosine >= kFacing) return normal;
  const Vec3d aside = normal - way_out * cosine;
  const double size = length(aside);
  return size > 0 ? way_out * kFacing + aside * (std::sqrt(1 - kFacing * kFacing) / size) : way_out;
}

}  // namespace relief::detail
