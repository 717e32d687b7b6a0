// glTF keeps vertex colours linear; everything else here is sRGB.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace relief::detail {

/// sRGB 0..1 -> linear 0..1.
[[nodiscard]] inline double decode_srgb(double s) noexcept {
  return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}
/// Linear 0..1 -> sRGB 0..1.
[[nodiscard]] inline double encode_srgb(double linear) noexcept {
  return linear <= 0.0031308 ? linear * 12.92 : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

/// sRGB 0..255 -> linear 0..65535. Sixteen bits, because eight would merge dark colours.
[[nodiscard]] inline std::uint16_t linear_from_srgb(std::uint8_t value) noexcept {
  return static_cast<std::uint16_t>(std::lround(decode_srgb(value / 255.0) * 65535.0));
}

/// Linear 0..1 -> sRGB 0..255, clamped; the inverse of linear_from_srgb for each of the 256 values.
[[nodiscard]] inline std::uint8_t srgb_from_linear(double linear) noexcept {
  if (!(linear > 0.0)) return 0;
  if (linear >= 1.0) return 255;
  return static_cast<std::uint8_t>(std::lround(encode_srgb(linear) * 255.0));
}

}  // namespace relief::detail
