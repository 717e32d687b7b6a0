#include "support/resident.h"

#include <relief/convert/support/paged.h>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace relief::detail {
namespace {

using testing::resident_of_files;

struct Arrays {
  std::vector<std::uint32_t> numbers;
  std::vector<std::array<double, 3>> places;
  std::vector<std::byte> bytes;
  bool operator==(const Arrays&) const = default;
};
auto arrays_of(Arrays& a) { return std::tie(a.numbers, a.places, a.bytes); }

Arrays many_numbers() {
  Arrays arrays = {std::vector<std::uint32_t>(5'000'000), {{1, 2, 3}}, {}};  // many pieces, the last of them smaller
  std::iota(arrays.numbers.begin(), arrays.numbers.end(), 7U);
  return arrays;
}

TEST(Paged, HasTheValueAgainWhenAsked) {
  Paged<Arrays> paged(many_numbers());
  const Arrays before = many_numbers();
  EXPECT_EQ(paged.get(), before);
  paged.rest();
  paged.rest();
  EXPECT_EQ(std::as_const(paged).get(), before);
  paged.get().numbers = {1, 2, 3};
  paged.rest();
  EXPECT_EQ(paged.get().numbers, (std::vector<std::uint32_t>{1, 2, 3})) << "and rests again";
}

TEST(Paged, MovesAndIsTakenWhileItRests) {
  Paged<Arrays> paged(many_numbers());
  paged.rest();
  Paged<Arrays> moved = std::move(paged);
  EXPECT_EQ(std::move(moved).take(), many_numbers());
}

TEST(Paged, TakesNoMemoryWhileItRests) {
  constexpr std::size_t kBytes = std::size_t{6} << 20;  // less than pages wait for in turn
  Arrays arrays;
  arrays.bytes.assign(kBytes, std::byte{1});
  Paged<Arrays> paged(std::move(arrays));
  const std::size_t before = resident_of_files();
  paged.rest();
  EXPECT_LT(resident_of_files(), before + kBytes / 2);
  EXPECT_EQ(std::ranges::count(paged.get().bytes, std::byte{1}), std::ptrdiff_t{kBytes});
}

TEST(Paged, StaysWhereItDoesNotPageOrNoFileMayBeWritten) {
  Paged<Arrays> stays(many_numbers(), false);
  const std::uint32_t* const place = stays.get().numbers.data();
  stays.rest();
  EXPECT_EQ(stays.get().numbers.data(), place);

  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small = {1024, before.rlim_max};
  Paged<Arrays> paged(many_numbers());
  const std::uint32_t* const there = paged.get().numbers.data();
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  paged.rest();
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(paged.get(), many_numbers());
  EXPECT_EQ(paged.get().numbers.data(), there);
}

}  // namespace
}  // namespace relief::detail
