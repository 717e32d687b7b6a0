#include <relief/core/query.h>
#include <relief/devices/open_device.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>

namespace relief {
namespace {

constexpr std::size_t kPlaces = 13;  // that the hand goes to, then again
constexpr double kAway = 1.2;        // of the box's half: how far out it travels
// Of the model's diagonal: how deep the hand would press the tool, and how far it strokes.
constexpr double kPress = 0.08;
// Of the model's diagonal: what is thinner is pressed through. A hand of 1.5 N goes about 0.025 deep.
constexpr double kThick = 0.05;
// How sure a press must be, or another is looked for. At the straight rim of a flat sheet half of what is around is
// missing, and no press is surer than this.
constexpr double kSure = 0.5;

/// Returns the unit vector of a place, as the device's axes run: they visit the sphere evenly, the top first (golden
/// angle).
Vec3d direction(std::size_t place) noexcept {
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  const auto index = static_cast<double>(place % kPlaces);
  const double y = 1 - 2 * (index + 0.5) / kPlaces;
  const double ring = std::sqrt(1 - y * y), turn = golden * index + std::numbers::pi / 2;
  return {ring * std::cos(turn), y, ring * std::sin(turn)};
}

/// From one unit vector to another along the sphere.
Vec3d between(Vec3d from, Vec3d to, double share) noexcept {
  const double angle = std::acos(std::clamp(dot(from, to), -1.0, 1.0));
  if (std::sin(angle) <= 1e-6) return to;
  return (from * std::sin((1 - share) * angle) + to * std::sin(share * angle)) / std::sin(angle);
}

/// Minimum-jerk way from 0 to 1.
double ease(double share) noexcept {
  const double s = std::clamp(share, 0.0, 1.0);
  return s * s * s * (10 - s * (15 - 6 * s));
}

/// Returns a unit vector across a unit vector.
Vec3d across(Vec3d way) noexcept {
  return normalized(cross(way, std::abs(way.y) < 0.9 ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0}));
}

/// In the model's space: from the air straight to the first place of the surface on that way, and on into it.
struct Press {
  Vec3d surface;
  Vec3d way;         ///< unit, inwards
  Vec3d side;        ///< unit, across the way: where the surface goes on
  double sure = -1;  ///< 0 .. 1, how surely the hand meets the surface there and keeps it; -1 where it has none
};

/// Looks for presses on one model.
class Feeler {
 public:
  explicit Feeler(const Snapshot& model) noexcept
      : model_(model), box_(bounds_of_surface(model)), size_(diagonal(box_)) {}

  /// At the place that is nearest to `from` if that is sure, else the surest of a fan of ways through the box. The way
  /// there is free.
  [[nodiscard]] Press press_from(Vec3d from) const noexcept {
    Press best = {.surface = box_.centre(), .way = normalized(box_.centre() - from), .side = {}};
    best.side = across(best.way);
    const Vec3d u = best.side, v = cross(best.way, u);
    const auto try_towards = [&](Vec3d aim) {
      if (const Press other = press_towards(from, aim); other.sure > best.sure) best = other;
    };
    if (const SurfacePoint nearest = closest_point(model_, from); nearest.slab != kNoSlab)
      try_towards(nearest.position);
    constexpr int kFan = 2;  // ways to each side of the middle
    for (int k = -kFan; k <= kFan && best.sure < kSure; ++k)
      for (int j = -kFan; j <= kFan; ++j)
        try_towards(box_.centre() + u * (reach(u) * k / kFan) + v * (reach(v) * j / kFan));
    return best;
  }

 private:
  /// Returns how far the box goes from its middle along a unit vector.
  [[nodiscard]] double reach(Vec3d along) const noexcept {
    const Vec3d half = box_.extent() * 0.5;
    return std::abs(along.x) * half.x + std::abs(along.y) * half.y + std::abs(along.z) * half.z;
  }

  [[nodiscard]] Press press_towards(Vec3d from, Vec3d aim) const noexcept {
    Press press = {.surface = aim, .way = normalized(aim - from), .side = {}};
    const std::optional<RayHit> hit = raycast(model_, {from, press.way});
    const double facing = hit ? -dot(press.way, hit->point.normal) : 0.0;
    if (!(facing > 0)) return press;
    press.surface = hit->point.position;
    constexpr int kSides = 8;
    const Vec3d u = across(press.way), v = cross(press.way, u);
    double around = 0, along = -1;
    for (int k = 0; k < kSides; ++k) {
      const double turn = 2 * std::numbers::pi * k / kSides;
      const Vec3d side = u * std::cos(turn) + v * std::sin(turn);
      const double near = met_beside(from, press, side * (0.5 * kPress * size_));
      const double far = met_beside(from, press, side * (kPress * size_));
      around += near / kSides;
      if ((near + far) / 2 <= along) continue;
      along = (near + far) / 2;
      press.side = side;
    }
    press.sure = around * (facing + along) / 2 * thickness(press);
    return press;
  }

