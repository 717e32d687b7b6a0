// Points, vectors, boxes and rays: plain values, no allocation, no dependency.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

namespace relief {

template <typename T>
/// A vector or point of three coordinates.
struct Vec3 {
  /// the coordinates
  T x{}, y{}, z{};

  /// Coordinate k: 0 is x, 1 is y, 2 is z.
  constexpr T& operator[](std::size_t k) noexcept { return k == 0 ? x : k == 1 ? y : z; }
  /// Coordinate k: 0 is x, 1 is y, 2 is z.
  constexpr const T& operator[](std::size_t k) const noexcept { return k == 0 ? x : k == 1 ? y : z; }

  /// Adds b.
  constexpr Vec3& operator+=(Vec3 b) noexcept { return *this = *this + b; }
  /// Subtracts b.
  constexpr Vec3& operator-=(Vec3 b) noexcept { return *this = *this - b; }
  /// Multiplies by s.
  constexpr Vec3& operator*=(T s) noexcept { return *this = *this * s; }

  friend constexpr Vec3 operator+(Vec3 a, Vec3 b) noexcept { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Vec3 operator-(Vec3 a, Vec3 b) noexcept { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Vec3 operator-(Vec3 a) noexcept { return {-a.x, -a.y, -a.z}; }
  friend constexpr Vec3 operator*(Vec3 a, T s) noexcept { return {a.x * s, a.y * s, a.z * s}; }
  friend constexpr Vec3 operator*(T s, Vec3 a) noexcept { return a * s; }
  friend constexpr Vec3 operator/(Vec3 a, T s) noexcept { return {a.x / s, a.y / s, a.z / s}; }
  friend constexpr bool operator==(Vec3 a, Vec3 b) noexcept = default;
};

using Vec3d = Vec3<double>;
using Vec3f = Vec3<float>;

template <typename T>
[[nodiscard]] constexpr T dot(Vec3<T> a, Vec3<T> b) noexcept {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <typename T>
[[nodiscard]] constexpr Vec3<T> cross(Vec3<T> a, Vec3<T> b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <typename T>
[[nodiscard]] T length(Vec3<T> a) noexcept {
  return std::sqrt(dot(a, a));
}
/// Returns the unit vector along a; a itself where it has no direction (zero, infinite, not a number).
template <typename T>
[[nodiscard]] Vec3<T> normalized(Vec3<T> a) noexcept {
  const T l = length(a);
  return l > T(0) && std::isfinite(l) ? a / l : a;
}
template <typename T>
[[nodiscard]] bool is_finite(Vec3<T> a) noexcept {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}
/// n turned towards `wanted` by at most so many radians; both unit.
[[nodiscard]] inline Vec3d turned_by(Vec3d n, Vec3d wanted, double most) noexcept {
  // A chord is shorter than its arc.
  if (dot(n - wanted, n - wanted) <= 0.9 * most * most) return wanted;
  const double angle = std::atan2(length(cross(n, wanted)), dot(n, wanted));
  if (!(angle > most)) return wanted;
  const Vec3d aside = wanted - n * dot(n, wanted);
  if (!(dot(aside, aside) > 1e-24)) return n;
  return normalized(n * std::cos(most) + normalized(aside) * std::sin(most));
}
[[nodiscard]] constexpr Vec3f to_float(Vec3d a) noexcept {
  return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)};
}
[[nodiscard]] constexpr Vec3d to_double(Vec3f a) noexcept {
  return {static_cast<double>(a.x), static_cast<double>(a.y), static_cast<double>(a.z)};
}

/// A rotation: the quaternion w + xi + yj + zk of unit length, right-handed.
struct Quatd {
  /// the real part w and the vector part; a unit quaternion is a rotation
  double w = 1, x = 0, y = 0, z = 0;

  /// v, turned.
  [[nodiscard]] constexpr Vec3d turn(Vec3d v) const noexcept {
    const Vec3d axis = {x, y, z}, twice = 2 * cross(axis, v);
    return v + w * twice + cross(axis, twice);
  }
  /// Returns the rotation back.
  [[nodiscard]] constexpr Quatd conjugate() const noexcept { return {w, -x, -y, -z}; }
  /// b first, then a.
  friend constexpr Quatd operator*(Quatd a, Quatd b) noexcept {
    return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
  }
  friend constexpr bool operator==(Quatd, Quatd) noexcept = default;
};
[[nodiscard]] constexpr double dot(Quatd a, Quatd b) noexcept { return a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z; }
/// q at unit length; none where it is shorter than 1e-6 or not finite, and is taken for no rotation.
[[nodiscard]] inline std::optional<Quatd> unit(Quatd q) noexcept {
  const double size = std::sqrt(dot(q, q));
  if (!(size >= 1e-6 && std::isfinite(size))) return std::nullopt;
  return Quatd{q.w / size, q.x / size, q.y / size, q.z / size};
}

/// Axis-aligned box; empty until something is added.
struct Box3d {
  Vec3d low = {kFar, kFar, kFar};      ///< least corner
  Vec3d high = {-kFar, -kFar, -kFar};  ///< greatest corner

  static constexpr double kFar = std::numeric_limits<double>::infinity();  ///< what an empty box begins with

  /// Grows until p lies inside.
  constexpr void add(Vec3d p) noexcept {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  /// An empty box adds nothing.
  constexpr void add(const Box3d& b) noexcept {
    low = {std::min(low.x, b.low.x), std::min(low.y, b.low.y), std::min(low.z, b.low.z)};
    high = {std::max(high.x, b.high.x), std::max(high.y, b.high.y), std::max(high.z, b.high.z)};
  }
  /// Returns whether it holds no point.
  [[nodiscard]] constexpr bool empty() const noexcept { return low.x > high.x; }
  /// Returns whether p lies in it, its border included.
  [[nodiscard]] constexpr bool contains(Vec3d p) const noexcept {
    return p.x >= low.x && p.x <= high.x && p.y >= low.y && p.y <= high.y && p.z >= low.z && p.z <= high.z;
  }
  /// Returns whether the two have a point in common.
  [[nodiscard]] constexpr bool meets(const Box3d& b) const noexcept {
    return low.x <= b.high.x && high.x >= b.low.x && low.y <= b.high.y && high.y >= b.low.y && low.z <= b.high.z &&
           high.z >= b.low.z;
  }
  /// Returns the middle.
  [[nodiscard]] constexpr Vec3d centre() const noexcept { return (low + high) * 0.5; }
  /// Returns its edges.
  [[nodiscard]] constexpr Vec3d extent() const noexcept { return high - low; }
  /// Squared distance from p, 0 inside.
  [[nodiscard]] constexpr double distance2(Vec3d p) const noexcept {
    const auto gap = [](double lo, double hi, double v) { return v < lo ? lo - v : v > hi ? v - hi : 0.0; };
    const Vec3d d = {gap(low.x, high.x, p.x), gap(low.y, high.y, p.y), gap(low.z, high.z, p.z)};
    return dot(d, d);
  }
};

/// Returns the length of the box's diagonal; 0 for an empty box.
[[nodiscard]] inline double diagonal(const Box3d& b) noexcept { return b.empty() ? 0.0 : length(b.extent()); }

/// Half line; the direction need not have unit length, distances along it are in its lengths.
struct Ray3d {
  Vec3d origin;     ///< where it begins
  Vec3d direction;  ///< where it goes; need not be a unit vector
};

/// 8-bit colour as files hold it, sRGB.
struct Rgba8 {
  /// red, green, blue and opacity, sRGB, 0 to 255
  std::uint8_t r = 255, g = 255, b = 255, a = 255;
  friend constexpr bool operator==(Rgba8, Rgba8) noexcept = default;
};

}  // namespace relief
