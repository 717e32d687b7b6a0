// What several sentences of a conversion have in common.
#pragma once

#include <relief/base/error.h>
#include <relief/base/place.h>
#include <relief/base/vec.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string>

namespace relief::detail {

[[nodiscard]] inline std::string number(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

/// To two digits, as lengths are said: 0.043, 12, 3300.
[[nodiscard]] inline std::string rounded(double value) {
  std::array<char, 40> text{};
  const bool is_large = std::abs(value) >= 100 && std::abs(value) < 1e9;  // where %g would write an exponent
  const double unit = is_large ? std::pow(10, std::floor(std::log10(std::abs(value))) - 1) : 1;
  std::snprintf(text.data(), text.size(), is_large ? "%.0f" : "%.2g",
                is_large ? std::round(value / unit) * unit : value);
  return text.data();
}

[[nodiscard]] inline std::string place(Vec3d p) {
  std::array<char, 120> text{};
  std::snprintf(text.data(), text.size(), "(%g, %g, %g)", p.x, p.y, p.z);
  return text.data();
}

/// The same as rounded_place() has it.
[[nodiscard]] inline std::string place(Vec3d p, double across) {
  const Vec3d at = rounded_place(p, across);
  std::array<char, 120> text{};
  std::snprintf(text.data(), text.size(), "(%.*g, %.*g, %.*g)", kPlaceDigits, at.x, kPlaceDigits, at.y, kPlaceDigits,
                at.z);
  return text.data();
}

/// "7 parts".
[[nodiscard]] inline std::string counted(std::size_t count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

}  // namespace relief::detail
