// A rigid tool made of points: one point is as a point, many push together, turned tools turn back.
#include "support/driver.h"
#include "support/tools.h"
#include "support/wandering_hand.h"

#include <relief/core/query.h>
#include <relief/haptics/contact/point_shell.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

namespace relief {
namespace {

using testing::displaced;
using testing::flat_plane;
using testing::sphere_points;
using testing::torus_shell;

SnapshotPtr rough_torus() {
  return displaced(torus_shell(24, 12, 24), [](Vec3d p) {
    return 0.5 + 0.25 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.1 * std::sin(21 * p.y);
  });
}

TEST(PointShell, OnePointIsAsAProxy) {
  const SnapshotPtr model = rough_torus();
  const Vec3d own[] = {{0.1, -0.2, 0.05}};
  PointShell shell(own);
  Proxy proxy;
  testing::WanderingHand wandering;
  int held = 0, least_to_begin = 1 << 20;
  for (int k = 0; k < 5000; ++k) {
    const Vec3d hand = wandering.next();
    const bool was_held = shell.held() > 0;
    shell.step(*model, {hand, {}});
    proxy.step(*model, hand + own[0]);
    ASSERT_EQ(shell.held() > 0, proxy.held()) << k;
    if (!proxy.held()) continue;
    ++held;
    if (was_held) {
      ASSERT_EQ(shell.work(), 10 + proxy.samples_placed() * 4 / 3) << "samples' time that it counts";
    } else {
      least_to_begin = std::min(least_to_begin, shell.work());
    }
    ASSERT_NEAR(shell.depth(), proxy.depth(), 1e-9);
    ASSERT_LT(length(shell.push() - proxy.way_out() * proxy.depth()), 1e-9);
    ASSERT_LT(length(shell.twist() - cross(own[0], shell.push())), 1e-12);
  }
  EXPECT_GT(held, 500);
  // To ask whether the point is clear, to begin a contact, and the first step of that; beside what they place.
  EXPECT_GE(least_to_begin, 32 + 200 + 10);
  EXPECT_LT(least_to_begin, 32 + 200 + 10 + 150);
}

/// In the open a point that was asked is clear for three lengths of the way that it came, so it is asked ever more
/// seldom.
TEST(PointShell, AFreePointIsClearForThreeOfItsWays) {
  const SnapshotPtr model = flat_plane();
  const Vec3d own[] = {{0, 0, 0}};
  PointShell shell(own);
  std::vector<int> asked;
  for (int k = 0; k < 100; ++k) {
    shell.step(*model, {{0.01 * k, 5, 0.5}, {}});
    if (shell.work() == 0) continue;
    asked.push_back(k);
    EXPECT_NEAR(shell.work(), 32, 2);
  }
  // From a way of 1 it is clear for 3 from the way's middle: 2.5 beyond its end, which takes 3 ticks; and so on.
  EXPECT_EQ(asked, (std::vector<int>{1, 4, 12, 32, 82}));
}

TEST(PointShell, PushesWithTheGradientOfHalfItsDepthSquared) {
  const SnapshotPtr model = flat_plane();
  const std::vector<Vec3d> points = sphere_points(300, 0.2);
  PointShell shell(points);
  const auto energy = [&](Vec3d origin, Quatd q) {
    shell.reset();
    shell.step(*model, {{0.5, 0.5, 0.5}, q});
    for (int k = 1; k <= 50; ++k)
      shell.step(*model, {Vec3d{0.5, 0.5, 0.5} + (origin - Vec3d{0.5, 0.5, 0.5}) * (k / 50.0), q});
    for (int k = 0; k < 200; ++k) shell.step(*model, {origin, q});
    return 0.5 * shell.depth() * shell.depth();
  };
  const Vec3d place = {0.5, 0.16, 0.5};
  const double h = 1e-5;
  energy(place, {});
  const Vec3d push = shell.push(), twist = shell.twist();
  EXPECT_GT(shell.held(), 10);
  EXPECT_NEAR((energy(place - Vec3d{0, h, 0}, {}) - energy(place + Vec3d{0, h, 0}, {})) / (2 * h), push.y,
              1e-3 * push.y);
  const double by_angle = (energy(place, {1, -h / 2, 0, 0}) - energy(place, {1, h / 2, 0, 0})) / (2 * h);
  EXPECT_NEAR(by_angle, twist.x, 1e-3 * length(push) * 0.2);
  EXPECT_LE(length(push), shell.depth() * std::sqrt(shell.most_stiffening()) * (1 + 1e-9));
}

TEST(PointShell, PointsEquallyDeepPushByTheEighthRootOfTheirNumber) {
  const SnapshotPtr model = flat_plane();
  for (const int across : {1, 10, 31}) {
    std::vector<Vec3d> plate;
    for (int k = 0; k < across * across; ++k)
      plate.push_back({0.3 * (k % across) / across - 0.15, 0, 0.3 * (k / across) / across - 0.15});
    PointShell shell(plate);
    const auto place = [](double above) { return ToolPose{{0.5, above, 0.5}, {}}; };
    shell.step(*model, place(0.2));
    for (int k = 1; k <= 100; ++k) shell.step(*model, place(0.2 - 0.0022 * k));
    for (int k = 0; k < 300; ++k) shell.step(*model, place(-0.02));
    const double deep = 0.02, count = across * across;
    ASSERT_EQ(shell.held(), across * across);
    EXPECT_NEAR(shell.depth(), deep * std::pow(count, 1.0 / 16), 1e-6) << count;
    EXPECT_NEAR(length(shell.push()), deep * std::pow(count, 1.0 / 8), 1e-6) << count;
    EXPECT_NEAR(shell.most_stiffening(), std::pow(count, 1.0 / 8), 1e-12) << count;
  }
}

TEST(PointShell, ATiltedBarIsTurnedBack) {
  const SnapshotPtr model = flat_plane();
  std::vector<Vec3d> bar;
  for (int k = -10; k <= 10; ++k) bar.push_back({0.02 * k, 0, 0});
  PointShell shell(bar);
  const double half = 0.05;  // half the angle, about z: the right end is up
  const Quatd q = {std::cos(half), 0, 0, std::sin(half)};
  shell.step(*model, {{0.5, 0.2, 0.5}, q});
  for (int k = 1; k <= 100; ++k) shell.step(*model, {{0.5, 0.2 - 0.0019 * k, 0.5}, q});
  ASSERT_GT(shell.held(), 0);
  EXPECT_GT(shell.push().y, 0);
  EXPECT_LT(shell.twist().z, 0) << "the left end is pushed up, which turns clockwise about z";
}

TEST(PointShell, ManyPointsStayWithinTheirWorkAndEachKeepsItsSide) {
  const SnapshotPtr model = rough_torus();
  PointShell shell(sphere_points(1000, 0.3));
  EXPECT_EQ(shell.size(), 1000U);
  shell.step(*model, {{2, 1.8, 0}, {}});
  int most = 0;
  for (int k = 1; k <= 600; ++k) {
    const double t = k * 1e-3;
    const Vec3d place = {2 * std::cos(t), 1.8 - std::min(k, 300) * 0.0034, 2 * std::sin(t)};
    shell.step(*model, {place, {std::cos(t), 0, std::sin(t), 0}});
    most = std::max(most, shell.held());
    ASSERT_TRUE(shell.depth() <= 0.02 || shell.push().y > 0) << k;
  }
  EXPECT_GT(most, 100);
}

TEST(PointShell, FewPointsAreAsManyProxies) {
  const SnapshotPtr model = rough_torus();
  const std::vector<Vec3d> points = sphere_points(60, 0.2);
  PointShell shell(points);
  std::vector<Proxy> proxies(points.size());
  int held = 0, apart = 0;
  for (int k = 0; k < 3000; ++k) {
    const double t = k * 1e-3;
    const ToolPose pose = {{2 * std::cos(t), 1.05 + 0.15 * std::cos(5 * t), 2 * std::sin(t)},
                           {std::cos(t), 0, std::sin(t), 0}};
    shell.step(*model, pose);
    EXPECT_EQ(shell.waited(), 0);
    double norm = 0;
    int count = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      proxies[i].step(*model, pose.place(points[i]));
      if (!proxies[i].held()) continue;
      ++count;
      norm += std::pow(proxies[i].depth(), 16);
    }
    const double depth = std::pow(norm, 1.0 / 16);
    held += shell.held();
    // A point may meet the surface at another place than its proxy, which goes there in shorter steps.
    ASSERT_NEAR(shell.held(), count, 3) << k;
    apart += std::abs(shell.depth() - depth) > 1e-6 ? 1 : 0;
  }
  EXPECT_GT(held, 4000);
  EXPECT_LT(apart, 60);
}

TEST(PointShell, NoPointWaitsLong) {
  const SnapshotPtr model = rough_torus();
  // A hand that shakes the tool through the rough, as deep as it is long: at up to 0.25 m/s, and at more than 1 m/s, if
  // the torus is as large as the device's workspace of 0.15 m.
  for (const auto& [speed, longest] : {std::pair{0.3, 30}, std::pair{1.0, 100}}) {
    PointShell shell(sphere_points(1000, 0.3));
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    Vec3d hand = {2, 1.4, 0}, way;
    int most = 0, held = 0;
    double fastest = 0;
    for (int k = 0; k < 2000; ++k) {
      way = way * 0.98 + Vec3d{normal(random), normal(random), normal(random)} * (2e-3 * speed) +
            (Vec3d{2, 0.9, 0} - hand) * (2e-3 * speed * speed);
      hand += way;
      fastest = std::max(fastest, length(way));
      const double turn = 3e-3 * speed * k;
      shell.step(*model, {hand, {std::cos(turn), 0, std::sin(turn), 0}});
      most = std::max(most, shell.waited());
      held = std::max(held, shell.held());
    }
    EXPECT_GT(held, 500);
    EXPECT_GT(fastest, 0.03 * speed);
    EXPECT_LE(most, longest);
  }
}

/// Of a tool that glides over the rough a point is asked once in some ticks, each time for a few samples.
TEST(PointShell, FreePointsTakeLittleWork) {
  const SnapshotPtr model = rough_torus();
  constexpr int kPoints = 200, kTicks = 1000;
  PointShell shell(sphere_points(kPoints, 0.3));
  double work = 0;
  for (int k = 0; k < kTicks; ++k) {
    const double t = 1e-3 * k;
    shell.step(*model, {.origin = {2 * std::cos(t), 1.3, 2 * std::sin(t)}, .orientation = {}});
    ASSERT_EQ(shell.held(), 0) << k;
    work += shell.work();
  }
  EXPECT_LT(work / (kPoints * kTicks), 1.5) << "samples' time per point and tick";
}

/// Where there is no time for all in a tick, what is felt is nearly what it would be if there were.
TEST(PointShell, WithoutTimeForAllPointsItIsFeltNearlyAsWithIt) {
  const SnapshotPtr model = rough_torus();
  const std::vector<Vec3d> points = sphere_points(1000, 0.3);
  PointShell shell(points);
  std::vector<Proxy> all(points.size());
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  Vec3d hand = {2, 1.4, 0}, way;
  double off = 0;
  int pushed = 0, waited = 0, left = 0;
  for (int k = 0; k < 1500; ++k) {
    way = way * 0.98 + Vec3d{normal(random), normal(random), normal(random)} * 2e-4 + (Vec3d{2, 0.9, 0} - hand) * 2e-5;
    hand += way;
    const double turn = 3e-4 * k;
    const ToolPose pose = {hand, {std::cos(turn), 0, std::sin(turn), 0}};
    shell.step(*model, pose);
    waited = std::max(waited, shell.waited());
    left += shell.worked() < shell.held() ? 1 : 0;
    double norm = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      all[i].step(*model, pose.place(points[i]));
      if (all[i].held()) norm += std::pow(all[i].depth(), 16);
    }
    if (norm == 0) continue;
    ++pushed;
    const double depth = std::pow(norm, 1.0 / 16);
    off += std::abs(shell.depth() - depth) / depth;
  }
  EXPECT_GT(pushed, 500);
  EXPECT_GT(left, 300) << "there was no time for all";
  EXPECT_LT(off / pushed, 9e-4);
  EXPECT_LE(waited, 6);
}

