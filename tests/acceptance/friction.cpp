// S9: friction, as a sled and a slider would measure it.
#include "acceptance/acceptance.h"
#include "support/driver.h"
#include "support/held_tools.h"

#include <relief/devices/simulated_hand.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace relief::acceptance {
namespace {

using testing::Driver;
using testing::HeldTool;

constexpr double kStatic = 0.6, kKinetic = 0.4, kStiffness = 1000;
constexpr double kNormal = 1;   // N
constexpr double kTick = 1e-3;  // s
constexpr double kPi = 3.14159265358979323846;

/// A plane of 1 m with layers in which static and dynamic friction differ.
SnapshotPtr rough_plane() {
  SnapshotDraft draft(testing::flat_plane());
  draft.add_layer(Layer::StaticFriction, 2, static_cast<float>(kStatic));
  draft.add_layer(Layer::DynamicFriction, 2, static_cast<float>(kKinetic));
  return draft.finish();
}

/// On a model without layers, the settings have both coefficients.
ServoSettings rubbing(const Snapshot& model, const HeldTool& held) {
  const bool layers = model.has(Layer::StaticFriction);
  ServoSettings settings = testing::settings_with(kStiffness, 0, layers ? 0.1 : kKinetic, 1);
  if (!layers) settings.force.static_friction = kStatic;
  settings.tool = held.tool();
  return settings;
}

/// A tool at a place along x, pressed down with a constant force.
class Sled {
 public:
  Sled(const Snapshot& model, const HeldTool& held)
      : model_(model), radius_(held.radius), hand_(rubbing(model, held), testing::strong_device()) {
    // No point of a rigid tool need be at its lowest place: it goes as deep as the force takes.
    for (int k = 0; k < 100; ++k) {
      static_cast<void>(at(0));
      depth_ += (kNormal - normal()) / (2 * kStiffness);
    }
  }
  /// Force along x, N; `deeper`: share of the depth.
  double at(double x, double deeper = 0) {
    felt_ = hand_.at(model_, {kStart + x, radius_ - depth_ * (1 + deeper), 0.5});
    return felt_.force.x;
  }
  [[nodiscard]] double normal() const { return felt_.force.y; }

