#include "viewport.h"

#include "event_log.h"
#include "text.h"
#include "widgets/theme.h"

#include <QAccessible>
#include <QApplication>
#include <QJsonArray>
#include <QLinearGradient>
#include <QMimeData>
#include <QPainter>
#include <QWindow>

#include <algorithm>
#include <cmath>

namespace relief::studio {

namespace {

/// ms without input after which the picture is made sharper, once and then fully.
constexpr int kRest = 150;
/// ms between two points of a pointer that rests while pressed.
constexpr int kHold = 16;
/// ms that a picture of a moving camera may take before it is made coarser.
constexpr double kSlow = 33;
constexpr double kDegrees = 57.29577951308232;

QJsonArray json(Vec3d v) { return {v.x, v.y, v.z}; }

}  // namespace

Viewport::Viewport(DocumentBridge& bridge, ToolState& tools, QWidget* parent)
    : QWidget(parent),
      bridge_(bridge),
      tools_(tools),
      stroke_(bridge, tools),
      thread_({.drawn =
                   [this](Piece piece) {
                     QMetaObject::invokeMethod(
                         this, [this, piece = std::move(piece)]() mutable { take(std::move(piece)); }, Qt::QueuedConnection);
                   },
               .failed =
                   [this](const Error& error) {
                     QMetaObject::invokeMethod(this, [this, words = text(error.message)] { emit said(words); }, Qt::QueuedConnection);
                   },
               .ready =
                   [this](const std::string& name) {
                     QMetaObject::invokeMethod(
                         this,
                         [this, words = text(name)] {
                           device_ = words;
                           emit deviceKnown(words);
                         },
                         Qt::QueuedConnection);
                   }}) {
  setObjectName(QStringLiteral("viewport"));
  setAccessibleName(tr("Viewport"));
  setAttribute(Qt::WA_OpaquePaintEvent);
  setAttribute(Qt::WA_TabletTracking);
  setMouseTracking(true);
  setFocusPolicy(Qt::StrongFocus);
  setAcceptDrops(true);
  setMinimumSize(200, 150);
  clock_.start();
  for (QTimer* timer : {&ask_timer_, &rest_timer_, &ring_timer_}) timer->setSingleShot(true);
  connect(&ask_timer_, &QTimer::timeout, this, &Viewport::ask_now);
  connect(&rest_timer_, &QTimer::timeout, this, [this] {
    moving_ = false;
    wanted_ = true;
    asked_samples_ = asked_samples_ < 4 ? 4 : final_samples_;
    ask_now();
  });
  connect(&ring_timer_, &QTimer::timeout, this, &Viewport::update_ring);
  connect(&tools_, &ToolState::toolChanged, this, &Viewport::update_ring);
  connect(&tools_, &ToolState::settingChanged, this, &Viewport::update_ring);
  info_.font = drag_value_.font = ui_font();
  describe(false);
}

Viewport::~Viewport() = default;

// ---- What is shown

void Viewport::set_scene(Scene scene, Unit unit, bool frame_it) {
  scene_ = std::move(scene);
  unit_ = unit;
  hint_ = {};
  box_ = scene_.model ? scene_.model->slab_mesh().bounds() : scene_.mesh ? bounds(*scene_.mesh) : Box3d{};
  diagonal_ = has_scene() ? diagonal(box_) : 1;
  look_.mm_per_unit = 1000 * metres(unit_);
  if (frame_it) frame_all();
  changed(0);
  update_ring();
  if (!has_scene()) {
    picture_ = {};
    update();
    describe(false);
  }
}

void Viewport::set_model(SnapshotPtr model) {
  scene_.model = std::move(model);
  changed(input_ns_);
  ring_timer_.start(0);
}

void Viewport::set_camera(const Camera& camera) {
  camera_ = camera;
  moving_ = true;
  changed(0);
  emit cameraChanged();
  update_ring();
}

void Viewport::frame_all() {
  if (!has_scene()) return;
  const double aspect = width() / std::max(1.0, double(height()));
  Camera camera = with_lens(camera_, false);
  const Vec3d back = picture_axes(camera).back;
  // Fitted from a direction of azimuth and elevation around the axis that is up.
  const bool z_up = up_.z > 0;
  const double ahead = z_up ? -back.y : back.z, above = std::clamp(z_up ? back.z : back.y, -1.0, 1.0);
  const double azimuth = std::atan2(back.x, ahead) * kDegrees, elevation = std::asin(above) * kDegrees;
  const bool parallel = camera_.parallel;
  camera = scene_.model ? framing(*scene_.model, azimuth, elevation, aspect, up_) : framing(box_, azimuth, elevation, aspect, up_);
  set_camera(with_lens(camera, parallel));
}

void Viewport::set_up(Vec3d up) {
  up_ = up;
  camera_ = look_along(camera_, AxisView::Front, up_);
  frame_all();
}

void Viewport::set_look(const Look& look) {
  if (look == look_) return;
  const double millimetres = look_.mm_per_unit;
  look_ = look;
  look_.mm_per_unit = millimetres;
  changed(0);
}

void Viewport::redraw_everything() {
  everything_ = true;
  wanted_ = true;
  ask();
}

// ---- Asking for pictures

/// Something differs from the picture. Not before the last picture has come, and not more often than allowed, another
/// is asked for.
void Viewport::changed(qint64 input_ns) {
  if (!has_scene()) return;
  wanted_ = true;
  asked_samples_ = 1;
  if (input_ns != 0 && input_ns_ == 0) input_ns_ = input_ns;
  ask();
}

void Viewport::ask() {
  if (!wanted_ || ask_timer_.isActive() || (in_flight_ && !refining_)) return;
  const qint64 since = since_asked_.isValid() ? since_asked_.elapsed() : interval_ms_;
  ask_timer_.start(static_cast<int>(std::max<qint64>(0, interval_ms_ - since)));
}

Frame Viewport::final_frame() const {
  const double ratio = pixel_ratio();
  Frame frame;
  frame.camera = camera_;
  frame.width = std::clamp(static_cast<int>(std::lround(width() * ratio)), 1, 8192);
  frame.height = std::clamp(static_cast<int>(std::lround(height() * ratio)), 1, 8192);
  frame.tau = 1;
  frame.samples = final_samples_;
  frame.look = look_;
  return frame;
}

void Viewport::ask_now() {
  const bool shown = isVisible() && !window()->isMinimized() && (windowHandle() == nullptr || windowHandle()->isExposed()) &&
                     (window()->windowHandle() == nullptr || window()->windowHandle()->isExposed());
  if (!wanted_ || !has_scene() || !shown || width() < 1 || height() < 1) return;
  if (in_flight_ && !refining_) return;
  DrawRequest request;
  request.scene = scene_;
  Frame& frame = request.frame = final_frame();
  frame.tau = moving_ ? tau_ : 1;
  frame.samples = std::max(1, asked_samples_);
  request.everything = everything_;
  request.input_ns = input_ns_;
  wanted_ = everything_ = false;
  input_ns_ = 0;
  in_flight_ = true;
  refining_ = frame.samples > 1;
  since_asked_.start();
  if (!refining_) describe(true);
  thread_.request(std::move(request));
}

void Viewport::take(Piece piece) {
  in_flight_ = refining_ = false;
  if (!piece.given_up) {
    const QSize size(piece.frame.width, piece.frame.height);
    if (piece.image.size() == size) {
      picture_ = std::move(piece.image);
      picture_.setDevicePixelRatio(pixel_ratio());
      update();
    } else if (!piece.rect.empty() && picture_.size() == size) {
      QPainter painter(&picture_);
      painter.setCompositionMode(QPainter::CompositionMode_Source);
      const double ratio = pixel_ratio();
      painter.scale(1 / ratio, 1 / ratio);
      painter.drawImage(piece.rect.x, piece.rect.y, piece.image);
      painter.end();
      update(QRectF(piece.rect.x / ratio, piece.rect.y / ratio, piece.rect.width / ratio, piece.rect.height / ratio)
                 .toAlignedRect()
                 .adjusted(-1, -1, 1, 1));
    }
    ++frames_;
    const bool moved = piece.frame.tau > 1;
    if (moved && piece.cpu_ms > 2 * kSlow)
      slow_ = std::min(slow_ + 1, 2);
    else if (moved)
      slow_ = std::max(slow_ - 1, 0);
    tau_ = slow_ >= 2 ? 4 : slow_ == 0 ? 2 : tau_;
    const double latency = piece.input_ns != 0 ? 1e-6 * static_cast<double>(clock_.nsecsElapsed() - piece.input_ns) : 0;
    if (event_log().active())
      event_log().write(QStringLiteral("frame"),
                        {{"n", qint64(frames_)},
                         {"view", objectName()},
                         {"revision", qint64(piece.revision)},
                         {"rect", QJsonArray{piece.rect.x, piece.rect.y, piece.rect.width, piece.rect.height}},
                         {"full", piece.full},
                         {"samples", piece.frame.samples},
                         {"triangles", qint64(piece.triangles)},
                         {"cpu_ms", piece.cpu_ms},
                         {"latency_ms", latency}});
    if (!wanted_ && piece.frame.camera != logged_) log_camera(piece.frame.camera);
    emit frameDrawn(frames_);
    if (!wanted_ && scene_.model && piece.frame.samples >= final_samples_) emit settled();
    const bool unfinished = piece.frame.samples < final_samples_ || piece.frame.tau > 1;
    if (!wanted_ && unfinished) rest_timer_.start(piece.frame.samples > 1 ? 0 : kRest);
  }
  describe(wanted_);
  if (wanted_) ask();
}

/// Where the camera has come to rest.
void Viewport::log_camera(const Camera& camera) {
  logged_ = camera;
  event_log().write(QStringLiteral("camera"), {{"view", objectName()},
                                               {"eye", json(camera.eye)},
                                               {"target", json(camera.target)},
                                               {"up", json(camera.up)},
                                               {"fov", camera.field_of_view},
                                               {"parallel", camera.parallel},
                                               {"view_height", camera.view_height}});
}

OverlayView Viewport::overlay_view() const { return {.camera = camera_, .size = size(), .unit = unit_}; }

QRect Viewport::ring_in_window() const {
  const QRectF ring = ring_.bounds(overlay_view());
  return ring.isEmpty() ? QRect() : QRect(mapTo(window(), ring.topLeft().toPoint()), ring.size().toSize());
}

void Viewport::add_overlay(const Overlay* overlay) { others_.push_back(overlay); }

void Viewport::show_overlays(bool shown) {
  overlays_ = shown;
  update();
}

void Viewport::update_overlays() {
  const OverlayView view = overlay_view();
  QRegion now;
  const auto add = [&](const Overlay& overlay) {
    if (const QRectF box = overlay.bounds(view); !box.isEmpty()) now += box.toAlignedRect().adjusted(-1, -1, 1, 1);
  };
  add(ring_);
  add(info_);
  add(axes_);
  add(drag_value_);
  for (const Overlay* overlay : others_) add(*overlay);
  update(painted_ + now);
  painted_ = now;
}

void Viewport::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  if (picture_.isNull()) {
    QLinearGradient ground(0, 0, 0, height());
    const auto colour = [](Vec3f c) { return QColor::fromRgbF(c.x, c.y, c.z); };
    ground.setColorAt(0, colour(look_.top));
    ground.setColorAt(1, colour(look_.bottom));
    painter.fillRect(rect(), ground);
  } else {
    painter.drawImage(QPointF(0, 0), picture_);
    const QSizeF shown = picture_.deviceIndependentSize();
    if (shown.width() < width()) painter.fillRect(QRectF(shown.width(), 0, width() - shown.width(), height()), current_theme().window);
    if (shown.height() < height()) painter.fillRect(QRectF(0, shown.height(), width(), height() - shown.height()), current_theme().window);
  }
  painter.setRenderHint(QPainter::Antialiasing);
  const OverlayView view = overlay_view();
  if (has_scene() && overlays_) {
    ring_.paint(painter, view);
    for (const Overlay* overlay : others_) overlay->paint(painter, view);
    info_.paint(painter, view);
    axes_.paint(painter, view);
    drag_value_.paint(painter, view);
  }
  if (hasFocus() && window()->property("keyboard").toBool()) {
    painter.setPen(QPen(current_theme().accent, 2));
    painter.setBrush(Qt::NoBrush);
    painter.drawRect(QRectF(rect()).adjusted(1, 1, -1, -1));
  }
}

