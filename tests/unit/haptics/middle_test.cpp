// Made-up bodies, thick and thin, whose contact is known: what is held past the middle, what is not, and that the
// point's own moves put nothing into the spring.
#include "support/bodies.h"
#include "support/driver.h"
#include "support/exported.h"
#include "support/god_object.h"
#include "support/hand_ways.h"

#include <relief/convert/convert.h>
#include <relief/core/tessellate.h>
#include <relief/haptics/contact/ball_proxy.h>
#include <relief/haptics/contact/proxy.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace relief {
namespace {

using testing::kPi;

SnapshotPtr converted(const TriangleMesh& mesh, int intervals = 16) {
  auto made = convert(mesh, {.slabs = 100, .intervals = intervals, .mode = Mode::Certified});
  if (!made) throw std::runtime_error(made.error().message);
  return made->model.head;
}

/// Along z, of radius 0.1.
SnapshotPtr rod() {
  static const SnapshotPtr model = converted(testing::extruded(testing::regular_polygon(48, 0.1), 0.5));
  return model;
}
/// Flat on z = 0, of radius 0.5.
SnapshotPtr disc(double thickness) {
  return converted(testing::extruded(testing::regular_polygon(64, 0.5), thickness / 2));
}
/// A hollow sphere of radius 1: a sheet that faces outwards, and one below it that faces inwards.
SnapshotPtr spherical_shell(double thickness) {
  const auto like = testing::sphere_shell(4, 8);
  const auto count = static_cast<FibreId>(like->fibres().size());
  std::vector<Fibre> fibres;
  for (const double side : {1.0, -1.0})
    for (const Fibre& f : like->fibres()) {
      const Vec3d out = normalized(f.inner), middle = out * (side > 0 ? 1 : 1 - thickness);
      fibres.push_back({middle - out * (side * 0.2 * thickness), middle + out * (side * 0.2 * thickness)});
    }
  std::vector<SlabMesh::Face> slabs;
  for (const Slab& slab : like->slabs()) slabs.push_back({slab.fibres, slab.intervals});
  for (const Slab& slab : like->slabs())
    slabs.push_back({{slab.fibres[0] + count, slab.fibres[2] + count, slab.fibres[1] + count}, slab.intervals});
  auto mesh = SlabMesh::make(std::move(fibres), slabs);
  if (!mesh) throw std::runtime_error(mesh.error().message);
  return testing::shaped(std::make_shared<const SlabMesh>(*std::move(mesh)), [=](Vec3d p) {
    const double r = length(p);
    return std::abs(r - 1 + thickness / 2) - thickness / 2;
  });
}
/// A finger along x, thinner than it is wide.
SnapshotPtr finger() {
  const auto thin =
      testing::mapped_shell(*testing::sphere_shell(2, 16), [](Vec3d p) { return Vec3d{p.x, 0.12 * p.y, 0.15 * p.z}; });
  return testing::displaced(thin, [](Vec3d) { return 0.5; });
}

/// A contact point that is led about, and what it does in each tick.
struct Led {
  const Snapshot& model;
  Proxy proxy = {};
  Vec3d cursor = {};
  double made = 0;       ///< of the squared distance: what the point's own moves have added to it since it is held
  double most_made = 0;  ///< at most, over the greatest squared depth
  double deepest2 = 0;
  int lost = 0;  ///< ticks without contact

