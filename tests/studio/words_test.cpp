// Whether all words fit: both themes, three sizes of text, and a language that is 40 % longer and runs from the right.
#include "support/folder.h"
#include "support/shells.h"

#include <gtest/gtest.h>
#include <studio/desktop_scheme.h>
#include <studio/languages.h>
#include <studio/main_window.h>
#include <studio/text.h>
#include <studio/widgets/theme.h>
#include <studio/widgets/value_bar.h>

#include <QAbstractButton>
#include <QAction>
#include <QApplication>
#include <QLabel>
#include <QSettings>
#include <QTest>
#include <QToolButton>
#include <cmath>

namespace relief::studio {
namespace {

constexpr int kPatience = 20'000;  // ms, on a machine that is busy with other things
constexpr int kLayout = 500;       // ms, after which nobody lays anything out any more

/// Whether a widget shows words for which it has no room. Text is cut to the pixel, so one is let through.
bool cuts(const QWidget& widget) {
  if (const auto* label = qobject_cast<const QLabel*>(&widget)) {
    if (label->text().isEmpty()) return false;
    const QSize room = label->size() + QSize(1, 1);
    return label->wordWrap() ? label->heightForWidth(label->width()) > room.height()
                             : label->sizeHint().width() > room.width() || label->sizeHint().height() > room.height();
  }
  if (const auto* tool = qobject_cast<const QToolButton*>(&widget);
      tool && tool->toolButtonStyle() == Qt::ToolButtonIconOnly)
    return false;
  if (const auto* button = qobject_cast<const QAbstractButton*>(&widget)) {
    if (button->text().isEmpty()) return false;
    const QSize needed = button->fontMetrics().size(Qt::TextShowMnemonic, button->text());
    return needed.width() > button->width() + 1 || needed.height() > button->height() + 1;
  }
  if (qobject_cast<const ValueBar*>(&widget) != nullptr) return widget.minimumSizeHint().width() > widget.width() + 1;
  return false;
}

/// What is cut below a widget, for people.
QStringList cut_words(const QWidget& root) {
  QStringList found;
  for (const QWidget* each : root.findChildren<QWidget*>()) {
    if (!each->isVisible() || !cuts(*each)) continue;
    const QString text = each->property("text").toString();
    found.append(QStringLiteral("%1 \"%2\" %3x%4")
                     .arg(each->metaObject()->className(), text.isEmpty() ? each->accessibleName() : text)
                     .arg(each->width())
                     .arg(each->height()));
  }
  return found;
}

/// What is still cut when all has been laid out.
std::string cut_at_last(const QWidget& root) {
  (void)QTest::qWaitFor([&] { return cut_words(root).isEmpty(); }, kLayout);
  return cut_words(root).join("; ").toStdString();
}

struct Dress {
  bool light;
  int percent;
  const char* language;
};
std::string name_of(const ::testing::TestParamInfo<Dress>& dress) {
  return std::string(dress.param.light ? "light" : "dark") + std::to_string(dress.param.percent) + dress.param.language;
}

class WordsTest : public ::testing::TestWithParam<Dress> {
 protected:
  WordsTest() {
    auto& application = *qobject_cast<QApplication*>(QCoreApplication::instance());
    apply(application, GetParam().light ? light_theme() : dark_theme(), GetParam().percent / 100.0);
    use_language(application, GetParam().language);
    settings.setValue("look/theme", GetParam().light ? "light" : "dark");
    settings.setValue("look/text", GetParam().percent);
  }
  ~WordsTest() override { use_language(*qobject_cast<QApplication*>(QCoreApplication::instance()), "en"); }

  [[nodiscard]] QString model() const {
    Model ball;
    ball.head = Snapshot::make(testing::sphere_shell(2, 8));
    const auto file = folder / "ball.relief";
    EXPECT_TRUE(ModelFile::create(file, ball));
    return text(file);
  }

  testing::Folder folder;
  QSettings settings{text(folder / "studio.conf"), QSettings::IniFormat};
  DesktopScheme desktop;
};

TEST_P(WordsTest, AllWordsFit) {
  MainWindow window(settings, desktop);
  window.resize(1600, 1000);
  window.show();
  EXPECT_EQ(cut_at_last(window), "") << "start page";

  window.open(model());
  ASSERT_TRUE(QTest::qWaitFor(
      [&] { return window.viewport().scene().model != nullptr && window.viewport().isVisible(); }, kPatience));
  for (const QAction* tool : window.findChildren<QAction*>()) {
    if (!tool->objectName().startsWith("tool-")) continue;
    const_cast<QAction*>(tool)->setChecked(true);
    EXPECT_EQ(cut_at_last(window), "") << tool->objectName().toStdString();
  }

  auto* preferences = window.findChild<QAction*>("preferences");
  ASSERT_NE(preferences, nullptr);
  preferences->trigger();
  for (const QWidget* dialog : QApplication::topLevelWidgets())
    if (dialog->isVisible() && dialog != &window) {
      EXPECT_EQ(cut_at_last(*dialog), "") << dialog->objectName().toStdString();
    }
}

INSTANTIATE_TEST_SUITE_P(, WordsTest,
                         ::testing::Values(Dress{false, 100, "en"}, Dress{true, 100, "de"}, Dress{false, 150, "de"},
                                           Dress{true, 150, "xx"}, Dress{false, 200, "en"}, Dress{true, 200, "xx"}),
                         name_of);

TEST(Words, ALabelThatIsTooNarrowIsFound) {
  QWidget root;
  QLabel label("these words need more than forty pixels", &root);
  label.setGeometry(0, 0, 40, 30);
  root.show();
  EXPECT_EQ(cut_words(root).size(), 1);
  label.resize(label.sizeHint());
  EXPECT_TRUE(cut_words(root).isEmpty());
}

}  // namespace
}  // namespace relief::studio
