// Sources on the lattice for tests of the outer skin, and judges by closed forms.
#pragma once

#include <relief/convert/geometry/lattice.h>
#include <relief/convert/prepare/closed_source.h>
#include <relief/convert/skin/face_arrangement.h>

#include <gtest/gtest.h>
#include <unit/convert/shapes.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>
#include <utility>

namespace relief::detail {

/// Sound parts as they are, in lattice coordinates.
inline ClosedSource source_of(const TriangleMesh& mesh) {
  ClosedSource source;
  for (const Vec3d p : mesh.positions) source.points.push_back(snap(p));
  source.faces = mesh.triangles;
  source.patch.assign(source.faces.size(), 0);
  source.phantom = source.patch;
  return source;
}

inline TriangleMesh box_at(Vec3d low, Vec3d size) {
  return ::relief::testing::scaled(::relief::testing::box(size), 1, low);
}

inline double volume(const ClosedSource& s) {
  double sum = 0;
  for (const Face& f : s.faces)
    sum += dot(to_double(s.points[f[0]]), cross(to_double(s.points[f[1]]), to_double(s.points[f[2]]))) / 6;
  return sum;
}

/// How often the faces wind around a point, by the sum of the solid angles [Van Oosterom, Strackee 1983].
inline double winding(const ClosedSource& s, Vec3d p) {
  double sum = 0;
  for (const Face& f : s.faces) {
    const Vec3d a = to_double(s.points[f[0]]) - p, b = to_double(s.points[f[1]]) - p, c = to_double(s.points[f[2]]) - p;
    const double la = length(a), lb = length(b), lc = length(c);
    sum += 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return sum / (4 * std::numbers::pi);
}

/// A source whose faces are cut along each other.
struct Arranged {
  ClosedSource source;
  FaceTree tree;
  FacePairs meetings;
  FaceArrangement made;

  explicit Arranged(const TriangleMesh& mesh)
      : source(source_of(mesh)), tree(source.points, source.faces), meetings(find_meetings(tree, {})) {
    auto all = arrange(source.points, source.faces, meetings, {});
    EXPECT_TRUE(all);
    if (all) made = std::move(*all);
  }
  [[nodiscard]] std::array<Vec3d, 3> corners(const Piece& p) const {
    return {made.approximate(p.corners[0]), made.approximate(p.corners[1]), made.approximate(p.corners[2])};
  }
  /// Twice the area, along the normal.
  [[nodiscard]] Vec3d area_of(const Piece& p) const {
    const auto [a, b, c] = corners(p);
    return cross(b - a, c - a);
  }
};

inline TriangleMesh soup(std::uint32_t seed, std::size_t count, int coarse) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> place(100, 100 + coarse), size(coarse / 20 + 1, coarse / 3 + 1);
  TriangleMesh all;
  const double unit = 1e6 / coarse;
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3d low{double(place(random)), double(place(random)), double(place(random))};
    if (k % 2 == 0) {
      ::relief::testing::append(
          all, box_at(low * unit, Vec3d{double(size(random)), double(size(random)), double(size(random))} * unit));
      continue;
    }
    TriangleMesh t = ::relief::testing::tetrahedron();
    for (Vec3d& p : t.positions)
      p = (low + Vec3d{double(size(random)), double(size(random)), double(size(random))}) * unit;
    if (volume(source_of(t)) < 0) t = ::relief::testing::turned(t);
    if (volume(source_of(t)) != 0) ::relief::testing::append(all, t);
  }
  return all;
}

}  // namespace relief::detail
