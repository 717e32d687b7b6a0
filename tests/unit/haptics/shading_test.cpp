// Shaded normals give no energy for long.
#include <relief/haptics/shading.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relief {
namespace {

constexpr double kForce = 2, kSlack = 1e-4, kStep = 1e-5, kAny = 4;  // rad that a normal may turn by
constexpr Vec3d kUp = {0, 1, 0};

/// Work on a hand that goes along x by so many steps, or back, over flat ground with a constant force.
double slide(Shading& shading, Vec3d shaded, int steps, double step, double force = kForce) {
  double work = 0;
  for (int k = 0; k < steps; ++k) {
    const Vec3d move = {step, 0, 0};
    work += dot(shading.step(shaded, kUp, force, 0, k > 0 ? move : Vec3d{}, kAny), move) * force;
  }
  return work;
}

Vec3d leaning(double degrees) {
  const double a = degrees * std::numbers::pi / 180;
  return {std::sin(a), std::cos(a), 0};
}

TEST(Shading, NormalsThatAlwaysLeanForwardsAreLedBack) {
  Shading shading;
  static_cast<void>(slide(shading, leaning(20), 2, kStep));
  EXPECT_GT(shading.step(leaning(20), kUp, kForce, 0, {}, kAny).x, 0.3) << "at first they are as they were given";
  const double work = slide(shading, leaning(20), 100'000, kStep);  // a metre: 0.68 J without
  EXPECT_LT(work, 2 * kSlack * kForce + 4e-4 * kForce * 1.0);
  EXPECT_GT(work, 3e-4 * kForce * 1.0) << "so much may be given for good";
  EXPECT_LT(shading.step(leaning(20), kUp, kForce, 0, {}, kAny).x, 0.1);
}

TEST(Shading, LettingGoDoesNotSettleTheAccount) {
  Shading shading;
  double work = 0;
  for (int tap = 0; tap < 1000; ++tap) {
    work += slide(shading, leaning(20), 100, kStep);
    shading.rest();
  }
  EXPECT_LT(work, 2 * kSlack * kForce + 4e-4 * kForce * 1.0);
  shading.reset();
  EXPECT_EQ(shading.given(), 0);
}

TEST(Shading, ALightTouchDoesNotSettleTheAccount) {
  Shading shading;
  double work = 0;
  for (int k = 0; k < 1000; ++k) {
    work += slide(shading, leaning(20), 50, kStep);
    work += slide(shading, kUp, 50, kStep, 1e-3 * kForce);
  }
  EXPECT_LT(work, 2 * kSlack * kForce + 4e-4 * kForce * 1.0);
}

TEST(Shading, WhatIsTakenBackIsLeftAsItIs) {
  Shading shading;
  for (int k = 0; k < 20'000; ++k) {  // grooves of 0.2 mm with slopes of 20 degrees
    const double x = k * kStep, lean = 20 * std::sin(x / 2e-4 * 2 * std::numbers::pi);
    const Vec3d normal = shading.step(leaning(lean), kUp, kForce, 0, {kStep, 0, 0}, kAny);
    ASSERT_GT(dot(normal, leaning(lean)), 0.99) << k;
  }
}

TEST(Shading, NormalsThatLeanBackwardsAreLeftAsTheyAre) {
  Shading shading;
  for (int k = 0; k < 100'000; ++k)
    ASSERT_EQ(shading.step(leaning(-20), kUp, kForce, 0, {kStep, 0, 0}, kAny), leaning(-20));
  // And what they took is not given back for more than a little.
  EXPECT_LT(slide(shading, leaning(20), 100'000, kStep), 3 * kSlack * kForce + 4e-4 * kForce * 1.0);
}

TEST(Shading, TheAccountHoldsATenthOfAMillimetreTimesTheForceOrThreeTenthsOfANewton) {
  for (const double force : {0.1, 0.3, 2.0}) {
    Shading shading;
    static_cast<void>(slide(shading, leaning(-20), 10'000, kStep, force));
    EXPECT_NEAR(shading.given(), -kSlack * std::max(0.3, force), 1e-12) << force;
  }
}

TEST(Shading, ASpringAlongTheWayOutOwesNothing) {
  Shading shading;
  const double stiffness = 1000;
  for (int k = 0; k < 10'000; ++k) {  // in and out
    const double depth = 1e-3 * (1 - std::cos(k * 1e-2)), before = 1e-3 * (1 - std::cos((k - 1) * 1e-2));
    static_cast<void>(shading.step(kUp, kUp, stiffness * depth, stiffness * depth * depth / 2,
                                   k > 0 ? kUp * (before - depth) : Vec3d{}, kAny));
    ASSERT_NEAR(shading.given(), 0, 1e-12);
  }
}

TEST(Shading, WhatAnEditAddsIsNoDebt) {
  Shading shading;
  shading.change(1, 1e-3);
  static_cast<void>(shading.step(kUp, kUp, 1, 1e-3, {}, kAny));
  Shading owing = shading;
  shading.change(2, 4e-3);
  static_cast<void>(shading.step(kUp, kUp, 2, 4e-3, {}, kAny));
  EXPECT_EQ(shading.given(), 0);
  static_cast<void>(owing.step(kUp, kUp, 2, 4e-3, {}, kAny));
  EXPECT_GT(owing.given(), 0) << "but what nobody has told of is";
}

TEST(Shading, AStifferSpringIsNoDebt) {
  Shading shading;
  shading.change(1, 1e-3);
  static_cast<void>(shading.step(kUp, kUp, 1, 1e-3, {}, kAny));
  shading.stiffen(3);
  static_cast<void>(shading.step(kUp, kUp, 3, 3e-3, {}, kAny));
  EXPECT_NEAR(shading.given(), 0, 1e-15);
}

TEST(Shading, NothingChangesAtRest) {
  Shading shading;
  static_cast<void>(slide(shading, leaning(20), 30, kStep));
  const Vec3d first = shading.step(leaning(20), kUp, kForce, 0, {}, kAny);
  for (int k = 0; k < 100; ++k) ASSERT_EQ(shading.step(leaning(20), kUp, kForce, 0, {}, kAny), first);
}

TEST(Shading, TurnsNoFasterThanItMayAndGetsThere) {
  Shading shading;
  constexpr double kTurn = 0.05;
  Vec3d last = shading.step(leaning(80), kUp, kForce, 0, {}, 0);
  EXPECT_EQ(last, leaning(80)) << "in the first tick of a contact there is none to turn from";
  for (int k = 0; k < 100; ++k) {
    // The first ways fill the account, so the way out is wanted from the second tick on.
    const Vec3d now = shading.step(leaning(80), kUp, kForce, 0, {k < 30 ? 1e-3 : 0, 0, 0}, kTurn);
    ASSERT_LT(std::acos(std::clamp(dot(now, last), -1.0, 1.0)), kTurn * 1.001) << k;
    last = now;
  }
  EXPECT_LT(last.x, 0.1);
  shading.rest();
  const Vec3d anew = shading.step(leaning(-80), leaning(40), kForce, 0, {}, kTurn);
  EXPECT_LT(length(anew - leaning(40)), 0.1) << "the account is still full";
}

}  // namespace
}  // namespace relief
