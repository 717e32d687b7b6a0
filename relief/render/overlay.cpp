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

/// Where the surface that the hand touches faces, unit: along the depth, else along the force, else to the eye.
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

namespace {

/// Letters of 5 x 7 dots, rows from the top, the left dot in the highest of five bits.
struct Glyph {
  char letter;
  std::array<std::uint8_t, 7> rows;
};
constexpr std::array<Glyph, 15> kGlyphs = {{
    {'0', {14, 17, 19, 21, 25, 17, 14}},
    {'1', {4, 12, 4, 4, 4, 4, 14}},
    {'2', {14, 17, 1, 6, 8, 16, 31}},
    {'3', {30, 1, 1, 14, 1, 1, 30}},
    {'4', {2, 6, 10, 18, 31, 2, 2}},
    {'5', {31, 16, 30, 1, 1, 17, 14}},
    {'6', {6, 8, 16, 30, 17, 17, 14}},
    {'7', {31, 1, 2, 4, 8, 8, 8}},
    {'8', {14, 17, 17, 14, 17, 17, 14}},
    {'9', {14, 17, 17, 15, 1, 2, 12}},
    {'.', {0, 0, 0, 0, 0, 12, 12}},
    {'a', {0, 0, 14, 1, 15, 17, 15}},
    {'l', {12, 4, 4, 4, 4, 4, 14}},
    {'p', {0, 0, 30, 17, 30, 16, 16}},
    {'h', {16, 16, 22, 25, 17, 17, 17}},
}};

void put(Picture& picture, int x, int y, Vec3f colour, float share) {
  if (x < 0 || y < 0 || x >= picture.width || y >= picture.height) return;
  std::uint8_t* pixel =
      picture.rgb.data() +
      (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) + static_cast<std::size_t>(x)) * 3;
  for (std::size_t c = 0; c < 3; ++c)
    pixel[c] = static_cast<std::uint8_t>(
        std::lround(std::clamp(static_cast<float>(pixel[c]) * (1 - share) + colour[c] * 255 * share, 0.0F, 255.0F)));
}

void write_text(Picture& picture, int x, int y, int dot, std::string_view text) {
  for (const char letter : text) {
    for (const Glyph& glyph : kGlyphs) {
      if (glyph.letter != letter) continue;
      for (int row = 0; row < 7 * dot; ++row)
        for (int column = 0; column < 5 * dot; ++column)
          if (((glyph.rows[static_cast<std::size_t>(row / dot)] >> static_cast<unsigned>(4 - column / dot)) & 1U) != 0)
            put(picture, x + column, y + row, {0.96F, 0.96F, 0.96F}, 1);
    }
    x += 6 * dot;
  }
}

}  // namespace

void draw_legend(Picture& picture, float min_alpha, float max_alpha) {
  const int dot = std::max(1, picture.height / 360), margin = 10 * dot, wide = 10 * dot, tall = 110 * dot;
  const int left = margin, top = picture.height - margin - tall;
  for (int y = -4 * dot - 12 * dot; y < tall + 4 * dot; ++y)
    for (int x = -4 * dot; x < wide + 44 * dot; ++x) put(picture, left + x, top + y, {0.05F, 0.05F, 0.06F}, 0.55F);
  for (int y = 0; y < tall; ++y) {
    const float t =
        (1 - (static_cast<float>(y) + 0.5F) / static_cast<float>(tall)) * static_cast<float>(kHeat.size() - 1);
    const auto k = std::min(static_cast<std::size_t>(t), kHeat.size() - 2);
    const float f = t - static_cast<float>(k);
    for (int x = 0; x < wide; ++x) put(picture, left + x, top + y, kHeat[k] * (1 - f) + kHeat[k + 1] * f, 1);
  }
  for (const int y : {top - 3 * dot, top + tall})
    for (int k = 0; k < 3 * dot * wide; ++k) put(picture, left + k % wide, y + k / wide, kAtEnd, 1);
  std::array<char, 16> number{};
  const auto label = [&](int y, float value) {
    std::snprintf(number.data(), number.size(), "%.3f", static_cast<double>(value));
    write_text(picture, left + wide + 5 * dot, y, dot, number.data());
  };
  write_text(picture, left, top - 12 * dot, dot, "alpha");
  label(top, max_alpha);
  label(top + tall / 2 - 3 * dot, (min_alpha + max_alpha) / 2);
  label(top + tall - 7 * dot, min_alpha);
}

}  // namespace relief::detail
