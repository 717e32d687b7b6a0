// S1: the simulated device against closed forms, before it judges anything.
#include "acceptance/acceptance.h"
#include "support/plants.h"

#include <algorithm>
#include <cmath>

namespace relief::acceptance {
namespace {

using testing::at_origin;
using testing::bare;
using testing::kNobody;

/// Largest error of speed and place over a second of free decay, m/s and m.
double free_decay_error() {
  const double mass = 0.045, viscous = 0.1;
  SimulatedHand hand(bare(mass, viscous), kNobody, at_origin);
  hand.set_state({}, {0.2, -0.1, 0.05});
  double worst = 0;
  for (int k = 1; k <= 1000; ++k) {
    static_cast<void>(hand.write({}));
    const double left = std::exp(-viscous / mass * 1e-3 * k);
    worst = std::max(worst, std::abs(hand.handle_velocity().x - 0.2 * left));
    worst = std::max(worst, std::abs(hand.handle_position().y + 0.1 * mass / viscous * (1 - left)));
  }
  return worst;
}

/// Work that is unaccounted for, W, with every loss at work and no wall.
double energy_error(double resonance, Report& report) {
  PlantPreset preset = {.name = "all", .plant = {}, .info = {}};
  preset.plant.resonance = resonance;
  SimulatedHand hand(preset, {.stiffness = 300, .damping = 3, .tremor = 2e-3}, [](double t) {
    return HandTarget{{0.03 * std::sin(7 * t), 0.02 * std::cos(5 * t), 0.01 * t}, 0};
  });
  const double start = hand.energy();
  const int ticks = report.long_form() ? 60'000 : 3'000;
  for (int k = 0; k < ticks; ++k) static_cast<void>(hand.write({}));
  const WorkDone& work = hand.work();
  report.at_least("work of the hand meanwhile", work.hand, 1e-3, "J");
  report.at_most("loss to friction, of that work",
                 (work.viscous + work.coulomb + work.structure) / std::max(work.hand, 1e-9), -0.1);
  const double open = work.motor + work.hand + work.viscous + work.coulomb + work.structure - (hand.energy() - start);
  return std::abs(open) / (ticks * 1e-3);
}

/// Energy that a sampled spring of stiffness k leaves in the plant after 4 s, less what it began with; the lossless
/// limit is where this changes sign.
double gained(double k, int delay) {
  PlantPreset preset = bare(1, 1);
  preset.plant.delay_ticks = delay;
  SimulatedHand hand(preset, kNobody, at_origin);
  hand.set_state({0.01, 0, 0}, {});
  DeviceState state;
  // The largest total energy over the first and over the last second: phases do not matter.
  double first = 0, last = 0;
  for (int tick = 0; tick < 4000; ++tick) {
    static_cast<void>(hand.read(state));
    const double energy = hand.energy() + 0.5 * k * dot(state.position, state.position);
    if (tick < 1000) first = std::max(first, energy);
    if (tick >= 3000) last = std::max(last, energy);
    static_cast<void>(hand.write({.force = state.position * -k, .torque = {}}));
  }
  return last - first;
}

double lossless_limit(double low, double high, int delay) {
  for (int step = 0; step < 24; ++step) (gained((low + high) / 2, delay) > 0 ? high : low) = (low + high) / 2;
  return (low + high) / 2;
}

}  // namespace

void plant(Report& report) {
  report.at_most("free decay against the closed form", free_decay_error(), 1e-9, "m/s, m");
  report.at_most("energy unaccounted for", energy_error(0, report), 1e-9, "J/s");
  report.at_most("the same with a structural mode of 80 Hz", energy_error(80, report), 1e-9, "J/s");
  // 2b/T for b = 1 N*s/m and T = 1 ms; one tick of delay divides it by three.
  report.at_most("lossless limit of a sampled spring off 2b/T", std::abs(lossless_limit(1000, 3000, 0) / 2000 - 1),
                 0.005);
  report.at_most("the same with a tick of delay off 2b/3T", std::abs(lossless_limit(300, 1500, 1) / (2000.0 / 3) - 1),
                 0.005);
}

}  // namespace relief::acceptance
