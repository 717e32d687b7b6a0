#include <relief/haptics/servo.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relief {
namespace {

constexpr double kReach = 10;  // m from the workspace's origin; no device's arm is longer
// Radii of the stated workspace. That is where forces are good; arms reach two to three times as far, and simulated
// hands and our own recordings stay within 2.8 (the falcon-like one, with the smallest radius).
constexpr double kReachOfRadius = 4;
constexpr double kFarModel = 1e100;      // model units; squares of it are still finite
constexpr double kFarTime = 1e12;        // s; beyond it a millisecond is lost in the rounding
constexpr double kMaxGap = 0.05 - 1e-6;  // s; a reading's neighbours may be rounded
constexpr double kMaxSpeed = ForceGuard::kFastest;
constexpr double kFrozenSpeed = 0.05;     // m/s
constexpr double kFrozenTime = 20e-3;     // s
constexpr double kRoughest = 4;           // greatest coefficient of friction
constexpr double kSensorStep = 1e-4;      // m, what an encoder may jump by in no time at all
constexpr double kVelocityFilter = 3e-3;  // s, time constant
constexpr double kSurfaceJump = 3e-3;     // m
constexpr double kEaseTime = 15e-3;       // s, in which a surface that was changed under the tool is taken over
constexpr double kEaseForce = 0.045;      // N per tick, at most, while it is
constexpr double kInTime = 1.25e-3;       // s; a device's max_stiffness is good for ticks that come no later
constexpr double kSlowStep = 2e-4;        // s, by which one late tick may move the estimate
constexpr double kRare = 1e-3;            // share of ticks that may be later than it
constexpr double kSoften = 5e-3;          // of the device's stiffness, per tick, while the limit moves with the ticks
constexpr double kUnfelt = 1e-4;          // N; texture whose force is less from top to bottom is none
constexpr double kFacing = 0.5;           // cosine from the normal to the way out, above which the normal alone counts
constexpr double kLeastTurn = 1e-6;       // length of a quaternion that is taken for a rotation

bool denormal(Vec3d v) noexcept {
  return std::fpclassify(v.x) == FP_SUBNORMAL || std::fpclassify(v.y) == FP_SUBNORMAL ||
         std::fpclassify(v.z) == FP_SUBNORMAL;
}

bool near(Vec3d v, double limit) noexcept {
  return is_finite(v) && std::abs(v.x) <= limit && std::abs(v.y) <= limit && std::abs(v.z) <= limit;
}

/// The rotation from one orientation to another as a vector along its axis, rad; good for small ones.
Vec3d turn_between(Quatd from, Quatd to) noexcept {
  const Vec3d a = {from.x, from.y, from.z}, b = {to.x, to.y, to.z};
  const Vec3d half = from.w * b - to.w * a - cross(b, a);
  return half * (dot(from, to) < 0 ? -2.0 : 2.0);
}

/// Zero for what is not a number or negative.
double at_most(double value, double limit) noexcept { return value > 0 ? std::min(value, limit) : 0.0; }

}  // namespace

Workspace fit_workspace(const DeviceInfo& device, const Box3d& model) noexcept {
  const double size = diagonal(model);
  if (!(size > 0) || !std::isfinite(size)) return {};
  const double room = device.workspace_radius > 0 ? std::min(0.15, 2 * device.workspace_radius) : 0.15;
  return {.metres_per_unit = room / size, .device_origin = {}, .model_origin = model.centre()};
}

Servo::Servo(const ServoSettings& settings, const DeviceInfo& device)
    : settings_(settings), device_(device), touch_(make_touch(settings.tool)), paper_(make_paper_touch()) {
  limit_settings();
}

void Servo::set(const ServoSettings& settings) noexcept {
  const Workspace &was = settings_.workspace, &now = settings.workspace;
  const bool moved = was.metres_per_unit != now.metres_per_unit || was.device_origin != now.device_origin ||
                     was.model_origin != now.model_origin;
  const bool other_law =
      settings_.force.paper_contact != settings.force.paper_contact || settings_.tool.radius != settings.tool.radius;
  settings_ = settings;
  touch_->resize(settings.tool.radius);
  limit_settings();
  if (!moved && !other_law) return;
  let_go();
  first_ = true;
  if (moved) has_position_ = false;
}

