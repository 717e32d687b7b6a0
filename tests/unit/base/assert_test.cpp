#include <relief/base/assert.h>

#include <gtest/gtest.h>

namespace relief {
namespace {

TEST(AssertDeathTest, EndsTheProgramWithThePlaceAndTheWords) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const int slabs = 3;
  EXPECT_DEATH(RELIEF_ASSERT(slabs == 4), "broken assumption slabs == 4 at .*assert_test\\.cpp:[0-9]+");
}

TEST(Assert, IsAnExpressionAndEvaluatesItsConditionOnce) {
  int count = 0;
  RELIEF_ASSERT(++count == 1);
  EXPECT_EQ(count, 1);
  if (count == 1)
    RELIEF_ASSERT(true);
  else
    FAIL();
}

}  // namespace
}  // namespace relief
