#include "keys_page.h"

#include "key_map.h"
#include "widgets/theme.h"

#include <QHBoxLayout>
#include <QHeaderView>
#include <QKeyEvent>
#include <QLabel>
#include <QPushButton>
#include <QTreeWidget>
#include <QVBoxLayout>

namespace relief::studio {

namespace {

enum Column { Action, Keys };

QString in_words(const QList<QKeySequence>& keys) { return QKeySequence::listToString(keys, QKeySequence::NativeText); }

bool is_modifier(int key) {
  return key == Qt::Key_Shift || key == Qt::Key_Control || key == Qt::Key_Alt || key == Qt::Key_Meta ||
         key == Qt::Key_AltGr || key == Qt::Key_unknown || key == 0;
}

}  // namespace

KeysPage::KeysPage(KeyMap& keys, QWidget* parent) : QWidget(parent), keys_(keys) {
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(0, 0, 0, 0);
  list_ = new QTreeWidget(this);
  list_->setObjectName(QStringLiteral("keys"));
  list_->setAccessibleName(tr("Keys of all commands"));
  list_->setHeaderLabels({tr("Command"), tr("Keys")});
  list_->setRootIsDecorated(false);
  list_->setUniformRowHeights(true);
  list_->header()->setSectionResizeMode(Action, QHeaderView::Stretch);
  list_->header()->setSectionResizeMode(Keys, QHeaderView::ResizeToContents);
  list_->header()->setStretchLastSection(false);
  list_->installEventFilter(this);
  column->addWidget(list_, 1);
  words_ = new QLabel(this);
  words_->setObjectName(QStringLiteral("keys-words"));
  words_->setWordWrap(true);
  words_->setMinimumHeight(2 * fontMetrics().lineSpacing());
  column->addWidget(words_);
  auto* row = new QHBoxLayout;
  const auto button = [&](const QString& id, const QString& title) {
    auto* made = new QPushButton(title, this);
    made->setObjectName(id);
    made->setAutoDefault(false);
    row->addWidget(made);
    return made;
  };
  change_ = button(QStringLiteral("key-change"), tr("Change …"));
  none_ = button(QStringLiteral("key-none"), tr("No key"));
  preset_ = button(QStringLiteral("key-preset"), tr("Usual key"));
  row->addStretch(1);
  take_over_ = button(QStringLiteral("key-take-over"), tr("Take it over"));
  leave_ = button(QStringLiteral("key-leave"), tr("Leave it"));
  column->addLayout(row);
  connect(change_, &QPushButton::clicked, this, &KeysPage::wait_for_key);
  connect(none_, &QPushButton::clicked, this, [this] { keys_.set(chosen_id(), {}); });
  connect(preset_, &QPushButton::clicked, this, [this] { keys_.reset(chosen_id()); });
  connect(take_over_, &QPushButton::clicked, this, [this] { give(take_over_->property("key").value<QKeySequence>()); });
  connect(leave_, &QPushButton::clicked, this, &KeysPage::stop_waiting);
  connect(list_, &QTreeWidget::itemDoubleClicked, this, &KeysPage::wait_for_key);
  connect(list_, &QTreeWidget::currentItemChanged, this, &KeysPage::stop_waiting);
  connect(&keys_, &KeyMap::changed, this, &KeysPage::refresh);
  fill();
}

void KeysPage::fill() {
  for (const QString& id : keys_.ids()) {
    auto* item = new QTreeWidgetItem(list_, {keys_.title(id), QString()});
    item->setData(Action, Qt::UserRole, id);
  }
  list_->sortItems(Action, Qt::AscendingOrder);
  if (list_->topLevelItemCount() > 0) list_->setCurrentItem(list_->topLevelItem(0));
  refresh();
}

/// The keys in all rows; those that two commands share, and so do nothing, are told in words and colour.
void KeysPage::refresh() {
  for (int k = 0; k < list_->topLevelItemCount(); ++k) {
    QTreeWidgetItem& item = *list_->topLevelItem(k);
    const QString id = item.data(Action, Qt::UserRole).toString();
    QStringList others;
    for (const QKeySequence& key : keys_.keys(id)) others += keys_.others_with(key, id);
    QString words = in_words(keys_.keys(id));
    if (!others.isEmpty()) words += QStringLiteral("   ") + tr("also: %1").arg(titles(others));
    item.setText(Keys, words);
    item.setForeground(Keys, others.isEmpty() ? current_theme().text : current_theme().warn);
    QFont font = list_->font();
    font.setBold(keys_.keys(id) != keys_.preset(id));
    item.setFont(Keys, font);
  }
  stop_waiting();
}

bool KeysPage::narrow(const QString& typed) {
  const QStringList words = typed.simplified().split(QLatin1Char(' '), Qt::SkipEmptyParts);
  bool any = false;
  for (int k = 0; k < list_->topLevelItemCount(); ++k) {
    QTreeWidgetItem* item = list_->topLevelItem(k);
    const QString line = item->text(Action) + QLatin1Char(' ') + item->text(Keys);
    const bool fits =
        std::ranges::all_of(words, [&](const QString& w) { return line.contains(w, Qt::CaseInsensitive); });
    item->setHidden(!fits);
    any = any || fits;
  }
  return any;
}

QString KeysPage::chosen_id() const {
  const QTreeWidgetItem* item = list_->currentItem();
  return item == nullptr ? QString() : item->data(Action, Qt::UserRole).toString();
}

QString KeysPage::titles(const QStringList& ids) const {
  QStringList all;
  for (const QString& id : ids) all.append(keys_.title(id));
  return all.join(QStringLiteral(", "));
}

void KeysPage::wait_for_key() {
  if (chosen_id().isEmpty()) return;
  stop_waiting();
  waiting_for_ = chosen_id();
  words_->setText(tr("Press the new key for “%1”, or Esc to leave it.").arg(keys_.title(waiting_for_)));
  list_->setFocus();
}

void KeysPage::stop_waiting() {
  waiting_for_.clear();
  take_over_->hide();
  leave_->hide();
  const QString id = chosen_id();
  for (QPushButton* each : {change_, none_}) each->setEnabled(!id.isEmpty());
  preset_->setEnabled(keys_.keys(id) != keys_.preset(id));
  words_->setText(id.isEmpty() ? QString()
                               : tr("Double click or “Change …”, then press a key. Changed keys are bold."));
}

void KeysPage::take(const QKeySequence& key) {
  const QString id = waiting_for_;
  const QStringList others = keys_.others_with(key, id);
  if (others.isEmpty()) {
    give(key);
    return;
  }
  waiting_for_.clear();
  words_->setText(tr("%1 belongs to “%2”.").arg(key.toString(QKeySequence::NativeText), titles(others)));
  take_over_->setProperty("key", key);
  take_over_->show();
  leave_->show();
  take_over_->setFocus();
}

/// The key is this command's alone from now on.
void KeysPage::give(const QKeySequence& key) {
  const QString id = chosen_id();
  for (const QString& other : keys_.others_with(key, id)) {
    QList<QKeySequence> left = keys_.keys(other);
    left.removeAll(key);
    keys_.set(other, left);
  }
  keys_.set(id, {key});
}

void KeysPage::changeEvent(QEvent* event) {
  QWidget::changeEvent(event);
  if (event->type() == QEvent::PaletteChange) refresh();
}

bool KeysPage::eventFilter(QObject* object, QEvent* event) {
  const bool key_event = event->type() == QEvent::ShortcutOverride || event->type() == QEvent::KeyPress;
  if (object != list_ || !key_event) return QWidget::eventFilter(object, event);
  const auto* press = static_cast<QKeyEvent*>(event);
  if (waiting()) {
    event->accept();
    if (event->type() == QEvent::ShortcutOverride || is_modifier(press->key())) return true;
    if (press->key() == Qt::Key_Escape)
      stop_waiting();
    else
      take(QKeySequence(press->keyCombination()));
    return true;
  }
  if (event->type() == QEvent::KeyPress && (press->key() == Qt::Key_Return || press->key() == Qt::Key_Enter)) {
    wait_for_key();
    return true;
  }
  return QWidget::eventFilter(object, event);
}

}  // namespace relief::studio
