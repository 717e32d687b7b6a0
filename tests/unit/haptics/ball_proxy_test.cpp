// A ball on the surface: planes, spheres, creases, thin parts, rough ground, a surface that changes under it.
#include "support/driver.h"
#include "support/shells.h"

#include <relief/core/query.h>
#include <relief/haptics/contact/ball_mover.h>
#include <relief/haptics/contact/ball_proxy.h>
#include <relief/haptics/contact/half_spaces.h>
#include <relief/haptics/touch.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

namespace relief {
namespace {

using testing::displaced;
using testing::fine_sphere;
using testing::flat_plane;
using testing::plane_shell;
using testing::torus_shell;

/// Goes straight in so many ticks.
void lead(BallProxy& ball, const Snapshot& model, Vec3d from, Vec3d to, double radius, int ticks) {
  for (int k = 1; k <= ticks; ++k) ball.step(model, from + (to - from) * (double(k) / ticks), radius);
}

TEST(HalfSpaces, TheNearestPointIsFeasibleAndNoneFoundByTryingIsNearer) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 2000; ++k) {
    std::vector<detail::HalfSpace> spaces(static_cast<std::size_t>(1 + k % 12));
    for (auto& s : spaces) {
      s.normal = normalized(Vec3d{normal(random), normal(random), normal(random)});
      s.offset = -std::abs(normal(random));  // the origin is in all of them
    }
    const Vec3d goal = Vec3d{normal(random), normal(random), normal(random)} * 3.0;
    const auto x = detail::nearest_in(spaces, goal, 1e-12);
    ASSERT_TRUE(x);
    for (const auto& s : spaces) ASSERT_GE(s.room(*x), -1e-9);
    // No step towards the goal's side stays inside: the conditions of Karush, Kuhn and Tucker, by trial.
    for (int trial = 0; trial < 200; ++trial) {
      const Vec3d y = *x + Vec3d{normal(random), normal(random), normal(random)} * std::pow(10, -trial % 5);
      bool in = true;
      for (const auto& s : spaces) in = in && s.room(y) >= 0;
      if (!in) continue;
      ASSERT_GE(length(y - goal), length(*x - goal) - 1e-9);
    }
  }
}

TEST(HalfSpaces, NearlyParallelPlanesThatTouchLeaveAPlace) {
  // As many facets of a smooth surface do to a ball that lies on them, some of them twice.
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(0, 1);
  constexpr double kSlack = 1e-9;
  for (const double cone : {1e-6, 1e-5, 1e-4, 3e-4, 1e-3, 1e-2, 1e-1})
    for (int k = 0; k < 5000; ++k) {
      const Vec3d up = normalized(Vec3d{normal(random), normal(random), normal(random)});
      std::vector<detail::HalfSpace> spaces(static_cast<std::size_t>(2 + k % 8));
      for (auto& s : spaces) {
        s.normal = normalized(up + Vec3d{normal(random), normal(random), normal(random)} * cone);
        const double room = unit(random);
        s.offset = room < 0.5 ? (room - 0.25) * 4e-11 : -0.01 * std::pow(10, -16 * (room - 0.5));
      }
      for (int twice = 0; twice < 2; ++twice) {
        detail::HalfSpace again = spaces[static_cast<std::size_t>(twice)];
        again.normal = normalized(again.normal + Vec3d{1e-16, -1e-16, 1e-16});
        spaces.push_back(again);
      }
      const Vec3d goal = up * -0.5 + Vec3d{normal(random), normal(random), normal(random)} * 0.2;
      const auto x = detail::nearest_in(spaces, goal, kSlack);
      ASSERT_TRUE(x) << cone;
      for (const auto& s : spaces) ASSERT_GE(s.room(*x), -kSlack * 1.000001) << cone;
      ASSERT_LE(length(*x - goal), length(goal) + kSlack) << cone;  // the origin is in all of them, but for rounding
    }
}

TEST(HalfSpaces, SqueezedFromBothSidesThereIsNoPlace) {
  detail::HalfSpace spaces[] = {{{0, 1, 0}, 1}, {{0, -1, 0}, 1}};
  EXPECT_FALSE(detail::nearest_in(spaces, {}, 1e-9));
}

TEST(HalfSpaces, OppositePlanesButForRoundingMeetNowhere) {
  // Two walls of a slot, each asking for a little: where their planes would meet is rounding, and far away.
  for (const double off : {1e-17, 1e-16, -3e-16, 1e-13}) {
    detail::HalfSpace spaces[] = {{{0, 1, 0}, 1e-4}, {{off, -1, -off}, 1e-4}};
    const auto found = detail::nearest_in(spaces, {}, 1e-9);
    EXPECT_FALSE(found) << off << ": " << (found ? length(*found) : 0);
  }
  // Nearly so, but for no rounding, they meet.
  detail::HalfSpace open[] = {{{0, 1, 0}, 1e-9}, {{-1e-8, -1, 0}, -0.5e-9}};
  const auto there = detail::nearest_in(open, {}, 1e-12);
  ASSERT_TRUE(there);
  EXPECT_NEAR(there->x, -0.05, 1e-6);
}

/// Two planes meet in a line, which a third one leaves no room for: along the line, but for rounding, it does so
/// everywhere; across it, be it at the smallest angle, only up to a place.
TEST(HalfSpaces, APlaneAlongTheLineOfTwoOthersHasNoEndOnIt) {
  const auto nearest = [](double tilt) {
    detail::HalfSpace spaces[] = {{{0, 1, 0}, 1}, {{1, 0, 0}, 0.9 + 2e-9}, {{-0.6, -0.8, tilt}, -0.6 * 0.9 - 0.8}};
    return detail::nearest_in(spaces, {5, 5, 0}, 1e-9);
  };
  EXPECT_FALSE(nearest(1e-16));
  EXPECT_FALSE(nearest(-1e-16));
  const auto found = nearest(1e-9);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->z, 1.2, 1e-3);
}

TEST(BallMover, ARidgeIsNoBackForRoundingsSake) {
  // The nearest point of two triangles that share an edge is the same; its two distances differ in the last bit.
  detail::ball::Around around;
  const Vec3d edge = {0, -1, 0};
  detail::NearTriangle face{}, back{};
  face.relative = {edge + Vec3d{0, 0, -1}, edge + Vec3d{0, 0, 1}, edge + Vec3d{-1, -0.1, 0}};
  back.relative = {edge + Vec3d{0, 0, 1}, edge + Vec3d{0, 0, -1}, edge + Vec3d{0.1, -1, 0}};
  if (detail::ball::shows_its_back(face)) std::swap(face.relative[0], face.relative[1]);
  if (!detail::ball::shows_its_back(back)) std::swap(back.relative[0], back.relative[1]);
  face.distance2 = std::nextafter(1.0, 2.0);
  back.distance2 = 1;
  around.triangles[0] = face;
  around.triangles[1] = back;
  around.count = 2;
  EXPECT_FALSE(detail::ball::is_behind(around, 1.5));
}

