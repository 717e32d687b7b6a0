// The source that a shell stands on: a closed oriented manifold on the lattice.
#pragma once

#include <relief/convert/geometry/half_edges.h>
#include <relief/convert/geometry/lattice.h>

#include <cstdint>
#include <tuple>
#include <vector>

namespace relief::detail {

/// A closed oriented manifold on the lattice.
struct ClosedSource {
  std::vector<LatticePoint> points;
  std::vector<Face> faces;
  std::vector<std::uint8_t> patch;    ///< per face: not scanned, but made to close a rim
  std::vector<std::uint8_t> phantom;  ///< per face: closes an opening of what was scanned
};
[[nodiscard]] inline auto arrays_of(ClosedSource& source) noexcept {
  return std::tie(source.points, source.faces, source.patch, source.phantom);
}

}  // namespace relief::detail