TEST(PointShell, ASurfaceThatRisesSlowlyPastRestingPointsIsFelt) {
  const auto mesh = testing::plane_shell(4, 8);
  PointShell shell(sphere_points(1000, 0.02));
  double deepest = 0;
  bool settles = true;
  for (int k = 0; k <= 300; ++k) {
    // From 0 to 0.015; the lowest point is at 0.002.
    const double height = std::min(k, 150) * 1e-4;
    const SnapshotPtr model = displaced(mesh, [=](Vec3d) { return 0.5 + height / 0.2; });
    shell.step(*model, {{0.5, 0.022, 0.5}, {}});
    settles = settles && shell.settling() == (k > 0);
    EXPECT_LT(shell.depth() - deepest, 1e-3) << "without a step, " << k;
    EXPECT_LT(shell.rise(), 1e-3);
    deepest = shell.depth();
  }
  EXPECT_TRUE(settles);
  EXPECT_GT(shell.held(), 200);
  EXPECT_GT(shell.depth(), 0.0125);
}

TEST(PointShell, SaysThatItSettlesForAsLongAsAnEditMovesIt) {
  const auto mesh = torus_shell(24, 12, 24);
  std::vector<SnapshotPtr> models;
  for (const double high : {0.0, 0.03, -0.05})
    models.push_back(displaced(
        mesh, [=](Vec3d p) { return 0.5 + high * std::cos(40 * p.x) + 0.2 * std::sin(9 * p.x) * std::cos(8 * p.z); }));
  PointShell shell(sphere_points(60, 0.08));
  testing::WanderingHand wandering;
  shell.step(*models[0], {wandering.next(), {}});
  int pushed = 0, settling = 0, long_after = 0;
  for (int k = 0; k < 6000; ++k) {
    const Snapshot& model = *models[std::size_t(k / 40) % 3];
    const bool now = shell.step(model, {wandering.next(), {}});
    settling += shell.settling() ? 1 : 0;
    long_after += shell.settling() && k % 40 > 10 ? 1 : 0;
    ASSERT_EQ(now, shell.held() > 0) << k;
    if (shell.push() == Vec3d{}) continue;
    ++pushed;
    // What is told lies on the surface as it is now, whenever it was made.
    const SurfacePoint near = closest_point(model, shell.surface().position);
    ASSERT_LT(length(near.position - shell.surface().position), 1e-9) << k;
  }
  EXPECT_GT(pushed, 1000);
  EXPECT_GE(settling, 149) << "in each tick in which the surface is another";
  EXPECT_EQ(long_after, 0);
}

