#include "banner.h"

#include "accessible.h"
#include "icons.h"
#include "paragraph.h"

#include <QEvent>
#include <QHBoxLayout>
#include <QLabel>
#include <QPainter>
#include <QPushButton>
#include <QStyle>
#include <algorithm>
#include <utility>

namespace relief::studio {

namespace {

constexpr int kIcon = 22, kEdge = 5;   // pixels: the icon, the strip of colour before it
constexpr double kGroundShare = 0.14;  // of the state's colour in the background; text keeps 4.5:1 on it

}  // namespace

Banner::Banner(QWidget* parent) : QFrame(parent), icon_(new QLabel), words_(new Paragraph), buttons_(new QHBoxLayout) {
  set_accessible_role(this, QAccessible::AlertMessage);
  setObjectName(QStringLiteral("banner"));
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Minimum);
  words_->setObjectName(QStringLiteral("banner.words"));
  words_->setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Preferred);
  auto* layout = new QHBoxLayout(this);
  layout->setContentsMargins(0, 7, 0, 7);
  layout->addSpacing(2 * kEdge + 5);  // spaces, not margins: they change sides where text runs from the right
  layout->addWidget(icon_);
  layout->addSpacing(kEdge);
  layout->addWidget(words_);
  layout->addLayout(buttons_);
  layout->addSpacing(2 * kEdge);
  hide();
}

bool Banner::say(Mood mood, const QString& words, std::vector<BannerAction> actions, const QString& subject) {
  if (std::ranges::any_of(
          said_, [&](const Said& each) { return each.subject == subject && each.words == words && each.mood == mood; }))
    return false;
  const bool was_seen = !said_.empty() && said_.back().subject == subject;
  std::erase_if(said_, [&](const Said& each) { return each.subject == subject; });
  if (actions.empty()) actions.push_back({tr("I have read it"), {}});
  const auto worse = std::ranges::find_if(said_, [&](const Said& each) { return each.mood > mood; });
  const bool is_seen = worse == said_.end();
  said_.insert(worse, {subject, words, mood, std::move(actions)});
  if (was_seen || is_seen) show_first();
  return true;
}

void Banner::retract(const QString& subject) {
  if (said_.empty()) return;
  const bool seen = said_.back().subject == subject;
  std::erase_if(said_, [&](const Said& each) { return each.subject == subject; });
  if (!seen) return;
  if (!said_.empty()) {
    show_first();
    return;
  }
  hide();
  emit closed();
}

void Banner::show_first() {
  const Said& first = said_.back();
  words_->setText(first.words);
  show_icon();
  setAccessibleName(first.words);
  while (QLayoutItem* item = buttons_->takeAt(0)) {
    item->widget()->hide();
    item->widget()->deleteLater();  // it may be the one whose click has led here
    delete item;
  }
  for (const BannerAction& action : first.actions) {
    auto* button = new QPushButton(action.text);
    button->setObjectName(QStringLiteral("banner.") + action.text);
    button->setAccessibleName(action.text);
    button->setAccessibleDescription(first.words);
    button->setToolTip(action.text);
    connect(button, &QPushButton::clicked, this, [this, subject = first.subject, run = action.run] {
      retract(subject);
      if (run) run();
    });
    buttons_->addWidget(button);
  }
  show();
  update();
  QAccessibleEvent event(this, QAccessible::Alert);
  QAccessible::updateAccessibility(&event);
}

QColor Banner::ground() const { return mixed(current_theme().panel, colour_of(mood()), kGroundShare); }

void Banner::show_icon() {
  icon_->setPixmap(icon_pixmap(icon_of(mood()), scaled(kIcon), colour_of(mood()), devicePixelRatioF()));
}

void Banner::changeEvent(QEvent* event) {
  if (event->type() == QEvent::StyleChange) show_icon();
  QFrame::changeEvent(event);
}

void Banner::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  const QColor colour = colour_of(mood());
  painter.fillRect(rect(), ground());
  painter.fillRect(QStyle::visualRect(layoutDirection(), rect(), {0, 0, kEdge, height()}), colour);
  painter.fillRect(QRect(0, height() - 1, width(), 1), mixed(ground(), colour, 0.5));
}

}  // namespace relief::studio
