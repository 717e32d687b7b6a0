// The six directions of space as seen by the camera, painted over the picture; a click looks along one.
#pragma once

#include <relief/base/vec.h>

#include <QPointF>
#include <QRectF>
#include <QString>
#include <optional>

class QPainter;

namespace relief::studio {

/// The camera's own axes in the model's space, each of length 1 and perpendicular to the others.
struct ViewAxes {
  Vec3d right{1, 0, 0}, up{0, 1, 0};
  Vec3d back{0, 0, 1};  ///< from what is looked at to the eye
};

enum class Axis { X, Y, Z, MinusX, MinusY, MinusZ };
/// The direction of an axis: what the camera looks from when it was clicked.
[[nodiscard]] Vec3d direction(Axis axis);
/// "from the right (+x)", for tool tips.
[[nodiscard]] QString title(Axis axis);

/// Painted and hit within the same square.
class AxisBall {
 public:
  /// Pixels of the square's side at 100 % text.
  static constexpr double kSide = 76;

  /// All that paint() touches.
  [[nodiscard]] QRectF bounds() const { return square_; }
  void set_square(const QRectF& square) { square_ = square; }
  void set_view(const ViewAxes& view) { view_ = view; }
  /// The axis under the mouse, drawn larger.
  void set_hovered(std::optional<Axis> axis) { hovered_ = axis; }
  [[nodiscard]] std::optional<Axis> hovered() const { return hovered_; }

  /// The middle of an axis's disc.
  [[nodiscard]] QPointF position(Axis axis) const;
  /// Of those under the point the one nearest to the eye.
  [[nodiscard]] std::optional<Axis> hit(QPointF point) const;
  void paint(QPainter& painter) const;

 private:
  [[nodiscard]] double disc() const;
  [[nodiscard]] double depth(Axis axis) const { return dot(direction(axis), view_.back); }
  void paint_axis(QPainter& painter, Axis axis) const;

  QRectF square_{0, 0, kSide, kSide};
  ViewAxes view_;
  std::optional<Axis> hovered_;
};

}  // namespace relief::studio
