// What wakes a kiosk, and what it does not listen to.
#include "event_log.h"
#include "kiosk.h"

#include <QApplication>
#include <QCloseEvent>
#include <QFrame>
#include <QKeyEvent>
#include <QLineEdit>
#include <QMouseEvent>

namespace relief::studio {

namespace {

/// ms that the field for the code stays.
constexpr int kCodePatience = 20'000;
/// m: a device that nobody holds trembles by less.
constexpr double kHeld = 0.002;

}  // namespace

void Kiosk::activity() {
  if (page_ == Page::Attract) {
    ++serial_;  // a model that is still being read is not wanted any more
    close_copy();
    show_page(Page::Choose);
    return;
  }
  watch_.activity();
}

void Kiosk::hand_at(Vec3d at) {
  if (!last_hand_) last_hand_ = at;
  if (!(length(at - *last_hand_) > kHeld)) return;  // a reading that is no number is no motion
  last_hand_ = at;
  activity();
}

bool Kiosk::is_input(const QEvent& event) {
  switch (event.type()) {
    case QEvent::MouseMove: {
      // A widget that comes or goes under a pointer makes moves, too.
      const QPointF at = static_cast<const QMouseEvent&>(event).globalPosition();
      return std::exchange(last_pointer_, at) != at;
    }
    case QEvent::MouseButtonPress:
    case QEvent::MouseButtonRelease:
    case QEvent::Wheel:
    case QEvent::KeyPress:
    case QEvent::ShortcutOverride:  // all that comes of a key that chooses a tool
    case QEvent::TouchBegin:
    case QEvent::TouchUpdate:
    case QEvent::TabletPress:
    case QEvent::TabletMove:
    case QEvent::NativeGesture:
      return true;
    default:
      return false;
  }
}

bool Kiosk::eventFilter(QObject*, QEvent* event) {
  switch (event->type()) {
    case QEvent::DragEnter:
    case QEvent::Drop:
    case QEvent::ContextMenu:
    case QEvent::ToolTip:
      return true;
    default:
      break;
  }
  const bool from_outside = event->spontaneous() || event->type() == QEvent::ShortcutOverride;
  if (!from_outside || !is_input(*event)) return false;
  const bool awake = page_ == Page::Choose || (page_ == Page::Model && !watch_.counting_down());
  if (event->type() == QEvent::KeyPress) {
    const auto* key = static_cast<const QKeyEvent*>(event);
    constexpr Qt::KeyboardModifiers kLeave = Qt::ControlModifier | Qt::AltModifier | Qt::ShiftModifier;
    if (key->key() == Qt::Key_L && key->modifiers() == kLeave) {
      ask_code();
      return true;
    }
  }
  activity();
  return !awake && event->type() != QEvent::MouseMove;  // what wakes the kiosk does nothing else
}

void Kiosk::closeEvent(QCloseEvent* event) {
  if (leaving_)
    event->accept();
  else
    event->ignore();
}

void Kiosk::ask_code() {
  code_line_->clear();
  code_frame_->show();
  code_frame_->adjustSize();
  code_frame_->move(rect().center() - code_frame_->rect().center());
  code_frame_->raise();
  code_line_->setFocus();
  code_timer_.start(kCodePatience);
}

void Kiosk::check_code() {
  code_frame_->hide();
  if (code_line_->text() != code_) {
    log_.write(QStringLiteral("a wrong code to leave"));
    return;
  }
  log_.write(QStringLiteral("left with the code"));
  event_log().write(QStringLiteral("exit"));
  leaving_ = true;
  close();
  QCoreApplication::exit(0);
}

}  // namespace relief::studio
