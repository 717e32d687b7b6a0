// What is taken off a texture that goes by too fast.
#include "support/driver.h"

#include <relief/haptics/texture_fade.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace relief {
namespace {

constexpr double kPitch = 0.02, kHeight = 1e-4, kSlope = 5e-4;  // of the sheet's edge

double wave(double x) { return kHeight * std::sin(2 * std::numbers::pi * x / kPitch); }

SnapshotPtr waves_on_a_slope() {
  return testing::displaced(testing::plane_shell(8, 64),
                            [](Vec3d p) { return 0.5 + (wave(p.x) + kSlope * (p.x - 0.5)) / 0.2; });
}

/// A tick of a point.
TextureFade::Fade stepped(TextureFade& fade, const Snapshot& model, const SurfacePoint& at, Vec3d normal,
                          double unfelt = 1e-9) {
  return fade.step(model, {at, normal, at.position}, unfelt);
}

/// 600 ticks to and fro along x; calls see(tick, fade, x) in each.
template <typename See>
void run(const Snapshot& model, double step, See&& see) {
  TextureFade fade;
  LocateHint hint;
  double x = 0.05;
  for (int tick = 0; tick < 600; ++tick, x += step) {
    if (x + step < 0.05 || x + step > 0.95) step = -step;
    const auto at = probe(model, {x, 0, 0.37}, hint);
    ASSERT_TRUE(at);
    see(tick, stepped(fade, model, at->surface, at->surface.normal), x);
  }
}

TEST(TextureFade, NothingIsTakenOffWhatCanBeFelt) {
  const SnapshotPtr model = waves_on_a_slope();
  for (const double ticks_per_wave : {2.4, 2.5, 3.0, 4.0, 10.0, 50.0})
    run(*model, kPitch / ticks_per_wave,
        [&](int, const TextureFade::Fade& fade, double) { ASSERT_EQ(fade.share, 0) << ticks_per_wave; });
}

TEST(TextureFade, WhatGoesByTooFastIsTakenOff) {
  const SnapshotPtr model = waves_on_a_slope();
  for (const double ticks_per_wave : {1.1, 1.4, 1.7}) {
    double worst = 0;
    run(*model, kPitch / ticks_per_wave, [&](int tick, const TextureFade::Fade& fade, double x) {
      if (tick < 200) return;
      EXPECT_GT(fade.share, 0.5) << ticks_per_wave << " at " << tick;
      // Where the way turns, the line is off by what the slope makes of a few ticks.
      worst = std::max(worst, std::abs(fade.above.y - wave(x)));
    });
    EXPECT_LT(worst, 0.2 * kHeight + 6 * kSlope * kPitch / ticks_per_wave) << ticks_per_wave;
  }
}

TEST(TextureFade, ItEndsWhereTheTipSlowsDown) {
  const SnapshotPtr model = waves_on_a_slope();
  TextureFade fade;
  LocateHint hint;
  double x = 0.05;
  const auto go = [&](double step, int ticks) {
    double share = 0;
    for (int k = 0; k < ticks; ++k, x += step) {
      const auto at = probe(*model, {x, 0, 0.37}, hint);
      share = at ? stepped(fade, *model, at->surface, at->surface.normal).share : -1;
    }
    return share;
  };
  EXPECT_EQ(go(kPitch / 1.3, 55), 1);
  EXPECT_EQ(go(1e-5, 60), 0);
}

TEST(TextureFade, ItEndsAsSoonAsAfterAnyFasterHand) {
  const SnapshotPtr model = waves_on_a_slope();
  TextureFade fade;
  LocateHint hint;
  double share = 0;
  const auto at = [&](double x) {
    const auto place = probe(*model, {x, 0, 0.37}, hint);
    share = place ? stepped(fade, *model, place->surface, place->surface.normal).share : -1;
  };
  double x = 0.05, step = kPitch / 1.02;
  for (int k = 0; k < 400; ++k, x += step) {
    if (x + step < 0.05 || x + step > 0.95) step = -step;
    at(x);
  }
  EXPECT_EQ(share, 1);
  int ticks = 0;
  for (; share > 0 && ticks < 100; ++ticks) at(x += 1e-5);
  EXPECT_LE(ticks, 5) << "0.9 of 1 after 4 ticks of 32";
}

TEST(TextureFade, ATickInThreeThatRunsOverManyWavesIsNotMost) {
  constexpr double kWide = 0.05;
  const SnapshotPtr model = testing::displaced(testing::plane_shell(1, 128), [](Vec3d p) {
    return 0.5 + kHeight * std::sin(2 * std::numbers::pi * p.x / kWide) / 0.2;
  });
  for (const int every : {1, 3}) {
    TextureFade fade;
    LocateHint hint;
    double x = 0.05, way = kWide * 3.3, most = 0;
    for (int tick = 0; tick < 300; ++tick) {
      if (tick % every == 0) {
        if (x + way < 0.05 || x + way > 0.6) way = -way;
        x += way;
      }
      const auto at = probe(*model, {x, 0, 0.02}, hint);
      ASSERT_TRUE(at);
      most = std::max(most, stepped(fade, *model, at->surface, at->surface.normal).share);
    }
    EXPECT_EQ(most, every == 1 ? 1 : 0) << every;
  }
}

TEST(TextureFade, WhatItRanOverLatelyIsThatOfEightTicks) {
  const SnapshotPtr model = waves_on_a_slope();
  LocateHint hint;
  const auto at = probe(*model, {0.5, 0, 0.37}, hint);
  ASSERT_TRUE(at);
  const Vec3d before = {0, 1, 0}, after = normalized(Vec3d{0.01, 1, 0});
  TextureFade fade;
  Vec3d lately = stepped(fade, *model, at->surface, before).normal;
  EXPECT_EQ(lately, before);
  for (int k = 0; k < 8; ++k) lately = stepped(fade, *model, at->surface, after).normal;
  EXPECT_NEAR(lately.x / after.x, 1 - std::pow(7.0 / 8, 8), 1e-3);
}

/// Every other sample is higher, and the tip leaps from the middle of a cell to that of another, where the waves are
/// as high as their mean. Between them it looks twice in a cell, and at 32 places at most.
/// Behind a fold in the ground the line through the last 20 ticks is off by 1.1 slopes and ticks' ways after 15 of
/// them, and right again after 20.
TEST(TextureFade, ItsLineGoesThroughTheLastTwentyTicks) {
  constexpr double kFold = 4e-3, kStep = kPitch / 1.4;
  const SnapshotPtr model = testing::displaced(
      testing::plane_shell(8, 64), [](Vec3d p) { return 0.5 + (wave(p.x) + kFold * std::abs(p.x - 0.5)) / 0.2; });
  double before = 0, off = 0, passed = 0, behind = 0;
  int near = 0;
  run(*model, kStep, [&](int tick, const TextureFade::Fade& fade, double x) {
    const bool was_left = std::exchange(before, x) < 0.5;
    if (was_left != (x < 0.5)) passed = tick;
    if (tick < 200) return;
    ASSERT_GT(fade.share, 0.5) << tick;
    const double since = tick - passed, error = (fade.above.y - wave(x)) / kHeight;
    if (since == 14 || since == 15) off += error, ++near;
    if (since >= 20 && since <= 24) behind = std::max(behind, std::abs(error));
  });
  EXPECT_GT(near, 10);
  EXPECT_GT(std::abs(off / near), 0.3);
  EXPECT_LT(behind, 0.25);
}

TEST(TextureFade, OfATicksWayItLooksAtThirtyTwoPieces) {
  constexpr int kCells = 128;
  const SnapshotPtr model = testing::displaced(testing::plane_shell(1, kCells), [](Vec3d p) {
    return 0.5 + (std::lround(p.x * kCells) % 2 == 0 ? kHeight : -kHeight);
  });
  for (const int leap : {16, 32}) {
    TextureFade fade;
    LocateHint hint;
    double share = 0;
    for (int tick = 0, cell = 8, way = leap; tick < 60; ++tick, cell += way) {
      if (cell + way < 8 || cell + way > 120) way = -way;
      const auto at = probe(*model, {(cell + 0.5) / kCells, 0, 0.02}, hint);
      ASSERT_TRUE(at);
      share = stepped(fade, *model, at->surface, at->surface.normal).share;
    }
    EXPECT_EQ(share, leap == 16 ? 1 : 0) << leap;
  }
}

TEST(TextureFade, WhatIsTakenOffGrowsByAQuarterPerTurn) {
  // From what is just felt, 1e-10, to half of the waves' height it takes 59 turns, 1.4 of them in a tick on average.
  const SnapshotPtr model = waves_on_a_slope();
  int first = -1;
  double most = 0;
  TextureFade fade;
  LocateHint hint;
  for (int tick = 0; tick < 49; ++tick) {
    const double x = 0.05 + tick * kPitch / 1.1;
    const auto at = probe(*model, {x, 0, 0.37}, hint);
    ASSERT_TRUE(at);
    most = std::max(most, std::abs(stepped(fade, *model, at->surface, at->surface.normal, 1e-10).above.y));
    if (first < 0 && most > 0.5 * kHeight) first = tick;
  }
  EXPECT_GT(first, 38);
  EXPECT_LT(first, 48);
}

/// Amplitude in N, under a Hann window, of what waves of a pitch in m make of the force at a speed in m/s, 200 ms on.
double felt_of_waves(const Snapshot& model, double edge, std::span<const Vec3d> tool, double pitch, double speed) {
  ServoSettings settings = testing::settings_with(400, 0, 0, edge);
  settings.tool.points = tool;
  testing::Driver hand(settings, testing::strong_device());
  const double down = -20e-6 / edge, step = 1e-3 * speed / edge;
  static_cast<void>(hand.at(model, {0.1, 1e-3 / edge, 0.4}));
  for (int k = 0; k < 100; ++k) static_cast<void>(hand.at(model, {0.1, down, 0.4}));
  std::vector<double> force;
  for (int k = 0; k < 320; ++k) {
    const double felt = hand.at(model, {0.1 + k * step, down, 0.4 + 1e-4 * k}).force.y;
    if (k >= 200) force.push_back(felt);
  }
  const double count = double(force.size()), mean = std::reduce(force.begin(), force.end()) / count;
  double c = 0, s = 0;
  for (std::size_t k = 0; k < force.size(); ++k) {
    const double window = 1 - std::cos(2 * std::numbers::pi * (double(k) + 0.5) / count);
    const double phase = 2 * std::numbers::pi * double(k) * 1e-3 * speed / pitch;
    c += window * (force[k] - mean) * std::cos(phase);
    s += window * (force[k] - mean) * std::sin(phase);
  }
  return 2 * std::hypot(c, s) / count;
}

TEST(TextureFade, ARigidToolThatTouchesWithOnePointFeelsNothingOfWhatGoesByTooFast) {
  constexpr double kEdge = 0.08, kHigh = 0.4e-6;  // m
  const std::vector<Vec3d> tool = {{0, 0, 0}, {0.01, 0.01, 0}, {-0.01, 0.01, 0.01}};
  const auto mesh = testing::plane_shell(16, 128, 0.02);
  for (const double pitch : {0.25e-3, 0.3e-3, 0.38e-3}) {
    const SnapshotPtr model = testing::displaced(mesh, [&](Vec3d p) {
      return 0.5 + kHigh / kEdge / 0.04 * std::sin(2 * std::numbers::pi * p.x * kEdge / pitch);
    });
    const double slow = felt_of_waves(*model, kEdge, tool, pitch, 0.0131);
    EXPECT_NEAR(slow, 400 * kHigh, 0.1 * 400 * kHigh) << pitch;
    EXPECT_LT(felt_of_waves(*model, kEdge, tool, pitch, 0.2), 0.1 * slow) << pitch;
  }
}

/// Waves of one height in m along a sheet of 0.08 m.
SnapshotPtr waves_of(double pitch, double high) {
  constexpr double kEdge = 0.08;
  return testing::displaced(testing::plane_shell(16, 128, 0.02), [=](Vec3d p) {
    return 0.5 + high / kEdge / 0.04 * std::sin(2 * std::numbers::pi * p.x * kEdge / pitch);
  });
}

/// By how much the force of a tool strays from its mean in a slide of so many ticks per wave, root mean square; N. Its
/// origin is `up` above the surface where it touches a flat one; m.
double straying(const Snapshot& model, const TouchTool& tool, double up, double depth, double pitch,
                double ticks_per_wave) {
  constexpr double kEdge = 0.08;
  ServoSettings settings = testing::settings_with(400, 0, 0, kEdge);
  settings.tool = tool;
  testing::Driver hand(settings, testing::strong_device());
  const double step = pitch / ticks_per_wave / kEdge;
  for (int k = 0; k < 30; ++k) static_cast<void>(hand.at(model, {0.1, (up + 1e-3) / kEdge, 0.4}));
  for (int k = 0; k < 100; ++k) static_cast<void>(hand.at(model, {0.1, (up - depth) / kEdge, 0.4}));
  double sum = 0, squares = 0;
  for (int k = 0; k < 270; ++k) {
    const double felt = hand.at(model, {0.1 + k * step, (up - depth) / kEdge, 0.4 + 1e-4 * k}).force.y;
    if (k < 120) continue;
    sum += felt / 150;
    squares += felt * felt / 150;
  }
  return std::sqrt(std::max(0.0, squares - sum * sum));
}

TEST(TextureFade, ARigidToolThatTouchesWithManyPointsFeelsNoMoreWhereItIsFast) {
  constexpr double kFine = 0.25e-3, kHigh = 0.4e-6;  // m
  std::vector<Vec3d> brush;
  for (int k = 0; k < 25; ++k) brush.push_back({0.01186 * (k % 5), 0, 0.01934 * (k / 5)});
  const SnapshotPtr model = waves_of(kFine, kHigh);
  for (const double ticks_per_wave : {1.3, 1.6, 4.7, 20.3}) {
    const double felt = straying(*model, {.points = brush}, 0, 20e-6, kFine, ticks_per_wave);
    EXPECT_LT(felt, 0.05 * 400 * kHigh) << ticks_per_wave << ": its points rest on many waves";
  }
}

TEST(TextureFade, ABallFeelsLessOfWhatGoesByTooFast) {
  constexpr double kFine = 0.25e-3, kHigh = 20e-6, kRadius = 0.2e-3;  // m
  const SnapshotPtr model = waves_of(kFine, kHigh);
  const auto felt = [&](double ticks_per_wave) {
    return straying(*model, {.radius = kRadius / 0.08}, kRadius, 50e-6, kFine, ticks_per_wave);
  };
  const double slow = felt(20.3);
  EXPECT_GT(slow, 0.4 * 400 * kHigh);
  EXPECT_LT(felt(1.3), 0.5 * slow);
  EXPECT_LT(felt(1.6), 0.4 * slow);
}

/// A tool that touches now here, now there has not run over what lies between.
TEST(TextureFade, FromOnePointOfAToolToAnotherIsNoWay) {
  const SnapshotPtr model = waves_on_a_slope();
  TextureFade fade;
  LocateHint hint;
  for (int k = 0; k < 300; ++k) {
    const double x = 0.1 + k * kPitch / 50;
    const auto at = probe(*model, {x + (k % 2 == 0 ? 0 : 0.05), 0, 0.37}, hint);
    ASSERT_TRUE(at);
    const TextureFade::Felt felt = {at->surface, {0, 1, 0}, {x, 0, 0.37}, false};
    ASSERT_EQ(fade.step(*model, felt, 1e-9).share, 0) << k;
  }
}

TEST(TextureFade, WhatGoesByTooFastAndIsLowerThanATenthOfAMillinewtonIsLeft) {
  constexpr double kEdge = 0.08, kFine = 0.3e-3;  // m
  const auto mesh = testing::plane_shell(16, 128, 0.02);
  for (const double newtons : {0.7e-4, 1.6e-4}) {  // from top to bottom
    const double high = newtons / 400 / 2;
    const SnapshotPtr model = testing::displaced(mesh, [&](Vec3d p) {
      return 0.5 + high / kEdge / 0.04 * std::sin(2 * std::numbers::pi * p.x * kEdge / kFine);
    });
    const double felt = felt_of_waves(*model, kEdge, {}, kFine, 0.2);
    if (newtons > 1e-4)
      EXPECT_LT(felt, 0.1 * newtons);
    else
      EXPECT_GT(felt, 0.3 * newtons);
  }
}

TEST(TextureFade, ALightTouchIsFeltNoMoreThanTwiceAsDeep) {
  constexpr double kEdge = 0.08;  // m
  const SnapshotPtr model = testing::displaced(testing::plane_shell(16, 128, 0.02), [&](Vec3d p) {
    return 0.5 + 20e-6 / kEdge / 0.04 * std::sin(2 * std::numbers::pi * p.x * kEdge / 0.3e-3);
  });
  testing::Driver hand(testing::settings_with(400, 0, 0, kEdge), testing::strong_device());
  static_cast<void>(hand.at(*model, {0.1, 1e-3 / kEdge, 0.4}));
  int doubled = 0;
  for (int k = 0; k < 320; ++k) {
    const ServoSample felt = hand.at(*model, {0.1 + k * 2e-4 / kEdge, -22e-6 / kEdge, 0.4 + 1e-4 * k});
    if (!felt.contact) continue;
    const double depth = length(felt.contact_point - felt.cursor);
    EXPECT_LE(felt.depth, 2 * depth * (1 + 1e-9)) << k;
    doubled += felt.depth > 1.99 * depth ? 1 : 0;
  }
  EXPECT_GT(doubled, 10);
}

}  // namespace
}  // namespace relief
