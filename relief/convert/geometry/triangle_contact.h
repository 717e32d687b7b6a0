// Where two triangles of lattice points meet, without rounding.
#pragma once

#include <relief/convert/geometry/exact_point.h>
#include <relief/convert/geometry/lattice.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace relief::detail {

/// A point in which a corner or an edge of one triangle meets the other one. Edge k runs from corner k to the next.
struct ContactPoint {
  enum Kind : std::uint8_t {
    CornerOfA,  ///< a; in B, rim included
    CornerOfB,  ///< b; in A, rim included
    EdgeOfA,    ///< a, within, crosses the plane of B in B
    EdgeOfB,    ///< b, within, crosses the plane of A in A
    Edges       ///< a and b cross within, in the plane of both triangles
  };
  Kind kind = CornerOfA;
  std::uint8_t a = 0, b = 0;
};

/// Holds what two triangles with area have in common: the convex hull of the points, of which some may coincide.
struct TriangleContact {
  bool coplanar = false;
  std::size_t count = 0;
  std::array<ContactPoint, 12> list{};

  [[nodiscard]] std::span<const ContactPoint> points() const noexcept { return std::span(list).first(count); }
};

/// Exact.
[[nodiscard]] TriangleContact find_contact(const LatticeTriangle& a, const LatticeTriangle& b) noexcept;

/// Returns whether two triangles with area have more in common than corners of both, or edges, or are the same except
/// for the order of their corners. Exact, and quick where they share corners and nothing else.
[[nodiscard]] bool meet_beyond_corners(const LatticeTriangle& a, const LatticeTriangle& b) noexcept;

/// Returns where a contact point lies.
[[nodiscard]] ExactPoint point_of(const ContactPoint& contact, const LatticeTriangle& a, const LatticeTriangle& b);

[[nodiscard]] bool has_area(const LatticeTriangle& t) noexcept;

/// Returns whether p, in the plane of the triangle, lies on its edge k, ends included. Exact.
[[nodiscard]] bool is_on_edge(const LatticeTriangle& t, std::size_t k, LatticePoint p) noexcept;

}  // namespace relief::detail
