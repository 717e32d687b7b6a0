#include "colour_palette.h"

#include "icons.h"
#include "theme.h"

#include <QButtonGroup>
#include <QColorDialog>
#include <QCoreApplication>
#include <QGridLayout>
#include <QPainter>
#include <QPushButton>
#include <QVBoxLayout>
#include <algorithm>
#include <array>

namespace relief::studio {

namespace {

constexpr int kColumns = 8;

/// Clay, earths and pigments first, in the order of the hues.
constexpr std::array<NamedColour, 16> kColours = {{
    {QT_TRANSLATE_NOOP("Colour", "clay"), 0xffb8a89a},
    {QT_TRANSLATE_NOOP("Colour", "brick red"), 0xffb4452b},
    {QT_TRANSLATE_NOOP("Colour", "ochre"), 0xffd6a23c},
    {QT_TRANSLATE_NOOP("Colour", "moss green"), 0xff4d7a58},
    {QT_TRANSLATE_NOOP("Colour", "sea blue"), 0xff35627f},
    {QT_TRANSLATE_NOOP("Colour", "night blue"), 0xff26303e},
    {QT_TRANSLATE_NOOP("Colour", "plaster white"), 0xffe8dfd5},
    {QT_TRANSLATE_NOOP("Colour", "chestnut brown"), 0xff6e4a37},
    {QT_TRANSLATE_NOOP("Colour", "coral"), 0xffe07a62},
    {QT_TRANSLATE_NOOP("Colour", "sun yellow"), 0xfff2d35c},
    {QT_TRANSLATE_NOOP("Colour", "leaf green"), 0xff8bb24c},
    {QT_TRANSLATE_NOOP("Colour", "sky blue"), 0xff7fb2d6},
    {QT_TRANSLATE_NOOP("Colour", "lavender"), 0xff9a86b8},
    {QT_TRANSLATE_NOOP("Colour", "plum"), 0xff6b3f5e},
    {QT_TRANSLATE_NOOP("Colour", "ash grey"), 0xff85888c},
    {QT_TRANSLATE_NOOP("Colour", "soot black"), 0xff141516},
}};

QString translated(const NamedColour& named) { return QCoreApplication::translate("Colour", named.name); }

/// Square of the distance in sRGB, green counting most, as the eye does.
int distance(const QColor& a, const QColor& b) {
  const int red = a.red() - b.red(), green = a.green() - b.green(), blue = a.blue() - b.blue();
  return 3 * red * red + 6 * green * green + blue * blue;
}

}  // namespace

std::span<const NamedColour> palette_colours() { return kColours; }

QString spoken_name(const QColor& colour) {
  const auto* nearest = std::ranges::min_element(
      kColours, {}, [&colour](const NamedColour& named) { return distance(colour, QColor(named.colour)); });
  if (QColor(nearest->colour).rgb() == colour.rgb()) return translated(*nearest);
  return QCoreApplication::translate("Colour", "close to %1, %2").arg(translated(*nearest), colour.name());
}

Swatch::Swatch(const QColor& colour, QWidget* parent) : QAbstractButton(parent), colour_(colour) {
  setObjectName(QStringLiteral("swatch.") + colour.name());
  setAccessibleName(spoken_name(colour));
  setAccessibleDescription(tr("Paint with %1.").arg(colour.name()));
  setToolTip(spoken_name(colour));
  setCheckable(true);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
}

QSize Swatch::sizeHint() const { return {scaled(24), scaled(24)}; }

void Swatch::paintEvent(QPaintEvent*) {
  const Theme& theme = current_theme();
  QPainter painter(this);
  painter.setRenderHint(QPainter::Antialiasing);
  const QRectF whole = QRectF(rect()).adjusted(1, 1, -1, -1);
  const double gap = isChecked() ? 3 : 1;
  painter.setPen(QPen(theme.line, 1));
  painter.setBrush(isEnabled() ? colour_ : mixed(theme.panel, colour_, 0.4));
  painter.drawRoundedRect(whole.adjusted(gap - 1, gap - 1, 1 - gap, 1 - gap), corner() - 1, corner() - 1);
  if (!isChecked() && !hasFocus()) return;
  painter.setBrush(Qt::NoBrush);
  painter.setPen(QPen(hasFocus() ? theme.accent : theme.text, 2));
  painter.drawRoundedRect(whole, corner(), corner());
}

ColourPalette::ColourPalette(QWidget* parent)
    : QWidget(parent),
      colour_(kColours[0].colour),
      group_(new QButtonGroup(this)),
      grid_(new QGridLayout),
      more_(new QPushButton(icon(u"palette"), tr("Other colour …"))) {
  setObjectName(QStringLiteral("colour_palette"));
  setAccessibleName(tr("Colours"));
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(0, 0, 0, 0);
  grid_->setSpacing(4);
  layout->addLayout(grid_);
  layout->addWidget(more_, 0, Qt::AlignLeading);
  for (std::size_t i = 0; i < kColours.size(); ++i)
    add_swatch(QColor(kColours[i].colour), static_cast<int>(i) / kColumns, static_cast<int>(i) % kColumns);
  more_->setObjectName(QStringLiteral("colour_palette.more"));
  more_->setAccessibleName(tr("Other colour"));
  more_->setAccessibleDescription(tr("Any colour, by hue or by number."));
  more_->setToolTip(more_->accessibleDescription());
  connect(more_, &QPushButton::clicked, this, &ColourPalette::ask_for_any);
  // Assistive tools check a swatch without clicking it.
  connect(group_, &QButtonGroup::buttonToggled, this, [this](const QAbstractButton* button, bool on) {
    const QColor colour = static_cast<const Swatch*>(button)->colour();
    if (on && colour.rgb() != colour_.rgb()) pick(colour);
  });
  show_chosen();
}

Swatch* ColourPalette::add_swatch(const QColor& colour, int row, int column) {
  auto* swatch = new Swatch(colour, this);
  grid_->addWidget(swatch, row, column);
  group_->addButton(swatch);
  return swatch;
}

void ColourPalette::set_colour(const QColor& colour) {
  colour_ = colour;
  show_chosen();
}

void ColourPalette::pick(const QColor& colour) {
  set_colour(colour);
  emit colourPicked(colour_);
}

/// The palette before the last used: a colour that is in both is chosen once.
void ColourPalette::show_chosen() {
  group_->setExclusive(false);  // else the last one checked could not be unchecked
  bool found = false;
  for (QAbstractButton* button : group_->buttons()) {
    const bool chosen = !found && static_cast<Swatch*>(button)->colour().rgb() == colour_.rgb();
    button->setChecked(chosen);
    found |= chosen;
  }
  group_->setExclusive(true);
  setAccessibleDescription(spoken_name(colour_));
}

void ColourPalette::mark_used(const QColor& colour) {
  QList<QColor> used = last_used_;
  used.prepend(colour);
  set_last_used(used);
}

void ColourPalette::set_last_used(const QList<QColor>& colours) {
  QList<QColor> used;
  for (const QColor& colour : colours)
    if (colour.isValid() && !used.contains(colour) && used.size() < kLastUsed) used.append(colour);
  if (used == last_used_) return;
  last_used_ = used;
  fill_last_used();
}

void ColourPalette::fill_last_used() {
  for (Swatch* swatch : recent_) {
    group_->removeButton(swatch);
    swatch->hide();
    swatch->deleteLater();  // it may be the one whose click has led here
  }
  recent_.clear();
  const int gap_row = static_cast<int>(kColours.size()) / kColumns;
  grid_->setRowMinimumHeight(gap_row, last_used_.isEmpty() ? 0 : scaled(4));
  for (qsizetype i = 0; i < last_used_.size(); ++i) {
    const int at = static_cast<int>(i);
    Swatch* swatch = add_swatch(last_used_[i], gap_row + 1 + at / kColumns, at % kColumns);
    const QString name = tr("%1, used before").arg(spoken_name(last_used_[i]));
    swatch->setObjectName(QStringLiteral("used.") + last_used_[i].name());
    swatch->setAccessibleName(name);
    swatch->setToolTip(name);
    recent_.append(swatch);
  }
  show_chosen();
}

void ColourPalette::ask_for_any() {
  auto* dialog = new QColorDialog(colour_, this);
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setOption(QColorDialog::DontUseNativeDialog);  // in our own theme, and by name for assistive tools
  dialog->setWindowTitle(tr("Other colour"));
  connect(dialog, &QColorDialog::colorSelected, this, &ColourPalette::pick);
  dialog->open();
}

}  // namespace relief::studio
