// The surface contact point: entry, the walk, release, rims, and a surface that changes under it.
#include "support/driver.h"
#include "support/leaps.h"
#include "support/wandering_hand.h"

#include <relief/haptics/contact/proxy.h>
#include <relief/haptics/hand_limit.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace relief {
namespace {

using testing::displaced;
using testing::plane_shell;
using testing::sphere_shell;
using testing::torus_shell;

SnapshotPtr bumpy_torus() {
  return displaced(torus_shell(16, 10, 16), [](Vec3d p) {
    return 0.5 + 0.25 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.1 * std::sin(21 * p.y);
  });
}

TEST(Proxy, NoTickTakesLongWhereverTheHandLeaps) {
  for (const SnapshotPtr& model : testing::rough_models(128)) {
    const double size = diagonal(model->slab_mesh().bounds());
    Proxy proxy;
    HandLimit limit;
    testing::Leaps leaps(*model);
    int held = 0;
    std::vector<int> placed;
    for (int k = 0; k < 500; ++k) {
      const Vec3d hand = leaps.next();
      do {
        held += proxy.step(*model, limit.follow({hand, {}}, 0, size).origin) ? 1 : 0;
        placed.push_back(proxy.samples_placed());
      } while (limit.late());
    }
    EXPECT_GT(held, 400);
    std::ranges::sort(placed);
    std::printf("samples placed in a tick of a leap: median %d, p99 %d, most %d of %zu\n", placed[placed.size() / 2],
                placed[placed.size() * 99 / 100], placed.back(), placed.size());
    EXPECT_LT(placed[placed.size() / 2], 300);
    EXPECT_LT(placed[placed.size() * 99 / 100], 350);
    EXPECT_LT(placed.back(), 2500);  // all but 130 of them of one ray that grazes the rough: 60 us of the tick
  }
}

/// Where a way that was swept met nothing, a clear ball is looked for, of sixteen such ways: what is farther away costs
/// nothing.
TEST(Proxy, LooksSixteenWaysAheadForAClearBall) {
  const SnapshotPtr model = displaced(plane_shell(4, 8, 0.005), [](Vec3d) { return 0.5; });
  for (const double height : {0.012, 0.024}) {
    Proxy proxy;
    int most = 0;
    for (int k = 0; k < 5; ++k) {
      static_cast<void>(proxy.step(*model, {0.4 + 1e-3 * k, height, 0.45}));
      most = std::max(most, proxy.samples_placed());
    }
    EXPECT_EQ(most > 8, height < 0.016) << height;
  }
}

/// Where it is dear to find, as above ground that is rough down to the samples, what 64 of them tell is enough.
TEST(Proxy, PlacesSixtyFourSamplesForAClearBall) {
  const SnapshotPtr model = displaced(plane_shell(1, 128, 0.02), [](Vec3d p) {
    const double any = 4e4 * std::sin(1e4 * p.x + 7e4 * p.z);
    return 0.3 + 0.4 * (any - std::floor(any));
  });
  Proxy proxy;
  int most = 0;
  for (int k = 0; k < 6; ++k) {
    static_cast<void>(proxy.step(*model, {0.4 + 3e-3 * k, 0.02, 0.2}));
    most = std::max(most, proxy.samples_placed());
  }
  EXPECT_GT(most, 64);
  EXPECT_LT(most, 64 + 40) << "and those of the square that it is at";
}

/// In the open a tick mostly places no sample at all: the cursor is in a ball that is known to be clear. A larger ball
/// serves for longer and costs more to find, which a fast hand pays for.
TEST(Proxy, InTheOpenATickCostsNextToNothing) {
  const SnapshotPtr model = displaced(torus_shell(16, 10, 64), [](Vec3d p) {
    return 0.5 + 0.25 * std::sin(9 * p.x) * std::cos(8 * p.z) + 0.1 * std::sin(21 * p.y);
  });
  const double size = diagonal(model->slab_mesh().bounds());
  // 0.3 % of the diagonal above the highest of the relief.
  const auto cost_at = [&](double speed) {
    Proxy proxy;
    std::vector<int> placed;
    for (int k = 0; k < 4000; ++k) {
      const double p = speed * size * k / 3, q = 0.6 * p;
      const Vec3d middle = Vec3d{std::cos(p), 0, std::sin(p)} * 2.0;
      const Vec3d out = {std::cos(q) * std::cos(p), std::sin(q), std::cos(q) * std::sin(p)};
      static_cast<void>(proxy.step(*model, middle + out * (0.95 + 0.003 * size)));
      EXPECT_FALSE(proxy.held());
      placed.push_back(proxy.samples_placed());
    }
    std::ranges::sort(placed);
    return placed;
  };
  const std::vector<int> slow = cost_at(1e-4), fast = cost_at(1e-3);  // 15 and 150 mm/s in the hand
  EXPECT_EQ(slow[slow.size() * 9 / 10], 0);
  EXPECT_EQ(fast[fast.size() * 9 / 10], 0);
  double sum = 0;
  for (const int one : slow) sum += one;
  EXPECT_LT(sum / double(slow.size()), 2);
  EXPECT_LT(fast[fast.size() * 99 / 100], 90);
}

TEST(Proxy, WhatAnEditTakesAwayLetsGoAtOnce) {
  // Pressed sideways into a thorn, which is then gone.
  const auto mesh = plane_shell(4, 32);
  const SnapshotPtr before = testing::with_thorn(mesh, 0.5), after = testing::with_thorn(mesh, 0);
  Proxy proxy;
  Vec3d hand = {0.4, 0, 0.5};
  for (; hand.x < 0.48; hand.x += 1e-3) static_cast<void>(proxy.step(*before, hand));
  for (int k = 0; k < 100; ++k) static_cast<void>(proxy.step(*before, hand));
  ASSERT_TRUE(proxy.held());
  ASSERT_GT(proxy.depth(), 0.015);
  EXPECT_FALSE(proxy.step(*after, hand));
  EXPECT_TRUE(proxy.has_left());
  EXPECT_FALSE(proxy.lost());
  EXPECT_TRUE(proxy.settling()) << "what it was held at went by the edit";
  EXPECT_EQ(proxy.depth(), 0);
  EXPECT_LT(proxy.rise(), -0.01);
  EXPECT_FALSE(proxy.step(*after, hand + Vec3d{1e-3, 0, 0}));
  EXPECT_FALSE(proxy.settling());
}

TEST(Proxy, StaysOnTheSurfaceAtTheNearestPlace) {
  const SnapshotPtr model = displaced(sphere_shell(2, 32), [](Vec3d p) {
    return (1 / length(p) - 0.8) / 0.4 + 0.02 * std::sin(20 * p.x) * std::cos(17 * p.y);
  });
  Proxy proxy;
  EXPECT_FALSE(proxy.step(*model, {0, 0, 1.1}));
  double worst = 0;
  for (int k = 0; k < 5000; ++k) {
    const double turn = 1.3e-3 * k;
    const Vec3d way = normalized(Vec3d{std::sin(turn), 0.4 * std::sin(3 * turn), std::cos(turn)});
    const Vec3d cursor = way * (k < 60 ? 1.1 - 0.0025 * k : 0.95);
    const bool held = proxy.step(*model, cursor);
    if (k < 100) continue;
    ASSERT_TRUE(held) << k;
    const Vec3d at = proxy.position();
    EXPECT_LT(length(closest_point(*model, at).position - at), 1e-9);
    EXPECT_NEAR(proxy.depth(), length(at - cursor), 1e-12);
    EXPECT_EQ(proxy.rise(), 0);
    worst = std::max(worst, proxy.depth() / length(closest_point(*model, cursor).position - cursor));
  }
  EXPECT_LT(worst, 1.03);
}

TEST(Proxy, ComesNearerInEveryTickUnderARestingCursor) {
  const SnapshotPtr model = bumpy_torus();
  std::mt19937 random(12);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int press = 0; press < 50; ++press) {
    const SurfacePoint p =
        closest_point(*model, normalized(Vec3d{unit(random), 0.3 * unit(random), unit(random)}) * 3.2);
    Proxy proxy;
    static_cast<void>(proxy.step(*model, p.position + p.normal * 0.05));
    const Vec3d cursor = p.position - p.normal * 0.05 + Vec3d{unit(random), unit(random), unit(random)} * 0.02;
    ASSERT_TRUE(proxy.step(*model, cursor));
    double last = proxy.depth();
    for (int k = 0; k < 100; ++k) {
      ASSERT_TRUE(proxy.step(*model, cursor));
      EXPECT_LE(proxy.depth(), last);
      last = proxy.depth();
    }
  }
}

