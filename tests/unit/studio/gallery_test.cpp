// Every widget, drawn in both themes, at several text sizes and in both directions of writing. With RELIEF_PICTURES set
// to a folder, the pictures are left there to be looked at.
#include <gtest/gtest.h>
#include <studio/widgets/axis_ball.h>
#include <studio/widgets/banner.h>
#include <studio/widgets/card.h>
#include <studio/widgets/colour_palette.h>
#include <studio/widgets/command_palette.h>
#include <studio/widgets/curve_editor.h>
#include <studio/widgets/drop_area.h>
#include <studio/widgets/force_meter.h>
#include <studio/widgets/icons.h>
#include <studio/widgets/plot.h>
#include <studio/widgets/progress_strip.h>
#include <studio/widgets/theme.h>
#include <studio/widgets/toast.h>
#include <studio/widgets/value_bar.h>

#include <QActionGroup>
#include <QApplication>
#include <QCheckBox>
#include <QColorDialog>
#include <QComboBox>
#include <QDir>
#include <QDockWidget>
#include <QDoubleSpinBox>
#include <QFileDialog>
#include <QGridLayout>
#include <QGroupBox>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QMainWindow>
#include <QMenu>
#include <QMenuBar>
#include <QMessageBox>
#include <QPainter>
#include <QProgressBar>
#include <QPushButton>
#include <QRadioButton>
#include <QSet>
#include <QStatusBar>
#include <QTabWidget>
#include <QTest>
#include <QToolBar>
#include <QToolButton>
#include <QVBoxLayout>
#include <cmath>
#include <functional>
#include <memory>

