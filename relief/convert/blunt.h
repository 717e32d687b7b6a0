// Tips that no fibre can pass through, cut off.
#pragma once

#include <relief/convert/mend.h>

#include <cstddef>
#include <cstdint>
#include <span>

namespace relief::detail {

/// Cuts the tips off at some vertices, as far along each edge as `width` lattice steps, and closes what that opens with
/// patches; less far where an edge is less than four times as long. Where edges are too short for the lattice, the tip
/// stays. The cuts of the faces around lie on these to within the rounding of the lattice. New points and faces come
/// last, the given ones stay. Says how many vertices were cut off. O(n log n).
std::size_t cut_tips(ClosedSource& source, std::span<const std::uint32_t> vertices, double width);

}  // namespace relief::detail
