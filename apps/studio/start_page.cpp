#include "start_page.h"

#include "file_desk.h"
#include "text.h"
#include "widgets/card.h"
#include "widgets/drop_area.h"
#include "widgets/icons.h"
#include "widgets/paragraph.h"
#include "widgets/theme.h"

#include <relief/mesh/samples.h>

#include <QDragEnterEvent>
#include <QFileInfo>
#include <QGridLayout>
#include <QLabel>
#include <QLocale>
#include <QMimeData>
#include <QPainter>
#include <QPainterPath>
#include <QPushButton>
#include <QToolButton>
#include <QVBoxLayout>

namespace relief::studio {

namespace {

/// Recent models shown, in rows of four.
constexpr std::size_t kRecent = 8;
constexpr int kAcross = 4;

QLabel* heading(const QString& words, QWidget* parent) {
  auto* label = new QLabel(words, parent);
  label->setFont(ui_font(12, QFont::DemiBold));
  label->setContentsMargins(0, scaled(14), 0, scaled(2));
  return label;
}

/// As high as its words are at its width, which a scroll area does not ask for by itself.
class Page : public QWidget {
 protected:
  void resizeEvent(QResizeEvent*) override { grow(); }
  bool event(QEvent* event) override {
    const bool done = QWidget::event(event);
    if (event->type() == QEvent::LayoutRequest) grow();
    return done;
  }

 private:
  void grow() {
    if (layout() != nullptr && layout()->hasHeightForWidth()) setMinimumHeight(layout()->totalHeightForWidth(width()));
  }
};

/// A picture over a title and lines of detail; the whole of it is the button.
class PictureButton : public QToolButton {
  static constexpr int kPicture = 112, kTitle = 20, kLine = 17, kGap = 7;  // heights, px at 100 %

 public:
  PictureButton(const QString& title, QStringList lines, const QPixmap& picture, QWidget* parent)
      : QToolButton(parent), lines_(std::move(lines)), picture_(picture) {
    setText(title);
    setAccessibleName(title);
    setAccessibleDescription(lines_.join(QStringLiteral(", ")));
    setFixedSize(scaled(178), kGap + scaled(kPicture + kTitle + kLine * static_cast<int>(lines_.size()) + kGap));
    setCursor(Qt::PointingHandCursor);
    setFocusPolicy(Qt::StrongFocus);
  }

 protected:
  void paintEvent(QPaintEvent*) override {
    const Theme& theme = current_theme();
    QPainter painter(this);
    painter.setRenderHint(QPainter::Antialiasing);
    painter.setRenderHint(QPainter::SmoothPixmapTransform);
    const bool lit = underMouse() || hasFocus();
    QPainterPath shape;
    shape.addRoundedRect(QRectF(rect()).adjusted(1, 1, -1, -1), 8, 8);
    painter.fillPath(shape, lit ? theme.raised : theme.panel);
    const QRectF top(1, 1, width() - 2, scaled(kPicture));
    painter.save();
    painter.setClipPath(shape);
    painter.fillRect(top, theme.field);
    if (!picture_.isNull()) {
      const QSizeF size = picture_.size();
      const double scale = std::max(top.width() / size.width(), top.height() / size.height());
      const QSizeF shown = size * scale;
      painter.drawPixmap(QRectF(top.center() - QPointF(shown.width() / 2, shown.height() / 2), shown), picture_,
                         QRectF(picture_.rect()));
    } else {
      const int side = scaled(34);
      painter.drawPixmap(QPointF(top.center().x() - side / 2.0, top.center().y() - side / 2.0),
                         icon_pixmap(u"picture", side, theme.dim, devicePixelRatioF()));
    }
    painter.restore();
    painter.setPen(QPen(lit ? theme.accent : theme.line, hasFocus() ? 2 : 1));
    painter.setBrush(Qt::NoBrush);
    painter.drawPath(shape);
    QRectF line(12, top.bottom() + kGap, width() - 24, scaled(kTitle));
    painter.setFont(ui_font(10, QFont::DemiBold));
    painter.setPen(theme.text);
    painter.drawText(line, Qt::AlignVCenter | Qt::AlignLeft,
                     painter.fontMetrics().elidedText(text(), Qt::ElideRight, static_cast<int>(line.width())));
    painter.setFont(ui_font(9));
    painter.setPen(theme.dim);
    for (const QString& each : lines_) {
      line.translate(0, scaled(kLine));
      painter.drawText(line, Qt::AlignVCenter | Qt::AlignLeft,
                       painter.fontMetrics().elidedText(each, Qt::ElideRight, static_cast<int>(line.width())));
    }
  }

