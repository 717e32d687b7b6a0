// The head: a stylised bust, built as a blend of simple solids and met by rays from a line inside it.
#pragma once

#include "profile.h"
#include "rings.h"

namespace relief::detail {

class HeadSurface final : public SampleSurface {
 public:
  [[nodiscard]] Status prepare(SampleProgress& progress) override;
  [[nodiscard]] Vec3d coarse(double s, double turn) const noexcept override;
  /// Returns the features of the face deserve smaller triangles.
  [[nodiscard]] double weight(Vec3d p) const noexcept override {
    return 1.0 + 0.7 * bell(p.x, 17.0) * bell(p.y - 53.0, 17.0) * smooth(4.0, 18.0, p.z);
  }
  [[nodiscard]] Vertex fine(double s, double turn, double edge) const noexcept override;

 private:
  struct Ray {
    Vec3d origin, direction;
  };
  /// Signed distances, below 0 inside, roughly in units; `open` is below 0 between the lids, `fringe` on the hair's
  /// side.
  struct Field {
    double all, hair, fringe, eyes, open;
  };
  [[nodiscard]] static Ray ray(double s, double turn) noexcept;
  [[nodiscard]] static Field field(Vec3d p) noexcept;
  [[nodiscard]] static Vec3d normal_at(Vec3d p) noexcept;
  [[nodiscard]] static Vec3d skin_colour(Vec3d p, double edge) noexcept;
  /// White, iris, pupil; `open` as in Field, edges softened by `blur` units.
  [[nodiscard]] static Vec3d eye_colour(Vec3d p, double open, double blur) noexcept;
  /// Height of the locks of hair at p, 0 .. 1, and the place in the hair: turns around the whorl, way from it (0 .. 1).
  [[nodiscard]] static double locks(Vec3d p, double& across, double& along) noexcept;
  /// Distance along the ray to the outermost crossing that lies below `start`.
  [[nodiscard]] static double crossing(const Ray& ray, double start) noexcept;

  static constexpr std::size_t kRows = 192, kColumns = 256;
  static constexpr double kFarthest = 66.0;  ///< no part of the head is farther from a ray's start
  [[nodiscard]] static std::size_t at(std::size_t row, std::size_t column) noexcept {
    return row * (kColumns + 1) + column;
  }
  struct Near {
    double between, most;
  };
  /// Returns the crossing's distance as interpolated from a grid of rays, and the largest of the four around it.
  [[nodiscard]] Near near(double s, double turn) const noexcept;
  std::vector<double> reach_;

