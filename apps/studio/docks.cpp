#include "docks.h"

#include "widgets/theme.h"

#include <QAction>
#include <QDockWidget>
#include <QLabel>
#include <QMainWindow>
#include <QMouseEvent>
#include <QSettings>
#include <QTabBar>
#include <algorithm>
#include <utility>

namespace relief::studio {

namespace {

constexpr QSize kRoomForAColumn(1280, 800);  // px at 100 % text: with less, a panel has no room for its first lines
constexpr int kFavoured = 2;                 // weight

QString height_key(const QDockWidget& dock) { return QStringLiteral("panels/height-") + dock.objectName(); }

}  // namespace

std::vector<int> shared_heights(const std::vector<PanelNeed>& needs, int total) {
  std::vector<int> heights(needs.size(), -1);
  const auto rest = [&] {
    PanelNeed left = {total, 0};
    for (std::size_t k = 0; k < needs.size(); ++k)
      heights[k] >= 0 ? left.height -= heights[k] : left.weight += needs[k].weight;
    return left;
  };
  // Each round serves those who need no more than a fair share of what is left, which makes the others' share larger.
  for (bool served = true; served;) {
    served = false;
    const auto [left, weights] = rest();
    for (std::size_t k = 0; k < needs.size(); ++k)
      if (heights[k] < 0 && needs[k].height * weights <= left * needs[k].weight) {
        heights[k] = needs[k].height;
        served = true;
      }
  }
  auto [left, weights] = rest();
  if (weights == 0 && !heights.empty()) heights.back() += left;
  for (std::size_t k = 0; k < needs.size(); ++k)
    if (heights[k] < 0) {
      heights[k] = left * needs[k].weight / weights;
      left -= heights[k];
      weights -= needs[k].weight;
    }
  return heights;
}

Docks::Docks(QMainWindow& window, QSettings& settings)
    : QObject(&window), window_(window), settings_(settings), tabs_(settings.value("panels/tabs").toBool()) {
  window_.installEventFilter(this);
  soon_.setSingleShot(true);
  connect(&soon_, &QTimer::timeout, this, [this] {
    arrange();
    share();
    if (std::exchange(raise_, false)) raise_first();
  });
}

QDockWidget* Docks::add(const QString& id, const QString& title, const QString& name, const QString& heading,
                        QWidget* content) {
  auto* dock = new QDockWidget(&window_);
  dock->setObjectName(id);
  titles_[dock] = {title, name};
  dock->setFeatures(QDockWidget::DockWidgetMovable | QDockWidget::DockWidgetFloatable |
                    QDockWidget::DockWidgetClosable);
  auto* bar = new QLabel(heading, dock);
  bar->setAccessibleName(tr("Heading of %1").arg(name));
  bar->setFont(ui_font(10, QFont::DemiBold));
  bar->setContentsMargins(scaled(12), scaled(9), scaled(8), scaled(5));
  dock->setTitleBarWidget(bar);
  dock->setWidget(content);
  window_.addDockWidget(Qt::RightDockWidgetArea, dock);
  docks_.push_back(dock);
  give_titles();
  connect(dock->toggleViewAction(), &QAction::triggered, this, [this, dock](bool open) {
    std::erase(closed_, dock);
    if (!open) closed_.push_back(dock);
    refresh();
  });
  return dock;
}

void Docks::put_under(QDockWidget& upper, QDockWidget& lower) { window_.splitDockWidget(&upper, &lower, Qt::Vertical); }

void Docks::set_heading(const QDockWidget& dock, const QString& heading) const {
  qobject_cast<QLabel*>(dock.titleBarWidget())->setText(heading);
}

void Docks::favour(QDockWidget* dock) {
  if (std::exchange(favoured_, dock) == dock) return;
  if (dock != nullptr) raise_ = true;
  share_soon();
}

void Docks::set_shown(bool shown) {
  shown_ = shown;
  refresh();
}

void Docks::refresh() {
  for (QDockWidget* dock : docks_) {
    const bool visible = shown_ && std::ranges::find(closed_, dock) == closed_.end();
    if (visible == !dock->isHidden()) continue;
    dock->setVisible(visible);
    if (visible) raise_ = true;
    share_soon();
  }
}

/// A dock's title is its name to assistive tools, and the word on its tab, which must be short.
void Docks::give_titles() {
  for (QDockWidget* dock : docks_) dock->setWindowTitle(tabs_ ? titles_[dock].tab : titles_[dock].name);
}

/// Of tabs, once they are there. No word on one of them is cut.
void Docks::raise_first() {
  int widest = 0;
  for (const QTabBar* bar : window_.findChildren<QTabBar*>(QString(), Qt::FindDirectChildrenOnly))
    if (bar->isVisible()) widest = std::max(widest, bar->sizeHint().width());
  for (QTabBar* bar : window_.findChildren<QTabBar*>(QString(), Qt::FindDirectChildrenOnly))
    for (int k = 0; k < bar->count(); ++k)
      for (const auto& [dock, titles] : titles_)
        if (titles.tab == bar->tabText(k)) bar->setAccessibleTabName(k, titles.name);
  for (QDockWidget* dock : docks_) dock->setMinimumWidth(tabs_ ? std::max(widest, dock->minimumSizeHint().width()) : 0);
  if (tabs_) (favoured_ != nullptr ? favoured_ : docks_.front())->raise();
}

void Docks::close_or_open_all() {
  if (closed_.size() < docks_.size()) {
    closed_together_.clear();
    for (QDockWidget* dock : docks_)
      if (std::ranges::find(closed_, dock) == closed_.end()) closed_together_.push_back(dock);
    closed_ = docks_;
  } else {
    // Where all were closed one by one, all come.
    if (closed_together_.empty()) closed_together_ = docks_;
    for (QDockWidget* dock : closed_together_) std::erase(closed_, dock);
    closed_together_.clear();
  }
  refresh();
}

void Docks::arrange() {
  const bool tabs =
      window_.width() < scaled(kRoomForAColumn.width()) || window_.height() < scaled(kRoomForAColumn.height());
  if (std::exchange(tabs_, tabs) == tabs) return;
  settings_.setValue("panels/tabs", tabs);
  give_titles();
  if (!tabs) {
    window_.restoreState(settings_.value("panels/column").toByteArray());
    refresh();
    raise_ = true;
    return;
  }
  settings_.setValue("panels/column", window_.saveState());
  QDockWidget* first = nullptr;
  for (QDockWidget* dock : docks_) {
    if (dock->isFloating() || window_.dockWidgetArea(dock) != Qt::RightDockWidgetArea) continue;
    if (first != nullptr) window_.tabifyDockWidget(first, dock);
    if (first == nullptr) first = dock;
  }
  raise_ = true;
}

std::vector<QDockWidget*> Docks::column() const {
  std::vector<QDockWidget*> found;
  for (QDockWidget* dock : docks_)
    if (dock->isVisible() && !dock->isFloating() && window_.dockWidgetArea(dock) == Qt::RightDockWidgetArea &&
        window_.tabifiedDockWidgets(dock).isEmpty())
      found.push_back(dock);
  std::ranges::sort(found, {}, [](const QDockWidget* dock) { return dock->y(); });
  return found;
}

void Docks::share() {
  const std::vector<QDockWidget*> docks = column();
  if (docks.size() < 2) return;
  std::vector<PanelNeed> needs;
  int total = 0;
  for (const QDockWidget* dock : docks) {
    const int all = dock->titleBarWidget()->sizeHint().height() + dock->widget()->sizeHint().height();
    const int own = settings_.value(height_key(*dock)).toInt();
    needs.push_back({own > 0 ? own : all, dock == favoured_ ? kFavoured : 1});
    total += dock->height();
  }
  const std::vector<int> heights = shared_heights(needs, total);
  window_.resizeDocks({docks.begin(), docks.end()}, {heights.begin(), heights.end()}, Qt::Vertical);
}

/// After somebody has dragged the line between two.
void Docks::keep_heights() {
  for (const QDockWidget* dock : column()) settings_.setValue(height_key(*dock), dock->height());
}

bool Docks::eventFilter(QObject*, QEvent* event) {
  if (event->type() == QEvent::Resize) share_soon();
  if (event->type() == QEvent::MouseButtonPress)
    dragging_ = window_.isSeparator(static_cast<QMouseEvent*>(event)->position().toPoint());
  if (event->type() == QEvent::MouseButtonRelease && std::exchange(dragging_, false))
    QMetaObject::invokeMethod(this, &Docks::keep_heights, Qt::QueuedConnection);
  return false;
}

}  // namespace relief::studio
