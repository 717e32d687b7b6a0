#include <relief/base/triples.h>

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

namespace relief {
namespace {

TEST(Triples, AreTheRowsOfAnArray) {
  const std::vector<std::array<double, 3>> rows = {{1, 2, 3}, {4, 5, 6}};
  const Triples<double> triples = rows;
  ASSERT_EQ(triples.size(), 2U);
  EXPECT_EQ(triples[1], rows[1]);
  std::vector<std::array<double, 3>> met;
  for (const auto& triple : triples) met.push_back(triple);
  EXPECT_EQ(met, rows);
}

TEST(Triples, AreTheSameMembersOfARowOfStructures) {
  struct Item {
    std::uint64_t before;
    std::array<std::uint32_t, 3> corners;
    int after;
  };
  const std::array<Item, 3> items = {{{1, {2, 3, 4}, 5}, {6, {7, 8, 9}, 10}, {11, {12, 13, 14}, 15}}};
  const Triples<std::uint32_t> triples(items[0].corners.data(), items.size(), sizeof(Item));
  ASSERT_EQ(triples.size(), items.size());
  std::size_t k = 0;
  for (const auto& triple : triples) EXPECT_EQ(triple, items[k++].corners);
  EXPECT_EQ(k, items.size());
}

TEST(Triples, MayBeNone) {
  const Triples<double> none;
  EXPECT_TRUE(none.empty());
  EXPECT_EQ(none.begin(), none.end());
  const std::vector<std::array<double, 3>> no_rows;
  EXPECT_TRUE(Triples<double>(no_rows).empty());
}

TEST(Triples, AreNotOfRowsThatAreGone) {
  using Rows = std::vector<std::array<double, 3>>;
  static_assert(!std::is_constructible_v<Triples<double>, Rows> && std::is_constructible_v<Triples<double>, Rows&>);
  static_assert(std::is_constructible_v<Triples<double>, std::span<const std::array<double, 3>>>);
}

}  // namespace
}  // namespace relief
