// How a hand moves the camera: pure arithmetic.
#pragma once

#include <relief/render/frame.h>

#include <QPointF>
#include <numbers>
#include <optional>

namespace relief::studio {

/// In a radian.
inline constexpr double kDegrees = 180 / std::numbers::pi;

/// An axis of the model, with a sign.
enum class AxisView : std::uint8_t { Front, Back, Right, Left, Top, Bottom };

/// Turns the camera around its target: `right` and `down` are radians. Turntable: the up axis stays up, the camera
/// never goes over the pole. Else a trackball around the picture's own axes.
[[nodiscard]] Camera orbit(Camera camera, double right, double down, bool turntable);
/// Moves eye and target together by shares of the picture's height.
[[nodiscard]] Camera pan(Camera camera, double right, double down);
/// Goes nearer (factor < 1) or farther; the point `keep`, where given, stays where it is in the picture.
[[nodiscard]] Camera zoom(Camera camera, double factor, std::optional<Vec3d> keep, double diagonal);
/// Turns the picture around its middle.
[[nodiscard]] Camera roll(Camera camera, double radians);
/// Looks along an axis at the same target from the same distance. `up` is the axis that points up in the model, y or z.
[[nodiscard]] Camera look_along(Camera camera, AxisView view, Vec3d up);
/// The same picture at the target, with or without perspective.
[[nodiscard]] Camera with_lens(Camera camera, bool parallel);
/// Moves the target, so that the camera turns around it, and looks at it.
[[nodiscard]] Camera centred(Camera camera, Vec3d target);
/// What the picture's height is where a point is, model units.
[[nodiscard]] double height_at(const Camera& camera, Vec3d point);
/// The same at the target.
[[nodiscard]] double height_at_target(const Camera& camera);
/// Unit axes of the picture: right, up, and towards the eye.
struct PictureAxes {
  Vec3d right, up, back;
};
[[nodiscard]] PictureAxes picture_axes(const Camera& camera);
/// Where a point is in a picture of the given size, pixels from the upper left corner; empty behind the eye.
[[nodiscard]] std::optional<QPointF> seen_at(const Camera& camera, Vec3d point, double width, double height);

}  // namespace relief::studio
