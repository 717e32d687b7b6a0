#include <relief/devices/simulated_hand.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace relief {
namespace {

constexpr double kTick = 1e-3;       // s
constexpr double kTremor = 10;       // Hz
constexpr double kPumpSpeed = 0.01;  // m/s of the handle, from which on the pump pushes with all that it has
constexpr double kPushed = 1e-3;     // N, from which on the motor pushes

/// v, shortened to length `limit` where it is longer.
Vec3d shortened(Vec3d v, double limit) noexcept {
  const double size = length(v);
  return size > limit ? v * (limit / size) : v;
}

/// v, shorter by `by`; zero where nothing is left.
Vec3d shrunk(Vec3d v, double by) noexcept {
  const double size = length(v);
  return size > by ? v * (1 - by / size) : Vec3d{};
}

Vec3d rounded(Vec3d v, double step) noexcept {
  if (!(step > 0)) return v;
  return {std::round(v.x / step) * step, std::round(v.y / step) * step, std::round(v.z / step) * step};
}

}  // namespace

const std::vector<PlantPreset>& plant_presets() {
  // Plausible figures, not identified on any device: hence "-like" in every name. The limits on stiffness and damping
  // follow the vendors' sheets and CHAI3D's published tuning. A point mass has three axes and no weight.
  static const std::vector<PlantPreset> presets = {
      {.name = "touch-like",
       .plant = {},
       .info = {.name = "sim:hand:touch-like", .gravity = GravityCompensation::Device}},
      {.name = "premium-like",
       .plant = {.mass = 0.075, .viscous = 0.05, .coulomb = 0.04, .encoder_step = 30e-6, .max_force = 8.5},
       .info = {.name = "sim:hand:premium-like",
                .max_force = 8.5,
                .max_stiffness = 1000,
                .max_damping = 5,
                .max_force_rate = 5000,
                .continuous_force = 1.4,
                .workspace_radius = 0.12,
                .gravity = GravityCompensation::Device}},
      {.name = "falcon-like",
       .plant = {.mass = 0.1, .viscous = 0.5, .coulomb = 0.3, .encoder_step = 63e-6, .max_force = 8},
       .info = {.name = "sim:hand:falcon-like",
                .max_force = 8,
                .max_stiffness = 3000,
                .max_damping = 20,
                .max_force_rate = 5000,
                .continuous_force = 3,
                .workspace_radius = 0.04,
                .gravity = GravityCompensation::Device}},
      {.name = "inverse3-like",
       .plant = {.mass = 0.1, .viscous = 0.3, .coulomb = 0.1, .encoder_step = 50e-6, .max_force = 10},
       .info = {.name = "sim:hand:inverse3-like",
                .max_force = 10,
                .max_stiffness = 1000,
                .max_damping = 6,
                .max_force_rate = 5000,
                .continuous_force = 3,
                .workspace_radius = 0.15,
                .gravity = GravityCompensation::Device}},
  };
  return presets;
}

SimulatedHand::SimulatedHand(const PlantPreset& preset, const Hand& hand, HandScript script)
    : info_(preset.info), plant_(preset.plant), hand_(hand), script_(std::move(script)) {
  plant_.substeps = std::max(plant_.substeps, 20);
  plant_.delay_ticks = std::clamp(plant_.delay_ticks, 0, 3);
  for (std::uint8_t& extra : plant_.jitter) extra = std::min<std::uint8_t>(extra, 3);
  step_ = kTick / plant_.substeps;
  if (plant_.lag > 0) lag_share_ = -std::expm1(-step_ / plant_.lag);
  if (plant_.resonance > 0) {
    // Two bodies of half the mass: the mode's reduced mass is a quarter of the whole.
    const double turn = 2 * std::numbers::pi * plant_.resonance;
    spring_ = plant_.mass / 4 * turn * turn;
    damper_ = 2 * plant_.resonance_damping * turn * plant_.mass / 4;
  }
  target_ = target_at(0, buttons_);
  set_state(target_, {});
}

