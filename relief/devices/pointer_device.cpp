#include <relief/devices/pointer_device.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relief {
namespace {

constexpr double kTick = 1e-3;        // s
constexpr double kForget = 0.02;      // share of the event interval per event: one late event slows ten others, no more
constexpr double kSteep = 3;          // way along the view beside that across it, from which on it is a silhouette
constexpr double kSilhouette = 2e-3;  // m along the view that are none yet
constexpr double kClearance = 5e-3;   // m in front of the model
constexpr double kLanding = 5e-3;     // m above the goal, from which on the tool comes down as slowly as it follows

}  // namespace

PointerPlace pointer_place(const Snapshot& model, const Ray3d& ray, const Workspace& workspace,
                           PickHint& hint) noexcept {
  const Box3d& box = model.slab_mesh().bounds();
  const Vec3d along = normalized(ray.direction);
  PointerPlace place;
  Vec3d at = ray.origin + along * std::max(0.0, dot(box.centre() - ray.origin, along));
  Vec3d normal = -along;
  if (const auto hit = raycast(model, ray, hint)) {
    place.over = true;
    at = hit->point.position;
    normal = hit->point.normal;
  }
  // How far the box reaches towards the eye.
  const Vec3d half = box.extent() * 0.5;
  const double reach = half.x * std::abs(along.x) + half.y * std::abs(along.y) + half.z * std::abs(along.z);
  place.rise = std::max(0.0, reach - dot(at - box.centre(), -along)) * workspace.metres_per_unit + kClearance;
  place.surface = workspace.to_device(at);
  place.normal = workspace.turned_to_device(normal);
  place.towards_eye = workspace.turned_to_device(-along);
  return place;
}

double PointerResistance::gain(double force) noexcept {
  return force > 0 ? kLeast + (1 - kLeast) * kHalf / (kHalf + force) : 1.0;
}

Ray3d PointerResistance::step(const Ray3d& mouse, bool pressed, double force) noexcept {
  const double share = gain(force);
  if (pressed && std::exchange(pressed_, pressed)) {
    pointer_.origin += (mouse.origin - mouse_.origin) * share;
    pointer_.direction += (mouse.direction - mouse_.direction) * share;
  } else {
    pressed_ = pressed;
    pointer_ = mouse;
  }
  mouse_ = mouse;
  return pointer_;
}

PointerDevice::PointerDevice(const PointerPlace& start) : place_(start), position_(front_of(start)) {
  info_ = {.name = "pointer",
           .continuous_force = DeviceInfo{}.max_force,  // no motor that warms up
           .max_work = 100,                             // nor a hand that could be hurt
           .max_speed = 2 * kFastest,
           .workspace_radius = 0,
           .sensed = {.position = 3},
           .actuated = {.position = 0},
           .absolute = false};
}

DeviceStatus PointerDevice::status() const {
  const bool on = forces_;
  return {.connected = true,
          .powered = true,
          .forces_on = on,
          .to_do = {},
          .force_off = on ? "" : "they are switched off",
          .trouble = {}};
}

Status PointerDevice::enable(bool forces) {
  forces_ = forces;
  return {};
}

void PointerDevice::point(const PointerPlace& place) noexcept {
  if (!is_finite(place.surface) || !is_finite(place.normal) || !is_finite(place.towards_eye) ||
      !std::isfinite(place.rise) || !std::isfinite(place.depth))
    return;
  PointerPlace kept = place;
  kept.depth = std::min(kept.depth, kDeepest);
  kept.pressure = kept.pressure >= 0 && kept.pressure <= 1 ? kept.pressure : 0;
  pressed_.fetch_or(kept.buttons & ~told_buttons_ & 0xffU, std::memory_order_relaxed);
  released_.fetch_or(told_buttons_ & ~kept.buttons & 0xffU, std::memory_order_relaxed);
  told_buttons_ = kept.buttons;
  places_.put(kept);
}

Vec3d PointerDevice::goal_of(const PointerPlace& place) noexcept {
  return place.over ? place.surface - place.normal * place.depth : place.surface;
}

Vec3d PointerDevice::front_of(const PointerPlace& place) noexcept {
  return place.surface + place.towards_eye * place.rise;
}

bool PointerDevice::behind_silhouette(const PointerPlace& from, const PointerPlace& to) noexcept {
  const Vec3d way = to.surface - from.surface;
  const double along = dot(way, to.towards_eye);
  return std::abs(along) > kSilhouette + kSteep * length(way - to.towards_eye * along);
}

void PointerDevice::arrive(const PointerPlace& place) noexcept {
  constexpr double kMost = kLongest / kLag / kTick;
  interval_ = std::min(std::max(since_, interval_ * (1 - kForget)), kMost);
  since_ = 0;
  left_ = std::clamp(kLag * interval_, kShortest / kTick, kLongest / kTick);
  if (behind_silhouette(place_, place)) {
    leg_ = Leg::Out;
    front_ = position_ + place_.towards_eye * std::max(0.0, dot(front_of(place_) - position_, place_.towards_eye));
  }
  place_ = place;
}

bool PointerDevice::hurry_to(Vec3d place) noexcept {
  const Vec3d way = place - position_;
  const double far = length(way), most = kFastest * kTick;
  position_ = far > most ? position_ + way * (most / far) : place;
  return far <= most;
}

void PointerDevice::fly() noexcept {
  if (leg_ == Leg::Out) {
    if (hurry_to(front_)) leg_ = Leg::Across;
  } else if (leg_ == Leg::Across) {
    if (hurry_to(front_of(place_))) leg_ = Leg::In;
  } else {
    // The way from the front is free down to the surface; the rest is for following.
    const Vec3d landing = place_.surface + place_.towards_eye * std::min(place_.rise, kLanding);
    if (hurry_to(landing)) {
      leg_ = Leg::None;
      left_ = kLongest / kTick;
    }
  }
}

bool PointerDevice::read(DeviceState& state) noexcept {
  since_ += 1;
  if (PointerPlace fresh; places_.take(fresh)) arrive(fresh);
  if (leg_ != Leg::None) {
    fly();
  } else {
    const Vec3d way = goal_of(place_) - position_;
    left_ = std::max(left_, length(way) / (kFastest * kTick));
    position_ = left_ > 1 ? position_ + way / left_ : goal_of(place_);
    left_ = std::max(0.0, left_ - 1);
  }
  state.t = static_cast<double>(tick_++) * kTick;
  state.position = position_;
  state.velocity = {};
  state.has_velocity = false;
  state.pressure = place_.pressure;
  state.has_pressure = true;
  state.buttons = place_.buttons;
  state.pressed = pressed_.exchange(0, std::memory_order_relaxed);
  state.released = released_.exchange(0, std::memory_order_relaxed);
  return true;
}

bool PointerDevice::write(const Wrench& wrench) noexcept {
  feel_.put({position_, forces_ ? wrench.force : Vec3d{}});
  return true;
}

}  // namespace relief
