// Light by the direction that a surface faces: the sculpting materials as tables.
#pragma once

#include <relief/base/vec.h>

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace relief::detail {

/// Texels along the edge of a table: neighbours differ by less than a step of 8 bits but in a highlight.
inline constexpr int kMatcapEdge = 512;

[[nodiscard]] std::span<const std::string_view> matcap_names() noexcept;

/// Holds what a material gives back, by the x and y of a unit normal in view space, -1 to 1 from corner to corner; rows
/// from below. Beyond the unit circle as on it.
struct MatcapTables {
  std::vector<std::uint32_t> finished;  ///< RGBA, sRGB: the material in its own colour
  std::vector<std::uint32_t> light;     ///< rgb: root of a quarter of the light it receives; a: root of the highlight
};
/// `base` is sRGB: the colour of material 0; the others have their own.
[[nodiscard]] MatcapTables make_matcap(std::size_t material, Vec3f base);

}  // namespace relief::detail
