#include "camera_control.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relief::studio {

namespace {

/// How near to the pole of a turntable, radians: half a degree.
constexpr double kPole = 0.0087;
/// Distances to the target that zooming keeps to, in diagonals.
constexpr double kNearest = 0.01, kFarthest = 30;

Vec3d turned(Vec3d v, Vec3d axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return v * c + cross(axis, v) * s + axis * (dot(axis, v) * (1 - c));
}

double tan_half(const Camera& camera) { return std::tan(0.5 * camera.field_of_view * std::numbers::pi / 180); }

}  // namespace

PictureAxes picture_axes(const Camera& camera) {
  const Vec3d back = normalized(camera.eye - camera.target);
  Vec3d right = cross(camera.up, back);
  if (length(right) < 1e-9) right = std::abs(back.x) < 0.9 ? cross(Vec3d{1, 0, 0}, back) : cross(Vec3d{0, 1, 0}, back);
  right = normalized(right);
  return {right, cross(back, right), back};
}

double height_at(const Camera& camera, Vec3d point) {
  if (camera.parallel) return camera.view_height;
  return 2 * tan_half(camera) * std::max(1e-9, dot(point - camera.eye, normalized(camera.target - camera.eye)));
}

double height_at_target(const Camera& camera) { return height_at(camera, camera.target); }

Camera orbit(Camera camera, double right, double down, bool turntable) {
  Vec3d arm = camera.eye - camera.target;
  if (!turntable) {
    const PictureAxes axes = picture_axes(camera);
    arm = turned(turned(arm, axes.up, -right), axes.right, -down);
    camera.up = turned(axes.up, axes.right, -down);
    camera.eye = camera.target + arm;
    return camera;
  }
  const Vec3d up = normalized(camera.up);
  const double reach = length(arm), elevation = std::asin(std::clamp(dot(arm, up) / reach, -1.0, 1.0));
  constexpr double kLimit = std::numbers::pi / 2 - kPole;
  const double to = std::clamp(elevation + down, -kLimit, kLimit);
  const Vec3d side = picture_axes(camera).right;
  const Vec3d level = cross(side, up);  // towards the eye, in the plane of the turntable
  camera.eye = camera.target + turned((level * std::cos(to) + up * std::sin(to)) * reach, up, -right);
  return camera;
}

Camera pan(Camera camera, double right, double down) {
  const PictureAxes axes = picture_axes(camera);
  const Vec3d step = (axes.up * down - axes.right * right) * height_at_target(camera);
  camera.eye += step;
  camera.target += step;
  return camera;
}

Camera zoom(Camera camera, double factor, std::optional<Vec3d> keep, double diagonal) {
  const double height = height_at_target(camera);
  const double reach = std::clamp(height * factor, kNearest * diagonal, kFarthest * diagonal);
  factor = reach / height;
  if (camera.parallel) camera.view_height *= factor;
  // The whole camera shrinks towards what is kept, which therefore stays at its pixel.
  const Vec3d fixed = keep.value_or(camera.target);
  camera.eye = fixed + (camera.eye - fixed) * factor;
  camera.target = fixed + (camera.target - fixed) * factor;
  return camera;
}

Camera roll(Camera camera, double radians) {
  const PictureAxes axes = picture_axes(camera);
  camera.up = turned(axes.up, axes.back, radians);
  return camera;
}

Camera look_along(Camera camera, AxisView view, Vec3d up) {
  static constexpr std::array<Vec3d, 6> kBack = {Vec3d{0, 0, 1},  Vec3d{0, 0, -1}, Vec3d{1, 0, 0},
                                                 Vec3d{-1, 0, 0}, Vec3d{0, 1, 0},  Vec3d{0, -1, 0}};
  const double reach = length(camera.eye - camera.target);
  Vec3d back = kBack[static_cast<std::size_t>(view)];
  // From above and below, half a degree off the pole, so that up stays what it is.
  if (back.y != 0) back = normalized(back + Vec3d{0, 0, kPole});
  const Vec3d from = up.z > 0 ? Vec3d{back.x, -back.z, back.y} : back;
  camera.up = up;
  camera.eye = camera.target + from * reach;
  return camera;
}

Camera with_lens(Camera camera, bool parallel) {
  if (parallel == camera.parallel) return camera;
  const double height = height_at_target(camera);
  camera.parallel = parallel;
  if (parallel)
    camera.view_height = height;
  else
    camera.eye = camera.target + normalized(camera.eye - camera.target) * (0.5 * height / tan_half(camera));
  return camera;
}

Camera centred(Camera camera, Vec3d target) {
  camera.eye += target - camera.target;
  camera.target = target;
  return camera;
}

std::optional<QPointF> seen_at(const Camera& camera, Vec3d point, double width, double height) {
  const PictureAxes axes = picture_axes(camera);
  const Vec3d arm = point - camera.eye;
  const double away = -dot(arm, axes.back);
  if (!camera.parallel && away <= 0) return std::nullopt;
  const double half = camera.parallel ? 0.5 * camera.view_height : tan_half(camera) * away;
  const double scale = 0.5 * height / half;
  return QPointF{0.5 * width + dot(arm, axes.right) * scale, 0.5 * height - dot(arm, axes.up) * scale};
}

}  // namespace relief::studio
