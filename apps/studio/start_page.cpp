#include "start_page.h"

#include "text.h"
#include "widgets/icons.h"
#include "widgets/theme.h"

#include <relief/mesh/samples.h>

#include <QDragEnterEvent>
#include <QFileInfo>
#include <QGridLayout>
#include <QLabel>
#include <QLocale>
#include <QMimeData>
#include <QPainter>
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

/// A picture over a title and a line of detail.
QToolButton* card(const QString& title, const QString& detail, const QIcon& picture, QWidget* parent) {
  auto* button = new QToolButton(parent);
  button->setToolButtonStyle(Qt::ToolButtonTextUnderIcon);
  button->setText(detail.isEmpty() ? title : title + QLatin1Char('\n') + detail);
  button->setIcon(picture);
  button->setIconSize(QSize(scaled(150), scaled(96)));
  button->setFixedSize(scaled(178), scaled(158));
  button->setAccessibleName(title);
  button->setAccessibleDescription(detail);
  button->setProperty("card", true);
  return button;
}

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

void StartPage::build() {
  auto* page = new QWidget;
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
  add_recent(*column);
  add_samples(*column);
  add_hints(*column);
  column->addStretch(1);
  setWidget(page);
}

void StartPage::add_recovery(QVBoxLayout& into) {
  for (const ShelfEntry& entry : shelf_.left_open()) {
    auto* row = new QWidget(this);
    row->setObjectName(QStringLiteral("recover"));
    row->setProperty("banner", QStringLiteral("warn"));
    auto* across = new QHBoxLayout(row);
    auto* sign = new QLabel(row);
    sign->setPixmap(icon_pixmap(u"recover", scaled(22), current_theme().warn, devicePixelRatioF()));
    across->addWidget(sign);
    const QString words = tr("%1 was open when the program ended. All %n finished stroke(s) are in it, the last one from %2.", nullptr,
                             static_cast<int>(entry.strokes))
                              .arg(entry.title, QLocale().toString(entry.used.time(), QLocale::ShortFormat));
    auto* label = new QLabel(words, row);
    label->setWordWrap(true);
    label->setAccessibleDescription(words);
    across->addWidget(label, 1);
    auto* open = new QPushButton(tr("Recover"), row);
    open->setAccessibleDescription(words);
    connect(open, &QPushButton::clicked, this, [this, file = entry.file] { emit fileAsked(file); });
    across->addWidget(open);
    into.addWidget(row);
  }
}

void StartPage::add_drop(QVBoxLayout& into) {
  auto* drop = new QWidget(this);
  drop->setObjectName(QStringLiteral("drop"));
  drop->setProperty("dropArea", true);
  auto* column = new QVBoxLayout(drop);
  column->setContentsMargins(scaled(24), scaled(26), scaled(24), scaled(26));
  auto* title = new QLabel(tr("Drop a scan here"), drop);
  title->setAlignment(Qt::AlignCenter);
  title->setFont(ui_font(17, QFont::DemiBold));
  auto* detail = new QLabel(tr("PLY, OBJ, STL, OFF, glTF or 3MF. It can be turned at once and carved some seconds later."), drop);
  detail->setAlignment(Qt::AlignCenter);
  detail->setWordWrap(true);
  auto* open = new QPushButton(icon(u"open"), tr("Open a file …"), drop);
  open->setObjectName(QStringLiteral("open-file"));
  open->setProperty("accent", true);
  open->setDefault(true);
  open->setAccessibleDescription(tr("Opens a scan or a Relief model"));
  connect(open, &QPushButton::clicked, this, &StartPage::openAsked);
  column->addWidget(title);
  column->addWidget(detail);
  column->addSpacing(scaled(8));
  column->addWidget(open, 0, Qt::AlignCenter);
  into.addWidget(drop);
}

void StartPage::add_samples(QVBoxLayout& into) {
  into.addWidget(heading(tr("Or try a sample"), this));
  auto* row = new QWidget(this);
  auto* across = new QHBoxLayout(row);
  across->setContentsMargins(0, 0, 0, 0);
  for (const std::string_view name : sample_names()) {
    QString title = text(name);
    title[0] = title[0].toUpper();
    auto* button = new QPushButton(title, row);
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
    const QString detail = ago_text(entry.used.secsTo(QDateTime::currentDateTime())) + QStringLiteral(" · ") +
                           tr("%n stroke(s)", nullptr, static_cast<int>(entry.strokes));
    QToolButton* button = card(entry.title, detail, entry.picture.isEmpty() ? icon(u"picture") : QIcon(entry.picture), grid);
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
    const char16_t* picture;
    QString title, words;
  };
  const std::array hints = {
      Hint{u"carve", tr("Sculpt"), tr("Drag on the model to carve. Shift smooths, Ctrl builds up. F and a drag set the size.")},
      Hint{u"camera", tr("Look around"), tr("Drag beside the model to turn it. The wheel zooms, Home shows all of it.")},
      Hint{u"device", tr("Feel"), tr("With a haptic device, or the mouse as a probe: choose it at the upper right.")}};
  auto* row = new QWidget(this);
  auto* across = new QHBoxLayout(row);
  across->setContentsMargins(0, 0, 0, 0);
  for (const Hint& hint : hints) {
    auto* box = new QWidget(row);
    box->setProperty("panelBox", true);
    auto* column = new QVBoxLayout(box);
    auto* sign = new QLabel(box);
    sign->setPixmap(icon_pixmap(hint.picture, scaled(26), current_theme().accent, devicePixelRatioF()));
    auto* title = new QLabel(hint.title, box);
    title->setFont(ui_font(10.5, QFont::DemiBold));
    auto* words = new QLabel(hint.words, box);
    words->setWordWrap(true);
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
