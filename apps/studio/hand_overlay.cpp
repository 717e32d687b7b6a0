#include "hand_overlay.h"

#include "widgets/theme.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relief::studio {

namespace {

// Shares of the picture's height at the tool.
constexpr double kStylus = 0.3, kRing = 0.022, kArrow = 0.16;
constexpr double kLeastForce = 0.02;     // N that have an arrow
constexpr double kThick = 9, kThin = 4;  // pixels of the stylus at its end and its tip
constexpr double kHead = 11;             // pixels of the arrow's head
constexpr double kTip = 5;               // pixels, radius of the tip's dot
constexpr double kMargin = 8;            // pixels around all of it: outlines, the head, the dot

}  // namespace

std::optional<HandOverlay::Lines> HandOverlay::lines(const OverlayView& view) const {
  if (!shown) return std::nullopt;
  const ServoSample& sample = shown->sample;
  const auto seen = [&](Vec3d p) { return seen_at(view.camera, p, view.size.width(), view.size.height()); };
  const double height = height_at(view.camera, sample.cursor);
  const PictureAxes axes = picture_axes(view.camera);
  // A device without an orientation is held as a right hand holds a pen.
  const Vec3d along = shown->has_orientation ? sample.orientation.turn({0, 0, 1})
                                             : normalized(axes.right * 0.55 + axes.up * 0.7 + axes.back * 0.45);
  const auto tip = seen(sample.cursor), end = seen(sample.cursor + along * (kStylus * height));
  if (!tip || !end) return std::nullopt;
  Lines lines;
  lines.tip = *tip;
  lines.end = *end;
  lines.thick = kThick;
  if (!sample.contact) return lines;
  lines.ring = circle(view, {sample.contact_point, sample.normal}, kRing * height);
  const auto contact = seen(sample.contact_point);
  if (contact) lines.spring = {*tip, *contact};
  const double force = length(sample.force);
  if (contact && force > kLeastForce && shown->force_limit > 0) {
    const double share = std::min(1.0, force / shown->force_limit);
    // Never so short that nobody sees where it points.
    const double long_ = kArrow * height * (0.2 + 0.8 * share);
    if (const auto head = seen(sample.contact_point + sample.force * (long_ / force))) lines.arrow = {*contact, *head};
  }
  return lines;
}

QRectF HandOverlay::bounds(const OverlayView& view) const {
  const auto all = lines(view);
  if (!all) return {};
  QPolygonF points({all->tip, all->end});
  points += all->ring;
  if (!all->spring.isNull()) points << all->spring.p1() << all->spring.p2();
  if (!all->arrow.isNull()) points << all->arrow.p1() << all->arrow.p2();
  const double margin = kMargin + kThick;
  return points.boundingRect().adjusted(-margin, -margin, margin, margin);
}

void HandOverlay::paint(QPainter& painter, const OverlayView& view) const {
  const auto all = lines(view);
  if (!all) return;
  const Theme& theme = current_theme();
  painter.save();
  if (!all->ring.isEmpty()) outlined(painter, all->ring, theme.good, 1.8);

  // The stylus: thin at the tip, light along one side.
  const QPointF way = all->end - all->tip;
  const double length = std::hypot(way.x(), way.y());
  if (length > 1) {
    const QPointF across(-way.y() / length, way.x() / length);
    const QPolygonF body({all->tip + across * (kThin / 2), all->end + across * (kThick / 2),
                          all->end - across * (kThick / 2), all->tip - across * (kThin / 2)});
    QLinearGradient metal(all->end - across * (kThick / 2), all->end + across * (kThick / 2));
    metal.setColorAt(0, QColor(150, 154, 162));
    metal.setColorAt(0.4, QColor(236, 238, 242));
    metal.setColorAt(1, QColor(118, 122, 130));
    painter.setPen(QPen(QColor(0, 0, 0, 130), 1));
    painter.setBrush(metal);
    painter.drawPolygon(body);
    painter.drawEllipse(all->end, kThick / 2, kThick / 2);
  }

  if (!all->spring.isNull() && all->spring.length() > 2)
    outlined(painter, QPolygonF({all->spring.p1(), all->spring.p2()}), theme.bad, 1.6, Qt::DashLine);
  painter.setPen(QPen(QColor(255, 255, 255, 220), 1.2));
  painter.setBrush(shown->sample.contact ? theme.bad : theme.dim);
  painter.drawEllipse(all->tip, kTip, kTip);

  if (!all->arrow.isNull()) {
    const QLineF& arrow = all->arrow;
    const double l = std::max(arrow.length(), 1.0);
    const QPointF along((arrow.dx()) / l, arrow.dy() / l), across(-along.y(), along.x());
    const double head = std::min(kHead, l);
    const QPointF neck = arrow.p2() - along * head;
    outlined(painter, QPolygonF({arrow.p1(), neck}), theme.good, 3);
    painter.setPen(QPen(QColor(0, 0, 0, 110), 1));
    painter.setBrush(theme.good);
    painter.drawPolygon(QPolygonF({arrow.p2(), neck + across * (head * 0.5), neck - across * (head * 0.5)}));
  }
  painter.restore();
}

}  // namespace relief::studio