TEST(Proxy, HoldsBelowTheSlabsAndLetsGoWhereItCameIn) {
  const SnapshotPtr model = displaced(plane_shell(4, 8), [](Vec3d) { return 0.5; });
  Proxy proxy;
  for (int k = 0; k <= 200; ++k) {
    const double y = 0.05 - 0.005 * (k <= 100 ? k : 200 - k);
    const bool held = proxy.step(*model, {0.4, y, 0.45});
    if (std::abs(y) > 1e-9) {
      EXPECT_EQ(held, y < 0) << y;
    }
    if (!proxy.held()) continue;
    EXPECT_LT(length(proxy.position() - Vec3d{0.4, 0, 0.45}), 1e-9);
    EXPECT_NEAR(proxy.depth(), -y, 1e-9);
  }
}

TEST(Proxy, LetsGoBeyondAnOpenEdgeAndDoesNotCatchFromBelow) {
  const SnapshotPtr model = displaced(plane_shell(4, 8), [](Vec3d) { return 0.5; });
  Proxy proxy;
  static_cast<void>(proxy.step(*model, {0.8, 0.02, 0.5}));
  for (double x = 0.8; x < 1.2; x += 0.01) {
    const bool held = proxy.step(*model, {x, -0.03, 0.5});
    EXPECT_EQ(held, x < 1) << x;
    if (held) {
      EXPECT_NEAR(proxy.depth(), 0.03, 1e-9);
    }
  }
  // Back under the sheet, and up through it: nothing there holds a tool that comes from behind.
  for (double x = 1.2; x > 0.5; x -= 0.01) EXPECT_FALSE(proxy.step(*model, {x, -0.2, 0.5}));
  for (double y = -0.2; y < 0.1; y += 0.01) EXPECT_FALSE(proxy.step(*model, {0.5, y, 0.5}));
  EXPECT_TRUE(proxy.step(*model, {0.5, -0.01, 0.5}));
}

