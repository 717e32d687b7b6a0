// Places as people read them.
#pragma once

#include <relief/base/vec.h>

#include <algorithm>
#include <cmath>

namespace relief {

/// Returns a place with the digits that a person needs to find it: to a thousandth of `across`, the diagonal of what it
/// lies in, or of its largest coordinate where `across` is 0. To whole units at most, and without -0. Model units.
[[nodiscard]] inline Vec3d rounded_place(Vec3d p, double across) noexcept {
  if (!(across > 0)) across = std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  const double step = across / 1000;
  const double unit = step > 0 && step < 1 ? std::pow(10, std::ceil(-std::log10(step))) : 1;
  const auto kept = [unit](double x) { return std::round(x * unit) / unit + 0.0; };
  return {kept(p.x), kept(p.y), kept(p.z)};
}

/// Significant digits that a number of rounded_place() is printed with: enough for all that it keeps.
inline constexpr int kPlaceDigits = 12;

}  // namespace relief
