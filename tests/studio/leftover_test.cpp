// What is opened and closed again, hundreds of times, leaves nothing behind.
#include "opened.h"
#include "support/folder.h"
#include "support/shells.h"

#include <gtest/gtest.h>
#include <malloc.h>
#include <studio/desktop_scheme.h>
#include <studio/main_window.h>
#include <studio/preferences_dialog.h>
#include <studio/split_view.h>
#include <studio/text.h>
#include <studio/widgets/command_palette.h>

#include <QAction>
#include <QApplication>
#include <QDockWidget>
#include <QSettings>
#include <QSignalSpy>
#include <QTest>
#include <algorithm>
#include <cstdlib>
#include <functional>
#include <vector>

namespace relief::studio {
namespace {

constexpr int kPatience = 60'000;  // ms
/// The long form is `./dev soak`'s.
int rounds() { return std::getenv("RELIEF_SOAK") != nullptr ? 500 : 40; }

class LeftoverTest : public ::testing::Test {
 protected:
  LeftoverTest() {
    window.resize(1200, 800);
    open_in(window, folder, testing::sphere_shell(2, 16));
  }
  void trigger(const char* action) { window.findChild<QAction*>(action)->trigger(); }
  /// What is done, with all that was put off until later.
  static void finish() {
    QApplication::processEvents();
    QApplication::sendPostedEvents(nullptr, QEvent::DeferredDelete);
  }
  [[nodiscard]] qsizetype objects() const {
    return window.findChildren<QObject*>().size() + QApplication::allWidgets().size();
  }
  /// Bytes, once no picture is being drawn any more.
  [[nodiscard]] std::size_t in_use() {
    QSignalSpy frames(&window.viewport(), &Viewport::frameDrawn);
    const auto rests = [&] {
      const auto before = frames.count();
      QTest::qWait(500);
      return frames.count() == before;
    };
    EXPECT_TRUE(QTest::qWaitFor(rests, kPatience));
    return ::mallinfo2().uordblks;
  }
  /// The first third makes what is kept for the next time. A picture that is kept once shows in one of the other two,
  /// what is left behind each time in both. Bytes are those that malloc has given out; a sanitizer has a malloc of its
  /// own, which gives out none of these.
  void leaves_nothing(const std::function<void()>& round) {
    const int third = rounds() / 3;
    qsizetype first = 0;
    std::vector<double> bytes;
    for (int k = 0; k < 3 * third; ++k) {
      if (k == third) first = objects();
      if (k % third == 0) bytes.push_back(static_cast<double>(in_use()));
      round();
      finish();
    }
    EXPECT_EQ(objects(), first);
    bytes.push_back(static_cast<double>(in_use()));
    EXPECT_LT(std::min(bytes[2] - bytes[1], bytes[3] - bytes[2]) / third, kMostPerRound)
        << bytes[1] << ' ' << bytes[2] << ' ' << bytes[3];
  }

  /// Bytes. Objects are counted; this finds what belongs to none, such as a picture. Qt's own caches add up to 4,200 in
  /// the first 50 rounds, and 1,500 over 500.
  static constexpr double kMostPerRound = 8192;
  testing::Folder folder;
  QSettings settings{text(folder / "studio.conf"), QSettings::IniFormat};
  DesktopScheme desktop;
  MainWindow window{settings, desktop};
};

TEST_F(LeftoverTest, Preferences) {
  leaves_nothing([&] {
    trigger("preferences");
    QApplication::processEvents();
    window.findChild<PreferencesDialog*>()->close();
  });
}

TEST_F(LeftoverTest, Palette) {
  auto* palette = window.findChild<CommandPalette*>();
  leaves_nothing([&] {
    palette->open();
    QApplication::processEvents();
    palette->close_again();
  });
}

TEST_F(LeftoverTest, Panels) {
  leaves_nothing([&] {
    trigger("panels");
    QApplication::processEvents();
    trigger("panels");
  });
}

TEST_F(LeftoverTest, APanelInAWindowOfItsOwn) {
  auto* dock = window.findChildren<QDockWidget*>().front();
  leaves_nothing([&] {
    dock->setFloating(true);
    QApplication::processEvents();
    dock->setFloating(false);
  });
}

TEST_F(LeftoverTest, AnalysisView) {
  leaves_nothing([&] {
    trigger("analysis-depth");
    QApplication::processEvents();
    trigger("analysis-off");
  });
}

TEST_F(LeftoverTest, AWidgetThatIsForgottenIsFound) {
  const qsizetype before = objects();
  auto* forgotten = new QWidget(&window);
  EXPECT_EQ(objects(), before + 2);
  delete forgotten;
  EXPECT_EQ(objects(), before);
}

}  // namespace
}  // namespace relief::studio
