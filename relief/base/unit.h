// The unit of length that a model's numbers are in.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace relief {

/// Relief never scales by it; it is kept for the formats that carry a unit (3MF, glTF).
enum class Unit : std::uint8_t { Millimetre, Centimetre, Metre, Inch };

[[nodiscard]] constexpr double metres(Unit unit) noexcept {
  switch (unit) {
    case Unit::Millimetre:
      return 1e-3;
    case Unit::Centimetre:
      return 1e-2;
    case Unit::Metre:
      return 1;
    case Unit::Inch:
      return 0.0254;
  }
  return 1e-3;
}
/// "mm", "cm", "m" or "in".
[[nodiscard]] constexpr std::string_view name(Unit unit) noexcept {
  switch (unit) {
    case Unit::Millimetre:
      return "mm";
    case Unit::Centimetre:
      return "cm";
    case Unit::Metre:
      return "m";
    case Unit::Inch:
      return "in";
  }
  return "mm";
}
[[nodiscard]] constexpr std::optional<Unit> unit_from_name(std::string_view text) noexcept {
  for (const Unit unit : {Unit::Millimetre, Unit::Centimetre, Unit::Metre, Unit::Inch})
    if (text == name(unit)) return unit;
  return std::nullopt;
}

}  // namespace relief