/// What a tick may take is counted in samples that are placed: beside its query, a step takes as long as eight and one
/// for each plane, and a triangle that is near as long as two.
TEST(BallMover, AStepIsCountedWithItsPlanesAndTheTrianglesThatItFinds) {
  const SnapshotPtr model = displaced(plane_shell(1, 4), [](Vec3d) { return 0.5; });
  MicroTriangles surface(*model);
  const double radius = 0.05, near = radius * (1 + detail::ball::kSkin), flat = detail::ball::kFlat * radius;
  const Vec3d from = {0.3, radius, 0.3}, to = from + Vec3d{1e-4, 0, 0};
  const auto room = std::make_unique<detail::ball::Room>();
  const auto go = [&](Vec3d start, Vec3d goal) {
    detail::ball::Mover ball(surface, *room, start, radius, 0, detail::kAnyWork);
    const int before = surface.placed(), planes = ball.around().count;
    static_cast<void>(ball.advance(goal, detail::kAnywhere, detail::ball::Mover::Until::Reach, false,
                                   BallProxy::kSearches, detail::kAnyWork, detail::kAnyWork));
    ball.stay();
    EXPECT_EQ(ball.centre(), goal);
    return std::array{surface.placed() - before, ball.searches(), planes};
  };
  detail::ball::Mover(surface, *room, to, radius, 0, detail::kAnyWork).stay();
  go(to, from);  // so that all is known
  detail::Neighbourhood list;
  const auto patches = std::make_unique<detail::Patches>();
  list.gather(surface, to, near, near + radius, flat, detail::kAnyWork);
  int look = 0, found = 0;
  for (int k = 0; k < 2; ++k) {  // the second time the patches are known, as they are for the step
    const int before = surface.placed();
    double reach2 = near * near;
    found = 0;
    list.visit_near(surface, *patches, to, reach2, detail::kAnyWork, [&](const detail::NearTriangle&) { ++found; });
    look = surface.placed() - before;
  }
  EXPECT_EQ(found, 2);
  const auto [work, searches, planes] = go(from, to);
  EXPECT_EQ(searches, 1);
  EXPECT_EQ(planes, 2);
  EXPECT_EQ(work, look + 2 * found + 8 + planes);
}

/// What the ball may come to next is minded before it is there: a thousandth of the radius beyond it. Over a plane that
/// is a disc of 0.045 radii.
TEST(BallMover, MindsWhatIsAThousandthOfTheRadiusBeyondIt) {
  const SnapshotPtr model = displaced(plane_shell(1, 4), [](Vec3d) { return 0.5; });
  MicroTriangles surface(*model);
  const double radius = 0.05;
  for (const double beside : {0.04, 0.05}) {  // radii to the next cells
    const auto room = std::make_unique<detail::ball::Room>();
    const Vec3d centre = {0.5 + beside * radius, radius, 0.35};
    const detail::ball::Mover ball(surface, *room, centre, radius, 0, detail::kAnyWork);
    EXPECT_EQ(ball.around().count, beside < 0.0447 ? 2 : 1) << beside;
  }
}

/// A step after which less than a twentieth of it is left is the last of its tick. Over an edge the ball's centre goes
/// round a circle; of a step along the tangent as much is left as the hand is deep, in radii.
TEST(BallProxy, LeavesATwentiethOfAStepToTheNextTick) {
  const SnapshotPtr ridge = displaced(plane_shell(8, 32, 0.5), [](Vec3d p) { return 0.5 - 0.5 * std::abs(p.x - 0.5); });
  const double radius = 0.05, turn = 0.02;
  for (const double deep : {0.04, 0.07}) {
    const double out = radius * (1 - deep);
    BallProxy ball;
    ball.step(*ridge, {0.5, 0.2, 0.47}, radius);
    lead(ball, *ridge, {0.5, 0.2, 0.47}, {0.5, out, 0.47}, radius, 40);
    ASSERT_NEAR(ball.centre().x, 0.5, 1e-6);
    ASSERT_NEAR(ball.depth(), deep * radius, 1e-6);
    ball.step(*ridge, {0.5 + out * std::sin(turn), out * std::cos(turn), 0.47}, radius);
    const double left = 1 - std::atan2(ball.centre().x - 0.5, ball.centre().y) / turn;
    EXPECT_NEAR(left, deep < 0.05 ? deep : deep * deep, 2e-3) << deep;
  }
}

/// On uneven ground a ball hardly ever comes to rest in a tick: what it all but touches is where it touches.
TEST(BallProxy, TellsWhereItTouchesAlsoWhereItNeverRests) {
  const SnapshotPtr waves = displaced(
      plane_shell(16, 64, 0.02), [](Vec3d p) { return 0.5 + 0.006 * std::sin(2 * 3.14159265358979 * p.x / 0.003125); });
  constexpr double kRadius = 0.04;
  for (const double step : {1.5e-4, 7e-4, 2.4e-3}) {
    BallProxy ball;
    ball.step(*waves, {0.1, 0.05, 0.4}, kRadius);
    lead(ball, *waves, {0.1, 0.05, 0.4}, {0.1, kRadius - 6e-4, 0.4}, kRadius, 20);
    double farthest = 0;
    for (double x = 0.1; x < 0.1 + 300 * step; x += step) {
      ball.step(*waves, {x, kRadius - 6e-4, 0.4}, kRadius);
      farthest = std::max(farthest, length(ball.surface().position - ball.centre()));
    }
    EXPECT_LT(farthest, 1.05 * kRadius) << step;
  }
}

TEST(BallRange, IsFromAMillionthToATwentiethOfTheDiagonal) {
  const BallRange range = ball_range(2);
  for (const double radius : {2.1e-6, 0.01, 0.099}) EXPECT_TRUE(range.has(radius)) << radius;
  for (const double radius : {0.0, 1.9e-6, 0.101}) EXPECT_FALSE(range.has(radius)) << radius;
}

TEST(BallProxy, RestsOnAPlaneAtItsRadius) {
  const SnapshotPtr model = flat_plane();
  BallProxy ball;
  ball.step(*model, {0.4, 0.08, 0.6}, 0.03);
  lead(ball, *model, {0.4, 0.08, 0.6}, {0.4, 0.031, 0.6}, 0.03, 10);
  EXPECT_FALSE(ball.held());
  lead(ball, *model, {0.4, 0.031, 0.6}, {0.4, -0.02, 0.6}, 0.03, 20);
  ASSERT_TRUE(ball.held());
  EXPECT_NEAR(ball.centre().y, 0.03, 1e-5);
  EXPECT_NEAR(ball.depth(), 0.05, 1e-5);
  EXPECT_NEAR(ball.way_out().y, 1, 1e-9);
  EXPECT_NEAR(ball.surface().position.y, 0, 1e-9);
  EXPECT_NEAR(ball.surface().position.x, 0.4, 1e-3);
  lead(ball, *model, {0.4, -0.02, 0.6}, {0.4, 0.05, 0.6}, 0.03, 20);
  EXPECT_FALSE(ball.held());
}

TEST(BallProxy, LessThanAMillionthOfTheRadiusIsNoStep) {
  const SnapshotPtr model = flat_plane();
  const double radius = 0.05;
  const Vec3d hand = {0.4, -0.02, 0.6};
  BallProxy ball;
  ball.step(*model, {0.4, 0.08, 0.6}, radius);
  lead(ball, *model, {0.4, 0.08, 0.6}, hand, radius, 20);
  const Vec3d rest = ball.centre();
  ball.step(*model, hand + Vec3d{0.5e-6 * radius, 0, 0}, radius);
  EXPECT_EQ(ball.centre(), rest);
  ball.step(*model, hand + Vec3d{2e-6 * radius, 0, 0}, radius);
  EXPECT_NEAR(ball.centre().x - rest.x, 2e-6 * radius, 1e-8 * radius);
}

/// Every other sample is lower. Of a radius: 2e-5 are as if they were not, 6e-5 are felt.
TEST(BallProxy, UnevennessOfThreeHundredThousandthsIsNotFelt) {
  const double radius = 0.05;
  constexpr int kCells = 8 * 32;
  const auto swing = [&](double share) {
    const SnapshotPtr model = displaced(plane_shell(8, 32, 0.005), [&](Vec3d p) {
      const auto number = std::lround(p.x * kCells) + std::lround(p.z * kCells);
      return 0.5 - (number % 2 == 0 ? 0 : share * radius / 0.01);
    });
    BallProxy ball;
    const Vec3d from = {0.3, 0.1, 0.4}, hand = {0.3, -0.01, 0.4};
    ball.step(*model, from, radius);
    lead(ball, *model, from, hand, radius, 50);
    double least = 1, most = 0;
    for (int k = 0; k < 200; ++k) {
      ball.step(*model, hand + Vec3d{1e-4 * k, 0, 3e-5 * k}, radius);
      least = std::min(least, ball.centre().y);
      most = std::max(most, ball.centre().y);
    }
    return (most - least) / radius;
  };
  EXPECT_LT(swing(2e-5), 1e-6);
  EXPECT_GT(swing(6e-5), 3e-6);
}

