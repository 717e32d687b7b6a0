// All pairs of boxes that meet.
#pragma once

#include <relief/base/vec.h>

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace relief::detail {

/// The pairs (a, b), a < b, of boxes that meet, by ascending a and then b. O(n log n + pairs).
[[nodiscard]] std::vector<std::pair<std::uint32_t, std::uint32_t>> meeting_boxes(std::span<const Box3d> boxes);

}  // namespace relief::detail