TEST(PointShell, LetsGoWhereTheHandTakesItOutPastARim) {
  const SnapshotPtr disc = displaced(
      testing::mapped_shell(*testing::sphere_shell(2, 24), [](Vec3d p) { return Vec3d{p.x, 0.02 * p.y, p.z}; }),
      [](Vec3d) { return 0.5; });
  PointShell shell(sphere_points(20, 0.02));
  Vec3d hand = {0.7, 0.1, 0};
  shell.step(*disc, {hand, {}});
  double deepest = 0;
  for (int k = 0; k < 800; ++k) {
    hand += k < 200 ? Vec3d{0, -1e-3, 0} : Vec3d{1e-3, 0, 0};  // down through the disc, and out past its rim
    const Vec3d before = shell.push();
    shell.step(*disc, {hand, {}});
    EXPECT_FALSE(shell.settling()) << "it is the hand that lets go, " << k;
    EXPECT_LE(length(shell.push() - before), 1e-3 + std::max(10e-3, 0.02 * length(before))) << k;
    deepest = std::max(deepest, shell.depth());
  }
  EXPECT_GT(deepest, 0.05);
  EXPECT_EQ(shell.push(), (Vec3d{}));
}

/// A bar of two ends lies across a ridge that is lower on one side; the hand pushes it along, until one end slips off
/// and then the other one. Neither the push nor the torque drops by more than the hand's way allows, and under a hand
/// at rest they go by a fiftieth of what is left in a tick.
TEST(PointShell, APointThatSlipsOffLeavesThePushInSteps) {
  const SnapshotPtr step = displaced(testing::plane_shell(8, 32, 0.5), [](Vec3d p) { return p.x < 0.5 ? 0.8 : 0.2; });
  constexpr double kArm = 0.1, kMove = 5e-4;
  for (const bool rests : {false, true}) {
    PointShell shell(std::vector<Vec3d>{{0.01, 0, -kArm}, {0, 0, kArm}});
    Vec3d hand = {0.42, 0.4, 0.5};
    shell.step(*step, {hand, {}});
    for (int k = 0; k < 300; ++k) shell.step(*step, {hand -= Vec3d{0, 5e-4, 0}, {}});
    ASSERT_GT(shell.push().y, 0.04);
    int slipped = 0;
    for (int k = 0; k < 800 && !(rests && slipped > 0 && shell.held() == 0); ++k) {
      const Vec3d push = shell.push(), twist = shell.twist();
      const int held = shell.held();
      shell.step(*step, {hand += Vec3d{kMove, 0, 0}, {}});
      slipped += shell.held() < held ? 1 : 0;
      EXPECT_LE(length(shell.push() - push), 11 * kMove) << k;
      EXPECT_LE(length(shell.twist() - twist), 10 * kMove * 1.1 * kArm) << k;
    }
    EXPECT_EQ(slipped, 2);
    for (int k = 0; rests && k < 200; ++k) {
      const double push = length(shell.push());
      shell.step(*step, {hand, {}});
      EXPECT_NEAR(length(shell.push()), 0.98 * push, 1e-6) << k;
    }
    for (int k = 0; rests && k < 700; ++k) shell.step(*step, {hand, {}});
    EXPECT_EQ(shell.push(), Vec3d{});
  }
}

