#include "force_meter.h"

#include "accessible.h"
#include "theme.h"

#include <QLocale>
#include <QPainter>
#include <QPainterPath>
#include <QStyle>
#include <algorithm>
#include <cmath>

namespace relief::studio {

namespace {

constexpr double kHeadroom = 1.12;  // of the limit: what goes beyond it is seen to do so
constexpr int kTellEvery = 500;     // ms between descriptions; the force comes at 60 Hz, no listener can follow that
constexpr int kMostTicks = 5;

/// 1, 2 or 5 times a power of ten, so that there are at most kMostTicks up to `limit`.
double step_of(double limit) {
  const double least = limit / kMostTicks;
  const double power = std::pow(10, std::floor(std::log10(least)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * power >= least) return factor * power;
  return 10 * power;
}

}  // namespace

ForceMeter::ForceMeter(QWidget* parent) : QWidget(parent) {
  set_accessible_role(this, QAccessible::ProgressBar);
  setObjectName(QStringLiteral("force_meter"));
  setAccessibleName(tr("Force"));
  setAttribute(Qt::WA_TransparentForMouseEvents);
  setSizePolicy(QSizePolicy::Fixed, QSizePolicy::Fixed);
  told_.setSingleShot(true);
  told_.setInterval(kTellEvery);
  // What the force has come to meanwhile.
  connect(&told_, &QTimer::timeout, this, [this] {
    if (accessibleDescription() != description()) tell();
  });
  tell();
}

void ForceMeter::set_force(double newtons) {
  const double force = std::isfinite(newtons) ? std::max(0.0, newtons) : 0;
  if (force == force_) return;
  force_ = force;
  update();
  if (!told_.isActive()) tell();
}

void ForceMeter::set_limit(double newtons) {
  Q_ASSERT(newtons > 0);
  limit_ = newtons;
  update();
  tell();
}

void ForceMeter::set_forces_on(bool on) {
  on_ = on;
  update();
  tell();
}

QString ForceMeter::words() const { return on_ ? tr("%1 N").arg(QLocale().toString(force_, 'f', 1)) : tr("off"); }

QString ForceMeter::description() const {
  return on_ ? tr("%1 of at most %2 N").arg(words(), QLocale().toString(limit_, 'f', 1)) : tr("Forces are off.");
}

void ForceMeter::tell() {
  told_.start();
  describe(this, description());
}

QSize ForceMeter::sizeHint() const { return {scaled(64), scaled(216)}; }

QRectF ForceMeter::column() const {
  const double line = QFontMetricsF(font()).height();
  const double top = line + 16 * text_scale(), bottom = height() - line - 16 * text_scale();
  const double left = 14 * text_scale();
  return QStyle::visualRect(layoutDirection(), rect(), QRectF(left, top, 14 * text_scale(), bottom - top).toRect());
}

double ForceMeter::y(double newtons) const {
  const QRectF box = column();
  return box.bottom() - std::clamp(newtons / (kHeadroom * limit_), 0.0, 1.0) * box.height();
}

void ForceMeter::paintEvent(QPaintEvent*) {
  const Theme& theme = current_theme();
  QPainter painter(this);
  painter.setRenderHint(QPainter::Antialiasing);
  painter.setPen(QPen(theme.line, 1));
  painter.setBrush(theme.panel);
  painter.drawRoundedRect(QRectF(rect()).adjusted(0.5, 0.5, -0.5, -0.5), 1.2 * corner(), 1.2 * corner());
  paint_column(painter);
  paint_scale(painter);
  const double line = QFontMetricsF(font()).height();
  painter.setFont(ui_font(9));
  painter.setPen(theme.dim);
  painter.drawText(QRectF(0, 6 * text_scale(), width(), line), Qt::AlignCenter, tr("Force"));
  painter.setFont(ui_font(10, QFont::DemiBold));
  painter.setPen(on_ && force_ > limit_ ? theme.bad : theme.text);
  painter.drawText(QRectF(0, height() - line - 6 * text_scale(), width(), line), Qt::AlignCenter, words());
}

void ForceMeter::paint_column(QPainter& painter) const {
  const Theme& theme = current_theme();
  const QRectF box = column();
  QPainterPath shape;
  shape.addRoundedRect(box, 4 * text_scale(), 4 * text_scale());
  painter.fillPath(shape, theme.field);
  if (!on_ || force_ <= 0) return;
  QLinearGradient gradient(0, box.bottom(), 0, y(limit_));
  gradient.setColorAt(0, theme.good);
  gradient.setColorAt(0.75, theme.warn);
  gradient.setColorAt(1, theme.bad);
  painter.save();
  painter.setClipRect(QRectF(box.left(), y(force_), box.width(), box.bottom() - y(force_)));
  painter.fillPath(shape, gradient);
  painter.restore();
}

void ForceMeter::paint_scale(QPainter& painter) const {
  const Theme& theme = current_theme();
  const QRectF box = column();
  painter.setFont(ui_font(9));
  const double line = QFontMetricsF(painter.font()).height();
  const bool mirrored = layoutDirection() == Qt::RightToLeft;
  const auto number = [&](double newtons) {
    const double gap = 8 * text_scale();
    const QRectF at = mirrored ? QRectF(2, y(newtons) - line / 2, box.left() - 2 - gap, line)
                               : QRectF(box.right() + gap, y(newtons) - line / 2, width(), line);
    painter.drawText(at, text_flags(layoutDirection(), Qt::AlignLeft), QLocale().toString(newtons, 'g', 3));
  };
  painter.setPen(theme.dim);
  const double step = step_of(limit_);
  for (int i = 0; i * step < limit_; ++i)
    if (y(i * step) - y(limit_) > line) number(i * step);  // else the limit's own number stands there
  painter.setPen(QPen(theme.bad, 1.5 * text_scale()));
  painter.drawLine(QPointF(box.left() - 4 * text_scale(), y(limit_)),
                   QPointF(box.right() + 4 * text_scale(), y(limit_)));
  number(limit_);
}

}  // namespace relief::studio
