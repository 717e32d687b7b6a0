// Triangle meshes made in the test.
#pragma once

#include <relief/core/plain_cage.h>
#include <relief/mesh/triangle_mesh.h>
#include <relief/verify/verify.h>

#include <cmath>
#include <functional>
#include <numbers>

namespace relief::testing {

inline void append(TriangleMesh& to, const TriangleMesh& more, Vec3d shift = {}, double scale = 1) {
  const auto first = static_cast<std::uint32_t>(to.positions.size());
  for (const Vec3d p : more.positions) to.positions.push_back(p * scale + shift);
  for (const Triangle& t : more.triangles) to.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

inline TriangleMesh scaled(TriangleMesh mesh, double scale, Vec3d shift = {}) {
  for (Vec3d& p : mesh.positions) p = p * scale + shift;
  return mesh;
}

inline TriangleMesh turned(TriangleMesh mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

/// A grid of columns x rows quadrilaterals over [0,1]^2, each cut in two, bent by `place`; closed around where asked
/// for. Counter-clockwise where place(1,0) x place(0,1) looks outwards.
inline TriangleMesh bent_grid(int columns, int rows, bool around_x, bool around_y,
                              const std::function<Vec3d(double, double)>& place) {
  TriangleMesh mesh;
  const int w = around_x ? columns : columns + 1, h = around_y ? rows : rows + 1;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) mesh.positions.push_back(place(double(x) / columns, double(y) / rows));
  const auto id = [&](int x, int y) { return static_cast<std::uint32_t>((y % h) * w + x % w); };
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      mesh.triangles.push_back({id(x, y), id(x + 1, y), id(x + 1, y + 1)});
      mesh.triangles.push_back({id(x, y), id(x + 1, y + 1), id(x, y + 1)});
    }
  return mesh;
}

/// A ball with bumps of height `bump`.
inline TriangleMesh ball(int rows, double bump = 0) {
  const int columns = 2 * rows;
  TriangleMesh mesh;
  const auto place = [&](double u, double v) {
    const double a = 2 * std::numbers::pi * u, b = std::numbers::pi * (v - 0.5);
    const Vec3d d = {std::cos(a) * std::cos(b), std::sin(a) * std::cos(b), std::sin(b)};
    return d * (1 + bump * std::sin(5 * d.x) * std::sin(6 * d.y) * std::sin(7 * d.z));
  };
  mesh.positions.push_back(place(0, 0));
  for (int y = 1; y < rows; ++y)
    for (int x = 0; x < columns; ++x) mesh.positions.push_back(place(double(x) / columns, double(y) / rows));
  mesh.positions.push_back(place(0, 1));
  const auto id = [&](int x, int y) {
    return y == 0      ? 0U
           : y == rows ? static_cast<std::uint32_t>(mesh.positions.size() - 1)
                       : static_cast<std::uint32_t>(1 + (y - 1) * columns + x % columns);
  };
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      if (y > 0) mesh.triangles.push_back({id(x, y), id(x + 1, y), id(x + 1, y + 1)});
      if (y < rows - 1) mesh.triangles.push_back({id(x, y), id(x + 1, y + 1), id(x, y + 1)});
    }
  return mesh;
}

inline TriangleMesh torus(int around, int across) {
  return bent_grid(around, across, true, true, [](double u, double v) {
    const double a = 2 * std::numbers::pi * u, b = 2 * std::numbers::pi * v;
    return Vec3d{(2 + 0.7 * std::cos(b)) * std::cos(a), (2 + 0.7 * std::cos(b)) * std::sin(a), 0.7 * std::sin(b)};
  });
}

inline TriangleMesh box(Vec3d size) {
  TriangleMesh mesh;
  for (int k = 0; k < 8; ++k)
    mesh.positions.push_back({(k & 1) != 0 ? size.x : 0, (k & 2) != 0 ? size.y : 0, (k & 4) != 0 ? size.z : 0});
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

/// The letters L, E and H of bars, each of them a box, half sunk in a plate. Faces of bars lie in each other.
inline TriangleMesh sign() {
  TriangleMesh mesh = box({5.5, 2, 0.3});
  const auto add_bar = [&](double x, double y, double width, double height) {
    append(mesh, box({width, height, 0.5}), {x, y, 0.1}, 1);
  };
  for (const double x : {0.4, 2.2, 4.0, 4.8}) add_bar(x, 0.4, 0.3, 1.2);
  add_bar(0.4, 0.4, 1, 0.3);
  for (const double y : {0.4, 0.85, 1.3}) add_bar(2.2, y, 1.1, 0.3);
  add_bar(4, 0.85, 1.1, 0.3);
  return mesh;
}
/// The plate, and what stands out of it: L, E and H.
inline constexpr double kSignVolume = 5.5 * 2 * 0.3 + 0.3 * (0.57 + 1.08 + 0.87);

/// Rotated so that `a` becomes the first axis; `b` says in which direction the second one lies.
inline TriangleMesh rotated(TriangleMesh mesh, Vec3d a, Vec3d b) {
  const Vec3d x = normalized(a), y = normalized(cross(x, b)), z = cross(x, y);
  for (Vec3d& p : mesh.positions) p = x * p.x + y * p.y + z * p.z;
  return mesh;
}

inline TriangleMesh tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}, {}};
}

