// Points where edges and planes of lattice triangles meet, without rounding, and the predicates on them.
#pragma once

#include <relief/convert/geometry/lattice.h>
#include <relief/convert/geometry/wide_int.h>

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>

namespace relief::detail {

/// The points x with normal . x = offset. Of a triangle of lattice points the normal has 52 bits, the offset 79.
struct LatticePlane {
  Vec3<std::int64_t> normal;
  Int128 offset = 0;

  /// Of three lattice points; the normal is (b - a) x (c - a).
  [[nodiscard]] static LatticePlane through(LatticePoint a, LatticePoint b, LatticePoint c) noexcept;
  /// Of two lattice points that differ in another coordinate too, along an axis.
  [[nodiscard]] static LatticePlane along(LatticePoint a, LatticePoint b, std::size_t axis) noexcept;
  [[nodiscard]] Int128 distance(LatticePoint p) const noexcept;  ///< times the length of the normal
};

/// A rational point within the lattice's bounds in homogeneous integers, with its coordinates rounded down to 2^-36 of
/// a step. 184 bytes.
class ExactPoint {
 public:
  ExactPoint() = default;
  [[nodiscard]] static ExactPoint at(LatticePoint p) noexcept;
  /// Returns where the segment from p to q has the distance 0, which it has at neither end; the signs differ.
  [[nodiscard]] static ExactPoint between(LatticePoint p, LatticePoint q, Int128 at_p, Int128 at_q) noexcept;
  /// Of three planes whose normals are independent.
  [[nodiscard]] static ExactPoint where_meet(const LatticePlane& a, const LatticePlane& b,
                                             const LatticePlane& c) noexcept;
  /// p / 2^bits, for bits up to 20 and coordinates below 2^46.
  [[nodiscard]] static ExactPoint scaled(Vec3<std::int64_t> p, unsigned bits) noexcept;

  static constexpr unsigned kFraction = 36;  ///< bits of the rounded coordinates behind the point
  using Rounded = std::array<std::int64_t, 3>;
  [[nodiscard]] const Rounded& rounded() const noexcept { return rounded_; }
  [[nodiscard]] bool is_lattice() const noexcept;
  [[nodiscard]] LatticePoint nearest() const noexcept;  ///< of the lattice
  [[nodiscard]] Vec3d approximate() const noexcept;     ///< off by at most 2^-26 of a step

  friend bool operator==(const ExactPoint& a, const ExactPoint& b) noexcept;
  /// The sign of (a - b) along an axis. Exact.
  friend int compare(const ExactPoint& a, const ExactPoint& b, std::size_t axis) noexcept;
  /// The sign of the area of (a, b, c) seen against an axis: 1 counter-clockwise. Exact.
  friend int turn(const ExactPoint& a, const ExactPoint& b, const ExactPoint& c, std::size_t axis) noexcept;

 private:
  using Number = WideInt<4>;  // x, y, z have 184 bits at most, w 157
  ExactPoint(const std::array<Number, 3>& x, const Number& w) noexcept;

  std::array<Number, 3> x_;
  Number w_{1};  // positive
  Rounded rounded_{};
  bool is_rounded_ = false;  // down, and not the same
};

/// The axes of the plane against `axis`, so that the three are right-handed.
struct PlaneAxes {
  std::size_t first, second;
  explicit constexpr PlaneAxes(std::size_t axis) noexcept : first((axis + 1) % 3), second((axis + 2) % 3) {}
};

/// Returns the axis along which a normal is longest.
[[nodiscard]] std::size_t dominant_axis(const Vec3<std::int64_t>& normal) noexcept;

}  // namespace relief::detail
