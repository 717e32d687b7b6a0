#include "overlay.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <span>
#include <string_view>

namespace relief::detail {

namespace {

constexpr int kAround = 40;
/// Forces up to this are not shown, N.
constexpr double kNoForce = 1e-3;

/// A solid of revolution: `profile` gives (height along the axis, radius) from the bottom up.
struct Ring {
  double height, radius;
};

void revolve(std::vector<SolidVertex>& to, Box3d& bounds, Vec3d base, Vec3d axis, std::span<const Ring> profile,
             Vec3f colour) {
  const Vec3d helper = std::abs(axis.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  const Vec3d a = normalized(cross(axis, helper)), b = cross(axis, a);
  const auto at = [&](Ring r, int k) {
    const double turn = 2 * std::numbers::pi * (k % kAround) / kAround;
    const Vec3d out = a * std::cos(turn) + b * std::sin(turn);
    return std::pair{base + axis * r.height + out * r.radius, out};
  };
  for (std::size_t r = 0; r + 1 < profile.size(); ++r) {
    const Ring low = profile[r], high = profile[r + 1];
    const double rise = high.height - low.height, widen = high.radius - low.radius;
    for (int k = 0; k < kAround; ++k) {
      const auto vertex = [&](Ring ring, int step) {
        const auto [p, out] = at(ring, step);
        bounds.add(p);
        to.push_back({to_float(p), to_float(normalized(out * rise - axis * widen)), colour});
      };
      vertex(low, k), vertex(low, k + 1), vertex(high, k + 1);
      vertex(low, k), vertex(high, k + 1), vertex(high, k);
    }
  }
}

void ball(std::vector<SolidVertex>& to, Box3d& bounds, Vec3d centre, double radius, Vec3f colour) {
  constexpr int kRings = 20;
  const std::size_t first = to.size();
  std::array<Ring, kRings + 1> profile{};
  for (int k = 0; k <= kRings; ++k) {
    const double turn = std::numbers::pi * k / kRings;
    profile[static_cast<std::size_t>(k)] = {-radius * std::cos(turn), radius * std::sin(turn)};
  }
  revolve(to, bounds, centre, {0, 1, 0}, profile, colour);
  for (std::size_t k = first; k < to.size(); ++k) to[k].normal = normalized(to[k].position - to_float(centre));
}

/// Returns where the surface that the hand touches faces, unit: along the depth, else along the force, else to the eye.
Vec3d outwards(const HandOverlay& hand, Vec3d to_eye, double view_height) {
  const Vec3d depth = hand.contact_point - hand.cursor;
  if (hand.contact && length(depth) > 1e-6 * view_height) return normalized(depth);
  return length(hand.force) > kNoForce ? normalized(hand.force) : to_eye;
}

}  // namespace

Vec3d stylus_lean(Vec3d out, const Eye& eye, Vec3d to_eye) {
  // Of all directions at one angle to `out`: to the right, up and to the eye, but in the picture beside `out`, on the
  // side nearer to right and up.
  constexpr double kTilt = 50 * std::numbers::pi / 180, kBeside = 2;
  const Vec3d beside = cross(to_eye, out);
  const double turn = dot(beside, eye.right * 0.88 + eye.up * 0.46) < 0 ? -kBeside : kBeside;
  Vec3d side = normalized(eye.right * 0.80 + eye.up * 0.42 + to_eye * 0.45) + beside * turn;
  side -= out * dot(side, out);
  if (length(side) < 1e-6) side = cross(out, std::abs(out.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0});
  return out * std::cos(kTilt) + normalized(side) * std::sin(kTilt);
}

Solids make_solids(const HandOverlay& hand, Vec3d centre, const Eye& eye, double view_height) {
  Solids solids;
  const Vec3d cursor = hand.cursor - centre;
  const double tip = 0.016 * view_height;
  ball(solids.opaque, solids.bounds, cursor, tip, {0.86F, 0.10F, 0.12F});

  const Vec3d away = eye.at - cursor, to_eye = length(away) > 0 ? normalized(away) : -eye.forward;
  const Vec3d lean = stylus_lean(outwards(hand, to_eye, view_height), eye, to_eye);
  const std::array<Ring, 3> nose = {
      {{0.6 * tip, 0.25 * tip}, {0.06 * view_height, 0.85 * tip}, {0.062 * view_height, 0}}};
  std::array<Ring, 9> body = {
      {{0.06 * view_height, 0}, {0.06 * view_height, 1.0 * tip}, {0.10 * view_height, 1.25 * tip}}};
  for (std::size_t k = 3; k < body.size(); ++k) {
    const double turn = 0.5 * std::numbers::pi * static_cast<double>(k - 3) / 5;
    body[k] = {0.40 * view_height + 1.15 * tip * std::sin(turn), 1.15 * tip * std::cos(turn)};
  }
  revolve(solids.opaque, solids.bounds, cursor, lean, nose, {0.66F, 0.67F, 0.70F});
  revolve(solids.opaque, solids.bounds, cursor, lean, body, {0.16F, 0.17F, 0.20F});

  const double newtons = length(hand.force);
  if (newtons > kNoForce && std::isfinite(newtons)) {
    constexpr double kFullForce = 3.3;
    const double size = std::clamp(0.2 * newtons / kFullForce, 0.04, 0.2) * view_height;
    const double head = std::min(0.4 * size, 0.055 * view_height), thick = std::min(0.0085 * view_height, 0.2 * size);
    const std::array<Ring, 5> arrow = {
        {{0, 0}, {0, thick}, {size - head, thick}, {size - head, 2.3 * thick}, {size, 0}}};
    revolve(solids.opaque, solids.bounds, (hand.contact ? hand.contact_point : hand.cursor) - centre,
            hand.force / newtons, arrow, {0.13F, 0.72F, 0.30F});
  }
  if (hand.tool_radius > 0) ball(solids.translucent, solids.bounds, cursor, hand.tool_radius, {0.95F, 0.80F, 0.25F});
  return solids;
}

}  // namespace relief::detail
