#include "navigation_card.h"

#include "widgets/theme.h"

#include <QHBoxLayout>
#include <QLabel>
#include <QPainter>
#include <QPainterPath>
#include <QPushButton>
#include <QVBoxLayout>

namespace relief::studio {

namespace {

/// A mouse from above or a pen beside a model, in a field of 150 x 84.
QPixmap drawing_of(const QString& map, double ratio) {
  const Theme& theme = current_theme();
  const QSizeF field(150, 84);
  QPixmap picture((field * text_scale() * ratio).toSize());
  picture.setDevicePixelRatio(ratio);
  picture.fill(Qt::transparent);
  QPainter painter(&picture);
  painter.setRenderHint(QPainter::Antialiasing);
  painter.scale(text_scale(), text_scale());
  const QPen line(theme.text, 1.7, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin),
      strong(theme.accent, 2.4, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin);
  painter.setPen(line);
  if (map == QLatin1String("pen")) {
    painter.drawEllipse(QPointF(60, 44), 30, 27);
    painter.setPen(strong);
    QPainterPath way(QPointF(100, 66));
    way.quadTo(QPointF(116, 46), QPointF(100, 24));
    painter.drawPath(way);
    painter.drawLine(QPointF(100, 24), QPointF(108, 25));
    painter.drawLine(QPointF(100, 24), QPointF(99, 33));
    painter.setPen(line);
    painter.drawPolyline(QPolygonF({{100, 66}, {106, 58}, {132, 32}, {138, 38}, {112, 64}, {100, 66}}));
    return picture;
  }
  const QRectF body(52, 6, 46, 72);
  QPainterPath outline;
  outline.addRoundedRect(body, 23, 23);
  const bool middle = map == QLatin1String("blender");
  if (!middle) {
    QPainterPath left;
    left.addRect(QRectF(body.left(), body.top(), body.width() / 2, 30));
    painter.fillPath(outline & left, theme.accent);
  }
  painter.drawPath(outline);
  painter.drawLine(QPointF(52, 36), QPointF(98, 36));
  painter.drawLine(QPointF(75, 6), QPointF(75, 36));
  painter.setBrush(middle ? theme.accent : theme.panel);
  painter.drawRoundedRect(QRectF(70, 14, 10, 16), 5, 5);
  if (!middle) {
    painter.setBrush(Qt::NoBrush);
    painter.drawRoundedRect(QRectF(6, 46, 34, 22), 4, 4);
    QFont font = ui_font(9, QFont::DemiBold);
    font.setPointSizeF(font.pointSizeF() / text_scale());
    painter.setFont(font);
    painter.drawText(QRectF(6, 46, 34, 22), Qt::AlignCenter, QStringLiteral("Alt"));
  }
  return picture;
}

/// A picture, a title and words below each other, as wide as they are given and as high as the words then need.
class PictureButton : public QPushButton {
 public:
  PictureButton(const QPixmap& picture, const QString& title, const QString& words, QWidget* parent)
      : QPushButton(parent) {
    auto* column = new QVBoxLayout(this);
    column->setContentsMargins(scaled(8), scaled(10), scaled(8), scaled(10));
    auto* drawing = new QLabel(this);
    drawing->setPixmap(picture);
    auto* head = new QLabel(title, this);
    head->setFont(ui_font(10.5, QFont::DemiBold));
    auto* rest = new QLabel(words, this);
    for (QLabel* label : {drawing, head, rest}) {
      label->setAlignment(Qt::AlignCenter);
      label->setAttribute(Qt::WA_TransparentForMouseEvents);
      column->addWidget(label);
    }
    for (QLabel* label : {head, rest}) label->setWordWrap(true);
    setAccessibleName(title);
    setAccessibleDescription(words);
    setAutoDefault(false);
    QSizePolicy policy(QSizePolicy::Expanding, QSizePolicy::Minimum);
    policy.setHeightForWidth(true);
    setSizePolicy(policy);
  }
  QSize sizeHint() const override { return layout()->sizeHint(); }
  QSize minimumSizeHint() const override { return layout()->minimumSize(); }
  bool hasHeightForWidth() const override { return true; }
  int heightForWidth(int width) const override { return layout()->totalHeightForWidth(width); }

 protected:
  // Layouts of layouts forget the height that words need when they are wrapped.
  void resizeEvent(QResizeEvent* event) override {
    QPushButton::resizeEvent(event);
    setMinimumHeight(heightForWidth(width()));
  }
};

}  // namespace

NavigationCard::NavigationCard(QWidget* parent) : QFrame(parent) {
  setObjectName(QStringLiteral("navigation-question"));
  setProperty("role", QStringLiteral("card"));
  auto* column = new QVBoxLayout(this);
  auto* title = new QLabel(tr("How do you turn the view?"), this);
  title->setFont(ui_font(12, QFont::DemiBold));
  column->addWidget(title);
  auto* row = new QHBoxLayout;
  struct Choice {
    QString map, title, words;
  };
  const std::array choices = {
      Choice{QStringLiteral("blender"), tr("Middle button"), tr("as in Blender; Shift moves")},
      Choice{QStringLiteral("industry"), tr("Alt and left button"), tr("as in film and CAD; middle moves")},
      Choice{QStringLiteral("pen"), tr("Beside the model"), tr("with a pen; Shift moves")}};
  for (const Choice& choice : choices) {
    auto* button = new PictureButton(drawing_of(choice.map, devicePixelRatioF()), choice.title, choice.words, this);
    button->setObjectName(QStringLiteral("map-") + choice.map);
    connect(button, &QPushButton::clicked, this, [this, map = choice.map] { emit mapChosen(map); });
    row->addWidget(button, 1);
  }
  column->addLayout(row);
  auto* hint = new QLabel(tr("The wheel always zooms. This can be changed later under Edit, Preferences."), this);
  hint->setWordWrap(true);
  hint->setProperty("role", QStringLiteral("dim"));
  column->addWidget(hint);
}

}  // namespace relief::studio
