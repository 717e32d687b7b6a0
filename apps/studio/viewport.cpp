#include "viewport.h"

#include "event_log.h"
#include "text.h"
#include "widgets/theme.h"

#include <relief/core/query.h>
#include <relief/edit/stroke.h>

#include <QAccessible>
#include <QApplication>
#include <QJsonArray>
#include <QLinearGradient>
#include <QPainter>
#include <QWindow>
#include <algorithm>
#include <cmath>

namespace relief::studio {

namespace {

/// ms without input after which the picture is made sharper, once and then fully.
constexpr int kRest = 150;
/// ms that a picture of something that happens may take before the next ones are made coarser.
constexpr double kSlow = 33;

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
                         this, [this, piece = std::move(piece)]() mutable { take(std::move(piece)); },
                         Qt::QueuedConnection);
                   },
               .failed =
                   [this](const Error& error) {
                     QMetaObject::invokeMethod(
                         this, [this, words = error_text(error)] { emit said(words); }, Qt::QueuedConnection);
                   },
               .ready =
                   [this](const std::string& name, bool software) {
                     QMetaObject::invokeMethod(
                         this,
                         [this, words = text(name), software] {
                           device_ = words;
                           software_ = software;
                           emit deviceKnown(words, software);
                         },
                         Qt::QueuedConnection);
                   }}) {
  setObjectName(QStringLiteral("viewport"));
  setAccessibleName(tr("Viewport"));
  setAttribute(Qt::WA_OpaquePaintEvent);
  setAttribute(Qt::WA_TabletTracking);
  setAttribute(Qt::WA_AcceptTouchEvents);
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
    stage_ = stage_ == Stage::Quick && final_samples_ > 4 ? Stage::Better : Stage::Final;
    ask_now();
  });
  connect(&ring_timer_, &QTimer::timeout, this, &Viewport::update_ring);
  connect(&tools_, &ToolState::toolChanged, this, &Viewport::update_ring);
  connect(&tools_, &ToolState::settingChanged, this, &Viewport::update_ring);
  use_theme();
  describe(false);
}

Viewport::~Viewport() = default;

// ---- What is shown

void Viewport::set_scene(Scene scene, Unit unit, bool frame_it) {
  scene_ = std::move(scene);
  unit_ = unit;
  hint_ = {};
  box_ = scene_.model ? bounds_of_surface(*scene_.model) : scene_.mesh ? bounds(*scene_.mesh) : Box3d{};
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
  emit sceneChanged();
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
  camera = scene_.model ? framing(*scene_.model, azimuth, elevation, aspect, up_)
                        : framing(box_, azimuth, elevation, aspect, up_);
  set_camera(with_lens(camera, parallel));
}

void Viewport::set_up(Vec3d up) {
  up_ = up;
  camera_ = look_along(camera_, AxisView::Front, up_);
  frame_all();
}

/// The ground of the picture is the window's, not the look's.
void Viewport::use_theme() {
  const bool dark = is_dark(current_theme());
  look_.top = dark ? Look{}.top : Vec3f{0.86F, 0.87F, 0.885F};
  look_.bottom = dark ? Look{}.bottom : Vec3f{0.69F, 0.70F, 0.72F};
  info_.font = drag_value_.font = ui_font();
}

void Viewport::set_look(const Look& look) {
  Look wanted = look;
  wanted.top = look_.top;
  wanted.bottom = look_.bottom;
  wanted.mm_per_unit = look_.mm_per_unit;
  if (wanted == look_) return;
  look_ = wanted;
  changed(0);
}

void Viewport::keep_left_free(int pixels) {
  if (pixels == left_free_) return;
  left_free_ = pixels;
  if (look_.map != Look::Map::None) changed(0);
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
  stage_ = Stage::Quick;
  if (input_ns != 0 && input_ns_ == 0) input_ns_ = input_ns;
  ask();
}

void Viewport::ask() {
  if (!wanted_ || ask_timer_.isActive() || (in_flight_ && !refining_)) return;
  const qint64 since = since_asked_.isValid() ? since_asked_.elapsed() : interval_ms();
  ask_timer_.start(static_cast<int>(std::max<qint64>(0, interval_ms() - since)));
}

Frame Viewport::final_frame() const {
  const double ratio = pixel_ratio();
  Frame frame;
  frame.camera = camera_;
  frame.width = std::clamp(static_cast<int>(std::lround(width() * ratio)), 1, 8192);
  frame.height = std::clamp(static_cast<int>(std::lround(height() * ratio)), 1, 8192);
  frame.tau = 1;
  // The studio light's shadows are soft without more.
  frame.samples = look_.light == Look::Light::Studio ? std::min(final_samples_, 4) : final_samples_;
  frame.look = look_;
  return frame;
}