void SimulatedHand::set_state(Vec3d position, Vec3d velocity) noexcept {
  handle_ = motor_ = {.at = position, .velocity = velocity};
}

double SimulatedHand::energy() const noexcept {
  if (!(spring_ > 0)) return 0.5 * plant_.mass * dot(handle_.velocity, handle_.velocity);
  const Vec3d bent = handle_.at - motor_.at;
  const double twice_kinetic = dot(handle_.velocity, handle_.velocity) + dot(motor_.velocity, motor_.velocity);
  return 0.25 * plant_.mass * twice_kinetic + 0.5 * spring_ * dot(bent, bent);
}

Vec3d SimulatedHand::target_at(double t, std::uint32_t& buttons) const noexcept {
  const HandTarget wanted = script_ ? script_(t) : HandTarget{};
  buttons = wanted.buttons;
  if (!(hand_.tremor > 0)) return wanted.position;
  const double phase = 2 * std::numbers::pi * kTremor * t;
  return wanted.position + Vec3d{std::sin(phase), std::sin(phase + 2), std::sin(phase + 4)} * hand_.tremor;
}

Status SimulatedHand::open() {
  if (!switches_->open.exchange(true)) switches_->forces = false;
  return {};
}

DeviceStatus SimulatedHand::status() const {
  const bool open = switches_->open, forces = open && switches_->forces;
  return {.connected = open && !switches_->silent,
          .powered = open,
          .forces_on = forces,
          .to_do = {},
          .force_off = forces ? ""
                       : open ? "they are switched off"
                              : "the device is closed",
          .trouble = switches_->silent ? "the simulated device is silent, as its plant says" : ""};
}

Status SimulatedHand::enable(bool forces) {
  if (!switches_->open) return fail(Errc::DeviceUnavailable, printable(info_.name) + " is closed: open it first");
  switches_->forces = forces;
  return {};
}

void SimulatedHand::close() noexcept { switches_->open = switches_->forces = false; }

bool SimulatedHand::read(DeviceState& state) noexcept {
  if (!switches_->open) return false;
  const bool is_silent = silent();
  switches_->silent = is_silent;
  if (is_silent) {
    idle();  // its time goes on
    return false;
  }
  state.t = static_cast<double>(tick_) * kTick;
  state.position = rounded(motor_.at, plant_.encoder_step);
  state.velocity = {};
  state.has_velocity = false;
  state.buttons = buttons_;
  return true;
}

bool SimulatedHand::write(const Wrench& wrench) noexcept {
  if (!switches_->open || switches_->silent) return false;
  silent_ = 0;
  commanded_ = switches_->forces ? wrench.force : Vec3d{};
  advance(commanded_);
  return true;
}

bool SimulatedHand::silent() const noexcept {
  const double t = static_cast<double>(tick_) * kTick;
  return t >= plant_.silent_at && t < plant_.silent_at + plant_.silent_for;
}

void SimulatedHand::idle() noexcept {
  ++silent_;
  const bool bites = plant_.watchdog > 0 && silent_ * kTick > plant_.watchdog;
  advance(bites ? Vec3d{} : commanded_);
}

void SimulatedHand::advance(Vec3d force) noexcept {
  const std::size_t extra = plant_.jitter.empty() ? 0 : plant_.jitter[tick_ % plant_.jitter.size()];
  pipeline_[tick_ % pipeline_.size()] = {.force = is_finite(force) ? force : Vec3d{},
                                         .arrives = tick_ + static_cast<std::uint64_t>(plant_.delay_ticks) + extra};
  // The newest command that has arrived counts; one that was overtaken is forgotten.
  for (std::uint64_t given = tick_; given >= held_tick_ && tick_ - given < pipeline_.size(); --given) {
    const Command& command = pipeline_[given % pipeline_.size()];
    if (command.arrives <= tick_) {
      held_ = command.force;
      held_tick_ = given;
      break;
    }
    if (given == 0) break;
  }

  const Vec3d command = rounded(shortened(held_, plant_.max_force), plant_.dac_step);
  std::uint32_t next_buttons = 0;
  const Vec3d next_target = target_at(static_cast<double>(tick_ + 1) * kTick, next_buttons);
  for (int k = 0; k < plant_.substeps; ++k) {
    amplify(command);
    move(target_ + (next_target - target_) * ((k + 0.5) / plant_.substeps));
  }
  target_ = next_target;
  buttons_ = next_buttons;
  ++tick_;
}

