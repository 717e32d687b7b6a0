// A 64-bit content hash: equal content gives equal hashes on every machine of the same byte order. Not for security.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace relief {

/// Feeds bytes in any cut; the result depends on the bytes only, not on how they were cut into `add` calls of whole
/// values.
class Hash64 {
 public:
  /// Adds a number.
  void add(std::uint64_t value) noexcept {
    state_ = mix(state_ ^ (value + 0x9e3779b97f4a7c15ULL + (state_ << 6U) + (state_ >> 2U)));
  }
  /// Adds bytes, in their order.
  void add_bytes(std::span<const std::byte> bytes) noexcept {
    std::size_t k = 0;
    for (; k + 8 <= bytes.size(); k += 8) {
      std::uint64_t word = 0;
      std::memcpy(&word, bytes.data() + k, 8);
      add(word);
    }
    std::uint64_t tail = 0;
    if (k < bytes.size()) std::memcpy(&tail, bytes.data() + k, bytes.size() - k);
    add(tail);
    add(bytes.size());
  }
  template <typename T>
  /// Adds values as their bytes; no type with padding.
  void add_values(std::span<const T> values) noexcept {
    add_bytes(std::as_bytes(values));
  }
  /// Returns the hash of everything added so far.
  [[nodiscard]] std::uint64_t value() const noexcept { return mix(state_); }

 private:
  static constexpr std::uint64_t mix(std::uint64_t z) noexcept {
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31U);
  }
  std::uint64_t state_ = 0x243f6a8885a308d3ULL;
};

}  // namespace relief