  [[nodiscard]] static double join(double a, double b, double k) noexcept {
    const double h = std::max(k - std::abs(a - b), 0.0) / k;
    return std::min(a, b) - h * h * k * 0.25;
  }
  [[nodiscard]] static double common(double a, double b, double k) noexcept { return -join(-a, -b, k); }
  [[nodiscard]] static double ellipsoid(Vec3d p, Vec3d centre, Vec3d radii) noexcept {
    const Vec3d d = p - centre, q = {d.x / radii.x, d.y / radii.y, d.z / radii.z};
    const Vec3d g = {q.x / radii.x, q.y / radii.y, q.z / radii.z};
    const double l = length(q), m = length(g);
    return m > 1e-9 ? l * (l - 1.0) / m : -std::min({radii.x, radii.y, radii.z});
  }
  /// Returns a rod whose radius runs from ra at a to rb at b.
  [[nodiscard]] static double rod(Vec3d p, Vec3d a, Vec3d b, double ra, double rb) noexcept {
    const double t = clamp01(dot(p - a, b - a) / dot(b - a, b - a));
    return length(p - mix(a, b, t)) - mix(ra, rb, t);
  }
};

inline HeadSurface::Ray HeadSurface::ray(double s, double turn) noexcept {
  // Latitude from the middle of the base to the crown; the start slides up from the base into the head.
  const double latitude = 0.25 - 0.5 * s;  // turns, downwards positive
  const double up = -sin_turn(latitude), out = cos_turn(latitude);
  const double slide = smooth(0.0, 0.52, s);
  const Vec3d origin = {0.0, mix(4.0, 60.0, slide), mix(-6.0, 0.0, slide)};
  return {origin, {out * sin_turn(turn + 0.5), up, out * cos_turn(turn + 0.5)}};
}

inline double HeadSurface::locks(Vec3d p, double& across, double& along) noexcept {
  // Hair grows from a whorl at the back of the crown and falls to all sides with a slight swirl.
  const Vec3d c = p - Vec3d{2.0, 72.0, -6.0};
  const Vec3d axis = {0.06, 0.90, -0.43};
  const double up = dot(c, axis);
  const Vec3d flat = c - axis * up;
  const double radius = length(flat);
  along = angle_turn(radius, up) * 2.0;  // 0 at the whorl, 1 opposite
  const double swirl = 0.10 * along + 0.022 * sin_turn(1.7 * along + noise(p * 0.03, 71));
  across = angle_turn(flat.x, flat.z) + swirl;
  const double wave = cos_turn(11.0 * across + 0.25 * sin_turn(5.0 * across + 1.3 * along));
  return std::sqrt(wave * wave + 0.025) * smooth(0.03, 0.25, along);
}

inline HeadSurface::Field HeadSurface::field(Vec3d p) noexcept {
  const Vec3d q = {std::sqrt(p.x * p.x + 0.01), p.y, p.z};  // both sides are alike
  Field f = {};

  // Skull, face, cheeks, jaw, chin, the ground of the mouth.
  double d = ellipsoid(p, {0.0, 70.0, -4.0}, {25.5, 27.0, 27.5});
  d = join(d, ellipsoid(p, {0.0, 53.0, 5.5}, {20.5, 23.5, 19.5}), 10.0);
  d = join(d, ellipsoid(q, {10.5, 49.5, 13.5}, {9.0, 8.5, 9.0}), 7.0);
  d = join(d, ellipsoid(p, {0.0, 34.5, 15.0}, {8.5, 6.5, 8.0}), 9.0);
  d = join(d, ellipsoid(p, {0.0, 41.0, 16.5}, {10.0, 7.5, 8.0}), 6.0);
  // Neck, flaring into an oval foot.
  const Vec3d n = {p.x * 0.92, p.y, (p.z + 7.0 - 0.06 * p.y) * 1.10};
  d = join(d, rod(n, {0.0, 0.0, 0.0}, {0.0, 52.0, 0.0}, 13.0, 11.5), 6.0);
  d = join(d, rod(n, {0.0, -3.0, 0.0}, {0.0, 52.0, 0.0}, 26.0, -7.0) * 0.85, 10.0);

  const bool front = p.z > 6.0 && p.y > 26.0 && p.y < 80.0, side = q.x > 12.0 && p.y > 38.0 && p.y < 78.0;
  f.eyes = f.open = 9.0;
  if (front) {
    // Brow, sockets.
    d = join(d, rod(q, {4.5, 68.5, 22.0}, {14.0, 70.0, 18.0}, 2.2, 1.6), 5.5);
    d = -join(-d, ellipsoid(q, {9.8, 60.8, 27.6}, {8.6, 5.6, 5.4}), 5.0);

    // Nose: bridge, tip, wings, shallow nostrils, the groove below.
    d = join(d, rod(p, {0.0, 65.0, 21.6}, {0.0, 51.5, 28.8}, 2.0, 2.7), 4.5);
    d = join(d, ellipsoid(p, {0.0, 50.0, 29.0}, {3.5, 3.1, 3.5}), 2.5);
    d = join(d, ellipsoid(q, {3.6, 48.9, 26.0}, {2.4, 2.3, 3.0}), 2.0);
    d = -join(-d, ellipsoid(q, {1.8, 46.7, 27.9}, {1.1, 1.0, 1.6}), 1.8);
    d = -join(-d, rod(p, {0.0, 46.0, 27.2}, {0.0, 43.6, 27.0}, 0.8, 0.9), 2.5);

    // Lips: a bow above, a fuller one below, the corners drawn up and back.
    const Vec3d m = {p.x, p.y - 0.018 * q.x * q.x, p.z + 0.031 * q.x * q.x};
    const Vec3d mq = {q.x, m.y, m.z};
    double lips = rod(mq, {1.6, 41.3, 24.3}, {7.4, 39.9, 24.5}, 1.6, 0.85);
    lips = join(lips, ellipsoid(m, {0.0, 40.8, 24.6}, {1.8, 1.2, 1.6}), 1.5);
    const double lower = join(ellipsoid(m, {0.0, 37.8, 24.0}, {5.4, 1.9, 2.3}),
                              rod(mq, {2.0, 38.2, 24.2}, {7.4, 39.6, 24.5}, 1.55, 0.75), 1.5);
    d = join(d, join(lips, lower, 0.4), 1.5);
    d = -join(-d, rod(mq, {0.0, 39.72, 26.5}, {7.9, 39.8, 26.0}, 0.32, 0.28), 1.1);
  }
  if (side) {
    // Ears: a tilted shell close to the head, a raised helix, a shallow bowl.
    const Vec3d e = {q.x - 23.0 + 0.30 * (p.z + 2.5) - 0.08 * (p.y - 57.0), p.y - 57.5,
                     p.z + 2.5 + 0.20 * (p.y - 57.5)};
    double ear = ellipsoid(e, {0.0, 0.0, 0.0}, {2.7, 9.0, 5.6});
    const double ring = std::sqrt(e.y * e.y * 0.40 + e.z * e.z) - 4.4;
    const double rim = std::sqrt(ring * ring + (e.x - 2.0) * (e.x - 2.0)) - 1.05;
    ear = join(ear, rim + 0.9 * smooth(-2.0, -7.0, e.y), 1.6);
    ear = join(ear, ellipsoid(e, {0.9, -7.4, 1.6}, {2.0, 2.9, 2.5}), 2.2);
    ear = join(ear, ellipsoid(e, {1.0, -1.6, 4.2}, {1.5, 1.9, 1.2}), 1.4);
    ear = -join(-ear, ellipsoid(e, {3.8, 0.6, 0.2}, {3.6, 5.2, 2.9}), 1.2);
    d = join(d, ear, 3.0);
  }

  if (front) {
    // Eyes: balls under lids that are cut open along an almond.
    const Vec3d r = q - Vec3d{9.8, 60.4, 15.6};
    f.eyes = length(r) - 8.2;
    const double along = (r.x - 0.2) / 6.7, arch = 1.0 - along * along, level = r.y - 0.09 * r.x + 0.3;
    f.open = std::max(level - 3.9 * arch, -level - 2.9 * arch) * 0.8;
    const double lids = common(length(r) - 9.05, -f.open, 0.7);
    d = join(d, lids, 1.6);
    d = join(d, f.eyes, 0.3);
  }

  // Hair: a cap from the forehead past the ears to the nape, its edge cut by the locks.
  f.hair = f.fringe = 4.0;
  double cap = ellipsoid(p, {0.0, 71.0, -5.5}, {27.0, 28.7, 28.8});
  cap = join(cap, ellipsoid(p, {0.0, 54.0, -10.0}, {21.0, 20.0, 14.0}), 9.0) + 4.5 * smooth(58.0, 40.0, p.y);
  if (cap < 4.0) {
    double across = 0.0, lengthwise = 0.0;
    const double lock = locks(p, across, lengthwise);
    const double fringe =
        80.0 + 0.3 * q.x * smooth(0.0, 9.0, q.x) * (1.0 - smooth(6.0, 20.0, q.x)) - 12.0 * smooth(8.0, 24.0, q.x);
    const double temple = mix(66.5, 38.0, smooth(-6.0, -15.0, p.z));
    const double line = mix(fringe, temple, smooth(11.0, -6.0, p.z)) - 2.6 * (lock - 0.6);
    f.fringe = line - p.y;
    f.hair = common(cap - 0.95 * (lock - 0.5), (line - p.y) * mix(0.7, 0.45, smooth(60.0, 45.0, p.y)),
                    mix(2.2, 5.0, smooth(60.0, 45.0, p.y)));
    d = join(d, f.hair, 1.1);
  }
  f.all = common(d, -p.y, 3.0);  // everything stands on a plane
  return f;
}

inline Status HeadSurface::prepare(SampleProgress& progress) {
  reach_.resize((kRows + 1) * (kColumns + 1));
  for (std::size_t i = 0; i <= kRows; ++i) {
    RELIEF_CHECK(progress.reach(SampleProgress::kPrepared * double(i) / double(kRows + 1)));
    for (std::size_t j = 0; j <= kColumns; ++j) {
      const bool first = i == 0 || j == 0;
      const double before = first ? kFarthest : std::max(reach_[at(i - 1, j)], reach_[at(i, j - 1)]) + 1.5;
      reach_[at(i, j)] = crossing(ray(double(i) / kRows, double(j) / kColumns), std::min(before, kFarthest));
    }
  }
  return {};
}

inline double HeadSurface::crossing(const Ray& ray, double start) noexcept {
  const auto value_at = [&](double distance) { return field(ray.origin + ray.direction * distance).all; };
  // March in from outside with the field as step, then close in on the crossing between the last two places.
  double outside = start, value = value_at(outside);
  while (value <= 0.0 && outside < kFarthest) value = value_at(outside += 2.0);
  double inside = outside, below = value;
  for (int k = 0; k < 200 && below > 0.0 && inside > 0.5; ++k) {
    outside = inside;
    value = below;
    inside = std::max(0.5, outside - std::max(0.30, 0.85 * value));
    below = value_at(inside);
  }
  for (int k = 0; k < 16 && outside - inside > 1e-9; ++k) {
    const double middle = mix(outside, inside, std::clamp(value / (value - below), 0.02, 0.98)),
                 here = value_at(middle);
    if (std::abs(here) < 1e-7) return middle;
    if (here > 0.0) {
      outside = middle;
      value = here;
    } else {
      inside = middle;
      below = here;
    }
  }
  return value < -below ? outside : inside;
}

inline HeadSurface::Near HeadSurface::near(double s, double turn) const noexcept {
  const double row = clamp01(s) * kRows, column = (turn - std::floor(turn)) * kColumns;
  const std::size_t i = std::min(static_cast<std::size_t>(row), kRows - 1),
                    j = std::min(static_cast<std::size_t>(column), kColumns - 1);
  const double a = reach_[at(i, j)], b = reach_[at(i, j + 1)], c = reach_[at(i + 1, j)], d = reach_[at(i + 1, j + 1)];
  return {mix(mix(a, b, column - double(j)), mix(c, d, column - double(j)), row - double(i)), std::max({a, b, c, d})};
}

inline Vec3d HeadSurface::coarse(double s, double turn) const noexcept {
  const Ray r = ray(s, turn);
  return r.origin + r.direction * near(s, turn).between;
}

inline Vec3d HeadSurface::normal_at(Vec3d p) noexcept {
  constexpr double kStep = 0.05;
  Vec3d sum;
  for (const Vec3d corner :
       {Vec3d{1.0, -1.0, -1.0}, Vec3d{-1.0, 1.0, -1.0}, Vec3d{-1.0, -1.0, 1.0}, Vec3d{1.0, 1.0, 1.0}})
    sum += corner * field(p + corner * kStep).all;
  return normalized(sum);
}

inline Vec3d HeadSurface::skin_colour(Vec3d p, double edge) noexcept {
  const double x = std::abs(p.x);
  Vec3d colour = mix(Vec3d{0.885, 0.685, 0.560}, Vec3d{0.930, 0.750, 0.630}, smooth(-0.5, 0.5, noise(p * 0.07, 87)));
  const double front = smooth(4.0, 14.0, p.z);
  const double blush = front * (bell(x - 13.5, 6.5) * bell(p.y - 50.0, 5.5) +
                                0.7 * bell(x, 4.0) * bell(p.y - 50.0, 3.5) * smooth(24.0, 30.0, p.z) +
                                0.35 * bell(x, 6.0) * bell(p.y - 31.0, 4.0)) +
                       0.6 * smooth(22.5, 25.5, x) * bell(p.y - 57.0, 9.0);
  colour = mix(colour, {0.880, 0.500, 0.420}, 0.50 * clamp01(blush));
  colour = mix(colour, {0.760, 0.540, 0.430}, front * 0.35 * bell(x - 10.0, 7.0) * bell(p.y - 65.0, 3.0));
  const CellHit freckles = cells(p * 0.75, 88);
  const double freckled =
      front * bell(x - 8.0, 8.0) * bell(p.y - 52.5, 3.5) * smooth(0.30, 0.18, freckles.nearest) * carried(1.2, edge);
  return mix(colour, {0.700, 0.450, 0.330}, 0.45 * freckled);
}

inline Vec3d HeadSurface::eye_colour(Vec3d p, double open, double blur) noexcept {
  // White, iris, pupil, a catch-light.
  const double gaze_x = std::abs(p.x) - 9.5, gaze_y = p.y - 60.4, gaze = std::sqrt(gaze_x * gaze_x + gaze_y * gaze_y);
  Vec3d ball = mix(Vec3d{0.960, 0.950, 0.930}, Vec3d{0.860, 0.740, 0.710}, smooth(4.0, 7.0, gaze));
  const double rays = noise({gaze_x / (gaze + 0.2) * 5.0, gaze_y / (gaze + 0.2) * 5.0, gaze * 0.4}, 89);
  Vec3d iris = mix(Vec3d{0.420, 0.300, 0.130}, Vec3d{0.270, 0.430, 0.350}, smooth(1.5, 2.9, gaze));
  iris = mix(iris, {0.640, 0.640, 0.420}, 0.45 * smooth(-0.1, 0.6, rays));
  iris = mix(iris, {0.080, 0.120, 0.110}, smooth(2.75, 3.45, gaze));
  ball = mix(ball, iris, smooth(3.5 + blur, 3.5 - blur, gaze));
  ball = mix(ball, {0.030, 0.025, 0.025}, smooth(1.55 + blur, 1.55 - blur, gaze));
  const double glint_x = p.x - (p.x > 0.0 ? 9.5 : -9.5) + 1.2, glint_y = gaze_y - 1.3;
  ball = mix(ball, {1.0, 1.0, 1.0}, smooth(0.75 + blur, 0.75 - blur, std::sqrt(glint_x * glint_x + glint_y * glint_y)));
  return mix(ball, ball * 0.55, smooth(-1.3, 0.0, open) * smooth(-1.0, 2.0, gaze_y));  // shade of the lid
}

inline SampleSurface::Vertex HeadSurface::fine(double s, double turn, double mean_edge) const noexcept {
  const Ray r = ray(s, turn);
  const Vec3d p = r.origin + r.direction * crossing(r, near(s, turn).most + 0.8);
  const double edge = mean_edge / weight(p);
  const Field f = field(p);
  const double x = std::abs(p.x), blur = std::max(0.14, 0.8 * edge);

  const double hair = smooth(0.30 + blur, -0.10, f.hair);
  const double eye = p.z > 10.0 ? smooth(blur, -blur, f.open) * smooth(1.5, 0.6, f.eyes) * (1.0 - hair) : 0.0;
  // The lips' red: a bow above the line of the mouth, a fuller curve below it.
  const double span = clamp01(1.0 - p.x * p.x / 68.0), mouth = p.y - 0.018 * p.x * p.x - 39.75;
  const double reach =
      mouth > 0.0 ? std::sqrt(span) * (2.5 - 0.55 * bell(x, 0.9) + 0.35 * bell(x - 2.0, 1.4)) : 3.7 * span;
  const double rise = p.z > 12.0 ? smooth(0.0, 1.2, reach - std::abs(mouth)) : 0.0;
  const double lips =
      p.z > 12.0 ? smooth(-0.2 - 0.5 * blur, 0.3 + 0.5 * blur, reach - std::abs(mouth)) * smooth(8.2, 7.2, x) : 0.0;
  const double skin = (1.0 - hair) * (1.0 - eye);
  double lift = 0.0;

  // Skin: faint unevenness and pores; lips with fine upright furrows.
  const CellHit pores = cells(p * 1.05, 81);
  lift += skin * (1.0 - lips) *
          (0.03 * noise(p * 0.55, 82) * carried(1.8, edge) -
           0.022 * (1.0 - smooth(0.05, 0.45, pores.nearest)) * carried(0.9, edge));
  lift +=
      0.5 * rise * smooth(0.0, 0.9, std::abs(mouth)) * smooth(1.0, 4.5, x) * smooth(7.8, 5.5, x) * carried(3.0, edge);
  lift += lips * 0.06 * noise({p.x * 1.9, p.y * 0.35, 0.5}, 83) * carried(0.7, edge);

  // Brows: tufts of short hairs over the ridge of the brow.
  const double brow_line = 68.6 + 0.36 * (x - 4.0) - 0.030 * (x - 4.0) * (x - 4.0);
  const double brow_half = 1.25 * smooth(3.0, 5.5, x) * smooth(17.5, 9.0, x) + 0.001;
  const double side = p.x > 0.0 ? 1.0 : -1.0;
  const double brow_hairs = noise({(p.x * 0.75 - side * p.y * 0.75) * 1.5, (p.x * side + p.y) * 0.25, 0.0}, 84);
  const double brow = p.z > 8.0
                          ? smooth(1.25 + 0.5 * edge, 0.55 - 0.2 * edge,
                                   std::abs(p.y - brow_line) / brow_half + 0.2 * brow_hairs * carried(0.8, edge)) *
                                (1.0 - hair) * smooth(3.2, 4.4, x) * smooth(0.15, 0.6, brow_half)
                          : 0.0;
  lift += brow * carried(2.2, edge) * (0.38 + 0.16 * brow_hairs * carried(0.8, edge));

  // Hair: strands in the locks.
  double across = 0.0, lengthwise = 0.0;
  const double lock = locks(p, across, lengthwise);
  const double spread = smooth(0.08, 0.28, lengthwise);
  const auto strands = [&](double count, double period, std::uint32_t seed) {
    const double angle = across + 0.006 * sin_turn(2.0 * lengthwise + 4.0 * across);
    return noise({cos_turn(angle) * count / 6.2831853, sin_turn(angle) * count / 6.2831853, lengthwise * period}, seed);
  };
  const double coarse_strands = strands(90.0, 3.0, 85), fine_strands = strands(230.0, 5.0, 86);
  lift += hair * spread * smooth(0.3, -2.2, f.fringe) * smooth(0.12, 0.55, lock) *
          (0.34 * coarse_strands * carried(1.7, edge) + 0.15 * fine_strands * carried(0.75, edge));

  Vec3d colour = skin_colour(p, edge);
  colour = mix(colour, {0.770, 0.420, 0.390}, 0.80 * lips);
  colour =
      mix(colour, {0.470, 0.190, 0.180}, 0.7 * lips * carried(1.6, edge) * smooth(0.45, 0.05, std::abs(mouth + 0.05)));
  const double lash = p.z > 10.0 ? smooth(0.45 + blur, 0.25, std::abs(f.open - 0.1)) * smooth(1.6, 1.0, f.eyes) *
                                       (1.0 - hair) * mix(0.6, 1.0, carried(1.8, edge))
                                 : 0.0;
  colour = mix(colour, eye_colour(p, f.open, blur), eye);
  colour = mix(colour, {0.160, 0.095, 0.070}, lash * (p.y - 60.4 > 0.0 ? 0.9 : 0.35));
  colour = mix(colour, {0.270, 0.165, 0.100}, 0.9 * brow * (0.85 + 0.15 * brow_hairs));
  Vec3d locks_colour = mix(Vec3d{0.190, 0.105, 0.060}, Vec3d{0.400, 0.235, 0.125}, smooth(0.15, 1.0, lock));
  locks_colour = mix(locks_colour, {0.560, 0.360, 0.190}, 0.55 * smooth(0.0, 0.8, coarse_strands) * spread);
  locks_colour = locks_colour * (1.0 + 0.18 * fine_strands * carried(0.75, edge));
  colour = mix(colour, locks_colour, hair);
  const Vec3d slate =
      mix(Vec3d{0.250, 0.310, 0.360}, Vec3d{0.330, 0.400, 0.450}, smooth(-0.4, 0.4, noise(p * 0.3, 90)));
  colour = mix(colour, slate, smooth(9.5 + blur, 9.5 - blur, p.y));
  // The foot: a collar with ribs.
  const double ribs = smooth(9.5, 8.5, p.y) * smooth(1.5, 2.5, p.y) * cos_turn(48.0 * turn) * carried(2.4, edge);
  lift += 0.5 * smooth(9.8 + 0.5 * blur, 9.2 - 0.5 * blur, p.y) + 0.22 * ribs;
  return {p + normal_at(p) * lift, colour};
}

}  // namespace relief::detail