void Viewport::resizeEvent(QResizeEvent*) {
  changed(0);
  update_overlays();
}

void Viewport::describe(bool drawing) {
  const QString words = !has_scene() ? QStringLiteral("no model")
                                     : QStringLiteral("%1, frame %2").arg(drawing ? QStringLiteral("drawing") : QStringLiteral("ready")).arg(frames_);
  if (accessibleDescription() == words) return;
  setAccessibleDescription(words);
}

// ---- The ring

Ray3d Viewport::ray(QPointF at) const { return pixel_ray(camera_, width(), height(), at.x(), at.y()); }

std::optional<RayHit> Viewport::hit(QPointF at) const {
  if (!scene_.model) return std::nullopt;
  return raycast(*scene_.model, ray(at), hint_);
}

void Viewport::update_ring() {
  const QPointF at = drag_.isEmpty() ? pointer_ : drag_at_;
  const bool shown = scene_.model && (over_ || !drag_.isEmpty()) && gesture_ != Gesture::Orbit && gesture_ != Gesture::Pan && gesture_ != Gesture::Zoom;
  const auto found = shown ? hit(at) : std::nullopt;
  const Brush brush = tools_.brush();
  ring_.place.reset();
  ring_.mirrored.clear();
  ring_.radius = brush.radius;
  ring_.strength = tools_.tool() ? brush.strength : 1;
  ring_.pressed = stroke_.open();
  if (found) {
    ring_.place = RingOverlay::Place{found->point.position, found->point.normal};
    for (unsigned mirror = 1; mirror < 8; ++mirror) {
      if ((mirror & ~static_cast<unsigned>(brush.symmetry)) != 0) continue;
      RingOverlay::Place other = *ring_.place;
      const auto flip = [&](unsigned axis, double& p, double& n, double plane) {
        if ((mirror & (1U << axis)) == 0) return;
        p = 2 * plane - p;
        n = -n;
      };
      flip(0, other.at.x, other.normal.x, brush.mirror.x);
      flip(1, other.at.y, other.normal.y, brush.mirror.y);
      flip(2, other.at.z, other.normal.z, brush.mirror.z);
      ring_.mirrored.push_back(other);
    }
  }
  info_.text = !scene_.model ? QString()
                             : QStringLiteral("%1   ·   %2").arg(ToolState::title(tools_.id()), length_text(brush.radius, unit_)) +
                                   (tools_.tool() ? QStringLiteral("   ·   %1").arg(percent_text(brush.strength)) : QString());
  drag_value_.text = drag_.isEmpty() ? QString() : drag_ == QLatin1String("radius") ? length_text(brush.radius, unit_) : percent_text(brush.strength);
  drag_value_.beside = drag_at_;
  update_overlays();
}