TEST(BallProxy, IsFeltWhereEdgesAreStitched) {
  // Next to a slab of smaller n some cells are drawn together to an edge or a corner, and others reach over them.
  const auto model = displaced(testing::mixed_shell(*plane_shell(3, 1, 0.25), 1, 4), [](Vec3d) { return 0.5; });
  const double height = surface_point(*model, 0, 0.3, 0.3).position.y;
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(0.05, 0.95);
  for (int k = 0; k < 3000; ++k) {
    const Vec3d above = {unit(random), height + 0.004, unit(random)};
    BallProxy ball;
    ASSERT_FALSE(ball.step(*model, above, 0.002));
    lead(ball, *model, above, above - Vec3d{0, 0.004, 0}, 0.002, 10);
    ASSERT_TRUE(ball.step(*model, above - Vec3d{0, 0.0041, 0}, 0.002)) << above.x << " " << above.z;
    ASSERT_LT(length(ball.surface().position - Vec3d{above.x, height, above.z}), 1e-9);
  }
}

TEST(BallProxy, OnASphereItsCentreIsOnTheLargerSphere) {
  const SnapshotPtr model = fine_sphere();
  const double radius = 0.15;
  BallProxy ball;
  const Vec3d out = normalized(Vec3d{1, 2, 3});
  ball.step(*model, out * 1.3, radius);
  lead(ball, *model, out * 1.3, out * 1.1, radius, 20);
  // Slides a quarter round.
  const Vec3d side = normalized(cross(out, Vec3d{0, 1, 0}));
  for (int k = 1; k <= 400; ++k) {
    const double angle = 1.57 * k / 400;
    const Vec3d goal = (out * std::cos(angle) + side * std::sin(angle)) * 1.1;
    ball.step(*model, goal, radius);
    ASSERT_TRUE(ball.held()) << k;
    ASSERT_NEAR(length(ball.centre()), 1 + radius, 5e-4) << k;
    ASSERT_GT(dot(ball.way_out(), normalized(goal)), std::cos(0.01)) << k;
  }
}

TEST(BallProxy, InACreaseItTouchesBothSidesAndGoesNoDeeper) {
  // A valley of two planes at 45 degrees along x = 0.5.
  const SnapshotPtr model = displaced(plane_shell(8, 32, 0.5), [](Vec3d p) { return 0.3 + std::abs(p.x - 0.5); });
  const double radius = 0.05, rest = -0.2 + radius * std::sqrt(2.0);
  BallProxy ball;
  ball.step(*model, {0.5, 0.2, 0.5}, radius);
  lead(ball, *model, {0.5, 0.2, 0.5}, {0.52, -0.25, 0.5}, radius, 60);
  ASSERT_TRUE(ball.held());
  EXPECT_NEAR(ball.centre().x, 0.5, 2e-4);
  EXPECT_NEAR(ball.centre().y, rest, 4e-4);
  for (const double z : {0.5, 0.55, 0.6}) {
    for (int k = 0; k < 40; ++k) ball.step(*model, {0.5, -0.25, z}, radius);
    EXPECT_NEAR(ball.centre().y, rest, 4e-4);
  }
}

/// Over rough ground, whatever the hand does: never in the material, never further from the hand than it was.
TEST(BallProxy, IsNeverInTheMaterial) {
  const SnapshotPtr model = displaced(torus_shell(24, 12, 24), [](Vec3d p) {
    return 0.5 + 0.25 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.1 * std::sin(21 * p.y);
  });
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (const double radius : {0.01, 0.04, 0.2}) {
    BallProxy ball;
    Vec3d hand = {0, 3, 0}, way;
    ball.step(*model, hand, radius);
    int held = 0;
    for (int k = 0; k < 6000; ++k) {
      way = way * 0.9 + Vec3d{normal(random), normal(random), normal(random)} * 0.01 - hand * 1e-3;
      if (k % 500 == 499) way = way * 30.0;
      hand += way;
      ball.step(*model, hand, radius);
      held += ball.held();
      const double distance = length(closest_point(*model, ball.centre()).position - ball.centre());
      ASSERT_GE(distance, radius * (1 - 1e-8)) << "tick " << k << ", radius " << radius;
      ASSERT_LE(ball.searches(), BallProxy::kSearches + 1);
      ASSERT_TRUE(ball.held() || ball.centre() == hand);
    }
    EXPECT_GT(held, 1000) << radius;
  }
}

/// A leap over hundreds of radii in the open takes a few ticks, in which the ball is under way, not held for good.
TEST(BallProxy, ArrivesAfterALeapInTheOpen) {
  const SnapshotPtr model = displaced(plane_shell(2, 32, 0.1), [](Vec3d) { return 0.5; });
  const double radius = 1e-3;
  for (const double height : {0.05, 0.15, 0.3}) {
    BallProxy ball;
    ball.step(*model, {0.5, height, 0.5}, radius);
    int ticks = 0;
    do {
      EXPECT_FALSE(ball.step(*model, {0.5, 0.04, 0.5}, radius));
      EXPECT_EQ(ball.held(), ball.under_way());
    } while (++ticks < 10 && ball.held());
    EXPECT_LE(ticks, 4) << height;
  }
}

/// Wherever a hand shakes, presses and jumps on fine rough ground, a tick takes no more than it may: most by the
/// budget, and all with the one look, and the list for it, that none goes without.
TEST(BallProxy, NoTickTakesLong) {
  const SnapshotPtr model = displaced(torus_shell(16, 8, 128), [](Vec3d p) {
    return 0.5 + 0.25 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.1 * std::sin(21 * p.y) + 0.02 * std::sin(90 * p.x);
  });
  const Box3d& box = model->slab_mesh().bounds();
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto any = [&](double size) { return Vec3d{normal(random), normal(random), normal(random)} * size; };
  std::vector<int> work;
  int held = 0;
  for (const double share : {0.003, 0.01, 0.03}) {
    const double radius = share * diagonal(box);
    BallProxy ball;
    Vec3d hand = {0, 3, 0}, way;
    ball.step(*model, hand, radius);
    for (int k = 0; k < 8000; ++k) {
      way = way * 0.9 + any(k % 1000 < 500 ? 0.05 * radius : 0.5 * radius) - hand * 1e-3;
      hand += way;
      if (k % 100 == 99) hand = closest_point(*model, any(1.5)).position;
      held += ball.step(*model, hand, radius);
      work.push_back(ball.work());
    }
  }
  EXPECT_GT(held, 5000);
  std::ranges::sort(work);
  const auto share_of = [&](double q) {
    return work[static_cast<std::size_t>(q * static_cast<double>(work.size() - 1))];
  };
  EXPECT_LT(share_of(0.9), 800);
  EXPECT_LT(share_of(0.99), 2500);  // a ball that is late may take more with each tick
  EXPECT_LT(share_of(0.999), 4300);
  EXPECT_LT(share_of(1), 5500);
}

/// What a tick may take at most, whatever the ground: a look ends with the square that it is at.
constexpr int kMostInATick = detail::ball::kMostWork + 100;

