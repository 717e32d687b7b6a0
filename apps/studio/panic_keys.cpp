#include "panic_keys.h"

#include <QCoreApplication>
#include <QKeyEvent>
#include <utility>

namespace relief::studio {

PanicKeys::PanicKeys(std::function<void()> off, QObject* parent) : QObject(parent), off_(std::move(off)) {}

void PanicKeys::set_on(bool on) {
  if (std::exchange(on_, on) == on) return;
  if (on)
    QCoreApplication::instance()->installEventFilter(this);
  else
    QCoreApplication::instance()->removeEventFilter(this);
}

bool PanicKeys::eventFilter(QObject* object, QEvent* event) {
  // An event comes here for the window first, and again for each widget that it is offered to.
  if (event->type() != QEvent::KeyPress || !object->isWindowType()) return false;
  const auto* key = static_cast<QKeyEvent*>(event);
  if (key->isAutoRepeat()) return false;
  if (key->key() == Qt::Key_Pause) off_();
  if (key->key() != Qt::Key_Escape) {
    escape_ = 0;
  } else if (escape_ != 0 && key->timestamp() - escape_ <= kTwice) {
    escape_ = 0;
    off_();
  } else {
    escape_ = key->timestamp();
  }
  return false;
}

}  // namespace relief::studio
