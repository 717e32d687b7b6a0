// Fingers on the viewport, and gestures of a trackpad.
#include "viewport.h"

#include <QNativeGestureEvent>
#include <QTouchEvent>
#include <cmath>

namespace relief::studio {

namespace {

/// How far three fingers may move in a tap, pixels.
constexpr double kTapReach = 20;
/// How long it may take, ms.
constexpr qint64 kTapTime = 350;

struct Fingers {
  QPointF middle;
  double spread = 0;  ///< mean distance from the middle
  double turn = 0;    ///< radians, of the second finger around the first
};

/// Of the places that `place` gives of the points, at least one.
Fingers fingers_of(const QList<QEventPoint>& points, QPointF (QEventPoint::*place)() const) {
  Fingers fingers;
  const auto count = static_cast<double>(points.size());
  for (const QEventPoint& point : points) fingers.middle += (point.*place)() / count;
  for (const QEventPoint& point : points) fingers.spread += QLineF(fingers.middle, (point.*place)()).length() / count;
  if (points.size() > 1) {
    const QPointF arm = (points[1].*place)() - (points[0].*place)();
    fingers.turn = std::atan2(arm.y(), arm.x());
  }
  return fingers;
}

}  // namespace

/// One finger turns the camera, or sculpts where it was told to; two shift, zoom and roll; a tap of three undoes.
/// While a pen is down, fingers do nothing: they are the hand that holds it.
bool Viewport::touch(QTouchEvent* event) {
  event->accept();
  if (pen_down_ || !has_scene()) return true;
  const QList<QEventPoint>& points = event->points();
  if (event->type() == QEvent::TouchBegin) {
    touch_clock_.start();
    most_fingers_ = 0;
    touch_moved_ = false;
  }
  most_fingers_ = std::max(most_fingers_, points.size());
  for (const QEventPoint& point : points)
    touch_moved_ = touch_moved_ || QLineF(point.pressPosition(), point.position()).length() > kTapReach;
  if (event->type() == QEvent::TouchEnd || event->type() == QEvent::TouchCancel) {
    if (gesture_ == Gesture::Stroke) release();
    if (most_fingers_ == 3 && !touch_moved_ && touch_clock_.elapsed() < kTapTime) emit undoAsked();
    return true;
  }
  const double scale = std::max(1, height());
  if (points.size() == 1 && most_fingers_ == 1) {
    const QEventPoint& finger = points.first();
    const PointerSample sample{finger.position(), 1e-3 * static_cast<double>(event->timestamp()), 1};
    if (touch_sculpts_ && finger.state() == QEventPoint::Pressed && hit(sample.at)) {
      press(Gesture::Stroke, sample, {}, false);
    } else if (gesture_ == Gesture::Stroke) {
      move(sample);
    } else {
      const QPointF by = finger.position() - finger.lastPosition();
      set_camera(orbit(camera_, 4.5 * by.x() / scale, 4.5 * by.y() / scale, turntable_));
    }
    return true;
  }
  if (gesture_ == Gesture::Stroke) {
    stroke_.cancel();
    gesture_ = Gesture::None;
  }
  if (points.size() < 2) return true;
  const Fingers now = fingers_of(points, &QEventPoint::position), then = fingers_of(points, &QEventPoint::lastPosition);
  Camera camera = pan(camera_, (now.middle.x() - then.middle.x()) / scale, (now.middle.y() - then.middle.y()) / scale);
  if (now.spread > 0 && then.spread > 0) camera = zoom(camera, then.spread / now.spread, std::nullopt, diagonal_);
  if (!turntable_) camera = roll(camera, now.turn - then.turn);
  set_camera(camera);
  return true;
}

bool Viewport::trackpad(QNativeGestureEvent* event) {
  if (!has_scene()) return false;
  if (event->gestureType() == Qt::ZoomNativeGesture)
    set_camera(zoom(camera_, 1 / std::max(0.1, 1 + event->value()), std::nullopt, diagonal_));
  else if (event->gestureType() == Qt::RotateNativeGesture && !turntable_)
    set_camera(roll(camera_, event->value() / kDegrees));
  else
    return false;
  event->accept();
  return true;
}

}  // namespace relief::studio
