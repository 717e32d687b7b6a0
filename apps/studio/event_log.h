// What the studio did, as JSON lines in a file: for tests, and for people who look for the cause of something.
#pragma once

#include <QFile>
#include <QJsonObject>

namespace relief::studio {

/// One JSON object per line, written through at once. Without a file nothing is written. UI thread.
class EventLog {
 public:
  /// False where the file cannot be written.
  bool open(const QString& file);
  [[nodiscard]] bool active() const { return file_.isOpen(); }
  /// "event" and the number of milliseconds since the start, "ms", are added.
  void write(const QString& event, QJsonObject facts = {});

 private:
  QFile file_;
};

/// The one of this process.
EventLog& event_log();

}  // namespace relief::studio