namespace relief::studio {
namespace {

struct Look {
  const Theme* theme;
  double scale;
  Qt::LayoutDirection direction;
  [[nodiscard]] QString name() const {
    return QStringLiteral("%1-%2%3")
        .arg(is_dark(*theme) ? QStringLiteral("dark") : QStringLiteral("light"))
        .arg(100 * scale)
        .arg(direction == Qt::RightToLeft ? QStringLiteral("-rtl") : QString());
  }
};

std::unique_ptr<QWidget> standard_controls() {
  auto page = std::make_unique<QWidget>();
  auto* layout = new QVBoxLayout(page.get());
  auto* bar = new QToolBar;
  for (const char* id : {"undo", "redo"}) bar->addAction(icon(QString::fromLatin1(id)), QString::fromLatin1(id));
  bar->addSeparator();
  for (const char* id : {"symmetry", "wires", "heat"}) {
    QAction* action = bar->addAction(icon(QString::fromLatin1(id)), QString::fromLatin1(id));
    action->setCheckable(true);
    action->setChecked(QLatin1String(id) == QLatin1String("symmetry"));
  }
  bar->addAction(icon(u"lock"), QStringLiteral("lock"))->setEnabled(false);
  layout->addWidget(bar);
  auto* row = new QHBoxLayout;
  auto* primary = new QPushButton(QStringLiteral("Open a scan"));
  primary->setProperty("role", QStringLiteral("primary"));
  auto* off = new QPushButton(QStringLiteral("Not now"));
  off->setEnabled(false);
  for (QPushButton* button : {primary, new QPushButton(icon(u"freeze"), QStringLiteral("Freeze")), off})
    row->addWidget(button);
  layout->addLayout(row);
  row = new QHBoxLayout;
  auto* size = new QCheckBox(QStringLiteral("Size"));
  auto* strength = new QCheckBox(QStringLiteral("Strength"));
  strength->setChecked(true);
  auto* some = new QCheckBox(QStringLiteral("Some"));
  some->setTristate(true);
  some->setCheckState(Qt::PartiallyChecked);
  auto* one = new QRadioButton(QStringLiteral("One"));
  one->setChecked(true);
  for (QWidget* widget : {static_cast<QWidget*>(size), static_cast<QWidget*>(strength), static_cast<QWidget*>(some),
                          static_cast<QWidget*>(one), static_cast<QWidget*>(new QRadioButton(QStringLiteral("Two")))})
    row->addWidget(widget);
  layout->addLayout(row);
  row = new QHBoxLayout;
  auto* choice = new QComboBox;
  choice->addItems({QStringLiteral("smooth"), QStringLiteral("linear")});
  row->addWidget(choice);
  row->addWidget(new QDoubleSpinBox);
  row->addWidget(new QLineEdit(QStringLiteral("Nefertiti")));
  layout->addLayout(row);
  auto* list = new QListWidget;
  for (const char* text : {"Form", "Colour", "Stiffness"})
    list->addItem(new QListWidgetItem(icon(u"layers"), QString::fromLatin1(text)));
  list->setCurrentRow(1);
  list->setFixedHeight(scaled(110));
  auto* tabs = new QTabWidget;
  tabs->addTab(list, QStringLiteral("Layers"));
  tabs->addTab(new QWidget, QStringLiteral("History"));
  layout->addWidget(tabs);
  auto* progress = new QProgressBar;
  progress->setValue(40);
  layout->addWidget(progress);
  for (const char* role : {"heading", "dim", "good", "warn", "bad"}) {
    auto* label = new QLabel(QStringLiteral("Holding the surface. All is well. (%1)").arg(QLatin1String(role)));
    label->setProperty("role", QString::fromLatin1(role));
    layout->addWidget(label);
  }
  return page;
}

std::unique_ptr<QWidget> all_icons() {
  auto page = std::make_unique<QWidget>();
  auto* grid = new QGridLayout(page.get());
  int at = 0;
  for (const QString& id : icon_ids()) {
    for (int state = 0; state < 2; ++state) {
      auto* button = new QToolButton;
      button->setIcon(icon(id));
      button->setIconSize({scaled(32), scaled(32)});
      button->setCheckable(true);
      button->setChecked(state == 1);
      grid->addWidget(button, at / 10 * 2 + state, at % 10);
    }
    ++at;
  }
  return page;
}

std::unique_ptr<QWidget> value_bars() {
  auto page = std::make_unique<QWidget>();
  auto* layout = new QVBoxLayout(page.get());
  struct Row {
    const char* name;
    double value;
  };
  for (const Row& row : {Row{"Depth", 1}, Row{"Spacing", 0.12}, Row{"Steady stroke", 0.2}}) {
    auto* bar = new ValueBar(QString::fromLatin1(row.name));
    bar->set_format(percent_format());
    bar->set_real_value(row.value);
    layout->addWidget(bar);
  }
  return page;
}

std::unique_ptr<QWidget> curve() {
  auto editor = std::make_unique<CurveEditor>();
  editor->set_curve({.low = 0.05, .high = 0.95, .exponent = 1.8});
  editor->set_live_pressure(0.57);
  return editor;
}

std::unique_ptr<QWidget> plots() {
  auto page = std::make_unique<QWidget>();
  auto* layout = new QVBoxLayout(page.get());
  struct Row {
    const char *title, *text;
    PlotView::Colour colour;
    double limit, size;
  };
  for (const Row& row : {Row{"Force", "1.9 N of 3.3", PlotView::Colour::Good, 3.3, 3},
                         Row{"Depth under the surface", "0.6 mm", PlotView::Colour::Blue, 1, 0.8},
                         Row{"Time per tick", "6 µs, worst 14", PlotView::Colour::Accent, 100, 8}}) {
    auto* plot = new PlotView(QString::fromUtf8(row.title), row.colour);
    std::vector<Sample> samples(10'000);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double t = 0.001 * static_cast<double>(i);
      const double wave = std::max(0.0, std::sin(1.3 * t) + 0.3 * std::sin(4 * t)) / 1.3;
      samples[i] = {.time = t, .value = static_cast<float>(row.size * wave + (i % 4000 == 17 ? 0.8 * row.size : 0))};
    }
    plot->set_limit(row.limit);
    plot->set_text(QString::fromUtf8(row.text));
    plot->append(samples);
    layout->addWidget(plot);
  }
  auto* frozen = page->findChild<PlotView*>();
  frozen->set_frozen(true);
  frozen->set_cursor(2.0);
  return page;
}

std::unique_ptr<QWidget> palette_of_commands() {
  auto window = std::make_unique<QMainWindow>();
  QMenu* menu = window->menuBar()->addMenu(QStringLiteral("&File"));
  menu->addAction(QStringLiteral("Save picture..."), QKeySequence(Qt::Key_F12));
  menu->addAction(icon(u"redo"), QStringLiteral("Redo"), QKeySequence::Redo);
  menu->addAction(QStringLiteral("Preferences..."), QKeySequence(QStringLiteral("Ctrl+,")));
  menu->addAction(QStringLiteral("Record"), QKeySequence(QStringLiteral("Ctrl+R")));
  window->setMinimumSize(scaled(640), scaled(420));
  auto* palette = new CommandPalette(window.get());
  window->resize(window->minimumSize());
  palette->open();
  palette->findChild<QLineEdit*>()->setText(QStringLiteral("re"));
  return window;
}

std::unique_ptr<QWidget> menu() {
  auto made = std::make_unique<QMenu>();
  made->addAction(icon(u"open"), QStringLiteral("Open..."), QKeySequence::Open);
  made->addAction(icon(u"save"), QStringLiteral("Save"), QKeySequence::Save)->setEnabled(false);
  made->addSeparator();
  QAction* wires = made->addAction(QStringLiteral("Slab wires"));
  wires->setCheckable(true);
  wires->setChecked(true);
  made->addAction(QStringLiteral("Heat map"))->setCheckable(true);
  made->addMenu(QStringLiteral("Recent"))->addAction(QStringLiteral("Nefertiti"));
  made->setActiveAction(wires);
  return made;
}

std::unique_ptr<QWidget> colours() {
  auto palette = std::make_unique<ColourPalette>();
  palette->set_colour(QColor(0xb4452b));
  palette->set_last_used({QColor(0xb4452b), QColor(0x2f6f6a), QColor(0xd98e5f)});
  return palette;
}

/// A grey picture with what is painted over it.
class OverPicture : public QWidget {
 public:
  OverPicture() {
    setMinimumSize(scaled(420), scaled(320));
    meter_.set_limit(3.3);
    meter_.set_force(1.9);
  }

