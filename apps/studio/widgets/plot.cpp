#include "plot.h"

#include "accessible.h"
#include "theme.h"

#include <QKeyEvent>
#include <QLocale>
#include <QPainter>
#include <algorithm>
#include <cmath>

namespace relief::studio {

namespace {

constexpr double kHeadroom = 1.15;   // of the limit: what goes beyond it is seen to do so
constexpr double kFillShare = 0.22;  // of the signal's colour under its line
constexpr int kDescribeEvery = 500;  // ms; telemetry comes at 60 Hz, no listener can follow that
constexpr double kFineScrub = 0.1;   // Shift

/// The rows that the line covers in one column of pixels.
struct Band {
  double top, bottom;
  [[nodiscard]] bool empty() const { return top > bottom; }
  [[nodiscard]] double share_of_row(int row) const {
    return std::clamp(std::min(bottom, row + 1.0) - std::max(top, double(row)), 0.0, 1.0);
  }
};

QColor colour_of(PlotView::Colour colour) {
  const Theme& theme = current_theme();
  switch (colour) {
    case PlotView::Colour::Good:
      return theme.good;
    case PlotView::Colour::Blue:
      return curve_blue(theme);
    case PlotView::Colour::Accent:
      break;
  }
  return theme.accent;
}

}  // namespace

PlotView::PlotView(const QString& title, Colour colour, QWidget* parent)
    : QWidget(parent),
      title_(title),
      colour_(colour),
      format_([](double value) { return QLocale().toString(value, 'g', 3); }) {
  setObjectName(QStringLiteral("plot.") + title);
  set_accessible_role(this, QAccessible::Chart);
  setAccessibleName(title);
  setToolTip(tr("Freeze it, then drag or use the arrows to read a moment."));
  setFocusPolicy(Qt::ClickFocus);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
}

void PlotView::set_format(std::function<QString(double)> format) {
  format_ = std::move(format);
  update();
}

void PlotView::set_text(const QString& text) {
  if (text == text_) return;
  text_ = text;
  if (!described_.isValid() || described_.elapsed() >= kDescribeEvery) describe_value();
  update();
}

void PlotView::set_limit(std::optional<double> limit) {
  limit_ = limit;
  update();
}

void PlotView::set_seconds(double seconds) {
  Q_ASSERT(seconds > 0);
  seconds_ = seconds;
  update();
}

void PlotView::append(std::span<const Sample> samples) {
  ring_.append(samples);
  if (!frozen()) update();
}

void PlotView::clear() {
  ring_.clear();
  set_frozen(false);
  update();
}

void PlotView::set_frozen(bool frozen) {
  if (frozen == this->frozen()) return;
  frozen_ = frozen ? std::optional(ring_) : std::nullopt;
  cursor_.reset();
  setFocusPolicy(frozen ? Qt::StrongFocus : Qt::ClickFocus);
  setCursor(frozen ? Qt::SplitHCursor : Qt::ArrowCursor);
  describe_value();
  update();
}

void PlotView::set_cursor(std::optional<double> time) {
  if (cursor_ == time) return;
  cursor_ = time;
  describe_value();
  update();
}

std::optional<float> PlotView::value_at_cursor() const {
  return frozen() && cursor_ ? shown().at(*cursor_) : std::nullopt;
}

QString PlotView::words() const {
  const auto value = value_at_cursor();
  if (!value) return text_;
  const double ago = shown().newest().time - *cursor_;
  return tr("%1, %2 s before").arg(format_(double(*value)), QLocale().toString(ago, 'f', 2));
}

void PlotView::describe_value() {
  describe(this, words());
  described_.start();
}

QRectF PlotView::box() const {
  const int margin = scaled(7);
  return rect().adjusted(margin, QFontMetrics(font()).height() + scaled(3), -margin, -scaled(5));
}

PlotView::View PlotView::view_of(std::size_t columns) const {
  const double column = seconds_ / static_cast<double>(columns);
  const double newest = shown().empty() ? 0 : shown().newest().time;
  const double to = (std::floor(newest / column) + 1) * column;
  return {.box = box(), .from = to - seconds_, .to = to, .low = 0, .high = 1};
}

void PlotView::scrub(double time) {
  if (!frozen() || shown().empty()) return;
  const double newest = shown().newest().time;
  set_cursor(std::clamp(time, std::max(shown()[0].time, newest - seconds_), newest));
  emit scrubbed(*cursor_);
}

void PlotView::scrub_to(double x) {
  const View view = view_of(static_cast<std::size_t>(std::max(1.0, box().width())));
  scrub(view.from + (x - view.box.left()) / view.box.width() * (view.to - view.from));
}

void PlotView::mousePressEvent(QMouseEvent* event) { scrub_to(event->position().x()); }

void PlotView::mouseMoveEvent(QMouseEvent* event) {
  if (event->buttons().testFlag(Qt::LeftButton)) scrub_to(event->position().x());
}

void PlotView::keyPressEvent(QKeyEvent* event) {
  if (!frozen() || shown().empty()) return QWidget::keyPressEvent(event);
  const double step = seconds_ / 100 * (event->modifiers().testFlag(Qt::ShiftModifier) ? kFineScrub : 1);
  const double at = cursor_.value_or(shown().newest().time);
  switch (event->key()) {
    case Qt::Key_Left:
      return scrub(at - step);
    case Qt::Key_Right:
      return scrub(at + step);
    case Qt::Key_Home:
      return scrub(shown()[0].time);
    case Qt::Key_End:
      return scrub(shown().newest().time);
    default:
      QWidget::keyPressEvent(event);
  }
}

QSize PlotView::sizeHint() const { return {scaled(240), QFontMetrics(font()).height() + scaled(36)}; }

QSize PlotView::minimumSizeHint() const { return {scaled(120), sizeHint().height()}; }

void PlotView::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  paint_field(painter, rect(), hasFocus());
  const QSize pixels = (box().size() * devicePixelRatioF()).toSize().expandedTo({1, 1});
  const auto columns = static_cast<std::size_t>(pixels.width());
  View view = view_of(columns);
  const std::vector<Extent> extents = shown().envelope(view.from, view.to, columns);
  if (limit_) view.high = kHeadroom * *limit_;
  for (const Extent& extent : extents) {
    if (extent.empty()) continue;
    view.low = std::min(view.low, double(extent.low));
    view.high = std::max(view.high, double(extent.high));
  }
  painter.drawImage(view.box, signal_picture(view, extents, pixels));
  paint_limit(painter, view);
  paint_cursor(painter, view);
  paint_texts(painter);
}

