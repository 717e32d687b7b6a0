// The window as a whole, without a screen: what is chosen for good holds in it at once.
#include "bowl.h"

#include <relief/file/model_file.h>

#include <gtest/gtest.h>
#include <studio/desktop_scheme.h>
#include <studio/docks.h>
#include <studio/hand.h>
#include <studio/languages.h>
#include <studio/main_window.h>
#include <studio/preferences_dialog.h>
#include <studio/text.h>
#include <studio/tool_state.h>
#include <studio/widgets/banner.h>
#include <studio/widgets/command_palette.h>
#include <studio/widgets/curve_editor.h>
#include <studio/widgets/theme.h>

#include <QAbstractButton>
#include <QAction>
#include <QApplication>
#include <QCheckBox>
#include <QComboBox>
#include <QDir>
#include <QDockWidget>
#include <QLineEdit>
#include <QListWidget>
#include <QMenuBar>
#include <QTabBar>
#include <QTemporaryDir>
#include <QTest>
#include <QThreadPool>
#include <QToolBar>
#include <QToolButton>
#include <cstdlib>
#include <map>
#include <memory>
#include <set>
#include <utility>

namespace relief::studio {
namespace {

struct Window : testing::Test {
  Window() {
    for (const auto& [variable, name] : {std::pair{"XDG_STATE_HOME", "/s"},
                                         {"XDG_CONFIG_HOME", "/c"},
                                         {"XDG_CACHE_HOME", "/k"},
                                         {"XDG_DATA_HOME", "/d"}})
      qputenv(variable, (folder.path() + QLatin1String(name)).toUtf8());
    qputenv("MESA_SHADER_CACHE_DISABLE", "true");
  }
  ~Window() override {
    window.reset();
    QThreadPool::globalInstance()->waitForDone();
    apply(*qApp, dark_theme(), 1);
  }
  MainWindow& make() {
    window = std::make_unique<MainWindow>(settings, desktop);
    window->show();
    return *window;
  }
  QAction& action(const QString& id) { return *window->findChild<QAction*>(id); }
  template <typename T>
  T* find(const QString& name) {
    return window->findChild<T*>(name);
  }
  PreferencesDialog& preferences() {
    action("preferences").trigger();
    return *window->findChild<PreferencesDialog*>();
  }
  bool open() {
    const QString file = folder.filePath("bowl.relief");
    EXPECT_TRUE(ModelFile::create(path(file), bowl()));
    window->open(file);
    return QTest::qWaitFor([&] { return window->viewport().scene().model != nullptr; }, 30'000);
  }

  QTemporaryDir folder;
  QSettings settings{folder.filePath("studio.conf"), QSettings::IniFormat};
  DesktopScheme desktop;
  std::unique_ptr<MainWindow> window;
};

TEST_F(Window, TheFirstStartAsksForTheNavigationOnce) {
  make();
  auto* industry = find<QAbstractButton>("map-industry");
  ASSERT_NE(industry, nullptr);
  industry->click();
  QApplication::processEvents();
  EXPECT_EQ(settings.value("input/map").toString(), "industry");
  QApplication::sendPostedEvents(nullptr, QEvent::DeferredDelete);
  EXPECT_EQ(find<QAbstractButton>("map-industry"), nullptr);
  make();
  EXPECT_EQ(find<QAbstractButton>("map-industry"), nullptr);
}

TEST_F(Window, PreferencesHoldAtOnce) {
  make();
  PreferencesDialog& dialog = preferences();
  auto* theme = dialog.findChild<QComboBox*>("look-theme");
  theme->setCurrentIndex(theme->findData("light"));
  EXPECT_EQ(current_theme(), light_theme());
  dialog.findChild<QCheckBox*>("look-reduced-motion")->setChecked(true);
  EXPECT_TRUE(reduced_motion());
  EXPECT_FALSE(window->isAnimated());
  dialog.findChild<QCheckBox*>("input-single-keys")->setChecked(false);
  EXPECT_TRUE(action("tool-carve").shortcut().isEmpty());
  EXPECT_EQ(action("undo").shortcut(), QKeySequence("Ctrl+Z"));
  EXPECT_FALSE(action("tool-carve").toolTip().contains("(C)"));
  auto* samples = dialog.findChild<QComboBox*>("drawing-samples");
  samples->setCurrentIndex(samples->findData("4"));
  EXPECT_EQ(window->viewport().final_frame().samples, 4);
  // So they do in the next window.
  make();
  EXPECT_TRUE(action("tool-carve").shortcut().isEmpty());
  EXPECT_EQ(window->viewport().final_frame().samples, 4);
  set_reduced_motion(false);
}

TEST_F(Window, TheNextOneHasTheClayTheLightAndThePensCurve) {
  make();
  auto* curve = find<CurveEditor>("pressure-curve");
  ASSERT_NE(curve, nullptr);
  EXPECT_EQ(curve->curve(), PressureCurve());
  const int clay = window->viewport().look().matcap == 1 ? 2 : 1;
  const bool cavity = window->viewport().look().cavity;
  action(QStringLiteral("matcap-%1").arg(clay)).trigger();
  action("cavity").trigger();
  action("wires").trigger();
  emit curve->curveEdited({0.1, 0.8, 2.5});
  make();
  EXPECT_EQ(window->viewport().look().matcap, clay);
  EXPECT_EQ(window->viewport().look().cavity, !cavity);
  EXPECT_FALSE(window->viewport().look().slab_wires);  // a look at one model
  EXPECT_EQ(find<CurveEditor>("pressure-curve")->curve(), (PressureCurve{0.1, 0.8, 2.5}));
  // What is no curve, and no clay, is passed over.
  settings.setValue("input/pressure-curve", "0.9 0.2 x");
  settings.setValue("look/clay", "custard");
  make();
  EXPECT_EQ(find<CurveEditor>("pressure-curve")->curve(), PressureCurve());
  EXPECT_EQ(window->viewport().look().matcap, Look{}.matcap);
}

TEST_F(Window, KeysComeFromTheirFile) {
  QDir().mkpath(folder.filePath("c/relief"));
  QFile file(folder.filePath("c/relief/keys.json"));
  ASSERT_TRUE(file.open(QIODevice::WriteOnly));
  file.write(R"({"tool-smooth": ["Alt+S"]})");
  file.close();
  make();
  EXPECT_EQ(action("tool-smooth").shortcut(), QKeySequence("Alt+S"));
  EXPECT_TRUE(action("tool-smooth").toolTip().contains("Alt+S"));
}

TEST_F(Window, NoTwoCommandsHaveTheSameKey) {
  make();
  std::map<QString, QString> taken;
  for (const QAction* each : window->findChildren<QAction*>())
    for (const QKeySequence& key : each->shortcuts()) {
      const auto [at, is_new] = taken.emplace(key.toString(), each->objectName());
      EXPECT_TRUE(is_new) << key.toString().toStdString() << ": " << at->second.toStdString() << ", "
                          << each->objectName().toStdString();
    }
  EXPECT_GT(taken.size(), 40U);
}

TEST_F(Window, NoCommandHasTheKeyOfAMenu) {
  for (const char* language : {"en", "de"}) {
    use_language(*qApp, language);
    make();
    std::set<QKeySequence> taken;
    for (const QAction* each : window->findChildren<QAction*>())
      for (const QKeySequence& key : each->shortcuts()) taken.insert(key);
    for (const QAction* menu : window->menuBar()->actions()) {
      const QKeySequence key = QKeySequence::mnemonic(menu->text());
      EXPECT_FALSE(key.isEmpty()) << menu->text().toStdString();
      EXPECT_TRUE(taken.insert(key).second) << language << ' ' << menu->text().toStdString();
    }
  }
  use_language(*qApp, "en");
}

TEST_F(Window, AnotherLanguageBuildsItAnewWithTheModel) {
  make();
  ASSERT_TRUE(open());
  auto* language = preferences().findChild<QComboBox*>("language");
  language->setCurrentIndex(language->findData("de"));
  EXPECT_TRUE(window->wants_another());
  EXPECT_FALSE(window->isVisible());
  EXPECT_EQ(window->last_file(), folder.filePath("bowl.relief"));
}

TEST_F(Window, TheAnalysisOpensAndCloses) {
  make();
  ASSERT_TRUE(open());
  action("analysis-depth").trigger();
  auto* analysis = find<Viewport>("analysis");
  ASSERT_NE(analysis, nullptr);
  EXPECT_EQ(analysis->look().map, Look::Map::Depth);
  EXPECT_EQ(analysis->scene().model, window->viewport().scene().model);
  action("analysis-off").trigger();
  EXPECT_EQ(find<Viewport>("analysis"), nullptr);
}

TEST_F(Window, FilmsAndReportsNeedAModel) {
  make();
  EXPECT_FALSE(action("turntable").isEnabled());
  EXPECT_FALSE(action("report").isEnabled());
  ASSERT_TRUE(open());
  EXPECT_TRUE(action("turntable").isEnabled());
  EXPECT_TRUE(action("report").isEnabled());
}

// ---- Panels

TEST(SharedHeights, GiveEachWhatItNeedsWhereThereIsRoom) {
  EXPECT_EQ(shared_heights({{100, 1}, {200, 1}, {50, 1}}, 500), (std::vector<int>{100, 200, 200}));
}

TEST(SharedHeights, TakeFromThoseWhoNeedMost) {
  EXPECT_EQ(shared_heights({{500, 1}, {150, 1}, {100, 1}, {800, 1}}, 750), (std::vector<int>{250, 150, 100, 250}));
  EXPECT_EQ(shared_heights({{500, 1}, {150, 1}, {100, 1}, {800, 2}}, 750), (std::vector<int>{166, 150, 100, 334}));
}

TEST(SharedHeights, AreTheWholeHeight) {
  for (const int total : {10, 101, 999}) {
    const std::vector<int> heights = shared_heights({{300, 1}, {301, 2}, {7, 1}}, total);
    EXPECT_EQ(heights[0] + heights[1] + heights[2], total);
  }
  EXPECT_TRUE(shared_heights({}, 100).empty());
}

struct Panels : Window {
  Panels() { settings.setValue("window/size", QSize(1500, 940)); }
  QDockWidget& panel(const char* id) { return *find<QDockWidget>(id); }
  /// At last, or not.
  bool in_tabs(bool wanted) {
    return QTest::qWaitFor([&] { return (window->tabifiedDockWidgets(&panel("tool-panel")).size() == 3) == wanted; });
  }
  void resize_to(int width, int height) {
    window->resize(width, height);
    // Each step of it, layout, tabs, heights, begins when the one before is done.
    for (int step = 0; step < 20; ++step) QApplication::processEvents();
  }
};

TEST_F(Panels, AreTabsInASmallWindowAndComeBackAsTheyWere) {
  make();
  ASSERT_TRUE(open());
  resize_to(1500, 940);
  EXPECT_TRUE(in_tabs(false));
  const int height = panel("tool-panel").height();
  EXPECT_GT(height, 250);
  resize_to(900, 600);
  EXPECT_TRUE(in_tabs(true));
  resize_to(1500, 940);
  EXPECT_TRUE(in_tabs(false));
  EXPECT_TRUE(QTest::qWaitFor([&] { return std::abs(panel("tool-panel").height() - height) <= 2; }))
      << panel("tool-panel").height() << " and not " << height;
}

TEST_F(Panels, AreTabsWhereTheTextIsLarge) {
  settings.setValue("look/text", 150);
  apply(*qApp, dark_theme(), 1.5);
  make();
  ASSERT_TRUE(open());
  resize_to(1500, 940);
  EXPECT_TRUE(in_tabs(true));
}

TEST_F(Panels, ThatPeopleCloseStayClosed) {
  make();
  ASSERT_TRUE(open());
  panel("layers-panel").toggleViewAction()->trigger();
  EXPECT_TRUE(panel("layers-panel").isHidden());
  action("panels").trigger();
  EXPECT_TRUE(panel("tool-panel").isHidden());
  action("tool-clay").trigger();  // the window looks anew at what there is
  EXPECT_TRUE(panel("tool-panel").isHidden());
  action("panels").trigger();
  EXPECT_FALSE(panel("tool-panel").isHidden());
  EXPECT_TRUE(panel("layers-panel").isHidden());
}

TEST_F(Panels, EachToolCanBeReachedInALowWindow) {
  make();
  ASSERT_TRUE(open());
  auto* column = find<QToolBar>("tools");
  auto* rest = column->findChild<QToolButton*>("qt_toolbar_ext_button");
  const auto seen = [&] {
    int count = 0;
    for (const QString& id : ToolState::ids()) count += find<QToolButton>("button-tool-" + id)->isVisible();
    return count;
  };
  resize_to(900, 540);
  EXPECT_LT(seen(), ToolState::ids().size());
  ASSERT_TRUE(rest->isVisible());
  EXPECT_GE(rest->width(), 20);
  EXPECT_FALSE(rest->accessibleName().isEmpty());
  rest->click();
  EXPECT_TRUE(QTest::qWaitFor([&] { return seen() == ToolState::ids().size(); }));
  resize_to(1500, 940);
  EXPECT_TRUE(QTest::qWaitFor([&] { return !rest->isVisible(); })) << "all have room";
}

TEST_F(Panels, TheDevicesTabIsInFrontOfTheOthersWhenItBegins) {
  make();
  ASSERT_TRUE(open());
  resize_to(900, 600);
  auto* tabs = window->findChild<QTabBar*>(QString(), Qt::FindDirectChildrenOnly);
  ASSERT_NE(tabs, nullptr);
  EXPECT_TRUE(QTest::qWaitFor([&] { return tabs->tabText(tabs->currentIndex()) == "Tool"; }));
  EXPECT_TRUE(QTest::qWaitFor([&] { return tabs->width() >= tabs->sizeHint().width(); })) << "a word is cut";
  EXPECT_EQ(tabs->accessibleTabName(tabs->currentIndex()), "Tool panel");
  window->use_device("simulated");
  EXPECT_TRUE(QTest::qWaitFor([&] { return tabs->tabText(tabs->currentIndex()) == "Device"; }));
}

TEST_F(Window, ThePaletteFindsTheThemeByWhatPeopleCallIt) {
  for (const auto& [language, word] : {std::pair{"en", "dark mode"}, {"de", "dunkelmodus"}}) {
    use_language(*qApp, language);
    make();
    auto* palette = window->findChild<CommandPalette*>();
    palette->open();
    palette->findChild<QLineEdit*>()->setText(word);
    auto* list = palette->findChild<QListWidget*>();
    ASSERT_EQ(list->count(), 1) << language;
    EXPECT_EQ(list->item(0)->text(), action("theme").text());
  }
  use_language(*qApp, "en");
}

TEST_F(Window, AnAlarmGoesWithTheModelOfWhichItSpoke) {
  make();
  ASSERT_TRUE(open());
  emit window->findChild<Hand*>()->alarm("The surface changed under the hand.", false);
  EXPECT_TRUE(window->findChild<Banner*>()->isVisible());
  action("close-model").trigger();
  EXPECT_FALSE(window->findChild<Banner*>()->isVisible());
}

}  // namespace
}  // namespace relief::studio
