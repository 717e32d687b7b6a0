// Closing the rims of an open surface with patches.
#pragma once

#include <relief/convert/decimate.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

/// How a rim is closed.
struct Closing {
  enum Kind : std::uint8_t {
    Membrane,  ///< a patch as taut as a soap film: holes, cut necks and bases
    Box,       ///< walls from the rim to a level beyond the whole part, and a floor there: terrain and range maps
    Back       ///< the part once more, as far behind it as `depth` says, and walls: sheets with no room for a box
  };
  Kind kind = Membrane;
  double depth = 0;

  // NOLINTNEXTLINE(google-explicit-constructor): a kind is a closing.
  constexpr Closing(Kind of, double deep = 0) noexcept : kind(of), depth(deep) {}
};

/// The rims of an oriented manifold surface with one fan per vertex: closed chains of points in the order in which a
/// patch runs along them (against the surface's own half-edges), by ascending first point.
[[nodiscard]] std::vector<std::vector<std::uint32_t>> find_rims(std::size_t point_count, std::span<const Face> faces);

/// Appends a patch for each rim to points and faces, with triangles about as large as the rim's edges near it and
/// larger ones further in. Patches have new points of their own only, no edge that the surface has already, and are
/// oriented with it. A back has what closes the part's rims before it, too. Rims of fewer than three points stay open.
/// Gives where each patch's faces begin, and their end. Deterministic. O(faces), and O(k^3) for a rim of k <= 100
/// edges, O(k) more beyond; Box, Back: O(points) each.
std::vector<std::size_t> close_rims(std::vector<Vec3d>& points, std::vector<Face>& faces,
                                    std::span<const std::vector<std::uint32_t>> rims,
                                    std::span<const Closing> closings);

}  // namespace relief::detail
