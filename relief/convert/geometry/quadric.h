// The error of moving a vertex, as a sum over planes, and the shape of triangles.
#pragma once

#include <relief/base/vec.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace relief::detail {

/// Sum of squared distances to planes, weighted by area: p'Ap + 2b'p + c.
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  Vec3d b;
  double c = 0;

  static constexpr double kPull = 1e-3;  ///< enough for rounding, too little to be seen across a sharp edge

  void add_plane(Vec3d n, Vec3d on, double weight) noexcept {
    const double d = -dot(n, on);
    xx += weight * n.x * n.x, xy += weight * n.x * n.y, xz += weight * n.x * n.z;
    yy += weight * n.y * n.y, yz += weight * n.y * n.z, zz += weight * n.z * n.z;
    b += n * (weight * d);
    c += weight * d * d;
  }
  Quadric& operator+=(const Quadric& q) noexcept {
    xx += q.xx, xy += q.xy, xz += q.xz, yy += q.yy, yz += q.yz, zz += q.zz;
    b += q.b;
    c += q.c;
    return *this;
  }
  Quadric& operator*=(double factor) noexcept {
    xx *= factor, xy *= factor, xz *= factor, yy *= factor, yz *= factor, zz *= factor;
    b *= factor;
    c *= factor;
    return *this;
  }
  [[nodiscard]] double trace() const noexcept { return xx + yy + zz; }
  [[nodiscard]] Vec3d times(Vec3d p) const noexcept {
    return {xx * p.x + xy * p.y + xz * p.z, xy * p.x + yy * p.y + yz * p.z, xz * p.x + yz * p.y + zz * p.z};
  }
  [[nodiscard]] double error(Vec3d p) const noexcept { return std::max(0.0, dot(p, times(p)) + 2 * dot(b, p) + c); }

  /// Returns the place of least error, drawn towards `near` with kPull of the trace where the planes leave it open.
  [[nodiscard]] Vec3d optimum(Vec3d near) const noexcept {
    const double pull = kPull * trace() + std::numeric_limits<double>::min();
    const double a = xx + pull, d = yy + pull, f = zz + pull;
    const Vec3d right = -(b + times(near));  // solved for the step from `near`
    const double m00 = d * f - yz * yz, m01 = xz * yz - xy * f, m02 = xy * yz - xz * d;
    const double m11 = a * f - xz * xz, m12 = xy * xz - a * yz, m22 = a * d - xy * xy;
    const double det = a * m00 + xy * m01 + xz * m02;
    if (!(det > 0)) return near;
    return near + Vec3d{m00 * right.x + m01 * right.y + m02 * right.z, m01 * right.x + m11 * right.y + m12 * right.z,
                        m02 * right.x + m12 * right.y + m22 * right.z} /
                      det;
  }
};

/// 1 for an equilateral triangle, 0 for one without area: 4 sqrt(3) times the area over the squared edges' sum.
[[nodiscard]] inline double shape_of(Vec3d a, Vec3d b, Vec3d c, double twice_area) noexcept {
  const double edges = dot(b - a, b - a) + dot(c - b, c - b) + dot(a - c, a - c);
  return edges > 0 ? 2 * std::numbers::sqrt3 * twice_area / edges : 0;
}

/// Holds what merging the ends of an edge costs, and where they would go.
struct Merge {
  double cost = 0;
  Vec3d place;
};
/// For an edge of the given squared length; `sum` is that of the quadrics of both ends. In planes, where nothing costs
/// anything, the squared length counts a little: short edges go first, and triangles stay even.
[[nodiscard]] inline double merge_cost(const Quadric& sum, Vec3d place, double edge2) noexcept {
  constexpr double kLengthCosts = 5e-5;  // of the trace
  return sum.error(place) + kLengthCosts * sum.trace() * edge2;
}
/// Returns the same, at the best place; in the middle where that is far off, as the planes nearly leave it open.
[[nodiscard]] inline Merge merge_ends(const Quadric& sum, Vec3d a, Vec3d b) noexcept {
  const Vec3d middle = (a + b) * 0.5, edge = b - a;
  const double edge2 = dot(edge, edge);
  Vec3d p = sum.optimum(middle);
  constexpr double kFar = 1.5;  // edge lengths
  if (dot(p - middle, p - middle) > kFar * kFar * edge2) p = middle;
  return {merge_cost(sum, p, edge2), p};
}

}  // namespace relief::detail
