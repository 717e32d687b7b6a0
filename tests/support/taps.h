// Taps with a ball on a model, and how far what they cut misses the ball, seen by rays alone.
#pragma once

#include <relief/core/query.h>
#include <relief/edit/stroke.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <random>
#include <utility>

namespace relief::testing {

/// A tap and the ball that it means.
struct Tap {
  Stroke stroke;
  Vec3d low, normal, centre;  ///< its lowest point, the way out, unit, and its middle; model units
  double radius = 0, depth = 0;
  /// The same with the clip as it is or blended, and with samples so many radii apart at most.
  [[nodiscard]] Tap with(bool exact, double detail) const {
    Tap other = *this;
    other.stroke.brush.exact = exact;
    other.stroke.brush.detail = detail;
    return other;
  }
};

/// How far a cut misses its ball, model units.
struct Misses {
  double left = 0;      ///< clay inside the ball, from it, at most
  double too_much = 0;  ///< what was cut beyond it, at most
  double rms = 0;       ///< of both, over what the ball cuts
};

/// Looks from the ball's centre down on what it was to cut. Nothing is taken from the program but where a ray meets a
/// surface.
inline Misses misses(const Snapshot& before, const Snapshot& after, const Tap& tap) {
  Misses found;
  const Vec3d side =
      normalized(std::abs(tap.normal.x) < 0.8 ? cross(tap.normal, Vec3d{1, 0, 0}) : cross(tap.normal, Vec3d{0, 1, 0}));
  const Vec3d across = cross(tap.normal, side);
  constexpr int kRings = 24, kTurns = 48;
  double squares = 0, area = 0;
  for (int ring = 0; ring < kRings; ++ring)
    for (int turn = 0; turn < kTurns; ++turn) {
      const double tilt = std::numbers::pi / 2 * (ring + 0.5) / kRings, round = 2 * std::numbers::pi * turn / kTurns;
      const Vec3d way =
          -tap.normal * std::cos(tilt) + (side * std::cos(round) + across * std::sin(round)) * std::sin(tilt);
      const auto was = raycast(before, {tap.centre, way});
      if (!was || was->distance > tap.radius) continue;
      // What lies behind the place where the ball is left: the body, as far as it goes, or nothing until it begins.
      const auto beyond = raycast(before, {tap.centre + way * tap.radius, way});
      const auto is = raycast(after, {tap.centre, way});
      if (!beyond) continue;  // an opening of the scan
      const double next = tap.radius + beyond->distance, reach = is ? std::min(is->distance, next) : next;
      const bool in_body = dot(beyond->point.normal, way) > 0;
      found.left = std::max(found.left, tap.radius - reach);
      if (in_body) found.too_much = std::max(found.too_much, reach - tap.radius);
      const double off = in_body || reach < tap.radius ? reach - tap.radius : 0;
      squares += off * off * std::sin(tilt);
      area += std::sin(tilt);
    }
  found.rms = area > 0 ? std::sqrt(squares / area) : 0;
  return found;
}

/// The share of a tap's ball, seen along its axis, that no height over the surface can hold: the body ends in the ball,
/// or comes back in it, so that the cut would be a hole or an undercut. Rays on the surface as it was.
inline double beyond_heights(const Snapshot& before, const Tap& tap, double diagonal) {
  constexpr int kAcross = 40;      // columns from the axis to the ball's side
  constexpr double kAside = 1e-5;  // of the diagonal: the surface itself is not met again
  const Vec3d side =
      normalized(std::abs(tap.normal.x) < 0.8 ? cross(tap.normal, Vec3d{1, 0, 0}) : cross(tap.normal, Vec3d{0, 1, 0}));
  const Vec3d across = cross(tap.normal, side);
  int columns = 0, beyond = 0;
  for (int y = -kAcross; y <= kAcross; ++y)
    for (int x = -kAcross; x <= kAcross; ++x) {
      const double square = double(x * x + y * y) / (kAcross * kAcross);
      if (square >= 1) continue;
      const double half = tap.radius * std::sqrt(1 - square);
      const Vec3d top = tap.centre + (side * x + across * y) * (tap.radius / kAcross) + tap.normal * half;
      int crossings = 0;
      bool is_in = false;
      auto met = raycast(before, {top, -tap.normal});
      const bool is_buried = met && dot(met->point.normal, tap.normal) < 0;
      for (double down = 0; met; met = raycast(before, {top - tap.normal * down, -tap.normal})) {
        if (down + met->distance > 2 * half) break;
        ++crossings;
        is_in = dot(met->point.normal, tap.normal) > 0;
        down += met->distance + kAside * diagonal;
      }
      if (crossings == 0 && !is_buried) continue;
      ++columns;
      beyond += !is_in || crossings != 1 || is_buried ? 1 : 0;
    }
  return columns > 0 ? double(beyond) / columns : 0;
}

/// Taps at random places of a model.
class Taps {
 public:
  Taps(SnapshotPtr model, double diagonal, std::uint32_t seed)
      : model_(std::move(model)), diagonal_(diagonal), random_(seed) {}

