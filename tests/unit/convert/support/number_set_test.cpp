#include <relief/convert/support/number_set.h>

#include <gtest/gtest.h>

namespace relief::detail {
namespace {

TEST(NumberSet, HoldsWhatWasAddedSinceItWasEmptied) {
  NumberSet set;
  set.reset(8);
  EXPECT_FALSE(set.has(0));
  EXPECT_TRUE(set.add(0));
  EXPECT_TRUE(set.add(7));
  EXPECT_FALSE(set.add(7)) << "it was there";
  EXPECT_TRUE(set.has(0));
  EXPECT_FALSE(set.has(6));
  set.reset(8);
  EXPECT_FALSE(set.has(0));
  EXPECT_TRUE(set.add(7));
  set.reset(100);
  EXPECT_FALSE(set.has(7));
  EXPECT_TRUE(set.add(99));
  EXPECT_FALSE(set.has(98));
}

}  // namespace
}  // namespace relief::detail