  void to(Vec3d next) {
    const bool was_held = proxy.held();
    const Vec3d before = proxy.position();
    static_cast<void>(proxy.step(model, next));
    cursor = next;
    lost += proxy.held() ? 0 : 1;
    if (!was_held) {
      made = 0;
      return;
    }
    const Vec3d now = proxy.held() ? proxy.position() : cursor, from = before - cursor, off = now - cursor;
    deepest2 = std::max(deepest2, dot(from, from));
    made += dot(off, off) - dot(from, from);
    most_made = std::max(most_made, made);
  }
  /// Straight, so far in a tick.
  void straight(Vec3d to_there, double step) {
    for (const Vec3d place : testing::straight_ways({cursor, to_there}, step)) to(place);
  }
  void begin(Vec3d at) {
    proxy.reset();
    static_cast<void>(proxy.step(model, cursor = at));
    lost = 0;
  }
};

TEST(Sphere, IsAsDeepAsItsRadiusIsLongerAtAllDepthsAndAllWays) {
  const SnapshotPtr model = testing::fine_sphere();
  for (const Vec3d way : {Vec3d{0, 0, 1}, Vec3d{0, 1, 0}, normalized(Vec3d{1, 2, 3}), normalized(Vec3d{-1, 1, 0.3})})
    for (const double depth : {0.07, 0.3, 0.6, 0.94}) {
      Led led{*model};
      led.begin(way * 1.05);
      led.straight(way * (1 - depth), 2e-3);
      EXPECT_NEAR(led.proxy.depth(), depth, 0.01 * depth);
      // And half round.
      const Vec3d side = normalized(cross(way, {0.3, 0.5, -0.7}));
      double deepest = 0;
      led.lost = 0;
      for (int k = 0; k <= 2000; ++k) {
        const double turn = kPi * k / 2000;
        led.to((way * std::cos(turn) + side * std::sin(turn)) * (1 - depth));
        deepest = std::max(deepest, led.proxy.depth());
      }
      EXPECT_EQ(led.lost, 0);
      EXPECT_LT(deepest, 1.05 * depth) << depth;
      EXPECT_NEAR(led.proxy.depth(), depth, 0.05 * depth);
    }
}

TEST(Rod, PressedBeyondItsMiddleItHoldsAlsoAHandThatStraysALittle) {
  // 0.15 deep in a rod of 0.2, by a hand that strays by 0.03 to each side; a plain god-object is on the far side at
  // once.
  const SnapshotPtr model = rod();
  for (double turn = 0.1; turn < 6; turn += 0.7) {
    const Vec3d out = {std::cos(turn), std::sin(turn), 0}, side = {-out.y, out.x, 0};
    Led led{*model};
    led.begin(out * 0.12);
    led.straight(out * (0.1 - 0.15), 5e-4);
    int wrong = 0;
    led.lost = 0;
    for (int k = 0; k < 4000; ++k) {
      const double phase = 2 * kPi * k / 1000;
      led.to(out * -0.05 + side * (0.03 * std::sin(phase)));
      wrong += dot(led.proxy.way_out(), out) > 0.5 ? 0 : 1;
    }
    EXPECT_EQ(led.lost, 0) << turn;
    EXPECT_EQ(wrong, 0) << turn;
    led.straight(out * 0.12, 5e-4);
    EXPECT_FALSE(led.proxy.held());
    EXPECT_LE(led.most_made, 1e-12) << turn;
  }
}

TEST(Rod, PressedThroughAndBackItIsHeldTheWholeWay) {
  const SnapshotPtr model = rod();
  for (double turn = 0.1; turn < 6; turn += 0.7) {
    const Vec3d out = {std::cos(turn), std::sin(turn), 0};
    Led led{*model};
    led.begin(out * 0.12);
    led.straight(out * 0.099, 5e-4);
    led.lost = 0;
    led.straight(out * -0.15, 5e-4);
    for (const double deep : {0.15, 0.01, -0.05}) {
      led.straight(out * -deep, 5e-4);
      EXPECT_NEAR(led.proxy.depth(), 0.1 + deep, 0.02 * (0.1 + deep)) << turn << " " << deep;
      EXPECT_GT(dot(led.proxy.way_out(), out), 0.9) << turn << " " << deep;
    }
    EXPECT_EQ(led.lost, 0);
  }
}

TEST(Rod, ACursorThatCirclesInsideItTakesThePointRound) {
  const SnapshotPtr model = rod();
  for (const double share : {0.3, 0.5, 0.8, 0.95})
    for (const double step : {3e-4, 1.5e-3}) {  // 0.1 and 0.5 diagonals a second
      Led led{*model};
      led.begin({0.12, 0, 0.013});
      led.straight({share * 0.1, 0, 0.013}, step);
      const double depth = 0.1 * (1 - share);
      double deepest = 0;
      const int ticks = static_cast<int>(4 * kPi * share * 0.1 / step);
      led.lost = 0;
      for (int k = 0; k < ticks; ++k) {
        const double turn = 4 * kPi * k / ticks;
        led.to({share * 0.1 * std::cos(turn), share * 0.1 * std::sin(turn), 0.013});
        deepest = std::max(deepest, led.proxy.depth());
      }
      EXPECT_LT(deepest, 1.05 * depth) << share << " " << step;
      EXPECT_EQ(led.lost, 0) << share << " " << step;
      EXPECT_LE(led.most_made, 1e-12) << share << " " << step;
    }
}

TEST(Disc, IsHeldSeveralThicknessesDeepAlsoNearItsRim) {
  // Of 8 presses a plain god-object loses 3; the one beside the rim that is deepest may slip.
  const SnapshotPtr model = disc(0.06);
  int slipped = 0;
  for (const double share : {0.0, 0.6, 0.9, 0.96})
    for (const double depth : {0.05, 0.15}) {
      Led led{*model};
      const Vec3d start = {0.5 * share * std::cos(0.3), 0.5 * share * std::sin(0.3), 0.05};
      led.begin(start);
      led.straight(start + Vec3d{0, 0, -0.021}, 5e-4);
      led.lost = 0;
      led.straight(start + Vec3d{0, 0, -0.02 - depth}, 5e-4);
      if (led.lost == 0 && led.proxy.way_out().z > 0.9) {
        EXPECT_NEAR(led.proxy.depth(), depth, 0.02 * depth) << share << " " << depth;
      }
      for (int k = 0; k < 500; ++k) led.to(led.cursor);
      led.straight(start + Vec3d{0, 0, -0.021}, 5e-4);
      const bool held = led.lost == 0 && led.proxy.way_out().z > 0.9;
      slipped += held ? 0 : 1;
      EXPECT_TRUE(held || (share > 0.95 && depth > 0.1)) << share << " " << depth;
      EXPECT_LE(led.most_made, 1e-12) << share << " " << depth;
    }
  EXPECT_LE(slipped, 1);
}

TEST(Disc, OneOf17ThousandthsIsHeldThreeThicknessesDeepBesideItsRim) {
  const SnapshotPtr model = disc(0.017);
  for (double turn = 0.1; turn < 6; turn += 0.7) {
    Led led{*model};
    const Vec3d start = {0.48 * std::cos(turn), 0.48 * std::sin(turn), 0.02};
    led.begin(start);
    led.straight(start + Vec3d{0, 0, -0.012}, 5e-4);
    led.lost = 0;
    led.straight(start + Vec3d{0, 0, -0.0115 - 3 * 0.017}, 5e-4);
    EXPECT_EQ(led.lost, 0) << turn;
    EXPECT_GT(led.proxy.way_out().z, 0.9) << turn;
    EXPECT_NEAR(led.proxy.depth(), 3 * 0.017, 0.02 * 3 * 0.017) << turn;
  }
}

TEST(SphericalShell, APointBelowItKeepsUpWithASlideHoweverDeep) {
  const double thickness = 0.02;
  const SnapshotPtr model = spherical_shell(thickness);
  for (const double times : {0.5, 1.0, 2.0, 4.0, 10.0}) {
    const double depth = times * thickness;
    Led led{*model};
    led.begin({0, 0, 1.02});
    led.straight({0, 0, 0.999}, 1e-3);
    led.lost = 0;
    led.straight({0, 0, 1 - depth}, 1e-3);
    double deepest = 0;
    for (int k = 0; k <= 1600; ++k) {
      const double turn = kPi * k / 1600;
      led.to(Vec3d{0.8 * std::sin(turn), 0.6 * std::sin(turn), std::cos(turn)} * (1 - depth));
      deepest = std::max(deepest, led.proxy.depth());
    }
    EXPECT_EQ(led.lost, 0) << times;
    EXPECT_LT(deepest, 1.05 * depth + 1e-4) << times;
    EXPECT_LE(led.most_made, 1e-12) << times;
  }
}

/// The nearest place goes five times as fast as the hand there, and the point at most three times. While it is behind
/// by less than the depth it is still led there, by whatever sideways way the hand makes.
TEST(SphericalShell, APointThatLagsCatchesUpWhileTheHandStirs) {
  const SnapshotPtr model = spherical_shell(0.02);
  Led led{*model};
  led.begin({0, 0, 1.02});
  led.straight({0, 0, 0.2}, 1e-3);
  led.lost = 0;
  const auto behind = [&] { return std::acos(dot(normalized(led.cursor), normalized(led.proxy.position()))); };
  led.straight({0.07, 0, 0.2}, 1e-3);
  EXPECT_GT(behind(), 0.11) << "there is something to catch up with";
  EXPECT_LT(behind(), 0.25);
  for (int k = 0; k < 100; ++k) led.to({0.07 + 1e-3 * (k % 2), 0, 0.2});
  EXPECT_LT(behind(), 0.03);
  EXPECT_EQ(led.lost, 0);
}

TEST(Wedge, OnItsFlatSideThePointKeepsUpAndPastTheEdgeItLetsGo) {
  // 30 degrees; at 0.2 from the edge it is 0.115 thick.
  const SnapshotPtr model = converted(testing::wedge(kPi / 6, 0.5));
  for (const double depth : {0.03, 0.1, 0.2}) {
    Led led{*model};
    led.begin({-0.6, 0.02, 0.05});
    led.straight({-0.6, -1e-3, 0.05}, 1e-3);
    led.lost = 0;
    led.straight({-0.6, -depth, 0.05}, 1e-3);
    for (double x = -0.6; x < 0.2; x += 1e-3) {
      led.to({x, -depth, 0.05});
      if (x < -0.01) {
        ASSERT_TRUE(led.proxy.held()) << depth << " " << x;
        ASSERT_NEAR(led.proxy.depth(), depth, 0.03 * depth) << depth << " " << x;
      }
      if (x > 0.03) {
        ASSERT_FALSE(led.proxy.held()) << depth << " " << x;
      }
    }
    EXPECT_LE(led.most_made, 1e-12) << depth;
  }
}

/// A wedge whose edge is cut off, so far from it on either face.
TriangleMesh chamfered_wedge(double angle, double cut) {
  const Vec3d far = {-std::cos(angle), -std::sin(angle), 0};
  return testing::extruded({{-cut, 0, 0}, {-1, 0, 0}, far, far * cut}, 0.4);
}

/// A hand slides out over a chamfer that is smaller than it is deep, at 0.1 diagonals a second. The ball goes over the
/// chamfer and through the air behind it by no more than 10 times the hand's way in a tick, which is 0.06 N. In the end
/// it is free.
TEST(Chamfer, ABallGoesOverItAndLetsGoWithoutAStepOfForce) {
  constexpr double kMetres = 0.15, kStiffness = 400;  // m, N/m
  for (const int degrees : {45, 60, 90, 120}) {
    const SnapshotPtr model = converted(testing::subdivided(chamfered_wedge(degrees * kPi / 180, 0.015), 4), 64);
    const Box3d box = bounds_of_surface(*model);
    const double size = diagonal(box);
    for (const double radius : {0.003, 0.01, 0.02})
      for (const double depth : {0.015, 0.02, 0.03})
        for (const double aslant : {0.0, 0.15}) {
          ServoSettings settings = testing::settings_with(kStiffness, 0, 0, kMetres / size);
          settings.workspace.model_origin = box.centre();
          settings.tool.radius = radius * size;
          testing::Driver hand(settings, testing::strong_device());
          const double up = (radius - depth) * size, above = (radius + 0.02) * size;
          ServoSample felt;
          Vec3d last;
          double most = 0, deepest = 0;
          for (const Vec3d cursor :
               testing::straight_ways({{-0.3, above, -aslant}, {-0.3, up, -aslant}, {0.15, up, aslant}}, 1e-4 * size)) {
            felt = hand.at(*model, cursor);
            most = std::max(most, length(felt.force - last));
            deepest = std::max(deepest, felt.depth);
            last = felt.force;
          }
          const auto which = [&] {
            return std::to_string(degrees) + " degrees, a ball of " + std::to_string(radius) + ", " +
                   std::to_string(depth) + " deep";
          };
          EXPECT_GT(deepest, 0.99 * depth * size) << which();
          EXPECT_LT(most, 0.1) << which();
          EXPECT_FALSE(felt.contact) << which();
          EXPECT_EQ(felt.force, Vec3d{}) << which();
        }
  }
}

/// All thin bodies, and a way into each.
struct Thin {
  const char* name;
  SnapshotPtr model;
  Vec3d outside, deep, aside, other;  ///< and how far the hand goes about there
};
std::vector<Thin> thin_bodies() {
  return {{"finger", finger(), {0.1, 0.3, 0.02}, {0.1, -0.1, 0.02}, {0.03, 0, 0}, {0, 0, 0.06}},
          {"rod", rod(), {0, 0.12, 0.05}, {0, -0.06, 0.05}, {0.03, 0, 0}, {0, 0.02, 0.03}},
          {"disc", disc(0.06), {0.2, 0.1, 0.05}, {0.2, 0.1, -0.1}, {0.05, 0, 0}, {0, 0.05, 0.02}},
          {"shell", spherical_shell(0.05), {0, 0, 1.05}, {0, 0, 0.8}, {0.2, 0, 0}, {0, 0.2, 0.05}}};
}

/// A point goes straight in, to so far beyond the middle of the finger as that is thick, and out again. Where a plain
/// god-object stays on its front up to the middle, the point stays there for good. Where that rolls off, the point does
/// so step by step, and its depth falls.
TEST(Finger, PressedThroughItHoldsWhereverAGodObjectDoesNotRollOff) {
  const SnapshotPtr model = finger();
  const testing::BareTriangles bare = testing::bare_triangles(*model);
  constexpr double kStep = 4e-4;
  int straight = 0, rolled = 0;
  for (const double x : {0.0, 0.5, 0.8, 0.93})
    for (const double z : {0.0, 0.02, 0.05, 0.1}) {
      const double half = 0.12 * std::sqrt(std::max(0.01, 1 - x * x)), beside = z / 0.15 * half * 1.25;
      const std::vector<Vec3d> way = testing::straight_ways({{x, 0.3, beside}, {x, -half, beside}}, kStep);
      testing::GodObject oracle(bare);
      bool rolls = false, past = false;
      for (const Vec3d cursor : way) {
        const testing::OracleTick plain = oracle.move(cursor);
        if (plain.held && plain.depth > 0.01 && !past) {
          rolls = rolls || plain.point.y - cursor.y < 0.5 * plain.depth;
          past = bare.past_the_middle(plain.point, cursor);
        }
      }
      (rolls ? rolled : straight) += 1;
      const auto in = bare.entry(way.front(), way.back());
      ASSERT_TRUE(in);
      const double front = 0.3 - in->share * (0.3 + half);
      Led led{*model};
      led.begin(way.front());
      for (std::size_t k = 1; k < 2 * way.size() - 1; ++k) {
        const Vec3d cursor = way[k < way.size() ? k : 2 * way.size() - 2 - k], last = led.proxy.position();
        const bool was_held = led.proxy.held();
        led.to(cursor);
        const double depth = led.proxy.depth();
        if (was_held && led.proxy.held()) {
          EXPECT_LE(length(led.proxy.position() - last), 1.001 * std::max(10 * kStep, 0.02 * (depth + 10 * kStep)));
        }
        if (rolls || std::abs(cursor.y - front) < 1e-6) continue;
        ASSERT_EQ(led.proxy.held(), cursor.y < front) << x << " " << z << " " << cursor.y;
        if (depth > 0.01) {
          EXPECT_GT(led.proxy.way_out().y, 0.5) << x << " " << z << " " << cursor.y;
        }
      }
    }
  EXPECT_GE(straight, 8);
  EXPECT_GE(rolled, 2);
}

TEST(ThinBodies, OverAClosedWayThePointsOwnMovesPutNothingIntoTheSpring) {
  for (const Thin& body : thin_bodies()) {
    Led led{*body.model};
    led.begin(body.outside);
    led.straight(body.deep, 5e-4);
    ASSERT_TRUE(led.proxy.held()) << body.name;
    int held = 0;
    for (int k = 0; k < 9000; ++k) {
      const double turn = 2 * kPi * k / 3000;
      led.to(body.deep + body.aside * std::sin(turn) + body.other * (1 - std::cos(turn)) +
             body.aside * (0.3 * std::sin(2 * turn)));
      held += led.proxy.held() ? 1 : 0;
    }
    EXPECT_GT(held, 3000) << body.name;
    EXPECT_LE(led.most_made, 1e-12 * led.deepest2) << body.name;
  }
}

/// Past the middle the point goes by at most three times the hand's sideways way in a tick, to a minimum that has come
/// near as well as when it makes up for what it owes.
TEST(ThinBodies, PastTheMiddleThePointGoesNoFartherThanThreeTimesTheHandsSidewaysWay) {
  double most = 0;
  long past = 0;
  for (const Thin& body : thin_bodies()) {
    const testing::BareTriangles bare = testing::bare_triangles(*body.model);
    Led led{*body.model};
    led.begin(body.outside);
    led.straight(body.deep, 5e-4);
    for (int k = 0; k < 9000; ++k) {
      const double turn = 2 * kPi * k / 3000;
      const Vec3d next = body.deep + body.aside * std::sin(turn) + body.other * (1 - std::cos(turn)) +
                         body.aside * (0.3 * std::sin(7 * turn));
      const bool was_held = led.proxy.held();
      const Vec3d before = led.proxy.position(), move = next - led.cursor;
      led.to(next);
      if (!was_held || !led.proxy.held() || led.proxy.has_left() || !bare.past_the_middle(before, next)) continue;
      ++past;
      const double own = length(detail::square_to(before - next, move)), gone = length(led.proxy.position() - before);
      EXPECT_LE(gone, 3 * own + 1e-9) << body.name << " " << k;
      if (own > 1e-6) most = std::max(most, gone / own);
    }
  }
  EXPECT_GT(past, 5000);
  EXPECT_GT(most, 2.9) << "the bound is reached";
}

TEST(ThinBodies, ABallsOwnMovesPutNothingIntoTheSpringEither) {
  for (const Thin& body : thin_bodies()) {
    const double radius = 0.02;
    BallProxy ball;
    Vec3d cursor = body.outside;
    double made = 0, most_made = 0, deepest2 = 0;
    int held = 0;
    const auto to = [&](Vec3d next) {
      const bool was_held = ball.held() && !ball.under_way();
      const Vec3d before = ball.centre() - next;
      static_cast<void>(ball.step(*body.model, next, radius));
      cursor = next;
      const Vec3d off = ball.centre() - next;
      if (!was_held)
        made = 0;
      else
        made += dot(off, off) - dot(before, before);
      most_made = std::max(most_made, made);
      deepest2 = std::max(deepest2, dot(off, off));
      held += ball.held() ? 1 : 0;
    };
    static_cast<void>(ball.step(*body.model, cursor, radius));
    for (const Vec3d place : testing::straight_ways({body.outside, body.deep}, 5e-4)) to(place);
    for (int k = 0; k < 9000; ++k) {
      const double turn = 2 * kPi * k / 3000;
      to(body.deep + body.aside * std::sin(turn) + body.other * (1 - std::cos(turn)) +
         body.aside * (0.3 * std::sin(2 * turn)));
    }
    EXPECT_GT(held, 3000) << body.name;
    EXPECT_LE(most_made, 1e-9 * deepest2) << body.name;
  }
}

}  // namespace
}  // namespace relief
