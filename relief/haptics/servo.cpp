#include <relief/core/micro_triangles.h>
#include <relief/haptics/servo.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace relief {
namespace {

// Greatest coefficient of friction: the cone then opens to 76 degrees (BreakAwayAndSlidingHaveTheirOwnCoefficients).
constexpr double kRoughest = 4;
// m in a tick: more than a tool carves. What rises so far has come to lie around the hand
// (ARiseOfMoreThanThreeMillimetresIsASafeStateAndNoForce).
constexpr double kSurfaceJump = 3e-3;
// N; less is none, also of texture from top to bottom (WhatGoesByTooFastAndIsLowerThanATenthOfAMillinewtonIsLeft).
constexpr double kUnfelt = 1e-4;

/// v, shortened to length `limit` where it is longer.
Vec3d shortened(Vec3d v, double limit) noexcept {
  const double size = length(v);
  return size > limit ? v * (limit / size) : v;
}

/// Zero for what is not a number or negative.
double at_most(double value, double limit) noexcept { return value > 0 ? std::min(value, limit) : 0.0; }

}  // namespace

Servo::Servo(const ServoSettings& settings, const DeviceInfo& device)
    : settings_(settings),
      device_(device),
      readings_(device),
      touch_(make_touch(settings.tool)),
      paper_(make_paper_touch()),
      placement_(settings.workspace, settings.clutch) {
  readings_.set(settings.readings);
  limit_settings();
}

void Servo::set(const ServoSettings& settings) noexcept {
  const bool other_law =
      settings_.force.paper_contact != settings.force.paper_contact || settings_.tool.radius != settings.tool.radius;
  placement_.set(settings.workspace, settings.clutch);
  const std::span<const Vec3d> points = settings_.tool.points;  // for good
  settings_ = settings;
  settings_.tool.points = points;
  touch_->resize(settings.tool.radius);
  readings_.set(settings.readings);
  limit_settings();
  if (!other_law) return;
  friction_.let_go();
  first_ = true;
}

void Servo::workspace_changed(const Placement::Change& change) noexcept {
  const Workspace &was = change.was, &now = placement_.workspace();
  const Vec3d before = was.to_model(change.device), after = now.to_model(change.device);
  const Quatd turned = now.rotation == was.rotation ? Quatd{} : now.rotation * was.rotation.conjugate();
  const bool touched = last_depth_ > 0 || blend_.blending();
  const double leap = length(after - before) * std::max(was.metres_per_unit, now.metres_per_unit);  // m
  last_cursor_ = after;
  put_elsewhere_ = true;
  // What was felt goes on from where it was, and friction holds as it held.
  if (turned != Quatd{}) guard_.turn(turned);
  for (Wrench* felt : {&spring_, &rubbed_}) *felt = {turned.turn(felt->force), turned.turn(felt->torque)};
  lead_over(spring_.force, spring_.torque);
  friction_.move(was.turned_to_model(change.device), now.turned_to_model(change.device), turned);
  // A tool in free space that lands in the solid has not gone in through its surface.
  first_ = first_ || (leap > kSurfaceJump && !touched);
}

void Servo::lead_over(Vec3d force, Vec3d torque) noexcept {
  blend_.moved({shortened(force, limits_.max_force), torque});
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
              .delay_ticks = delay_of(device_)},
             wanted.guard);
  limits_.clamped = wanted.stiffness > allowed || wanted.damping > dampest;
  if (before > 0) shading_.stiffen(limits_.stiffness / before);
  if (last_depth_ > 0 && before > 0)
    gift_ += in_spring(limits_.stiffness * last_share_, last_depth_) - in_spring(before * last_share_, last_depth_) +
             last_stored_ * (limits_.stiffness / before - 1);
}

void Servo::follow_period() noexcept {
  if (readings_.late() == late_ && readings_.softer() == softer_) return;
  late_ = readings_.late();
  softer_ = readings_.softer();
  limit_settings();
}

bool Servo::clear(const Snapshot& model, const ToolPose& tool) noexcept {
  return (settings_.force.paper_contact ? paper_ : touch_)->clear(model, tool);
}

void Servo::start_contact_anew() noexcept {
  touch_->reset();
  paper_->reset();
  hand_.reset();
  fade_.reset();
  shading_.reset();
}