/// Thousands of slabs are near the largest ball, or thousands of rough squares: what is near is found over several
/// ticks, the first time too, and is known then. It lands in time all the same.
TEST(BallProxy, NoTickTakesLongWhereThereIsFarMoreThanATickHasTimeFor) {
  struct Ground {
    int cells, n;
    double rough;
    int first;  ///< the tick in which it touches
  };
  for (const auto& [cells, n, rough, first] : {Ground{128, 2, 0, 334}, Ground{64, 32, 0.05, 241}}) {
    const SnapshotPtr model = displaced(
        plane_shell(cells, n), [&](Vec3d p) { return 0.5 + rough * std::sin(900 * p.x) * std::cos(700 * p.z); });
    const double radius = BallRange::kMost * std::sqrt(2);
    BallProxy ball;
    int longest = 0, touched = 0;
    for (int k = 0; k <= 1500; ++k) {
      const double height = radius * std::max(0.9, 1.5 - 0.0015 * k), along = 1e-4 * std::max(0, k - 400);
      touched += ball.step(*model, {0.5 + along, height, 0.5}, radius) ? 1 : 0;
      longest = std::max(longest, ball.work());
      if (height < 0.99 * radius) {
        EXPECT_NEAR(ball.centre().y, radius + 0.2 * rough, 5e-3 * radius) << k;
      }
    }
    EXPECT_NEAR(touched, 1501 - first, 2);
    EXPECT_LT(longest, kMostInATick);
  }
}

double distance_of(const SurfacePoint& point, Vec3d from = {}) { return length(point.position - from); }

/// What a tick takes is bounded, whatever the ground: also in a hollow that touches the ball with thousands of slabs,
/// far more than there is room for in the list. The ball gets to where it belongs all the same.
TEST(BallProxy, NoTickTakesLongWhereThereIsNoRoomForAllThatIsNear) {
  for (const int levels : {4, 5}) {
    const SnapshotPtr model = displaced(testing::hollow_shell(levels, 2), [](Vec3d) { return 0.5; });
    const double fits = distance_of(closest_point(*model, {}));
    for (const double radius : {fits * (1 - 1e-6), 0.99 * fits, 0.5 * fits}) {
      BallProxy ball;
      ball.step(*model, {}, radius);
      int longest = 0, touched = 0, ticks = 0;
      Vec3d hand;
      const auto step = [&] {
        touched += ball.step(*model, hand, radius) ? 1 : 0;
        longest = std::max(longest, ball.work());
        if (ticks++ % 50 != 0) return;
        EXPECT_GE(distance_of(closest_point(*model, ball.centre()), ball.centre()), radius * (1 - 1e-6));
      };
      for (int k = 0; k < 2000; ++k) {
        const double turn = 2e-3 * k;
        hand = normalized(Vec3d{std::sin(turn), 0.3 * std::cos(0.3 * turn), std::cos(turn)}) * std::min(0.7, k / 300.0);
        step();
      }
      EXPECT_GT(touched, 1000) << radius;
      // While the hand rests the ball comes to where it belongs: it may go so far in any direction.
      const double depth = 0.7 - (fits - radius) * (1 - 1e-3);
      for (int k = 0; k < 5000 && length(ball.centre() - hand) > depth; ++k) step();
      EXPECT_LE(length(ball.centre() - hand), depth) << radius;
      EXPECT_LT(longest, kMostInATick) << levels << ' ' << radius;
    }
  }
}

/// Ground of spikes, up to 80 times as high as they are apart: the ball rests on their tips, and is in none of them.
TEST(BallProxy, IsInNoneOfTheSpikesThatItRestsOn) {
  struct Ground {
    double depth, radius;
  };
  for (const auto& [depth, radius] : {Ground{0.5, 2.5 / 128}, Ground{1, 5.0 / 128}, Ground{2, 2.5 / 128}}) {
    const SnapshotPtr model = displaced(plane_shell(1, 128, depth), [](Vec3d p) {
      const double any = 4e4 * std::sin(1e4 * p.x + 3e4 * p.y + 7e4 * p.z);
      return 0.5 + 0.8 * (any - std::floor(any) - 0.5);
    });
    const double top = 0.8 * depth;
    BallProxy ball;
    Vec3d hand = {0.3, top + 2 * radius, 0.4};
    ball.step(*model, hand, radius);
    int touched = 0, longest = 0;
    for (int k = 1; k < 2000; ++k) {
      hand = {0.3 + 1e-4 * k, top + std::max(-0.1 * top, (2 - 0.01 * k) * radius), 0.4 + 5e-5 * k};
      touched += ball.step(*model, hand, radius) ? 1 : 0;
      longest = std::max(longest, ball.work());
      if (k % 20 == 0) {
        EXPECT_GE(distance_of(closest_point(*model, ball.centre()), ball.centre()), radius * (1 - 1e-3)) << depth;
      }
    }
    EXPECT_GT(touched, 500) << depth;
    EXPECT_LT(longest, kMostInATick / 2) << depth;
  }
}

/// Nor where the surface changes under it, and all that is near is to be found anew.
TEST(BallProxy, NoTickTakesLongAfterAChange) {
  const auto mesh = plane_shell(64, 32);
  const auto ground = [&](double height) {
    return displaced(mesh, [&](Vec3d p) { return height + 0.05 * std::sin(900 * p.x) * std::cos(700 * p.z); });
  };
  const std::array<SnapshotPtr, 2> models = {ground(0.5), ground(0.55)};
  const double radius = BallRange::kMost * std::sqrt(2);
  BallProxy ball;
  lead(ball, *models[0], {0.5, 1.5 * radius, 0.5}, {0.5, 0.8 * radius, 0.5}, radius, 1000);
  int longest = 0;
  for (int k = 0; k < 600; ++k) {
    const bool higher = k / 100 % 2 == 0;
    ball.step(*models[higher ? 1 : 0], {0.5 + 1e-4 * k, 0.8 * radius, 0.5}, radius);
    longest = std::max(longest, ball.work());
    if (k % 100 > 50) {
      EXPECT_NEAR(ball.centre().y, radius + 0.01 + (higher ? 0.01 : 0), 5e-3 * radius) << k;
    }
  }
  EXPECT_LT(longest, kMostInATick + detail::ball::kWork);  // and the hand's way
}

/// Another hand changes the model every 16 ticks, and to look around takes longer than that. A look that was begun is
/// seen to its end, on the model on which it was begun: the ball follows, and feels each few changes the newest.
TEST(BallProxy, FollowsTheHandWhileTheModelChangesAgainAndAgain) {
  const auto hollow = testing::hollow_shell(5, 2);
  const auto of_height = [&](double alpha) { return displaced(hollow, [=](Vec3d) { return alpha; }); };
  const std::array<SnapshotPtr, 2> models = {of_height(0.5), of_height(0.501)};
  const double fits = distance_of(closest_point(*models[0], {})), radius = 0.9 * fits;
  SnapshotPtr newest = models[0], felt = newest;
  BallProxy ball;
  ball.step(*felt, {}, radius);
  Vec3d last;
  int still = 0, longest = 0, taken = 0;
  for (int k = 1; k <= 6000; ++k) {
    newest = models[static_cast<std::size_t>(k / 16 % 2)];
    if (!ball.is_looking()) {
      taken += newest != felt ? 1 : 0;
      felt = newest;
    }
    const double turn = 1e-3 * k;
    const Vec3d hand = Vec3d{std::sin(turn), 0.3, std::cos(turn)} * (std::min(1.0, 2e-3 * k) * 0.3 * fits);
    ball.step(*felt, hand, radius);
    still = ball.centre() == last ? still + 1 : 0;
    longest = k > 500 ? std::max(longest, still) : 0;
    last = ball.centre();
  }
  EXPECT_GT(longest, 16) << "there is something to see";
  EXPECT_LT(longest, 100);
  EXPECT_GT(taken, 6000 / 100);
}

