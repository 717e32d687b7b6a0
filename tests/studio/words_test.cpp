// Whether all words fit and can be read: both themes, three sizes of text, and a language that is 40 % longer and runs
// from the right.
#include "support/folder.h"

#include <relief/mesh/samples.h>

#include <gtest/gtest.h>
#include <studio/desktop_scheme.h>
#include <studio/export_dialog.h>
#include <studio/failure_dialog.h>
#include <studio/hand.h>
#include <studio/languages.h>
#include <studio/main_window.h>
#include <studio/preferences_dialog.h>
#include <studio/text.h>
#include <studio/turntable_dialog.h>
#include <studio/widgets/card.h>
#include <studio/widgets/theme.h>
#include <studio/widgets/value_bar.h>

#include <QAbstractButton>
#include <QAbstractSpinBox>
#include <QAction>
#include <QApplication>
#include <QComboBox>
#include <QGroupBox>
#include <QHash>
#include <QImage>
#include <QLabel>
#include <QListWidget>
#include <QSet>
#include <QSettings>
#include <QTest>
#include <QToolButton>
#include <algorithm>
#include <fstream>

namespace relief::studio {
namespace {

constexpr int kPatience = 240'000;  // ms, for a conversion with a sanitizer on a machine that is busy with other things
constexpr int kLayout = 500;        // ms, after which nobody lays anything out any more
constexpr double kContrast = 4.5;   // of words with their ground, WCAG 2.1 AA

/// Whether a widget shows words for which it has no room. Text is cut to the pixel, so one is let through.
bool cuts(const QWidget& widget) {
  const auto narrower_than = [&](int needed) { return needed > widget.width() + 1; };
  if (const auto* label = qobject_cast<const QLabel*>(&widget)) {
    if (label->text().isEmpty()) return false;
    const int needed = label->wordWrap() ? label->heightForWidth(label->width()) : label->sizeHint().height();
    // A word that is longer than its line is cut at the side.
    int widest = label->sizeHint().width();
    if (label->wordWrap()) {
      widest = 0;
      for (const QString& word : label->text().split(QLatin1Char(' ')))
        widest = std::max(widest, label->fontMetrics().horizontalAdvance(word));
    }
    return narrower_than(widest) || needed > label->height() + 1;
  }
  if (const auto* tool = qobject_cast<const QToolButton*>(&widget);
      tool && tool->toolButtonStyle() == Qt::ToolButtonIconOnly)
    return false;
  if (const auto* button = qobject_cast<const QAbstractButton*>(&widget)) {
    const QSize needed = button->sizeHint();  // with what the sheet puts around the words
    return !button->text().isEmpty() && (narrower_than(needed.width()) || needed.height() > button->height() + 1);
  }
  if (qobject_cast<const ValueBar*>(&widget) || qobject_cast<const QComboBox*>(&widget) ||
      qobject_cast<const QAbstractSpinBox*>(&widget) || qobject_cast<const QGroupBox*>(&widget))
    return narrower_than(widget.minimumSizeHint().width());
  if (const auto* list = qobject_cast<const QListWidget*>(&widget))
    return list->sizeHintForColumn(0) > list->viewport()->width() + 1 &&
           list->horizontalScrollBarPolicy() == Qt::ScrollBarAlwaysOff;
  return false;
}

QString told(const QWidget& widget, const QString& what) {
  const QString text = widget.property("text").toString();
  return QStringLiteral("%1 \"%2\" %3x%4%5")
      .arg(widget.metaObject()->className(), text.isEmpty() ? widget.accessibleName() : text)
      .arg(widget.width())
      .arg(widget.height())
      .arg(what);
}

/// What is cut below a widget, for people.
QStringList cut_words(const QWidget& root) {
  QStringList found;
  for (const QWidget* each : root.findChildren<QWidget*>())
    if (each->isVisible() && cuts(*each)) found.append(told(*each, QString()));
  return found;
}

/// What is still cut when all has been laid out.
std::string cut_at_last(const QWidget& root) {
  QApplication::processEvents();  // layouts of what has just been shown
  (void)QTest::qWaitFor([&] { return cut_words(root).isEmpty(); }, kLayout);
  return cut_words(root).join("; ").toStdString();
}

/// The greatest contrast of a pixel with the colour that most of them have: of the words with their ground.
double contrast_in(const QImage& picture) {
  QHash<QRgb, int> counts;
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x) ++counts[picture.pixel(x, y)];
  QRgb ground = 0;
  for (auto each = counts.cbegin(); each != counts.cend(); ++each)
    if (each.value() > counts.value(ground)) ground = each.key();
  double most = 1;
  for (auto each = counts.cbegin(); each != counts.cend(); ++each)
    most = std::max(most, contrast(QColor(each.key()), QColor(ground)));
  return most;
}

/// Words below a widget that can hardly be told from their ground, for people. What is switched off may be pale; words
/// beside an icon are those of the same sheet without one.
QStringList pale_words(QWidget& root) {
  QStringList found;
  const QImage all = root.grab().toImage().convertToFormat(QImage::Format_RGB32);
  for (const QWidget* each : root.findChildren<QWidget*>()) {
    const auto* label = qobject_cast<const QLabel*>(each);
    const auto* button = qobject_cast<const QAbstractButton*>(each);
    const bool words =
        (label && !label->text().isEmpty()) || (button && !button->text().isEmpty() && button->icon().isNull());
    if (!words || !each->isVisible() || !each->isEnabled() || each->isWindow()) continue;
    if (each->visibleRegion().boundingRect() != each->rect()) continue;  // scrolled away, or covered
    const double reached = contrast_in(all.copy(QRect(each->mapTo(&root, QPoint()), each->size())));
    if (reached < kContrast) found.append(told(*each, QStringLiteral(": %1").arg(reached)));
  }
  return found;
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

  /// A small scan.
  [[nodiscard]] QString scan() const {
    const auto mesh = make_sample("torus", 2000);
    EXPECT_TRUE(mesh);
    const auto file = folder / "torus.obj";
    std::ofstream out(file);
    for (const Vec3d& p : mesh->positions) out << "v " << p.x << ' ' << p.y << ' ' << p.z << '\n';
    for (const auto& t : mesh->triangles) out << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
    return text(file);
  }
  /// All words of it fit, and can be read. Where RELIEF_PICTURES names a folder, its picture is left there.
  static void reads_well(QWidget& root, const QString& what) {
    EXPECT_EQ(cut_at_last(root), "") << what.toStdString();
    EXPECT_EQ(pale_words(root).join("; ").toStdString(), "") << what.toStdString();
    if (const QString place = qEnvironmentVariable("RELIEF_PICTURES"); !place.isEmpty())
      root.grab().save(QStringLiteral("%1/%2-%3.png").arg(place, text(name_of({GetParam(), 0})), what));
  }

  testing::Folder folder;
  QSettings settings{text(folder / "studio.conf"), QSettings::IniFormat};
  DesktopScheme desktop;
};

TEST_P(WordsTest, AllWordsFitAndCanBeRead) {
  MainWindow window(settings, desktop);
  window.resize(1600, 1000);
  window.show();
  reads_well(window, "start");

  window.open(scan());
  ASSERT_TRUE(QTest::qWaitFor([&] { return window.findChild<Card*>("verdict") != nullptr; }, kPatience));
  reads_well(window, "verdict");
  for (QAction* tool : window.findChildren<QAction*>()) {
    if (!tool->objectName().startsWith("tool-")) continue;
    tool->setChecked(true);
    reads_well(window, tool->objectName());
  }
  window.use_device("simulated");
  auto* hand = window.findChild<Hand*>();
  ASSERT_TRUE(QTest::qWaitFor([&] { return hand->monitor().taken() > 0; }, kPatience));
  window.findChild<QAction*>("forces-off")->trigger();
  reads_well(window, "forces-off");
  window.use_device("none");

  window.findChild<QAction*>("preferences")->trigger();
  auto* preferences = window.findChild<PreferencesDialog*>();
  ASSERT_NE(preferences, nullptr);
  auto* pages = preferences->findChild<QListWidget*>("preferences-pages");
  ASSERT_GT(pages->count(), 3);
  for (int k = 0; k < pages->count(); ++k) {
    pages->setCurrentRow(k);
    reads_well(*preferences, "preferences-" + pages->item(k)->data(Qt::UserRole).toString());
  }
  preferences->close();

  const SnapshotPtr head = window.viewport().scene().model;
  ExportDialog exporting(settings, *head, "torus.ply", &window);
  exporting.show();
  reads_well(exporting, "export");
  TurntableDialog turntable(settings, head, window.viewport().final_frame(), "torus", &window);
  turntable.show();
  reads_well(turntable, "turntable");
  FailureDialog failure(MainWindow::tr("The model could not be exported"), MainWindow::tr("Saving …"), "torus.ply",
                        &window);
  failure.setAttribute(Qt::WA_DeleteOnClose, false);
  failure.add_remedy(MainWindow::tr("Save elsewhere …"), [] {});
  failure.show();
  reads_well(failure, "failure");

  // The control: the same window, with words for which nothing has room.
  window.findChild<QLabel*>("status")->setText(QString(400, QLatin1Char('m')));
  QApplication::processEvents();
  EXPECT_FALSE(cut_words(window).isEmpty());
}

INSTANTIATE_TEST_SUITE_P(, WordsTest,
                         ::testing::Values(Dress{false, 100, "xx"}, Dress{true, 100, "xx"}, Dress{false, 150, "xx"},
                                           Dress{true, 150, "xx"}, Dress{false, 200, "xx"}, Dress{true, 200, "xx"},
                                           Dress{true, 200, "de"}),
                         name_of);

TEST(Words, AFailureIsToldInTheUsersLanguage) {
  const auto all = [] {
    QStringList sentences;
    for (auto code = Errc::InvalidArgument; code <= Errc::Cancelled; code = static_cast<Errc>(int(code) + 1))
      sentences.append(error_text({code, "head.ply: ends in line 7"}));
    return sentences;
  };
  use_language(*qApp, "en");
  for (const QString& each : all()) EXPECT_EQ(each, "head.ply: ends in line 7");
  use_language(*qApp, "de");
  const QStringList german = all();
  use_language(*qApp, "en");
  EXPECT_EQ(QSet<QString>(german.begin(), german.end()).size(), german.size());
  for (const QString& each : german) EXPECT_TRUE(each.endsWith(" (head.ply: ends in line 7)")) << each.toStdString();
  EXPECT_TRUE(german[int(Errc::Corrupt)].startsWith("Die Datei ist beschädigt"));
}

TEST(Words, ALabelThatIsTooNarrowIsFound) {
  QWidget root;
  QLabel label("these words need more than forty pixels", &root);
  label.setGeometry(0, 0, 40, 30);
  root.show();
  EXPECT_EQ(cut_words(root).size(), 1);
  label.resize(label.sizeHint());
  EXPECT_TRUE(cut_words(root).isEmpty());
}

TEST(Words, ALabelThatIsTooPaleIsFound) {
  QWidget root;
  QLabel label("these words should be read", &root);
  label.resize(label.sizeHint());
  root.resize(label.size());
  root.show();
  EXPECT_TRUE(pale_words(root).isEmpty());
  label.setStyleSheet(QStringLiteral("color: %1").arg(mixed(current_theme().window, current_theme().text, 0.3).name()));
  EXPECT_EQ(pale_words(root).size(), 1);
}

}  // namespace
}  // namespace relief::studio