// By hand, column by column: stroking a noisy line of 500 points takes QPainter some milliseconds.
QImage PlotView::signal_picture(View view, std::span<const Extent> extents, QSize pixels) const {
  view.box = QRectF({0, 0}, pixels);
  const QColor line = colour_of(colour_), field = current_theme().field, area = mixed(field, line, kFillShare);
  const double half = 0.6 * text_scale() * devicePixelRatioF(), base = view.y(0);
  QImage picture(pixels, QImage::Format_RGB32);
  picture.fill(field);
  Band before{0, -1};
  for (std::size_t i = 0; i < extents.size(); ++i) {
    if (extents[i].empty()) {
      before = {0, -1};
      continue;
    }
    const Band own{view.y(double(extents[i].high)) - half, view.y(double(extents[i].low)) + half};
    const Band band = before.empty() ? own : Band{std::min(own.top, before.bottom), std::max(own.bottom, before.top)};
    before = own;
    const int last = std::min(static_cast<int>(std::ceil(std::max(band.bottom, base))), pixels.height());
    for (int row = std::max(0, static_cast<int>(band.top)); row < last; ++row) {
      const double cover = band.share_of_row(row);
      const QColor& under = row + 0.5 > band.top && row + 0.5 < base ? area : field;
      picture.setPixel(static_cast<int>(i), row, (cover <= 0 ? under : mixed(under, line, cover)).rgb());
    }
  }
  return picture;
}

void PlotView::paint_limit(QPainter& painter, const View& view) const {
  if (!limit_) return;
  painter.setPen(QPen(current_theme().bad, 1, Qt::DashLine));
  const double y = std::round(view.y(*limit_)) + 0.5;
  painter.drawLine(QPointF(view.box.left(), y), QPointF(view.box.right(), y));
}

void PlotView::paint_cursor(QPainter& painter, const View& view) const {
  const auto value = value_at_cursor();
  if (!value) return;
  const double x = view.x(*cursor_);
  painter.setPen(QPen(current_theme().text, 1));
  painter.drawLine(QPointF(x, view.box.top()), QPointF(x, view.box.bottom()));
  painter.setBrush(colour_of(colour_));
  painter.drawEllipse(QPointF(x, view.y(double(*value))), 3 * text_scale(), 3 * text_scale());
}

void PlotView::paint_texts(QPainter& painter) const {
  const QRect row(scaled(8), scaled(2), width() - 2 * scaled(8), QFontMetrics(font()).height());
  const QString text = words();
  const QFontMetrics metrics(font());
  painter.setPen(current_theme().text);
  painter.drawText(row, text_flags(layoutDirection(), Qt::AlignRight), text);
  painter.setPen(current_theme().dim);
  const int room = row.width() - metrics.horizontalAdvance(text) - scaled(8);
  painter.drawText(row, text_flags(layoutDirection(), Qt::AlignLeft), metrics.elidedText(title_, Qt::ElideRight, room));
}

}  // namespace relief::studio
