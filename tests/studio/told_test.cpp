// What a stroke could not do as it was wanted: the window says so while it goes on. Strokes are made with the mouse on
// models on which each of these happens, and on none of them more than one.
#include "opened.h"
#include "support/folder.h"
#include "support/shells.h"

#include <relief/file/model_file.h>

#include <gtest/gtest.h>
#include <studio/camera_control.h>
#include <studio/desktop_scheme.h>
#include <studio/main_window.h>
#include <studio/text.h>
#include <studio/widgets/toast.h>
#include <studio/widgets/value_bar.h>

#include <QAction>
#include <QApplication>
#include <QLabel>
#include <QRegularExpression>
#include <QSettings>
#include <QTest>
#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

namespace relief::studio {
namespace {

constexpr int kPatience = 60'000;  // ms, on a machine that is busy with other things
const QString kAway = QStringLiteral("The tool leaves the surface on the way to %1: what it does there is left out.");
const QString kLean = QStringLiteral("The fibres lean at %1: the tool takes some clay from beside it, too.");
const QString kCoarse = QStringLiteral("The surface stays coarser at %1 than this tool wants. A larger radius helps.");

/// Fibres straight up through a sheet, or leaning by `lean` sideways for each unit up.
std::shared_ptr<const SlabMesh> sheet(double lean) {
  return testing::mapped_shell(*testing::plane_shell(4, 32, 0.3),
                               [lean](Vec3d p) { return Vec3d{p.x + lean * p.y, p.y, p.z}; });
}

class ToldTest : public ::testing::Test {
 protected:
  ToldTest() { window.resize(1200, 800); }

  void open(std::shared_ptr<const SlabMesh> cage, AxisView from) {
    open_in(window, folder, std::move(cage));
    view().set_camera(look_along(view().camera(), from, {0, 1, 0}));
    QTest::keyClick(&view(), Qt::Key_C);
    set("strength", 0.3);
  }
  [[nodiscard]] Viewport& view() { return window.viewport(); }
  /// As a bar of a setting does when somebody drags it.
  void set(const char* bar, double value) { emit window.findChild<ValueBar*>(bar)->valueEdited(value); }
  /// A place on the model, in the picture.
  [[nodiscard]] QPoint at(Vec3d place) {
    const auto seen = seen_at(view().camera(), place, view().width(), view().height());
    return seen ? seen->toPoint() : QPoint();
  }
  void press(Vec3d place) { QTest::mousePress(&view(), Qt::LeftButton, {}, at(place)); }
  void move(Vec3d place) {
    QTest::mouseMove(&view(), at(place));
    QApplication::processEvents();
  }
  /// Ends the stroke, and waits until all is said of it.
  void release(Vec3d place) {
    QTest::mouseRelease(&view(), Qt::LeftButton, {}, at(place));
    const auto* undo = window.findChild<QAction*>("undo");
    ASSERT_TRUE(QTest::qWaitFor([&] { return undo->isEnabled(); }, kPatience));
  }
  /// A stroke over the middle of a sheet.
  void cut_the_sheet() {
    set("radius", 0.15);
    set("strength", 0.6);
    press({0.4, 0, 0.5});
    for (int k = 1; k <= 20; ++k) move({0.4 + 0.01 * k, 0, 0.5});
    release({0.6, 0, 0.5});
  }
  /// Two places on the front of a ball, one after the other, with nothing between.
  void leap_over_the_ball(double stabiliser) {
    open(testing::sphere_shell(3, 16), AxisView::Front);
    set("radius", 0.05);
    set("setting-stabiliser", stabiliser);
    press(kLeft);
    move(kRight);
    release(kRight);
  }
  /// A dab on a sheet with fibres so long that the finest spacing, a share of them, is coarse for a small tool.
  void touch_the_sheet(double radius) {
    open(testing::plane_shell(4, 32, 20), AxisView::Top);
    set("radius", radius);
    press(kMiddle);
    release(kMiddle);
  }
  static void connect_to(DocumentBridge& bridge, int& finished, int& cancelled) {
    QObject::connect(&bridge, &DocumentBridge::strokeFinished, [&](const StrokeFinished& stroke) {
      ++finished;
      cancelled += stroke.cancelled;
    });
  }
  [[nodiscard]] QString status() { return window.findChild<QLabel*>("status")->accessibleDescription(); }
  /// In the status line, and over the picture.
  void says(const QString& words) {
    EXPECT_EQ(status(), words);
    EXPECT_EQ(window.findChild<Toast*>()->findChild<QLabel*>()->text(), words);
  }

  /// The same, of a place in millimetres, which is returned where the words are those.
  [[nodiscard]] std::optional<Vec3d> says_of_a_place(const QString& words) {
    const QString place = QStringLiteral(R"(\((\S+), (\S+), (\S+)\)\x{a0}mm)");
    const QRegularExpression form(QRegularExpression::anchoredPattern(
        QRegularExpression::escape(words).replace(QRegularExpression::escape("%1"), place)));
    const auto said = form.match(status());
    EXPECT_TRUE(said.hasMatch()) << status().toStdString();
    says(status());
    if (!said.hasMatch()) return {};
    return Vec3d{said.captured(1).toDouble(), said.captured(2).toDouble(), said.captured(3).toDouble()};
  }
  [[nodiscard]] bool says_nothing_like(const QString& words) { return !status().startsWith(words.section("%1", 0, 0)); }