 private:
  static constexpr double kStart = 0.2;
  const Snapshot& model_;
  double radius_;
  double depth_ = -1e-3;  ///< m
  Driver hand_;
  ServoSample felt_;
};

struct Coefficients {
  double still = 0, kinetic = 0;
};
/// From rest to a constant speed: the peak, and the mean over the second half.
Coefficients measured(const Snapshot& model, const HeldTool& held, double speed) {
  Sled sled(model, held);
  Coefficients found;
  // Three times what the friction gives way by before it breaks.
  const double way = std::clamp(1000 * speed * kTick, 3e-3, 0.4);
  const int ticks = static_cast<int>(way / (speed * kTick));
  double sum = 0;
  int count = 0;
  for (int k = 1; k <= ticks; ++k) {
    const double ratio = -sled.at(k * speed * kTick) / sled.normal();
    found.still = std::max(found.still, ratio);
    if (k <= ticks / 2) continue;
    sum += ratio;
    ++count;
  }
  found.kinetic = sum / count;
  return found;
}

/// A mass on the plane, damped so much that it rests on the friction before the next slip, pulled along x by a spring
/// whose other end moves, or by a force.
struct Slider {
  double mass = 1, damping = 2;  // kg, N*s/m
  double x = 0, v = 0;
  /// One tick with the friction held, as a device holds it.
  template <typename Pull>
  void move(double friction, Pull&& pull, double t) {
    constexpr int kSub = 20;
    const double h = kTick / kSub;
    for (int k = 0; k < kSub; ++k) {
      v += h * (friction + pull(t + k * h, x) - damping * v) / mass;
      x += h * v;
    }
  }
};

/// The period of stick and slip of a slider pulled at a speed by a spring, in closed form: damped swinging about the
/// place where the spring is as strong as kinetic friction, then loading of the spring and of the friction's own.
double ideal_period(const Slider& s, double spring, double speed) {
  const double gap = (kStatic - kKinetic) * kNormal;
  // z: stretch of the spring beyond that place, which damping shifts by damping * speed / spring.
  const double rate = s.damping / (2 * s.mass), w = std::sqrt(spring / s.mass - rate * rate);
  const double shift = s.damping * speed / spring;
  // The slider lets go at rest, with all of the gap in the spring: z' = speed there.
  const double z0 = gap / spring - shift, z1 = speed;
  const auto z = [&](double t) {
    return std::exp(-rate * t) * (z0 * std::cos(w * t) + (z1 + rate * z0) / w * std::sin(w * t));
  };
  const auto dz = [&](double t) {
    return std::exp(-rate * t) *
           (z1 * std::cos(w * t) - (z0 * (w * w + rate * rate) + z1 * rate) / w * std::sin(w * t));
  };
  // At rest again where z' = speed, past half a swing.
  double low = kPi / w, high = 2 * kPi / w;
  for (int k = 0; k < 60; ++k) (dz((low + high) / 2) < speed ? low : high) = (low + high) / 2;
  const double end = z(low) + shift;
  return low + (gap / spring - end) / speed * (1 + spring / kStiffness);
}

/// The same, measured over several periods, as a share of the ideal one.
double measured_period(const Snapshot& model, const HeldTool& held, double spring, double speed, int periods) {
  Slider slider;
  Sled sled(model, held);
  const double ideal = ideal_period(slider, spring, speed);
  double first = 0, last = 0;
  int slips = -2;  // not the first ones
  bool stuck = true;
  for (int k = 0; slips < periods && k < 200'000; ++k) {
    const double t = k * kTick;
    slider.move(sled.at(slider.x), [&](double now, double x) { return spring * (speed * now - x); }, t);
    const bool slipping = slider.v > 0.01;  // m/s; it swings on the friction's spring with less
    if (slipping && stuck) {
      ++slips;
      if (slips == 0) first = t;
      last = t;
    }
    if (slipping) stuck = false;
    if (slider.v < 0) stuck = true;
  }
  return slips > 0 ? (last - first) / slips / ideal : std::nan("");
}

/// How far a slider goes in a minute, m, that is held at nine tenths of what it can hold, with a tremor of the pressure
/// and of the pull.
double creep(const Snapshot& model, const HeldTool& held, int minutes) {
  Sled sled(model, held);
  Slider slider;
  slider.damping = 20;
  double settled = 0;
  for (int k = 0; k < 2'000 + minutes * 60'000; ++k) {
    const double t = k * kTick, shake = std::sin(2 * kPi * 9 * t);
    const double friction_force = sled.at(slider.x, 0.02 * shake);
    slider.move(
        friction_force,
        [&](double now, double) {
          return 0.9 * kStatic * kNormal * std::min(1.0, now) + 0.01 * kNormal * std::sin(2 * kPi * 11 * now);
        },
        t);
    if (k == 2'000) settled = slider.x;
  }
  // The same phase of both tremors: whole seconds apart.
  return std::abs(slider.x - settled) / minutes;
}

void rub(Report& report, const Snapshot& model, const HeldTool& held) {
  double still = 0, kinetic = 0;
  for (const double speed : {0.001, 0.005, 0.02, 0.05, 0.1, 0.2}) {
    const Coefficients found = measured(model, held, speed);
    kinetic = std::max(kinetic, std::abs(found.kinetic / kKinetic - 1));
    // In a tick the pull grows by stiffness * speed * tick; break-away lies somewhere in it.
    const double tick = kStiffness * speed * kTick / kNormal / kStatic;
    if (tick < 0.02)
      still = std::max(still, std::abs(found.still / kStatic - 1));
    else
      report.shown("static friction recovered at " + std::to_string(int(speed * 1000)) + " mm/s, off by" + held.name,
                   std::abs(found.still / kStatic - 1));
  }
  report.at_most("kinetic friction recovered at 1 to 200 mm/s, off by" + held.name, kinetic, 0.02);
  report.at_most("static friction recovered at 1 and 5 mm/s, off by" + held.name, still, 0.02);

  for (const auto& [spring, speed] : {std::pair{50.0, 0.001}, {50.0, 0.002}, {100.0, 0.001}}) {
    const double share = measured_period(model, held, spring, speed, report.long_form() ? 50 : 5);
    report.at_most("stick-slip period at " + std::to_string(int(spring)) + " N/m and " +
                       std::to_string(int(speed * 1000)) + " mm/s, off by" + held.name,
                   std::abs(share - 1), 0.05);
  }
  report.at_most("creep at 0.9 of static friction" + held.name, creep(model, held, report.long_form() ? 10 : 1) * 1e6,
                 1, "um/min");
}

/// A device held by a hand stops: friction holds it, and its force does not change sign any more.
void rest(Report& report, const SnapshotPtr& plane, const HeldTool& held) {
  const PlantPreset& preset = plant_presets().front();
  const double metres_per_unit = 0.1, radius = held.radius * metres_per_unit;
  const Workspace space = {.metres_per_unit = metres_per_unit, .device_origin = {}, .model_origin = {0.5, 0, 0.5}};
  SimulatedHand hand(preset, {.stiffness = 300, .damping = 3, .tremor = 0}, [radius](double t) {
    return HandTarget{{0.02 * std::min(t, 1.0), radius + 0.004 - 0.008 * std::min(t, 1.0), 0}, 0};
  });
  hand.set_state({0, radius + 0.004, 0}, {});
  Servo servo({.workspace = space, .force = {.stiffness = 400, .friction = 0.4}, .tool = held.tool()}, hand.info());
  int crossings = 0, resting = 0;
  double last = 0;
  const int ticks = report.long_form() ? 60'000 : 6'000;
  for (int k = 0; k < ticks; ++k) {
    DeviceState state;
    static_cast<void>(hand.read(state));
    const ServoSample felt = servo.step(*plane, state);
    static_cast<void>(hand.write({felt.force, felt.torque}));
    if (k < 2'000) continue;
    if (felt.force.x * last < 0) ++crossings;
    if (felt.force.x != 0) last = felt.force.x;
    resting += felt.contact && length(hand.handle_velocity()) < 1e-3 ? 1 : 0;
  }
  report.at_least("ticks at rest under a hand, of all" + held.name, double(resting) / (ticks - 2'000), 0.999);
  report.at_most("zero crossings of the friction force there" + held.name, crossings, 0);
}

}  // namespace

void friction(Report& report) {
  const SnapshotPtr model = rough_plane();
  for (const HeldTool& held : testing::held_tools(0.04)) {
    rub(report, *model, held);
    if (held.is_point()) {
      HeldTool plain = held;
      plain.name = ", by the settings alone";
      rub(report, *testing::flat_plane(), plain);
    }
    rest(report, model, held);
  }
}

}  // namespace relief::acceptance
