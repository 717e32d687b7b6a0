// How fast a contact follows the hand: a leap is caught up with in bounded steps, and nothing tunnels meanwhile.
#include "support/contact_judge.h"
#include "support/leaps.h"

#include <relief/haptics/hand_limit.h>

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace relief {
namespace {

Quatd turned(Vec3d axis, double angle) {
  const Vec3d part = normalized(axis) * std::sin(angle / 2);
  return {std::cos(angle / 2), part.x, part.y, part.z};
}
double angle_between(Quatd a, Quatd b) { return 2 * std::acos(std::min(1.0, std::abs(dot(a, b)))); }

/// What a program has put elsewhere has time: the contact is led there at 0.75 m/s where the diagonal is 0.15 m.
TEST(HandLimit, LeadsWhatAProgramMovesMoreSlowly) {
  HandLimit limit;
  static_cast<void>(limit.follow({{0, 0, 0}, {}}, 0, 2));
  EXPECT_NEAR(limit.follow({{1, 0, 0}, {}}, 0, 2, true).origin.x, 0.01, 1e-12);
  EXPECT_TRUE(limit.late());
  EXPECT_NEAR(limit.follow({{1, 0, 0}, {}}, 0, 2).origin.x, 0.05, 1e-12);
}

TEST(HandLimit, FollowsAHandToTheBitThatIsNoFaster) {
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  HandLimit limit;
  ToolPose hand;
  for (int k = 0; k < 1000; ++k) {
    const Vec3d last = hand.origin;
    const Vec3d way = normalized(Vec3d{normal(random), normal(random), normal(random)});
    hand.origin += way * (0.0149 * 3);
    hand.orientation = turned({1, 2, 3}, 0.01 * k);
    const ToolPose at = limit.follow(hand, 0.5, 3);  // of the turn 0.005 of way, of 0.06
    ASSERT_FALSE(limit.late()) << k;
    ASSERT_EQ(at.origin, hand.origin);
    ASSERT_EQ(at.orientation, hand.orientation);
    if (k > 0) {
      ASSERT_LT(length(limit.move() - (hand.origin - last)), 1e-15);
    }
  }
}

TEST(HandLimit, ALeapIsFollowedByAFiftiethOfTheDiagonalInATickAndArrives) {
  for (const double diagonal : {1e-3, 3.0}) {
    HandLimit limit;
    Vec3d at = limit.follow({{1, 2, 3}, {}}, 0, diagonal).origin;
    EXPECT_EQ(limit.move(), Vec3d{}) << "the first pose is where it is";
    const Vec3d to = Vec3d{1, 2, 3} + normalized(Vec3d{1, -2, 0.5}) * (0.33 * diagonal);
    int ticks = 0;
    do {
      const Vec3d now = limit.follow({to, {}}, 0, diagonal).origin;
      ASSERT_LE(length(now - at), 0.02 * diagonal * (1 + 1e-9));
      if (limit.late()) {
        ASSERT_GE(length(now - at), 0.02 * diagonal * (1 - 1e-9)) << "it goes as far as it may,";
        ASSERT_LT(length(cross(now - at, to - at)), 1e-12 * diagonal * diagonal) << "straight";
      }
      ASSERT_LT(length(limit.move() - (now - at)), 1e-15 * length(to));
      at = now;
      ++ticks;
    } while (limit.late() && ticks < 100);
    EXPECT_EQ(ticks, 17) << "33 % of the diagonal";
    EXPECT_EQ(at, to);
  }
}

TEST(HandLimit, ATurnCountsByHowFarItMovesTheToolsEndAndGoesTheShortWay) {
  const double diagonal = 1, reach = 0.1;
  for (const double sign : {1.0, -1.0}) {  // of the quaternion: both are one orientation
    HandLimit limit;
    ToolPose at = limit.follow({{}, {}}, reach, diagonal);
    Quatd end = turned({0, 1, 0}, std::numbers::pi / 2);
    end = {sign * end.w, sign * end.x, sign * end.y, sign * end.z};
    int ticks = 0;
    do {
      const ToolPose now = limit.follow({{}, end}, reach, diagonal);
      ASSERT_NEAR(dot(now.orientation, now.orientation), 1, 1e-12);
      // Chord and arc: within a tenth over such a turn.
      ASSERT_LE(reach * angle_between(at.orientation, now.orientation), 1.1 * 0.02 * diagonal) << ticks;
      ASSERT_LE(angle_between(now.orientation, end), angle_between(at.orientation, end));
      at = now;
      ++ticks;
    } while (limit.late() && ticks < 100);
    EXPECT_NEAR(ticks, 8, 1);  // 0.157 of way
    EXPECT_EQ(at.orientation, end);
  }
}

TEST(HandLimit, WhereItBeginsAnewItIsWhereTheHandIs) {
  HandLimit limit;
  static_cast<void>(limit.follow({{0, 0, 0}, {}}, 0, 1));
  limit.reset();
  EXPECT_EQ(limit.follow({{9, 9, 9}, {}}, 0, 1).origin, (Vec3d{9, 9, 9}));
  EXPECT_FALSE(limit.late());
  EXPECT_EQ(limit.move(), Vec3d{});
}

TEST(HandLimit, NothingTunnelsWhileALeapIsCaughtUpWith) {
  for (const SnapshotPtr& model : testing::rough_models(32)) {
    const testing::TriangleSoup soup(*model);
    const double size = diagonal(model->slab_mesh().bounds());
    testing::ContactJudge judge(soup, false);
    Proxy proxy;
    HandLimit limit;
    testing::Leaps leaps(*model);
    LocateHint hint;
    const Box3d& box = model->slab_mesh().bounds();
    static_cast<void>(proxy.step(*model, limit.follow({box.centre() + box.extent(), {}}, 0, size).origin));
    int late = 0, held = 0, landed = 0;
    for (int k = 0; k < 400; ++k) {
      const Vec3d hand = leaps.next();
      // Some of the leaps are followed by others before they have come to their end.
      const int most = k % 3 == 0 ? 5 : 100;
      Vec3d cursor;
      for (int tick = 0; tick < most; ++tick) {
        cursor = limit.follow({hand, {}}, 0, size).origin;
        static_cast<void>(proxy.step(*model, cursor));
        const testing::Fault fault = judge.judge(proxy, cursor);
        ASSERT_EQ(fault, testing::Fault::None) << k << " " << tick << " " << testing::name(fault);
        held += proxy.held() ? 1 : 0;
        late += limit.late() ? 1 : 0;
        if (!limit.late()) break;
      }
      if (limit.late()) continue;
      ++landed;
      ASSERT_EQ(cursor, hand);
      // And at rest in the material, it is held.
      if (!proxy.held() && length(closest_point(*model, cursor).position - cursor) > 1e-6 * size) {
        ASSERT_FALSE(inside(*model, cursor, hint)) << k;
      }
    }
    EXPECT_GT(late, 3000);
    EXPECT_GT(held, 1000);
    EXPECT_GT(landed, 200);
  }
}

TEST(HandLimit, ASurfaceThatRisesPastACursorThatCatchesUpTakesItAlong) {
  // Over the crest of a tube, which is rough; in the middle of a leap along it, it grows.
  const auto mesh = testing::torus_shell(16, 10, 64);
  const auto rough_at = [&](double alpha) {
    return testing::displaced(
        mesh, [=](Vec3d p) { return alpha + 0.04 * std::sin(90 * p.x) * std::sin(80 * p.y + 70 * p.z); });
  };
  const SnapshotPtr low = rough_at(0.3), high = rough_at(0.9);
  const double size = diagonal(mesh->bounds());
  LocateHint hint;
  int risen = 0;
  for (int k = 0; k < 400; ++k) {
    const double turn = 0.016 * k;
    const Vec3d out = {std::cos(turn), 0, std::sin(turn)}, along = {-out.z, 0, out.x};
    const Vec3d start = closest_point(*low, out * 10.0).position + out * 0.02;
    Proxy proxy;
    HandLimit limit;
    static_cast<void>(proxy.step(*low, limit.follow({start, {}}, 0, size).origin));
    const Vec3d hand = start + along * (k % 2 == 0 ? 1.0 : 0.3);
    const Vec3d cursor = limit.follow({hand, {}}, 0, size).origin;
    ASSERT_TRUE(limit.late());
    static_cast<void>(proxy.step(*low, cursor));
    if (proxy.held() || !inside(*high, cursor, hint)) continue;
    ++risen;
    static_cast<void>(proxy.step(*high, limit.follow({hand, {}}, 0, size).origin));
    EXPECT_TRUE(proxy.held() || proxy.has_left()) << k;
    EXPECT_GT(proxy.rise(), 0) << k;
  }
  EXPECT_GT(risen, 100);
}

}  // namespace
}  // namespace relief
