#include "value_bar.h"

#include "accessible.h"
#include "theme.h"

#include <QApplication>
#include <QKeyEvent>
#include <QLineEdit>
#include <QPainter>
#include <QPainterPath>
#include <QToolTip>
#include <algorithm>
#include <cmath>

namespace relief::studio {

namespace {

constexpr int kSteps = 1000;         // of the slider; a screen's worth of pixels, so that no step is seen
constexpr double kFine = 0.1;        // Shift
constexpr double kFillShare = 0.35;  // of accent in the filled part; text on it keeps 4.5:1 in both themes
constexpr double kPadding = 9;       // pixels from the border to the texts

}  // namespace

ValueBar::ValueBar(const QString& name, QWidget* parent) : QSlider(Qt::Horizontal, parent), title_(name) {
  setObjectName(name);
  setAccessibleName(name);
  setRange(0, kSteps);
  setSingleStep(kSteps / 100);
  setPageStep(kSteps / 10);
  setFocusPolicy(Qt::StrongFocus);
  setCursor(Qt::SizeHorCursor);
  setAttribute(Qt::WA_Hover);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  // What moves the slider from outside: its keys, and assistive tools.
  connect(this, &QSlider::valueChanged, this, [this](int position) {
    if (storing_) return;
    edit(value_at(double(position) / kSteps));
    emit editFinished();
  });
  store(min_);
}

void ValueBar::set_range(double min, double max, Scale scale, double step) {
  Q_ASSERT(min < max && (scale == Scale::Linear || min > 0));
  min_ = min;
  max_ = max;
  scale_ = scale;
  const bool stepped = scale == Scale::Linear && step > 0;
  const double share = stepped ? step / (max - min) : 0.01;
  setSingleStep(std::clamp(static_cast<int>(std::lround(kSteps * share)), 1, kSteps));
  store(value_);
}

void ValueBar::set_format(ValueFormat format) {
  format_ = std::move(format);
  store(value_);
  updateGeometry();
}

void ValueBar::set_title(const QString& title) {
  title_ = title;
  updateGeometry();
  update();
}

void ValueBar::set_help(const QString& help, const QString& key) {
  const QString first = key.isEmpty() ? help : QStringLiteral("%1 (%2)").arg(help, key);
  setToolTip(first + u'\n' + tr("Drag to change, with Shift finely. Double click or Enter to type."));
}

void ValueBar::set_real_value(double value) { store(value); }

QString ValueBar::text() const { return format_.text(value_); }

double ValueBar::share_of(double value) const {
  const double share =
      scale_ == Scale::Linear ? (value - min_) / (max_ - min_) : std::log(value / min_) / std::log(max_ / min_);
  return std::clamp(share, 0.0, 1.0);
}

double ValueBar::value_at(double share) const {
  const double s = std::clamp(share, 0.0, 1.0);
  return scale_ == Scale::Linear ? min_ + (max_ - min_) * s : min_ * std::pow(max_ / min_, s);
}

double ValueBar::share_at(double x) const {
  const double share = x / std::max(1, width());
  return isRightToLeft() ? 1 - share : share;
}

void ValueBar::store(double value) {
  value_ = std::clamp(value, min_, max_);
  storing_ = true;
  setValue(static_cast<int>(std::lround(kSteps * share_of(value_))));
  storing_ = false;
  describe(this, text());
  update();
}

void ValueBar::edit(double value) {
  store(value);
  emit valueEdited(value_);
}

bool ValueBar::event(QEvent* event) {
  if (event->type() == QEvent::StyleChange || event->type() == QEvent::FontChange) updateGeometry();
  // Esc belongs to an open drag, not to whatever shortcut the window has on it.
  if (event->type() == QEvent::ShortcutOverride && press_ && static_cast<QKeyEvent*>(event)->key() == Qt::Key_Escape)
    event->accept();
  return QSlider::event(event);
}

void ValueBar::mousePressEvent(QMouseEvent* event) {
  if (event->button() == Qt::LeftButton)
    press_ = Press{.x = event->position().x(), .share = share_of(value_), .value = value_};
  else if (press_ && event->button() == Qt::RightButton)
    take_back_drag();
  event->accept();
}

void ValueBar::mouseMoveEvent(QMouseEvent* event) {
  if (!press_) return;
  const double way = std::abs(event->position().x() - press_->x);
  if (!press_->dragged && way < QApplication::startDragDistance() / 2.0) return;
  press_->dragged = true;
  drag_to(*event);
}

void ValueBar::drag_to(const QMouseEvent& event) {
  const double fine = event.modifiers().testFlag(Qt::ShiftModifier) ? kFine : 1;
  press_->share += fine * (share_at(event.position().x()) - share_at(press_->x));
  press_->x = event.position().x();
  edit(value_at(press_->share));
}

void ValueBar::mouseReleaseEvent(QMouseEvent* event) {
  if (event->button() != Qt::LeftButton || !press_) return;
  before_click_ = press_->value;
  if (!press_->dragged) edit(value_at(share_at(event->position().x())));
  press_.reset();
  emit editFinished();
}

void ValueBar::take_back_drag() {
  const double before = press_->value;
  press_.reset();
  edit(before);
  emit editFinished();
}

void ValueBar::mouseDoubleClickEvent(QMouseEvent* event) {
  if (event->button() != Qt::LeftButton) return;
  if (value_ != before_click_) {  // the first click of the two has jumped
    edit(before_click_);
    emit editFinished();
  }
  start_typing();
}

void ValueBar::keyPressEvent(QKeyEvent* event) {
  switch (event->key()) {
    case Qt::Key_Return:
    case Qt::Key_Enter:
    case Qt::Key_F2:
      return start_typing();
    case Qt::Key_Escape:
      return press_ ? take_back_drag() : event->ignore();
    case Qt::Key_Left:
    case Qt::Key_Right:
    case Qt::Key_Up:
    case Qt::Key_Down:
      break;
    default:
      return QSlider::keyPressEvent(event);
  }
  if (!event->modifiers().testFlag(Qt::ShiftModifier)) return QSlider::keyPressEvent(event);
  const bool towards_max =
      event->key() == Qt::Key_Up || event->key() == (isRightToLeft() ? Qt::Key_Left : Qt::Key_Right);
  edit(value_at(share_of(value_) + (towards_max ? kFine : -kFine) * singleStep() / kSteps));
  emit editFinished();
}

void ValueBar::wheelEvent(QWheelEvent* event) {
  // Without focus the wheel belongs to the panel that scrolls.
  if (hasFocus())
    QSlider::wheelEvent(event);
  else
    event->ignore();
}

void ValueBar::start_typing() {
  if (editor_) return;
  editor_ = new QLineEdit(text(), this);
  editor_->setObjectName(objectName() + QStringLiteral(".editor"));
  editor_->setAccessibleName(tr("%1, type a value").arg(accessibleName()));
  editor_->setGeometry(rect());
  editor_->selectAll();
  // For Esc, which the editor itself leaves to whatever shortcut the window has on it.
  editor_->installEventFilter(this);
  connect(editor_, &QLineEdit::editingFinished, this, [this] { finish_typing(true); });
  editor_->show();
  editor_->setFocus();
}

bool ValueBar::eventFilter(QObject* object, QEvent* event) {
  if (object != editor_) return QSlider::eventFilter(object, event);
  const bool override = event->type() == QEvent::ShortcutOverride;
  if (!override && event->type() != QEvent::KeyPress) return false;
  const auto* key = static_cast<QKeyEvent*>(event);
  if (key->key() != Qt::Key_Escape) return false;
  event->accept();
  if (!override) finish_typing(false);
  return true;
}

void ValueBar::finish_typing(bool keep) {
  if (!editor_) return;
  const auto typed = format_.parse(editor_->text());
  if (keep && !typed && editor_->hasFocus()) {
    QToolTip::showText(editor_->mapToGlobal(QPoint(0, editor_->height())),
                       tr("\"%1\" is not a value here. Type for example %2.").arg(editor_->text(), format_.example),
                       this);
    return editor_->selectAll();
  }
  const bool had_focus = editor_->hasFocus();
  QLineEdit* editor = editor_;
  editor_ = nullptr;  // hiding it ends the editing once more
  editor->hide();
  editor->deleteLater();
  if (had_focus) setFocus();
  if (!keep || !typed) return;
  edit(*typed);
  emit editFinished();
}

QSize ValueBar::sizeHint() const {
  const QFontMetrics metrics(font());
  return {std::max(scaled(150), minimumSizeHint().width()), metrics.height() + scaled(9)};
}

QSize ValueBar::minimumSizeHint() const {
  const QFontMetrics metrics(font());
  const int value_width =
      std::max(metrics.horizontalAdvance(format_.text(min_)), metrics.horizontalAdvance(format_.text(max_)));
  const int gap = scaled(2 * kPadding + 8);
  return {metrics.horizontalAdvance(title_) + value_width + gap, metrics.height() + scaled(9)};
}

void ValueBar::resizeEvent(QResizeEvent* event) {
  QSlider::resizeEvent(event);
  if (editor_) editor_->setGeometry(rect());
}

void ValueBar::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  paint_field(painter, rect(), false);
  paint_fill(painter);
  if (hasFocus()) {
    painter.setBrush(Qt::NoBrush);
    painter.setPen(QPen(current_theme().accent, 2));
    painter.drawRoundedRect(QRectF(rect()).adjusted(1, 1, -1, -1), corner(), corner());
  }
  paint_texts(painter);
}