void Servo::limit_settings() noexcept {
  const ForceSettings& wanted = settings_.force;
  const double before = limits_.stiffness;
  constexpr double kAny = 1e9;  // for a device that states no limit worth the name
  const double stiffest = at_most(device_.max_stiffness, kAny), dampest = at_most(device_.max_damping, kAny);
  const double allowed = stiffest / touch_->most_stiffening();
  limits_.stiffness = at_most(wanted.stiffness, wanted.guard ? allowed * softer_ : allowed);
  limits_.damping =
      at_most(at_most(wanted.damping, dampest) + (wanted.guard ? limits_.stiffness * late_ / 2 : 0), dampest);
  limits_.lowered = limits_.stiffness < at_most(wanted.stiffness, allowed);
  limits_.friction = at_most(wanted.friction, kRoughest);
  limits_.static_friction = std::max(limits_.friction, at_most(wanted.static_friction, kRoughest));
  limits_.max_force = at_most(wanted.max_force, at_most(device_.max_force, kAny));
  guard_.set({.max_force = limits_.max_force,
              .max_force_rate = at_most(device_.max_force_rate, kAny),
              .max_torque = at_most(device_.max_torque, kAny),
              .max_damping = dampest - limits_.damping,
              .continuous_force = at_most(device_.continuous_force, kAny),
              .max_work = at_most(device_.max_work, kAny),
              .max_speed = at_most(device_.max_speed, kAny),
              .delay_ticks = device_.delay_ticks},
             wanted.guard);
  limits_.clamped = wanted.stiffness > allowed || wanted.damping > dampest;
  if (before > 0) shading_.stiffen(limits_.stiffness / before);
  if (last_depth_ > 0 && before > 0)
    gift_ += in_spring(limits_.stiffness * last_share_, last_depth_) - in_spring(before * last_share_, last_depth_) +
             last_stored_ * (limits_.stiffness / before - 1);
}

void Servo::judge_period(double dt) noexcept {
  period_ += dt > period_ ? std::min(kSlowStep, dt - period_) * (1 - kRare) : -kSlowStep * kRare;
  period_ = std::max(period_, kInTime);
  // A single late tick is none. What a spring makes of many grows with stiffness times period: less of the one, and
  // damping for the rest.
  const double late = std::max(0.0, period_ - kInTime - kSlowStep), softer = kInTime / (kInTime + late);
  if (late == late_ && softer == softer_) return;
  late_ = late;
  softer_ += std::clamp(softer - softer_, -kSoften, kSoften);
  limit_settings();
}

void Servo::let_go() noexcept {
  has_anchor_ = false;
  sliding_ = false;
}

bool Servo::within_workspace(Vec3d position) const noexcept {
  return !(device_.workspace_radius > 0) || length(position) <= kReachOfRadius * device_.workspace_radius;
}

