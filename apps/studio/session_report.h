// What was done in a session, as a page that can be kept or sent.
#pragma once

#include "bridge.h"

#include <relief/session/hand_monitor.h>

#include <QDateTime>
#include <QObject>
#include <map>

class QImage;

namespace relief::studio {

/// Counts what happens to a document, tool by tool, from when it is opened.
class SessionCounter : public QObject {
  Q_OBJECT
 public:
  explicit SessionCounter(DocumentBridge& bridge, QObject* parent = nullptr);

  struct OfTool {
    std::uint64_t strokes = 0, dabs = 0, samples = 0;
    std::uint64_t limited = 0;  ///< samples that would have gone beyond the clay
    std::uint64_t stopped = 0;  ///< strokes in which that happened
    double cpu_seconds = 0;
  };
  [[nodiscard]] const std::map<Tool, OfTool>& tools() const { return tools_; }
  [[nodiscard]] const QDateTime& begun() const { return begun_; }
  [[nodiscard]] std::uint64_t undone() const { return undone_; }

 private:
  std::map<Tool, OfTool> tools_;
  QDateTime begun_;
  std::uint64_t undone_ = 0, steps_ = 0;
};

/// What the hand has counted in its last minute; only where a device was on.
struct HandFigures {
  QString device;
  std::uint64_t ticks = 0, missing = 0, stops = 0;
  double late_ms = 0, compute_us = 0;  ///< 99.9 % of the ticks were below it
  double force = 0;                    ///< N, the greatest
};
/// Empty without ticks.
[[nodiscard]] std::optional<HandFigures> figures_of(const HandMonitor& monitor, const QString& device);

/// All that a report tells. Taken on the UI thread; session_report() needs nothing else.
struct SessionFacts {
  QString title, file;
  QDateTime begun, now;
  std::map<Tool, SessionCounter::OfTool> tools;
  std::uint64_t undone = 0;
  DocumentStatistics document;
  ModelInfo info;
  std::size_t slabs = 0;
  bool named = true;  ///< else the file is in the folder of models without a name
  std::optional<HandFigures> hand;
};

/// One HTML file without any other: style and picture are inside. Any thread.
[[nodiscard]] QByteArray session_report(const SessionFacts& facts, const QImage& picture);

}  // namespace relief::studio
