#include "document_log.h"

#include "event_log.h"
#include "text.h"

namespace relief::studio {

void log_document(DocumentBridge& bridge, const Viewport& viewport) {
  if (!event_log().active()) return;
  const auto hash = [&bridge] { return hash_text(bridge.head()->content_hash()); };
  QObject::connect(&bridge, &DocumentBridge::strokeFinished, &viewport,
                   [&bridge, &viewport, hash](const StrokeFinished& stroke) {
                     event_log().write(QStringLiteral("stroke"), {{"stroke", qint64(stroke.stroke)},
                                                                  {"tool", text(name(stroke.tool))},
                                                                  {"source", qint64(stroke.source)},
                                                                  {"samples", qint64(stroke.result.samples)},
                                                                  {"dabs", qint64(stroke.result.dabs)},
                                                                  {"limited", qint64(stroke.result.limited)},
                                                                  {"changed", stroke.result.changed},
                                                                  {"points", viewport.stroke_events()},
                                                                  {"revision", qint64(bridge.head()->number())},
                                                                  {"hash", hash()}});
                   });
  QObject::connect(&bridge, &DocumentBridge::historyChanged, &viewport, [hash](const HistoryChanged& history) {
    event_log().write(QStringLiteral("history"),
                      {{"undo", qint64(history.undo_steps)}, {"redo", qint64(history.redo_steps)}, {"hash", hash()}});
  });
  QObject::connect(&bridge, &DocumentBridge::saved, &viewport,
                   [](quint64 stroke) { event_log().write(QStringLiteral("saved"), {{"stroke", qint64(stroke)}}); });
}

}  // namespace relief::studio
