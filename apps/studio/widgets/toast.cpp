#include "toast.h"

#include "accessible.h"
#include "theme.h"

#include <QEvent>
#include <QGraphicsOpacityEffect>
#include <QHBoxLayout>
#include <QLabel>
#include <QPropertyAnimation>
#include <algorithm>

namespace relief::studio {

namespace {

constexpr int kFade = 250;   // ms
constexpr int kMargin = 18;  // pixels from the window's edge

}  // namespace

Toast::Toast(QWidget* window)
    : QFrame(window),
      label_(new QLabel),
      opacity_(new QGraphicsOpacityEffect(this)),
      fade_(new QPropertyAnimation(opacity_, "opacity", this)),
      shown_(this) {
  set_accessible_role(this, QAccessible::Notification);
  setObjectName(QStringLiteral("toast"));
  setProperty("role", QStringLiteral("pill"));
  setAttribute(Qt::WA_TransparentForMouseEvents);
  setGraphicsEffect(opacity_);
  label_->setObjectName(QStringLiteral("toast.words"));
  label_->setAlignment(Qt::AlignCenter);
  label_->setWordWrap(true);
  auto* layout = new QHBoxLayout(this);
  layout->setContentsMargins(14, 8, 14, 8);
  layout->addWidget(label_);
  fade_->setDuration(kFade);
  fade_->setStartValue(1.0);
  fade_->setEndValue(0.0);
  connect(fade_, &QPropertyAnimation::finished, this, &QWidget::hide);
  shown_.setSingleShot(true);
  shown_.setInterval(kShownFor);
  connect(&shown_, &QTimer::timeout, this, &Toast::vanish);
  window->installEventFilter(this);
  hide();
}

void Toast::say(const QString& words, const QRect& keep_clear) {
  fade_->stop();
  opacity_->setOpacity(1);
  keep_clear_ = keep_clear;
  label_->setText(words);
  setAccessibleName(words);
  place();
  show();
  raise();
  shown_.start();
  QAccessibleEvent event(this, QAccessible::Alert);
  QAccessible::updateAccessibility(&event);
}

void Toast::vanish() {
  if (reduced_motion())
    hide();
  else
    fade_->start();
}

void Toast::place() {
  const QWidget& window = *parentWidget();
  const int most = window.width() - 2 * scaled(kMargin);
  const int width = std::min(most, label_->fontMetrics().horizontalAdvance(label_->text()) + scaled(32));
  const int height =
      layout()->hasHeightForWidth() ? layout()->totalHeightForWidth(width) : layout()->sizeHint().height();
  QRect place((window.width() - width) / 2, window.height() - height - scaled(kMargin), width, height);
  if (place.intersects(keep_clear_)) place.moveTop(scaled(kMargin));
  setGeometry(place);
}

bool Toast::eventFilter(QObject* object, QEvent* event) {
  if (object == parentWidget() && event->type() == QEvent::Resize && isVisible()) place();
  return QFrame::eventFilter(object, event);
}

}  // namespace relief::studio
