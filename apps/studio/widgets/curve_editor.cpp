#include "curve_editor.h"

#include "accessible.h"
#include "theme.h"

#include <QFocusEvent>
#include <QKeyEvent>
#include <QPainter>
#include <QPainterPath>
#include <algorithm>
#include <cmath>

namespace relief::studio {

namespace {

constexpr std::array kHandles = {CurveEditor::Handle::Low, CurveEditor::Handle::Bend, CurveEditor::Handle::High};
constexpr double kLeastGap = 0.05;                         // between low and high: a curve that a hand can still dose
constexpr double kLeastExponent = 0.2, kMostExponent = 5;  // beyond, the curve is a step
constexpr double kArrow = 0.05, kFineArrow = 0.01;         // of the plot's width or height

PressureCurve within_reach(PressureCurve curve) {
  curve.low = std::clamp(curve.low, 0.0, 1 - kLeastGap);
  curve.high = std::clamp(curve.high, curve.low + kLeastGap, 1.0);
  curve.exponent = std::clamp(curve.exponent, kLeastExponent, kMostExponent);
  return curve;
}

/// The exponent whose curve has this output half way between low and high.
double exponent_through(double output) { return std::log(std::clamp(output, 1e-3, 1 - 1e-3)) / std::log(0.5); }

}  // namespace

CurveEditor::CurveEditor(QWidget* parent) : QWidget(parent) {
  setObjectName(QStringLiteral("pressure_curve"));
  set_accessible_role(this, QAccessible::Chart);
  setAccessibleName(tr("Pressure curve"));
  setFocusPolicy(Qt::StrongFocus);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  setToolTip(
      tr("How strongly the tool acts as you press harder.\n"
         "Drag a circle, or Tab to it and use the arrows; Home makes the line straight."));
  describe_curve();
}

void CurveEditor::set_curve(const PressureCurve& curve) {
  curve_ = within_reach(curve);
  describe_curve();
  update();
}

void CurveEditor::set_live_pressure(std::optional<double> pressure) {
  if (pressure) pressure = std::clamp(*pressure, 0.0, 1.0);
  if (live_ == pressure) return;
  live_ = pressure;
  update();
}

void CurveEditor::describe_curve() {
  const auto percent = [](double share) { return static_cast<int>(std::lround(100 * share)); };
  const QString names[] = {tr("start"), tr("bend"), tr("end")};
  const QString words = tr("Starts at %1 % pressure, full at %2 %, exponent %3. Chosen: %4.")
                            .arg(percent(curve_.low))
                            .arg(percent(curve_.high))
                            .arg(curve_.exponent, 0, 'f', 2)
                            .arg(names[static_cast<int>(current_)]);
  describe(this, words);
}

QRectF CurveEditor::plot() const {
  const double margin = 8 * text_scale();
  return QRectF(rect()).adjusted(margin, margin, -margin, -margin);
}

QPointF CurveEditor::to_pixel(QPointF point) const {
  const QRectF box = plot();
  return {box.left() + point.x() * box.width(), box.bottom() - point.y() * box.height()};
}

QPointF CurveEditor::from_pixel(QPointF pixel) const {
  const QRectF box = plot();
  return {(pixel.x() - box.left()) / box.width(), (box.bottom() - pixel.y()) / box.height()};
}

QPointF CurveEditor::position(Handle handle) const {
  switch (handle) {
    case Handle::Low:
      return to_pixel({curve_.low, 0});
    case Handle::High:
      return to_pixel({curve_.high, 1});
    case Handle::Bend:
      break;
  }
  const double middle = (curve_.low + curve_.high) / 2;
  return to_pixel({middle, curve_(middle)});
}

void CurveEditor::choose(Handle handle) {
  current_ = handle;
  describe_curve();
  update();
}

void CurveEditor::move_to(QPointF point) {
  PressureCurve curve = curve_;
  switch (current_) {
    case Handle::Low:
      curve.low = std::clamp(point.x(), 0.0, curve.high - kLeastGap);
      break;
    case Handle::High:
      curve.high = std::clamp(point.x(), curve.low + kLeastGap, 1.0);
      break;
    case Handle::Bend:
      curve.exponent = exponent_through(point.y());
      break;
  }
  edit(curve);
}

void CurveEditor::edit(const PressureCurve& curve) {
  set_curve(curve);
  emit curveEdited(curve_);
}

void CurveEditor::mousePressEvent(QMouseEvent* event) {
  if (event->button() != Qt::LeftButton) return;
  const auto distance = [this, event](Handle handle) {
    const QPointF way = position(handle) - event->position();
    return QPointF::dotProduct(way, way);
  };
  choose(*std::ranges::min_element(kHandles, {}, distance));
  dragging_ = true;
  move_to(from_pixel(event->position()));
}

void CurveEditor::mouseMoveEvent(QMouseEvent* event) {
  if (dragging_) move_to(from_pixel(event->position()));
}

void CurveEditor::mouseReleaseEvent(QMouseEvent*) {
  if (!dragging_) return;
  dragging_ = false;
  emit editFinished();
}

void CurveEditor::keyPressEvent(QKeyEvent* event) {
  const double step = event->modifiers().testFlag(Qt::ShiftModifier) ? kFineArrow : kArrow;
  QPointF point = from_pixel(position(current_));
  switch (event->key()) {
    case Qt::Key_Left:
      point.rx() -= step;
      break;
    case Qt::Key_Right:
      point.rx() += step;
      break;
    case Qt::Key_Up:
      point += QPointF(step, step);
      break;
    case Qt::Key_Down:
      point -= QPointF(step, step);
      break;
    case Qt::Key_Home:
      edit({});
      return emit editFinished();
    default:
      return QWidget::keyPressEvent(event);
  }
  if (current_ == Handle::Bend && (event->key() == Qt::Key_Left || event->key() == Qt::Key_Right)) return;
  move_to(point);
  emit editFinished();
}

bool CurveEditor::focusNextPrevChild(bool next) {
  const int to = static_cast<int>(current_) + (next ? 1 : -1);
  if (to < 0 || to >= static_cast<int>(kHandles.size())) return QWidget::focusNextPrevChild(next);
  choose(kHandles[static_cast<std::size_t>(to)]);
  return true;
}

void CurveEditor::focusInEvent(QFocusEvent* event) {
  if (event->reason() == Qt::TabFocusReason) choose(Handle::Low);
  if (event->reason() == Qt::BacktabFocusReason) choose(Handle::High);
  QWidget::focusInEvent(event);
}

QSize CurveEditor::sizeHint() const { return {scaled(240), scaled(91)}; }

QSize CurveEditor::minimumSizeHint() const { return {scaled(120), scaled(91)}; }

void CurveEditor::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  paint_field(painter, rect(), hasFocus());
  const Theme& theme = current_theme();
  painter.setPen(QPen(theme.line, 1));
  for (const double x : {0.25, 0.5, 0.75}) painter.drawLine(to_pixel({x, 0}), to_pixel({x, 1}));
  paint_texts(painter);
  if (live_) {
    painter.setPen(QPen(theme.good, 1, Qt::DashLine));
    const double x = std::round(to_pixel({*live_, 0}).x()) + 0.5;  // a whole column of pixels: sharp
    painter.drawLine(QPointF(x, plot().top()), QPointF(x, plot().bottom()));
  }
  paint_curve(painter);
  paint_handles(painter);
}

