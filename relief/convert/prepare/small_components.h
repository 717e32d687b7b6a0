// Connected components that are too small to have slabs of their own.
#pragma once

#include <relief/base/vec.h>
#include <relief/convert/geometry/components.h>
#include <relief/mesh/triangle_mesh.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

/// The fewest slabs that a closed surface takes: a tetrahedron's.
inline constexpr std::size_t kLeastSlabs = 4;

/// Leaves the components of the least area out when kLeastSlabs slabs for each are more than `most`; one always stays.
/// Says how many went. O(n log n).
std::size_t drop_small_components(const std::vector<Vec3d>& points, std::vector<Face>& faces, std::size_t most);

/// Returns the positions and the triangles of a mesh without some of its components: those whose number `gone` has,
/// ascending.
[[nodiscard]] TriangleMesh without_components(const TriangleMesh& mesh, const Components& components,
                                              std::span<const std::uint32_t> gone);

}  // namespace relief::detail