  /// 0 .. 1, how squarely the same press, moved by `off`, meets the surface; 0 where that lies more above or below than
  /// beside.
  [[nodiscard]] double met_beside(Vec3d from, const Press& press, Vec3d off) const noexcept {
    const std::optional<RayHit> hit = raycast(model_, {from + off, press.way});
    if (!hit || std::abs(hit->distance - length(press.surface - from)) > length(off)) return 0;
    return std::max(0.0, -dot(press.way, hit->point.normal));
  }

  /// 0 .. 1, 1 where the hand does not press through.
  [[nodiscard]] double thickness(const Press& press) const noexcept {
    // From a little below, so as not to meet the surface itself.
    const std::optional<RayHit> out = raycast(model_, {press.surface + press.way * (1e-3 * size_), press.way});
    return out ? std::min(1.0, out->distance / (kThick * size_)) : 1.0;
  }

  const Snapshot& model_;
  Box3d box_;
  double size_;  ///< model units
};

/// For a place whose own press is not sure: the sure one that is nearest to it, or else the surest of all.
std::size_t best_instead(const std::array<Press, kPlaces>& presses, std::size_t place) noexcept {
  const auto better = [&](std::size_t a, std::size_t b) {
    const double sure_a = std::min(presses[a].sure, kSure), sure_b = std::min(presses[b].sure, kSure);
    if (sure_a != sure_b) return sure_a > sure_b;
    return dot(direction(a), direction(place)) > dot(direction(b), direction(place));
  };
  std::size_t best = place;
  for (std::size_t k = 0; k < kPlaces; ++k)
    if (better(k, best)) best = k;
  return best;
}

}  // namespace

HandScript exploring_hand(const Snapshot& model, const Workspace& workspace, std::uint32_t buttons) {
  const Box3d box = bounds_of_surface(model);
  const Vec3d centre = box.centre(), half = box.extent() * (0.5 * kAway);
  /// In the model's space, in the air: the device's `way` from the middle.
  const auto around = [=](Vec3d way) {
    const Vec3d turned = workspace.turned_to_model(way);
    return centre + Vec3d{turned.x * half.x, turned.y * half.y, turned.z * half.z};
  };
  const Feeler feeler(model);
  std::array<Press, kPlaces> presses;
  for (std::size_t k = 0; k < kPlaces; ++k) presses[k] = feeler.press_from(around(direction(k)));

  /// In the device's space: from which direction the hand comes, where it would press the tool to, and how it strokes.
  struct Place {
    Vec3d way, in, stroke;
  };
  std::array<Place, kPlaces> places;
  for (std::size_t k = 0; k < kPlaces; ++k) {
    const std::size_t chosen = best_instead(presses, k);
    const Press& press = presses[chosen];
    const Vec3d in = press.surface + press.way * (kPress * diagonal(box));
    const Vec3d stroked = in + press.side * (kPress * diagonal(box));
    places[k] = {direction(chosen), workspace.to_device(in), workspace.to_device(stroked) - workspace.to_device(in)};
  }
  return [places, around, workspace, buttons](double t) -> HandTarget {
    // One place after the other, 2 s each: travel around the box, press in, stroke there and back, lift off. The first
    // one needs no travel.
    constexpr double kVisit = 2, kFirst = 0.5;
    const double now = std::max(t, 0.0) + kFirst, visit = std::floor(now / kVisit), at = now - visit * kVisit;
    const auto index = static_cast<std::size_t>(std::fmod(visit, 1e6));
    const Place& here = places[index % kPlaces];
    const Place& last = index > 0 ? places[(index - 1) % kPlaces] : here;
    const Vec3d above = workspace.to_device(around(between(last.way, here.way, ease(at / 0.7))));
    const double press = ease((at - 0.7) / 0.3) * (1 - ease((at - 1.7) / 0.3));
    const double stroke = ease((at - 0.95) / 0.35) - ease((at - 1.35) / 0.35);
    return {.position = above + (here.in - above) * press + here.stroke * stroke,
            .buttons = press > 0.5 ? buttons : 0U};
  };
}

}  // namespace relief
