// Unpacking of deflated data within a bound.
#pragma once

#include <relief/base/steps.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace relief::detail {

/// What deflated data stand in.
enum class Wrapper : std::uint8_t { None, Gzip };
enum class Inflated : std::uint8_t { Whole, Damaged, TooLarge, Cancelled };

/// Returns what a file of this many bytes may unpack to: a hundred times as many, and 16 MiB. Real meshes stay below 20
/// times.
[[nodiscard]] constexpr std::uint64_t most_unpacked(std::uint64_t bytes) noexcept {
  return 100 * bytes + (std::uint64_t{16} << 20U);
}

/// Unpacks into `out` until it would have more than `most` bytes. Several gzip members follow one another; what follows
/// the last is passed over. `out` grows with what really comes out, so a lying header costs nothing.
/// A packed byte is a step.
[[nodiscard]] Inflated inflate_all(std::string_view packed, Wrapper wrapper, std::uint64_t most, std::string& out,
                                   Steps& steps);

}  // namespace relief::detail
