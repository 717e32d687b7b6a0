#include "support/resident.h"

#include <relief/convert/laid_aside.h>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace relief::detail {
namespace {

using testing::resident_of_files;

TEST(LaidAside, GivesBackWhatItTook) {
  std::vector<std::uint32_t> numbers(5'000'000);  // many pieces, the last of them smaller
  std::iota(numbers.begin(), numbers.end(), 7U);
  std::vector<std::array<double, 3>> places = {{1, 2, 3}}, none;
  const auto numbers_before = numbers;
  const auto places_before = places;
  LaidAside aside;
  aside.take(numbers, places);
  aside.take(none);
  EXPECT_EQ(numbers.capacity() + places.capacity(), 0U);
  aside.give_back();
  EXPECT_EQ(numbers, numbers_before);
  EXPECT_EQ(places, places_before);
  EXPECT_TRUE(none.empty());
  numbers.clear();
  aside.give_back();
  EXPECT_TRUE(numbers.empty()) << "it gives back once";
  numbers = {1, 2, 3};
  aside.take(numbers);
  EXPECT_TRUE(numbers.empty());
  aside.give_back();
  EXPECT_EQ(numbers, (std::vector<std::uint32_t>{1, 2, 3})) << "and takes again";
}

TEST(LaidAside, TakesNoMemoryMeanwhile) {
  constexpr std::size_t kBytes = std::size_t{6} << 20;  // less than pages wait for in turn
  std::vector<std::byte> bytes(kBytes, std::byte{1});
  const std::size_t before = resident_of_files();
  LaidAside aside;
  aside.take(bytes);
  ASSERT_TRUE(bytes.empty());
  EXPECT_LT(resident_of_files(), before + kBytes / 2);
  aside.give_back();
  EXPECT_EQ(std::count(bytes.begin(), bytes.end(), std::byte{1}), kBytes);
}

TEST(LaidAside, LeavesArraysAloneWhereNoFileMayBeWritten) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small = {1024, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  std::vector<int> numbers(100'000, 7);
  const int* const place = numbers.data();
  LaidAside aside;
  aside.take(numbers);
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(numbers.size(), 100'000U);
  aside.give_back();
  EXPECT_EQ(numbers, std::vector<int>(100'000, 7));
  EXPECT_EQ(numbers.data(), place);
}

TEST(LaidAside, ForgetsWhatItDoesNotGiveBack) {
  std::vector<int> numbers = {1, 2, 3};
  {
    LaidAside aside;
    aside.take(numbers);
  }
  EXPECT_TRUE(numbers.empty());
}

}  // namespace
}  // namespace relief::detail
