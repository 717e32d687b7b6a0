// What is painted over the picture: each knows the rectangle that it paints in.
#pragma once

#include "camera_control.h"
#include "widgets/axis_ball.h"

#include <relief/base/unit.h>
#include <relief/core/query.h>

#include <QPainter>
#include <QRectF>
#include <optional>
#include <vector>

namespace relief::studio {

/// How the viewport shows the model now.
struct OverlayView {
  Camera camera;
  QSizeF size;  ///< of the viewport
  Unit unit = Unit::Millimetre;
};

/// A place of the surface; the normal is unit.
struct SurfacePlace {
  Vec3d at, normal;
};
/// A circle that lies on the surface there, as seen; empty where a part of it is behind the eye.
[[nodiscard]] QPolygonF circle(const OverlayView& view, const SurfacePlace& place, double radius);

/// bounds() and paint() take the same way through the same figures, so that nothing is ever left standing.
class Overlay {
 public:
  Overlay() = default;
  Overlay(const Overlay&) = delete;
  Overlay& operator=(const Overlay&) = delete;
  virtual ~Overlay() = default;
  /// Empty where nothing is shown.
  [[nodiscard]] virtual QRectF bounds(const OverlayView& view) const = 0;
  virtual void paint(QPainter& painter, const OverlayView& view) const = 0;
};

/// The brush on the surface: solid for the radius of a dab, dotted for that times strength, faint for the radius that
/// the most pressure gives, a short normal, and a dashed circle at each mirrored place.
class RingOverlay : public Overlay {
 public:
  std::optional<SurfacePlace> place;
  std::vector<SurfacePlace> mirrored;
  double radius = 1, most = 1, strength = 1;  ///< radius: at most `most`
  bool pressed = false;

  [[nodiscard]] QRectF bounds(const OverlayView& view) const override;
  void paint(QPainter& painter, const OverlayView& view) const override;

 private:
  struct Lines {
    QPolygonF radius, most, strength;
    QLineF normal;
    std::vector<QPolygonF> mirrored;
  };
  [[nodiscard]] std::optional<Lines> lines(const OverlayView& view) const;
};

/// The mirror planes, as faint outlines around the model.
class PlaneOverlay : public Overlay {
 public:
  Box3d box;
  Vec3d through;
  unsigned axes = 0;  ///< bit k: the plane whose normal is axis k

  [[nodiscard]] QRectF bounds(const OverlayView& view) const override;
  void paint(QPainter& painter, const OverlayView& view) const override;

 private:
  [[nodiscard]] std::vector<QPolygonF> outlines(const OverlayView& view) const;
};

/// One line in a rounded box, at the upper left corner or beside a place.
class PillOverlay : public Overlay {
 public:
  QString text;
  std::optional<QPointF> beside;  ///< else in the corner
  QFont font;

  [[nodiscard]] QRectF bounds(const OverlayView& view) const override;
  void paint(QPainter& painter, const OverlayView& view) const override;
};

/// The axes at the upper right corner; a click looks along one.
class AxisOverlay : public Overlay {
 public:
  mutable AxisBall ball;

  [[nodiscard]] QRectF bounds(const OverlayView& view) const override;
  void paint(QPainter& painter, const OverlayView& view) const override;
};

/// Paints a line twice, dark and wide beneath, so that it is seen on any clay.
void outlined(QPainter& painter, const QPolygonF& line, const QColor& colour, double width,
              Qt::PenStyle style = Qt::SolidLine);

}  // namespace relief::studio
