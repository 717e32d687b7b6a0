#include "command_palette.h"

#include "theme.h"

#include <QAction>
#include <QApplication>
#include <QKeyEvent>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QMenu>
#include <QMenuBar>
#include <QPainter>
#include <QSet>
#include <QStyledItemDelegate>
#include <QVBoxLayout>
#include <algorithm>

namespace relief::studio {

namespace {

constexpr int kActionRole = Qt::UserRole;        // index into actions_
constexpr int kShortcutRole = Qt::UserRole + 1;  // text at the right
constexpr int kWidth = 560, kRows = 9;           // pixels and rows at 100 % text: two words and a shortcut fit well

/// The name without its mnemonic: "&Save picture..." is "Save picture...".
QString title_of(const QAction& action) {
  QString title;
  const QString text = action.text();
  for (qsizetype i = 0; i < text.size(); ++i) {
    if (text[i] == u'&' && i + 1 < text.size()) ++i;
    title += text[i];
  }
  return title;
}

constexpr const char* kWords = "palette_words";  // property of an action

/// What typed words are looked for in.
QString searched(const QAction& action) { return title_of(action) + u' ' + action.property(kWords).toString(); }

QString shortcut_of(const QAction& action) { return action.shortcut().toString(QKeySequence::NativeText); }

/// A row: icon, title, and the shortcut at the far end in dim.
class RowDelegate : public QStyledItemDelegate {
 public:
  using QStyledItemDelegate::QStyledItemDelegate;
  QSize sizeHint(const QStyleOptionViewItem& option, const QModelIndex&) const override {
    return {0, option.fontMetrics.height() + scaled(14)};
  }
  void paint(QPainter* painter, const QStyleOptionViewItem& option, const QModelIndex& index) const override {
    const Theme& theme = current_theme();
    painter->save();
    painter->setRenderHint(QPainter::Antialiasing);
    if (option.state.testFlag(QStyle::State_Selected)) {
      painter->setPen(QPen(theme.line, 1));
      painter->setBrush(theme.raised);
      painter->drawRoundedRect(QRectF(option.rect).adjusted(0.5, 0.5, -0.5, -0.5), corner(), corner());
    }
    const auto place = [&option](const QRect& rect) { return QStyle::visualRect(option.direction, option.rect, rect); };
    const int icon_side = scaled(18), left = option.rect.left() + scaled(10);
    const QRect icon_rect(left, option.rect.center().y() - icon_side / 2, icon_side, icon_side);
    index.data(Qt::DecorationRole).value<QIcon>().paint(painter, place(icon_rect));
    const QRect text = option.rect.adjusted(scaled(38), 0, -scaled(10), 0);
    painter->setFont(option.font);
    const QString shortcut = index.data(kShortcutRole).toString();
    const int room = text.width() - option.fontMetrics.horizontalAdvance(shortcut) - scaled(12);
    painter->setPen(theme.text);
    painter->drawText(place(text), text_flags(option.direction, Qt::AlignLeft),
                      option.fontMetrics.elidedText(index.data().toString(), Qt::ElideRight, room));
    painter->setPen(theme.dim);
    painter->drawText(place(text), text_flags(option.direction, Qt::AlignRight), shortcut);
    painter->restore();
  }
};

void collect(const QList<QAction*>& from, QList<QAction*>& into) {
  for (QAction* action : from) {
    if (action->menu())
      collect(action->menu()->actions(), into);
    else
      into.append(action);
  }
}

}  // namespace

CommandPalette::CommandPalette(QWidget* window)
    : QFrame(window),
      open_action_(new QAction(tr("Find a command …"), this)),
      line_(new QLineEdit),
      list_(new QListWidget),
      nothing_(new QLabel(tr("No command has these words."))) {
  setObjectName(QStringLiteral("command_palette"));
  setAccessibleName(tr("Commands"));
  setProperty("role", QStringLiteral("card"));
  open_action_->setShortcuts({QKeySequence(Qt::Key_F3), QKeySequence(Qt::CTRL | Qt::Key_K)});
  connect(open_action_, &QAction::triggered, this, [this] { isVisible() ? close_again() : open(); });
  window->addAction(open_action_);

  line_->setObjectName(QStringLiteral("command_palette.words"));
  line_->setAccessibleName(tr("Words of a command"));
  line_->setAccessibleDescription(tr("Up and Down choose, Enter does it, Esc closes."));
  line_->setPlaceholderText(tr("Type a few letters of what you want to do"));
  list_->setObjectName(QStringLiteral("command_palette.list"));
  list_->setAccessibleName(tr("Commands found"));
  list_->setItemDelegate(new RowDelegate(list_));
  list_->setFocusPolicy(Qt::NoFocus);
  list_->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(10, 10, 10, 10);
  layout->addWidget(line_);
  nothing_->setProperty("role", QStringLiteral("dim"));
  nothing_->setAlignment(Qt::AlignCenter);
  layout->addWidget(nothing_, 1);
  layout->addWidget(list_, 1);

  connect(line_, &QLineEdit::textChanged, this, &CommandPalette::narrow);
  connect(list_, &QListWidget::itemClicked, this, &CommandPalette::trigger);
  connect(qApp, &QApplication::focusChanged, this, [this](const QWidget*, const QWidget* now) {
    if (isVisible() && now && now != this && !isAncestorOf(now)) hide();
  });
  line_->installEventFilter(this);
  window->installEventFilter(this);
  hide();
}

QList<QAction*> CommandPalette::actions_of(const QWidget& window, const QWidget* without) {
  QList<QAction*> all;
  if (const auto* bar = window.findChild<QMenuBar*>(QString(), Qt::FindDirectChildrenOnly))
    collect(bar->actions(), all);
  collect(window.actions(), all);
  for (const QWidget* widget : window.findChildren<QWidget*>())
    if (!without || (widget != without && !without->isAncestorOf(widget))) collect(widget->actions(), all);
  QSet<QString> seen;
  all.removeIf([&seen](const QAction* action) {
    if (action->isSeparator() || !action->isEnabled() || !action->isVisible() || action->text().isEmpty()) return true;
    const QString key = title_of(*action) + u'\n' + shortcut_of(*action);
    const bool again = seen.contains(key);
    seen.insert(key);
    return again;
  });
  return all;
}

void CommandPalette::set_words(QAction& action, const QString& words) { action.setProperty(kWords, words); }

bool CommandPalette::matches(const QString& title, const QString& typed) {
  return std::ranges::all_of(typed.split(u' ', Qt::SkipEmptyParts),
                             [&title](const QString& word) { return title.contains(word, Qt::CaseInsensitive); });
}

void CommandPalette::open() {
  focus_before_ = QApplication::focusWidget();
  actions_.clear();
  for (QAction* action : actions_of(*parentWidget(), this))
    if (action != open_action_) actions_.append(action);
  line_->clear();
  narrow({});
  place();
  show();
  raise();
  line_->setFocus();
}

void CommandPalette::close_again() {
  if (!isVisible()) return;
  hide();
  if (focus_before_) focus_before_->setFocus();
}

void CommandPalette::narrow(const QString& typed) {
  list_->clear();
  for (qsizetype i = 0; i < actions_.size(); ++i) {
    const QAction* action = actions_[i];
    if (!action || !matches(searched(*action), typed)) continue;
    const QString title = title_of(*action), shortcut = shortcut_of(*action);
    auto* item = new QListWidgetItem(action->icon(), title, list_);
    item->setData(kActionRole, i);
    item->setData(kShortcutRole, shortcut);
    item->setData(Qt::AccessibleTextRole, shortcut.isEmpty() ? title : QStringLiteral("%1, %2").arg(title, shortcut));
    item->setToolTip(action->toolTip());
  }
  list_->setCurrentRow(0);
  list_->setVisible(list_->count() > 0);
  nothing_->setVisible(list_->count() == 0);
}

void CommandPalette::place() {
  const QWidget& window = *parentWidget();
  const QSize size(std::min(scaled(kWidth), window.width() - 20),
                   std::min(scaled(44 + 31 * kRows), window.height() - 20));
  setGeometry(QRect(
      QPoint((window.width() - size.width()) / 2, std::min(scaled(120), (window.height() - size.height()) / 3)), size));
}

void CommandPalette::trigger(const QListWidgetItem* item) {
  if (!item) return;
  const QPointer<QAction> action = actions_[item->data(kActionRole).toInt()];
  close_again();  // first: what the command does may take the focus
  if (action) action->trigger();
}

bool CommandPalette::key_pressed(const QKeyEvent& event) {
  const int row = list_->currentRow(), last = list_->count() - 1;
  switch (event.key()) {
    case Qt::Key_Escape:
      close_again();
      return true;
    case Qt::Key_Return:
    case Qt::Key_Enter:
      trigger(list_->currentItem());
      return true;
    case Qt::Key_Down:
      list_->setCurrentRow(std::min(row + 1, last));
      return true;
    case Qt::Key_Up:
      list_->setCurrentRow(std::max(row - 1, 0));
      return true;
    case Qt::Key_PageDown:
      list_->setCurrentRow(std::min(row + kRows, last));
      return true;
    case Qt::Key_PageUp:
      list_->setCurrentRow(std::max(row - kRows, 0));
      return true;
    case Qt::Key_Tab:
    case Qt::Key_Backtab:
      return true;  // nowhere else to go until it is closed
    default:
      return false;
  }
}

bool CommandPalette::eventFilter(QObject* object, QEvent* event) {
  if (object == parentWidget() && event->type() == QEvent::Resize && isVisible()) place();
  if (object != line_) return QFrame::eventFilter(object, event);
  // Esc here closes the palette; it must not reach a shortcut of the window first.
  if (event->type() == QEvent::ShortcutOverride && static_cast<QKeyEvent*>(event)->key() == Qt::Key_Escape) {
    event->accept();
    return true;
  }
  return event->type() == QEvent::KeyPress && key_pressed(*static_cast<QKeyEvent*>(event));
}

}  // namespace relief::studio
