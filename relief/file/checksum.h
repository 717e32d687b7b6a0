// Checksums of rows: each row of our files that carries a blob or a fact carries one.
#pragma once

#include <relief/base/hash.h>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace relief::detail {

using Bytes = std::span<const std::byte>;

inline Bytes bytes_of(std::string_view text) { return std::as_bytes(std::span(text)); }
/// As SQLite keeps it.
inline std::int64_t stored(const Hash64& hash) { return std::bit_cast<std::int64_t>(hash.value()); }
/// Over the bytes of the name, the numbers, and the bytes of the data, in this order.
template <typename... Numbers>
std::int64_t hash_of(std::string_view name, Bytes data, Numbers... numbers) {
  Hash64 hash;
  hash.add_bytes(bytes_of(name));
  (hash.add(static_cast<std::uint64_t>(numbers)), ...);
  hash.add_bytes(data);
  return stored(hash);
}

}  // namespace relief::detail
