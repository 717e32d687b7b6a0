// The unit of length that a model's numbers are in.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace relief {

/// Relief never scales by it; it is kept for the formats that carry a unit (3MF, glTF).
enum class Unit : std::uint8_t { Millimetre, Centimetre, Metre };

[[nodiscard]] constexpr double metres(Unit unit) noexcept {
  return unit == Unit::Millimetre ? 1e-3 : unit == Unit::Centimetre ? 1e-2 : 1.0;
}
/// "mm", "cm" or "m".
[[nodiscard]] constexpr std::string_view name(Unit unit) noexcept {
  return unit == Unit::Millimetre ? "mm" : unit == Unit::Centimetre ? "cm" : "m";
}
[[nodiscard]] constexpr std::optional<Unit> unit_from_name(std::string_view text) noexcept {
  for (const Unit unit : {Unit::Millimetre, Unit::Centimetre, Unit::Metre})
    if (text == name(unit)) return unit;
  return std::nullopt;
}

}  // namespace relief
