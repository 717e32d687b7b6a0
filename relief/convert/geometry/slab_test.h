// Whether the source keeps clear of a slab's ends and runs through it as a section of its fibres.
#pragma once

#include <relief/base/lanes.h>
#include <relief/convert/geometry/lattice.h>

#include <algorithm>
#include <array>
#include <cstdint>

namespace relief::detail {

/// How far, in lattice steps, the source keeps from the ends, and what is as good as inside a slab.
inline constexpr double kClearance = 2;

/// A triangle of the source in lattice coordinates, with its unit normal. Fibres must lean towards the normal by more
/// than `slack`, a sine: it covers the rounding of the normal and a move of the corners by kClearance.
struct SourceTriangle {
  Vec3d a, b, c;
  Vec3d normal;
  double slack = 0;
};

/// Holds what holds for all triangles of a cluster: a box, and a cone around their normals.
struct SourceCluster {
  Vec3d centre, half;
  Vec3d axis;
  double cosine = -1;  ///< of the cone's half angle
  double slack = 0;    ///< the greatest
};

/// Where a slab and a piece of the source stand to each other.
enum class Meeting : std::uint8_t {
  Apart,    ///< the piece lies outside the slab
  Section,  ///< in the slab, clear of both ends, crossed by all its fibres from the back to the front (C5, C6)
  Inner,    ///< not certainly clear of the inner triangle
  Outer,    ///< not certainly clear of the outer triangle
  Folded,   ///< a fibre of the slab may run along the piece or back through it
  Within,   ///< a cluster in the slab and clear of both ends, whose triangles fibres may not all cross
  Mixed     ///< a cluster that must be looked at triangle by triangle
};

/// A slab with the planes that bound it. All verdicts err on the safe side: they are computed in double with margins
/// far above the rounding of coordinates below 2^25, so Apart and Section are proofs.
class SlabShape {
 public:
  SlabShape() = default;
  SlabShape(const LatticeTriangle& inner, const LatticeTriangle& outer) noexcept;

  /// Returns Section also where the piece fails only in parts of the slab that it does not enter
  /// (docs/explanation/conversion.md, the slab test).
  [[nodiscard]] Meeting meet(const SourceTriangle& t) const noexcept;
  [[nodiscard]] Meeting meet(const SourceCluster& cluster) const noexcept;
  /// Returns whether meet() says Apart.
  [[nodiscard]] bool is_apart(const SourceTriangle& t) const noexcept;
  /// Returns whether an end of a fibre of the other may lie in it.
  [[nodiscard]] bool holds_end_of(const SlabShape& other) const noexcept;
  /// Returns whether the triangles of two sides are certainly apart, by the plane of either. Side 0 is inner, 1 outer.
  [[nodiscard]] bool surely_apart(std::size_t side, const SlabShape& other, std::size_t other_side) const noexcept;
  /// Returns the same of one side and any triangle, by the plane of this side alone.
  [[nodiscard]] bool surely_apart(std::size_t side, const LatticeTriangle& other) const noexcept {
    const Vec3d n = plane(side);
    const double level = levels_[side];
    const double a = dot(n, to_double(other[0])) - level, b = dot(n, to_double(other[1])) - level,
                 c = dot(n, to_double(other[2])) - level;
    return std::min({a, b, c}) > kSurelyBeyond || std::max({a, b, c}) < -kSurelyBeyond;
  }

  [[nodiscard]] const Box3d& box() const noexcept { return box_; }
  /// Of the triangle half way along the fibres.
  [[nodiscard]] double middle_area() const noexcept;
  [[nodiscard]] const Box3d& box(std::size_t side) const noexcept { return side_boxes_[side]; }
  [[nodiscard]] const LatticeTriangle& triangle(std::size_t side) const noexcept { return triangles_[side]; }