  static constexpr Vec3d kLeft{-0.5, 0, 0.866}, kRight{0.5, 0, 0.866}, kMiddle{0.5, 0, 0.5};
  testing::Folder folder;
  QSettings settings{text(folder / "studio.conf"), QSettings::IniFormat};
  DesktopScheme desktop;
  MainWindow window{settings, desktop};
};

TEST_F(ToldTest, FibresThatLean) {
  open(sheet(1.5), AxisView::Top);
  cut_the_sheet();
  const auto place = says_of_a_place(kLean);
  ASSERT_TRUE(place);
  EXPECT_LT(length(*place - kMiddle), 0.2) << "where the stroke went";
}

TEST_F(ToldTest, FibresThatStandUprightAreNotTold) {
  open(sheet(0), AxisView::Top);
  cut_the_sheet();
  EXPECT_TRUE(says_nothing_like(kLean)) << status().toStdString();
}

// A tool on a string cuts the corner: it goes through the ball, farther from its surface than its radius.
TEST_F(ToldTest, AToolAwayFromTheSurface) {
  leap_over_the_ball(0.8);
  const auto place = says_of_a_place(kAway);
  ASSERT_TRUE(place);
  EXPECT_LT(length(*place - kRight), 0.05) << "where the hand went";
}

TEST_F(ToldTest, AToolOnTheSurfaceIsNotTold) {
  leap_over_the_ball(0);
  EXPECT_TRUE(says_nothing_like(kAway)) << status().toStdString();
}

TEST_F(ToldTest, AGridThatStaysTooCoarse) {
  touch_the_sheet(0);  // the smallest
  const auto place = says_of_a_place(kCoarse);
  ASSERT_TRUE(place);
  EXPECT_LT(length(*place - kMiddle), 0.02) << "its dab";
}

// The same tool where the grid is to stay as it is: nothing is wanted of it.
TEST_F(ToldTest, AGridThatIsToStayIsNotTold) {
  auto* spacing = window.findChild<ValueBar*>("setting-detail");
  ASSERT_NE(spacing, nullptr);
  EXPECT_EQ(spacing->text(), "8.3 %");
  set("setting-detail", 0);
  EXPECT_EQ(spacing->text(), "0.0 %");
  touch_the_sheet(0);
  EXPECT_TRUE(says_nothing_like(kCoarse)) << status().toStdString();
}

TEST_F(ToldTest, AGridThatIsFineEnoughIsNotTold) {
  touch_the_sheet(0.15);
  EXPECT_TRUE(says_nothing_like(kCoarse)) << status().toStdString();
}

TEST_F(ToldTest, EscapeTakesAStrokeBackForWhichRoomIsBeingMade) {
  // A dent in clay that is 0.2 thick: half a radius too deep, so that room is made once the button is up.
  // This room takes until somebody cancels it, or until the test says that it was made.
  std::atomic<bool> made{false};
  window.bridge().make_room_with([&](const SnapshotPtr&, const RoomWanted&, const Progress& progress) -> Result<Room> {
    while (!progress.cancelled() && !made) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (!made) return fail(Errc::Cancelled, "cancelled");
    return Room{};
  });
  open(testing::sphere_shell(3, 16), AxisView::Front);
  set("radius", 0.4);
  set("strength", 1);
  DocumentBridge& bridge = window.bridge();
  const std::uint64_t before = bridge.head()->content_hash();
  int finished = 0, cancelled = 0, rooms = 0;
  connect_to(bridge, finished, cancelled);
  QObject::connect(&bridge, &DocumentBridge::roomEnded, &view(), [&] { ++rooms; });
  bool escape = false;
  QObject::connect(&bridge, &DocumentBridge::roomAsked, &view(), [&] {
    EXPECT_EQ(status(), "Making room under the stroke … Esc takes the stroke back.");
    escape ? QTest::keyClick(&view(), Qt::Key_Escape) : void(made = true);
  });
  const auto dab = [&] {
    const int so_far = finished;
    press({0, 0, 1});
    QTest::mouseRelease(&view(), Qt::LeftButton, {}, at({0, 0, 1}));
    ASSERT_TRUE(QTest::qWaitFor([&] { return finished > so_far; }, kPatience));
  };
  escape = true;
  dab();
  EXPECT_EQ(cancelled, 1);
  EXPECT_EQ(rooms, 0);
  EXPECT_EQ(status(), "The stroke was taken back.");
  EXPECT_EQ(bridge.head()->content_hash(), before);
  escape = false;  // the control: nobody presses it
  dab();
  EXPECT_EQ(cancelled, 1);
  EXPECT_GT(rooms, 0);
  EXPECT_NE(bridge.head()->content_hash(), before);
}

}  // namespace
}  // namespace relief::studio
