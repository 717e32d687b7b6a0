#include "overlays.h"

#include "widgets/theme.h"

#include <QFontMetricsF>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace relief::studio {

namespace {

/// Corners of a ring; at 200 pixels of radius a side is then 20 pixels long and 0.25 off the circle.
constexpr int kCorners = 64;
/// Pixels around a line that its outline takes.
constexpr double kOutline = 3;

}  // namespace

QPolygonF circle(const OverlayView& view, const SurfacePlace& place, double radius) {
  const Vec3d n = place.normal;
  const Vec3d a = normalized(cross(n, std::abs(n.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0})), b = cross(n, a);
  QPolygonF line;
  for (int k = 0; k <= kCorners; ++k) {
    const double turn = 2 * std::numbers::pi * k / kCorners;
    const auto seen = seen_at(view.camera, place.at + (a * std::cos(turn) + b * std::sin(turn)) * radius,
                              view.size.width(), view.size.height());
    if (!seen) return {};
    line.append(*seen);
  }
  return line;
}

void outlined(QPainter& painter, const QPolygonF& line, const QColor& colour, double width, Qt::PenStyle style) {
  painter.setBrush(Qt::NoBrush);
  painter.setPen(QPen(QColor(0, 0, 0, 110), width + 2, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
  if (style == Qt::SolidLine) painter.drawPolyline(line);
  QPen pen(colour, width, style, Qt::RoundCap, Qt::RoundJoin);
  if (style == Qt::DotLine) pen.setDashPattern({0.1, 3});
  if (style == Qt::DashLine) pen.setDashPattern({4, 4});
  painter.setPen(pen);
  painter.drawPolyline(line);
}

std::optional<RingOverlay::Lines> RingOverlay::lines(const OverlayView& view) const {
  if (!place) return std::nullopt;
  Lines lines{.radius = circle(view, *place, radius),
              .most = radius < most ? circle(view, *place, most) : QPolygonF(),
              .strength = circle(view, *place, radius * std::clamp(strength, 0.05, 1.0)),
              .normal = {},
              .mirrored = {}};
  if (lines.radius.isEmpty()) return std::nullopt;
  const auto from = seen_at(view.camera, place->at, view.size.width(), view.size.height());
  const auto to = seen_at(view.camera, place->at + place->normal * (0.5 * most), view.size.width(), view.size.height());
  if (from && to) lines.normal = {*from, *to};
  for (const SurfacePlace& each : mirrored)
    if (QPolygonF ghost = circle(view, each, radius); !ghost.isEmpty()) lines.mirrored.push_back(std::move(ghost));
  return lines;
}

QRectF RingOverlay::bounds(const OverlayView& view) const {
  const auto all = lines(view);
  if (!all) return {};
  QRectF box = all->radius.boundingRect()
                   .united(all->most.boundingRect())
                   .united(QRectF(all->normal.p1(), all->normal.p2()).normalized());
  for (const QPolygonF& ghost : all->mirrored) box = box.united(ghost.boundingRect());
  return box.adjusted(-kOutline, -kOutline, kOutline, kOutline);
}

void RingOverlay::paint(QPainter& painter, const OverlayView& view) const {
  const auto all = lines(view);
  if (!all) return;
  const QColor light(255, 240, 224, pressed ? 255 : 225);
  for (const QPolygonF& ghost : all->mirrored) outlined(painter, ghost, QColor(255, 240, 224, 150), 1.2, Qt::DashLine);
  if (!all->most.isEmpty()) outlined(painter, all->most, QColor(255, 240, 224, 90), 1);
  if (strength < 0.999) outlined(painter, all->strength, QColor(255, 240, 224, 190), 1.6, Qt::DotLine);
  outlined(painter, all->radius, light, pressed ? 2.2 : 1.6);
  outlined(painter, QPolygonF({all->normal.p1(), all->normal.p2()}), light, 1.4);
}

std::vector<QPolygonF> PlaneOverlay::outlines(const OverlayView& view) const {
  std::vector<QPolygonF> all;
  for (unsigned axis = 0; axis < 3; ++axis) {
    if ((axes & (1U << axis)) == 0) continue;
    QPolygonF outline;
    for (const unsigned corner : {0U, 1U, 3U, 2U, 0U}) {
      Vec3d p = through;
      const auto side = [&](unsigned bit, double low, double high) { return (corner & bit) != 0 ? high : low; };
      if (axis == 0) p = {through.x, side(1, box.low.y, box.high.y), side(2, box.low.z, box.high.z)};
      if (axis == 1) p = {side(1, box.low.x, box.high.x), through.y, side(2, box.low.z, box.high.z)};
      if (axis == 2) p = {side(1, box.low.x, box.high.x), side(2, box.low.y, box.high.y), through.z};
      const auto seen = seen_at(view.camera, p, view.size.width(), view.size.height());
      if (seen) outline.append(*seen);
    }
    if (outline.size() == 5) all.push_back(std::move(outline));
  }
  return all;
}

QRectF PlaneOverlay::bounds(const OverlayView& view) const {
  QRectF box_seen;
  // Seen from its edge, a plane is a line, and its box as good as empty.
  for (const QPolygonF& outline : outlines(view))
    box_seen = box_seen.united(outline.boundingRect().adjusted(-kOutline, -kOutline, kOutline, kOutline));
  return box_seen;
}

void PlaneOverlay::paint(QPainter& painter, const OverlayView& view) const {
  QColor colour = current_theme().accent;
  colour.setAlpha(120);
  for (const QPolygonF& outline : outlines(view)) {
    painter.setPen(QPen(colour, 1.2, Qt::DashLine));
    painter.setBrush(Qt::NoBrush);
    painter.drawPolygon(outline);
  }
}

QRectF AxisOverlay::bounds(const OverlayView& view) const {
  const double side = scaled(AxisBall::kSide);
  const PictureAxes axes = picture_axes(view.camera);
  ball.set_square({view.size.width() - side - 12, 12, side, side});
  ball.set_view({axes.right, axes.up, axes.back});
  return ball.bounds();
}

void AxisOverlay::paint(QPainter& painter, const OverlayView& view) const {
  (void)bounds(view);
  ball.paint(painter);
}

QRectF PillOverlay::bounds(const OverlayView& view) const {
  if (text.isEmpty()) return {};
  const QFontMetricsF metrics(font);
  const QSizeF size(metrics.horizontalAdvance(text) + 26, metrics.height() + 14);
  QPointF corner(16, 14);
  if (beside)
    corner = {std::clamp(beside->x() + 18, 0.0, std::max(0.0, view.size.width() - size.width())),
              std::clamp(beside->y() - size.height() - 12, 0.0, std::max(0.0, view.size.height() - size.height()))};
  return {corner, size};
}

void PillOverlay::paint(QPainter& painter, const OverlayView& view) const {
  const QRectF box = bounds(view);
  if (box.isEmpty()) return;
  const Theme& theme = current_theme();
  QColor ground = theme.window;
  ground.setAlpha(225);
  painter.setPen(QPen(theme.line, 1));
  painter.setBrush(ground);
  painter.drawRoundedRect(box.adjusted(1, 1, -1, -1), 6, 6);
  painter.setFont(font);
  painter.setPen(theme.text);
  painter.drawText(box, Qt::AlignCenter, text);
}

}  // namespace relief::studio