Servo::Admitted Servo::admit(const DeviceState& reading) noexcept {
  Admitted now;
  bool timed = false;  // the step from the last reading's time to this one's is good
  if (std::exchange(stalled_, false)) now.faults |= bit(ServoFault::Stalled);
  if (!(std::abs(reading.t) <= kFarTime) || std::fpclassify(reading.t) == FP_SUBNORMAL) {
    now.faults |= bit(ServoFault::BadTime);
    has_time_ = false;
  } else {
    if (has_time_) {
      const double dt = reading.t - last_t_;
      timed = dt > 0 && dt <= kMaxGap;
      if (timed) {
        now.dt = dt;
        judge_period(dt);
      } else {
        now.faults |= bit(ServoFault::BadTime);
      }
    }
    last_t_ = reading.t;
    has_time_ = true;
  }

  const Workspace& space = settings_.workspace;
  now.has_position = space.metres_per_unit > 0 && std::isfinite(space.metres_per_unit) && !denormal(reading.position) &&
                     near(reading.position - space.device_origin, kReach) && within_workspace(reading.position) &&
                     near(space.to_model(reading.position), kFarModel);
  if (!now.has_position) {
    now.faults |= bit(ServoFault::BadPosition);
    has_position_ = false;
    velocity_ = {};
    return now;
  }
  const Vec3d step = has_position_ ? reading.position - last_position_ : Vec3d{};
  now.travel = length(step);
  if (timed && now.travel > kMaxSpeed * now.dt + kSensorStep) now.faults |= bit(ServoFault::TooFast);
  if (reading.has_velocity) {
    if (!is_finite(reading.velocity))
      now.faults |= bit(ServoFault::BadPosition);
    else if (!near(reading.velocity, kMaxSpeed) || length(reading.velocity) > kMaxSpeed)
      now.faults |= bit(ServoFault::TooFast);
    // A sensor that says it moves and stays where it is.
    frozen_ = has_position_ && step == Vec3d{} && length(reading.velocity) > kFrozenSpeed ? frozen_ + now.dt : 0;
    if (frozen_ > kFrozenTime) now.faults |= bit(ServoFault::BadPosition);
  }
  if (reading.has_orientation) {
    const Quatd q = reading.orientation;
    const double size = std::sqrt(dot(q, q));
    if (size >= kLeastTurn && std::isfinite(size))
      orientation_ = {q.w / size, q.x / size, q.y / size, q.z / size};
    else
      now.faults |= bit(ServoFault::BadPosition);
  } else {
    orientation_ = {};
  }
  if (now.faults != 0)
    velocity_ = {};
  else if (reading.has_velocity)
    velocity_ = reading.velocity;
  else  // an implicit step of the filter: right for any dt, and never a division by it
    velocity_ = (velocity_ * kVelocityFilter + step) / (kVelocityFilter + now.dt);
  last_position_ = reading.position;
  has_position_ = true;
  return now;
}

void Servo::start_contact_anew() noexcept {
  touch_->reset();
  paper_->reset();
  hand_.reset();
  fade_.reset();
  shading_.reset();
}

Touched Servo::touch(const Snapshot& model, const ToolPose& tool, double dt) noexcept {
  const Blend::Ease ease = {.share = 1 - std::exp(-dt / kEaseTime), .most = depth_for(kEaseForce)};
  const double metres = settings_.workspace.metres_per_unit;
  const ToolPose at = hand_.follow(tool, touch_->reach(), diagonal(model.slab_mesh().bounds()));
  Touched now = touch_->step(model, at, ease, kSurfaceJump / metres, true);
  if (!now.touching) {
    fade_.reset();
    shading_.rest();
    return now;
  }
  const TextureFade::Fade fade = fade_.step(model, now.surface, now.normal, depth_for(kUnfelt));
  if (fade.share > 0) {
    const double off = fade.share * dot(fade.above, now.way_out), before = now.depth;
    now.depth = std::clamp(before - off, 0.0, 2 * before);
    now.push *= now.depth / before;
    now.normal = normalized(now.normal + (fade.normal - now.normal) * fade.share);
  }
  if (settings_.force.exact_normals || settings_.tool.radius > 0 || !settings_.tool.points.empty()) {
    now.normal = now.way_out;
    return now;
  }
  const double force = std::min(limits_.stiffness * now.push * metres, limits_.max_force);
  const auto [all, gift] = stored(limits_.stiffness, now);
  // Where the surface at the point does not face the way out (the tool is through a thin part, near its rim), the way
  // out holds.
  const double faces = dot(now.way_out, now.normal), exact = std::clamp((kFacing - faces) / kFacing, 0.0, 1.0);
  if (exact > 0) now.normal = normalized(now.normal * (1 - exact) + now.way_out * exact);
  now.normal = shading_.step(now.normal, now.way_out, force, all, gift, hand_.move() * metres, now.turn);
  return now;
}

