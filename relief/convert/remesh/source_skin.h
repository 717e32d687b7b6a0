// The triangles that a solid is made of again, in voxels, and what is asked of them.
#pragma once

#include <relief/base/vec.h>
#include <relief/convert/geometry/lattice.h>
#include <relief/convert/geometry/winding_number.h>
#include <relief/convert/sample/source_rays.h>
#include <relief/mesh/triangle_mesh.h>

#include <cstdint>
#include <vector>

namespace relief::detail {

/// A triangle soup in voxel coordinates; inside is where it winds around more than half. All queries may run on many
/// threads at once.
class Skin {
 public:
  /// Throws std::bad_alloc.
  Skin(std::vector<Vec3d> points, std::vector<Triangle> triangles);
  Skin(const Skin&) = delete;
  Skin& operator=(const Skin&) = delete;

  [[nodiscard]] const std::vector<Vec3d>& points() const noexcept { return points_; }
  [[nodiscard]] const std::vector<Triangle>& triangles() const noexcept { return triangles_; }
  /// Every edge has a triangle on its other side: the winding number changes at triangles alone.
  [[nodiscard]] bool is_closed() const noexcept { return is_closed_; }

  [[nodiscard]] double winding(Vec3d p) const noexcept { return winding_.at(p); }
  [[nodiscard]] bool is_inside(Vec3d p) const noexcept { return winding(p) > WindingNumber::kInside; }
  /// Returns whether a place of the skin parts inside from outside, `outwards` being a unit direction off the solid;
  /// skin that lies within the solid does not.
  [[nodiscard]] bool is_outer(Vec3d at, Vec3d outwards) const noexcept;
  /// Returns whether the winding number on either side of a place of the skin differs from one half by more than its
  /// own error.
  [[nodiscard]] bool is_decided(Vec3d at, Vec3d outwards) const noexcept;

  /// Returns the unit normal of a triangle.
  [[nodiscard]] Vec3d normal(std::uint32_t triangle) const noexcept;
  /// Returns its area in square voxels.
  [[nodiscard]] double area(std::uint32_t triangle) const noexcept;
  struct Place {
    Vec3d at;
    Vec3d normal;         ///< unit, of the triangle
    double distance = 0;  ///< voxels
    std::uint32_t triangle = 0;
  };
  /// Returns the place of the skin nearest to p; about a microsecond.
  [[nodiscard]] Place nearest(Vec3d p) const;
  [[nodiscard]] Place nearest_of(std::uint32_t triangle, Vec3d p) const noexcept;
  /// Returns how far the line from p goes until it leaves through the front of a triangle, at most `reach` voxels.
  [[nodiscard]] double way_out(Vec3d p, Vec3d direction, double reach) const;

 private:
  std::vector<Vec3d> points_;
  std::vector<Triangle> triangles_;
  Lattice lattice_;
  WindingNumber winding_;
  SourceRays surface_;
  bool is_closed_;
};

}  // namespace relief::detail
