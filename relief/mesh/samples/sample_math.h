// Arithmetic for the sample models that gives the same bits on every machine: only + - * /, sqrt and floor.
#pragma once

#include <relief/base/vec.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace relief::detail {

[[nodiscard]] inline double clamp01(double x) noexcept { return std::clamp(x, 0.0, 1.0); }
[[nodiscard]] inline double mix(double a, double b, double t) noexcept { return a + (b - a) * t; }
[[nodiscard]] inline Vec3d mix(Vec3d a, Vec3d b, double t) noexcept { return a + (b - a) * t; }
/// 0 below `from`, 1 above `to` (or the other way round), with slope 0 at both ends.
[[nodiscard]] inline double smooth(double from, double to, double x) noexcept {
  const double t = clamp01((x - from) / (to - from));
  return t * t * (3.0 - 2.0 * t);
}

/// sin(2 pi x), error below 1e-11; x in turns.
[[nodiscard]] inline double sin_turn(double x) noexcept {
  double t = x - std::floor(x + 0.5);  // -0.5 .. 0.5
  if (t > 0.25) t = 0.5 - t;
  if (t < -0.25) t = -0.5 - t;
  const double a = t * 6.283185307179586, q = a * a;
  double sum = 0.0;
  for (const double c : {-1.0 / 210.0, -1.0 / 156.0, -1.0 / 110.0, -1.0 / 72.0, -1.0 / 42.0, -1.0 / 20.0, -1.0 / 6.0})
    sum = (1.0 + sum) * q * c;
  return a + a * sum;
}
[[nodiscard]] inline double cos_turn(double x) noexcept { return sin_turn(x + 0.25); }

/// exp(-x) for x >= 0, relative error below 1e-8.
[[nodiscard]] inline double exp_minus(double x) noexcept {
  if (x > 60.0) return 0.0;
  const double y = x / 64.0;  // below 1
  double sum = 1.0;
  for (const double c :
       {1.0 / 10.0, 1.0 / 9.0, 1.0 / 8.0, 1.0 / 7.0, 1.0 / 6.0, 1.0 / 5.0, 1.0 / 4.0, 1.0 / 3.0, 1.0 / 2.0, 1.0})
    sum = 1.0 - sum * y * c;
  for (int k = 0; k < 6; ++k) sum *= sum;
  return sum;
}
/// Returns the bell exp(-(x/width)^2).
[[nodiscard]] inline double bell(double x, double width) noexcept { return exp_minus(x / width * (x / width)); }

/// Returns the angle of (x, y) in turns, -0.5 .. 0.5, error below 1e-6; 0 at the origin.
[[nodiscard]] inline double angle_turn(double y, double x) noexcept {
  const double ax = std::abs(x), ay = std::abs(y), most = std::max(ax, ay);
  if (most == 0.0) return 0.0;
  const double t = std::min(ax, ay) / most, q = t * t;
  // Minimax polynomial of atan on 0 .. 1.
  double a =
      t * (0.99997726 + q * (-0.33262347 + q * (0.19354346 + q * (-0.11643287 + q * (0.05265332 - q * 0.01172120)))));
  a /= 6.283185307179586;
  if (ay > ax) a = 0.25 - a;
  if (x < 0.0) a = 0.5 - a;
  return y < 0.0 ? -a : a;
}

[[nodiscard]] constexpr std::uint32_t hash_cell(std::int64_t x, std::int64_t y, std::int64_t z,
                                                std::uint32_t seed) noexcept {
  std::uint64_t h = static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15ULL ^
                    static_cast<std::uint64_t>(y) * 0xc2b2ae3d27d4eb4fULL ^
                    static_cast<std::uint64_t>(z) * 0x165667b19e3779f9ULL ^ std::uint64_t{seed} * 0xd6e8feb86659fd93ULL;
  h = (h ^ (h >> 32U)) * 0xd6e8feb86659fd93ULL;
  h = (h ^ (h >> 32U)) * 0xd6e8feb86659fd93ULL;
  return static_cast<std::uint32_t>(h >> 32U);
}
/// Byte k (0 .. 3) of a hash as 0 .. 1.
[[nodiscard]] constexpr double hash_part(std::uint32_t h, unsigned k) noexcept {
  return ((h >> (8U * k)) & 255U) / 255.0;
}