// ---- Input

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
    const Kind kind = (modifiers & Qt::ShiftModifier)                ? Kind::Smoothing
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
  if (gesture == Gesture::Touch) emit pointed(ray(sample.at), true, sample.pressure);
  update_ring();
}

void Viewport::move(const PointerSample& sample, Qt::KeyboardModifiers) {
  pointer_ = sample.at;
  over_ = true;
  switch (gesture_) {
    case Gesture::Stroke:
      if (input_ns_ == 0) input_ns_ = clock_.nsecsElapsed();
      stroke_.move(sample);
      break;
    case Gesture::Orbit:
    case Gesture::Pan:
    case Gesture::Zoom:
      navigate(sample.at - last_, sample.at);
      last_ = sample.at;
      return;
    case Gesture::Drag:
      drag_setting(sample.at);
      return;
    case Gesture::Touch:
    case Gesture::None:
      if (!tools_.tool()) emit pointed(ray(sample.at), gesture_ == Gesture::Touch, sample.pressure);
      break;
  }
  if (!ring_timer_.isActive()) ring_timer_.start(8);
}

void Viewport::release() {
  hold_timer_.stop();
  if (gesture_ == Gesture::Stroke) stroke_.end();
  if (gesture_ == Gesture::Touch) emit pointed(ray(pointer_), false, 0);
  gesture_ = Gesture::None;
  button_ = Qt::NoButton;
  update_ring();
}

