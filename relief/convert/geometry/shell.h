// A finished shell on the lattice.
#pragma once

#include <relief/convert/geometry/half_edges.h>
#include <relief/convert/geometry/lattice.h>

#include <array>
#include <cstddef>
#include <vector>

namespace relief::detail {

/// Which end of a fibre, or which of a slab's two triangles.
using Side = std::size_t;
inline constexpr Side kInner = 0, kOuter = 1;

using Ends = std::array<LatticePoint, 2>;  ///< of a fibre, by Side

/// Slabs as triangles of fibres, which satisfy C0 to C4 (docs/explanation/conversion.md).
struct Shell {
  std::array<std::vector<LatticePoint>, 2> ends;  ///< by Side, per fibre
  std::vector<Face> faces;
};

}  // namespace relief::detail
