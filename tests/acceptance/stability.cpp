// S2: how stiff each plant can be made over four shapes before it shakes by itself.
#include "acceptance/acceptance.h"
#include "support/shells.h"

#include <relief/devices/simulated_hand.h>
#include <relief/haptics/servo.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace relief::acceptance {
namespace {

/// What is pressed on, from above, and where.
struct Shape {
  const char* name;
  SnapshotPtr model;
  Workspace space;
  Vec3d top;  ///< model units: the place that is pressed
};

std::vector<Shape> shapes() {
  const auto sheet = [](int cells, int n, auto&& height) {
    return testing::displaced(testing::plane_shell(cells, n), [&](Vec3d p) { return 0.5 + 5 * height(p.x); });
  };
  const Workspace wide = {.metres_per_unit = 0.05}, small = {.metres_per_unit = 0.01};
  return {
      {"wall", sheet(4, 8, [](double) { return 0.0; }), wide, {0.52, 0, 0.51}},
      {"sphere",
       testing::displaced(testing::sphere_shell(3, 32), [](Vec3d) { return 0.5; }),
       {.metres_per_unit = 0.025},
       {0, 1, 0}},
      {"sharp edge", sheet(4, 32, [](double x) { return 0.06 - 0.3 * std::abs(x - 0.5); }), wide, {0.5, 0.06, 0.51}},
      // 0.2 mm wide, 0.8 mm deep.
      {"slot",
       sheet(4, 64, [](double x) { return std::abs(x - 0.5) < 0.01 ? -0.08 : 0.0; }),
       small,
       {0.5, -0.08, 0.51}}};
}

struct Press {
  double push = 0;   ///< N
  double entry = 0;  ///< m/s
  double hand_damping = 0;
};

/// Whether the handle comes to rest on the shape in 3 s.
bool settles(const Shape& shape, const PlantPreset& preset, const Press& press, double stiffness) {
  constexpr double kHold = 1000;  // N/m, so that it stays on the edge
  const Vec3d at = shape.space.to_device(shape.top);
  const Vec3d target = at - Vec3d{0, press.push / kHold, 0};
  PlantPreset stiff = preset;
  stiff.info.max_stiffness = 1e9;
  SimulatedHand hand(stiff, {.stiffness = kHold, .damping = press.hand_damping, .max_force = press.push, .tremor = 0},
                     [&](double) { return HandTarget{target, 0}; });
  hand.set_state(at + Vec3d{0, 1e-3, 0}, {0, -press.entry, 0});
  Servo servo({.workspace = shape.space, .force = {.stiffness = stiffness}}, stiff.info);
  double late = 0;
  for (int k = 0; k < 3000; ++k) {
    DeviceState state;
    static_cast<void>(hand.read(state));
    const ServoSample felt = servo.step(*shape.model, state);
    static_cast<void>(hand.write(felt.force));
    if (k >= 2400) late = std::max(late, length(hand.handle_velocity()));
  }
  return late < 1e-3;
}

/// The largest stiffness, in steps, up to which every press settles.
double stiffest(const Shape& shape, const PlantPreset& preset, double hand_damping, bool in_long_form) {
  const double step = in_long_form ? 1.08 : 1.3;
  const std::vector<double> pushes = {0.5, 2}, entries = {0.02, 0.1, 0.3};
  double best = 0;
  for (double k = 100; k < 2e4; k *= step) {
    for (const double push : pushes)
      for (const double entry : entries)
        if (!settles(shape, preset, {push, entry, hand_damping}, k)) return best;
    best = k;
  }
  return best;
}

}  // namespace

void limit_cycles(Report& report) {
  const ForceSettings usual;
  for (const Shape& shape : shapes())
    for (const PlantPreset& listed : plant_presets()) {
      report.at_most("default stiffness on " + std::string(listed.name), usual.stiffness, listed.info.max_stiffness,
                     "N/m");
      for (const int delay : {0, 1, 2})
        for (const double damping : {0.0, 2.0}) {
          PlantPreset preset = listed;
          preset.plant.delay_ticks = delay;
          const double most = stiffest(shape, preset, damping, report.long_form());
          const std::string what = std::string(shape.name) + ", " + std::string(listed.name) + ", delay " +
                                   std::to_string(delay) + ", hand " + std::to_string(int(damping)) + " N*s/m";
          if (delay == 1)
            report.at_least("stiffest without shaking: " + what, most, 2 * usual.stiffness, "N/m");
          else
            report.shown("stiffest without shaking: " + what, most, "N/m");
        }
    }
}

}  // namespace relief::acceptance