TEST(Proxy, SlidesOverAnEdgeAndIsFreeBeyondIt) {
  // A step of 0.16 down at x = 0.5, over one sample.
  const SnapshotPtr model = displaced(plane_shell(4, 32), [](Vec3d p) { return p.x < 0.5 ? 0.9 : 0.1; });
  Proxy proxy;
  static_cast<void>(proxy.step(*model, {0.3, 0.1, 0.3}));
  for (double x = 0.3; x < 0.6; x += 0.002) {
    const bool held = proxy.step(*model, {x, 0.07, 0.3});
    if (x < 0.49 || x > 0.52) {
      EXPECT_EQ(held, x < 0.5) << x;
    }
  }
}

/// A thin disc, pressed straight through near its rim and back, also with a lean outwards: the tool is held beyond it.
/// A hand that comes aslant has led the point along before it is past the middle; so it may slip off the rim, but only
/// many thicknesses deep.
TEST(Proxy, IsNotLetGoWhereItIsPressedStraightPastARim) {
  const auto round = testing::sphere_shell(2, 16);
  const auto flat = testing::mapped_shell(*round, [](Vec3d p) { return Vec3d{p.x, 0.05 * p.y, p.z}; });
  const SnapshotPtr model = displaced(flat, [](Vec3d) { return 0.5; });
  int pressed = 0, lost = 0, presses_lost = 0;
  for (const double lean : {0.0, 0.2, 0.4, 0.6})
    for (double x = 0.7; x < 0.96; x += 0.02) {
      const auto in = raycast(*model, {{x, 1, 0.1}, {0, -1, 0}}), back = raycast(*model, {{x, -1, 0.1}, {0, 1, 0}});
      ASSERT_TRUE(in && back);
      const Vec3d start = in->point.position, way = normalized(Vec3d{lean, -1, 0});
      const double thickness = start.y - back->point.position.y;
      Proxy proxy;
      double slipped_at = 1e300;
      for (int k = 0; k <= 400; ++k) {
        const double depth = 0.19 - 0.2 * std::cos(2 * 3.14159265 * k / 400);
        const bool held = proxy.step(*model, start + way * depth);
        if (depth < 0.02) continue;
        ++pressed;
        if (held) continue;
        ++lost;
        if (slipped_at == 1e300) slipped_at = depth;
      }
      presses_lost += slipped_at < 1e300 ? 1 : 0;
      EXPECT_GT(slipped_at, 4 * thickness) << lean << " " << x;
      if (lean < 0.5) {
        EXPECT_EQ(slipped_at, 1e300) << lean << " " << x;
      }
    }
  EXPECT_GT(pressed, 10'000);
  EXPECT_LE(presses_lost, 3) << lost << " ticks of " << pressed;
}

/// A finger, thinner than the tool goes deep.
SnapshotPtr finger() {
  const auto thin =
      testing::mapped_shell(*testing::sphere_shell(2, 16), [](Vec3d p) { return Vec3d{p.x, 0.12 * p.y, 0.15 * p.z}; });
  return displaced(thin, [](Vec3d) { return 0.5; });
}

/// Pressed beyond the middle of a thin part and led about in circles there, or trembling.
struct DeepHand {
  Proxy proxy;
  Vec3d start, cursor;
  double made = 0;  ///< of the squared distance: what the point's own moves added to it after the tick of entry
  double most = 0;

  DeepHand(const Snapshot& model, Vec3d above, Vec3d way, double depth)
      : start(raycast(model, {above, way})->point.position) {
    for (int k = 0; k <= 400; ++k) to(model, start + way * (depth * (k - 20) / 380));
  }
  void to(const Snapshot& model, Vec3d next) {
    const bool held = proxy.held();
    const Vec3d before = held ? proxy.position() : Vec3d{};
    cursor = next;
    if (!proxy.step(model, cursor)) {
      made = 0;
    } else if (held) {
      const Vec3d now = proxy.position();
      made += dot(now - cursor, now - cursor) - dot(before - cursor, before - cursor);
      most = std::max(most, made);
    }
  }
};

TEST(Proxy, ItsOwnMovesPutNothingIntoTheSpringInAThinPart) {
  const SnapshotPtr model = finger();
  for (double x = -0.5; x < 0.6; x += 0.25)
    for (const double aside : {0.0, 0.03, 0.06}) {
      DeepHand hand(*model, {x, 1, aside}, {0, -1, 0}, 0.2);
      const Vec3d middle = hand.cursor;
      int held = 0;
      for (int k = 0; k < 6000; ++k) {
        const double turn = 2 * 3.14159265 * k / 1000;
        hand.to(*model, middle + Vec3d{0.03 * std::sin(turn), 0.02 * std::sin(2 * turn), 0.03 * std::cos(turn) - 0.03});
        held += hand.proxy.held() ? 1 : 0;
      }
      EXPECT_GT(held, 0);
      EXPECT_LT(hand.most, 1e-6 * 0.2 * 0.2) << x << " " << aside;
    }
}

TEST(Proxy, ATremblingHandDoesNotWorkItOffAThinPart) {
  const SnapshotPtr model = finger();
  int lost = 0, wrong = 0;
  for (double x = -0.5; x < 0.6; x += 0.25) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    DeepHand hand(*model, {x, 1, 0.02}, {0, -1, 0}, 0.2);
    const Vec3d middle = hand.cursor;
    Vec3d off;
    for (int k = 0; k < 8000; ++k) {
      off += Vec3d{normal(random), normal(random), normal(random)} * 2e-4 - off * 0.05;
      hand.to(*model, middle + off);
      lost += hand.proxy.held() ? 0 : 1;
      wrong += hand.proxy.held() && !(hand.proxy.way_out().y > 0) ? 1 : 0;
    }
  }
  EXPECT_EQ(lost, 0);
  EXPECT_EQ(wrong, 0);
}