void SimulatedHand::amplify(Vec3d command) noexcept {
  slewed_ = plant_.slew > 0 ? slewed_ + shortened(command - slewed_, plant_.slew * step_) : command;
  amplifier_ += (slewed_ - amplifier_) * lag_share_;
}

Vec3d SimulatedHand::pumping() const noexcept {
  const double push = length(amplifier_);
  if (!(hand_.pump > 0) || !(push > kPushed)) return {};
  const Vec3d along = amplifier_ / push;
  return along * (hand_.pump * std::clamp(dot(handle_.velocity, along) / kPumpSpeed, -1.0, 1.0));
}

// One sub-step by the implicit midpoint rule, which keeps the energy's books exactly: each force's work is the force at
// the midpoint times the way.
void SimulatedHand::move(Vec3d target) noexcept {
  const double h = step_, half = h / 2;
  const bool two = spring_ > 0;
  // Twice a body's mass over h: its momentum's change is inertia * (midpoint velocity - velocity before).
  const double inertia = (two ? 0.5 : 1.0) * plant_.mass / half;
  // A hand that pulls as hard as it will is a constant force for this sub-step.
  const bool strained = length(target - handle_.at) * hand_.stiffness > hand_.max_force;
  const Vec3d hand_pull = shortened((target - handle_.at) * hand_.stiffness, hand_.max_force) + pumping();
  const double give = strained ? 0.0 : hand_.stiffness * half;
  const double grip = hand_.damping + give;       // what the hand adds per midpoint velocity
  const double joint = damper_ + spring_ * half;  // likewise the structure

  // Handle: (inertia + grip + joint) v2 = pull2 + joint v1. Motor: (inertia + viscous + joint) v1 = pull1 + joint v2 -
  // friction.
  Vec3d push = motor_.velocity * inertia + amplifier_;
  double resistance = inertia + plant_.viscous;
  Vec3d handle_push;
  double handle_resistance = 1;
  if (two) {
    const Vec3d bend = (handle_.at - motor_.at) * spring_;
    handle_push = handle_.velocity * inertia + hand_pull - bend;
    handle_resistance = inertia + grip + joint;
    push += bend + handle_push * (joint / handle_resistance);
    resistance += joint - joint * joint / handle_resistance;
  } else {
    push += hand_pull;
    resistance += grip;
  }

  const Vec3d slid = shrunk(push, plant_.coulomb);
  const bool stuck = slid == Vec3d{};
  const Vec3d middle = slid / resistance;  // the motor's velocity at the midpoint
  const Vec3d way = middle * h;
  work_.motor += dot(amplifier_, way);
  work_.viscous -= plant_.viscous * dot(middle, way);
  // Static friction takes whatever motion the motor still had.
  work_.coulomb += stuck ? -0.25 * inertia * h * dot(motor_.velocity, motor_.velocity) : dot(slid - push, way);

  Vec3d handle_middle = middle;
  if (two) {
    handle_middle = (handle_push + middle * joint) / handle_resistance;
    const Vec3d sway = handle_middle - middle;
    work_.structure -= damper_ * dot(sway, sway) * h;
  }
  const Vec3d hand_force = hand_pull - handle_middle * grip;
  work_.hand += dot(hand_force, handle_middle) * h;

  motor_.velocity = stuck ? Vec3d{} : middle * 2 - motor_.velocity;
  motor_.at += way;
  if (two) {
    handle_.velocity = handle_middle * 2 - handle_.velocity;
    handle_.at += handle_middle * h;
  } else {
    handle_ = motor_;
  }
}

}  // namespace relief
