#include <relief/haptics/servo.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relief {
namespace {

constexpr double kRoughest = 4;        // greatest coefficient of friction
constexpr double kSurfaceJump = 3e-3;  // m
constexpr double kSteepest = 4;        // depth that one unit of travel may add: fibres lean by 75 degrees at most
constexpr double kEaseTime = 15e-3;    // s, in which a surface that was changed under the tool is taken over
constexpr double kEaseForce = 0.045;   // N per tick, at most, while it is
constexpr double kUnfelt = 1e-4;       // N; texture whose force is less from top to bottom is none
constexpr double kFacing = 0.5;        // cosine from the normal to the way out, above which the normal alone counts

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
      shell_(settings.tool.points),
      placement_(settings.workspace, settings.clutch) {
  readings_.set(settings.readings);
  limit_settings();
}

void Servo::set(const ServoSettings& settings) noexcept {
  const bool other_law =
      settings_.force.paper_contact != settings.force.paper_contact || settings_.tool.radius != settings.tool.radius;
  placement_.set(settings.workspace, settings.clutch);
  settings_ = settings;
  readings_.set(settings.readings);
  limit_settings();
  if (!other_law) return;
  let_go();
  first_ = true;
}

void Servo::workspace_changed(const Placement::Change& change) noexcept {
  const Workspace &was = change.was, &now = placement_.workspace();
  const Vec3d before = was.to_model(change.device), after = now.to_model(change.device);
  const Quatd turned = now.rotation == was.rotation ? Quatd{} : now.rotation * was.rotation.conjugate();
  const bool touched = last_depth_ > 0 || blend_.blending();
  const double leap = length(after - before) * std::max(was.metres_per_unit, now.metres_per_unit);  // m
  last_cursor_ = after;
  // What was felt goes on from where it was, and friction holds as it held.
  if (turned != Quatd{}) guard_.turn(turned);
  blend_.moved({shortened(asked_.force, limits_.max_force), asked_.torque}, turned);
  anchor_ = now.turned_to_model(change.device) - turned.turn(was.turned_to_model(change.device) - anchor_);
  shading_.moved();
  // A tool in the open that lands in the solid has not gone in through its surface.
  first_ = first_ || (leap > kSurfaceJump && !touched);
}

void Servo::limit_settings() noexcept {
  const ForceSettings& wanted = settings_.force;
  const double before = limits_.stiffness;
  constexpr double kAny = 1e9;  // for a device that states no limit worth the name
  const double stiffest = at_most(device_.max_stiffness, kAny), dampest = at_most(device_.max_damping, kAny);
  const double allowed = stiffest / shell_.most_stiffening();
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

void Servo::let_go() noexcept {
  has_anchor_ = false;
  sliding_ = false;
}

bool Servo::risen(double rise) const noexcept { return rise * workspace().metres_per_unit > kSurfaceJump; }

bool Servo::surface_jumped(const Snapshot& model, double depth, double travel) const noexcept {
  if (&model != last_model_) {
    LocateHint hint = hint_;
    const std::optional<Contact> before = probe(model, last_cursor_, hint);
    if (before && before->depth * workspace().metres_per_unit > last_depth_ + kSurfaceJump) return true;
  }
  // From above, depth cannot grow much faster than the hand moves; from below, it is large at once.
  return !was_in_slab_ && depth > kSteepest * travel + kSurfaceJump;
}

bool Servo::inside(const Snapshot& model, const ToolPose& tool) noexcept {
  if (shell_.size() > 0) return !shell_.clear(model, tool);
  LocateHint hint = hint_;
  if (relief::inside(model, tool.origin, hint)) return true;
  return settings_.tool.radius > 0 && !BallProxy::clear(model, tool.origin, settings_.tool.radius);
}

void Servo::start_contact_anew() noexcept {
  proxy_.reset();
  fade_.reset();
  shading_.reset();
  ball_.reset();
  shell_.reset();
}

Servo::Touch Servo::paper_touch(const Snapshot& model, Vec3d cursor, double travel) noexcept {
  Touch now;
  const std::optional<Contact> contact = probe(model, cursor, hint_);
  now.touching = contact && contact->touching() && std::isfinite(contact->depth);
  if (now.touching) {
    now.at = contact->at;
    now.surface = contact->surface;
    now.depth = now.push = contact->depth;
    now.normal = now.surface.normal;
    now.contact_point = settings_.force.paper_contact ? cursor + now.normal * now.depth : now.surface.position;
    now.jumped = surface_jumped(model, now.depth * workspace().metres_per_unit, travel);
  }
  was_in_slab_ = contact && !contact->hole;
  return now;
}

Servo::Touch Servo::touch(const Snapshot& model, const ToolPose& tool, const Readings::Judged& judged) noexcept {
  const Proxy::Ease ease = {.share = 1 - std::exp(-judged.dt / kEaseTime), .most = depth_for(kEaseForce)};
  if (shell_.size() > 0) return shell_touch(model, tool, ease);
  if (settings_.tool.radius > 0) return ball_touch(model, tool.origin, ease);
  return point_touch(model, tool.origin, ease);
}

Servo::Touch Servo::point_touch(const Snapshot& model, Vec3d cursor, Proxy::Ease ease) noexcept {
  Touch now;
  const bool held =
      proxy_.step(model, cursor, ease, settings_.force.exact_normals ? Proxy::Look::Around : Proxy::Look::Here);
  now.jumped = proxy_.lost() ? inside(model, {cursor, {}}) : risen(proxy_.rise());
  now.touching = held && proxy_.depth() > 0 && std::isfinite(proxy_.depth());
  if (!now.touching) {
    fade_.reset();
    shading_.rest();
    return now;
  }
  now.surface = proxy_.surface();
  now.depth = now.push = proxy_.depth();
  now.grown = proxy_.grown();
  now.contact_point = now.surface.position;
  now.at = {now.surface.slab, now.surface.u, now.surface.v, proxy_.alpha()};
  // Where the surface at the point does not face the way out (the tool is through a thin part, near its rim), the way
  // out holds.
  const double faces = dot(proxy_.way_out(), proxy_.normal());
  const double exact = settings_.force.exact_normals ? 1 : std::clamp((kFacing - faces) / kFacing, 0.0, 1.0);
  now.normal = exact > 0 ? normalized(proxy_.normal() * (1 - exact) + proxy_.way_out() * exact) : proxy_.normal();
  const TextureFade::Fade fade = fade_.step(model, now.surface, now.normal, depth_for(kUnfelt));
  if (fade.share > 0) {
    const double off = fade.share * dot(fade.above, proxy_.way_out());
    now.depth = now.push = std::clamp(now.depth - off, 0.0, 2 * now.depth);
    if (!settings_.force.exact_normals) now.normal = normalized(now.normal + (fade.normal - now.normal) * fade.share);
  }
  if (!settings_.force.exact_normals) {
    const double metres = workspace().metres_per_unit;
    const double force = std::min(limits_.stiffness * now.push * metres, limits_.max_force);
    const auto [all, gift] = stored(limits_.stiffness, now);
    now.normal =
        shading_.step(now.normal, proxy_.way_out(), force, all, gift, (cursor - last_cursor_) * metres, proxy_.turn());
  }
  return now;
}

Servo::Touch Servo::ball_touch(const Snapshot& model, Vec3d cursor, Proxy::Ease ease) noexcept {
  Touch now;
  double to_go = 0;  // through the air to what it will touch
  now.touching = ball_.step(model, cursor, settings_.tool.radius, ease);
  now.jumped = ball_.lost() || risen(ball_.rise());
  now.surface = ball_.surface();
  if (!now.touching && ball_.held()) {
    // Under a fast hand it has not come as near as to touch: held back by what is ahead, or late on a free way.
    const Vec3d far = ball_.way_out() * (ball_.depth() + settings_.tool.radius);
    const auto ahead = first_entry(model, ball_.centre(), ball_.centre() - far);
    now.touching = ahead.has_value();
    if (now.touching) {
      now.surface = ahead->point;
      to_go = std::clamp(length(ahead->point.position - ball_.centre()) - settings_.tool.radius, 0.0, ball_.depth());
    }
  }
  if (!now.touching) return now;
  now.depth = now.push = ball_.depth() - to_go;
  now.grown = ball_.grown();
  now.normal = ball_.way_out();
  now.contact_point = now.surface.position;
  now.at = {now.surface.slab, now.surface.u, now.surface.v, now.surface.alpha};
  return now;
}

Servo::Touch Servo::shell_touch(const Snapshot& model, const ToolPose& tool, Proxy::Ease ease) noexcept {
  Touch now;
  const bool held = shell_.step(model, tool, ease);
  now.jumped = shell_.lost() || risen(shell_.rise());
  now.push = length(shell_.push());
  // A point that is held right on the surface does not push, and tells of no place.
  now.touching = held && now.push > 0 && std::isfinite(now.push);
  if (now.touching && shell_.surface().slab >= model.slab_mesh().slab_count()) now.jumped = true;  // another cage
  now.touching = now.touching && !now.jumped;
  if (!now.touching) return now;
  now.surface = shell_.surface();
  now.depth = shell_.depth();
  now.grown = shell_.grown();
  now.normal = shell_.push() / now.push;
  now.twist = shell_.twist();
  now.arm = shell_.touched() - tool.origin;
  now.spread = shell_.spread();
  now.contact_point = now.surface.position;
  now.at = {now.surface.slab, now.surface.u, now.surface.v, now.surface.alpha};
  return now;
}

// Coulomb friction as a spring to an anchor that gives way at the limit: implicit, so it neither drifts nor chatters. A
// rigid tool has a second one, against turning on the spot, over the radius that its points touch at.
Servo::Friction Servo::friction(const Snapshot& model, const Touch& touch, Vec3d position, Vec3d turn, double stiffness,
                                double normal_force) noexcept {
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
    anchor_ -= cross(turn, touch.arm * workspace().metres_per_unit);
    spin_ += dot(turn, touch.normal);
  }
  Friction now;
  const double radius = touch.spread * workspace().metres_per_unit;
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
  const double force_per_unit = limits_.stiffness * workspace().metres_per_unit;
  return force_per_unit > 0 ? force / force_per_unit : 1e300;
}

// The spring's force ends at the greatest one.
double Servo::in_spring(double stiffness, double depth) const noexcept {
  const double longest = stiffness > 0 ? limits_.max_force / stiffness : 0;
  const double bent = std::min(depth, longest);
  return stiffness * bent * (depth - 0.5 * bent);
}

Servo::Stored Servo::stored(double stiffness, const Touch& felt) const noexcept {
  const double metres = workspace().metres_per_unit, all = in_spring(stiffness, felt.depth * metres);
  if (felt.grown == 0) return {all, 0};
  return {all, all - in_spring(stiffness, std::max(0.0, felt.depth - felt.grown) * metres)};
}

ServoSample Servo::step(const Snapshot& model, const DeviceState& reading) noexcept {
  const Readings::Judged now = readings_.judge(reading, placement_.next_workspace());
  follow_period();
  if (!now.news && now.faults == 0) {
    hold(now, reading);
    return last_;
  }
  return last_ = feel(model, reading, now);
}

void Servo::hold(const Readings::Judged& now, const DeviceState& reading) noexcept {
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
  asked_ = {};
  blend_.rest();
  guard_.restart();
}

void Servo::fade_out(ServoSample& sample, double dt, double gift) noexcept {
  asked_ = blend_.blending() ? blend_.step({}, {}, dt) : Wrench{};
  if (!blend_.blending()) {
    guard_.rest();
    return;
  }
  const Wrench& left = asked_;
  const double per_unit = limits_.stiffness * workspace().metres_per_unit;
  sample.contact = true;
  sample.at = last_.at;
  sample.normal = normalized(left.force);
  sample.depth = per_unit > 0 ? length(left.force) / per_unit : 0;
  sample.contact_point = sample.cursor + sample.normal * sample.depth;
  const Wrench given = guard_.wrench({left.force, left.torque, sample.normal, 0, gift}, sample.flags);
  sample.force = given.force;
  sample.torque = given.torque;
}

ServoSample Servo::feel(const Snapshot& model, const DeviceState& reading, const Readings::Judged& now) noexcept {
  ServoSample sample;
  sample.t = reading.t;
  sample.device = reading.position;
  sample.buttons = now.buttons;
  sample.flags = now.faults | now.warnings;
  const Placement::Place at = placement_.place(now, reading.position);
  if (at.change) workspace_changed(*at.change);
  if (at.clutched) anchor_ += at.step;
  sample.velocity = at.velocity;
  sample.orientation = at.orientation;
  if (now.faults != 0) latched_ = true;
  const double gift = std::exchange(gift_, 0.0);
  if (now.faults == 0)
    guard_.observe({at.hand, at.velocity, now.dt, at.turn, at.change || at.clutched || blend_.blending()});
  if (!now.has_position) {
    sample.cursor = sample.contact_point = last_cursor_;
    sample.flags |= bit(ServoFault::Latched);
    last_depth_ = 0;
    let_go();
    give_nothing();
    return sample;
  }

  const Vec3d cursor = at.cursor;
  const ToolPose tool = {cursor, at.orientation};
  const bool held_back = first_ || latched_ || start_inside_;
  const bool as_paper = held_back || settings_.force.paper_contact;
  if (as_paper) start_contact_anew();
  const Touch felt = as_paper ? paper_touch(model, cursor, length(now.step)) : touch(model, tool, now);
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
    const bool in = inside(model, tool);
    if (first_) start_inside_ = in;
    if (now.faults == 0 && !jumped && !in) latched_ = start_inside_ = false;
    // From here on the way of the cursor is followed.
    start_contact_anew();
    static_cast<void>(touch(model, tool, now));
  }
  first_ = false;
  last_cursor_ = cursor;
  last_depth_ = felt.depth * workspace().metres_per_unit;
  last_share_ = 1;
  last_stored_ = 0;
  last_model_ = &model;
  if (latched_) sample.flags |= bit(ServoFault::Latched);
  if (start_inside_) sample.flags |= bit(ServoFault::StartInside);
  if (!felt.touching || held_back || latched_ || start_inside_) {
    let_go();
    if (held_back) blend_.rest();
    if (latched_ || start_inside_)
      give_nothing();
    else
      fade_out(sample, now.dt, gift);
    sample.leak = guard_.leak();
    return sample;
  }

