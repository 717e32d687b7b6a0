// Profiles of turned shapes, and normals of any sample surface.
#pragma once

#include "rings.h"

#include <array>
#include <cstddef>

namespace relief::detail {

/// A control point of a profile from pole to pole: distance from the axis, height, two further values carried along.
struct ProfileKnot {
  double rho, y, a, b;
};
struct ProfilePoint {
  double rho, y, a, b;
  double normal_rho, normal_y;  ///< Unit normal, to the right of the direction of travel.
};

/// Returns the point at s in 0 .. 1 of the cubic B-spline over the knots; the first and last lie on the axis and are
/// smooth there.
template <std::size_t N>
[[nodiscard]] ProfilePoint profile_point(const std::array<ProfileKnot, N>& knots, double s) noexcept {
  const double x = clamp01(s) * double(N - 1);
  const auto cell = std::min(static_cast<std::size_t>(x), N - 2);
  const double t = x - double(cell), r = 1.0 - t;
  const auto mirrored = [](ProfileKnot k) { return ProfileKnot{-k.rho, k.y, k.a, k.b}; };
  const std::array<ProfileKnot, 4> k = {cell == 0 ? mirrored(knots[1]) : knots[cell - 1], knots[cell], knots[cell + 1],
                                        cell + 2 == N ? mirrored(knots[N - 2]) : knots[cell + 2]};
  const std::array<double, 4> w = {r * r * r / 6.0, (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
                                   (4.0 - 6.0 * r * r + 3.0 * r * r * r) / 6.0, t * t * t / 6.0};
  const std::array<double, 4> d = {-r * r / 2.0, (3.0 * t * t - 4.0 * t) / 2.0, (4.0 * r - 3.0 * r * r) / 2.0,
                                   t * t / 2.0};
  ProfilePoint p = {};
  double along_rho = 0.0, along_y = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    p.rho += w[i] * k[i].rho;
    p.y += w[i] * k[i].y;
    p.a += w[i] * k[i].a;
    p.b += w[i] * k[i].b;
    along_rho += d[i] * k[i].rho;
    along_y += d[i] * k[i].y;
  }
  const double speed = std::sqrt(along_rho * along_rho + along_y * along_y);
  p.normal_rho = along_y / speed;
  p.normal_y = -along_rho / speed;
  return p;
}

/// Outward unit normal of the coarse shape, by differences; near a pole that of a ring close by.
[[nodiscard]] inline Vec3d surface_normal(const SampleSurface& surface, double s, double turn) noexcept {
  constexpr double kStep = 1e-4;
  const auto across = [&](double at) {
    const Vec3d around = surface.coarse(at, turn + kStep) - surface.coarse(at, turn - kStep);
    const Vec3d along = surface.coarse(at + kStep, turn) - surface.coarse(at - kStep, turn);
    return normalized(cross(around, along));
  };
  if (surface.closed() || (s > 1e-3 && s < 1.0 - 1e-3)) return across(s);
  const double near = s < 0.5 ? 1e-3 : 1.0 - 1e-3;
  Vec3d sum;
  for (int k = 0; k < 4; ++k) {
    const double other = turn + 0.25 * k;
    const Vec3d around = surface.coarse(near, other + kStep) - surface.coarse(near, other - kStep);
    const Vec3d along = surface.coarse(near + kStep, other) - surface.coarse(near - kStep, other);
    sum += normalized(cross(around, along));
  }
  return normalized(sum);
}

}  // namespace relief::detail
