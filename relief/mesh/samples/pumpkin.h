// The pumpkin: ten uneven ribs, a fluted stem, warts, dimpled skin.
#pragma once

#include "profile.h"
#include "rings.h"

namespace relief::detail {

class PumpkinSurface final : public SampleSurface {
 public:
  [[nodiscard]] Vec3d coarse(double s, double turn) const noexcept override { return shape(s, turn).position; }
  [[nodiscard]] Vertex fine(double s, double turn, double edge) const noexcept override;

 private:
  struct Shape {
    Vec3d position;
    Vec3d out;     ///< unit normal of the body without ribs
    double rib;    ///< 0 in the grooves, 1 on the crests
    double stem;   ///< 0 on the body, 1 on the stem
    double flute;  ///< -1 .. 1 around the stem
  };
  [[nodiscard]] static Shape shape(double s, double turn) noexcept;

  /// rho, y, depth of the ribs, stem.
  static constexpr std::array<ProfileKnot, 24> kProfile = {{
      {0.0, 9.0, 0.0, 0.0},   {6.0, 7.5, 0.6, 0.0},   {14.0, 4.0, 1.8, 0.0},  {25.0, 0.0, 3.2, 0.0},
      {37.0, 1.5, 5.0, 0.0},  {48.0, 9.0, 7.2, 0.0},  {55.0, 20.0, 7.8, 0.0}, {58.0, 33.0, 8.0, 0.0},
      {57.0, 46.0, 8.0, 0.0}, {52.5, 58.0, 7.8, 0.0}, {45.0, 68.0, 7.2, 0.0}, {35.0, 75.0, 6.2, 0.0},
      {25.5, 77.5, 5.0, 0.0}, {18.5, 75.5, 3.2, 0.0}, {14.5, 75.0, 1.2, 0.4}, {11.8, 78.0, 0.2, 0.9},
      {10.2, 81.5, 0.0, 1.0}, {9.3, 85.0, 0.0, 1.0},  {8.9, 88.5, 0.0, 1.0},  {8.9, 91.5, 0.0, 1.0},
      {8.6, 94.0, 0.0, 1.0},  {6.4, 95.2, 0.0, 1.0},  {3.2, 94.4, 0.0, 0.9},  {0.0, 94.0, 0.0, 0.8},
  }};
};

inline PumpkinSurface::Shape PumpkinSurface::shape(double s, double turn) noexcept {
  const ProfilePoint at = profile_point(kProfile, s);
  const double warped = turn + 0.010 * sin_turn(2.0 * turn + 0.1) + 0.008 * sin_turn(3.0 * turn + 0.4);
  const double wave = cos_turn(5.0 * warped + 0.25);
  const double rib = std::sqrt(wave * wave + 0.010);
  const double depth = at.a * smooth(0.0, 10.0, at.rho) * (1.0 + 0.15 * sin_turn(3.0 * turn + 0.3));
  const double flute = cos_turn(6.0 * turn + 0.010 * at.y + 0.2) + 0.5 * cos_turn(11.0 * turn + 0.35);
  const double push =
      depth * (rib - 0.8) + 0.95 * at.b * flute * smooth(0.0, 6.0, at.rho) * (1.0 - 0.5 * smooth(91.0, 96.0, at.y));
  const double rho = at.rho + at.normal_rho * push, y = at.y + at.normal_y * push;
  Vec3d p = {rho * sin_turn(turn + 0.5), y, rho * cos_turn(turn + 0.5)};
  // Grown, not turned on a lathe: a slight lean, a lopsided belly and a bent stem.
  const double bend = smooth(68.0, 100.0, p.y);
  const double lopsided = 1.0 + 0.025 * noise({p.x * 0.016 + 3.1, p.y * 0.02, p.z * 0.016}, 11) * (1.0 - at.b);
  p = {p.x * lopsided + 4.5 * bend * bend, p.y, p.z * lopsided + 2.0 * bend * bend};
  p.y += 0.035 * p.x * (1.0 - at.b) * smooth(20.0, 70.0, p.y) + at.b * 0.10 * (p.x - 3.0) * smooth(86.0, 95.0, p.y);
  const Vec3d out = {at.normal_rho * sin_turn(turn + 0.5), at.normal_y, at.normal_rho * cos_turn(turn + 0.5)};
  return {p, out, clamp01((rib - 0.10) / 0.90), at.b, flute};
}

inline SampleSurface::Vertex PumpkinSurface::fine(double s, double turn, double edge) const noexcept {
  const Shape at = shape(s, turn);
  const Vec3d p = at.position;
  // In a groove the normals of its two sides would cross: what rises there rises along the middle.
  const Vec3d n = normalized(
      mix(at.out, surface_normal(*this, s, turn), mix(smooth(0.0, 0.45, at.rib), 1.0, smooth(0.0, 0.5, at.stem))));
  const double body = 1.0 - smooth(0.0, 0.5, at.stem);

  // Skin: broad dents, dimples and pores.
  double lift = 0.0;
  lift += body * 0.55 * noise(p * 0.11, 21) * carried(9.0, edge);
  lift += body * 0.34 * noise(p * 0.18, 27) * carried(6.5, edge);
  const double dents = noise(p * 0.30, 22);
  lift += body * 0.26 * dents * carried(3.3, edge);
  const double dimples = noise(p * 0.62, 23);
  lift -= body * 0.19 * smooth(0.05, 0.75, dimples) * carried(1.7, edge);
  const CellHit pores = cells(p * 0.8, 24);
  lift -= body * 0.075 * (1.0 - smooth(0.05, 0.42, pores.nearest)) * carried(1.0, edge);
  lift += body * 0.035 * noise(p * 1.9, 25) * carried(0.55, edge);

  // Warts: rare large ones in loose groups, more small ones. A wart is a steep-sided dome with a bumpy top.
  const double groups = 0.5 + 0.5 * noise(p * 0.035 + Vec3d{0.3, 0.7, 0.1}, 26);
  const auto wart = [&](double cell, double share, double least, double most, double height, std::uint32_t seed) {
    const Vec3d q = {p.x, p.y * 0.86, p.z};
    const Vec3d wobble = {noise(p * 0.45, seed + 1), noise(p * 0.45, seed + 2), noise(p * 0.45, seed + 3)};
    return strewn((q + wobble * (0.18 * least)) / cell, seed, [&](double distance, std::uint32_t hash) {
      if (hash_part(hash, 0) > share * (0.35 + 1.3 * groups)) return 0.0;
      const double radius = mix(least, most, hash_part(hash, 1) * hash_part(hash, 1));
      const double t = distance * cell / radius;
      return height * (0.5 + 0.5 * radius / most) *
             (0.75 * smooth(1.0, 0.45, t) + 0.45 * (1.0 - t * t) * smooth(1.0, 0.9, t)) * carried(radius * 2.1, edge);
    });
  };
  const double away = body * smooth(0.06, 0.16, s) * (1.0 - smooth(0.62, 0.70, s));
  const double large = away * wart(11.0, 0.42, 1.8, 4.2, 2.0, 31);
  const double small = away * wart(5.0, 0.26, 0.7, 1.4, 0.7, 41);
  const double warts = std::max(large, small);
  lift = lift * (1.0 - 0.6 * smooth(0.2, 1.0, warts)) + warts +
         0.07 * smooth(0.4, 1.2, large) * noise(p * 0.7, 47) * carried(1.4, edge);

  // Stem: fibres along it, a rough cut on top.
  const double woody = smooth(0.3, 0.9, at.stem);
  const double cut = woody * smooth(0.93, 0.965, s);
  const Vec3d fibre = {p.x * 1.15, p.y * 0.10, p.z * 1.15};
  const double fibres = noise(fibre, 51);
  lift +=
      woody * (1.0 - cut) * (0.24 * fibres * carried(0.9, edge) + 0.10 * noise(fibre * 2.2, 52) * carried(0.5, edge));
  lift += cut * 0.35 * noise(p * 0.55, 53) * carried(1.8, edge);

  // Colour: ripe orange on the crests, redder in the grooves and below, pale speckles drawn out along the ribs.
  const double low = 1.0 - smooth(0.0, 45.0, p.y);
  Vec3d colour = mix(Vec3d{0.78, 0.36, 0.07}, Vec3d{0.93, 0.585, 0.13}, smooth(0.05, 0.85, at.rib));
  colour = mix(colour, {0.84, 0.42, 0.08}, 0.55 * low);
  colour = mix(colour, {0.97, 0.68, 0.20}, 0.38 * smooth(-0.1, 0.7, noise(p * 0.05, 61)) * at.rib);
  const double speckles =
      noise({p.x * 0.55, p.y * 0.24, p.z * 0.55}, 62) + 0.5 * noise({p.x * 1.2, p.y * 0.6, p.z * 1.2}, 63);
  colour = mix(colour, {0.98, 0.78, 0.38},
               0.60 * smooth(0.30, 0.75, speckles) * smooth(0.1, 0.6, at.rib) * carried(2.2, edge));
  colour = mix(colour, {0.72, 0.34, 0.07}, 0.35 * smooth(0.25, 0.8, -speckles) * carried(2.2, edge));
  colour = mix(colour, {0.80, 0.40, 0.08}, 0.22 * smooth(0.2, 0.7, dimples) * carried(1.7, edge));
  colour = mix(colour, {0.66, 0.62, 0.25},
               0.55 * smooth(24.0, 11.0, std::sqrt(p.x * p.x + p.z * p.z)) * smooth(55.0, 72.0, p.y));
  colour = mix(colour, {0.80, 0.68, 0.40}, 0.92 * smooth(0.12, 0.8, warts));
  colour = mix(colour, {0.68, 0.56, 0.30},
               0.5 * smooth(0.3, 1.0, warts) * smooth(-0.2, 0.6, noise(p * 0.8, 64)) * carried(1.2, edge));
  colour = mix(colour, {0.45, 0.33, 0.16}, 0.75 * (1.0 - smooth(2.0, 9.0, std::sqrt(p.x * p.x + p.z * p.z))) * low);
  Vec3d stem = mix(Vec3d{0.27, 0.32, 0.11}, Vec3d{0.60, 0.60, 0.33}, smooth(-1.1, 1.1, at.flute + 0.7 * fibres));
  stem = mix(stem, {0.42, 0.50, 0.17}, 0.45 * smooth(92.0, 74.0, p.y));
  stem = mix(stem, mix(Vec3d{0.55, 0.50, 0.32}, Vec3d{0.74, 0.68, 0.48}, smooth(-0.4, 0.4, noise(p * 0.7, 65))),
             smooth(0.935, 0.96, s));
  colour = mix(colour, stem, smooth(0.25, 0.75, at.stem));
  return {p + n * lift, colour};
}

}  // namespace relief::detail
