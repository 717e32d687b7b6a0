// The paper's own algorithms, step by step, as the reference that the product is held against.
#pragma once

#include <relief/core/query.h>

#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace relief::paper {

/// Sec. 3.1: the polynomials of the alpha-plane A x + B y + C z + D = 0, precomputed from the six corners.
struct Coefficients {
  std::array<double, 3> a{}, b{}, c{};  ///< A, A', A'': constant term first
  std::array<double, 4> d{};            ///< D, D', D'', D'''
};

inline Coefficients coefficients(const SlabCorners& k) {
  // Each corner is X0 + alpha (X1 - X0); minors of products of two such lines give the quadratics, of three the cubic.
  const auto line = [&](std::size_t corner, std::size_t axis) {
    return std::array<double, 2>{k.inner[corner][axis], k.outer[corner][axis] - k.inner[corner][axis]};
  };
  const auto product = [](std::array<double, 2> p, std::array<double, 2> q) {
    return std::array<double, 3>{p[0] * q[0], p[0] * q[1] + p[1] * q[0], p[1] * q[1]};
  };
  Coefficients out;
  const auto minor = [&](std::size_t first, std::size_t second, std::size_t r, std::size_t s) {
    auto plus = product(line(r, first), line(s, second));
    const auto minus = product(line(r, second), line(s, first));
    for (std::size_t i = 0; i < 3; ++i) plus[i] -= minus[i];
    return plus;
  };
  // A = det[1 R_y R_z; 1 S_y S_z; 1 T_y T_z], expanded along the column of ones; B and C likewise.
  for (std::size_t i = 0; i < 3; ++i) {
    out.a[i] = minor(1, 2, 1, 2)[i] - minor(1, 2, 0, 2)[i] + minor(1, 2, 0, 1)[i];
    out.b[i] = minor(2, 0, 1, 2)[i] - minor(2, 0, 0, 2)[i] + minor(2, 0, 0, 1)[i];
    out.c[i] = minor(0, 1, 1, 2)[i] - minor(0, 1, 0, 2)[i] + minor(0, 1, 0, 1)[i];
  }
  // D = -det[R; S; T], expanded along R.
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto m = minor((axis + 1) % 3, (axis + 2) % 3, 1, 2);
    const auto r = line(0, axis);
    for (std::size_t i = 0; i < 3; ++i) {
      out.d[i] -= m[i] * r[0];
      out.d[i + 1] -= m[i] * r[1];
    }
  }
  return out;
}

/// Eq. 2.
inline double f(const Coefficients& k, Vec3d p, double alpha) {
  double sum = ((k.d[3] * alpha + k.d[2]) * alpha + k.d[1]) * alpha + k.d[0];
  const auto quadratic = [&](const std::array<double, 3>& q) { return (q[2] * alpha + q[1]) * alpha + q[0]; };
  sum += quadratic(k.a) * p.x + quadratic(k.b) * p.y + quadratic(k.c) * p.z;
  return sum;
}

/// Sec. 3.1: opposite signs at 0 and 1, then 15 halvings.
inline std::optional<double> alpha_by_bisection(const Coefficients& k, Vec3d p, int halvings = 15) {
  double low = 0, high = 1;
  const bool negative = f(k, p, low) < 0;
  if (negative == (f(k, p, high) < 0)) return std::nullopt;
  for (int step = 0; step < halvings; ++step) {
    const double middle = 0.5 * (low + high);
    ((f(k, p, middle) < 0) == negative ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// Sec. 3.1: h = H M^-1 p. The columns of M are R, S, T at alpha; H takes them to (0,0), (0,n), (n,n), which is the
/// paper's lower triangle. M must be invertible, so p and the slab are taken relative to a point off their plane.
inline std::array<double, 2> homogeneous(const SlabCorners& k, Vec3d p, double alpha, int n) {
  std::array<Vec3d, 3> m{};
  for (std::size_t i = 0; i < 3; ++i) m[i] = k.inner[i] + (k.outer[i] - k.inner[i]) * alpha;
  const Vec3d off = m[0] - normalized(cross(m[1] - m[0], m[2] - m[0])) * length(m[1] - m[0]);
  for (Vec3d& corner : m) corner -= off;
  p -= off;
  const double det = dot(m[0], cross(m[1], m[2]));
  const double s = dot(m[0], cross(p, m[2])) / det, t = dot(m[0], cross(m[1], p)) / det;
  return {t * n, s * n};
}

/// Sec. 3.1: the three conditions of the inside test.
inline bool inside(std::array<double, 2> h, int n) { return h[0] >= 0 && h[1] >= 0 && h[0] + h[1] <= n; }

/// Sec. 3.1: the coordinates of p where it is in the slab.
inline std::optional<SlabCoord> coordinates_in(const SlabMesh& mesh, SlabId s, Vec3d p) {
  if (!mesh.box(s).contains(p)) return std::nullopt;
  const SlabCorners corners = mesh.corners(s);
  const auto alpha = alpha_by_bisection(coefficients(corners), p);
  if (!alpha) return std::nullopt;
  const auto h = homogeneous(corners, p, *alpha, mesh.intervals(s));
  if (!inside(h, mesh.intervals(s))) return std::nullopt;
  // The paper's T is our corner 2 and its S our corner 1.
  return SlabCoord{s, h[1] / mesh.intervals(s), h[0] / mesh.intervals(s), *alpha};
}

/// Sec. 3: all slabs in sequence; the product's hierarchy must find the same one. With `last`, the slab of the last
/// answer or kNoSlab, that one and its neighbours come first.
inline std::optional<SlabCoord> locate(const SlabMesh& mesh, Vec3d p, SlabId last = kNoSlab) {
  if (last != kNoSlab) {
    if (const auto at = coordinates_in(mesh, last, p)) return at;
    for (const SlabId next : mesh.slabs()[last].neighbours)
      if (next != kNoSlab)
        if (const auto at = coordinates_in(mesh, next, p)) return at;
  }
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    if (const auto at = coordinates_in(mesh, s, p)) return at;
  return std::nullopt;
}

}  // namespace relief::paper
