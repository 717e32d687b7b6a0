// The torus: a standing ring covered by a plain weave of two colours of cord.
#pragma once

#include "profile.h"
#include "rings.h"

namespace relief::detail {

class TorusSurface final : public SampleSurface {
 public:
  [[nodiscard]] bool closed() const noexcept override { return true; }
  /// s runs around the tube, turn along the ring; the axis is z.
  [[nodiscard]] Vec3d coarse(double s, double turn) const noexcept override {
    const double rho = kRing + kTube * cos_turn(s);
    return {rho * sin_turn(turn), rho * cos_turn(turn), -kTube * sin_turn(s)};
  }
  [[nodiscard]] Vertex fine(double s, double turn, double edge) const noexcept override;

 private:
  static constexpr double kRing = 33.5, kTube = 15.0;
  static constexpr double kAlongRing = 24.0, kAroundTube = 12.0;  ///< even counts close the weave

  /// One family of cords at place `across` (in cords) while `along` counts the crossings of the other family.
  struct Cord {
    double height;  ///< 0 .. 1
    double side;    ///< -1 .. 1 across the cord
    double number;  ///< of the cord; twelve cords of each family wind around the torus, so it counts modulo 12
  };
  [[nodiscard]] static Cord cord(double across, double along, double phase) noexcept {
    const double number = std::floor(across), side = 2.0 * (across - number) - 1.0;
    const double round = std::sqrt(std::max(0.0, 1.0 - 0.94 * side * side));
    return {0.62 * round + 0.38 * cos_turn(0.5 * (along + number) + phase), side, number};
  }
};

inline SampleSurface::Vertex TorusSurface::fine(double s, double turn, double edge) const noexcept {
  const Vec3d p = coarse(s, turn), n = surface_normal(*this, s, turn);
  const double a = kAlongRing * turn + kAroundTube * s, b = kAlongRing * turn - kAroundTube * s;
  // Crossings are counted at the middles of the cords.
  const Cord first = cord(a, b - 0.5, 0.0), second = cord(b, a - 0.5, 0.5);
  const bool over = first.height > second.height;
  const Cord& top = over ? first : second;
  const double along = over ? b : a;
  const double rho = std::sqrt(p.x * p.x + p.y * p.y), size = rho / kRing;  // cords are finer inside the ring

  // A cord is twisted of strands, and a strand of hairs.
  const double slant = 2.5 * along + 0.42 * top.side;
  const double twist = std::sqrt(cos_turn(slant) * cos_turn(slant) + 0.02);
  const double hairs = 0.6 * cos_turn(5.0 * slant + 0.4 * noise(p * 0.8, 101)) + 0.5 * noise(p * 2.6, 102);
  const double gap = std::max(first.height, second.height);
  double lift = 2.1 * std::sqrt(size) * (gap - 0.6) * carried(7.0 * size, edge);
  lift += 0.30 * size * (twist - 0.6) * carried(1.7 * size, edge);
  lift += 0.05 * size * hairs * carried(0.45 * size, edge);

  const double ageing = noise(p * 0.09, 103);
  const auto cycle = [](const Cord& c) { return c.number - 12.0 * std::floor(c.number / 12.0); };
  const auto tone = [&](const Cord& c) {
    return hash_part(hash_cell(static_cast<std::int64_t>(cycle(c)), &c == &first ? 1 : 2, 0, 104), 0);
  };
  const Vec3d dyed = mix(Vec3d{0.060, 0.320, 0.370}, Vec3d{0.130, 0.480, 0.490}, tone(first));
  const Vec3d red = {0.740, 0.270, 0.170},
              plain = mix(Vec3d{0.860, 0.690, 0.400}, Vec3d{0.930, 0.800, 0.560}, tone(second));
  const double seam = 0.03 + 0.09 * edge;  // the colours meet within about an edge
  Vec3d colour = mix(plain, cycle(first) == 0.0 || cycle(first) == 5.0 ? red : dyed,
                     smooth(-seam, seam, first.height - second.height));
  colour = colour * (1.0 + 0.10 * ageing);
  colour = colour * mix(1.0, 0.62 + 0.45 * twist, carried(1.7 * size, edge));
  colour = colour * (1.0 + 0.12 * hairs * carried(0.45 * size, edge));
  colour = colour * mix(0.80, 0.48 + 0.56 * smooth(0.25, 0.85, gap), carried(7.0 * size, edge));
  return {p + n * lift, colour};
}

}  // namespace relief::detail
