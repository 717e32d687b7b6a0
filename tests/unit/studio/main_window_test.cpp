// The window as a whole, without a screen: what is chosen for good holds in it at once.
#include "bowl.h"

#include <relief/file/model_file.h>

#include <gtest/gtest.h>
#include <studio/desktop_scheme.h>
#include <studio/languages.h>
#include <studio/main_window.h>
#include <studio/preferences_dialog.h>
#include <studio/text.h>
#include <studio/widgets/curve_editor.h>
#include <studio/widgets/theme.h>

#include <QAbstractButton>
#include <QAction>
#include <QApplication>
#include <QCheckBox>
#include <QComboBox>
#include <QDir>
#include <QMenuBar>
#include <QTemporaryDir>
#include <QTest>
#include <QThreadPool>
#include <QToolButton>
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

}  // namespace
}  // namespace relief::studio
