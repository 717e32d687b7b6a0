#include <relief/convert/geometry/exact_point.h>

#include <cmath>

namespace relief::detail {
namespace {

constexpr int sign(Int128 v) noexcept { return v > 0 ? 1 : v < 0 ? -1 : 0; }

/// Returns the quotient of two numbers >= 0 and > 0, rounded down; below 2^63.
std::int64_t quotient(WideInt<4> of, const WideInt<4>& by, bool& is_rounded) noexcept {
  // Both are brought to where the first bit of the quotient is decided.
  WideInt<4> divisor = by;
  int bits = 0;
  while (!(of - divisor).is_negative()) {
    divisor.double_it();
    ++bits;
  }
  std::int64_t result = 0;
  for (; bits > 0; --bits) {
    of.double_it();
    result *= 2;
    if (const WideInt<4> rest = of - divisor; !rest.is_negative()) {
      of = rest;
      ++result;
    }
  }
  is_rounded = is_rounded || of.sign() != 0;
  return result;
}

using Long = Vec3<std::int64_t>;
using Wide3 = std::array<Int128, 3>;

Wide3 wide_cross(const Long& a, const Long& b) noexcept {
  return {Int128{a.y} * b.z - Int128{a.z} * b.y, Int128{a.z} * b.x - Int128{a.x} * b.z,
          Int128{a.x} * b.y - Int128{a.y} * b.x};
}

}  // namespace

LatticePlane LatticePlane::through(LatticePoint a, LatticePoint b, LatticePoint c) noexcept {
  const LatticePoint e = b - a, g = c - a;
  LatticePlane plane{cross(Long{e.x, e.y, e.z}, Long{g.x, g.y, g.z})};
  plane.offset = plane.distance(a);
  return plane;
}

LatticePlane LatticePlane::along(LatticePoint a, LatticePoint b, std::size_t axis) noexcept {
  const LatticePoint e = b - a;
  Long direction;
  direction[axis] = 1;
  LatticePlane plane{cross(Long{e.x, e.y, e.z}, direction)};
  plane.offset = plane.distance(a);
  return plane;
}

Int128 LatticePlane::distance(LatticePoint p) const noexcept {
  return Int128{normal.x} * p.x + Int128{normal.y} * p.y + Int128{normal.z} * p.z - offset;
}

ExactPoint::ExactPoint(const std::array<Number, 3>& x, const Number& w) noexcept : x_(x), w_(w) {
  if (w_.is_negative()) {
    w_ = -w_;
    for (Number& v : x_) v = -v;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    Number shifted;  // x is below 2^220
    const Number& v = x_[k];
    for (std::size_t i = 0; i < 4; ++i)
      shifted.words[i] = v.words[i] << kFraction | (i > 0 ? v.words[i - 1] >> (64 - kFraction) : 0);
    rounded_[k] = quotient(shifted, w_, is_rounded_);
  }
}

ExactPoint ExactPoint::at(LatticePoint p) noexcept {
  ExactPoint point;
  for (std::size_t k = 0; k < 3; ++k) {
    point.x_[k] = Int128{p[k]};
    point.rounded_[k] = std::int64_t{p[k]} << kFraction;
  }
  return point;
}

ExactPoint ExactPoint::between(LatticePoint p, LatticePoint q, Int128 at_p, Int128 at_q) noexcept {
  std::array<Number, 3> x;
  for (std::size_t k = 0; k < 3; ++k) x[k] = q[k] * at_p - p[k] * at_q;
  return {x, at_p - at_q};
}

ExactPoint ExactPoint::where_meet(const LatticePlane& a, const LatticePlane& b, const LatticePlane& c) noexcept {
  // Cramer: (offset_a (b x c) + offset_b (c x a) + offset_c (a x b)) / (a . (b x c)).
  const Wide3 bc = wide_cross(b.normal, c.normal), ca = wide_cross(c.normal, a.normal),
              ab = wide_cross(a.normal, b.normal);
  const auto product = [&](Int128 v, Int128 w) { return WideInt<2>(v) * WideInt<2>(w); };
  std::array<Number, 3> x;
  for (std::size_t k = 0; k < 3; ++k)
    x[k] = product(a.offset, bc[k]) + product(b.offset, ca[k]) + product(c.offset, ab[k]);
  const Number w = product(a.normal.x, bc[0]) + product(a.normal.y, bc[1]) + product(a.normal.z, bc[2]);
  return {x, w};
}

ExactPoint ExactPoint::scaled(Vec3<std::int64_t> p, unsigned bits) noexcept {
  return {{Int128{p.x}, Int128{p.y}, Int128{p.z}}, Int128{1} << bits};
}

bool ExactPoint::is_lattice() const noexcept {
  if (is_rounded_) return false;
  constexpr std::int64_t kMask = (std::int64_t{1} << kFraction) - 1;
  return ((rounded_[0] | rounded_[1] | rounded_[2]) & kMask) == 0;
}

LatticePoint ExactPoint::nearest() const noexcept {
  const auto round = [](std::int64_t v) {
    return static_cast<std::int32_t>((v + (std::int64_t{1} << (kFraction - 1))) >> kFraction);
  };
  return {round(rounded_[0]), round(rounded_[1]), round(rounded_[2])};
}

Vec3d ExactPoint::approximate() const noexcept {
  const auto value = [](std::int64_t v) { return std::ldexp(static_cast<double>(v), -int{kFraction}); };
  return {value(rounded_[0]), value(rounded_[1]), value(rounded_[2])};
}

bool operator==(const ExactPoint& a, const ExactPoint& b) noexcept {
  if (a.rounded_ != b.rounded_ || a.is_rounded_ != b.is_rounded_) return false;
  if (!a.is_rounded_) return true;
  for (std::size_t k = 0; k < 3; ++k)
    if (!(a.x_[k] * b.w_ == b.x_[k] * a.w_)) return false;
  return true;
}

int compare(const ExactPoint& a, const ExactPoint& b, std::size_t axis) noexcept {
  const std::int64_t difference = a.rounded_[axis] - b.rounded_[axis];
  if (difference != 0) return difference > 0 ? 1 : -1;
  if (!a.is_rounded_ && !b.is_rounded_) return 0;
  return (a.x_[axis] * b.w_ - b.x_[axis] * a.w_).sign();
}

int turn(const ExactPoint& a, const ExactPoint& b, const ExactPoint& c, std::size_t axis) noexcept {
  const PlaneAxes axes(axis);
  const Int128 bx = b.rounded_[axes.first] - a.rounded_[axes.first];
  const Int128 by = b.rounded_[axes.second] - a.rounded_[axes.second];
  const Int128 cx = c.rounded_[axes.first] - a.rounded_[axes.first];
  const Int128 cy = c.rounded_[axes.second] - a.rounded_[axes.second];
  const Int128 area = bx * cy - by * cx;
  if (!a.is_rounded_ && !b.is_rounded_ && !c.is_rounded_) return sign(area);
  // Each difference is off by less than one.
  const auto magnitude = [](Int128 v) { return v < 0 ? -v : v; };
  const Int128 off = magnitude(bx) + magnitude(by) + magnitude(cx) + magnitude(cy) + 2;
  if (magnitude(area) > off) return sign(area);
  const auto minor = [&](const ExactPoint& p, const ExactPoint& q) {
    return p.x_[axes.first] * q.x_[axes.second] - p.x_[axes.second] * q.x_[axes.first];
  };
  return (minor(a, b) * c.w_ + minor(b, c) * a.w_ + minor(c, a) * b.w_).sign();
}

std::size_t dominant_axis(const Vec3<std::int64_t>& n) noexcept {
  const std::int64_t x = std::abs(n.x), y = std::abs(n.y), z = std::abs(n.z);
  return x >= y && x >= z ? 0 : y >= z ? 1 : 2;
}

}  // namespace relief::detail
