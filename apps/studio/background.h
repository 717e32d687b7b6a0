// Work that a window must not wait for.
#pragma once

#include <relief/base/error.h>

#include <QCoreApplication>
#include <QPointer>
#include <QThreadPool>
#include <functional>

namespace relief::studio {

/// Runs `work` on another thread, then `done` on that of `owner`, unless the owner is gone by then.
template <typename Owner>
void in_background(Owner* owner, std::function<Status()> work, std::function<void(const Status&)> done) {
  QThreadPool::globalInstance()->start([guard = QPointer<Owner>(owner), application = QCoreApplication::instance(),
                                        work = std::move(work), done = std::move(done)] {
    const Status status = work();
    QMetaObject::invokeMethod(
        application,
        [guard, status, done] {
          if (guard) done(status);
        },
        Qt::QueuedConnection);
  });
}

}  // namespace relief::studio
