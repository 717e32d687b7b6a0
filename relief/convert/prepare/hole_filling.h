// Closing the boundary loops of an open surface with patches.
#pragma once

#include <relief/base/vec.h>
#include <relief/convert/geometry/half_edges.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

/// Says how a boundary loop is closed.
struct Closing {
  enum Kind : std::uint8_t {
    Patch,      ///< as taut as a soap film: holes, cut necks and bases
    Box,        ///< walls from the loop to a level beyond the whole component, and a floor there: terrain, range maps
    OffsetCopy  ///< of the component, as far behind it as `depth` says, and walls: sheets with no room for a box
  };
  Kind kind = Patch;
  double depth = 0;

  // NOLINTNEXTLINE(google-explicit-constructor): a kind is a closing.
  constexpr Closing(Kind of, double deep = 0) noexcept : kind(of), depth(deep) {}
};

/// Returns the boundary loops of an oriented manifold with one fan per vertex: closed chains of points, by ascending
/// first point. Their order is that of a patch's edges, against the surface's own half-edges.
[[nodiscard]] std::vector<std::vector<std::uint32_t>> find_boundary_loops(std::size_t point_count,
                                                                          std::span<const Face> faces);

/// Appends the points and faces that close each loop, oriented with the surface. Triangles are about as large as the
/// loop's edges near it and larger further in. They share no edge that the surface has already. Loops of fewer than
/// three points stay open. Returns where the faces of each loop begin, and their end. O(faces), and O(k^3) for a loop
/// of k <= 100 edges; Box, OffsetCopy: O(points).
std::vector<std::size_t> fill_holes(std::vector<Vec3d>& points, std::vector<Face>& faces,
                                    std::span<const std::vector<std::uint32_t>> loops,
                                    std::span<const Closing> closings);

}  // namespace relief::detail
