// Vertices with very many triangles around them, as the middles of discs and cones that CAD programs write.
#pragma once

#include <relief/convert/prepare/closed_source.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace relief::detail {

/// Most triangles around a vertex: work that compares each with each stays affordable up to here.
inline constexpr std::uint32_t kHighValence = 256;

/// Returns how many triangles lie around each vertex. O(faces).
[[nodiscard]] std::vector<std::uint32_t> valences_of(const ClosedSource& source);

/// Divides large fans by rings around their vertices until kHighValence triangles are left. Each ring has half the
/// points and at most half the width of the one outside it, and stays within a quarter of a lattice step of what it
/// replaces. New points and faces come last. Returns how many fans were divided. O(n log n).
std::size_t split_high_valence(ClosedSource& source);

}  // namespace relief::detail