 private:
  QStringList lines_;
  QPixmap picture_;
};

}  // namespace

StartPage::StartPage(Shelf& shelf, QWidget* parent) : QScrollArea(parent), shelf_(shelf) {
  setObjectName(QStringLiteral("start"));
  setAccessibleName(tr("Start page"));
  setWidgetResizable(true);
  setFrameShape(QFrame::NoFrame);
  setAcceptDrops(true);
  build();
  connect(&shelf_, &Shelf::changed, this, &StartPage::build);
}

void StartPage::set_question(std::function<QWidget*(QWidget* parent)> make) {
  question_ = std::move(make);
  build();
}

void StartPage::build() {
  // What was clicked may still be at work.
  if (QWidget* old = takeWidget()) old->deleteLater();
  auto* page = new Page;
  auto* whole = new QHBoxLayout(page);
  auto* middle = new QWidget(page);
  middle->setMaximumWidth(scaled(4 * 190));
  middle->setMinimumWidth(scaled(420));
  auto* column = new QVBoxLayout(middle);
  column->setSpacing(scaled(8));
  whole->addStretch(1);
  whole->addWidget(middle, 8);
  whole->addStretch(1);
  add_recovery(*column);
  add_drop(*column);
  if (QWidget* question = question_ ? question_(middle) : nullptr) column->addWidget(question);
  add_recent(*column);
  add_samples(*column);
  add_hints(*column);
  column->addStretch(1);
  setWidget(page);
}

void StartPage::add_recovery(QVBoxLayout& into) {
  for (const ShelfEntry& entry : shelf_.left_open()) {
    if (entry.strokes == 0) continue;
    const QString words =
        tr("It was open when the program ended. All %n finished stroke(s) are in it, the last one from %1.", nullptr,
           static_cast<int>(entry.strokes))
            .arg(QLocale().toString(entry.used.time(), QLocale::ShortFormat));
    auto* card = new Card(tr("%1 can be opened again").arg(entry.title), {words}, this);
    card->setObjectName(QStringLiteral("recover"));
    card->set_mood(Mood::Warn);
    QPushButton* open = card->add_button(tr("Recover"), true);
    open->setAccessibleDescription(entry.title + QStringLiteral(": ") + words);
    connect(open, &QPushButton::clicked, this, [this, file = entry.file] { emit fileAsked(file); });
    into.addWidget(card);
  }
}

void StartPage::add_drop(QVBoxLayout& into) {
  auto* drop = new DropArea(tr("Drop a scan here"), FileDesk::suffixes(), this);
  drop->setMinimumHeight(scaled(200));
  connect(drop, &DropArea::browseRequested, this, &StartPage::openAsked);
  connect(drop, &DropArea::dropped, this, [this](const QStringList& files) { emit fileAsked(files.first()); });
  into.addWidget(drop);
}

void StartPage::add_samples(QVBoxLayout& into) {
  into.addWidget(heading(tr("Or try a sample"), this));
  auto* row = new QWidget(this);
  auto* across = new QHBoxLayout(row);
  across->setContentsMargins(0, 0, 0, 0);
  for (const std::string_view name : sample_names()) {
    auto* button = new QPushButton(sample_title(text(name)), row);
    button->setObjectName(QStringLiteral("sample-") + text(name));
    button->setAccessibleDescription(tr("Makes the sample model and opens it"));
    connect(button, &QPushButton::clicked, this, [this, id = text(name)] { emit sampleAsked(id); });
    across->addWidget(button);
  }
  across->addStretch(1);
  into.addWidget(row);
}

void StartPage::add_recent(QVBoxLayout& into) {
  if (shelf_.recent().empty()) return;
  into.addWidget(heading(tr("Recent"), this));
  auto* grid = new QWidget(this);
  auto* cells = new QGridLayout(grid);
  cells->setContentsMargins(0, 0, 0, 0);
  cells->setAlignment(Qt::AlignLeft);
  int k = 0;
  for (const ShelfEntry& entry : shelf_.recent()) {
    if (k >= static_cast<int>(kRecent)) break;
    auto* button = new PictureButton(entry.title,
                                     {ago_text(entry.used.secsTo(QDateTime::currentDateTime())),
                                      tr("%n stroke(s)", nullptr, static_cast<int>(entry.strokes))},
                                     QPixmap(entry.picture), grid);
    button->setToolTip(entry.unnamed ? tr("Without a name yet; kept by the program") : entry.file);
    connect(button, &QToolButton::clicked, this, [this, file = entry.file] { emit fileAsked(file); });
    cells->addWidget(button, k / kAcross, k % kAcross);
    ++k;
  }
  into.addWidget(grid);
}

void StartPage::add_hints(QVBoxLayout& into) {
  into.addWidget(heading(tr("What can I do here?"), this));
  struct Hint {
    QStringView picture;
    QString title, words;
  };
  const std::array hints = {
      Hint{u"carve", tr("Sculpt"),
           tr("Drag on the model to carve. Shift smooths, Ctrl builds up. F and a drag set the size.")},
      Hint{u"camera", tr("Look around"),
           tr("Drag beside the model to turn it. The wheel zooms, Home shows all of it.")},
      Hint{u"device", tr("Feel"), tr("With a haptic device, or the mouse as a probe: choose it at the upper right.")}};
  auto* row = new QWidget(this);
  auto* across = new QHBoxLayout(row);
  across->setContentsMargins(0, 0, 0, 0);
  for (const Hint& hint : hints) {
    auto* box = new QFrame(row);
    box->setProperty("role", QStringLiteral("card"));
    auto* column = new QVBoxLayout(box);
    column->setContentsMargins(scaled(16), scaled(14), scaled(16), scaled(14));
    auto* sign = new QLabel(box);
    sign->setPixmap(icon_pixmap(hint.picture, scaled(26), current_theme().accent, devicePixelRatioF()));
    auto* title = new QLabel(hint.title, box);
    title->setFont(ui_font(10.5, QFont::DemiBold));
    auto* words = new Paragraph(hint.words, box);
    column->addWidget(sign);
    column->addWidget(title);
    column->addWidget(words);
    column->addStretch(1);
    across->addWidget(box, 1);
  }
  into.addWidget(row);
}

void StartPage::dragEnterEvent(QDragEnterEvent* event) {
  if (event->mimeData()->hasUrls()) event->acceptProposedAction();
}

void StartPage::dropEvent(QDropEvent* event) {
  for (const QUrl& url : event->mimeData()->urls())
    if (url.isLocalFile()) {
      event->acceptProposedAction();
      emit fileAsked(url.toLocalFile());
      return;
    }
}

}  // namespace relief::studio