/// Smooth gradient noise of period about 1, roughly -1 .. 1, mean 0.
[[nodiscard]] inline double noise(Vec3d p, std::uint32_t seed) noexcept {
  const double fx = std::floor(p.x), fy = std::floor(p.y), fz = std::floor(p.z);
  const auto ix = static_cast<std::int64_t>(fx), iy = static_cast<std::int64_t>(fy), iz = static_cast<std::int64_t>(fz);
  const double x = p.x - fx, y = p.y - fy, z = p.z - fz;
  const auto corner = [&](int a, int b, int c) {
    const std::uint32_t h = hash_cell(ix + a, iy + b, iz + c, seed);
    return (hash_part(h, 0) - 0.5) * (x - a) + (hash_part(h, 1) - 0.5) * (y - b) + (hash_part(h, 2) - 0.5) * (z - c);
  };
  const auto fade = [](double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); };
  const double u = fade(x), v = fade(y), w = fade(z);
  const double low = mix(mix(corner(0, 0, 0), corner(1, 0, 0), u), mix(corner(0, 1, 0), corner(1, 1, 0), u), v);
  const double high = mix(mix(corner(0, 0, 1), corner(1, 0, 1), u), mix(corner(0, 1, 1), corner(1, 1, 1), u), v);
  return 2.6 * mix(low, high, w);
}

/// Calls visit(squared distance, hash of its cell) for the points around p: one in each of the 27 cells there.
template <typename Visit>
void for_each_point_around(Vec3d p, std::uint32_t seed, Visit visit) noexcept {
  const double fx = std::floor(p.x), fy = std::floor(p.y), fz = std::floor(p.z);
  for (int c = -1; c <= 1; ++c)
    for (int b = -1; b <= 1; ++b)
      for (int a = -1; a <= 1; ++a) {
        const std::uint32_t h = hash_cell(static_cast<std::int64_t>(fx) + a, static_cast<std::int64_t>(fy) + b,
                                          static_cast<std::int64_t>(fz) + c, seed);
        const Vec3d q = {fx + a + hash_part(h, 0), fy + b + hash_part(h, 1), fz + c + hash_part(h, 2)};
        visit(dot(q - p, q - p), h);
      }
}

/// One point is strewn into each unit cell; what lies nearest to p.
struct CellHit {
  double nearest = 8.0, second = 8.0;  ///< Distances, in cells.
  std::uint32_t hash = 0;              ///< Of the nearest point's cell: bits for size, presence, colour.
};
[[nodiscard]] inline CellHit cells(Vec3d p, std::uint32_t seed) noexcept {
  double best = 64.0, next = 64.0;
  CellHit hit;
  for_each_point_around(p, seed, [&](double d, std::uint32_t h) {
    if (d < best) {
      next = best;
      best = d;
      hit.hash = h * 2654435761U;
    } else if (d < next) {
      next = d;
    }
  });
  hit.nearest = std::sqrt(best);
  hit.second = std::sqrt(next);
  return hit;
}

/// Returns the highest of the bumps strewn one to a cell around p: `bump(distance, hash)`, distance in cells, 0 from 1
/// on.
template <typename Bump>
[[nodiscard]] double strewn(Vec3d p, std::uint32_t seed, Bump bump) noexcept {
  double highest = 0.0;
  for_each_point_around(p, seed, [&](double d, std::uint32_t h) {
    if (d < 1.0) highest = std::max(highest, bump(std::sqrt(d), h * 2654435761U));
  });
  return highest;
}

/// Returns how much of a detail of this wavelength a mesh with this edge length can carry without aliasing, 0 .. 1.
[[nodiscard]] inline double carried(double wavelength, double edge) noexcept {
  return smooth(1.8, 4.5, wavelength / edge);
}

}  // namespace relief::detail