/// A flat body, pressed from above to past its middle. What is added to it takes the ball along by as much, be there
/// time to see where to in one tick or not.
TEST(BallProxy, GoesWithMaterialThatRisesUnderItHoweverLongItLooks) {
  const double radius = 0.02, flat = 0.3;
  const auto mesh = testing::mapped_shell(*testing::sphere_shell(3, 128, 0.6, 1.4),
                                          [=](Vec3d p) { return Vec3d{p.x, flat * p.y, p.z}; });
  int longest = 0;
  for (const double rough : {0.0, 0.05, 0.2})
    for (const double rise : {0.03, 0.1}) {
      const auto body = [&](double more) {
        return displaced(mesh, [&](Vec3d p) {
          const double any = 4e4 * std::sin(1e4 * p.x + 3e4 * p.y + 7e4 * p.z);
          return 0.5 + more + rough * (any - std::floor(any) - 0.5);
        });
      };
      const SnapshotPtr before = body(0), after = body(rise);
      BallProxy ball;
      const Vec3d above = {0, 0.5, 0}, hand = {0, -0.4, 0};
      ball.step(*before, above, radius);
      lead(ball, *before, above, hand, radius, 2000);
      for (int k = 0; k < 200; ++k) ball.step(*before, hand, radius);
      const Vec3d was = ball.centre();
      int ticks = 0;
      do ball.step(*after, hand, radius);
      while ((ball.settling() || ball.is_looking()) && ++ticks < 100);
      longest = std::max(longest, ticks);
      const double fibre = flat * 0.8;  // at the top
      EXPECT_NEAR(ball.centre().y - was.y, rise * fibre, 1e-3 * fibre) << rough << ' ' << rise;
      EXPECT_FALSE(ball.lost());
    }
  EXPECT_GT(longest, 2) << "there is something to see";
}

/// All that a ball keeps: many ticks' worth of a core's cache.
TEST(BallProxy, KeepsOneAndAHalfMegabytes) {
  EXPECT_LT(sizeof(detail::ball::Room), std::size_t{1650} << 10U);
  EXPECT_LT(sizeof(detail::ball::Room) - sizeof(detail::Patches), std::size_t{32} << 10U);
}

/// Pressed in by as much as its radius and leaning to and fro, it seldom sees in a tick where it would come to rest; it
/// goes along with the hand in what is left of the same tick.
TEST(BallProxy, LooksAheadAndGoesAlongInOneTick) {
  const SnapshotPtr model = displaced(torus_shell(24, 12, 128), [](Vec3d p) {
    return 0.5 + 0.1 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.01 * std::sin(90 * p.x) * std::sin(80 * p.y);
  });
  const double size = diagonal(model->slab_mesh().bounds()), radius = 0.01 * size;
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::vector<int> work;
  for (int press = 0; press < 60; ++press) {
    const SurfacePoint p = closest_point(*model, Vec3d{normal(random), normal(random), normal(random)} * (0.5 * size));
    const Vec3d aside = normalized(cross(p.normal, std::abs(p.normal.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}));
    BallProxy ball;
    for (int k = 0; k <= 200; ++k) ball.step(*model, p.position + p.normal * (radius * (3 - 4 * k / 200.0)), radius);
    for (int k = 0; k < 100; ++k) {
      ball.step(*model, p.position - p.normal * radius + aside * (0.3 * radius * std::sin(0.1 * k)), radius);
      work.push_back(ball.work());
    }
  }
  std::ranges::sort(work);
  EXPECT_LT(work[work.size() * 999 / 1000], 600);
}

/// What stopped a step stops the next at once: on waves a third as long as it is thick, a ball that is drawn along
/// looks around once a tick, where it would do so two and a half times.
TEST(BallProxy, WhatStoppedAStepIsNotFoundAgainByTrying) {
  const SnapshotPtr model = displaced(plane_shell(8, 32, 0.5),
                                      [](Vec3d p) { return 0.5 + 0.01 * std::sin(80 * p.x) * std::sin(80 * p.z + 1); });
  const double radius = 0.03;
  const Vec3d above = {0.2, 0.2, 0.2}, hand = {0.2, -0.05, 0.2};
  BallProxy ball;
  ball.step(*model, above, radius);
  lead(ball, *model, above, hand, radius, 100);
  int searches = 0;
  constexpr int kTicks = 600;
  for (int k = 1; k <= kTicks; ++k) {
    ASSERT_TRUE(ball.step(*model, hand + Vec3d{1e-3 * k, 0, 0.7e-3 * k}, radius));
    searches += ball.searches();
  }
  EXPECT_LT(searches, 1.3 * kTicks);
}

/// At the speed of a hand, on ground finer and rougher than there is time for in a tick.
TEST(BallProxy, IsNotLateForLong) {
  const SnapshotPtr model = displaced(torus_shell(48, 24, 128), [](Vec3d p) {
    return 0.5 + 0.1 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.02 * std::sin(90 * p.x) * std::sin(80 * p.y) +
           0.03 * std::sin(900 * p.x) * std::cos(700 * p.y + 500 * p.z);
  });
  const double size = diagonal(model->slab_mesh().bounds());
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  int longest = 0, felt = 0;
  for (const double share : {0.01, 0.03})
    for (int tap = 0; tap < 60; ++tap) {
      const double radius = share * size, step = 2e-3 * size * (1 + tap % 5) / 5;
      const SurfacePoint p =
          closest_point(*model, Vec3d{normal(random), normal(random), normal(random)} * (0.5 * size));
      BallProxy ball;
      int late = 0;
      for (double height = 2 * radius; height > -0.01 * size; height -= step) {
        const bool touches = ball.step(*model, p.position + p.normal * height, radius);
        late = ball.held() && !touches ? late + 1 : 0;
        longest = std::max(longest, late);
        felt += touches ? 1 : 0;
      }
    }
  EXPECT_GT(felt, 1000);
  EXPECT_LE(longest, 10);
}

/// What ticks took, of a run.
struct Work {
  std::vector<int> all;
  int felt = 0, late = 0;

  [[nodiscard]] int quantile(double q) {
    std::ranges::sort(all);
    return all[static_cast<std::size_t>(q * static_cast<double>(all.size() - 1))];
  }
  [[nodiscard]] double mean() const {
    double sum = 0;
    for (const int one : all) sum += one;
    return sum / static_cast<double>(all.size());
  }
};

/// A hand that comes from just above ground that is rough down to the cells, presses and slides.
Work press_and_slide(const Snapshot& model, double share) {
  const double size = diagonal(model.slab_mesh().bounds()), radius = share * size;
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  Work work;
  for (int place = 0; place < 8; ++place) {
    SurfacePoint p;
    do {
      p = closest_point(model, Vec3d{normal(random), normal(random), normal(random)} * (0.5 * size));
    } while (!BallProxy::clear(model, p.position + p.normal * (1.5 * radius), radius));
    const Vec3d along = normalized(cross(p.normal, {0.2, 1, 0.4}));
    BallProxy ball;
    for (int k = 0; k < 1500; ++k) {
      const double height = radius - std::min(0.01, 1e-4 * k - 0.015) * size;
      const Vec3d slid = along * (1e-4 * size * std::max(0, k - 250));
      const bool touches = ball.step(model, p.position + p.normal * height + slid, radius);
      work.felt += touches ? 1 : 0;
      work.late += ball.held() && !touches ? 1 : 0;
      work.all.push_back(ball.work());
    }
  }
  return work;
}

/// Also of a ball in which there are thousands of the ground's triangles a tick costs no more than of one in which
/// there are a few hundred, from the first on.
TEST(BallProxy, ALargeOneCostsNoMoreThanASmallOne) {
  const SnapshotPtr model = displaced(torus_shell(48, 24, 128), [](Vec3d p) {
    return 0.5 + 0.1 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.02 * std::sin(90 * p.x) * std::sin(80 * p.y) +
           0.03 * std::sin(900 * p.x) * std::cos(700 * p.y + 500 * p.z);
  });
  Work small = press_and_slide(*model, 0.01);
  EXPECT_GT(small.felt, 4000);
  for (const double share : {0.03, 0.05}) {
    Work large = press_and_slide(*model, share);
    EXPECT_GT(large.felt, 4000) << share;
    EXPECT_LT(large.late, large.felt / 50) << share;
    EXPECT_LT(large.mean(), 2 * small.mean()) << share;  // it is felt, and moves, in more of the ticks
    EXPECT_LT(large.quantile(0.9), 1.1 * small.quantile(0.9)) << share;
    EXPECT_LT(large.quantile(0.99), 1.1 * small.quantile(0.99)) << share;
    EXPECT_LT(large.quantile(1), 4500) << share;  // a ball that is late may take more with each tick
  }
}

