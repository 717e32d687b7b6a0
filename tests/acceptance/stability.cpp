// S2: how stiff each plant can be made over four shapes before it shakes by itself. S3: energy at the handle.
#include "acceptance/acceptance.h"
#include "support/held_tools.h"
#include "support/shells.h"

#include <relief/devices/simulated_hand.h>
#include <relief/haptics/servo.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

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
  stiff.info.delay_ticks = preset.plant.delay_ticks;
  SimulatedHand hand(stiff, {.stiffness = kHold, .damping = press.hand_damping, .max_force = press.push, .tremor = 0},
                     [&](double) { return HandTarget{target, 0}; });
  hand.set_state(at + Vec3d{0, 1e-3, 0}, {0, -press.entry, 0});
  Servo servo({.workspace = shape.space, .force = {.stiffness = stiffness}}, stiff.info);
  double late = 0;
  for (int k = 0; k < 3000; ++k) {
    DeviceState state;
    static_cast<void>(hand.read(state));
    const ServoSample felt = servo.step(*shape.model, state);
    static_cast<void>(hand.write({felt.force, felt.torque}));
    if (k >= 2400) late = std::max(late, length(hand.handle_velocity()));
  }
  return late < 1e-3;
}

/// The largest stiffness, in steps, up to which every press settles.
double stiffest(const Shape& shape, const PlantPreset& preset, double hand_damping, bool in_long_form) {
  const double step = in_long_form ? 1.08 : 2;
  double best = 0;
  for (double k = 200; k < 1e4; k *= step) {
    for (const double push : {0.5, 2.0})
      for (const double entry : {0.02, 0.1, 0.3})
        if (!settles(shape, preset, {push, entry, hand_damping}, k)) return best;
    best = k;
  }
  return best;
}

/// What many contacts did, at the handle.
struct Contacts {
  int count = 0;
  double net = 0, worst = 0;          ///< J, work of the motor on the handle: of all, and of the worst contact
  std::array<int, 6> histogram = {};  ///< of what one contact made: none, to 1e-7, 1e-6, 1e-5, 1e-4 J, more
};

/// Random taps, presses and slides of a hand over a rough sheet; with a pump it also draws energy out of them.
Contacts tap(const PlantPreset& preset, const testing::HeldTool& held, bool guard, int count, std::uint32_t seed,
             double pump = 0) {
  const SnapshotPtr model = testing::displaced(testing::plane_shell(4, 32), [](Vec3d p) {
    return 0.5 + 0.05 * std::sin(20 * p.x) * std::cos(17 * p.z) + 0.01 * std::sin(90 * p.x + 40 * p.z);
  });
  const Workspace space = {.metres_per_unit = 0.05};
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  Vec3d target = space.to_device({0.5, 0.1 + held.radius, 0.5});
  SimulatedHand hand(preset, {.stiffness = 300, .damping = 1, .max_force = 2, .tremor = 1e-4, .pump = pump},
                     [&](double) { return HandTarget{target, 0}; });
  Servo servo({.workspace = space, .force = {.guard = guard}, .tool = held.tool()}, preset.info);
  Contacts all;
  double before = 0;
  int open = 0;  // ticks since the force was last felt
  bool counting = false, down = false;
  for (int k = 0; all.count < count; ++k) {
    if (k % 60 == 0) {  // somewhere else, above or below the surface
      down = !down;
      const double x = 0.3 + 0.4 * unit(random), height = down ? -0.15 * unit(random) : 0.1;
      target = space.to_device({x, height + held.radius, 0.3 + 0.4 * unit(random)});
    }
    DeviceState state;
    static_cast<void>(hand.read(state));
    const ServoSample felt = servo.step(*model, state);
    if (felt.contact && !counting) {
      counting = true;
      before = hand.work().motor;
    }
    static_cast<void>(hand.write({felt.force, felt.torque}));
    open = felt.contact ? 0 : open + 1;
    if (counting && open == 10) {  // the last command is through delay and amplifier
      const double made = hand.work().motor - before;
      counting = false;
      ++all.count;
      all.net += made;
      all.worst = std::max(all.worst, made);
      const int bin = made <= 0 ? 0 : std::clamp(static_cast<int>(std::ceil(std::log10(made))) + 8, 1, 5);
      ++all.histogram[static_cast<std::size_t>(bin)];
    }
  }
  return all;
}

std::string said(const Contacts& all) {
  std::string words = "contacts by what they made: none " + std::to_string(all.histogram[0]);
  const std::array<const char*, 5> names = {"1e-7", "1e-6", "1e-5", "1e-4", "more"};
  for (std::size_t k = 0; k < names.size(); ++k)
    words += std::string(k + 1 < names.size() ? ", to " : ", ") + names[k] + " " + std::to_string(all.histogram[k + 1]);
  return words;
}

}  // namespace

void limit_cycles(Report& report) {
  const ForceSettings usual;
  const double asked = 2 * usual.stiffness;
  for (const PlantPreset& listed : plant_presets())
    report.at_most(std::string(listed.name) + ", default stiffness", usual.stiffness, listed.info.max_stiffness, "N/m");
  for (const Shape& shape : shapes())
    for (const PlantPreset& listed : plant_presets())
      for (const int delay : {0, 1, 2}) {
        if (delay != 1 && !report.long_form()) continue;
        PlantPreset preset = listed;
        preset.plant.delay_ticks = delay;
        for (const double damping : {0.0, 2.0}) {
          std::string what = std::string(shape.name) + ", " + std::string(listed.name) + ", delay " +
                             std::to_string(delay) + ", hand " + (damping > 0 ? "2" : "0") + " N*s/m: stiffest";
          const double most = stiffest(shape, preset, damping, report.long_form());
          if (delay == 1)
            report.at_least(std::move(what), most, asked, "N/m");
          else
            report.shown(std::move(what), most, "N/m");
        }
      }
}

void human_port(Report& report) {
  constexpr double kPump = 1;  // N
  // Ball and rigid tool: 2.5 mm at the hand.
  for (const testing::HeldTool& held : testing::held_tools(0.05))
    for (const PlantPreset& listed : plant_presets())
      for (const int delay : {0, 1}) {
        PlantPreset preset = listed;
        preset.plant.delay_ticks = preset.info.delay_ticks = delay;
        const int count = report.long_form() ? 10'000 : 2'500 / held.dear;
        const std::string what = std::string(listed.name) + ", delay " + std::to_string(delay) + held.name;
        const Contacts with = tap(preset, held, true, count, 1), without = tap(preset, held, false, count, 1);
        report.shown(what + ", guarded: " + said(with), with.count);
        report.at_most(what + ", guarded: net work on the hand", with.net, 0, "J");
        report.shown(what + ", guarded: most that one contact made", with.worst, "J");
        report.shown(what + ", bare: " + said(without), without.count);
        if (delay == 0)
          report.at_most(what + ", bare: most that one contact made", without.worst, 1e-4, "J");
        else  // what the guard is for
          report.shown(what + ", bare: most that one contact made", without.worst, "J");
        // A hand that speeds up both ways for as long as it is pushed.
        const Contacts pumped = tap(preset, held, true, count, 2, kPump),
                       pumped_bare = tap(preset, held, false, count, 2, kPump);
        report.at_most(what + ", guarded, against a pump: net work on the hand", pumped.net, 0, "J");
        report.shown(what + ", guarded, against a pump: most that one contact made", pumped.worst, "J");
        report.shown(what + ", bare, against a pump: net work on the hand", pumped_bare.net, "J");
        report.shown(what + ", bare, against a pump: most that one contact made", pumped_bare.worst, "J");
      }
}

}  // namespace relief::acceptance