TEST(Proxy, AfterAnEditItRestsWhereTheNewSurfaceLetsIt) {
  // A bump rises under the tip, or goes, so steep that the nearest place of the new surface is elsewhere.
  const auto mesh = plane_shell(4, 32);
  const auto bump = [&](double height) {
    return displaced(
        mesh, [=](Vec3d p) { return 0.5 + height * std::max(0.0, 1 - 5 * std::hypot(p.x - 0.46, p.z - 0.45)) / 0.2; });
  };
  const SnapshotPtr flat = bump(0), raised = bump(0.06);
  for (const double depth : {0.01, 0.05, 0.1}) {
    Proxy proxy;
    const Vec3d cursor = {0.5, -depth, 0.45};
    for (int k = 0; k < 300; ++k)
      static_cast<void>(proxy.step(*flat, cursor + Vec3d{0, std::max(0.0, 2e-3 * (100 - k)), 0}));
    ASSERT_TRUE(proxy.held());
    const Vec3d first = proxy.position();
    for (const SnapshotPtr& model : {raised, flat}) {
      ASSERT_TRUE(proxy.step(*model, cursor));
      EXPECT_TRUE(proxy.settling());
      EXPECT_GT(std::abs(proxy.rise()), 0.01);
      const Vec3d now = proxy.position();
      EXPECT_LT(length(closest_point(*model, now).position - now), 1e-9);
      if (model == raised) {
        EXPECT_GT(length(now - first), 0.01);
      } else {
        EXPECT_LT(length(now - first), 2e-3) << depth;
      }
      for (int k = 0; k < 50; ++k) {
        ASSERT_TRUE(proxy.step(*model, cursor));
        EXPECT_FALSE(proxy.settling());
      }
      EXPECT_EQ(proxy.position(), now) << "there is nothing left to do";
    }
  }
}

