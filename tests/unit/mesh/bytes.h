// Bytes of binary files, put together by hand.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace relief::testing {

/// The value's bytes, the least significant first.
template <typename T>
std::string le(T value) {
  auto raw = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if constexpr (std::endian::native == std::endian::big) std::ranges::reverse(raw);
  return {raw.data(), raw.size()};
}

/// The value's bytes, the most significant first.
template <typename T>
std::string be(T value) {
  std::string bytes = le(value);
  std::ranges::reverse(bytes);
  return bytes;
}

/// A zip archive of members, by name and content, stored as they are.
inline std::string stored_zip(const std::vector<std::pair<std::string, std::string>>& members) {
  std::string zip, list;
  for (const auto& [name, content] : members) {
    std::uint32_t crc = ~0U;
    for (const char c : content) {
      crc ^= static_cast<unsigned char>(c);
      for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xedb88320U : 0U);
    }
    std::string entry;
    for (const unsigned v : {20U, 0U, 0U, 0U, 0x21U})
      entry += le(static_cast<std::uint16_t>(v));  // version, flags, method, time, date
    entry += le(~crc);
    for (int k = 0; k < 2; ++k) entry += le(static_cast<std::uint32_t>(content.size()));
    entry += le(static_cast<std::uint16_t>(name.size())) + le(std::uint16_t{0});
    list += std::string("PK\1\2") + le(std::uint16_t{20}) + entry;
    list.append(10, '\0');  // no comment, the first disk, attributes
    list += le(static_cast<std::uint32_t>(zip.size())) + name;
    zip += std::string("PK\3\4") + entry + name + content;
  }
  const auto start = static_cast<std::uint32_t>(zip.size());
  zip += list + std::string("PK\5\6").append(4, '\0');
  for (int k = 0; k < 2; ++k) zip += le(static_cast<std::uint16_t>(members.size()));
  zip += le(static_cast<std::uint32_t>(list.size())) + le(start);
  return zip.append(2, '\0');
}

}  // namespace relief::testing
