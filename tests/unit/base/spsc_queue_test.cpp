#include <relief/base/spsc_queue.h>

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <thread>

namespace relief {
namespace {

TEST(SpscQueue, KeepsOrderAndRefusesWhenFull) {
  SpscQueue<int> queue(4);
  ASSERT_EQ(queue.capacity(), 4U);
  int item = -1;
  EXPECT_FALSE(queue.pop(item));
  EXPECT_EQ(item, -1);
  for (int round = 0; round < 5; ++round) {
    for (int k = 0; k < 4; ++k) EXPECT_TRUE(queue.push(10 * round + k));
    EXPECT_FALSE(queue.push(99));
    for (int k = 0; k < 4; ++k) {
      ASSERT_TRUE(queue.pop(item));
      EXPECT_EQ(item, 10 * round + k);
    }
    EXPECT_FALSE(queue.pop(item));
  }
}

TEST(SpscQueue, CapacityIsRoundedUpToAPowerOfTwo) {
  EXPECT_EQ(SpscQueue<int>(1).capacity(), 1U);
  EXPECT_EQ(SpscQueue<int>(5).capacity(), 8U);
  EXPECT_EQ(SpscQueue<int>(8).capacity(), 8U);
}

// Items wider than a machine word: a torn one would have words that disagree.
TEST(SpscQueue, TwoThreadsSeeEveryItemWholeAndInOrder) {
  struct Item {
    std::array<std::uint64_t, 9> words;
  };
  constexpr std::uint64_t kCount = 200'000;
  SpscQueue<Item> queue(64);
  std::thread producer([&] {
    for (std::uint64_t k = 0; k < kCount; ++k) {
      Item item{};
      item.words.fill(k);
      while (!queue.push(item)) std::this_thread::yield();
    }
  });
  std::uint64_t wrong = 0;
  for (std::uint64_t k = 0; k < kCount; ++k) {
    Item item{};
    while (!queue.pop(item)) std::this_thread::yield();
    for (const std::uint64_t word : item.words) wrong += word != k;
  }
  producer.join();
  EXPECT_EQ(wrong, 0U);
  Item item{};
  EXPECT_FALSE(queue.pop(item));
}

}  // namespace
}  // namespace relief
