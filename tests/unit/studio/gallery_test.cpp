// Every widget, drawn in both themes, at several text sizes and in both directions of writing. With RELIEF_PICTURES set
// to a folder, the pictures are left there to be looked at.
#include <gtest/gtest.h>
#include <studio/widgets/icons.h>
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
#include <QMenu>
#include <QMenuBar>
#include <QProgressBar>
#include <QPushButton>
#include <QRadioButton>
#include <QTabWidget>
#include <QToolBar>
#include <QToolButton>
#include <QVBoxLayout>
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

struct Exhibit {
  const char* name;
  std::function<std::unique_ptr<QWidget>()> make;
};

const std::vector<Exhibit>& exhibits() {
  static const std::vector<Exhibit> all = {
      {"standard", standard_controls}, {"icons", all_icons}, {"value-bars", value_bars}};
  return all;
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
      EXPECT_FALSE(picture.allGray()) << exhibit.name;  // the accent is in it
      if (!folder.isEmpty())
        picture.save(QDir(QString::fromLocal8Bit(folder))
                         .filePath(QStringLiteral("%1-%2.png").arg(QLatin1String(exhibit.name), look.name())));
    }
  }
  apply(*qApp, dark_theme(), 1);
}

}  // namespace
}  // namespace relief::studio
