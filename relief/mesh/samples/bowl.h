// The bowl: a thin wall with a rounded rim, a foot ring and a carved band; glazed in blue and white.
#pragma once

#include "profile.h"
#include "rings.h"

namespace relief::detail {

class BowlSurface final : public SampleSurface {
 public:
  [[nodiscard]] Vec3d coarse(double s, double turn) const noexcept override {
    const ProfilePoint at = profile_point(kProfile, s);
    return {at.rho * sin_turn(turn + 0.5), at.y, at.rho * cos_turn(turn + 0.5)};
  }
  [[nodiscard]] Vertex fine(double s, double turn, double edge) const noexcept override;

 private:
  struct Work {
    double lift;  ///< units along the normal
    double ink;   ///< 0 .. 1, share of cobalt
  };
  [[nodiscard]] static Work outside(const ProfilePoint& at, double turn, double edge) noexcept;
  [[nodiscard]] static Work inside(Vec3d p, const ProfilePoint& at, double turn, double edge) noexcept;
  /// Half the width over which painted edges fade, so that they do not fray.
  [[nodiscard]] static double blur_of(double edge) noexcept { return std::max(0.25, 0.6 * edge); }

  /// rho, y, then: 1 on the inside; the way up the outer wall (0 .. 1).
  static constexpr std::array<ProfileKnot, 37> kProfile = {{
      {0.0, 5.5, 0, 0},      {10.0, 5.4, 0, 0},     {20.0, 5.2, 0, 0},     {28.0, 4.6, 0, 0},    {32.0, 2.2, 0, 0},
      {34.5, -0.6, 0, 0},    {38.5, -1.2, 0, 0},    {41.8, 0.6, 0, 0},     {42.6, 4.4, 0, 0},    {46.0, 8.2, 0, 0.02},
      {54.0, 11.8, 0, 0.1},  {64.0, 17.6, 0, 0.2},  {73.5, 26.0, 0, 0.3},  {81.0, 36.0, 0, 0.4}, {86.5, 47.0, 0, 0.5},
      {90.4, 58.5, 0, 0.6},  {93.2, 70.0, 0, 0.7},  {95.2, 81.0, 0, 0.8},  {96.8, 90.5, 0, 0.9}, {97.9, 97.0, 0, 0.96},
      {96.9, 101.2, 0.1, 1}, {92.8, 102.0, 0.5, 1}, {89.2, 99.4, 0.9, 1},  {87.4, 92.5, 1, 1},   {85.4, 82.5, 1, 0.9},
      {83.2, 72.0, 1, 0.8},  {80.2, 61.0, 1, 0.7},  {76.2, 50.5, 1, 0.6},  {70.8, 40.8, 1, 0.5}, {63.8, 32.4, 1, 0.4},
      {55.2, 26.0, 1, 0.3},  {46.0, 21.6, 1, 0.2},  {36.0, 18.6, 1, 0.15}, {26.0, 16.8, 1, 0.1}, {16.0, 15.8, 1, 0.05},
      {7.0, 15.4, 1, 0.02},  {0.0, 15.3, 1, 0},
  }};
};

inline BowlSurface::Work BowlSurface::outside(const ProfilePoint& at, double turn, double edge) noexcept {
  const double blur = blur_of(edge);
  const auto line = [&](double middle, double half, double place) {
    return smooth(half + blur, half - blur, std::abs(place - middle));
  };
  double lift = 0.0, ink = 0.0;
  // The band: scrolls and bosses between two rows of beads, leaves below it.
  const double y = at.y;
  const double frame = smooth(62.0, 63.5, y) * smooth(90.5, 89.0, y);
  const double around = 18.0 * turn, cell = around - std::floor(around);
  const double u = (cell - 0.5) * 32.6, v = y - 76.2;  // units, from the middle of one scroll
  const double r = std::sqrt(u * u + v * v);
  const double spiral = r / 5.4 - angle_turn(v, u);  // one arm, 5.4 units from turn to turn
  const double arm = cos_turn(spiral), soft = std::clamp(1.2 * edge, 0.45, 1.0);
  const double scroll = mix(0.8, smooth(0.05 - soft, 0.05 + soft, arm), carried(5.0, edge)) *
                        smooth(12.4 + 0.5 * blur, 11.2 - 0.5 * blur, r);
  const double side = 16.3 - std::abs(u), diamond = 1.25 * side + 0.55 * std::abs(v);
  const double boss =
      smooth(4.2 + 0.5 * blur, 2.6 - 0.5 * blur, diamond) * (1.0 - 0.5 * smooth(0.4, 0.0, diamond / 4.0));
  const double relief = std::max(scroll, boss);
  lift += 1.55 * frame * relief * carried(4.0, edge);
  ink = std::max(ink, frame * smooth(mix(0.85, 0.60, carried(5.0, edge)), 0.20, relief));
  const auto beads = [&](double middle) {
    const double turn_bead = cos_turn(108.0 * turn);
    const double bead = std::sqrt(std::max(0.0, 1.0 - (y - middle) * (y - middle) / 4.0)) * (0.62 + 0.38 * turn_bead);
    return bead * carried(5.0, edge);
  };
  lift += 1.25 * beads(61.0) + 1.25 * beads(91.7);
  const double petals = 24.0 * turn, petal = 2.0 * (petals - std::floor(petals)) - 1.0;
  const double width = std::sqrt(clamp01((56.5 - y) / 20.0)) * smooth(9.0, 14.0, y);
  const double leaf = width - std::abs(petal);
  const double body = smooth(-0.5 * blur, 2.4 + 0.5 * blur, leaf * at.rho * 0.131);
  lift += 1.15 * body * smooth(8.0, 14.0, y) * carried(5.0, edge);
  const double groove = body * smooth(0.35 + blur, 0.15, std::abs(petal) * at.rho * 0.131) * smooth(52.0, 46.0, y);
  lift -= 0.45 * groove * carried(2.0, edge);
  const double veins = std::abs(cos_turn((y - 7.0 * std::abs(petal)) / 5.0));
  lift -= 0.22 * body * smooth(0.25, 0.0, veins) * smooth(0.95, 0.55, std::abs(petal) / (width + 1e-6)) *
          carried(1.5, edge);
  ink = std::max(ink,
                 smooth(1.3 + blur, 0.6 - blur, leaf * at.rho * 0.131) * smooth(9.5, 11.0, y) * smooth(58.5, 57.0, y));
  ink = std::max(
      {ink, 0.8 * groove * carried(2.0, edge), line(96.4, 0.8, y), line(6.5, 0.7, y) * smooth(40.0, 41.0, at.rho)});
  return {lift, ink};
}

inline BowlSurface::Work BowlSurface::inside(Vec3d p, const ProfilePoint& at, double turn, double edge) noexcept {
  const double blur = blur_of(edge);
  const auto line = [&](double middle, double half, double place) {
    return smooth(half + blur, half - blur, std::abs(place - middle));
  };
  double lift = 0.0, ink = 0.0;
  // Inside: a flower in the bottom, throwing rings up the wall, a painted edge.
  const double throwing = noise({0.2, 0.2, at.b * 34.0 + 0.4 * sin_turn(turn)}, 111);
  lift += 0.16 * throwing * carried(3.0, edge) * smooth(0.10, 0.2, at.b);
  const double rho = at.rho, petals = 8.0 * turn;
  // Distance to the outline of a flower with eight petals, positive inside.
  const auto flower_at = [&](double least, double more, double shift) {
    const double petal = std::abs(cos_turn(0.5 * petals + shift));
    const double slope = more * 4.0 * std::sqrt(std::max(0.0, 1.0 - petal * petal)) / std::max(rho, 1.0);
    return (least + more * petal - rho) / std::sqrt(1.0 + slope * slope);
  };
  const double outer = flower_at(20.0, 28.0, 0.0), inner = flower_at(11.0, 16.0, 0.25);
  const double flower = smooth(-0.5 - blur, 1.0 + blur, outer), flower_inner = smooth(-0.5 - blur, 1.0 + blur, inner);
  lift += (0.9 * flower + 0.9 * flower_inner) * carried(5.0, edge);
  const double heart = smooth(8.2 + 0.5 * blur, 7.0 - 0.5 * blur, rho);
  const CellHit seeds = cells(p * 0.75, 112);
  lift += heart * (1.0 + 0.25 * smooth(0.5, 0.1, seeds.nearest) * carried(1.2, edge));
  const double from_middle =
      std::abs(petals - std::floor(petals + 0.5)) * rho * 0.785;  // units from a petal's middle line
  const double vein = smooth(0.5 + blur, 0.1, from_middle) +
                      0.5 * smooth(0.6, 1.0, cos_turn((rho + 2.0 * from_middle) / 4.0)) * smooth(8.0, 2.0, from_middle);
  ink = std::max({line(0.4, 0.6, outer), line(0.4, 0.5, inner), 0.6 * flower * (1.0 - flower_inner) * clamp01(vein),
                  line(94.5, 0.8, at.y) * smooth(80.0, 84.0, rho), line(91.0, 0.45, at.y) * smooth(80.0, 84.0, rho)});
  ink = std::max(ink, 0.38 * flower_inner * (1.0 - heart));
  ink = std::max(ink, 0.9 * heart * smooth(0.25, 0.5, seeds.nearest));
  const double dots = 48.0 * turn, dot_x = (dots - std::floor(dots) - 0.5) * rho * 6.2831853 / 48.0,
               dot_y = at.y - 84.0;
  ink =
      std::max(ink, smooth(1.7 + blur, 1.7 - blur, std::sqrt(dot_x * dot_x + dot_y * dot_y)) * smooth(75.0, 80.0, rho));
  return {lift, ink};
}

inline SampleSurface::Vertex BowlSurface::fine(double s, double turn, double edge) const noexcept {
  const ProfilePoint at = profile_point(kProfile, s);
  const Vec3d p = coarse(s, turn), n = surface_normal(*this, s, turn);
  const bool within = at.a > 0.5;
  auto [lift, ink] = within ? inside(p, at, turn, edge) : outside(at, turn, edge);

  // Clay under the glaze: broad unevenness, fine pits.
  lift += 0.10 * noise(p * 0.16, 113) * carried(6.0, edge);
  const CellHit pits = cells(p * 0.5, 114);
  const bool pitted = hash_part(pits.hash, 2) > 0.6;
  if (pitted) lift -= 0.07 * smooth(0.30, 0.05, pits.nearest) * carried(1.2, edge);

  // Cobalt on a bluish white, paler where the brush ran dry; the foot is bare clay.
  const double brush = 0.5 + 0.5 * noise({p.x * 0.16, p.y * 0.35, p.z * 0.16}, 115);
  Vec3d colour = mix(Vec3d{0.900, 0.915, 0.905}, Vec3d{0.850, 0.885, 0.890}, smooth(-0.5, 0.6, noise(p * 0.05, 116)));
  const Vec3d cobalt = mix(Vec3d{0.070, 0.150, 0.420}, Vec3d{0.190, 0.330, 0.620}, brush);
  colour = mix(colour, cobalt, clamp01(ink));
  if (pitted) colour = mix(colour, {0.560, 0.520, 0.440}, 0.6 * smooth(0.18, 0.05, pits.nearest) * carried(1.2, edge));
  const double rim = smooth(99.8, 101.0, at.y);
  colour = mix(colour, {0.620, 0.460, 0.290}, 0.85 * rim);
  const double foot = within ? 0.0 : smooth(41.5, 39.5, at.rho) * smooth(3.4, 2.0, at.y) * smooth(29.0, 31.0, at.rho);
  colour = mix(colour, mix(Vec3d{0.700, 0.520, 0.380}, Vec3d{0.620, 0.430, 0.300}, brush), foot);
  return {p + n * lift, colour};
}

}  // namespace relief::detail
