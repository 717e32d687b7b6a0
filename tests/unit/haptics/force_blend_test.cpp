// What is felt between two places of the workspace.
#include <relief/haptics/force_blend.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace relief {
namespace {

constexpr double kTick = 1e-3;  // s

Wrench force(double x, double y = 0) { return {{x, y, 0}, {}}; }

TEST(ForceBlend, ComesToTheLawWithFifteenMilliseconds) {
  ForceBlend blend;
  EXPECT_FALSE(blend.blending());
  blend.moved({{0.3, 0, 0}, {0, 0, 0.03}});
  EXPECT_TRUE(blend.blending());
  Wrench given;
  for (int k = 1; k <= 15; ++k) given = blend.step({}, {}, kTick);
  EXPECT_NEAR(given.force.x, 0.3 / std::exp(1), 1e-9);
  EXPECT_NEAR(given.torque.z, 0.03 / std::exp(1), 1e-9) << "the torque in the same measure";
  int ticks = 15;
  for (; blend.blending() && ticks < 1000; ++ticks) given = blend.step({}, {}, kTick);
  EXPECT_NEAR(ticks, 15 * std::log(300), 2) << "until a thousandth of a newton is left";
  EXPECT_EQ(given.force, Vec3d{});
  EXPECT_EQ(given.torque, Vec3d{});
}

TEST(ForceBlend, ChangesByLessThanAFingerNotices) {
  ForceBlend blend;
  blend.moved(force(3));
  double last = 3, law = -1;
  int ticks = 0;
  for (; blend.blending() && ticks < 1000; ++ticks) {
    // The law's own force goes on changing meanwhile.
    const double now = blend.step(force(law += 0.01), {}, kTick).force.x;
    ASSERT_LE(std::abs(now - last), 0.045 + 1e-12) << ticks;
    last = now;
  }
  EXPECT_LT(ticks, 200) << "and is there in the end, though the law moves";
  EXPECT_EQ(last, law);
}

TEST(ForceBlend, TheHandIsFeltAtOnce) {
  ForceBlend blend;
  blend.moved(force(0, 1));
  const Vec3d given = blend.step(force(0, 1.2), {0, 0.2, 0}, kTick).force;
  EXPECT_NEAR(given.x, 0, 1e-12);
  EXPECT_NEAR(given.y, 1.2, 1e-12) << "0.2 of it by the hand";
}

TEST(ForceBlend, AHandThatGoesOutIsNotPulledIn) {
  // The surface has risen by as much as bends the spring by 1 N; the hand goes out past where it was before.
  ForceBlend blend;
  blend.moved(force(0, 0.5));
  double law = 1.5;
  int none = 0;
  for (int k = 0; k < 30; ++k) {
    law = std::max(0.01, law - 0.05);
    const Vec3d given = blend.step(force(0, law), {0, -0.05, 0}, kTick).force;
    ASSERT_GE(given.y, -1e-15) << k;
    ASSERT_LE(given.y, 0.5) << k;
    none += given.y < 1e-15 ? 1 : 0;
  }
  EXPECT_GT(none, 0);
}

TEST(ForceBlend, WhatIsLeftOfALostContactFadesTheWayThatItPushed) {
  ForceBlend blend;
  blend.moved(force(0.3, 0.6));
  double last = length(Vec3d{0.3, 0.6, 0});
  for (int k = 0; blend.blending() && k < 500; ++k) {
    const Vec3d given = blend.step({}, {}, kTick).force;
    ASSERT_NEAR(given.x * 2, given.y, 1e-12) << k;
    ASSERT_GE(given.y, 0);
    ASSERT_LT(length(given), last);
    last = length(given);
  }
  EXPECT_EQ(last, 0);
}

TEST(ForceBlend, AnotherChangeGoesOnFromWhatIsGiven) {
  ForceBlend blend;
  blend.moved(force(1));
  double last = 1, law = 0;
  for (int k = 0; k < 200; ++k) {
    if (k % 7 == 0) {
      law = 1 - law;
      blend.moved(force(last));
    }
    const double now = blend.step(force(law), {}, kTick).force.x;
    ASSERT_LE(std::abs(now - last), 0.045 + 1e-12) << k;
    last = now;
  }
}

TEST(ForceBlend, AtRestThereIsNothingToLeadOver) {
  ForceBlend blend;
  blend.moved(force(1));
  static_cast<void>(blend.step({}, {}, kTick));
  EXPECT_TRUE(blend.blending());
  blend.rest();
  EXPECT_FALSE(blend.blending());
}

}  // namespace
}  // namespace relief
