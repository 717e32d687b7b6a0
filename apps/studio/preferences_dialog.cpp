#include "preferences_dialog.h"

#include "key_map.h"
#include "keys_page.h"
#include "languages.h"
#include "preferences.h"
#include "widgets/theme.h"
#include "widgets/value_bar.h"

#include <QCheckBox>
#include <QComboBox>
#include <QDialogButtonBox>
#include <QEvent>
#include <QFileDialog>
#include <QHBoxLayout>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QPushButton>
#include <QScrollArea>
#include <QSignalBlocker>
#include <QStackedWidget>
#include <QVBoxLayout>
#include <algorithm>

namespace relief::studio {

namespace {

/// As wide as its rows. A list places its rows when it first has some, and keeps the places: those from before it has
/// its style are too near each other, and a change of the text's size makes the width another.
class PageList : public QListWidget {
 public:
  using QListWidget::QListWidget;
  [[nodiscard]] QSize sizeHint() const override {
    return {sizeHintForColumn(0) + scaled(36), QListWidget::sizeHint().height()};
  }
  [[nodiscard]] QSize minimumSizeHint() const override {
    return {sizeHint().width(), QListWidget::minimumSizeHint().height()};
  }

 protected:
  bool event(QEvent* event) override {
    const bool handled = QListWidget::event(event);
    if (event->type() == QEvent::Polish || event->type() == QEvent::StyleChange) {
      scheduleDelayedItemsLayout();
      updateGeometry();
    }
    return handled;
  }
};

}  // namespace

PreferencesDialog::PreferencesDialog(QSettings& settings, KeyMap& keys, const QString& drawing, QWidget* parent)
    : QDialog(parent), settings_(settings) {
  setObjectName(QStringLiteral("preferences"));
  setWindowTitle(tr("Preferences"));
  auto* whole = new QVBoxLayout(this);
  search_ = new QLineEdit(this);
  search_->setObjectName(QStringLiteral("preferences-search"));
  search_->setAccessibleName(tr("Search in the preferences"));
  search_->setPlaceholderText(tr("Search"));
  search_->setClearButtonEnabled(true);
  whole->addWidget(search_);
  auto* across = new QHBoxLayout;
  list_ = new PageList(this);
  list_->setSizePolicy(QSizePolicy::Fixed, QSizePolicy::Expanding);
  list_->setObjectName(QStringLiteral("preferences-pages"));
  list_->setAccessibleName(tr("Pages"));
  pages_ = new QStackedWidget(this);
  across->addWidget(list_);
  across->addWidget(pages_, 1);
  whole->addLayout(across, 1);
  nothing_ = new QLabel(tr("Nothing of that name."), this);
  nothing_->setProperty("role", QStringLiteral("dim"));
  nothing_->hide();
  whole->addWidget(nothing_);
  auto* buttons = new QDialogButtonBox(QDialogButtonBox::Close, this);
  whole->addWidget(buttons);
  connect(buttons, &QDialogButtonBox::rejected, this, &QDialog::reject);
  connect(search_, &QLineEdit::textChanged, this, &PreferencesDialog::narrow);
  connect(list_, &QListWidget::currentRowChanged, pages_, &QStackedWidget::setCurrentIndex);
  add_look();
  add_input();
  add_drawing(drawing);
  add_forces();
  add_saving();
  add_language();
  add_keys(keys);
  for (const Row& row : rows_) row.refresh();
  list_->setCurrentRow(0);
  resize(scaled(720), scaled(560));
}

void PreferencesDialog::show_page(const QString& page) {
  for (int k = 0; k < list_->count(); ++k)
    if (list_->item(k)->data(Qt::UserRole) == page) list_->setCurrentRow(k);
}

// ---- Pages and rows

QVBoxLayout* PreferencesDialog::add_page(const QString& id, const QString& title) {
  auto* item = new QListWidgetItem(title, list_);
  item->setData(Qt::UserRole, id);
  auto* area = new QScrollArea(pages_);
  area->setObjectName(QStringLiteral("page-") + id);
  area->setWidgetResizable(true);
  area->setFrameShape(QFrame::NoFrame);
  area->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  auto* page = new QWidget(area);
  auto* column = new QVBoxLayout(page);
  column->setSpacing(scaled(10));
  area->setWidget(page);
  pages_->addWidget(area);
  return column;
}

void PreferencesDialog::finish_page(QVBoxLayout& column, std::function<void()> reset) {
  const int page = pages_->count() - 1;
  if (!reset) {
    column.addStretch(1);
    reset = [this, page] { this->reset(page); };
  }
  auto* back = new QPushButton(tr("Back to defaults"), pages_->widget(page));
  back->setObjectName(QStringLiteral("defaults-") + list_->item(page)->data(Qt::UserRole).toString());
  back->setAccessibleDescription(tr("All of the page “%1”").arg(list_->item(page)->text()));
  back->setAutoDefault(false);
  connect(back, &QPushButton::clicked, this, std::move(reset));
  column.addWidget(back, 0, Qt::AlignRight);
}

/// Title and control in a line, the help below it.
void PreferencesDialog::add_row(QVBoxLayout& column, const QString& key, const QString& title, const QString& help,
                                QWidget* control, std::function<void()> refresh) {
  auto* row = new QWidget(pages_->widget(pages_->count() - 1));
  auto* lines = new QVBoxLayout(row);
  lines->setContentsMargins(0, 0, 0, 0);
  lines->setSpacing(scaled(2));
  auto* line = new QHBoxLayout;
  lines->addLayout(line);
  if (qobject_cast<QCheckBox*>(control) == nullptr) {
    auto* label = new QLabel(title, row);
    label->setBuddy(control);
    line->addWidget(label);
    line->addStretch(1);
  }
  control->setParent(row);
  line->addWidget(control);
  if (qobject_cast<QCheckBox*>(control) != nullptr) line->addStretch(1);
  if (control->objectName().isEmpty()) control->setObjectName(QString(key).replace(QLatin1Char('/'), QLatin1Char('-')));
  if (control->accessibleName().isEmpty()) control->setAccessibleName(title);
  control->setAccessibleDescription(help);
  if (!help.isEmpty()) {
    auto* words = new QLabel(help, row);
    words->setWordWrap(true);
    words->setProperty("role", QStringLiteral("dim"));
    lines->addWidget(words);
  }
  column.addWidget(row);
  rows_.push_back({key, title + QLatin1Char(' ') + help + QLatin1Char(' ') + list_->item(list_->count() - 1)->text(),
                   row, pages_->count() - 1, std::move(refresh)});
}

void PreferencesDialog::add_choice(QVBoxLayout& column, const QString& key, const QString& title, const QString& help,
                                   const QStringList& titles) {
  auto* box = new QComboBox(this);
  const QStringList values = values_of(key);
  for (int k = 0; k < values.size(); ++k) box->addItem(titles[k], values[k]);
  connect(box, &QComboBox::currentIndexChanged, this, [this, box, key] { keep(key, box->currentData()); });
  add_row(column, key, title, help, box, [this, box, key] {
    const QSignalBlocker quiet(box);
    box->setCurrentIndex(std::max(0, box->findData(chosen(settings_, key).toString())));
  });
}

void PreferencesDialog::add_switch(QVBoxLayout& column, const QString& key, const QString& title, const QString& help) {
  auto* box = new QCheckBox(title, this);
  connect(box, &QCheckBox::toggled, this, [this, key](bool on) { keep(key, on); });
  add_row(column, key, title, help, box, [this, box, key] {
    const QSignalBlocker quiet(box);
    box->setChecked(chosen(settings_, key).toBool());
  });
}

void PreferencesDialog::add_folder(QVBoxLayout& column, const QString& key, const QString& title, const QString& help) {
  auto* button = new QPushButton(tr("Choose …"), this);
  button->setAutoDefault(false);
  button->setAccessibleName(tr("Choose: %1").arg(title));
  connect(button, &QPushButton::clicked, this, [this, key, title] {
    const QString folder = QFileDialog::getExistingDirectory(this, title, chosen(settings_, key).toString());
    if (folder.isEmpty()) return;
    keep(key, folder);
    for (const Row& row : rows_) row.refresh();
  });
  add_row(column, key, title, help, button, {});
  auto* place = new QLabel(rows_.back().widget);
  place->setObjectName(QStringLiteral("place-") + key.section(QLatin1Char('/'), 1));
  place->setTextInteractionFlags(Qt::TextSelectableByMouse | Qt::TextSelectableByKeyboard);
  place->setWordWrap(true);
  qobject_cast<QVBoxLayout*>(rows_.back().widget->layout())->insertWidget(1, place);
  rows_.back().refresh = [this, place, key] { place->setText(chosen(settings_, key).toString()); };
}

void PreferencesDialog::add_percent(QVBoxLayout& column, const QString& key, const QString& title,
                                    const QString& help) {
  auto* bar = new ValueBar(title, this);
  bar->setObjectName(QString(key).replace(QLatin1Char('/'), QLatin1Char('-')));
  bar->set_title(QStringLiteral(" "));  // it stands before it
  bar->setMinimumWidth(scaled(220));
  const auto [low, high] = percents_of(key).value();
  bar->set_range(low / 100.0, high / 100.0, ValueBar::Scale::Linear, 0.1);
  bar->set_format(percent_format());
  connect(bar, &ValueBar::editFinished, this, [this, bar, key] { keep(key, qRound(100 * bar->real_value())); });
  add_row(column, key, title, help, bar,
          [this, bar, key] { bar->set_real_value(chosen(settings_, key).toInt() / 100.0); });
}

void PreferencesDialog::add_look() {
  QVBoxLayout* page = add_page(QStringLiteral("look"), tr("Look"));
  add_choice(*page, "look/theme", tr("Theme"), tr("“Like the desktop” is dark where the desktop does not say."),
             {tr("Like the desktop"), tr("Dark"), tr("Light")});
  add_percent(*page, "look/text", tr("Text size"), tr("Of all words and of what is around them."));
  add_switch(*page, "look/reduced-motion", tr("Less motion"), tr("Nothing slides, fades or turns by itself."));
  finish_page(*page);
}

void PreferencesDialog::add_input() {
  QVBoxLayout* page = add_page(QStringLiteral("input"), tr("Input"));
  add_choice(*page, "input/map", tr("Navigation"), tr("Which buttons turn, move and zoom the view."),
             {tr("Blender: middle button"), tr("Industry: Alt and a button"), tr("Pen: beside the model")});
  add_switch(*page, "input/turntable", tr("Turn like on a turntable"),
             tr("What is up stays up. Without it, the model turns freely in all directions."));
  add_switch(*page, "input/pressure", tr("Use the pressure of the pen"),
             tr("Without it, a pen works like a mouse: always at full pressure."));
  add_switch(*page, "input/tilt", tr("Use the tilt of the pen"),
             tr("A pen works with less pressure the flatter it lies: with half of it at 60 degrees."));
  add_switch(*page, "input/single-keys", tr("Single keys choose tools"),
             tr("Off, keys act with Ctrl or Alt only: for people who speak their words, or whose hands tremble."));
  finish_page(*page);
}

void PreferencesDialog::add_drawing(const QString& drawing) {
  QVBoxLayout* page = add_page(QStringLiteral("drawing"), tr("Drawing"));
  auto* with = new QLabel(drawing, this);
  with->setObjectName(QStringLiteral("drawing-device"));
  with->setWordWrap(true);
  with->setMinimumWidth(scaled(320));
  with->setAlignment(Qt::AlignRight);
  with->setTextInteractionFlags(Qt::TextSelectableByMouse | Qt::TextSelectableByKeyboard);
  add_row(*page, {}, tr("Drawn by"), {}, with, [] {});
  add_choice(*page, "drawing/samples", tr("Smooth edges at rest"),
             tr("How often each point is drawn when nothing moves: more is finer, and takes longer."),
             {tr("Off"), tr("4 times"), tr("16 times")});
  finish_page(*page);
}

void PreferencesDialog::add_forces() {
  QVBoxLayout* page = add_page(QStringLiteral("forces"), tr("Forces"));
  add_percent(*page, "forces/most", tr("Most force"),
              tr("Of what the device can give. Less is kinder to a hand that is new to it; the device panel sets less "
                 "still, never more."));
  add_switch(*page, "forces/sound", tr("Sound of the contact"),
             tr("Lets people beside you hear what the tool does to the clay."));
  auto* always =
      new QLabel(tr("These limits always hold on a real device, for the sake of the hand and of the motors:"), this);
  always->setWordWrap(true);
  page->addWidget(always);
  const std::pair<QString, QString> limits[] = {
      {tr("A force grows gently"), tr("It may end at once, but never begins with a blow.")},
      {tr("A late or lost device gets none"), tr("A force that comes late pushes where the hand no longer is.")},
      {tr("A fast hand is braked"), tr("A hand that slips off is slowed.")},
      {tr("Warm motors get less"), tr("Most devices bear their greatest force for seconds only.")},
      {tr("Pause, or Escape twice, ends all forces"), tr("They come back only when you ask for them.")}};
  for (const auto& [title, reason] : limits) {
    auto* line = new QLabel(QStringLiteral("<b>%1.</b> %2").arg(title.toHtmlEscaped(), reason.toHtmlEscaped()), this);
    line->setWordWrap(true);
    page->addWidget(line);
  }
  finish_page(*page);
}

void PreferencesDialog::add_saving() {
  QVBoxLayout* page = add_page(QStringLiteral("saving"), tr("Saving"));
  auto* words = new QLabel(tr("Every finished stroke is saved at once. There is nothing to switch on."), this);
  words->setWordWrap(true);
  page->addWidget(words);
  add_folder(*page, "folders/pictures", tr("Pictures and films"), tr("Where F12 puts them."));
  add_folder(*page, "folders/unnamed", tr("Models without a name"),
             tr("Where they lie until you name them. Models that are there already stay where they are."));
  finish_page(*page);
}

void PreferencesDialog::add_language() {
  QVBoxLayout* page = add_page(QStringLiteral("language"), tr("Language"));
  QStringList titles = {tr("Like the desktop")};
  for (const QString& code : languages()) titles.append(language_title(code));
  add_choice(*page, "language", tr("Language"), tr("The window is built anew; your model stays open."), titles);
  finish_page(*page);
}

void PreferencesDialog::add_keys(KeyMap& keys) {
  QVBoxLayout* page = add_page(QStringLiteral("keys"), tr("Keys"));
  keys_page_ = new KeysPage(keys, this);
  page->addWidget(keys_page_, 1);
  finish_page(*page, [&keys] { keys.reset(); });
}

// ---- What happens

void PreferencesDialog::keep(const QString& key, const QVariant& value) {
  settings_.setValue(key, value);
  emit changed(key);
}

void PreferencesDialog::reset(int page) {
  for (const Row& row : rows_) {
    if (row.page != page || row.key.isEmpty()) continue;
    const QVariant before = chosen(settings_, row.key);
    settings_.remove(row.key);
    row.refresh();
    if (chosen(settings_, row.key) != before) emit changed(row.key);  // another language builds the window anew
  }
}

/// Hides rows and pages that do not hold all typed words, and goes to the first page that does.
void PreferencesDialog::narrow(const QString& typed) {
  const QStringList words = typed.simplified().split(QLatin1Char(' '), Qt::SkipEmptyParts);
  std::vector<bool> found(static_cast<std::size_t>(pages_->count()));
  for (const Row& row : rows_) {
    const bool fits =
        std::ranges::all_of(words, [&](const QString& w) { return row.words.contains(w, Qt::CaseInsensitive); });
    row.widget->setVisible(fits);
    if (fits) found[static_cast<std::size_t>(row.page)] = true;
  }
  found.back() = keys_page_->narrow(typed);
  for (int k = 0; k < list_->count(); ++k) list_->item(k)->setHidden(!found[static_cast<std::size_t>(k)]);
  const auto first = std::ranges::find(found, true);
  nothing_->setVisible(first == found.end());
  pages_->setVisible(first != found.end());
  if (first != found.end() && list_->currentRow() >= 0 && list_->currentItem()->isHidden())
    list_->setCurrentRow(static_cast<int>(first - found.begin()));
}

}  // namespace relief::studio
