// The viewport's hand: what mouse, pen, wheel and keys do.
#include "text.h"
#include "viewport.h"

#include <QApplication>
#include <QDropEvent>
#include <QMimeData>
#include <QStyleHints>
#include <QWindow>
#include <algorithm>
#include <cmath>
#include <utility>

namespace relief::studio {

namespace {

/// ms between two points of a pointer that rests while pressed.
constexpr int kHold = 16;

}  // namespace

Viewport::Gesture Viewport::gesture_for(Qt::MouseButton button, Qt::KeyboardModifiers modifiers, bool on_model) const {
  const auto turn = [&] {
    if (modifiers & Qt::ShiftModifier) return Gesture::Pan;
    if (modifiers & Qt::ControlModifier) return Gesture::Zoom;
    return Gesture::Orbit;
  };
  const bool alt = (modifiers & Qt::AltModifier) != 0;
  if (map_ == NavigationMap::Industry && alt) {
    if (button == Qt::MiddleButton) return Gesture::Pan;
    if (button == Qt::RightButton) return Gesture::Zoom;
    return Gesture::Orbit;
  }
  if (button == Qt::MiddleButton || button == Qt::RightButton || alt || space_) return turn();
  if (button != Qt::LeftButton) return Gesture::None;
  if (!on_model) return turn();
  return tools_.tool() ? Gesture::Stroke : Gesture::Touch;
}

void Viewport::press(Gesture gesture, const PointerSample& sample, Qt::KeyboardModifiers modifiers, bool eraser) {
  last_ = pointer_ = sample.at;
  gesture_ = gesture;
  if (gesture == Gesture::Stroke) {
    using Kind = StrokeInput::Kind;
    const Kind kind = (modifiers & Qt::ShiftModifier)               ? Kind::Smoothing
                      : (modifiers & Qt::ControlModifier) || eraser ? Kind::Inverted
                                                                    : Kind::Own;
    QString why;
    input_ns_ = clock_.nsecsElapsed();
    if (stroke_.begin(kind, sample, camera_, size(), why)) {
      hold_timer_.start(kHold, Qt::PreciseTimer, this);
    } else {
      gesture_ = Gesture::None;
      if (!why.isEmpty()) emit said(why);
    }
  }
  if (gesture_ == Gesture::Touch || gesture_ == Gesture::Stroke) emit pointed(ray(sample.at), true, sample.pressure);
  update_ring();
}

void Viewport::move(const PointerSample& sample) {
  pointer_ = sample.at;
  over_ = true;
  switch (gesture_) {
    case Gesture::Stroke:
      if (input_ns_ == 0) input_ns_ = clock_.nsecsElapsed();
      stroke_.move(sample);
      emit pointed(ray(sample.at), true, sample.pressure);
      break;
    case Gesture::Orbit:
    case Gesture::Pan:
    case Gesture::Zoom:
      navigate(sample.at - last_);
      last_ = sample.at;
      return;
    case Gesture::Drag:
      drag_setting(sample.at);
      return;
    case Gesture::Touch:
    case Gesture::None:
      emit pointed(ray(sample.at), gesture_ == Gesture::Touch, sample.pressure);
      break;
  }
  if (!ring_timer_.isActive()) ring_timer_.start(8);
}

void Viewport::release() {
  if (gesture_ == Gesture::Drag) return end_drag(true);
  hold_timer_.stop();
  if (gesture_ == Gesture::Stroke) end_stroke();
  if (gesture_ == Gesture::Touch || gesture_ == Gesture::Stroke) emit pointed(ray(pointer_), false, 0);
  gesture_ = Gesture::None;
  button_ = Qt::NoButton;
  update_ring();
}

void Viewport::navigate(QPointF by) {
  if (!has_scene() || by.isNull()) return;
  const double scale = std::max(1, height());
  Camera camera = camera_;
  if (gesture_ == Gesture::Orbit) camera = orbit(camera, 4.5 * by.x() / scale, 4.5 * by.y() / scale, turntable_);
  if (gesture_ == Gesture::Pan) camera = pan(camera, by.x() / scale, by.y() / scale);
  if (gesture_ == Gesture::Zoom) camera = zoom(camera, std::exp(3 * by.y() / scale), std::nullopt, diagonal_);
  const qint64 now = clock_.nsecsElapsed();
  if (input_ns_ == 0) input_ns_ = now;
  set_camera(camera);
}

void Viewport::mousePressEvent(QMouseEvent* event) {
  window()->setProperty("keyboard", false);
  if (pen_down_ || event->source() != Qt::MouseEventNotSynthesized) return;
  pen_.reset();
  if (gesture_ == Gesture::Drag) {
    if (event->button() == Qt::RightButton) end_drag(false);
    return;  // another button may be held while the hand goes on; its release ends it
  }
  if (gesture_ != Gesture::None) return;
  const PointerSample sample{event->position(), 1e-3 * static_cast<double>(event->timestamp()), 1};
  if (const auto axis = has_scene() ? axes_.ball.hit(sample.at) : std::nullopt;
      axis && event->button() == Qt::LeftButton) {
    look_from(*axis);
    return;
  }
  const auto under = hit(sample.at);
  if (pick_ && event->button() == Qt::LeftButton) {
    pick_ = false;
    unsetCursor();
    if (under) emit colourPicked(colour_at(*scene_.model, under->point.slab, under->point.u, under->point.v));
    return;
  }
  if (event->button() == Qt::MiddleButton && (event->modifiers() & Qt::AltModifier) && map_ == NavigationMap::Blender) {
    if (under) set_camera(centred(camera_, under->point.position));
    return;
  }
  button_ = event->button();
  press(gesture_for(event->button(), event->modifiers(), under.has_value()), sample, event->modifiers(), false);
}

void Viewport::mouseMoveEvent(QMouseEvent* event) {
  if (pen_down_) return;
  pen_.reset();
  if (const auto axis = axes_.ball.hit(event->position()); gesture_ == Gesture::None && axis != axes_.ball.hovered()) {
    axes_.ball.set_hovered(axis);
    update_overlays();
  }
  move({event->position(), 1e-3 * static_cast<double>(event->timestamp()), 1});
}

void Viewport::look_from(Axis axis) {
  const Vec3d back = direction(axis);
  for (const AxisView view :
       {AxisView::Front, AxisView::Back, AxisView::Right, AxisView::Left, AxisView::Top, AxisView::Bottom})
    if (const Camera seen = look_along(camera_, view, up_); dot(normalized(seen.eye - seen.target), back) > 0.9)
      set_camera(seen);
}

void Viewport::mouseReleaseEvent(QMouseEvent* event) {
  if (!pen_down_ && (event->button() == button_ || gesture_ == Gesture::Drag)) release();
}

void Viewport::mouseDoubleClickEvent(QMouseEvent* event) {
  if (map_ == NavigationMap::Pen && !hit(event->position()))
    frame_all();
  else
    mousePressEvent(event);
}

/// Whether a pen comes down beside the model for the second time within the time and the distance of a double click.
/// The system makes no such event of a pen's.
bool Viewport::taps_twice(const PointerSample& sample) {
  const QStyleHints& hints = *QGuiApplication::styleHints();
  const std::optional<PointerSample> before = std::exchange(pen_tap_, std::nullopt);
  if (hit(sample.at)) return false;
  const bool twice = before && sample.seconds - before->seconds <= 1e-3 * hints.mouseDoubleClickInterval() &&
                     QLineF(before->at, sample.at).length() <= hints.touchDoubleTapDistance();
  if (!twice) pen_tap_ = sample;
  return twice;
}

namespace {
/// The cosine of the angle between a pen and the normal of its tablet, from its leans along x and y, degrees.
double uprightness(double x, double y) {
  const auto slope = [](double degrees) {
    return std::isfinite(degrees) ? std::tan(std::clamp(degrees, -89.0, 89.0) / kDegrees) : 0.0;
  };
  return 1 / std::sqrt(1 + slope(x) * slope(x) + slope(y) * slope(y));
}
}  // namespace

/// A pen: never as a mouse, whose events have no pressure.
bool Viewport::tablet(QTabletEvent* event) {
  event->accept();
  const double raw = event->pressure(), upright = uprightness(event->xTilt(), event->yTilt());
  const PointerSample sample{event->position(), 1e-3 * static_cast<double>(event->timestamp()),
                             std::isfinite(raw) ? std::clamp(raw, 0.0, 1.0) * (tools_.use_tilt() ? upright : 1) : 0.0};
  pen_ = sample.pressure;
  emit pointerKnown(event->pointingDevice()->name(), sample.pressure, std::acos(upright) * kDegrees);
  const bool eraser = event->pointerType() == QPointingDevice::PointerType::Eraser;
  switch (event->type()) {
    case QEvent::TabletPress:
      if (gesture_ != Gesture::None) return true;
      pen_down_ = true;
      if (map_ == NavigationMap::Pen && taps_twice(sample)) {
        frame_all();
        return true;
      }
      press(gesture_for(event->button(), event->modifiers(), hit(sample.at).has_value()), sample, event->modifiers(),
            eraser);
      return true;
    case QEvent::TabletMove:
      move(sample);
      return true;
    default:
      pen_down_ = false;
      release();
      return true;
  }
}

void Viewport::wheelEvent(QWheelEvent* event) {
  if (!has_scene()) return;
  const QPoint pixels = event->pixelDelta();
  const double notches = pixels.isNull() ? event->angleDelta().y() / 120.0 : pixels.y() / 60.0;
  event->accept();
  if (notches == 0) return;
  if (gesture_ == Gesture::Touch) {
    emit depthTurned(notches);
    return;
  }
  const auto under = hit(event->position());
  if (input_ns_ == 0) input_ns_ = clock_.nsecsElapsed();
  set_camera(
      zoom(camera_, std::pow(0.88, notches), under ? std::optional(under->point.position) : std::nullopt, diagonal_));
}

void Viewport::begin_drag(const QString& setting) {
  if (gesture_ != Gesture::None || !scene_.model || !tools_.tool()) return;
  gesture_ = Gesture::Drag;
  drag_ = setting;
  drag_from_ = tools_.value(setting);
  drag_at_ = over_ ? pointer_ : QPointF(width() * 0.5, height() * 0.5);
  last_ = drag_at_;
  update_ring();
}

void Viewport::drag_setting(QPointF at) {
  const double right = at.x() - drag_at_.x();
  if (drag_ == QLatin1String("radius")) {
    // The ring follows the pointer: pixels of the picture become the lengths that they show there.
    const auto under = hit(drag_at_);
    const double away = under ? length(under->point.position - camera_.eye) : length(camera_.target - camera_.eye);
    const double scale = camera_.parallel ? 1 : away / length(camera_.target - camera_.eye);
    tools_.set_value(drag_, drag_from_ + right * height_at_target(camera_) * scale / std::max(1, height()));
  } else {
    tools_.set_value(drag_, drag_from_ + right / 250);
  }
}

void Viewport::end_drag(bool keep) {
  if (!keep) tools_.set_value(drag_, drag_from_);
  drag_.clear();
  gesture_ = Gesture::None;
  update_ring();
}

void Viewport::pick_colour() {
  pick_ = true;
  setCursor(Qt::CrossCursor);
}

void Viewport::keyPressEvent(QKeyEvent* event) {
  if (gesture_ == Gesture::Drag &&
      (event->key() == Qt::Key_Escape || event->key() == Qt::Key_Return || event->key() == Qt::Key_Enter)) {
    end_drag(event->key() != Qt::Key_Escape);
    return;
  }
  if (event->key() == Qt::Key_Escape && stroke_.open()) {
    stroke_.cancel();
    hold_timer_.stop();
    gesture_ = Gesture::None;
    return;
  }
  if (event->key() == Qt::Key_Space && !event->isAutoRepeat()) space_ = true;
  if (event->key() == Qt::Key_Return || event->key() == Qt::Key_Enter) {
    dab_at_ring();
    return;
  }
  const int key = event->key();
  if (key == Qt::Key_Left || key == Qt::Key_Right || key == Qt::Key_Up || key == Qt::Key_Down) {
    move_ring_by_keys(event);
    return;
  }
  QWidget::keyPressEvent(event);
}

/// Arrows move the ring; Shift by a pixel, else by ten.
void Viewport::move_ring_by_keys(QKeyEvent* event) {
  pen_.reset();
  window()->setProperty("keyboard", true);
  if (!over_) pointer_ = QPointF(width() * 0.5, height() * 0.5);
  over_ = true;
  const double step = event->modifiers() & Qt::ShiftModifier ? 1 : 10;
  const int key = event->key();
  pointer_ += QPointF(key == Qt::Key_Left    ? -step
                      : key == Qt::Key_Right ? step
                                             : 0,
                      key == Qt::Key_Up     ? -step
                      : key == Qt::Key_Down ? step
                                            : 0);
  pointer_.setX(std::clamp(pointer_.x(), 0.0, width() - 1.0));
  pointer_.setY(std::clamp(pointer_.y(), 0.0, height() - 1.0));
  update_ring();
}

/// Enter: a tap where the ring is.
void Viewport::dab_at_ring() {
  if (gesture_ != Gesture::None) return;
  pen_.reset();
  window()->setProperty("keyboard", true);
  if (!over_) pointer_ = QPointF(width() * 0.5, height() * 0.5);
  over_ = true;
  QString why;
  const PointerSample sample{pointer_, 0, 1};
  if (stroke_.begin(StrokeInput::Kind::Own, sample, camera_, size(), why)) end_stroke();
  update_ring();
}

void Viewport::end_stroke() {
  if (stroke_.open()) emit strokeMade(stroke_.end());  // else it was cancelled
}

void Viewport::repeat_stroke(const PointerStroke& stroke) {
  if (gesture_ != Gesture::None) return;
  if (stroke.samples.empty()) return emit said(tr("There is no stroke to repeat yet."));
  if (!tools_.tool()) return emit said(tr("Touch leaves no trace. Choose another tool to repeat the last stroke."));
  QString why;
  input_ns_ = clock_.nsecsElapsed();
  if (!stroke_.repeat(stroke, why)) emit said(why.isEmpty() ? tr("The last stroke cannot be repeated here.") : why);
}

void Viewport::keyReleaseEvent(QKeyEvent* event) {
  if (event->key() == Qt::Key_Space && !event->isAutoRepeat()) space_ = false;
  // The key that was held while the hand moved; one that was only tapped is up before that.
  if (gesture_ == Gesture::Drag && !event->isAutoRepeat() && pointer_ != drag_at_ && event->key() != Qt::Key_Shift &&
      event->key() != Qt::Key_Control && event->key() != Qt::Key_Alt)
    end_drag(true);
  QWidget::keyReleaseEvent(event);
}

void Viewport::focusOutEvent(QFocusEvent* event) {
  space_ = false;
  update();
  QWidget::focusOutEvent(event);
}

void Viewport::enterEvent(QEnterEvent*) {
  over_ = true;
  const QWidget* focus = QApplication::focusWidget();
  if (focus == nullptr || !focus->inherits("QLineEdit")) setFocus(Qt::MouseFocusReason);
}

void Viewport::leaveEvent(QEvent*) {
  over_ = false;
  pen_.reset();
  emit left();
  update_ring();
}

void Viewport::dragEnterEvent(QDragEnterEvent* event) {
  if (event->mimeData()->hasUrls()) event->acceptProposedAction();
}

void Viewport::dropEvent(QDropEvent* event) {
  QStringList files;
  for (const QUrl& url : event->mimeData()->urls())
    if (url.isLocalFile()) files.append(url.toLocalFile());
  event->acceptProposedAction();
  emit dropped(files);
}

void Viewport::timerEvent(QTimerEvent* event) {
  if (event->timerId() == hold_timer_.timerId())
    stroke_.hold();
  else
    QWidget::timerEvent(event);
}

bool Viewport::event(QEvent* event) {
  switch (event->type()) {
    case QEvent::TabletPress:
    case QEvent::TabletMove:
    case QEvent::TabletRelease:
      return tablet(static_cast<QTabletEvent*>(event));
    case QEvent::TouchBegin:
    case QEvent::TouchUpdate:
    case QEvent::TouchEnd:
    case QEvent::TouchCancel:
      return touch(static_cast<QTouchEvent*>(event));
    case QEvent::NativeGesture:
      if (trackpad(static_cast<QNativeGestureEvent*>(event))) return true;
      break;
    case QEvent::Show:
      window()->windowHandle()->installEventFilter(this);
      [[fallthrough]];
    case QEvent::WindowStateChange:
      QTimer::singleShot(0, this, [this] { ask(); });
      break;
    case QEvent::PaletteChange:
      use_theme();
      [[fallthrough]];
    case QEvent::ScreenChangeInternal:
      changed(0);
      break;
    default:
      break;
  }
  return QWidget::event(event);
}

/// A window manager may map the window long after it was shown: what was wanted meanwhile is asked for then.
bool Viewport::eventFilter(QObject* object, QEvent* event) {
  if (event->type() == QEvent::Expose) ask();
  return QWidget::eventFilter(object, event);
}

}  // namespace relief::studio