/// On ground where a single look takes longer than any tick has, it does not wait for good: each tick that it waited
/// gives it more time, up to a limit, and goes on from where the last one ended.
TEST(BallProxy, WhereALookTakesTooLongItWaitsForAFewTicksOnly) {
  const SnapshotPtr model = displaced(torus_shell(48, 24, 128), [](Vec3d p) {
    const double any = 4e4 * std::sin(1e4 * p.x + 3e4 * p.y + 7e4 * p.z);
    return 0.5 + 0.05 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.4 * (any - std::floor(any) - 0.5);
  });
  const double size = diagonal(model->slab_mesh().bounds()), radius = 0.03 * size;
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  int longest = 0, waits = 0, dear = 0, most = 0;
  for (int place = 0; place < 3; ++place) {
    SurfacePoint p;
    do {
      p = closest_point(*model, Vec3d{normal(random), normal(random), normal(random)} * (0.5 * size));
    } while (!BallProxy::clear(*model, p.position + p.normal * (1.5 * radius), radius));
    const Vec3d along = normalized(cross(p.normal, {0.2, 1, 0.4})), other = cross(p.normal, along);
    BallProxy ball;
    Vec3d last;
    int still = 0;
    for (int k = 0; k < 800; ++k) {
      const double height = radius - std::min(0.01, 1e-4 * k - 0.015) * size, turn = 3e-3 * std::max(0, k - 250);
      const Vec3d slid = (along * std::sin(turn) + other * std::sin(0.7 * turn)) * (0.1 * size);
      const Vec3d hand = p.position + p.normal * height + slid;
      ball.step(*model, hand, radius);
      const bool waiting = ball.held() && ball.centre() == last && length(hand - last) > 0.02 * radius;
      still = waiting ? still + 1 : 0;
      waits += waiting ? 1 : 0;
      longest = std::max(longest, still);
      last = ball.centre();
      dear += ball.work() > 1000 ? 1 : 0;
      most = std::max(most, ball.work());
    }
  }
  EXPECT_GT(waits, 500) << "there is something to see";
  EXPECT_GT(dear, 10);
  EXPECT_LE(longest, 12);
  EXPECT_LT(most, kMostInATick);
}

/// What a tick starts with is what the last one found, also in a copy, and not where the model is another.
TEST(BallProxy, GoesOnAsACopyOfItDoes) {
  const auto mesh = torus_shell(24, 12, 24);
  const auto rough = [](Vec3d p) { return 0.5 + 0.2 * std::sin(9 * p.x) * std::cos(8 * p.z); };
  const SnapshotPtr model = displaced(mesh, rough);
  const SnapshotPtr lower = displaced(mesh, [&](Vec3d p) { return rough(p) - 0.05; });
  const SurfacePoint at = closest_point(*model, {2, 3, 1});
  const double radius = 0.04;
  BallProxy ball;
  lead(ball, *model, at.position + at.normal * 0.3, at.position - at.normal * 0.05, radius, 100);
  ASSERT_TRUE(ball.held());
  const Vec3d along = normalized(cross(at.normal, {0, 1, 0.3}));
  for (int k = 0; k < 200; ++k) {
    const Snapshot& now = k % 50 < 40 ? *model : *lower;
    const Vec3d hand = at.position - at.normal * 0.05 + along * (1e-3 * k);
    BallProxy copy = ball;
    ball.step(now, hand, radius);
    copy.step(now, hand, radius);
    ASSERT_EQ(ball.centre(), copy.centre()) << k;
    ASSERT_GE(length(closest_point(now, ball.centre()).position - ball.centre()) + ball.overlap(), radius * (1 - 1e-3));
    ball = copy;
  }
}

/// The hand goes along slowly on straight ways under rough ground. Nearly always the ball is on the surface: where it
/// may not go round, it goes straight on towards the hand until something is in the way.
TEST(BallProxy, DoesNotWaitInTheAir) {
  const SnapshotPtr model = displaced(torus_shell(24, 12, 24), [](Vec3d p) {
    return 0.5 + 0.25 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.1 * std::sin(21 * p.y);
  });
  const double radius = 0.04;
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  int held = 0, waits = 0;
  for (int way = 0; way < 20; ++way) {
    const SurfacePoint at = closest_point(*model, normalized(Vec3d{normal(random), 0.3, normal(random)}) * 4.0);
    const Vec3d along = normalized(cross(at.normal, Vec3d{normal(random), normal(random), normal(random)}));
    BallProxy ball;
    lead(ball, *model, at.position + at.normal * 0.5, at.position - at.normal * 0.1, radius, 200);
    for (int k = 0; k < 800; ++k) {
      ball.step(*model, at.position - at.normal * 0.1 + along * (1e-3 * k), radius);
      if (!ball.held()) continue;
      ++held;
      waits += length(closest_point(*model, ball.centre()).position - ball.centre()) > radius * 1.01;
    }
  }
  EXPECT_GT(held, 6000);
  EXPECT_LT(waits, held / 50) << "of " << held;
}

TEST(BallProxy, ThroughAThinPlateItIsStillPushedOutTheWayItCameIn) {
  // The torus' tube, pressed from above to beyond its lower side.
  const SnapshotPtr model = displaced(torus_shell(24, 12, 16), [](Vec3d) { return 0.5; });
  BallProxy ball;
  const double radius = 0.1;
  ball.step(*model, {2, 1.2, 0}, radius);
  lead(ball, *model, {2, 1.2, 0}, {2, -1.5, 0}, radius, 1000);
  ASSERT_TRUE(ball.held());
  EXPECT_GT(ball.centre().y, 0.5);
  EXPECT_GT(ball.way_out().y, 0.7);
}

/// A rough finger, pressed straight through with a small ball by a hand that trembles. There is no time in a tick to
/// see how far the way round the finger leads; the ball stays where it came in all the same, until the hand has gone
/// past. A hand that trembles by a fifth of the radius may lead it round once it is past the middle.
TEST(BallProxy, DoesNotSlipRoundAFingerThatItIsPressedThrough) {
  const auto finger =
      testing::mapped_shell(*testing::sphere_shell(3, 32), [](Vec3d p) { return Vec3d{p.x, 0.2 * p.y, 0.2 * p.z}; });
  const SnapshotPtr model = displaced(finger, [](Vec3d p) {
    return 0.5 + 0.1 * std::sin(20 * p.x) * std::sin(25 * p.z) + 0.01 * std::sin(90 * p.x) * std::sin(95 * p.z);
  });
  const double radius = 0.02;
  for (const double trembling : {0.001, 0.004}) {
    int pressed = 0, lost = 0;
    for (double x = -0.7; x < 0.7; x += 0.05) {
      const auto in = raycast(*model, {{x, 1, 0.006}, {0, -1, 0}});
      ASSERT_TRUE(in);
      const Vec3d out = in->point.normal, start = in->point.position + out * radius;
      const auto back = raycast(*model, {in->point.position - out * 1e-4, -out});
      ASSERT_TRUE(back);
      const double judged = trembling > 0.002 ? back->distance / 2 + radius : 1;
      BallProxy ball;
      Vec3d hand;
      for (int k = 0; k <= 400; ++k) {
        const double depth = 0.5 * k / 400 - 0.01;
        hand = start - out * depth + Vec3d{std::sin(0.08 * k), 0, std::cos(0.06 * k)} * trembling;
        const bool touches = ball.step(*model, hand, radius);
        if (depth < 0.02 || depth > judged) continue;
        ++pressed;
        lost += touches && dot(ball.way_out(), out) > 0 ? 0 : 1;
      }
      lead(ball, *model, hand, {x, hand.y, 0.6}, radius, 300);
      EXPECT_FALSE(ball.held()) << x << ": once the hand is beside the finger";
    }
    EXPECT_GT(pressed, trembling > 0.002 ? 4'000 : 10'000);
    EXPECT_EQ(lost, 0) << trembling;
  }
}