// Coulomb friction as a spring to an anchor that gives way at the limit: implicit, so it neither drifts nor chatters. A
// rigid tool has a second one, against turning on the spot, over the radius that its points touch at.
Servo::Friction Servo::friction(const Snapshot& model, const Touched& touch, Vec3d position, Vec3d turn,
                                double stiffness, double normal_force) noexcept {
  if (!(limits_.friction > 0) || !(stiffness > 0)) {
    has_anchor_ = false;
    return {};
  }
  const SurfacePoint& at = touch.surface;
  const auto coefficient = [&](Layer layer, double elsewhere) noexcept {
    return at_most(layer_at(model, layer, at.slab, at.u, at.v, elsewhere), kRoughest);
  };
  const double kinetic = coefficient(Layer::DynamicFriction, limits_.friction);
  const double still = std::max(kinetic, coefficient(Layer::StaticFriction, limits_.static_friction));
  if (!has_anchor_) {
    anchor_ = position;
    spin_ = 0;
    has_anchor_ = true;
    sliding_ = false;
  } else {
    // It is where the tool touches that moves over the surface.
    anchor_ -= cross(turn, touch.arm * settings_.workspace.metres_per_unit);
    spin_ += dot(turn, touch.normal);
  }
  Friction now;
  const double radius = touch.spread * settings_.workspace.metres_per_unit;
  if (radius > 0) {
    const double most = kinetic * normal_force / (stiffness * radius);  // rad
    spin_ = std::clamp(spin_, -most, most);
    now.torque = touch.normal * (-stiffness * radius * radius * spin_);
    now.stored = 0.5 * stiffness * radius * radius * spin_ * spin_;
  }
  const Vec3d gap = position - anchor_;
  Vec3d stretch = gap - touch.normal * dot(gap, touch.normal);
  const double pull = stiffness * length(stretch);
  sliding_ = pull > (sliding_ ? kinetic : still) * normal_force;
  if (sliding_) {
    stretch *= kinetic * normal_force / pull;
    anchor_ = position - stretch;
  }
  now.force = stretch * -stiffness;
  now.stored += 0.5 * stiffness * dot(stretch, stretch);
  return now;
}

double Servo::depth_for(double force) const noexcept {
  const double force_per_unit = limits_.stiffness * settings_.workspace.metres_per_unit;
  return force_per_unit > 0 ? force / force_per_unit : 1e300;
}

// The spring's force ends at the greatest one.
double Servo::in_spring(double stiffness, double depth) const noexcept {
  const double longest = stiffness > 0 ? limits_.max_force / stiffness : 0;
  const double bent = std::min(depth, longest);
  return stiffness * bent * (depth - 0.5 * bent);
}

Servo::Stored Servo::stored(double stiffness, const Touched& felt) const noexcept {
  const double metres = settings_.workspace.metres_per_unit, all = in_spring(stiffness, felt.depth * metres);
  if (felt.grown == 0) return {all, 0};
  return {all, all - in_spring(stiffness, std::max(0.0, felt.depth - felt.grown) * metres)};
}