TEST(Proxy, SettlesOverTicksWhereTheWayToRestIsLong) {
  // The whole ground leans after the edit, and the way down over its triangles is longer than a tick may look.
  const auto mesh = plane_shell(4, 64);
  const auto leaning = [&](double slope) {
    return displaced(mesh, [=](Vec3d p) { return 0.5 + slope * (p.x - 0.5); });
  };
  const SnapshotPtr level = leaning(0), slope = leaning(0.9);
  Proxy proxy;
  const Vec3d cursor = {0.5, -0.6, 0.5};
  static_cast<void>(proxy.step(*level, {0.5, 0.01, 0.5}));
  for (int k = 1; k <= 61; ++k) ASSERT_TRUE(proxy.step(*level, {0.5, 0.01 - 0.01 * k, 0.5}));
  for (int k = 0; k < 400; ++k) ASSERT_TRUE(proxy.step(*level, cursor));
  EXPECT_FALSE(proxy.settling());
  double last = 1e300;
  int ticks = 0;
  for (; ticks < 100; ++ticks) {
    ASSERT_TRUE(proxy.step(*slope, cursor));
    EXPECT_LE(proxy.depth(), last) << ticks;
    last = proxy.depth();
    if (!proxy.settling()) break;
  }
  EXPECT_GE(ticks, 1);
  EXPECT_LT(ticks, 20);
  EXPECT_NEAR(proxy.depth(), length(closest_point(*slope, cursor).position - cursor), 1e-6);
  const Vec3d rest = proxy.position();
  for (int k = 0; k < 20; ++k) ASSERT_TRUE(proxy.step(*slope, cursor));
  EXPECT_EQ(proxy.position(), rest);
}

