// Plain bodies whose contact is known in closed form.
#pragma once

#include <relief/mesh/triangle_mesh.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <utility>
#include <vector>

namespace relief::testing {

inline constexpr double kPi = 3.14159265358979323846;

/// A polygon in the plane z = 0, counter-clockwise and convex, made a solid from z = -half_length to half_length.
inline TriangleMesh extruded(const std::vector<Vec3d>& polygon, double half_length) {
  TriangleMesh mesh;
  const auto n = static_cast<std::uint32_t>(polygon.size());
  for (const double z : {-half_length, half_length})
    for (const Vec3d p : polygon) mesh.positions.push_back({p.x, p.y, z});
  Vec3d middle;
  for (const Vec3d p : polygon) middle += p / n;
  mesh.positions.push_back({middle.x, middle.y, -half_length});
  mesh.positions.push_back({middle.x, middle.y, half_length});
  for (std::uint32_t k = 0; k < n; ++k) {
    const std::uint32_t next = (k + 1) % n;
    mesh.triangles.push_back({k, next, n + next});
    mesh.triangles.push_back({k, n + next, n + k});
    mesh.triangles.push_back({2 * n, next, k});
    mesh.triangles.push_back({2 * n + 1, n + k, n + next});
  }
  return mesh;
}

/// Corners at so far from the middle, the first one on the x axis.
inline std::vector<Vec3d> regular_polygon(int sides, double radius) {
  std::vector<Vec3d> polygon;
  for (int k = 0; k < sides; ++k) {
    const double turn = 2 * kPi * k / sides;
    polygon.push_back(Vec3d{std::cos(turn), std::sin(turn), 0} * radius);
  }
  return polygon;
}

/// Along z, its edge at the origin; one face is in the half-plane y = 0, x < 0, and faces up, the other one lies so
/// many radians below it. Both are 1 wide.
inline TriangleMesh wedge(double angle, double half_length) {
  const Vec3d far = {-std::cos(angle), -std::sin(angle), 0};
  return extruded({{0, 0, 0}, {-1, 0, 0}, far}, half_length);
}

/// |x| + |y| + |z| <= 1.
inline TriangleMesh octahedron() {
  TriangleMesh mesh;
  mesh.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  return mesh;
}

/// Each triangle cut in four, so many times.
inline TriangleMesh subdivided(TriangleMesh mesh, int times) {
  for (; times > 0; --times) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, fresh] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.positions.size()));
      if (fresh) mesh.positions.push_back((mesh.positions[a] + mesh.positions[b]) * 0.5);
      return at->second;
    };
    std::vector<Triangle> finer;
    for (const auto [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(finer);
  }
  return mesh;
}

/// A sphere of radius 1 with 8 * 4^times triangles, whose corners lie on it.
inline TriangleMesh round_sphere_mesh(int times) {
  TriangleMesh mesh = octahedron();
  for (; times > 0; --times) {
    mesh = subdivided(std::move(mesh), 1);
    for (Vec3d& p : mesh.positions) p = normalized(p);
  }
  return mesh;
}

/// The convex hull of points of which no four lie in a plane.
inline TriangleMesh convex_hull(const std::vector<Vec3d>& points) {
  TriangleMesh mesh;
  mesh.positions = points;
  const auto n = static_cast<std::uint32_t>(points.size());
  const auto all_below = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const Vec3d out = cross(points[b] - points[a], points[c] - points[a]);
    for (std::uint32_t k = 0; k < n; ++k)
      if (k != a && k != b && k != c && dot(out, points[k] - points[a]) > 0) return false;
    return true;
  };
  for (std::uint32_t a = 0; a < n; ++a)
    for (std::uint32_t b = a + 1; b < n; ++b)
      for (std::uint32_t c = b + 1; c < n; ++c) {
        if (all_below(a, b, c)) mesh.triangles.push_back({a, b, c});
        if (all_below(a, c, b)) mesh.triangles.push_back({a, c, b});
      }
  return mesh;
}

/// The convex hull of so many random points around a sphere of radius 1: the same ones for the same seed.
inline TriangleMesh random_hull(std::uint32_t seed, int points) {
  std::mt19937 random(seed);
  const auto unit = [&] { return 2 * (double(random()) / 4294967296.0) - 1; };
  std::vector<Vec3d> all;
  while (all.size() < static_cast<std::size_t>(points)) {
    const Vec3d p = {unit(), unit(), unit()};
    if (length(p) <= 1 && length(p) > 0.1) all.push_back(normalized(p) * (0.85 + 0.15 * unit()));
  }
  return convex_hull(all);
}

}  // namespace relief::testing
