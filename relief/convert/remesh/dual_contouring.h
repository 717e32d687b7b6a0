// From signs on a grid to the connectivity of the surface between them.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/remesh/hermite_grid.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

/// A closed surface of quadrilaterals, one around each crossing of the grid. A cell that several sheets pass has a
/// vertex for each (manifold dual contouring, Schaefer et al. 2007). Every edge has two quadrilaterals, and no two
/// edges have the same ends.
struct DualContour {
  using Quad = std::array<std::uint32_t, 4>;
  std::vector<Quad> quads;               ///< by crossing; counter-clockwise seen from outside
  std::vector<std::uint32_t> cell_of;    ///< by vertex
  std::vector<std::uint32_t> first;      ///< by vertex, and one more: into `crossings`
  std::vector<std::uint32_t> crossings;  ///< those of the edges of the cell that the sheet passes

  [[nodiscard]] std::span<const std::uint32_t> crossings_of(std::uint32_t vertex) const noexcept {
    return std::span(crossings).subspan(first[vertex], first[vertex + 1] - first[vertex]);
  }
};

/// Returns where two diagonal corners of a face of a cell are inside, what lies in the middle of the face decides
/// whether they hang together, unless two edges would have the same ends then. Empty when cancelled. O(cells).
[[nodiscard]] DualContour contour(const HermiteGrid& grid, const Skin& skin, const Progress& progress);

}  // namespace relief::detail
