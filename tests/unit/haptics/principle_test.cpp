// How far what is held may go in a tick, the hand's way past it, and the account of what its own moves give.
#include <relief/haptics/contact/principle.h>

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace relief::detail {
namespace {

TEST(Budget, IsTenTimesTheHandsWayOrAFiftiethOfTheDepth) {
  EXPECT_EQ(budget(0, 0), 0);
  EXPECT_DOUBLE_EQ(budget(1e-3, 0.04), 10e-3);
  EXPECT_DOUBLE_EQ(budget(1e-5, 0.04), 0.04 / 50);
  EXPECT_DOUBLE_EQ(budget(0, 0.04), 0.04 / 50) << "it comes to rest under a hand at rest";
}

TEST(Past, IsWhatTheHandGoesMoreSidewaysThanIn) {
  const Vec3d up = {0, 1, 0};
  EXPECT_EQ(past(up, {}), Vec3d{});
  EXPECT_EQ(past(up, {0, -1, 0}), Vec3d{}) << "pressed on";
  EXPECT_EQ(past(up, {0, 1, 0}), Vec3d{}) << "pulled back";
  EXPECT_EQ(past(up, {0.99, -1, 0}), Vec3d{}) << "pressed on aslant";
  EXPECT_EQ(past(up, {2, 0, 0}), (Vec3d{2, 0, 0}));
  EXPECT_LT(length(past(up, {4, -1, 0}) - Vec3d{3, 0, 0}), 1e-15);
  EXPECT_LT(length(past(up, {4, 1, 0}) - Vec3d{4, 0, 0}), 1e-15) << "pulled back aslant";
  // Without a step where it begins, and whatever the axes.
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  const auto any = [&] { return Vec3d{normal(random), normal(random), normal(random)}; };
  for (int k = 0; k < 1000; ++k) {
    const Vec3d out = normalized(any()), move = any(), sideways = square_to(out, move);
    const double aside = length(sideways), in = std::max(0.0, -dot(move, out));
    ASSERT_NEAR(dot(sideways, out), 0, 1e-12);
    ASSERT_NEAR(length(past(out, move)), std::max(0.0, aside - in), 1e-12);
    const Vec3d near = move + any() * 1e-7;
    ASSERT_LT(length(past(out, near) - past(out, move)), 1e-5) << k;
  }
}

TEST(Past, WhereThereIsNoWayOutAllIsSideways) { EXPECT_EQ(square_to({}, {1, 2, 3}), (Vec3d{1, 2, 3})); }

/// A place so far from the middle of the cursor's way.
Vec3d at(double distance2) { return {0, std::sqrt(distance2), 0}; }

TEST(Ledger, AllowsWhatWasBroughtAndNoMore) {
  Ledger ledger;
  EXPECT_TRUE(ledger.allows(at(1), at(1), {}));
  EXPECT_FALSE(ledger.allows(at(1), at(1 + 1e-9), {})) << "nothing was brought yet";
  ledger.book(at(1), at(0.75), {});
  EXPECT_TRUE(ledger.allows(at(0.75), at(1 - 1e-12), {}));
  EXPECT_FALSE(ledger.allows(at(0.75), at(1 + 1e-9), {}));
  ledger.book(at(0.75), at(0.875), {});
  EXPECT_TRUE(ledger.allows(at(0.875), at(1 - 1e-12), {}));
  EXPECT_FALSE(ledger.allows(at(0.875), at(1 + 1e-9), {})) << "what was spent is gone";
  ledger.clear();
  EXPECT_FALSE(ledger.allows(at(0.875), at(0.875 + 1e-9), {}));
}

TEST(Ledger, CountsFromTheMiddleOfTheCursorsWay) {
  Ledger ledger;
  const Vec3d middle = {3, -1, 2};
  ledger.book(middle + at(1), middle + at(0.75), middle);
  EXPECT_TRUE(ledger.allows(middle + at(0.5), middle + at(0.75 - 1e-12), middle));
  EXPECT_FALSE(ledger.allows(middle + at(0.5), middle + at(0.75 + 1e-9), middle));
}

TEST(Ledger, HoldsNoMoreThanTheSquaredDepth) {
  // Brought while the hand was deep; now it is not.
  Ledger ledger;
  for (int k = 0; k < 10; ++k) ledger.book(at(1), at(0.5), {});
  EXPECT_TRUE(ledger.allows(at(0.5), at(1.5 - 1e-12), {}));
  EXPECT_FALSE(ledger.allows(at(0.5), at(1.5 + 1e-9), {})) << "a squared depth of 1 was the most that it came from";
  ledger.book(at(0.01), at(0.01), {});
  EXPECT_FALSE(ledger.allows(at(0.01), at(0.02 + 1e-9), {}));
}

TEST(Ledger, AtACursorAtRestAllMovesTogetherOnlyTakeFromTheSpring) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  int gone = 0, refused = 0;
  for (int run = 0; run < 200; ++run) {
    Ledger ledger;
    Vec3d place = normalized(Vec3d{normal(random), normal(random), normal(random)});
    const double first2 = dot(place, place);
    for (int k = 0; k < 200; ++k) {
      const Vec3d next = place + Vec3d{normal(random), normal(random), normal(random)} * 0.1;
      if (!ledger.allows(place, next, {})) {
        ++refused;
        continue;
      }
      ledger.book(place, next, {});
      place = next;
      ++gone;
      ASSERT_LE(dot(place, place), first2 * (1 + 1e-12));
    }
  }
  EXPECT_GT(gone, 5000);
  EXPECT_GT(refused, 1000);
}

TEST(Ledger, WhatIsOwedLiesAcrossTheWayOutAndIsNoMoreThanTheDepth) {
  Ledger ledger;
  ledger.owe({3, 5, 0}, {0, 1, 0}, 10);
  EXPECT_EQ(ledger.owed(), (Vec3d{3, 0, 0}));
  ledger.owe({3, 5, 4}, {0, 1, 0}, 1);
  EXPECT_LT(length(ledger.owed() - Vec3d{0.6, 0, 0.8}), 1e-15);
  ledger.settle();
  EXPECT_EQ(ledger.owed(), Vec3d{});
  ledger.owe({1, 0, 0}, {0, 1, 0}, 1);
  ledger.clear();
  EXPECT_EQ(ledger.owed(), Vec3d{});
}

}  // namespace
}  // namespace relief::detail