void CurveEditor::paint_curve(QPainter& painter) const {
  constexpr int kPieces = 96;
  QPainterPath path(to_pixel({0, curve_(0)}));
  const auto piece = [&](double x) { path.lineTo(to_pixel({x, curve_(x)})); };
  piece(curve_.low);
  for (int i = 1; i <= kPieces; ++i) piece(curve_.low + (curve_.high - curve_.low) * i / kPieces);
  piece(1);
  painter.setBrush(Qt::NoBrush);
  painter.setPen(QPen(isEnabled() ? current_theme().accent : current_theme().dim, 1.8 * text_scale()));
  painter.drawPath(path);
  if (!live_) return;
  painter.setPen(Qt::NoPen);
  painter.setBrush(current_theme().good);
  painter.drawEllipse(to_pixel({*live_, curve_(*live_)}), 3 * text_scale(), 3 * text_scale());
}

void CurveEditor::paint_handles(QPainter& painter) const {
  const Theme& theme = current_theme();
  for (const Handle handle : kHandles) {
    const bool chosen = handle == current_ && (hasFocus() || dragging_);
    const double radius = (chosen ? 5 : 4) * text_scale();
    painter.setPen(QPen(isEnabled() ? theme.accent : theme.dim, 1.6 * text_scale()));
    painter.setBrush(chosen ? theme.accent : theme.field);
    painter.drawEllipse(position(handle), radius, radius);
  }
}

void CurveEditor::paint_texts(QPainter& painter) const {
  const QRect box = plot().toRect().adjusted(scaled(2), 0, -scaled(2), -scaled(2));
  const auto text = [&](Qt::Alignment alignment, const QString& words) {
    const int place = static_cast<int>(alignment.toInt());
    // On ground of its own, or a line of the grid would cross it.
    painter.fillRect(painter.boundingRect(box, place, words), current_theme().field);
    painter.setPen(current_theme().dim);
    painter.drawText(box, place, words);
  };
  text(Qt::AlignLeft | Qt::AlignTop, tr("output"));
  text(Qt::AlignRight | Qt::AlignBottom, tr("pressure"));
}

}  // namespace relief::studio
