// Every widget, drawn in both themes, at several text sizes and in both directions of writing. With RELIEF_PICTURES set
// to a folder, the pictures are left there to be looked at.
#include <gtest/gtest.h>
#include <studio/widgets/command_palette.h>
#include <studio/widgets/curve_editor.h>
#include <studio/widgets/icons.h>
#include <studio/widgets/plot.h>
#include <studio/widgets/theme.h>
#include <studio/widgets/value_bar.h>

#include <QApplication>
#include <QCheckBox>
#include <QComboBox>
#include <QDir>
#include <QDoubleSpinBox>
#include <QGridLayout>
#include <QGroupBox>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QMainWindow>
#include <QMenu>
#include <QMenuBar>
#include <QProgressBar>
#include <QPushButton>
#include <QRadioButton>
#include <QTabWidget>
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

struct Exhibit {
  const char* name;
  std::function<std::unique_ptr<QWidget>()> make;
};

const std::vector<Exhibit>& exhibits() {
  static const std::vector<Exhibit> all = {{"standard", standard_controls},
                                           {"icons", all_icons},
                                           {"value-bars", value_bars},
                                           {"curve", curve},
                                           {"plots", plots},
                                           {"palette", palette_of_commands},
                                           {"menu", menu}};
  return all;
}

bool has(const QImage& picture, const QColor& colour) {
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x)
      if (picture.pixel(x, y) == colour.rgb()) return true;
  return false;
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
      const QImage picture = widget->grab().toImage();
      const QString which = QStringLiteral("%1 %2").arg(QLatin1String(exhibit.name), look.name());
      EXPECT_TRUE(has(picture, look.theme->accent) || has(picture, look.theme->text)) << which.toStdString();
      const Theme& other = is_dark(*look.theme) ? light_theme() : dark_theme();
      EXPECT_FALSE(has(picture, other.panel) || has(picture, other.window)) << which.toStdString();
      if (!folder.isEmpty())
        picture.save(QDir(QString::fromLocal8Bit(folder))
                         .filePath(QStringLiteral("%1-%2.png").arg(QLatin1String(exhibit.name), look.name())));
    }
  }
  apply(*qApp, dark_theme(), 1);
}

}  // namespace
}  // namespace relief::studio
