#include "session_report.h"

#include "text.h"
#include "tool_state.h"

#include <QBuffer>
#include <QCoreApplication>
#include <QImage>
#include <QLocale>
#include <algorithm>

namespace relief::studio {

namespace {

struct Words {
  Q_DECLARE_TR_FUNCTIONS(SessionReport)
};

QString number(std::uint64_t count) { return QLocale().toString(qulonglong{count}); }
QString number(double value, int decimals) { return QLocale().toString(value, 'f', decimals); }

/// A table of two columns or more; the first cells of rows are their headings.
class Table {
 public:
  void head(const QStringList& cells) { add(cells, QStringLiteral("th")); }
  void row(const QStringList& cells) { add(cells, QStringLiteral("td")); }
  [[nodiscard]] QString html() const { return QStringLiteral("<table>\n") + rows_ + QStringLiteral("</table>\n"); }

 private:
  void add(const QStringList& cells, const QString& tag) {
    rows_ += QStringLiteral("<tr>");
    for (qsizetype k = 0; k < cells.size(); ++k) {
      const QString each = k == 0 ? QStringLiteral("th") : tag;
      rows_ += QStringLiteral("<%1>%2</%1>").arg(each, cells[k].toHtmlEscaped());
    }
    rows_ += QStringLiteral("</tr>\n");
  }
  QString rows_;
};

QString heading(const QString& words) { return QStringLiteral("<h2>%1</h2>\n").arg(words.toHtmlEscaped()); }

QString saved_words(const SessionFacts& facts) {
  if (facts.document.unsaved > 0)
    return Words::tr("%n stroke(s) are not in the file yet.", nullptr, static_cast<int>(facts.document.unsaved));
  return facts.named ? Words::tr("Every stroke is in the file.")
                     : Words::tr("Every stroke is kept, in a file without a name yet.");
}

QString model_table(const SessionFacts& facts) {
  Table table;
  table.row({Words::tr("File"), facts.file});
  if (!facts.info.source.empty()) table.row({Words::tr("Made of"), text(facts.info.source)});
  table.row({Words::tr("Mode"), facts.info.mode == Mode::Certified ? Words::tr("Certified") : Words::tr("Tolerant")});
  table.row({Words::tr("Slabs"), number(facts.slabs)});
  table.row({Words::tr("Saved"), saved_words(facts)});
  const QLocale locale;
  table.row({Words::tr("Session"), Words::tr("%1 to %2")
                                       .arg(locale.toString(facts.begun, QLocale::ShortFormat),
                                            locale.toString(facts.now, QLocale::ShortFormat))});
  return table.html();
}

QString tool_table(const SessionFacts& facts) {
  if (facts.tools.empty()) return QStringLiteral("<p>%1</p>\n").arg(Words::tr("No strokes were made.").toHtmlEscaped());
  Table table;
  table.head({Words::tr("Tool"), Words::tr("Strokes"), Words::tr("Dabs"), Words::tr("Samples changed"),
              Words::tr("Strokes that met the clay's end"), Words::tr("Processor time")});
  SessionCounter::OfTool sum;
  const auto row = [&](const QString& title, const SessionCounter::OfTool& each) {
    table.row({title, number(each.strokes), number(each.dabs), number(each.samples), number(each.stopped),
               number(each.cpu_seconds, 2) + QStringLiteral(" s")});
  };
  for (const auto& [tool, each] : facts.tools) {
    row(ToolState::title(text(name(tool))), each);
    sum.strokes += each.strokes;
    sum.dabs += each.dabs;
    sum.samples += each.samples;
    sum.stopped += each.stopped;
    sum.cpu_seconds += each.cpu_seconds;
  }
  row(Words::tr("All"), sum);
  return table.html();
}

QString time_table(const SessionFacts& facts) {
  Table table;
  const auto microseconds = [&](double q) {
    return number(1e-3 * static_cast<double>(facts.document.dab_time.quantile(q)), 1) + QStringLiteral(" µs");
  };
  table.row({Words::tr("A dab, typical"), microseconds(0.5)});
  table.row({Words::tr("A dab, 99 % are quicker"), microseconds(0.99)});
  table.row({Words::tr("Steps taken back"), number(facts.undone)});
  table.row({Words::tr("Samples stopped at the clay's end"), number(facts.document.limited)});
  table.row({Words::tr("Points beside the model"), number(facts.document.missed)});
  return table.html();
}

QString hand_table(const HandFigures& hand) {
  Table table;
  table.row({Words::tr("Device"), hand.device});
  table.row({Words::tr("Ticks looked at"), number(hand.ticks)});
  table.row({Words::tr("Ticks missing"), number(hand.missing)});
  table.row({Words::tr("Late, 99.9 % are less"), number(hand.late_ms, 2) + QStringLiteral(" ms")});
  table.row({Words::tr("Computing, 99.9 % are less"), number(hand.compute_us, 1) + QStringLiteral(" µs")});
  table.row({Words::tr("Greatest force"), number(hand.force, 2) + QStringLiteral(" N")});
  table.row({Words::tr("Times without force"), number(hand.stops)});
  return table.html();
}

QString style() {
  return QStringLiteral(
      "body{font:16px/1.5 system-ui,sans-serif;max-width:60em;margin:2em auto;padding:0 "
      "1em;color:#22262b;background:#fff}"
      "h1{font-size:1.7em}h2{font-size:1.15em;margin-top:2em}img{max-width:100%;border-radius:8px}"
      "table{border-collapse:collapse;width:100%}th,td{padding:.35em .7em;border-bottom:1px solid "
      "#d6d9dc;text-align:right}"
      "th:first-child{text-align:left}td:only-of-type{text-align:left;word-break:break-word}th{font-weight:600}");
}

/// What 99.9 % of the values are below.
template <typename Get>
double high_of(const HandMonitor& monitor, Get get) {
  std::vector<float> values(monitor.size());
  for (std::size_t k = 0; k < values.size(); ++k) values[k] = get(monitor[k]);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(0.999 * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return static_cast<double>(*at);
}

}  // namespace

SessionCounter::SessionCounter(DocumentBridge& bridge, QObject* parent) : QObject(parent) {
  connect(&bridge, &DocumentBridge::opened, this, [this, &bridge] {
    tools_.clear();
    undone_ = 0;
    steps_ = bridge.document()->statistics().undo_steps;
    begun_ = QDateTime::currentDateTime();
  });
  connect(&bridge, &DocumentBridge::strokeFinished, this, [this](const StrokeFinished& stroke) {
    if (!stroke.result.changed) return;
    OfTool& of = tools_[stroke.tool];
    ++of.strokes;
    of.dabs += stroke.result.dabs;
    of.samples += stroke.result.samples;
    of.limited += stroke.result.limited;
    of.stopped += stroke.result.limited > 0 ? 1 : 0;
    of.cpu_seconds += stroke.seconds;
  });
  connect(&bridge, &DocumentBridge::historyChanged, this, [this](const HistoryChanged& history) {
    if (history.undo_steps < steps_) undone_ += steps_ - history.undo_steps;
    steps_ = history.undo_steps;
  });
}

std::optional<HandFigures> figures_of(const HandMonitor& monitor, const QString& device) {
  if (monitor.size() == 0) return std::nullopt;
  HandFigures figures;
  figures.device = device;
  figures.ticks = monitor.size();
  figures.missing = monitor.missing();
  figures.stops = monitor.safety().stops();
  figures.late_ms = 1e3 * high_of(monitor, [](const HandTick& tick) { return tick.late; });
  figures.compute_us = 1e6 * high_of(monitor, [](const HandTick& tick) { return tick.compute; });
  for (std::size_t k = 0; k < monitor.size(); ++k)
    figures.force = std::max(figures.force, static_cast<double>(length(monitor[k].force)));
  return figures;
}

QByteArray session_report(const SessionFacts& facts, const QImage& picture) {
  QByteArray png;
  QBuffer buffer(&png);
  buffer.open(QIODevice::WriteOnly);
  picture.save(&buffer, "PNG");
  const QString title = Words::tr("%1: report of a session").arg(facts.title).toHtmlEscaped();
  QString page = QStringLiteral(
                     "<!DOCTYPE html>\n<html lang=\"%1\">\n<head>\n<meta "
                     "charset=\"utf-8\">\n<title>%2</title>\n<style>%3</style>\n</head>\n<body>\n<h1>%2</h1>\n")
                     .arg(QLocale().name().section(QLatin1Char('_'), 0, 0), title, style());
  if (!picture.isNull())
    page += QStringLiteral("<img alt=\"%1\" width=\"%2\" height=\"%3\" src=\"data:image/png;base64,%4\">\n")
                .arg(Words::tr("The model at the end").toHtmlEscaped())
                .arg(picture.width())
                .arg(picture.height())
                .arg(QString::fromLatin1(png.toBase64()));
  page += heading(Words::tr("Model")) + model_table(facts);
  page += heading(Words::tr("Strokes")) + tool_table(facts);
  page += heading(Words::tr("Times and limits")) + time_table(facts);
  if (facts.hand) page += heading(Words::tr("Device, in its last minute")) + hand_table(*facts.hand);
  page += QStringLiteral("</body>\n</html>\n");
  return page.toUtf8();
}

}  // namespace relief::studio
