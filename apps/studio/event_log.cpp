#include "event_log.h"

#include <QElapsedTimer>
#include <QJsonDocument>

namespace relief::studio {

bool EventLog::open(const QString& file) {
  file_.setFileName(file);
  return file_.open(QIODevice::WriteOnly | QIODevice::Truncate);
}

void EventLog::write(const QString& event, QJsonObject facts) {
  if (!active()) return;
  static const QElapsedTimer started = [] {
    QElapsedTimer timer;
    timer.start();
    return timer;
  }();
  facts.insert(QStringLiteral("event"), event);
  facts.insert(QStringLiteral("ms"), started.elapsed());
  file_.write(QJsonDocument(facts).toJson(QJsonDocument::Compact) + '\n');
  file_.flush();
}

EventLog& event_log() {
  static EventLog log;
  return log;
}

}  // namespace relief::studio