 protected:
  void resizeEvent(QResizeEvent*) override {
    meter_.setGeometry(QRect(QPoint(12, height() - meter_.sizeHint().height() - 12), meter_.sizeHint()));
    toast_.say(QStringLiteral("Saved as you work"));
  }
  void paintEvent(QPaintEvent*) override {
    QPainter painter(this);
    painter.fillRect(rect(), is_dark(current_theme()) ? QColor(0x2a2d33) : QColor(0xc4c6ca));
    painter.fillRect(rect().adjusted(width() / 2, 0, 0, 0), QColor(0xcfc4b8));  // pale clay
    const double side = scaled(AxisBall::kSide);
    const double s = std::sqrt(0.5), t = std::sqrt(1.0 / 3), u = std::sqrt(1.0 / 6);
    AxisBall ball;
    ball.set_view({.right = {s, 0, -s}, .up = {-u, 2 * u, -u}, .back = {t, t, t}});
    for (const double x : {0.3, 0.8}) {
      ball.set_square({x * width() - side / 2, 12, side, side});
      ball.set_hovered(x < 0.5 ? std::optional(Axis::X) : std::nullopt);
      ball.paint(painter);
    }
  }

 private:
  ForceMeter& meter_ = *new ForceMeter(this);
  Toast& toast_ = *new Toast(this);
};

std::unique_ptr<QWidget> over_picture() { return std::make_unique<OverPicture>(); }

std::unique_ptr<QWidget> banners() {
  auto page = std::make_unique<QWidget>();
  auto* layout = new QVBoxLayout(page.get());
  page->setMinimumWidth(scaled(620));
  const auto add = [&](Mood mood, const char* words, std::vector<BannerAction> actions) {
    auto* banner = new Banner;
    layout->addWidget(banner);
    banner->say(mood, QString::fromUtf8(words), std::move(actions));
  };
  add(Mood::Bad, "The hand moved too fast; forces are off until you let go.", {});
  add(Mood::Warn, "The disk is full. What you do is kept in memory and saved as soon as there is room.",
      {{QStringLiteral("Try again"), {}}, {QStringLiteral("Save elsewhere..."), {}}});
  add(Mood::Good, "The device is back.", {{QStringLiteral("Go on"), {}}});
  auto* strip = new ProgressStrip;
  strip->start(QStringLiteral("Preparing the surface: parting it into slabs"));
  strip->set_progress(QStringLiteral("Preparing the surface: parting it into slabs"), 0.43);
  layout->addWidget(strip);
  return page;
}

std::unique_ptr<QWidget> start_page() {
  auto page = std::make_unique<QWidget>();
  auto* layout = new QHBoxLayout(page.get());
  layout->addWidget(new DropArea(QStringLiteral("Drop a scan here"),
                                 {QStringLiteral("ply"), QStringLiteral("stl"), QStringLiteral("obj")}));
  QPixmap picture(320, 180);
  picture.fill(QColor(0x6b7480));
  auto* recent = new Card(QStringLiteral("Nefertiti"), {QStringLiteral("2 minutes ago · 214 strokes")});
  recent->set_picture(picture);
  recent->add_button(QStringLiteral("Open"), true);
  layout->addWidget(recent);
  auto* verdict = new Card(QStringLiteral("Tolerant: two thin places may be felt through."),
                           {QStringLiteral("Within 0.09 mm of the scan."), QStringLiteral("Nothing was removed.")});
  verdict->set_mood(Mood::Warn);
  verdict->add_button(QStringLiteral("Show them"), true);
  verdict->add_button(QStringLiteral("Go on"));
  layout->addWidget(verdict);
  return page;
}

/// The frame that the program's window has: bars, a column of tools, docks.
std::unique_ptr<QWidget> window() {
  auto made = std::make_unique<QMainWindow>();
  for (const char* name : {"&File", "&Edit", "&View"}) made->menuBar()->addMenu(QString::fromLatin1(name));
  auto* top = made->addToolBar(QStringLiteral("Top"));
  top->setMovable(false);
  top->addAction(icon(u"undo"), QStringLiteral("Undo"));
  top->addAction(icon(u"redo"), QStringLiteral("Redo"));
  top->addSeparator();
  auto* radius = new ValueBar(QStringLiteral("Radius"));
  radius->setFixedWidth(scaled(190));
  radius->set_range(0.1, 100, ValueBar::Scale::Logarithmic);
  radius->set_format(length_format(QStringLiteral("mm")));
  radius->set_real_value(7.5);
  top->addWidget(radius);
  auto* column = new QToolBar(QStringLiteral("Tools"));
  column->setMovable(false);
  made->addToolBar(Qt::LeftToolBarArea, column);
  auto* group = new QActionGroup(made.get());
  for (const char* id :
       {"touch", "carve", "deposit", "smooth", "flatten", "inflate", "layer", "clay", "paint", "mask"}) {
    QAction* action = column->addAction(icon(QString::fromLatin1(id)), QString::fromLatin1(id));
    action->setCheckable(true);
    group->addAction(action);
  }
  group->actions()[1]->setChecked(true);
  auto* picture = new QWidget;
  picture->setMinimumSize(scaled(500), scaled(420));
  made->setCentralWidget(picture);
  const auto dock = [&made](const char* title, std::unique_ptr<QWidget> inside) {
    auto* panel = new QDockWidget(QString::fromLatin1(title));
    auto* margin = new QWidget;
    auto* layout = new QVBoxLayout(margin);
    layout->setContentsMargins(12, 4, 12, 12);
    inside->layout() ? inside->layout()->setContentsMargins(0, 0, 0, 0) : void();
    layout->addWidget(inside.release());
    panel->setWidget(margin);
    made->addDockWidget(Qt::RightDockWidgetArea, panel);
  };
  dock("Carve", value_bars());
  dock("Pressure", curve());
  dock("Device", plots());
  made->statusBar()->showMessage(QStringLiteral("Tool: Carve"));
  made->statusBar()->addPermanentWidget(new QLabel(QStringLiteral("Certified · 240 slabs")));
  return made;
}

std::unique_ptr<QWidget> message_box() {
  auto box = std::make_unique<QMessageBox>(QMessageBox::Warning, QStringLiteral("Head.stl could not be opened"),
                                           QStringLiteral("Head.stl could not be opened."),
                                           QMessageBox::Open | QMessageBox::Cancel);
  box->setInformativeText(QStringLiteral("Line 12 has five numbers where six are needed."));
  return box;
}

std::unique_ptr<QWidget> colour_dialog() {
  auto dialog = std::make_unique<QColorDialog>(QColor(0xb4452b));
  dialog->setOption(QColorDialog::DontUseNativeDialog);
  return dialog;
}

std::unique_ptr<QWidget> file_dialog() {
  auto dialog = std::make_unique<QFileDialog>(nullptr, QStringLiteral("Open"), QStringLiteral(RELIEF_SOURCE_DIR));
  dialog->setOption(QFileDialog::DontUseNativeDialog);
  return dialog;
}

struct Exhibit {
  const char* name;
  std::function<std::unique_ptr<QWidget>()> make;
  bool ours = true;  ///< else it is made of Qt's own controls, whose names are not ours to give
};

const std::vector<Exhibit>& exhibits() {
  static const std::vector<Exhibit> all = {{"standard", standard_controls, false},
                                           {"icons", all_icons, false},
                                           {"value-bars", value_bars},
                                           {"curve", curve},
                                           {"plots", plots},
                                           {"palette", palette_of_commands},
                                           {"menu", menu, false},
                                           {"colours", colours},
                                           {"over-picture", over_picture},
                                           {"banners", banners},
                                           {"start", start_page},
                                           {"window", window, false},
                                           {"message", message_box, false},
                                           {"colour-dialog", colour_dialog, false},
                                           {"file-dialog", file_dialog, false}};
  return all;
}

/// What can be worked with by keyboard; parts inside other controls (the list of a combo box) have their owner's name.
bool is_control(const QWidget& widget) {
  return widget.focusPolicy() != Qt::NoFocus && widget.isVisible() && !qobject_cast<const QTabBar*>(&widget);
}

TEST(Gallery, EveryControlOfOursSaysWhatItIsOnceOnly) {
  for (const Exhibit& exhibit : exhibits()) {
    if (!exhibit.ours) continue;
    const auto widget = exhibit.make();
    widget->setAttribute(Qt::WA_DontShowOnScreen);
    widget->show();
    QSet<QString> names;
    for (const QWidget* control : widget->findChildren<QWidget*>()) {
      if (!is_control(*control)) continue;
      const std::string which =
          QStringLiteral("%1 %2").arg(QLatin1String(exhibit.name), control->objectName()).toStdString();
      EXPECT_FALSE(control->objectName().isEmpty()) << which;
      EXPECT_FALSE(control->accessibleName().isEmpty()) << which;
      EXPECT_FALSE(names.contains(control->accessibleName())) << which;
      names.insert(control->accessibleName());
    }
  }
}

/// Pixels of the control that the focus changes to the colour of a ring.
int ring_pixels(QWidget& page, QWidget& control) {
  if (QWidget* before = QApplication::focusWidget()) before->clearFocus();
  const QImage without = control.grab().toImage();
  control.setFocus(Qt::TabFocusReason);
  EXPECT_TRUE(control.hasFocus() || QApplication::focusWidget()) << page.objectName().toStdString();
  const QImage with = control.grab().toImage();
  const Theme& theme = current_theme();
  int found = 0;
  for (int y = 0; y < with.height(); ++y) {
    for (int x = 0; x < with.width(); ++x) {
      const QRgb now = with.pixel(x, y);
      found += now != without.pixel(x, y) && (now == theme.accent.rgb() || now == theme.text.rgb());
    }
  }
  return found;
}

TEST(Gallery, FocusIsSeenOnEveryControl) {
  int controls = 0;
  for (const Theme* theme : {&dark_theme(), &light_theme()}) {
    apply(*qApp, *theme, 1);
    for (const Exhibit& exhibit : exhibits()) {
      const auto page = exhibit.make();
      if (qobject_cast<QMenu*>(page.get())) continue;  // a menu has its own current row
      page->show();
      ASSERT_TRUE(QTest::qWaitForWindowActive(page.get()));
      QList<QWidget*> all = page->findChildren<QWidget*>();
      all.append(page.get());
      for (QWidget* control : all) {
        if (!control->isVisible() || !control->isEnabled() || (control->focusPolicy() & Qt::TabFocus) == 0) continue;
        ++controls;
        const QString which = QStringLiteral("%1 %2 %3")
                                  .arg(QLatin1String(exhibit.name), QLatin1String(control->metaObject()->className()),
                                       control->objectName());
        EXPECT_GT(ring_pixels(*page, *control), 30) << which.toStdString();
      }
    }
  }
  apply(*qApp, dark_theme(), 1);
  EXPECT_GT(controls, 100);
}

/// Pixels that have one of two colours.
int count(const QImage& picture, const QColor& a, const QColor& b) {
  int found = 0;
  for (int y = 0; y < picture.height(); ++y) {
    const auto* row = reinterpret_cast<const QRgb*>(picture.constScanLine(y));
    for (int x = 0; x < picture.width(); ++x) found += row[x] == a.rgb() || row[x] == b.rgb();
  }
  return found;
}

/// Labels and buttons whose text does not fit into them.
QStringList clipped(const QWidget& page) {
  QStringList texts;
  for (const QLabel* label : page.findChildren<QLabel*>())
    if (label->isVisible() && !label->wordWrap() && label->width() < label->sizeHint().width())
      texts.append(label->text());
  for (const QAbstractButton* button : page.findChildren<QAbstractButton*>())
    if (button->isVisible() && !button->text().isEmpty() && button->width() < button->minimumSizeHint().width())
      texts.append(button->text());
  for (const ValueBar* bar : page.findChildren<ValueBar*>())
    if (bar->isVisible() && bar->width() < bar->minimumSizeHint().width()) texts.append(bar->accessibleName());
  return texts;
}

TEST(Gallery, ALabelThatIsTooNarrowIsFound) {
  QWidget page;
  auto* label = new QLabel(QStringLiteral("Convert progress"), &page);
  label->resize(10, 20);
  page.show();
  EXPECT_EQ(clipped(page), QStringList{"Convert progress"});
}

TEST(Gallery, EveryWidgetDrawsItselfInEveryLook) {
  const QByteArray folder = qgetenv("RELIEF_PICTURES");
  for (const Look& look : {Look{&dark_theme(), 1, Qt::LeftToRight}, Look{&light_theme(), 1, Qt::LeftToRight},
                           Look{&dark_theme(), 1.5, Qt::LeftToRight}, Look{&light_theme(), 2, Qt::RightToLeft},
                           Look{&dark_theme(), 0.8, Qt::LeftToRight}}) {
    apply(*qApp, *look.theme, look.scale);
    for (const Exhibit& exhibit : exhibits()) {
      const auto widget = exhibit.make();
      widget->setLayoutDirection(look.direction);
      widget->setAttribute(Qt::WA_DontShowOnScreen);
      widget->show();
      widget->resize(widget->sizeHint().expandedTo({scaled(280), 0}));
      QApplication::processEvents();
      const QImage picture = widget->grab().toImage().convertToFormat(QImage::Format_ARGB32);
      const QString which = QStringLiteral("%1 %2").arg(QLatin1String(exhibit.name), look.name());
      EXPECT_EQ(clipped(*widget), QStringList()) << which.toStdString();
      EXPECT_GT(count(picture, look.theme->accent, look.theme->text), 20) << which.toStdString();
      const Theme& other = is_dark(*look.theme) ? light_theme() : dark_theme();
      EXPECT_LT(count(picture, other.panel, other.window), 20) << which.toStdString();
      if (!folder.isEmpty())
        picture.save(QDir(QString::fromLocal8Bit(folder))
                         .filePath(QStringLiteral("%1-%2.png").arg(QLatin1String(exhibit.name), look.name())));
    }
  }
  apply(*qApp, dark_theme(), 1);
}

}  // namespace
}  // namespace relief::studio
