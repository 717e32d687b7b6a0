#include "axis_ball.h"

#include "theme.h"

#include <QCoreApplication>
#include <QPainter>
#include <algorithm>
#include <array>

namespace relief::studio {

namespace {

constexpr std::array kAxes = {Axis::X, Axis::Y, Axis::Z, Axis::MinusX, Axis::MinusY, Axis::MinusZ};
constexpr double kDisc = 0.12;   // radius of a disc as a share of the square's side
constexpr double kHover = 1.15;  // of a disc under the mouse

bool negative(Axis axis) { return axis >= Axis::MinusX; }

/// Red, green, blue for x, y, z, as everywhere; dark letters are legible on each.
QColor colour_of(Axis axis) {
  static constexpr std::array<QRgb, 3> kColours = {0xffe0705f, 0xff8fbf5a, 0xff5b9be8};
  return QColor(kColours[static_cast<std::size_t>(axis) % 3]);
}

}  // namespace

Vec3d direction(Axis axis) {
  Vec3d along;
  along[static_cast<std::size_t>(axis) % 3] = negative(axis) ? -1 : 1;
  return along;
}

QString title(Axis axis) {
  static constexpr std::array kTitles = {
      QT_TRANSLATE_NOOP("AxisBall", "From the right (+x)"), QT_TRANSLATE_NOOP("AxisBall", "From the top (+y)"),
      QT_TRANSLATE_NOOP("AxisBall", "From the front (+z)"), QT_TRANSLATE_NOOP("AxisBall", "From the left (-x)"),
      QT_TRANSLATE_NOOP("AxisBall", "From below (-y)"),     QT_TRANSLATE_NOOP("AxisBall", "From behind (-z)")};
  return QCoreApplication::translate("AxisBall", kTitles[static_cast<std::size_t>(axis)]);
}

double AxisBall::disc() const { return kDisc * square_.width(); }

QPointF AxisBall::position(Axis axis) const {
  const Vec3d along = direction(axis);
  const double reach = square_.width() / 2 - kHover * disc() - 1;
  return square_.center() + reach * QPointF(dot(along, view_.right), -dot(along, view_.up));
}

std::optional<Axis> AxisBall::hit(QPointF point) const {
  std::optional<Axis> nearest;
  for (const Axis axis : kAxes) {
    const QPointF way = point - position(axis);
    if (QPointF::dotProduct(way, way) > kHover * disc() * kHover * disc()) continue;
    if (!nearest || depth(axis) > depth(*nearest)) nearest = axis;
  }
  return nearest;
}

void AxisBall::paint(QPainter& painter) const {
  std::array order = kAxes;
  std::ranges::sort(order, {}, [this](Axis axis) { return depth(axis); });
  painter.save();
  painter.setRenderHint(QPainter::Antialiasing);
  for (const Axis axis : order) paint_axis(painter, axis);
  painter.restore();
}

void AxisBall::paint_axis(QPainter& painter, Axis axis) const {
  const Theme& theme = current_theme();
  const QColor colour = mixed(colour_of(axis), theme.panel, std::clamp(0.25 - 0.35 * depth(axis), 0.0, 0.5));
  const QPointF at = position(axis);
  const double radius = disc() * (hovered_ == axis ? kHover : 1);
  const double width = square_.width() / 40;
  if (!negative(axis)) {
    // A dark outline under the light line, or it drowns on pale clay.
    painter.setPen(QPen(QColor(0, 0, 0, 90), 2 * width));
    painter.drawLine(square_.center(), at);
    painter.setPen(QPen(colour, width));
    painter.drawLine(square_.center(), at);
  }
  painter.setPen(QPen(negative(axis) ? colour : QColor(0, 0, 0, 90), negative(axis) ? 1.4 : 1));
  painter.setBrush(negative(axis) ? mixed(theme.panel, colour, 0.35) : colour);
  painter.drawEllipse(at, radius, radius);
  if (hovered_ == axis) {
    painter.setPen(QPen(theme.text, 1.5));
    painter.setBrush(Qt::NoBrush);
    painter.drawEllipse(at, radius, radius);
  }
  if (negative(axis)) return;
  QFont font = ui_font(10, QFont::Bold);
  font.setPixelSize(std::max(1, static_cast<int>(1.25 * radius)));
  painter.setFont(font);
  painter.setPen(QColor(0x14181d));
  const QString letter(QChar(u'X' + static_cast<char16_t>(axis)));
  painter.drawText(QRectF(at.x() - radius, at.y() - radius, 2 * radius, 2 * radius), Qt::AlignCenter, letter);
}

}  // namespace relief::studio
