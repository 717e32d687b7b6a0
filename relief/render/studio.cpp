#include "studio.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relief::detail {

namespace {

constexpr double kPi = std::numbers::pi;

Vec3d any_across(Vec3d d) noexcept {
  const Vec3d axis = std::abs(d.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
  return normalized(cross(d, axis));
}

template <typename Visit>
void for_each_corner(const Box3d& box, Visit&& visit) {
  for (unsigned k = 0; k < 8; ++k)
    visit(Vec3d{(k & 1U) != 0 ? box.high.x : box.low.x, (k & 2U) != 0 ? box.high.y : box.low.y,
                (k & 4U) != 0 ? box.high.z : box.low.z});
}

/// Returns the k-th of an even sequence of points in the unit square (additive recurrence of the plastic number).
std::array<double, 2> even_point(int k) noexcept {
  constexpr double kPlastic = 1.32471795724474602596;
  const auto fraction = [](double x) { return x - std::floor(x); };
  return {fraction(0.5 + (k + 1) / kPlastic), fraction(0.5 + (k + 1) / (kPlastic * kPlastic))};
}

/// A square soft box: direction by azimuth from the eye (positive to the right) and elevation, in radians; half its
/// edge as seen from the model; what it gives to a surface that faces it.
struct SoftBox {
  double azimuth, elevation, half_edge;
  Vec3f colour;
  double share;  ///< of the lights
};
constexpr std::array<SoftBox, 3> kBoxes = {{
    {-0.92, 0.85, 0.34, {1.95F, 1.76F, 1.50F}, 0.42},
    {1.05, 0.42, 0.40, {0.27F, 0.31F, 0.36F}, 0.12},
    {2.75, 0.75, 0.32, {0.62F, 0.65F, 0.70F}, 0.10},
}};
constexpr Vec3f kSky = {0.47F, 0.51F, 0.57F}, kBounce = {0.20F, 0.19F, 0.18F};

}  // namespace

Eye make_eye(const Camera& camera, Vec3d centre, double aspect, const Box3d& seen) {
  Eye eye;
  eye.at = camera.eye - centre;
  eye.forward = normalized(camera.target - camera.eye);
  const Vec3d across = cross(eye.forward, normalized(camera.up));
  eye.right = length(across) > 1e-6 ? normalized(across) : any_across(eye.forward);
  eye.up = cross(eye.right, eye.forward);
  eye.parallel = camera.parallel;
  eye.tan_y = camera.parallel ? 0.5 * camera.view_height : std::tan(camera.field_of_view * kPi / 360);
  eye.tan_x = eye.tan_y * aspect;
  double nearest = Box3d::kFar, farthest = -Box3d::kFar;
  for_each_corner(seen, [&](Vec3d p) {
    const double d = dot(p - eye.at, eye.forward);
    nearest = std::min(nearest, d);
    farthest = std::max(farthest, d);
  });
  const double slack = 0.01 * diagonal(seen);
  if (eye.parallel) {
    eye.near = nearest - slack;
    eye.far = farthest + slack;
    return eye;
  }
  eye.far = std::max(farthest, 0.0) + 2 * slack;
  eye.near = std::max(nearest - slack, 5e-4 * eye.far);
  return eye;
}

Matrix projection(const Eye& eye, const Part& part) {
  // Rows of clip = P * (p - at); the part is stretched over the whole of clip space.
  const double sx = 1 / (part.x1 - part.x0), sy = 1 / (part.y1 - part.y0);
  const double ox = (1 - part.x0 - part.x1) * sx, oy = (1 - part.y0 - part.y1) * sy;
  if (eye.parallel) {
    const double depth = 2 / (eye.far - eye.near);
    const std::array<Vec3d, 3> rows = {eye.right * (sx / eye.tan_x), eye.up * (sy / eye.tan_y), eye.forward * depth};
    const std::array<double, 3> beside = {ox, oy, -0.5 * (eye.far + eye.near) * depth};
    Matrix m{};
    for (std::size_t r = 0; r < 3; ++r) {
      for (std::size_t c = 0; c < 3; ++c) m[c * 4 + r] = static_cast<float>(rows[r][c]);
      m[12 + r] = static_cast<float>(beside[r] - dot(rows[r], eye.at));
    }
    m[15] = 1;
    return m;
  }
  const Vec3d x = eye.right * (sx / eye.tan_x) + eye.forward * ox, y = eye.up * (sy / eye.tan_y) + eye.forward * oy;
  const double a = (eye.far + eye.near) / (eye.far - eye.near), b = -2 * eye.far * eye.near / (eye.far - eye.near);
  const std::array<Vec3d, 4> rows = {x, y, eye.forward * a, eye.forward};
  Matrix m{};
  for (std::size_t r = 0; r < 4; ++r) {
    for (std::size_t c = 0; c < 3; ++c) m[c * 4 + r] = static_cast<float>(rows[r][c]);
    m[12 + r] = static_cast<float>(-dot(rows[r], eye.at) + (r == 2 ? b : 0));
  }
  return m;
}

FloorAxes floor_axes(const Eye& eye, Vec3d up) {
  FloorAxes frame;
  frame.up = normalized(up);
  // Seen from straight above or below, the eye's own up takes the place of the way it looks.
  const Vec3d flat = eye.forward - frame.up * dot(eye.forward, frame.up);
  const Vec3d ahead = length(flat) > 1e-3 ? flat : eye.up - frame.up * dot(eye.up, frame.up);
  frame.back = length(ahead) > 1e-9 ? -normalized(ahead) : any_across(frame.up);
  frame.right = cross(frame.up, frame.back);
  return frame;
}

Studio make_studio(int count, const Eye& eye, Vec3d up) {
  const FloorAxes f = floor_axes(eye, up);
  Studio studio;
  std::array<int, kBoxes.size()> numbers{};
  int left = count;
  for (std::size_t b = 0; b < kBoxes.size(); ++b) {
    numbers[b] = std::min(left, std::max(1, static_cast<int>(std::lround(count * kBoxes[b].share))));
    left -= numbers[b];
  }
  // Too few for a sky serve the first box better.
  const bool sky = left >= 6;
  if (!sky) numbers[0] += left;
  for (std::size_t b = 0; b < kBoxes.size(); ++b) {
    const SoftBox& box = kBoxes[b];
    const int number = numbers[b];
    const Vec3d flat = f.back * std::cos(box.azimuth) + f.right * std::sin(box.azimuth);
    const Vec3d middle = flat * std::cos(box.elevation) + f.up * std::sin(box.elevation);
    const Vec3d across = normalized(cross(f.up, middle)), over = cross(middle, across);
    for (int k = 0; k < number; ++k) {
      const auto [s, t] = number == 1 ? std::array<double, 2>{0.5, 0.5} : even_point(k);
      const Vec3d d = middle + across * ((2 * s - 1) * box.half_edge) + over * ((2 * t - 1) * box.half_edge);
      studio.lights.push_back({normalized(d), box.colour * (1.0F / static_cast<float>(number)), true,
                               1.3 * box.half_edge / std::sqrt(number)});
    }
  }
  if (!sky) {
    studio.sky = kSky * 0.75F;
    studio.ground = kBounce * 0.75F;
    return studio;
  }
  // The sky, and the light that comes back from the floor: directions spread evenly over the part of the sphere above
  // -40 degrees, each with the mean of what lies around it.
  const double lowest = -0.64;
  std::vector<Light> dome;
  double from_above = 0;
  for (int k = 0; k < left; ++k) {
    const double y = 1 - (1 - lowest) * (k + 0.5) / left, turn = 2 * kPi * k * 0.61803398874989484820;
    const double flat = std::sqrt(std::max(0.0, 1 - y * y));
    const Vec3d d = f.right * (flat * std::cos(turn)) + f.back * (flat * std::sin(turn)) + f.up * y;
    const auto above = static_cast<float>(std::clamp(0.5 + 1.2 * y, 0.0, 1.0));
    dome.push_back({d, kSky * above + kBounce * (1 - above), false, 1.1 * std::sqrt(2 * (1 - lowest) / left)});
    from_above += std::max(0.0, y) * static_cast<double>(above);
  }
  for (Light& light : dome) {
    light.colour *= static_cast<float>(1 / from_above);
    studio.lights.push_back(light);
  }
  studio.sky = kSky * 0.04F;
  studio.ground = kBounce * 0.25F;
  return studio;
}

ShadowView make_shadow_view(Vec3d towards, const Box3d& box, int resolution) {
  const Vec3d a = any_across(towards), b = cross(towards, a);
  const std::array<Vec3d, 3> axes = {a, b, -towards};
  std::array<double, 3> low{}, high{};
  low.fill(Box3d::kFar);
  high.fill(-Box3d::kFar);
  for_each_corner(box, [&](Vec3d p) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], dot(axes[k], p));
      high[k] = std::max(high[k], dot(axes[k], p));
    }
  });
  ShadowView view{};
  const double margin = 0.02 * diagonal(box) + 1e-30;
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] -= margin;
    high[k] += margin;
    const double scale = 1 / (high[k] - low[k]);
    const Vec3f row = to_float(axes[k] * scale);
    view.rows[k] = {row.x, row.y, row.z, static_cast<float>(-low[k] * scale)};
  }
  view.texel = static_cast<float>(std::max(high[0] - low[0], high[1] - low[1]) / resolution);
  view.depth = static_cast<float>(high[2] - low[2]);
  return view;
}

}  // namespace relief::detail