TEST(Proxy, LetsGoOfAFastCursorThatComesOutAtAGrazingAngle) {
  const SnapshotPtr model = testing::fine_sphere();
  for (const double step : {0.01, 0.02, 0.04}) {
    const auto at = [&](double turn, double height) {
      return Vec3d{std::sin(turn), std::cos(turn), 0.01} * (1 + height);
    };
    Proxy proxy;
    static_cast<void>(proxy.step(*model, at(0, 0.01)));
    for (int k = 1; k <= 100; ++k) static_cast<void>(proxy.step(*model, at(1e-3 * k, 0.01 - 1.5e-4 * k)));
    ASSERT_TRUE(proxy.held());
    int held = 0;
    for (int k = 1; k <= 20; ++k) held += proxy.step(*model, at(0.1 + step * k, 0.005 * step * k)) ? 1 : 0;
    EXPECT_LE(held, 2) << step;
  }
}

TEST(Proxy, FollowsASurfaceThatRisesAndFalls) {
  const auto mesh = plane_shell(4, 8);
  const auto level = [&](double height) { return displaced(mesh, [=](Vec3d) { return 0.5 + height / 0.2; }); };
  const SnapshotPtr flat = level(0), raised = level(0.02), carved = level(-0.02);
  Proxy proxy;
  static_cast<void>(proxy.step(*flat, {0.4, 0.01, 0.45}));
  static_cast<void>(proxy.step(*flat, {0.4, -0.03, 0.45}));
  EXPECT_NEAR(proxy.depth(), 0.03, 1e-6);
  EXPECT_TRUE(proxy.step(*raised, {0.4, -0.03, 0.45}));
  EXPECT_NEAR(proxy.rise(), 0.02, 1e-6);
  EXPECT_NEAR(proxy.depth(), 0.05, 1e-6);
  EXPECT_NEAR(proxy.position().y, 0.02, 1e-6);
  ASSERT_TRUE(proxy.step(*raised, {0.4, -0.03, 0.45}));
  EXPECT_EQ(proxy.rise(), 0);
  ASSERT_TRUE(proxy.step(*carved, {0.4, -0.03, 0.45}));
  EXPECT_NEAR(proxy.rise(), -0.04, 1e-6);
  EXPECT_NEAR(proxy.depth(), 0.01, 1e-6);
  EXPECT_NEAR(proxy.position().y, -0.02, 1e-6);
}

TEST(Proxy, IsCaughtByASurfaceThatRisesPastARestingCursor) {
  const auto mesh = plane_shell(4, 8);
  const auto level = [&](double height) { return displaced(mesh, [=](Vec3d) { return 0.5 + height / 0.2; }); };
  Proxy proxy;
  EXPECT_FALSE(proxy.step(*level(0), {0.4, 0.01, 0.45}));
  EXPECT_TRUE(proxy.step(*level(0.03), {0.4, 0.01, 0.45}));
  EXPECT_NEAR(proxy.rise(), 0.02, 1e-6);
  EXPECT_NEAR(proxy.depth(), 0.02, 1e-6);
  EXPECT_TRUE(proxy.settling());
}

