// Signs of areas that rounding cannot turn.
#pragma once

#include <relief/base/vec.h>

#include <array>
#include <cmath>

namespace relief::detail {

struct Point2 {
  double x, y;
};

/// Sign of the area of (a, b, c), exactly: +1 counter-clockwise, 0 on one line. For finite input whose magnitudes
/// differ by less than 2^400; sums an error-free expansion [Shewchuk 1997].
[[nodiscard]] inline int exact_orientation(Point2 a, Point2 b, Point2 c) noexcept {
  double largest = 0.0;
  for (const double v : {a.x, a.y, b.x, b.y, c.x, c.y}) largest = std::max(largest, std::abs(v));
  if (largest == 0.0) return 0;
  const int shift = -std::ilogb(largest);
  for (double* v : {&a.x, &a.y, &b.x, &b.y, &c.x, &c.y}) *v = std::scalbn(*v, shift);

  std::array<double, 12> sum{};
  std::size_t count = 0;
  const auto add = [&](double term) {
    std::size_t kept = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const double s = term + sum[k];
      const double bv = s - term;
      const double error = (term - (s - bv)) + (sum[k] - bv);
      if (error != 0.0) sum[kept++] = error;
      term = s;
    }
    sum[kept++] = term;
    count = kept;
  };
  const auto add_product = [&](double p, double q) {
    const double high = p * q;
    add(std::fma(p, q, -high));
    add(high);
  };
  add_product(a.x, b.y);
  add_product(-a.x, c.y);
  add_product(-c.x, b.y);
  add_product(-a.y, b.x);
  add_product(a.y, c.x);
  add_product(c.y, b.x);
  const double top = sum[count - 1];
  return top > 0.0 ? 1 : top < 0.0 ? -1 : 0;
}

/// Returns the same sign from plain arithmetic, or 2 where rounding leaves it open.
[[nodiscard]] inline int quick_orientation(Point2 a, Point2 b, Point2 c) noexcept {
  const double left = (a.x - c.x) * (b.y - c.y);
  const double right = (a.y - c.y) * (b.x - c.x);
  const double det = left - right;
  const double margin = 4e-16 * (std::abs(left) + std::abs(right)) + 1e-290;
  return det > margin ? 1 : det < -margin ? -1 : 2;
}

[[nodiscard]] inline int orientation(Point2 a, Point2 b, Point2 c) noexcept {
  const int quick = quick_orientation(a, b, c);
  return quick != 2 ? quick : exact_orientation(a, b, c);
}

/// Returns whether three finite points span an area, exactly.
[[nodiscard]] inline bool has_area(Vec3d a, Vec3d b, Vec3d c) noexcept {
  const auto drop = [](Vec3d p, int axis) -> Point2 {
    return axis == 0 ? Point2{p.y, p.z} : axis == 1 ? Point2{p.z, p.x} : Point2{p.x, p.y};
  };
  for (int axis = 0; axis < 3; ++axis) {
    if (quick_orientation(drop(a, axis), drop(b, axis), drop(c, axis)) != 2) return true;
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (exact_orientation(drop(a, axis), drop(b, axis), drop(c, axis)) != 0) return true;
  }
  return false;
}

}  // namespace relief::detail