/// All that it touches are edges and corners of triangles, beyond which is nothing. It is not late there, but where
/// it lands by a tick or two: on ground with thousands of triangles around, or as a ball larger than one may be.
TEST(BallProxy, RestsOnTheRimOfAHoleAndOfASheet) {
  struct Case {
    int n;
    double radius, hole;
    int late;
  };
  for (const auto& [n, radius, hole, late] :
       {Case{32, 0.03, 0.02, 0}, Case{128, 0.03, 0.02, 2}, Case{32, 0.07, 0.04, 0}, Case{128, 0.07, 0.04, 2},
        Case{8, 0.15, 0.08, 0}, Case{8, 0.3, 0.08, 1}, Case{32, 0.15, 0.08, 1}, Case{32, 0.3, 0.08, 2}}) {
    const auto centre = [](Vec3d p) { return std::hypot(p.x - 0.5, p.z - 0.5); };
    const SnapshotPtr plane = displaced(plane_shell(4, n), [](Vec3d) { return 0.5; });
    const SnapshotPtr pierced = testing::with_hole(plane, [&](Vec3d p) { return centre(p) < hole; }),
                      disc = testing::with_hole(plane, [&](Vec3d p) { return centre(p) > 0.2; });
    for (const double aside : {0.0, 0.125 * hole, 0.3 * hole}) {
      BallProxy over_hole, over_rim;
      std::array<int, 2> waits{};
      int longest = 0;
      const double past_rim = std::min(0.05, 0.3 * radius);
      const Vec3d at = {0.5 + aside, 0, 0.5 + aside / 3}, beyond = {0.7 + past_rim, 0, 0.5};
      for (int k = 0; k <= 400; ++k) {
        const Vec3d up = {0, radius * (1.2 - 1.5 * k / 400.0), 0};
        const bool rests = over_hole.step(*pierced, at + up, radius);
        const bool hangs = over_rim.step(*disc, beyond + up, radius);
        waits = {rests != over_hole.held() ? waits[0] + 1 : 0, hangs != over_rim.held() ? waits[1] + 1 : 0};
        longest = std::max({longest, waits[0], waits[1]});
        if (hangs) {
          EXPECT_LT(centre(over_rim.surface().position), 0.24);
        }
      }
      EXPECT_LE(longest, late) << n << " " << aside << " " << radius;
      EXPECT_TRUE(over_hole.held());
      EXPECT_GT(over_hole.centre().y, 0.6 * radius);
      EXPECT_GT(centre(over_hole.surface().position), 0.5 * hole);
    }
  }
}

TEST(BallProxy, AFastHandDoesNotTunnel) {
  const SnapshotPtr model = flat_plane();
  BallProxy ball;
  const double radius = 0.01;
  ball.step(*model, {0.5, 0.5, 0.5}, radius);
  for (int k = 0; k < 10; ++k) ball.step(*model, {0.5, -0.5, 0.5}, radius);
  EXPECT_TRUE(ball.held());
  EXPECT_NEAR(ball.centre().y, radius, 1e-5);
}

/// A hand that leaps into fine waves, and rests there. What the ball has not come in that tick, on its way through the
/// air and past what it all but touches, it comes in the next ones: no bound holds before it has landed.
TEST(BallProxy, LandsInAFewTicksAfterALeap) {
  const SnapshotPtr model =
      displaced(plane_shell(16, 128, 0.02), [](Vec3d p) { return 0.5 + 5e-6 / 0.04 * std::sin(1675 * p.x); });
  const double radius = 0.0375;
  BallProxy ball;
  ball.step(*model, {0.1, radius + 0.0125, 0.4}, radius);
  for (int k = 0; k < 12; ++k) ball.step(*model, {0.1, radius - 2.5e-4, 0.4}, radius);
  ASSERT_TRUE(ball.held());
  EXPECT_NEAR(ball.centre().y, radius, 2e-5);
}

TEST(BallProxy, ASheetDoesNotCatchABallFromBehind) {
  const SnapshotPtr model = flat_plane();
  BallProxy ball;
  const double radius = 0.05;
  ball.step(*model, {0.5, -0.3, 0.5}, radius);
  for (int k = 1; k <= 300; ++k) {
    ball.step(*model, {0.5, -0.3 + 0.002 * k, 0.5}, radius);
    ASSERT_LT(ball.depth(), 5e-3) << k;  // it may lose a tick or two in the plane itself
  }
  EXPECT_FALSE(ball.held());
  EXPECT_NEAR(ball.centre().y, 0.3, 1e-9);
}

TEST(BallProxy, ARisingSurfacePushesItOut) {
  const auto mesh = plane_shell(4, 8);
  const SnapshotPtr low = displaced(mesh, [](Vec3d) { return 0.5; });
  const SnapshotPtr high = displaced(mesh, [](Vec3d) { return 0.55; });  // by 0.01
  BallProxy ball;
  const double radius = 0.05;
  const Vec3d hand = {0.5, 0.04, 0.5};
  ball.step(*low, {0.5, 0.1, 0.5}, radius);
  lead(ball, *low, {0.5, 0.1, 0.5}, hand, radius, 10);
  ASSERT_NEAR(ball.depth(), 0.01, 1e-5);
  ball.step(*high, hand, radius);
  EXPECT_NEAR(ball.rise(), 0.01, 1e-4);
  EXPECT_NEAR(ball.depth(), 0.02, 1e-4);
  EXPECT_TRUE(ball.settling());
  ball.step(*high, hand, radius);
  EXPECT_FALSE(ball.settling());
  EXPECT_EQ(ball.rise(), 0);
  EXPECT_NEAR(ball.depth(), 0.02, 1e-4);
  // And a surface that falls lets it down.
  ball.step(*low, hand, radius);
  EXPECT_NEAR(ball.depth(), 0.01, 1e-4);
  EXPECT_TRUE(ball.settling());
  ball.step(*low, hand, radius);
  EXPECT_FALSE(ball.settling());
}

/// A hand that presses on rough ground, under which half the radius is added: the ball would slide aside as it rises.
TEST(BallProxy, RoughGroundThatRisesPushesItOutToo) {
  const auto mesh = plane_shell(2, 64);
  const auto ground = [&](double rise) {
    return displaced(mesh, [=](Vec3d p) {
      const double r2 = (p.x - 0.5) * (p.x - 0.5) + (p.z - 0.5) * (p.z - 0.5);
      return 0.5 + 0.02 * std::sin(60 * p.x) * std::sin(70 * p.z) + rise / 0.2 * std::exp(-r2 / 0.005);
    });
  };
  const double radius = 0.03, rise = 0.015;
  const SnapshotPtr low = ground(0), high = ground(rise);
  for (double x = 0.4; x < 0.6; x += 0.017) {
    BallProxy ball;
    const Vec3d from = {x, 0.06, 1 - x}, hand = {x, -0.02, 1 - x};
    ball.step(*low, from, radius);
    lead(ball, *low, from, hand, radius, 400);
    ASSERT_GT(ball.depth(), 0.03);
    int ticks = 0;
    do ASSERT_TRUE(ball.step(*high, hand, radius));
    while (ball.settling() && ++ticks < 20);
    EXPECT_LT(ticks, 10) << x;
    EXPECT_LT(ball.overlap(), 0.01 * radius) << x;
    EXPECT_TRUE(BallProxy::clear(*high, ball.centre(), 0.98 * radius)) << x;
  }
}