  const SurfacePoint& surface = felt.surface;
  const double share = layer_at(model, Layer::Stiffness, surface.slab, surface.u, surface.v, 1);
  const double stiffness = limits_.stiffness * at_most(share, 1);
  const double metres = workspace().metres_per_unit;
  const double spring = stiffness * felt.push * metres;
  const double outwards = spring - limits_.damping * (1 - at.loose) * dot(at.velocity, felt.normal);
  const double normal_force = std::max(0.0, outwards);
  const Friction sideways = friction(model, felt, at.hand, at.clutched ? Vec3d{} : at.turn, stiffness, normal_force);
  if (limits_.clamped) sample.flags |= bit(ServoFault::StiffnessClamped);
  if (limits_.lowered) sample.flags |= bit(ServoFault::LateTicks);
  last_share_ = at_most(share, 1);
  last_stored_ = sideways.stored;
  const auto [all, grown] = stored(stiffness, felt);
  Wrench wish = {
      felt.normal * normal_force + sideways.force,
      felt.twist * (stiffness * metres * metres) + cross(felt.arm * metres, sideways.force) + sideways.torque};
  Vec3d along = felt.normal;
  if (blend_.blending()) {
    // Where the model was moved under the tool: of the change, the hand's own way is felt at once.
    const Vec3d by_hand = felt.normal * (at.clutched ? 0 : -stiffness * dot(at.step, felt.normal));
    wish = blend_.step({shortened(wish.force, limits_.max_force), wish.torque}, by_hand, now.dt);
    along = normalized(wish.force);
  }
  asked_ = wish;
  const Wrench given = guard_.wrench({.force = wish.force,
                                      .torque = wish.torque,
                                      .normal = along,
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
    give_nothing();
  }
  return sample;
}

}  // namespace relief
