// A vector as its bits: 0 and -0 differ, and a NaN is equal to itself.
#pragma once

#include <relief/base/vec.h>

#include <array>
#include <bit>
#include <cstdint>

namespace relief::testing {

inline std::array<std::uint64_t, 3> bits(Vec3d v) { return std::bit_cast<std::array<std::uint64_t, 3>>(v); }

}  // namespace relief::testing
