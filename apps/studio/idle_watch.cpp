#include "idle_watch.h"

namespace relief::studio {

IdleWatch::IdleWatch(QObject* parent) : QObject(parent) {
  timer_.setInterval(1000);
  connect(&timer_, &QTimer::timeout, this, &IdleWatch::tick);
}

void IdleWatch::start(int patience) {
  patience_ = patience;
  idle_ = 0;
  timer_.start();
}

void IdleWatch::stop() { timer_.stop(); }

void IdleWatch::activity() {
  const bool was = counting_down();
  idle_ = 0;
  if (was) emit resumed();
}

void IdleWatch::tick() {
  ++idle_;
  const int left = patience_ + kCountdown - idle_;
  if (left > kCountdown) return;
  if (left >= 0) {
    emit countdown(left);
    return;
  }
  stop();
  emit expired();
}

}  // namespace relief::studio