void ValueBar::paint_fill(QPainter& painter) const {
  const Theme& theme = current_theme();
  const QRectF inner = QRectF(rect()).adjusted(1, 1, -1, -1);
  QRectF filled = inner;
  filled.setWidth(inner.width() * share_of(value_));
  if (isRightToLeft()) filled.moveRight(inner.right());
  QPainterPath clip;
  clip.addRoundedRect(inner, corner() - 1, corner() - 1);
  const QColor accent = isEnabled() ? theme.accent : theme.dim;
  painter.save();
  painter.setClipPath(clip);
  painter.fillRect(filled, mixed(theme.field, accent, kFillShare));
  const double underline = 2 * text_scale();
  painter.fillRect(QRectF(filled.left(), filled.bottom() - underline, filled.width(), underline), accent);
  painter.restore();
}

void ValueBar::paint_texts(QPainter& painter) const {
  const Theme& theme = current_theme();
  painter.setPen(isEnabled() ? theme.text : theme.dim);
  const QRect inside = rect().adjusted(scaled(kPadding), 0, -scaled(kPadding), 0);
  const QString value = text();
  const QFontMetrics metrics(font());
  const int for_title = inside.width() - metrics.horizontalAdvance(value) - scaled(6);
  painter.drawText(inside, text_flags(layoutDirection(), Qt::AlignLeft),
                   metrics.elidedText(title_, Qt::ElideRight, for_title));
  painter.drawText(inside, text_flags(layoutDirection(), Qt::AlignRight), value);
}

}  // namespace relief::studio