ServoSample Servo::step(const Snapshot& model, const DeviceState& reading) noexcept {
  ServoSample sample;
  sample.t = reading.t;
  sample.device = reading.position;
  sample.buttons = reading.buttons;

  const Admitted now = admit(reading);
  sample.flags = now.faults;
  sample.velocity = velocity_;
  sample.orientation = orientation_;
  if (now.faults != 0) latched_ = true;
  const double gift = std::exchange(gift_, 0.0);
  const Vec3d turn =
      now.faults == 0 ? turn_between(std::exchange(last_orientation_, orientation_), orientation_) : Vec3d{};
  if (now.faults == 0) guard_.observe({reading.position, velocity_, now.dt, turn});
  if (!now.has_position) {
    sample.cursor = sample.contact_point = last_cursor_;
    sample.flags |= bit(ServoFault::Latched);
    last_depth_ = 0;
    let_go();
    guard_.restart();
    return sample;
  }

  const Vec3d cursor = settings_.workspace.to_model(reading.position);
  const ToolPose tool = {cursor, orientation_};
  const bool held_back = first_ || latched_ || start_inside_;
  const bool as_paper = held_back || settings_.force.paper_contact;
  const double jump = kSurfaceJump / settings_.workspace.metres_per_unit;
  const Touched felt = as_paper ? paper_->step(model, tool, {}, jump, true) : touch(model, tool, now.dt);
  sample.cursor = sample.contact_point = cursor;
  if (felt.touching) {
    sample.contact = true;
    sample.at = felt.at;
    sample.depth = felt.depth;
    sample.normal = felt.normal;
    sample.contact_point = felt.contact_point;
  }

  // Edits keep the cage. In another one nothing that is known of the contact holds, whatever its surface; a tool that
  // touched nothing starts anew there.
  const bool other_cage = std::exchange(cage_, model.slab_mesh().number()) != model.slab_mesh().number();
  const bool jumped = !held_back && (felt.jumped || (other_cage && last_depth_ > 0));
  first_ = first_ || (other_cage && !jumped);
  // Safe state: no force until a good reading outside the solid.
  if (jumped) {
    sample.flags |= bit(ServoFault::SurfaceJumped);
    latched_ = true;
  }
  if (first_ || latched_ || start_inside_) {
    const bool in = !(settings_.force.paper_contact ? paper_ : touch_)->clear(model, tool);
    if (first_) start_inside_ = in;
    if (now.faults == 0 && !jumped && !in) latched_ = start_inside_ = false;
    // From here on the way of the cursor is followed.
    start_contact_anew();
    static_cast<void>(touch(model, tool, now.dt));
  }
  first_ = false;
  last_cursor_ = cursor;
  last_depth_ = felt.depth * settings_.workspace.metres_per_unit;
  last_share_ = 1;
  last_stored_ = 0;
  if (latched_) sample.flags |= bit(ServoFault::Latched);
  if (start_inside_) sample.flags |= bit(ServoFault::StartInside);
  if (!felt.touching || held_back || latched_ || start_inside_) {
    let_go();
    if (latched_ || start_inside_)
      guard_.restart();
    else
      guard_.rest();
    sample.leak = guard_.leak();
    return sample;
  }

  const SurfacePoint& surface = felt.surface;
  const double share = layer_at(model, Layer::Stiffness, surface.slab, surface.u, surface.v, 1);
  const double stiffness = limits_.stiffness * at_most(share, 1);
  const double metres = settings_.workspace.metres_per_unit;
  const double spring = stiffness * felt.push * metres;
  const double outwards = spring - limits_.damping * dot(velocity_, felt.normal);
  const double normal_force = std::max(0.0, outwards);
  const Friction sideways = friction(model, felt, reading.position, turn, stiffness, normal_force);
  if (limits_.clamped) sample.flags |= bit(ServoFault::StiffnessClamped);
  if (limits_.lowered) sample.flags |= bit(ServoFault::LateTicks);
  last_share_ = at_most(share, 1);
  last_stored_ = sideways.stored;
  const auto [all, grown] = stored(stiffness, felt);
  const Wrench given = guard_.wrench({.force = felt.normal * normal_force + sideways.force,
                                      .torque = felt.twist * (stiffness * metres * metres) +
                                                cross(felt.arm * metres, sideways.force) + sideways.torque,
                                      .normal = felt.normal,
                                      .stored = all + sideways.stored,
                                      .gift = gift + grown},
                                     sample.flags);
  sample.force = given.force;
  sample.torque = given.torque;
  sample.leak = guard_.leak();
  if (!is_finite(sample.force) || !is_finite(sample.torque)) {  // the model's own numbers are broken here
    latched_ = true;
    sample.flags |= bit(ServoFault::Latched);
    sample.force = sample.torque = {};
    let_go();
    guard_.restart();
    return sample;
  }
  return sample;
}

}  // namespace relief
