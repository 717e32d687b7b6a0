// What is taken off a texture that goes by too fast.
#include "support/driver.h"

#include <relief/haptics/texture_fade.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relief {
namespace {

constexpr double kPitch = 0.02, kHeight = 1e-4, kSlope = 5e-4;  // of the sheet's edge

double wave(double x) { return kHeight * std::sin(2 * std::numbers::pi * x / kPitch); }

SnapshotPtr waves_on_a_slope() {
  return testing::displaced(testing::plane_shell(8, 64),
                            [](Vec3d p) { return 0.5 + (wave(p.x) + kSlope * (p.x - 0.5)) / 0.2; });
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
    see(tick, fade.step(model, at->surface, at->surface.normal, 1e-9), x);
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
      share = at ? fade.step(*model, at->surface, at->surface.normal, 1e-9).share : -1;
    }
    return share;
  };
  EXPECT_EQ(go(kPitch / 1.3, 55), 1);
  EXPECT_EQ(go(1e-5, 60), 0);
}

}  // namespace
}  // namespace relief