Touched Servo::touch(const Snapshot& model, const ToolPose& tool) noexcept {
  const ToolPose at = hand_.follow(tool, touch_->reach(), diagonal(model.slab_mesh().bounds()), put_elsewhere_);
  Touched felt = touch_->step(model, at, kSurfaceJump / workspace().metres_per_unit);
  looking_ = touch_->is_looking();
  felt.settling = felt.settling || put_elsewhere_;
  put_elsewhere_ = put_elsewhere_ && hand_.late();
  if (felt.settling) lead_over(spring_.force, spring_.torque);
  if (!felt.touching) {
    // Friction goes with what it held on to, and that no faster.
    if (felt.settling) lead_over(spring_.force + rubbed_.force, spring_.torque + rubbed_.torque);
    fade_.reset();
    shading_.rest();
    return felt;
  }
  const bool is_point = settings_.tool.radius == 0 && settings_.tool.points.empty();
  limit_band(model, at.origin, felt);
  felt.normal = is_point && !settings_.force.exact_normals ? shaded(felt) : felt.way_out;
  return felt;
}

void Servo::limit_band(const Snapshot& model, Vec3d origin, Touched& felt) noexcept {
  const Vec3d held = origin + felt.way_out * felt.depth;
  const bool is_point = settings_.tool.radius == 0 && felt.spread == 0;
  const TextureFade::Fade fade = fade_.step(model, {felt.surface, felt.normal, held, is_point}, depth_for(kUnfelt));
  if (!(fade.share > 0 && felt.depth > 0)) return;
  const double before = felt.depth, faded = dot(felt.way_out * before - fade.above, fade.normal);
  felt.depth = std::clamp(before + fade.share * (faded - before), 0.0, 2 * before);
  felt.push *= felt.depth / before;
  felt.normal = normalized(felt.normal + (fade.normal - felt.normal) * fade.share);
}

Vec3d Servo::shaded(const Touched& felt) noexcept {
  const double metres = workspace().metres_per_unit;
  const double force = std::min(limits_.stiffness * felt.push * metres, limits_.max_force);
  const double stored = in_spring(limits_.stiffness, felt.depth * metres);
  if (felt.settling) shading_.change(force, stored);
  return shading_.step(felt.normal, felt.way_out, force, stored, hand_.move() * metres, felt.turn);
}

Wrench Servo::spring(const Touched& felt, double stiffness, Vec3d hand_step, double dt) noexcept {
  const double metres = workspace().metres_per_unit;
  const Wrench law = {felt.normal * (stiffness * felt.push * metres), felt.twist * (stiffness * metres * metres)};
  if (!blend_.blending()) return law;
  const Vec3d by_hand = felt.normal * (-stiffness * dot(hand_step, felt.normal));
  return blend_.step({shortened(law.force, limits_.max_force), law.torque}, by_hand, dt);
}

Friction::Given Servo::friction(const Snapshot& model, const Touched& felt, Vec3d along, double stiffness,
                                double normal_force, const Placement::Place& at) noexcept {
  if (!(limits_.friction > 0) || !(stiffness > 0)) {
    friction_.let_go();
    return {};
  }
  const SurfacePoint& place = felt.surface;
  const auto coefficient = [&](Layer layer, double elsewhere) noexcept {
    return at_most(layer_at(model, layer, place.slab, place.u, place.v, elsewhere), kRoughest);
  };
  const double kinetic = coefficient(Layer::DynamicFriction, limits_.friction);
  const double still = std::max(kinetic, coefficient(Layer::StaticFriction, limits_.static_friction));
  const double metres = workspace().metres_per_unit;
  return friction_.step({kinetic, still, stiffness, normal_force}, at.hand, along, felt.arm * metres,
                        felt.spread * metres, at.clutched ? Vec3d{} : at.turn);
}

double Servo::depth_for(double force) const noexcept {
  const double force_per_unit = limits_.stiffness * workspace().metres_per_unit;
  return force_per_unit > 0 ? force / force_per_unit : 1e300;
}

// The spring's force ends at the greatest one.
double Servo::in_spring(double stiffness, double depth) const noexcept {
  const double longest = stiffness > 0 ? limits_.max_force / stiffness : 0;
  const double bent = std::min(depth, longest);
  return stiffness * bent * (depth - 0.5 * bent);
}

double Servo::in_spring_of(double stiffness, double force) const noexcept {
  return stiffness > 0 ? in_spring(stiffness, force / stiffness) : 0;
}

ServoSample Servo::step(const Snapshot& model, const DeviceState& reading) noexcept {
  const Readings::Judged now = readings_.judge(reading, placement_.next_workspace());
  follow_period();
  if (now.news || now.faults != 0)
    last_ = answer(model, reading, now);
  else
    hold(model, now, reading);
  if (last_.at.slab != kNoSlab) foothold_.stand_in(model.slab_mesh(), last_.at.slab);
  return last_;
}

