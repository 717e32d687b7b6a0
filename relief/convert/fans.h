// Vertices with very many triangles around them, as the middles of discs and cones that CAD programs write.
#pragma once

#include <relief/convert/mend.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace relief::detail {

/// The triangles around a vertex that is not too much for work that compares each with each.
inline constexpr std::uint32_t kLargeFan = 256;

/// How many triangles lie around each vertex. O(faces).
[[nodiscard]] std::vector<std::uint32_t> valences_of(const ClosedSource& source);

/// Divides larger fans by rings around their vertices, each with half as many points as the one outside it and at most
/// half as wide, until kLargeFan triangles are left around the vertex. A ring is so narrow that what it leaves out lies
/// within a quarter of a lattice step of what takes its place; where it would have to be too narrow for the lattice, as
/// in a rough fan, the division ends there. New points and faces come last, the given points stay. Says how many fans
/// were divided. O(n log n).
std::size_t divide_fans(ClosedSource& source);

}  // namespace relief::detail