 private:
  friend class QuickShape;
  /// Lattice steps over a plane from which a lattice point is surely beyond it: doubles below 2^25 are off by 1e-6.
  static constexpr double kSurelyBeyond = 0.01;
  [[nodiscard]] bool misses_box(const SourceTriangle& t) const noexcept {
    for (std::size_t k = 0; k < 3; ++k)
      if (std::min({t.a[k], t.b[k], t.c[k]}) > box_.high[k] + kClearance ||
          std::max({t.a[k], t.b[k], t.c[k]}) < box_.low[k] - kClearance)
        return true;
    return false;
  }
  [[nodiscard]] bool misses_bad_part(const SourceTriangle& t, const std::array<double, 3>& lean) const noexcept;

  std::array<LatticeTriangle, 2> triangles_;
  std::array<Vec3d, 6> ends_;  // inner, then outer
  std::array<Vec3d, 3> fibres_;
  std::array<double, 3> lengths_{};
  Box3d box_;
  std::array<Box3d, 2> side_boxes_;
  // Supporting planes of the six ends: below the inner triangle, above the outer one, two per wall.
  static constexpr std::size_t kPlanes = 8;
  [[nodiscard]] Vec3d plane(std::size_t k) const noexcept { return {normals_[0][k], normals_[1][k], normals_[2][k]}; }
  std::array<std::array<double, kPlanes>, 3> normals_;  // by axis
  std::array<double, kPlanes> limits_{};
  std::array<double, 2> levels_{};  // of the inner and outer triangle's own planes
};

/// Four pieces of the source side by side, in float about an origin near them.
struct FourTriangles {
  std::array<std::array<Lanes, 3>, 3> corners;  ///< by corner, by axis
  std::array<Lanes, 3> normals;
  std::array<Lanes, 3> low, high;  ///< of their boxes
  Lanes slack, reach;              ///< reach: greatest coordinate
  unsigned clusters = 0;           ///< a bit for each that is a cluster, of which there is only the box

  /// The first `count` of them; the others lie nowhere. `normals_and_slacks` as in SourceIndex.
  void set(const std::array<LatticeTriangle, 4>& triangles,
           const std::array<std::array<float, 4>, 4>& normals_and_slacks, std::size_t count,
           LatticePoint origin) noexcept;
  /// Puts a cluster in the place of one: only its box.
  void set(std::size_t k, const SourceCluster& cluster, LatticePoint origin) noexcept;
};

/// Holds what SlabShape tells of triangles, in float about an origin near the slab. Settles most of them at a fraction
/// of the time; its verdicts, too, are proofs.
class QuickShape {
 public:
  QuickShape(const SlabShape& shape, LatticePoint origin) noexcept;

  /// A bit per triangle.
  struct Verdict {
    unsigned near = 0;     ///< not certainly apart
    unsigned section = 0;  ///< of these, crossed by all fibres; otherwise ask the shape itself
  };
  [[nodiscard]] unsigned near(const FourTriangles& t) const noexcept;  ///< by the boxes around both alone
  /// Returns which of the boxes around them are not certainly apart from the slab.
  [[nodiscard]] unsigned near_boxes(const FourTriangles& t) const noexcept;
  /// Clusters are judged as their boxes.
  [[nodiscard]] Verdict meet(const FourTriangles& t) const noexcept;
  /// Returns which of them all fibres cross, of those that lie in the slab and clear of its ends.
  [[nodiscard]] unsigned crossed(const FourTriangles& t) const noexcept;

 private:
  std::array<std::array<float, SlabShape::kPlanes>, 3> normals_;  // by axis
  std::array<float, SlabShape::kPlanes> limits_;
  std::array<float, 2> levels_;
  std::array<std::array<float, 3>, 3> fibres_;
  std::array<float, 3> lengths_, low_, high_;
  float reach_ = 0;

  /// Returns how far beyond a plane floats must lie to be surely beyond it, clearance included: a height over a plane
  /// takes about ten roundings of 2^-24 of sums below three times the reach.
  [[nodiscard]] Four margin_for(Four reach) const noexcept {
    return static_cast<float>(kClearance) + 0x1p-18F * (reach + reach_);
  }
};

}  // namespace relief::detail
