// Four floats, or whole numbers, side by side.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

/// Before a loop in which no two arrays overlap: the compiler need not ask.
#if defined(__clang__)
#define RELIEF_VECTORS _Pragma("clang loop vectorize(assume_safety)")
#else
#define RELIEF_VECTORS _Pragma("GCC ivdep")
#endif

namespace relief::detail {

using Four = float __attribute__((vector_size(16)));
using FourMask = decltype(Four{} < Four{});
using FourInts = std::int32_t __attribute__((vector_size(16)));

/// Four floats, written one by one and computed with together.
struct Lanes {
  std::array<float, 4> of{};
  [[nodiscard]] Four all() const noexcept { return std::bit_cast<Four>(of); }
};

/// Returns a bit per lane of what a comparison gave.
[[nodiscard]] inline unsigned bits_of(FourMask mask) noexcept {
#if defined(__SSE2__)
  return static_cast<unsigned>(__builtin_ia32_movmskps(std::bit_cast<Four>(mask)));
#else
  return (static_cast<unsigned>(mask[0]) & 1U) | (static_cast<unsigned>(mask[1]) & 2U) |
         (static_cast<unsigned>(mask[2]) & 4U) | (static_cast<unsigned>(mask[3]) & 8U);
#endif
}

/// Returns the square roots.
[[nodiscard]] inline Four root(Four a) noexcept {
#if defined(__SSE2__)
  return __builtin_ia32_sqrtps(a);
#else
  return {std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])};
#endif
}

/// Lane by lane: a < b ? a : b.
[[nodiscard]] inline Four least(Four a, Four b) noexcept {
#if defined(__SSE2__)
  return __builtin_ia32_minps(a, b);
#else
  return a < b ? a : b;
#endif
}
/// Lane by lane: a < b ? b : a.
[[nodiscard]] inline Four greatest(Four a, Four b) noexcept {
#if defined(__SSE2__)
  return __builtin_ia32_maxps(b, a);
#else
  return a < b ? b : a;
#endif
}
[[nodiscard]] inline FourInts least(FourInts a, FourInts b) noexcept { return a < b ? a : b; }
[[nodiscard]] inline FourInts greatest(FourInts a, FourInts b) noexcept { return a < b ? b : a; }

/// Rows become columns.
inline void transpose(std::array<Four, 4>& m) noexcept {
  const Four a = __builtin_shufflevector(m[0], m[1], 0, 4, 1, 5), b = __builtin_shufflevector(m[2], m[3], 0, 4, 1, 5),
             c = __builtin_shufflevector(m[0], m[1], 2, 6, 3, 7), d = __builtin_shufflevector(m[2], m[3], 2, 6, 3, 7);
  m = {__builtin_shufflevector(a, b, 0, 1, 4, 5), __builtin_shufflevector(a, b, 2, 3, 6, 7),
       __builtin_shufflevector(c, d, 0, 1, 4, 5), __builtin_shufflevector(c, d, 2, 3, 6, 7)};
}

}  // namespace relief::detail
