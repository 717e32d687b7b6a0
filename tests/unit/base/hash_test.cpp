#include <relief/base/hash.h>

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <set>
#include <string_view>
#include <vector>

namespace relief {
namespace {

std::uint64_t hash_of(std::string_view text) {
  Hash64 hash;
  hash.add_bytes(std::as_bytes(std::span(text)));
  return hash.value();
}

// These values are in model files, so they must never change.
TEST(Hash, HasTheValuesThatFilesHold) {
  EXPECT_EQ(Hash64{}.value(), 0xe9e0033e3badaf36ULL);
  EXPECT_EQ(hash_of("relief"), 0xbecd1e362b50d583ULL);
  Hash64 hash;
  hash.add(1);
  hash.add(2);
  EXPECT_EQ(hash.value(), 0x4b5b8a139cfcd3ceULL);
}

TEST(Hash, DependsOnEveryBitOfTheContent) {
  std::array<std::byte, 37> bytes{};
  std::set<std::uint64_t> seen;
  const auto note = [&] {
    Hash64 hash;
    hash.add_bytes(bytes);
    seen.insert(hash.value());
  };
  note();
  for (std::size_t bit = 0; bit < bytes.size() * 8; ++bit) {
    bytes[bit / 8] ^= std::byte(1U << (bit % 8));
    note();
    bytes[bit / 8] ^= std::byte(1U << (bit % 8));
  }
  EXPECT_EQ(seen.size(), bytes.size() * 8 + 1);
}

TEST(Hash, DependsOnLengthAndOrder) {
  using std::string_view_literals::operator""sv;
  EXPECT_NE(hash_of(""sv), hash_of("\0"sv));
  EXPECT_NE(hash_of("\0\0\0\0\0\0\0"sv), hash_of("\0\0\0\0\0\0\0\0"sv));
  EXPECT_NE(hash_of("abcdefgh12345678"), hash_of("12345678abcdefgh"));
}

TEST(Hash, ValuesHashAsTheirBytes) {
  const std::vector<float> values = {0.25F, -1.5F, 3e-30F, 7.0F, 0.0F};
  Hash64 a, b;
  a.add_values(std::span<const float>(values));
  b.add_bytes(std::as_bytes(std::span(values)));
  EXPECT_EQ(a.value(), b.value());
}

}  // namespace
}  // namespace relief
