#include <relief/convert/laid_aside.h>

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace relief::detail {
namespace {

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
