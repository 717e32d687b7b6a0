// What an edit of the surface under a tool does to the force: it is felt without a step, and is over in bounded time.
#include "support/driver.h"
#include "support/held_tools.h"
#include "support/wandering_hand.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace relief {
namespace {

using testing::displaced;
using testing::Driver;
using testing::HeldTool;
using testing::plane_shell;

constexpr double kStiffness = 400, kMetres = 0.1;     // N/m; m per model unit
constexpr double kMost = 0.045 * (1 + 1e-9) + 1e-12;  // N in a tick, what is felt of an edit

/// Pushed straight out or along the shaded normal, with each of the tools.
struct Case {
  HeldTool held;
  bool exact;
};
std::vector<Case> cases() {
  std::vector<Case> all;
  for (const HeldTool& held : testing::held_tools(0.04))
    for (const bool exact : {false, true})
      if (held.is_point() || exact) all.push_back({held, exact});
  return all;
}
Driver driver(const Case& with, double friction = 0) {
  ServoSettings settings = testing::settings_with(kStiffness, 0, friction, kMetres);
  settings.force.exact_normals = with.exact;
  settings.tool = with.held.tool();
  return {settings, testing::strong_device()};
}

TEST(Edit, ABumpThatRisesAndGoesUnderTheToolIsFeltWithoutAStep) {
  const auto mesh = plane_shell(4, 32);
  const auto bump = [&](double height) {
    return displaced(
        mesh, [=](Vec3d p) { return 0.5 + height * std::max(0.0, 1 - 5 * std::hypot(p.x - 0.46, p.z - 0.45)) / 0.2; });
  };
  // By 2.4 mm at the hand, so steep that the nearest place of the new surface is elsewhere.
  const SnapshotPtr flat = bump(0), raised = bump(0.024);
  for (const Case& with : cases())
    for (const double depth : {0.01, 0.03}) {
      Driver hand = driver(with);
      const Vec3d rest = {0.47, with.held.radius - depth, 0.45};
      ServoSample last;
      for (int k = 0; k < 400; ++k) last = hand.at(*flat, rest + Vec3d{0, std::max(0.0, 1e-3 * (100 - k)), 0});
      const Vec3d first = last.force;
      ASSERT_GT(first.y, 0.3) << with.held.name;
      double farthest = 0;
      int ticks = 0;  // in which the force still changes
      for (int k = 0; k < 800; ++k) {
        const ServoSample now = hand.at(k < 400 ? *raised : *flat, rest);
        ASSERT_EQ(now.flags, 0U);
        ASSERT_LE(length(now.force - last.force), kMost) << with.held.name << " " << depth << " " << k;
        ticks += now.force != last.force ? 1 : 0;
        last = now;
        farthest = std::max(farthest, length(now.force - first));
      }
      EXPECT_GT(farthest, 0.5) << with.held.name << " feels it";
      EXPECT_LT(length(last.force - first), 0.1) << "and is back";
      EXPECT_LT(ticks, 2 * 200);
    }
}

TEST(Edit, ARiseOfMoreThanThreeMillimetresIsASafeStateAndNoForce) {
  const auto mesh = plane_shell(4, 8);
  const auto level = [&](double metres) {
    return displaced(mesh, [=](Vec3d) { return 0.5 + metres / kMetres / 0.2; });
  };
  for (const Case& with : cases())
    for (const double rise : {2.9e-3, 3.1e-3}) {
      Driver hand = driver(with);
      const Vec3d rest = {0.45, with.held.radius - 0.005, 0.45};
      for (int k = 0; k < 100; ++k) static_cast<void>(hand.at(*level(0), rest + Vec3d{0, 1e-4 * (99 - k), 0}));
      const ServoSample now = hand.at(*level(rise), rest);
      const std::uint32_t latched = bit(ServoFault::SurfaceJumped) | bit(ServoFault::Latched);
      EXPECT_EQ(now.flags & latched, rise > 3e-3 ? latched : 0U) << with.held.name << " " << rise;
      if (rise > 3e-3) {
        EXPECT_EQ(now.force, Vec3d{});
      } else {
        EXPECT_GT(length(now.force), 0.1);
      }
    }
}

/// Pressed sideways into a thorn, which is then gone: what held the tool fades, whatever the hand does.
TEST(Edit, WhatItTakesAwayIsOverInBoundedTimeWithoutAStep) {
  const auto mesh = plane_shell(4, 32);
  const SnapshotPtr before = testing::with_thorn(mesh, 0.5), after = testing::with_thorn(mesh, 0);
  const Case point = cases().front();
  for (const int moves_every : {0, 1, 2, 10})
    for (const Vec3d way : {Vec3d{1, 0, 0}, Vec3d{-1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}}) {
      Driver driven = driver(point, 0.5);
      Vec3d hand = {0.4, 0, 0.5};
      ServoSample last;
      for (; hand.x < 0.48; hand.x += 1e-3) last = driven.at(*before, hand);
      for (int k = 0; k < 100; ++k) last = driven.at(*before, hand);
      ASSERT_GT(length(last.force), 0.5);
      const Vec3d first = last.force;
      int ticks = 0;
      while (length(last.force) > 0 && ticks < 400) {
        const double travel = moves_every > 0 && ticks % moves_every == 0 ? 2e-4 : 0;
        hand += way * travel;
        const ServoSample now = driven.at(*after, hand);
        ASSERT_EQ(now.flags, 0U);
        ASSERT_LE(length(now.force - last.force), kMost) << ticks;
        ASSERT_GE(dot(now.force, first), 0) << "it fades the way that it pushed";
        last = now;
        ++ticks;
      }
      EXPECT_GT(ticks, 20) << "it is felt for a while";
      EXPECT_LT(ticks, 150) << "a thousandth of a newton is left after 15 ms times ln 1000";
    }
}

bool all_finite(const ServoSample& s) {
  const bool vectors = is_finite(s.device) && is_finite(s.cursor) && is_finite(s.velocity) &&
                       is_finite(s.contact_point) && is_finite(s.normal) && is_finite(s.force) && is_finite(s.torque);
  return vectors && std::isfinite(s.at.u) && std::isfinite(s.at.v) && std::isfinite(s.at.alpha) &&
         std::isfinite(s.depth) && std::isfinite(s.leak);
}

/// What is left of a force then has neither a surface nor a spring that it could be measured by.
TEST(Edit, GroundAndStiffnessThatGoInOneMomentLeaveNoForceAndNoNumberThatIsNone) {
  const auto mesh = plane_shell(4, 8);
  const SnapshotPtr ground = displaced(mesh, [](Vec3d) { return 0.5; });
  const SnapshotPtr gone = displaced(mesh, [](Vec3d) { return 0.5 - 0.08 / 0.2; });
  for (const Case& with : cases())
    for (const bool guard : {false, true}) {
      ServoSettings settings = testing::settings_with(kStiffness, 1, 0.5, kMetres);
      settings.force.exact_normals = with.exact;
      settings.force.guard = guard;
      settings.tool = with.held.tool();
      Driver hand(settings, testing::strong_device());
      const Vec3d rest = {0.45, with.held.radius - 0.03, 0.45};
      ServoSample last;
      for (int k = 0; k < 300; ++k) last = hand.at(*ground, rest + Vec3d{0, std::max(0.0, 1e-3 * (100 - k)), 0});
      ASSERT_GT(last.force.y, 0.5) << with.held.name;
      settings.force.stiffness = 0;
      hand.servo().set(settings);
      int felt = 0;
      for (int k = 0; k < 400; ++k) {
        const ServoSample now = hand.at(*gone, rest);
        felt += length(now.force) > 0 ? 1 : 0;
        ASSERT_TRUE(all_finite(now)) << with.held.name << " " << k;
        ASSERT_LE(length(now.force), length(last.force) * (1 + 1e-9)) << with.held.name << " " << k;
        ASSERT_LE(now.depth, last.depth) << with.held.name << " " << k;
        last = now;
      }
      EXPECT_GT(felt, 20) << with.held.name;
      EXPECT_EQ(last.force, Vec3d{}) << with.held.name;
      EXPECT_EQ(last.torque, Vec3d{}) << with.held.name;
      EXPECT_FALSE(last.contact) << with.held.name;
    }
}

/// The surface becomes another again and again under a hand that goes in and out of it.
TEST(Edit, WhateverTheHandDoesMeanwhileTheForceGoesNoFasterThanItMay) {
  const auto mesh = testing::torus_shell(24, 12, 24);
  std::vector<SnapshotPtr> models;
  for (const double high : {0.0, 0.03, -0.05})
    models.push_back(displaced(
        mesh, [=](Vec3d p) { return 0.5 + high * std::cos(40 * p.x) + 0.2 * std::sin(9 * p.x) * std::cos(8 * p.z); }));
  for (const Case& with : cases()) {
    Driver driven = driver(with);
    testing::WanderingHand wandering;
    Vec3d before = wandering.next();
    ServoSample last = driven.at(*models[0], before);
    int felt = 0, jumps = 0;
    for (int k = 1; k < 6000; ++k) {
      const bool edit = k % 40 == 0;
      const Vec3d hand = wandering.next(), move = hand - std::exchange(before, hand);
      const ServoSample now = driven.at(*models[std::size_t(k / 40) % 3], hand);
      const double change = length(now.force - last.force);
      // In the tick of an edit the law's own change is led over, and only the hand's way is felt at once.
      if (edit && now.flags == 0 && last.flags == 0) {
        ASSERT_LE(change, kMost + kStiffness * kMetres * length(move)) << with.held.name << " " << k;
        jumps += change > 0.044 ? 1 : 0;
      }
      felt += length(now.force) > 0 ? 1 : 0;
      last = now;
    }
    EXPECT_GT(felt, 800) << with.held.name;
    EXPECT_GT(jumps, 10) << with.held.name;
  }
}

}  // namespace
}  // namespace relief
