// One scripted motion over one model, and the forces that it gives: for comparing builds, bit by bit.
#pragma once

#include "support/driver.h"
#include "support/held_tools.h"

#include <cstddef>
#include <random>
#include <vector>

namespace relief::testing {

/// Round a rough sphere, in and out, with a trembling hand that turns the tool, damping and friction. `tool`: of
/// held_tools().
inline std::vector<ServoSample> forces_of_a_script(std::size_t tool, std::size_t ticks) {
  const HeldTool held = held_tools(0.05)[tool];
  const SnapshotPtr model = displaced(sphere_shell(2, 32), [](Vec3d p) {
    return 0.5 + 0.1 * p.x * p.y - 0.2 * p.z * p.z * p.x + 0.05 * (p.x * 8 - static_cast<int>(p.x * 8));
  });
  std::mt19937 random(11);
  // Not a distribution of the standard library: each has its own.
  const auto noise = [&] { return (double(random()) / 4294967296.0 - 0.5) * 2e-3; };
  ServoSettings settings = settings_with(400, 1, 0.4);
  settings.tool = held.tool();
  Driver hand(settings, DeviceInfo{});
  std::vector<ServoSample> samples;
  Vec3d way = {1, 0, 0.3};
  for (std::size_t k = 0; k < ticks; ++k) {
    // Plain arithmetic, so that every build has the same cursors: a spiral, and heights up and down.
    way = normalized(way + cross(way, Vec3d{0.3, 1, 0.2}) * 2e-3);
    const double beat = static_cast<double>(k % 1000) / 500 - 1;
    const double height = 1.01 + 0.07 * (beat < 0 ? -beat : beat) - 0.07 + noise();
    samples.push_back(hand.at(*model, way * (height + held.radius), Quatd{1, way.x, beat, way.z}));
  }
  return samples;
}

}  // namespace relief::testing