/// The tool is led on closed ways, through ridges off which its points slip: the hand gets no more than it put in.
TEST(PointShell, OverClosedWaysTheHandGetsNothing) {
  const SnapshotPtr ridges = displaced(testing::plane_shell(8, 32, 0.5), [](Vec3d p) {
    return 0.5 + 0.3 * std::pow(std::cos(20 * p.x) * std::cos(20 * p.z), 4);
  });
  double most = 0;
  for (const double turn : {0.0, 1.0, 2.5}) {
    PointShell shell(sphere_points(60, 0.03));
    Vec3d hand = {0.5, 0.5, 0.5 + 0.2 * std::sin(turn)}, push;
    shell.step(*ridges, {hand, {}});
    double got = 0;
    for (int k = 1; k <= 6000; ++k) {
      const double t = 2 * std::numbers::pi * k / 3000;
      const Vec3d next = {0.5 + 0.2 * std::sin(t) * std::cos(turn), 0.2 + 0.3 * std::cos(t) * std::cos(0.5 * t),
                          0.5 + 0.2 * std::sin(t + turn)};
      shell.step(*ridges, {next, {}});
      got += dot((shell.push() + push) * 0.5, next - hand);
      push = shell.push();
      most = std::max(most, 0.5 * shell.depth() * shell.depth());
      hand = next;
    }
    EXPECT_EQ(push, Vec3d{});
    EXPECT_LT(got, 1e-3 * most) << turn;
  }
  EXPECT_GT(most, 1e-4);
}

