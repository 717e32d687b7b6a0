// What a change that the hand did not make does to what is felt.
#include <relief/haptics/contact/blend.h>
#include <relief/haptics/contact/principle.h>

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace relief {
namespace {

TEST(Blend, NothingJumpsWhereAChangeIsAbsorbed) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Blend blend;
  Vec3d own = {1, 2, 3};
  for (int k = 0; k < 100; ++k) {
    const Vec3d felt = own + blend.offset(), change = {normal(random), normal(random), normal(random)};
    own += change;
    blend.absorb(change);
    EXPECT_LT(length(own + blend.offset() - felt), 1e-13) << k;
    EXPECT_TRUE(blend.fading());
    blend.fade({.share = 0.1});
  }
}

TEST(Blend, FadesByItsShareOrByTheMostWhicheverIsLess) {
  Blend blend;
  blend.absorb({-1, 0, 0});
  double left = 1;
  for (int k = 0; k < 50; ++k) {
    blend.fade({.share = 0.06, .most = 0.02});
    left -= std::min(0.06 * left, 0.02);
    ASSERT_NEAR(blend.offset().x, left, 1e-12) << k;
    ASSERT_EQ(blend.offset().y, 0);
  }
  EXPECT_LT(left, 0.3) << "the share was less, too";
}

TEST(Blend, IsOverAfterAsManyTimeConstantsAsAMillionthTakes) {
  for (const double whole : {1e-9, 1.0, 1e9}) {
    Blend blend;
    blend.absorb({0, whole, 0});
    int ticks = 0;
    for (; blend.fading() && ticks < 10'000; ++ticks) blend.fade({.share = 0.06});
    EXPECT_EQ(ticks, static_cast<int>(std::ceil(std::log(1e-6) / std::log(1 - 0.06)))) << whole;
    EXPECT_EQ(blend.offset(), Vec3d{});
  }
}

TEST(Blend, AMillionthOfTheWholeIsTheWholesOwn) {
  // One that was great and is small goes on fading, and one that was small is not over for it.
  Blend blend;
  blend.absorb({1, 0, 0});
  for (int k = 0; k < 100; ++k) blend.fade({.share = 0.1});
  ASSERT_TRUE(blend.fading());
  while (blend.fading()) blend.fade({.share = 0.1});
  blend.absorb({1e-7, 0, 0});
  blend.fade({.share = 0.1});
  EXPECT_TRUE(blend.fading());
}

TEST(Blend, AHandThatMovesShortensIt) {
  Blend blend;
  blend.absorb({-1, 0, 0});
  blend.fade({.share = 0.1, .most = 0.05}, 0.3);
  EXPECT_NEAR(blend.offset().x, 1 - 0.05 - 0.3, 1e-15);
  blend.fade({.share = 0.1, .most = 0.05}, 10);
  EXPECT_FALSE(blend.fading()) << "and never turns it round";
}

TEST(Blend, AtOnceIsAtOnce) {
  Blend blend;
  blend.absorb({1, 2, 3});
  blend.fade({});
  EXPECT_FALSE(blend.fading());
}

/// What a contact gives to feel when its own vector changes so much in each of some ticks, by an edit.
TEST(Feeling, TheDepthThatAnEditBringsIsToldAsGrown) {
  detail::Feeling feeling;
  Vec3d own = {0, 0.01, 0};
  feeling.tell(true, own, feeling.blend().offset());
  EXPECT_EQ(feeling.grown(), 0);
  feeling.blend().absorb({0, 0.02, 0});
  own.y += 0.02;
  double depth = feeling.depth(), all = 0;
  EXPECT_NEAR(depth, 0.01, 1e-15);
  for (int k = 0; k < 300; ++k) {
    const Vec3d offset = feeling.blend().offset();
    feeling.blend().fade({.share = 0.1});
    own.y += 1e-5;  // and the hand goes deeper
    feeling.tell(true, own, offset);
    ASSERT_NEAR(feeling.depth() - depth, feeling.grown() + 1e-5, 1e-15) << k;
    all += feeling.grown();
    depth = feeling.depth();
  }
  EXPECT_NEAR(all, 0.02, 1e-12);
}

TEST(Feeling, WhatIsNotYetTakenOverNeverPullsIn) {
  // The surface has risen by 0.02 under a tip 0.01 deep; the hand goes out of what was there before.
  detail::Feeling feeling;
  const double rise = 0.02;
  double hand = -0.01;  // above the surface as it was
  feeling.tell(true, {0, -hand, 0}, {});
  feeling.blend().absorb({0, rise, 0});
  for (; hand < rise; hand += 1e-3) {
    const Vec3d own = {0, rise - hand, 0}, offset = feeling.blend().offset();
    feeling.blend().fade({.share = 0.01});
    feeling.tell(true, own, offset);
    ASSERT_GE(dot(feeling.way_out(), own) * feeling.depth(), 0) << hand;
  }
}

TEST(Feeling, WhatIsLeftOfALostContactFadesTheWayThatItPushed) {
  detail::Feeling feeling;
  feeling.tell(true, {0, 0.01, 0}, {});
  // An edit takes away what held it: from its own vector to none.
  feeling.blend().absorb(Vec3d{} - Vec3d{0, 0.01, 0});
  double last = 0.01;
  for (int k = 0; k < 20; ++k) {
    const Vec3d offset = feeling.blend().offset();
    feeling.blend().fade({.share = 0.1});
    feeling.tell(false, {}, offset);
    ASSERT_NEAR(feeling.depth(), 0.9 * last, 1e-12);
    ASSERT_EQ(feeling.way_out(), (Vec3d{0, 1, 0}));
    last = feeling.depth();
  }
  // One that would pull the other way is none.
  feeling.blend().absorb({0, 1, 0});
  feeling.tell(false, {}, feeling.blend().offset());
  EXPECT_EQ(feeling.depth(), 0);
}

}  // namespace
}  // namespace relief