inline TriangleMesh sheet(int cells, double height = 0) {
  return bent_grid(cells, cells, false, false,
                   [&](double u, double v) { return Vec3d{u, v, height * std::sin(9 * u) * std::cos(7 * v)}; });
}

inline TriangleMesh moebius(int cells) {
  TriangleMesh mesh;
  constexpr int kAcross = 4;
  for (int x = 0; x < cells; ++x)
    for (int y = 0; y <= kAcross; ++y) {
      const double a = 2 * std::numbers::pi * x / cells, w = (double(y) / kAcross - 0.5) * 0.8;
      const double r = 2 + w * std::cos(a / 2);
      mesh.positions.push_back({r * std::cos(a), r * std::sin(a), w * std::sin(a / 2)});
    }
  const auto id = [&](int x, int y) {
    return static_cast<std::uint32_t>(x < cells ? x * (kAcross + 1) + y : kAcross - y);
  };
  for (int x = 0; x < cells; ++x)
    for (int y = 0; y < kAcross; ++y) {
      mesh.triangles.push_back({id(x, y), id(x + 1, y), id(x + 1, y + 1)});
      mesh.triangles.push_back({id(x, y), id(x + 1, y + 1), id(x, y + 1)});
    }
  return mesh;
}

/// Without the faces that have a corner for which `hole` holds.
inline TriangleMesh pierced(TriangleMesh mesh, const std::function<bool(Vec3d)>& hole) {
  std::erase_if(mesh.triangles, [&](const Triangle& t) {
    return hole(mesh.positions[t[0]]) || hole(mesh.positions[t[1]]) || hole(mesh.positions[t[2]]);
  });
  return mesh;
}

/// A disc of n triangles, or where it is high a cone, on another one or on a flat disc.
inline TriangleMesh fans(std::uint32_t n, double top, double bottom,
                         const std::function<double(std::uint32_t)>& width) {
  TriangleMesh mesh;
  mesh.positions = {{0, 0, top}, {0, 0, bottom}};
  for (std::uint32_t k = 0; k < n; ++k) {
    const double a = 2 * std::numbers::pi * k / n, r = width(k);
    mesh.positions.push_back({r * std::cos(a), r * std::sin(a), 0});
  }
  for (std::uint32_t k = 0; k < n; ++k) {
    const std::uint32_t a = 2 + k, b = 2 + (k + 1) % n;
    mesh.triangles.push_back({0, a, b});
    mesh.triangles.push_back({1, b, a});
  }
  return mesh;
}

/// A star of so many points that the triangles around a tip cannot be compared with each other: no shell has it.
inline TriangleMesh unheld_star() {
  constexpr std::uint32_t kPoints = 6000;
  TriangleMesh star;
  star.positions = {{0, 1, 0}, {0, -1, 0}};
  for (std::uint32_t k = 0; k < kPoints; ++k) {
    const double turn = 2 * std::numbers::pi * k / kPoints, out = 1 + 0.1 * (k % 2);
    star.positions.push_back({out * std::cos(turn), 0.1 * (k % 2), out * std::sin(turn)});
  }
  for (std::uint32_t k = 0; k < kPoints; ++k) {
    const std::uint32_t here = k + 2, there = (k + 1) % kPoints + 2;
    star.triangles.push_back({0, there, here});
    star.triangles.push_back({1, here, there});
  }
  return star;
}

/// What the verifier proves of a cage alone.
inline verify::Certificate certificate(const SlabMesh& mesh) {
  const PlainCage cage(mesh);
  return verify::check({cage.inner, cage.outer, cage.triangles});
}

/// A torus with grooves whose rims overhang, so that few slabs cannot follow them.
inline TriangleMesh grooved_torus(int around = 150, int across = 128) {
  return bent_grid(around, across, true, true, [](double u, double v) {
    const double a = 2 * std::numbers::pi * u, t = 2 * std::numbers::pi * v;
    const double b = t + 0.3 * std::sin(4 * t), r = 0.7 * (1 + 0.15 * std::sin(4 * t));
    return Vec3d{(2 + r * std::cos(b)) * std::cos(a), (2 + r * std::cos(b)) * std::sin(a), r * std::sin(b)};
  });
}

}  // namespace relief::testing