ServoSample Servo::answer(const Snapshot& model, const DeviceState& reading, const Readings::Judged& now) noexcept {
  looking_ = false;
  const double gift = std::exchange(gift_, 0.0);
  const Placement::Place at = follow_hand(reading, now);
  ServoSample sample = sample_of(reading, now, at);
  if (!now.has_position) {
    sample.cursor = sample.contact_point = last_cursor_;
    last_depth_ = 0;
    give_nothing();
    return sample;
  }
  const ToolPose tool = {at.cursor, at.orientation};
  const bool was_safe = in_safe_state();
  const Touched felt = feel(model, tool);
  tell(felt, sample);
  keep_safe(model, tool, felt, now, sample);
  last_cursor_ = at.cursor;
  last_depth_ = felt.depth * workspace().metres_per_unit;
  last_share_ = 1;
  last_stored_ = 0;
  if (was_safe) blend_.rest();
  if (in_safe_state())
    give_nothing();
  else if (was_safe || !felt.touching)
    fade_out(model, sample, now.dt, gift);
  else
    push(model, felt, at, now.dt, gift, sample);
  sample.leak = guard_.leak();
  if (!is_finite(sample.force) || !is_finite(sample.torque)) {  // the model's own numbers are broken here
    latched_ = true;
    sample.flags |= bit(ServoFault::Latched);
    sample.force = sample.torque = {};
    give_nothing();
  }
  return sample;
}

Placement::Place Servo::follow_hand(const DeviceState& reading, const Readings::Judged& now) noexcept {
  const Placement::Place at = placement_.place(now, reading.position);
  if (at.change) workspace_changed(*at.change);
  if (at.clutched) friction_.move({}, at.step, {});
  if (now.faults == 0)
    guard_.observe({at.hand, at.velocity, now.dt, at.turn, at.change || at.clutched});
  else
    latched_ = true;
  return at;
}

void Servo::push(const Snapshot& model, const Touched& felt, const Placement::Place& at, double dt, double gift,
                 ServoSample& sample) noexcept {
  const SurfacePoint& surface = felt.surface;
  last_share_ = at_most(layer_at(model, Layer::Stiffness, surface.slab, surface.u, surface.v, 1), 1);
  const double stiffness = limits_.stiffness * last_share_;
  const bool blended = blend_.blending();
  spring_ = spring(felt, stiffness, at.clutched ? Vec3d{} : at.step, dt);
  const double pushes = length(spring_.force);
  const Vec3d along = blended && pushes > kUnfelt ? spring_.force / pushes : felt.normal;
  // The surface does not pull.
  const double normal_force = std::max(0.0, pushes - damper(felt, along, blended, at));
  const Friction::Given sideways = friction(model, felt, along, stiffness, normal_force, at);
  last_stored_ = sideways.stored;
  rubbed_ = {sideways.force, cross(felt.arm * workspace().metres_per_unit, sideways.force) + sideways.torque};
  // The guard is told what the springs hold, and how much of that the hand did not put in.
  const double in = blended ? in_spring_of(stiffness, pushes) : in_spring(stiffness, last_depth_);
  const double given_in = blended ? in - in_spring_of(stiffness, length(blend_.from())) : 0;
  if (limits_.clamped) sample.flags |= bit(ServoFault::StiffnessClamped);
  if (limits_.lowered) sample.flags |= bit(ServoFault::LateTicks);
  const Wrench given = guard_.wrench({.force = along * normal_force + rubbed_.force,
                                      .torque = spring_.torque + rubbed_.torque,
                                      .normal = along,
                                      .stored = in + sideways.stored,
                                      .gift = gift + given_in,
                                      .moved = blended && (felt.settling || !blend_.blending())},
                                     sample.flags);
  sample.force = given.force;
  sample.torque = given.torque;
}

// It acts along the surface's normal. What is left of a blend may be so little that it points anywhere.
double Servo::damper(const Touched& felt, Vec3d along, bool blended, const Placement::Place& at) const noexcept {
  const double outwards =
      blended ? dot(at.velocity, felt.normal) * std::max(0.0, dot(along, felt.normal)) : dot(at.velocity, along);
  return limits_.damping * (1 - at.loose) * outwards;
}

ServoSample Servo::sample_of(const DeviceState& reading, const Readings::Judged& now,
                             const Placement::Place& at) const noexcept {
  ServoSample sample;
  sample.t = reading.t;
  sample.device = reading.position;
  sample.buttons = now.buttons;
  sample.flags = now.faults | now.warnings;
  if (!now.has_position) sample.flags |= bit(ServoFault::Latched);
  sample.velocity = at.velocity;
  sample.orientation = at.orientation;
  sample.cursor = sample.contact_point = at.cursor;
  return sample;
}

