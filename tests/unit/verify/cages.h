// Shells and sources as plain numbers, which a test may put together, change and break.
#pragma once

#include <relief/core/slab_mesh.h>
#include <relief/verify/verify.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <ostream>
#include <utility>
#include <vector>

namespace relief::verify {

inline void PrintTo(Condition condition, std::ostream* out) { *out << name(condition); }

using Point = std::array<double, 3>;
using Face = std::array<std::uint32_t, 3>;

inline Vec3d vec(const Point& p) { return {p[0], p[1], p[2]}; }

/// To multiples of 2^-bits.
inline Point rounded(const Point& p, int bits) {
  const auto round = [&](double c) { return std::ldexp(std::round(std::ldexp(c, bits)), -bits); };
  return {round(p[0]), round(p[1]), round(p[2])};
}

struct Surface {
  std::vector<Point> points;
  std::vector<Face> faces;

  void add(const Surface& other) {
    const auto first = static_cast<std::uint32_t>(points.size());
    points.insert(points.end(), other.points.begin(), other.points.end());
    for (const Face& f : other.faces) faces.push_back({f[0] + first, f[1] + first, f[2] + first});
  }
  /// Every point replaced by `change` of it.
  template <typename Change>
  [[nodiscard]] Surface moved(Change&& change) const {
    Surface other = *this;
    for (Point& p : other.points) {
      const Vec3d q = change(vec(p));
      p = {q.x, q.y, q.z};
    }
    return other;
  }
  [[nodiscard]] Surface inside_out() const {
    Surface other = *this;
    for (Face& f : other.faces) std::swap(f[1], f[2]);
    return other;
  }
  [[nodiscard]] Source view() const { return {points, faces}; }
};

struct Cage {
  std::vector<Point> inner, outer;
  std::vector<Face> faces;

  void fibre(const Point& in, const Point& out) {
    inner.push_back(in);
    outer.push_back(out);
  }
  /// Puts another shell beside this one, moved and scaled.
  void add(const Cage& other, const Point& by = {}, double scale = 1) {
    const auto first = static_cast<std::uint32_t>(inner.size());
    const auto at = [&](Point p) {
      for (std::size_t k = 0; k < 3; ++k) p[k] = p[k] * scale + by[k];
      return p;
    };
    for (std::size_t f = 0; f < other.inner.size(); ++f) fibre(at(other.inner[f]), at(other.outer[f]));
    for (const Face& f : other.faces) faces.push_back({f[0] + first, f[1] + first, f[2] + first});
  }
  /// Every end p replaced by change(p).
  template <typename Change>
  void move(Change&& change) {
    for (auto* ends : {&inner, &outer})
      for (Point& p : *ends) p = change(p);
  }
  void snap(int bits) {
    move([&](const Point& p) { return rounded(p, bits); });
  }
  [[nodiscard]] Shell view() const { return {inner, outer, faces}; }
  [[nodiscard]] Certificate check() const { return verify::check(view()); }
  [[nodiscard]] Certificate check(const Surface& source) const { return verify::check(view(), source.view()); }
};

inline Cage cage_of(const SlabMesh& mesh) {
  const auto point = [](Vec3d p) { return Point{p.x, p.y, p.z}; };
  Cage cage;
  for (const Fibre& f : mesh.fibres()) cage.fibre(point(f.inner), point(f.outer));
  for (const relief::Slab& s : mesh.slabs()) cage.faces.push_back(s.fibres);
  return cage;
}
inline Cage snapped(const SlabMesh& mesh, int bits) {
  Cage cage = cage_of(mesh);
  cage.snap(bits);
  return cage;
}

/// Corners of a cube and its twelve triangles.
inline Surface cube(double half) {
  Surface surface;
  for (int k = 0; k < 8; ++k)
    surface.points.push_back({k & 1 ? half : -half, k & 2 ? half : -half, k & 4 ? half : -half});
  const std::array<std::array<std::uint32_t, 4>, 6> sides = {
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (const auto& s : sides) {
    surface.faces.push_back({s[0], s[1], s[2]});
    surface.faces.push_back({s[0], s[2], s[3]});
  }
  return surface;
}
/// Between two cubes; its faces are flat, so many of its triangles lie in one plane.
inline Cage cube_cage(double inner, double outer) { return {cube(inner).points, cube(outer).points, cube(1).faces}; }

}  // namespace relief::verify