void Viewport::navigate(QPointF by, QPointF) {
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
  if (pen_down_) return;
  if (gesture_ == Gesture::Drag) {
    end_drag(event->button() != Qt::RightButton);
    return;
  }
  if (gesture_ != Gesture::None) return;
  const PointerSample sample{event->position(), 1e-3 * static_cast<double>(event->timestamp()), 1};
  if (const auto axis = has_scene() ? axes_.ball.hit(sample.at) : std::nullopt; axis && event->button() == Qt::LeftButton) {
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
  if (const auto axis = axes_.ball.hit(event->position()); gesture_ == Gesture::None && axis != axes_.ball.hovered()) {
    axes_.ball.set_hovered(axis);
    update_overlays();
  }
  move({event->position(), 1e-3 * static_cast<double>(event->timestamp()), 1}, event->modifiers());
}

void Viewport::look_from(Axis axis) {
  const Vec3d back = direction(axis);
  for (const AxisView view : {AxisView::Front, AxisView::Back, AxisView::Right, AxisView::Left, AxisView::Top, AxisView::Bottom})
    if (const Camera seen = look_along(camera_, view, up_); dot(normalized(seen.eye - seen.target), back) > 0.9) set_camera(seen);
}

void Viewport::mouseReleaseEvent(QMouseEvent* event) {
  if (pen_down_ || event->button() != button_ || gesture_ == Gesture::Drag) return;
  release();
}

void Viewport::mouseDoubleClickEvent(QMouseEvent* event) {
  if (map_ == NavigationMap::Pen && !hit(event->position()))
    frame_all();
  else
    mousePressEvent(event);
}

/// A pen: never as a mouse, whose events have no pressure.
bool Viewport::tablet(QTabletEvent* event) {
  event->accept();
  const double raw = event->pressure();
  const PointerSample sample{event->position(), 1e-3 * static_cast<double>(event->timestamp()),
                             std::isfinite(raw) ? std::clamp(raw, 0.0, 1.0) : 0.0};
  emit pointerKnown(event->pointingDevice()->name(), sample.pressure, std::hypot(event->xTilt(), event->yTilt()));
  const bool eraser = event->pointerType() == QPointingDevice::PointerType::Eraser;
  switch (event->type()) {
    case QEvent::TabletPress:
      if (gesture_ != Gesture::None) return true;
      pen_down_ = true;
      press(gesture_for(event->button(), event->modifiers(), hit(sample.at).has_value()), sample, event->modifiers(), eraser);
      return true;
    case QEvent::TabletMove:
      move(sample, event->modifiers());
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
  set_camera(zoom(camera_, std::pow(0.88, notches), under ? std::optional(under->point.position) : std::nullopt, diagonal_));
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
  if (gesture_ == Gesture::Drag && (event->key() == Qt::Key_Escape || event->key() == Qt::Key_Return || event->key() == Qt::Key_Enter)) {
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
  window()->setProperty("keyboard", true);
  if (!over_) pointer_ = QPointF(width() * 0.5, height() * 0.5);
  over_ = true;
  const double step = event->modifiers() & Qt::ShiftModifier ? 1 : 10;
  const int key = event->key();
  pointer_ += QPointF(key == Qt::Key_Left ? -step : key == Qt::Key_Right ? step : 0, key == Qt::Key_Up ? -step : key == Qt::Key_Down ? step : 0);
  pointer_.setX(std::clamp(pointer_.x(), 0.0, width() - 1.0));
  pointer_.setY(std::clamp(pointer_.y(), 0.0, height() - 1.0));
  update_ring();
}

/// Enter: a tap where the ring is.
void Viewport::dab_at_ring() {
  if (gesture_ != Gesture::None) return;
  window()->setProperty("keyboard", true);
  if (!over_) pointer_ = QPointF(width() * 0.5, height() * 0.5);
  over_ = true;
  QString why;
  const PointerSample sample{pointer_, 0, 1};
  if (stroke_.begin(StrokeInput::Kind::Own, sample, camera_, size(), why)) stroke_.end();
  update_ring();
}

void Viewport::keyReleaseEvent(QKeyEvent* event) {
  if (event->key() == Qt::Key_Space && !event->isAutoRepeat()) space_ = false;
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
    case QEvent::TabletRelease: return tablet(static_cast<QTabletEvent*>(event));
    case QEvent::Show:
    case QEvent::WindowStateChange: QTimer::singleShot(0, this, [this] { ask(); }); break;
    case QEvent::ScreenChangeInternal:
    case QEvent::PaletteChange: changed(0); break;
    default: break;
  }
  return QWidget::event(event);
}

}  // namespace relief::studio