/// Ground that rises by more than the ball goes at a time, and not evenly.
TEST(BallProxy, AConeThatRisesDeepIntoItPushesItOutAtOnce) {
  const auto mesh = plane_shell(4, 32);
  const auto cone = [&](double height) {
    return displaced(
        mesh, [=](Vec3d p) { return 0.5 + height / 0.2 * std::max(0.0, 1 - 5 * std::hypot(p.x - 0.46, p.z - 0.45)); });
  };
  const double radius = 0.04;
  for (const double share : {0.3, 0.57, 0.9})
    for (const double aside : {0.0, 0.01, 0.04}) {
      const SnapshotPtr flat = cone(0), raised = cone(share * radius);
      const Vec3d hand = {0.46 + aside, radius - 0.02, 0.45};
      BallProxy ball;
      ball.step(*flat, hand + Vec3d{0, 0.1, 0}, radius);
      lead(ball, *flat, hand + Vec3d{0, 0.1, 0}, hand, radius, 100);
      ASSERT_TRUE(ball.step(*raised, hand, radius));
      EXPECT_FALSE(ball.lost());
      EXPECT_GT(ball.rise(), 0.5 * share * radius);
      EXPECT_LT(ball.overlap(), 1e-5 * radius) << share << " " << aside;
      int ticks = 0;  // in which it comes to rest
      for (; ball.settling() && ticks < 10; ++ticks) ASSERT_TRUE(ball.step(*raised, hand, radius));
      EXPECT_LE(ticks, 3) << share << " " << aside;
      EXPECT_TRUE(BallProxy::clear(*raised, ball.centre(), (1 - 1e-5) * radius));
    }
}

TEST(BallProxy, IsLetDownWhereTheGroundIsTakenAway) {
  const auto mesh = plane_shell(4, 8);
  const auto level = [&](double height) { return displaced(mesh, [=](Vec3d) { return 0.5 + height / 0.2; }); };
  for (const double fall : {0.001, 0.01, 0.04}) {
    const SnapshotPtr before = level(0), after = level(-fall);
    BallProxy ball;
    const Vec3d hand = {0.5, -0.05, 0.5};
    ball.step(*before, {0.5, 0.2, 0.5}, 0.05);
    lead(ball, *before, {0.5, 0.2, 0.5}, hand, 0.05, 200);
    ASSERT_NEAR(ball.depth(), 0.1, 1e-6);
    ASSERT_TRUE(ball.step(*after, hand, 0.05));
    EXPECT_NEAR(ball.depth(), 0.1 - fall, 2 * 5e-4 * 0.05);  // but for a step that is left to the next tick
    EXPECT_NEAR(ball.surface().position.y, -fall, 1e-5);
    EXPECT_TRUE(ball.settling());
    for (int k = 0; k < 10; ++k) {
      ASSERT_TRUE(ball.step(*after, hand, 0.05));
      EXPECT_FALSE(ball.settling());
    }
    EXPECT_NEAR(ball.depth(), 0.1 - fall, 1e-6);
  }
}

TEST(BallProxy, ItIsFreeOnceTheHandRestsInTheOpen) {
  const SnapshotPtr model = fine_sphere();
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 50; ++trial) {
    const Vec3d way = normalized(Vec3d{normal(random), normal(random), normal(random)});
    BallProxy ball;
    ball.step(*model, way * 1.3, 0.05);
    lead(ball, *model, way * 1.3, way * 0.9, 0.05, 100);
    ASSERT_TRUE(ball.held());
    lead(ball, *model, way * 0.9, way * 1.2, 0.05, 3);
    int ticks = 0;
    while (ball.held() && ticks < 2000) ball.step(*model, way * 1.2, 0.05), ++ticks;
    ASSERT_LT(ticks, 1200);
  }
}

/// Ground that rises above the ball takes it along, rough or with a bump, be it several radii in one tick.
TEST(BallProxy, GroundThatRisesAboveItTakesItAlong) {
  const auto mesh = plane_shell(2, 64, 0.4);
  const double radius = 0.03;
  for (const bool bump : {false, true})
    for (const double share : {1.2, 2.4, 3.6, 5.0}) {
      const double rise = share * radius;
      const auto ground = [&](double risen) {
        return displaced(mesh, [=](Vec3d p) {
          const double r2 = (p.x - 0.5) * (p.x - 0.5) + (p.z - 0.5) * (p.z - 0.5);
          const double rough = 0.004 * std::sin(60 * p.x) * std::sin(70 * p.z);
          return 0.5 + (rough + risen * (bump ? std::exp(-r2 / 0.005) : 1)) / 0.8;
        });
      };
      const SnapshotPtr low = ground(0), high = ground(rise);
      for (double x = 0.4; x < 0.6; x += 0.017) {
        BallProxy ball;
        const Vec3d from = {x, 0.06, 1 - x}, hand = {x, radius - 0.01, 1 - x};
        ball.step(*low, from, radius);
        lead(ball, *low, from, hand, radius, 100);
        ASSERT_TRUE(ball.step(*high, hand, radius));
        EXPECT_FALSE(ball.lost());
        if (!bump) {
          EXPECT_NEAR(ball.rise(), rise, 0.1 * radius) << share << ' ' << x;
        }
        int ticks = 0;
        for (; ball.settling() && ticks < 20; ++ticks) ASSERT_TRUE(ball.step(*high, hand, radius));
        EXPECT_LT(ticks, 10) << share << ' ' << x;
        LocateHint hint;
        const auto there = probe(*high, ball.centre(), hint);
        EXPECT_FALSE(there && there->touching()) << share << ' ' << x;
        EXPECT_TRUE(BallProxy::clear(*high, ball.centre(), 0.99 * radius)) << share << ' ' << x;
      }
    }
}

/// What rises beside the place where it touches does not take it along.
TEST(BallProxy, ASurfaceThatRisesBeyondItsCentreIsReported) {
  const auto mesh = plane_shell(1, 100, 0.4);
  const double radius = 0.03;
  // A slope of 45 degrees: the ball touches it 0.7 radii beside its centre, below which a block rises.
  const auto ground = [&](double risen) {
    return displaced(mesh, [=](Vec3d p) { return 0.5 + (0.5 - p.x + (p.x > 0.51 ? risen : 0)) / 0.8; });
  };
  const SnapshotPtr low = ground(0);
  for (const double share : {2.0, 3.0, 5.0}) {
    const SnapshotPtr high = ground(share * radius);
    BallProxy ball;
    const Vec3d out = {std::sqrt(0.5), std::sqrt(0.5), 0}, on = {0.5, 0, 0.3};
    ball.step(*low, on + out * 0.09, radius);
    lead(ball, *low, on + out * 0.09, on + out * 0.02, radius, 10);
    ASSERT_TRUE(ball.held());
    EXPECT_FALSE(ball.lost());
    ball.step(*high, on + out * 0.02, radius);
    EXPECT_TRUE(ball.lost()) << share;
  }
}

TEST(BallProxy, ALateBallInTheAirIsNoContact) {
  const SnapshotPtr model = flat_plane();
  BallProxy ball;
  const double radius = 1e-3;
  ball.step(*model, {0.1, 2e-3, 0.5}, radius);
  ball.step(*model, {0.1, 5e-4, 0.5}, radius);
  EXPECT_TRUE(ball.held());
  // Up, and then so fast along the plane, just above it, that a tick is not enough.
  ball.step(*model, {0.1, 1.2e-3, 0.5}, radius);
  EXPECT_FALSE(ball.held());
  EXPECT_FALSE(ball.step(*model, {0.9, 1.2e-3, 0.5}, radius));
}

}  // namespace
}  // namespace relief