TEST(PointShell, IsClearOnlyWhereNoPointIsInside) {
  const SnapshotPtr model = rough_torus();
  PointShell shell(sphere_points(100, 0.2));
  const auto clear = [&](Vec3d place) {
    for (int k = 0; k < 20; ++k)
      if (shell.clear(*model, {place, {}})) return true;
    return false;
  };
  EXPECT_TRUE(clear({0, 2, 0}));
  EXPECT_FALSE(clear({2, 0, 0}));
  EXPECT_TRUE(clear({0, 0, 0})) << "in the hole of the torus";
  EXPECT_FALSE(clear({2, 0.9, 0}));
}

TEST(PointShell, LooksForFourPointsAmongTheSlabsATick) {
  // A ring of 40 points above the inner flank of the torus, which is within the ring's ball.
  const SnapshotPtr model = rough_torus();
  std::vector<Vec3d> ring;
  for (int k = 0; k < 40; ++k)
    ring.push_back(
        {1.3 * std::cos(2 * std::numbers::pi * k / 40), 0.85, 1.3 * std::sin(2 * std::numbers::pi * k / 40)});
  PointShell shell(ring);
  for (int twice = 0; twice < 2; ++twice) {
    int asked = 1;
    while (!shell.clear(*model, {}) && asked < 100) ++asked;
    EXPECT_EQ(asked, 10);
  }
}

TEST(PointShell, ASurfaceThatRisesPastFreePointsIsSeen) {
  const auto mesh = testing::plane_shell(4, 8);
  const SnapshotPtr low = displaced(mesh, [](Vec3d) { return 0.5; });
  const SnapshotPtr high = displaced(mesh, [](Vec3d) { return 0.8; });  // from 0 to 0.06
  PointShell shell(sphere_points(50, 0.02));
  for (int k = 0; k < 5; ++k) shell.step(*low, {{0.5, 0.03, 0.5}, {}});
  double rise = 0;
  for (int k = 0; k < 5; ++k) {
    shell.step(*high, {{0.5, 0.03, 0.5}, {}});
    rise = std::max(rise, shell.rise());
  }
  EXPECT_NEAR(rise, 0.05, 0.01) << "the lowest point, at 0.01";
}

TEST(PointShell, PointsBeyondTheMostAreLeftOut) {
  EXPECT_EQ(PointShell(sphere_points(1200, 1)).size(), TouchTool::kMostPoints);
  EXPECT_EQ(PointShell({}).size(), 0U);
}

}  // namespace
}  // namespace relief
