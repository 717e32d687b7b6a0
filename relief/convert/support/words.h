// What several sentences of a conversion have in common.
#pragma once

#include <relief/base/error.h>
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

/// The same to a thousandth of what it lies in, whose diagonal is `across`: enough to find it by. All in model units.
[[nodiscard]] inline std::string place(Vec3d p, double across) {
  const double step = across / 1000;
  const int digits = step > 0 && step < 1 ? static_cast<int>(std::ceil(-std::log10(step))) : 0;
  const double unit = std::pow(10, digits);
  const auto kept = [unit](double x) { return std::round(x * unit) / unit + 0.0; };  // no -0
  std::array<char, 120> text{};
  std::snprintf(text.data(), text.size(), "(%.12g, %.12g, %.12g)", kept(p.x), kept(p.y), kept(p.z));
  return text.data();
}

/// "7 parts".
[[nodiscard]] inline std::string counted(std::size_t count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

}  // namespace relief::detail