void Viewport::ask_now() {
  const bool shown = isVisible() && !window()->isMinimized() &&
                     (windowHandle() == nullptr || windowHandle()->isExposed()) &&
                     (window()->windowHandle() == nullptr || window()->windowHandle()->isExposed());
  if (!wanted_ || !has_scene() || !shown || width() < 1 || height() < 1) return;
  if (in_flight_ && !refining_) return;
  DrawRequest request;
  request.scene = scene_;
  Frame& frame = request.frame = final_frame();
  frame.look.legend_left = static_cast<int>(std::lround(left_free_ * pixel_ratio()));
  if (stage_ == Stage::Quick) frame.tau = (moving_ ? 2 : 1) * (coarser_ > 0 ? 2 : 1);
  if (stage_ != Stage::Final) {
    frame.samples = stage_ == Stage::Quick ? 1 : 4;
    // The studio light takes seconds: until the picture rests it is the sculpting one.
    frame.look.light = Look::Light::Matcap;
  }
  request.stage = stage_;
  request.everything = everything_;
  request.input_ns = input_ns_;
  wanted_ = everything_ = false;
  input_ns_ = 0;
  in_flight_ = true;
  refining_ = stage_ != Stage::Quick;
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
    pace(piece);
    const double latency = piece.input_ns != 0 ? 1e-6 * static_cast<double>(clock_.nsecsElapsed() - piece.input_ns) : 0;
    if (event_log().active())
      event_log().write(QStringLiteral("frame"),
                        {{"n", qint64(frames_)},
                         {"view", objectName()},
                         {"revision", qint64(piece.revision)},
                         {"cage", qint64(piece.cage)},
                         {"rect", QJsonArray{piece.rect.x, piece.rect.y, piece.rect.width, piece.rect.height}},
                         {"full", piece.full},
                         {"samples", piece.frame.samples},
                         {"triangles", qint64(piece.triangles)},
                         {"cpu_ms", piece.cpu_ms},
                         {"latency_ms", latency}});
    if (!wanted_ && piece.frame.camera != logged_) log_camera(piece.frame.camera);
    emit frameDrawn(frames_);
    if (!wanted_ && scene_.model && piece.stage == Stage::Final) emit settled();
    if (!wanted_ && piece.stage != Stage::Final) rest_timer_.start(piece.stage == Stage::Better ? 0 : kRest);
  }
  describe(wanted_);
  if (wanted_) ask();
}

/// Pictures of something that happens become coarser after two in a row that took too long, and finer again where the
/// next finer level, with four times the triangles, would still be quick.
void Viewport::pace(const Piece& piece) {
  if (piece.stage != Stage::Quick) return;
  slow_ = piece.wall_ms > kSlow ? slow_ + 1 : 0;
  if (slow_ >= 2) coarser_ = 1;
  if (piece.full && piece.wall_ms < kSlow / 6) coarser_ = 0;
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
  add(planes_);
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
    if (shown.width() < width())
      painter.fillRect(QRectF(shown.width(), 0, width() - shown.width(), height()), current_theme().window);
    if (shown.height() < height())
      painter.fillRect(QRectF(0, shown.height(), width(), height() - shown.height()), current_theme().window);
  }
  painter.setRenderHint(QPainter::Antialiasing);
  const OverlayView view = overlay_view();
  if (has_scene() && overlays_) {
    planes_.paint(painter, view);
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
                                     : QStringLiteral("%1, frame %2")
                                           .arg(drawing ? QStringLiteral("drawing") : QStringLiteral("ready"))
                                           .arg(frames_);
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
  const bool shown = scene_.model && (over_ || !drag_.isEmpty()) && gesture_ != Gesture::Orbit &&
                     gesture_ != Gesture::Pan && gesture_ != Gesture::Zoom;
  const auto found = shown ? hit(at) : std::nullopt;
  const Brush brush = tools_.brush();
  ring_.place.reset();
  ring_.mirrored.clear();
  ring_.most = brush.radius;
  // Who sets the radius, or aims with a pen in the air, wants to see it whole.
  const bool light = pen_ && *pen_ > 0 && tools_.use_pressure() && tools_.tool() && drag_.isEmpty();
  ring_.radius = brush.radius * (light ? dab_size(brush, *pen_) : 1);
  ring_.strength = tools_.tool() ? brush.strength : 1;
  ring_.pressed = stroke_.open();
  planes_.box = scene_.model ? box_ : Box3d{};
  planes_.through = brush.mirror;
  planes_.axes = scene_.model && tools_.tool() ? brush.symmetry : 0;
  if (found) {
    ring_.place = SurfacePlace{found->point.position, found->point.normal};
    for (unsigned mirror = 1; mirror < 8; ++mirror) {
      if ((mirror & ~static_cast<unsigned>(brush.symmetry)) != 0) continue;
      SurfacePlace other = *ring_.place;
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
  info_.text =
      !scene_.model
          ? QString()
          : QStringLiteral("%1   ·   %2").arg(ToolState::title(tools_.id()), length_text(brush.radius, unit_)) +
                (tools_.tool() ? QStringLiteral("   ·   %1").arg(percent_text(brush.strength)) : QString());
  drag_value_.text = drag_.isEmpty()                    ? QString()
                     : drag_ == QLatin1String("radius") ? length_text(brush.radius, unit_)
                                                        : percent_text(brush.strength);
  drag_value_.beside = drag_at_;
  update_overlays();
}

}  // namespace relief::studio
