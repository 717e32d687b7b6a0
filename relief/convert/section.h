// Whether the source keeps clear of a slab's ends and runs through it as a section of its fibres.
#pragma once

#include <relief/convert/lattice.h>

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

/// What holds for all triangles of a block: a box, and a cone around their normals.
struct SourceBlock {
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
  Mixed     ///< a block that must be looked at triangle by triangle
};

/// A slab with the planes that bound it. All verdicts err on the safe side: they are computed in double with margins
/// far above the rounding of coordinates below 2^25, so Apart and Section are proofs.
class SlabShape {
 public:
  SlabShape() = default;
  SlabShape(const LatticeTriangle& inner, const LatticeTriangle& outer) noexcept;

  /// Section also where the piece fails only in parts of the slab that it does not enter (shell.md 8).
  [[nodiscard]] Meeting meet(const SourceTriangle& t) const noexcept;
  [[nodiscard]] Meeting meet(const SourceBlock& block) const noexcept;
  /// Whether the triangles of two sides are certainly apart, by the plane of either. Side 0 is inner, 1 outer.
  [[nodiscard]] bool surely_apart(std::size_t side, const SlabShape& other, std::size_t other_side) const noexcept;

  [[nodiscard]] const Box3d& box() const noexcept { return box_; }
  [[nodiscard]] const Box3d& box(std::size_t side) const noexcept { return side_boxes_[side]; }
  [[nodiscard]] const LatticeTriangle& triangle(std::size_t side) const noexcept { return triangles_[side]; }

 private:
  friend class QuickShape;
  [[nodiscard]] bool misses_bad_part(const SourceTriangle& t, const std::array<double, 3>& lean) const noexcept;

  std::array<LatticeTriangle, 2> triangles_;
  std::array<Vec3d, 6> ends_;  // inner, then outer
  std::array<Vec3d, 3> fibres_;
  std::array<double, 3> lengths_{};
  Box3d box_;
  std::array<Box3d, 2> side_boxes_;
  // Supporting planes of the six ends: below the inner triangle, above the outer one, two per wall.
  std::array<Vec3d, 8> normals_;
  std::array<double, 8> limits_{};
  std::array<double, 2> levels_{};  // of the inner and outer triangle's own planes
};

/// A triangle of the source in float, about an origin near it.
struct QuickTriangle {
  std::array<float, 3> a{}, b{}, c{};
  std::array<float, 3> normal{};
  float slack = 0;
  float reach = 0;  ///< greatest coordinate

  QuickTriangle() = default;
  QuickTriangle(const SourceTriangle& t, Vec3d origin) noexcept;
};

/// What SlabShape tells of a triangle, in float about an origin near the slab. Settles most triangles, for a quarter of
/// the time; its verdicts, too, are proofs.
class QuickShape {
 public:
  QuickShape(const SlabShape& shape, Vec3d origin) noexcept;

  /// Apart, Section, or Mixed: ask the shape itself.
  [[nodiscard]] Meeting meet(const QuickTriangle& t) const noexcept;

 private:
  using Four = float __attribute__((vector_size(16)));
  std::array<std::array<Four, 2>, 3> normals_;  // by axis
  std::array<Four, 2> limits_;
  std::array<float, 2> levels_;
  std::array<std::array<float, 3>, 3> fibres_;
  std::array<float, 3> lengths_;
  float reach_ = 0;
};

}  // namespace relief::detail
