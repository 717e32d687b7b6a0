// Tips that no fibre can pass through, cut off.
#pragma once

#include <relief/convert/prepare/closed_source.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace relief::detail {

/// Cuts the tips off some vertices, `width` lattice steps along each edge or a quarter of a shorter edge, and closes
/// the cuts with patches. Where edges are too short for the lattice, the tip stays. Cuts lie on the faces around to
/// within the lattice's rounding. New points and faces come last. Returns how many vertices were cut. O(n log n).
std::size_t truncate_spikes(ClosedSource& source, std::span<const std::uint32_t> vertices, double width);

}  // namespace relief::detail
