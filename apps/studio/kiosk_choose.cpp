#include "kiosk_choose.h"

#include "languages.h"
#include "widgets/theme.h"

#include <QGridLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QToolButton>
#include <QVBoxLayout>
#include <algorithm>

namespace relief::studio {

namespace {

/// Cards in a row at most: three are large on a screen of 1280 pixels and more.
constexpr std::size_t kAcross = 3;

}  // namespace

KioskChoose::KioskChoose(const std::vector<Exhibit>& exhibits, QWidget* parent)
    : QScrollArea(parent), exhibits_(exhibits) {
  setObjectName(QStringLiteral("kiosk-choose"));
  setWidgetResizable(true);
  setFrameShape(QFrame::NoFrame);
  setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  auto* page = new QWidget(this);
  auto* column = new QVBoxLayout(page);
  column->setContentsMargins(scaled(40), scaled(48), scaled(40), scaled(40));
  column->setSpacing(scaled(32));
  add_languages(*column);
  heading_ = new QLabel(page);
  heading_->setFont(ui_font(26, QFont::DemiBold));
  heading_->setAlignment(Qt::AlignCenter);
  heading_->setWordWrap(true);
  column->addWidget(heading_);
  nothing_ = new QLabel(page);
  nothing_->setFont(ui_font(16));
  nothing_->setAlignment(Qt::AlignCenter);
  nothing_->setVisible(exhibits_.empty());
  column->addWidget(nothing_);
  auto* grid = new QGridLayout;
  grid->setSpacing(scaled(28));
  grid->setAlignment(Qt::AlignCenter);
  for (std::size_t k = 0; k < exhibits_.size(); ++k) {
    auto* card = new QToolButton(page);
    card->setObjectName(QStringLiteral("exhibit-%1").arg(k));
    card->setToolButtonStyle(Qt::ToolButtonTextUnderIcon);
    card->setFont(ui_font(17, QFont::DemiBold));
    card->setIconSize(picture_size());
    card->setFixedSize(picture_size() + QSize(scaled(24), scaled(64)));
    connect(card, &QToolButton::clicked, this, [this, k] { emit chosen(static_cast<int>(k)); });
    grid->addWidget(card, static_cast<int>(k / kAcross), static_cast<int>(k % kAcross));
    cards_.push_back(card);
  }
  column->addLayout(grid);
  column->addStretch(1);
  setWidget(page);
}

/// A button for each language that captions and program have, where there are several.
void KioskChoose::add_languages(QVBoxLayout& into) {
  QStringList spoken = languages();
  spoken.removeIf([&](const QString& code) {
    return std::ranges::none_of(exhibits_, [&](const Exhibit& each) { return each.captions.contains(code); });
  });
  if (spoken.size() < 2) return;
  auto* row = new QHBoxLayout;
  row->addStretch(1);
  for (const QString& code : spoken) {
    auto* button = new QPushButton(language_title(code));
    button->setObjectName(QStringLiteral("language-") + code);
    button->setFont(ui_font(15));
    button->setMinimumSize(scaled(130), scaled(56));
    connect(button, &QPushButton::clicked, this, [this, code] { emit languageChosen(code); });
    row->addWidget(button);
  }
  into.addLayout(row);
}

QSize KioskChoose::picture_size() const { return {scaled(380), scaled(270)}; }

void KioskChoose::set_language(const QString& language) {
  heading_->setText(tr("Touch one to begin"));
  nothing_->setText(tr("Nothing can be shown just now. Please tell the staff."));
  for (std::size_t k = 0; k < cards_.size(); ++k) {
    const Exhibit::Caption& caption = exhibits_[k].caption(language);
    cards_[k]->setText(caption.title);
    cards_[k]->setAccessibleName(caption.title);
    cards_[k]->setAccessibleDescription(caption.sentences.join(QLatin1Char(' ')));
  }
}

void KioskChoose::set_picture(std::size_t exhibit, const QImage& picture) {
  cards_[exhibit]->setIcon(QIcon(QPixmap::fromImage(picture)));
}

void KioskChoose::take_away(std::size_t exhibit) {
  cards_[exhibit]->hide();
  nothing_->setVisible(
      std::ranges::none_of(cards_, [](const QToolButton* card) { return card->isVisibleTo(card->parentWidget()); }));
}

}  // namespace relief::studio
