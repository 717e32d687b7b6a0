// The integer lattice on which all fibre ends lie, and the exact predicates on it.
#pragma once

#include <relief/base/lanes.h>
#include <relief/base/vec.h>

#include <algorithm>
#include <array>
#include <cstdint>

namespace relief::detail {

using LatticePoint = Vec3<std::int32_t>;

/// A uniform lattice whose step is a power of two and whose origin is a multiple of the step, so that every lattice
/// point is a double without rounding. Coordinates of the shell lie in [0, 2^25].
struct Lattice {
  Vec3d origin;
  double step = 1;

  static constexpr int kBits = 25;
  static constexpr double kSpan = 33554432.0;  ///< 2^25

  /// Returns the finest lattice that holds the box widened by `room` on every side, but not finer than the box's own
  /// doubles.
  [[nodiscard]] static Lattice around(const Box3d& box, double room) noexcept;

  [[nodiscard]] Vec3d to_lattice(Vec3d p) const noexcept { return (p - origin) * (1 / step); }
  [[nodiscard]] Vec3d to_model(LatticePoint p) const noexcept {
    return origin + Vec3d{double(p.x), double(p.y), double(p.z)} * step;
  }
};

/// Returns the nearest lattice point, kept within [0, 2^25].
[[nodiscard]] LatticePoint snap(Vec3d lattice_coordinates) noexcept;
[[nodiscard]] constexpr Vec3d to_double(LatticePoint p) noexcept { return {double(p.x), double(p.y), double(p.z)}; }

/// Returns the sign of the volume of (a, b, c, d): 1 when d lies on the side from which a, b, c run counter-clockwise.
/// Exact.
[[nodiscard]] int orientation(LatticePoint a, LatticePoint b, LatticePoint c, LatticePoint d) noexcept;

/// Returns the sign of the determinant of three differences of lattice points. Exact.
[[nodiscard]] int determinant_sign(LatticePoint a, LatticePoint b, LatticePoint c) noexcept;

using LatticeTriangle = std::array<LatticePoint, 3>;

/// Ten bits of each coordinate interleaved (Morton order): neighbours in space have codes that are close, as a rule.
[[nodiscard]] constexpr std::uint32_t morton_code(LatticePoint p) noexcept {
  const auto spread = [](std::uint32_t v) {
    v = (v | (v << 16U)) & 0x030000ffU;
    v = (v | (v << 8U)) & 0x0300f00fU;
    v = (v | (v << 4U)) & 0x030c30c3U;
    return (v | (v << 2U)) & 0x09249249U;
  };
  const auto top = [](std::int32_t v) { return std::min(static_cast<std::uint32_t>(v) >> 15U, 1023U); };
  return spread(top(p.x)) | (spread(top(p.y)) << 1U) | (spread(top(p.z)) << 2U);
}

/// The box around lattice points; at first around the origin. Exact.
struct LatticeBox {
  FourInts low{}, high{};  ///< by axis; the fourth is 0

  LatticeBox() = default;
  explicit LatticeBox(const LatticeTriangle& t) noexcept {
    const FourInts a = lanes(t[0]), b = lanes(t[1]), c = lanes(t[2]);
    low = least(least(a, b), c);
    high = greatest(greatest(a, b), c);
  }
  void add(const LatticeBox& b) noexcept {
    low = least(low, b.low);
    high = greatest(high, b.high);
  }
  [[nodiscard]] bool meets(const LatticeBox& b) const noexcept {
    return bits_of((low <= b.high) & (high >= b.low)) == 15;
  }
  [[nodiscard]] bool holds(LatticePoint p) const noexcept {
    return bits_of((low <= lanes(p)) & (high >= lanes(p))) == 15;
  }

 private:
  [[nodiscard]] static FourInts lanes(LatticePoint p) noexcept { return FourInts{p.x, p.y, p.z, 0}; }
};

/// Returns whether two closed triangles have a point in common, touching and coplanar ones included. Exact.
[[nodiscard]] bool triangles_meet(const LatticeTriangle& a, const LatticeTriangle& b) noexcept;

/// What is wrong with the Jacobian of a slab.
enum class JacobianFault : std::uint8_t { None, Inner, Outer, Between };

/// Returns whether the Jacobian is positive in the whole closed slab; names the place where it is not. Closed form,
/// exact.
[[nodiscard]] JacobianFault jacobian_fault(const LatticeTriangle& inner, const LatticeTriangle& outer) noexcept;

/// Returns whether p lies in the convex hull of the slab's six corners, rim included. Exact.
[[nodiscard]] bool in_hull(const LatticeTriangle& inner, const LatticeTriangle& outer, LatticePoint p) noexcept;

}  // namespace relief::detail
