#include <relief/base/free_memory.h>

#include <gtest/gtest.h>

#include <vector>

namespace relief {
namespace {

TEST(FreeMemory, GivesBackWhatArraysHold) {
  std::vector<int> some(1000);
  std::vector<double> others(10);
  free_memory(some, others);
  EXPECT_EQ(some.capacity(), 0U);
  EXPECT_EQ(others.capacity(), 0U);
}

}  // namespace
}  // namespace relief
