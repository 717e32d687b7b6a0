// Connected components.
#pragma once

#include <relief/convert/geometry/half_edges.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

/// Per face the number of its connected component (components joined by a vertex count as one), in the order of their
/// first faces, and how many there are. Faces whose corners are no points are gone; their number is 0.
struct Components {
  std::vector<std::uint32_t> of_face;
  std::uint32_t count = 0;
};
[[nodiscard]] Components find_components(std::size_t point_count, std::span<const Face> faces);

}  // namespace relief::detail
