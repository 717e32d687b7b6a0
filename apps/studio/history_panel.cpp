#include "history_panel.h"

#include "text.h"
#include "tool_state.h"
#include "widgets/icons.h"
#include "widgets/theme.h"

#include <QKeyEvent>
#include <algorithm>

namespace relief::studio {

namespace {

/// Rows shown at most: the newest. A list widget of ten thousand rows takes a second to fill.
constexpr std::size_t kMostRows = 500;

}  // namespace

HistoryPanel::HistoryPanel(DocumentBridge& bridge, QWidget* parent) : QListWidget(parent), bridge_(bridge) {
  setObjectName(QStringLiteral("history"));
  setAccessibleName(tr("History"));
  setAccessibleDescription(tr("The strokes, oldest first. Choose one to go there."));
  setUniformItemSizes(true);
  // A row as wide as the panel: what is long loses letters in its middle, and is whole in its tip.
  setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  setTextElideMode(Qt::ElideMiddle);
  setIconSize(QSize(scaled(18), scaled(18)));
  connect(&bridge_, &DocumentBridge::opened, this, [this] {
    saved_ = bridge_.document()->statistics().undo_steps;
    refresh();
  });
  connect(&bridge_, &DocumentBridge::closed, this, [this] { clear(); });
  connect(&bridge_, &DocumentBridge::historyChanged, this, &HistoryPanel::refresh);
  connect(&bridge_, &DocumentBridge::saved, this, [this](quint64 stroke) {
    saved_ = stroke;
    refresh();
  });
  connect(this, &QListWidget::itemClicked, this, [this](QListWidgetItem* item) { go_to(row(item)); });
  connect(this, &QListWidget::itemActivated, this, [this](QListWidgetItem* item) { go_to(row(item)); });
}

/// The newest strokes are what people want back; all of them would leave the other panels no room.
QSize HistoryPanel::sizeHint() const {
  constexpr int kRows = 3;
  return {QListWidget::sizeHint().width(), kRows * std::max(0, sizeHintForRow(0)) + 2 * frameWidth()};
}

void HistoryPanel::refresh() {
  Document* document = bridge_.document();
  if (document == nullptr) return;
  filling_ = true;
  const DocumentStatistics statistics = document->statistics();
  const std::vector<std::string> labels = document->labels();
  undo_ = statistics.undo_steps;
  clear();
  const std::size_t first = labels.size() > kMostRows ? labels.size() - kMostRows : 0;
  auto* start = new QListWidgetItem(
      icon(u"open"), first == 0 ? tr("As converted") : tr("%n earlier stroke(s)", nullptr, static_cast<int>(first)),
      this);
  start->setData(Qt::UserRole, qulonglong{first});
  for (std::size_t k = first; k < labels.size(); ++k) {
    const QString id = text(labels[k]);
    const bool known = ToolState::ids().contains(id);
    const QString title = known ? ToolState::title(id) : id;
    const bool last_saved = k + 1 == saved_;
    // What no tool did is a change of the slabs.
    const QString words = known ? tr("%1, stroke %2").arg(title).arg(k + 1) : tr("%1, step %2").arg(title).arg(k + 1);
    auto* item = new QListWidgetItem(icon(known ? QStringView(id) : QStringView(u"wires")),
                                     words + (last_saved ? QStringLiteral("  ✓") : QString()), this);
    item->setData(Qt::UserRole, qulonglong{k + 1});
    item->setToolTip(last_saved ? tr("%1. In the file up to here").arg(words) : words);
    if (k >= undo_) item->setForeground(current_theme().dim);
  }
  const int current = static_cast<int>(undo_ >= first ? undo_ - first : 0);
  setCurrentRow(current);
  scrollToItem(item(current));
  filling_ = false;
}

/// The keys that move in a list are the list's while it has the focus.
bool HistoryPanel::event(QEvent* event) {
  if (event->type() == QEvent::ShortcutOverride) {
    const int key = static_cast<QKeyEvent*>(event)->key();
    if (key == Qt::Key_Home || key == Qt::Key_End || key == Qt::Key_PageUp || key == Qt::Key_PageDown) {
      event->accept();
      return true;
    }
  }
  return QListWidget::event(event);
}

void HistoryPanel::go_to(int row) {
  if (filling_ || item(row) == nullptr) return;
  const quint64 to = item(row)->data(Qt::UserRole).toULongLong();
  if (to < undo_) bridge_.post(Undo{.steps = undo_ - to});
  if (to > undo_) bridge_.post(Redo{.steps = to - undo_});
}

}  // namespace relief::studio
