#include <relief/base/mailbox.h>

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <thread>

namespace relief {
namespace {

/// Whole only where all three belong together.
struct Triple {
  std::uint64_t number = 0, twice = 0, square = 0;
};

TEST(Mailbox, GivesEachValueOnceAndTheNewestOnly) {
  Mailbox<int> box;
  int got = -1;
  EXPECT_FALSE(box.take(got));
  EXPECT_EQ(got, -1);
  box.put(1);
  box.put(2);
  EXPECT_TRUE(box.take(got));
  EXPECT_EQ(got, 2);
  EXPECT_FALSE(box.take(got));
  for (int k = 3; k < 20; ++k) {
    box.put(k);
    ASSERT_TRUE(box.take(got));
    EXPECT_EQ(got, k);
  }
}

TEST(Mailbox, NeverTearsAValueNorGoesBack) {
  Mailbox<Triple> box;
  constexpr std::uint64_t kLast = 200'000;
  std::thread writer([&] {
    for (std::uint64_t k = 1; k <= kLast; ++k) box.put({k, 2 * k, k * k});
  });
  std::uint64_t newest = 0;
  for (Triple got; newest < kLast;) {
    if (!box.take(got)) continue;
    ASSERT_GT(got.number, newest);
    ASSERT_EQ(got.twice, 2 * got.number);
    ASSERT_EQ(got.square, got.number * got.number);
    newest = got.number;
  }
  writer.join();
}

}  // namespace
}  // namespace relief