TEST(Proxy, OtherSlabsUnderItWithoutASurfaceNearItAreReported) {
  const SnapshotPtr one = displaced(sphere_shell(2, 8), [](Vec3d) { return 0.5; });
  const SnapshotPtr two = displaced(sphere_shell(2, 8, 0.7, 1.3), [](Vec3d) { return 0.5; });
  Proxy proxy;
  static_cast<void>(proxy.step(*one, {0, 0, 1.1}));
  ASSERT_TRUE(proxy.step(*one, {0, 0, 0.9}));
  EXPECT_TRUE(proxy.step(*two, {0, 0, 0.9}));
  EXPECT_FALSE(proxy.lost());
  EXPECT_NEAR(proxy.depth(), 0.1, 0.01);
  const SnapshotPtr far = displaced(sphere_shell(2, 8, 2.7, 3.3), [](Vec3d) { return 0.5; });
  EXPECT_FALSE(proxy.step(*far, {0, 0, 0.9}));
  EXPECT_TRUE(proxy.lost());
  // As much work as the search for its place takes, in samples: by its root, along its fibre, and all around.
  EXPECT_NEAR(proxy.samples_placed(), 4 + 40 + 120, 2);
}

TEST(Proxy, AskedForItsNormalOrNotItGoesTheSameWay) {
  const SnapshotPtr model = bumpy_torus();
  Proxy told, bare;
  testing::WanderingHand wandering;
  int held = 0;
  for (int k = 0; k < 5000; ++k) {
    const Vec3d hand = wandering.next();
    const bool feels = told.step(*model, hand);
    bare.step(*model, hand);
    ASSERT_EQ(told.held(), bare.held()) << k;
    if (!feels) continue;
    const SurfacePoint at = told.describe(*model).surface;
    ++held;
    ASSERT_EQ(told.depth(), bare.depth());
    ASSERT_EQ(told.way_out(), bare.way_out());
    ASSERT_EQ(told.position(), bare.position());
    if (k % 7 == 0) {
      const SurfacePoint same = bare.surface(*model);
      ASSERT_EQ(at.position, same.position);
      ASSERT_EQ(at.normal, same.normal);
    }
  }
  EXPECT_GT(held, 500);
}

/// Where samples stand up like needles their normals go anywhere, also to where the force would pull in.
TEST(Proxy, AtLeastHalfOfTheForceAlongItsNormalPushesOut) {
  const SnapshotPtr model = testing::rough_models(128).front();
  Proxy proxy;
  testing::WanderingHand wandering;
  int held = 0;
  double least = 1;
  for (int k = 0; k < 20000; ++k) {
    if (!proxy.step(*model, wandering.next()) || !(proxy.depth() > 0)) continue;
    ++held;
    least = std::min(least, dot(proxy.describe(*model).normal, proxy.way_out()));
  }
  EXPECT_GT(held, 5000);
  EXPECT_NEAR(least, 0.5, 1e-4) << "and it is led no further than that";
}

TEST(Proxy, SetsOffFromAPlaceInTheOpenOrOneThatTheSurfaceHasRisenPast) {
  const auto mesh = plane_shell(4, 8);
  const auto level = [&](double height) { return displaced(mesh, [=](Vec3d) { return 0.5 + height / 0.2; }); };
  const SnapshotPtr low = level(0), high = level(0.03);
  Proxy proxy;
  proxy.start(*mesh, {0.4, 0.01, 0.45});
  EXPECT_TRUE(proxy.step(*low, {0.4, -0.02, 0.45}));
  EXPECT_NEAR(proxy.depth(), 0.02, 1e-6);
  LocateHint hint;
  const auto below = probe(*high, {0.4, 0.01, 0.45}, hint);
  ASSERT_TRUE(below && below->touching());
  proxy.start(*mesh, {0.4, 0.01, 0.45}, below->at);
  EXPECT_TRUE(proxy.step(*high, {0.4, 0.01, 0.45}));
  EXPECT_NEAR(proxy.rise(), 0.02, 1e-6);
  EXPECT_NEAR(proxy.depth(), 0.02, 1e-6);
}

}  // namespace
}  // namespace relief
