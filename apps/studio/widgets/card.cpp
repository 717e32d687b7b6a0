#include "card.h"

#include "accessible.h"
#include "icons.h"

#include <QEvent>
#include <QHBoxLayout>
#include <QLabel>
#include <QPainter>
#include <QPainterPath>
#include <QPushButton>
#include <QStyle>
#include <QVBoxLayout>

namespace relief::studio {

namespace {

constexpr int kPictureWidth = 240, kPictureHeight = 135;  // pixels at 100 % text

/// The middle of `picture` in a frame of `size`, with round corners.
QPixmap cut(const QPixmap& picture, QSize size, double pixel_ratio) {
  const QSize pixels = size * pixel_ratio;
  const QPixmap filling = picture.scaled(pixels, Qt::KeepAspectRatioByExpanding, Qt::SmoothTransformation);
  QPixmap made(pixels);
  made.fill(Qt::transparent);
  QPainter painter(&made);
  painter.setRenderHint(QPainter::Antialiasing);
  QPainterPath shape;
  shape.addRoundedRect(made.rect(), corner() * pixel_ratio, corner() * pixel_ratio);
  painter.setClipPath(shape);
  painter.drawPixmap((pixels.width() - filling.width()) / 2, (pixels.height() - filling.height()) / 2, filling);
  painter.end();
  made.setDevicePixelRatio(pixel_ratio);
  return made;
}

}  // namespace

Card::Card(const QString& title, const QStringList& lines, QWidget* parent)
    : QFrame(parent),
      picture_(new QLabel),
      icon_(new QLabel),
      title_(new QLabel),
      lines_(new QVBoxLayout),
      buttons_(new QHBoxLayout) {
  set_accessible_role(this, QAccessible::Grouping);
  setProperty("role", QStringLiteral("card"));
  title_->setWordWrap(true);
  picture_->hide();
  icon_->hide();
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(16, 14, 16, 14);
  layout->addWidget(picture_, 0, Qt::AlignHCenter);
  auto* head = new QHBoxLayout;
  head->addWidget(icon_);
  head->addWidget(title_, 1);
  layout->addLayout(head);
  lines_->setSpacing(3);
  layout->addLayout(lines_);
  layout->addStretch();
  buttons_->addStretch();
  layout->addLayout(buttons_);
  set_title(title);
  set_lines(lines);
  show_mood();
}

void Card::set_title(const QString& title) {
  title_->setText(title);
  setObjectName(QStringLiteral("card.") + title);
  setAccessibleName(title);
}

void Card::set_lines(const QStringList& lines) {
  while (QLayoutItem* item = lines_->takeAt(0)) {
    delete item->widget();
    delete item;
  }
  for (const QString& line : lines) {
    auto* label = new QLabel(line);
    label->setWordWrap(true);
    lines_->addWidget(label);
  }
  describe(this, lines.join(u' '));
}

void Card::set_mood(Mood mood) {
  mood_ = mood;
  show_mood();
}

void Card::show_mood() {
  const bool plain = mood_ == Mood::Plain;
  icon_->setVisible(!plain);
  if (!plain) icon_->setPixmap(icon_pixmap(icon_of(mood_), scaled(22), colour_of(mood_), devicePixelRatioF()));
  static constexpr const char* kNames[] = {"", "good", "warn", "bad"};
  const QString mood = QLatin1String(kNames[static_cast<int>(mood_)]);
  if (title_->property("mood").toString() != mood) {
    title_->setProperty("mood", mood);
    title_->style()->unpolish(title_);  // the style sheet looks at properties only then
    title_->style()->polish(title_);
  }
  title_->setFont(ui_font(12.5, QFont::DemiBold));
}

void Card::set_picture(const QPixmap& picture) {
  picture_->setVisible(!picture.isNull());
  if (!picture.isNull())
    picture_->setPixmap(cut(picture, {scaled(kPictureWidth), scaled(kPictureHeight)}, devicePixelRatioF()));
}

QPushButton* Card::add_button(const QString& text, bool primary) {
  auto* button = new QPushButton(text);
  button->setObjectName(QStringLiteral("%1.%2").arg(objectName(), text));
  button->setAccessibleName(text);
  button->setAccessibleDescription(accessibleName());
  button->setToolTip(text);
  if (primary) button->setProperty("role", QStringLiteral("primary"));
  buttons_->addWidget(button);
  return button;
}

void Card::changeEvent(QEvent* event) {
  if (event->type() == QEvent::StyleChange) show_mood();
  QFrame::changeEvent(event);
}

}  // namespace relief::studio
