// Parts of a mesh that close nothing off.
#pragma once

#include <relief/base/vec.h>
#include <relief/convert/geometry/components.h>
#include <relief/convert/remesh/source_skin.h>

#include <cstdint>
#include <vector>

namespace relief::detail {

/// Returns which parts are sheets, by part: just behind them, the whole skin winds around little more than half.
/// O(parts).
[[nodiscard]] std::vector<std::uint8_t> find_sheets(const Skin& skin, const Components& parts);

/// Gives the sheets of a mesh two sides, each a voxel away from it, and walls between them along their boundary loops.
/// Where they are bent more tightly, the sides cross.
void thicken_sheets(std::vector<Vec3d>& points, std::vector<Triangle>& triangles, const Components& parts,
                    const std::vector<std::uint8_t>& is_sheet);

}  // namespace relief::detail