  /// A tap so deep that the ball's centre stands in the open above the surface. Its axis is the mean normal under the
  /// tool. The body goes on straight below the place for `thick` at least.
  [[nodiscard]] Tap next(double radius, double depth, double thick = 0) {
    while (true)
      if (auto tap = try_next(radius, depth); tap && thickness(*tap) >= thick) return *std::move(tap);
  }

 private:
  [[nodiscard]] double thickness(const Tap& tap) const {
    constexpr double kAside = 1e-4;  // of the diagonal: the surface itself is not met again
    const Vec3d surface = tap.low + tap.normal * tap.depth;
    const auto far = raycast(*model_, {surface - tap.normal * (kAside * diagonal_), -tap.normal});
    return far ? far->distance : 0;
  }

  [[nodiscard]] std::optional<Tap> try_next(double radius, double depth) {
    const Snapshot& model = *model_;
    std::uniform_real_distribution<double> unit(-1, 1);
    const Box3d box = bounds_of_surface(model);
    const Vec3d middle = (box.low + box.high) / 2;
    const Vec3d from = middle + normalized(Vec3d{unit(random_), unit(random_), unit(random_)}) * diagonal_;
    const Vec3d to = middle + Vec3d{unit(random_), unit(random_), unit(random_)} * (0.2 * diagonal_);
    const auto hit = raycast(model, {from, normalized(to - from)});
    if (!hit) return {};
    const Vec3d low = hit->point.position - hit->point.normal * depth;
    Stroke stroke;
    stroke.brush = {.tool = Tool::Carve, .radius = radius, .detail = 1.0 / 40, .exact = true};
    stroke.tip = true;
    stroke.points = {{0, low, 1}, {0.1, low, 1}};
    Editor editor(model_);
    StrokeEngine engine(editor);
    std::optional<Dab> dab;
    engine.on_dab([&](const Dab& given, const DabResult&) {
      if (!dab) dab = given;
    });
    engine.begin(stroke.brush, stroke.tip);
    engine.move(stroke.points);
    engine.cancel();
    if (!dab) return {};
    Tap tap = {stroke, dab->cursor, normalized(dab->normal), {}, radius, depth};
    tap.centre = tap.low + tap.normal * radius;
    const auto down = raycast(model, {tap.centre, -tap.normal}), up = raycast(model, {tap.centre, tap.normal});
    const bool is_open = down && down->distance < radius && dot(down->point.normal, tap.normal) > 0 &&
                         (!up || dot(up->point.normal, tap.normal) < 0);
    return is_open ? std::optional(std::move(tap)) : std::nullopt;
  }

  SnapshotPtr model_;
  double diagonal_;
  std::mt19937 random_;
};

}  // namespace relief::testing