void Servo::tell(const Touched& felt, ServoSample& sample) noexcept {
  if (!felt.touching) return;
  sample.contact = true;
  sample.at = felt.at;
  sample.depth = felt.depth;
  sample.normal = felt.normal;
  sample.contact_point = felt.contact_point;
}

bool Servo::in_safe_state() const noexcept { return first_ || latched_ || start_inside_; }

bool Servo::feels_as_paper() const noexcept { return in_safe_state() || settings_.force.paper_contact; }

Touched Servo::feel(const Snapshot& model, const ToolPose& tool) noexcept {
  if (!feels_as_paper()) return touch(model, tool);
  return paper_->step(model, tool, kSurfaceJump / workspace().metres_per_unit);
}

void Servo::keep_safe(const Snapshot& model, const ToolPose& tool, const Touched& felt, const Readings::Judged& now,
                      ServoSample& sample) noexcept {
  // Contact goes on in another cage, but what touches nothing may be in the material there.
  const std::uint64_t roots = model.slab_mesh().roots_number();
  const bool other_roots = std::exchange(roots_, roots) != roots, was_safe = in_safe_state();
  const bool buried =
      other_roots && !was_safe && !felt.touching && (feels_as_paper() ? paper_ : touch_)->is_buried(model, tool);
  const bool jumped = !was_safe && (felt.jumped || (buried && last_depth_ > 0));
  first_ = first_ || (buried && !jumped);
  latched_ = latched_ || jumped;
  if (jumped) sample.flags |= bit(ServoFault::SurfaceJumped);
  if (in_safe_state()) {
    const bool in = !clear(model, tool);
    if (first_) start_inside_ = in;
    if (now.faults == 0 && !jumped && !in) latched_ = start_inside_ = false;
    // From here on the way of the cursor is followed.
    start_contact_anew();
    blend_.rest();
    static_cast<void>(touch(model, tool));
  }
  first_ = false;
  if (latched_) sample.flags |= bit(ServoFault::Latched);
  if (start_inside_) sample.flags |= bit(ServoFault::StartInside);
}

std::optional<SurfacePlace> Servo::last_place(MicroTriangles& surface) const noexcept {
  if (last_.at.slab == kNoSlab) return std::nullopt;
  if (foothold_.is_in(surface.mesh())) return surface.place_at(last_.at.slab, last_.at.u, last_.at.v);
  return foothold_.find(surface, last_.at, last_.contact_point);
}

void Servo::hold(const Snapshot& model, const Readings::Judged& now, const DeviceState& reading) noexcept {
  if (last_.at.slab != kNoSlab && !foothold_.is_in(model.slab_mesh())) {
    MicroTriangles surface(model);
    const auto place = last_place(surface);
    last_.at = place ? surface.coordinates(*place) : SlabCoord{};
    last_.contact = place.has_value();
    if (place) foothold_.stand_in(model.slab_mesh(), last_.at.slab);
  }
  last_.t = reading.t;
  last_.device = reading.position;
  last_.buttons = now.buttons;
  last_.flags = now.warnings | (last_.flags & (bit(ServoFault::Latched) | bit(ServoFault::StartInside)));
  // The settings may have changed meanwhile.
  const Vec3d held = shortened(last_.force, limits_.max_force);
  if (held != last_.force) last_.torque *= length(held) / length(last_.force);
  last_.force = held;
  guard_.hold({last_.force, last_.torque});
}

void Servo::give_nothing() noexcept {
  spring_ = rubbed_ = {};
  blend_.rest();
  friction_.let_go();
  guard_.restart();
}

void Servo::fade_out(const Snapshot& model, ServoSample& sample, double dt, double gift) noexcept {
  friction_.let_go();
  rubbed_ = {};
  spring_ = blend_.blending() ? blend_.step({}, {}, dt) : Wrench{};
  // It is felt on the surface that is left.
  MicroTriangles surface(model);
  const auto place = spring_.force == Vec3d{} ? std::nullopt : last_place(surface);
  if (!place) {
    spring_ = {};
    blend_.rest();
    guard_.rest();
    return;
  }
  const double force = length(spring_.force), stiffness = limits_.stiffness;
  sample.contact = true;
  sample.at = surface.coordinates(*place);
  sample.normal = spring_.force / force;
  sample.depth = stiffness > 0 ? depth_for(force) : 0;
  sample.contact_point = place->position;
  const Wrench given = guard_.wrench({.force = spring_.force,
                                      .torque = spring_.torque,
                                      .normal = sample.normal,
                                      .stored = in_spring_of(stiffness, force),
                                      .gift = gift,
                                      .moved = true},
                                     sample.flags);
  sample.force = given.force;
  sample.torque = given.torque;
}

}  // namespace relief
