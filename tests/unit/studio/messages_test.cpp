#include <gtest/gtest.h>
#include <studio/widgets/banner.h>
#include <studio/widgets/card.h>
#include <studio/widgets/drop_area.h>
#include <studio/widgets/progress_strip.h>
#include <studio/widgets/toast.h>

#include <QAccessible>
#include <QApplication>
#include <QDragEnterEvent>
#include <QLabel>
#include <QMimeData>
#include <QProgressBar>
#include <QPropertyAnimation>
#include <QPushButton>
#include <QSignalSpy>
#include <QTest>
#include <QTimer>
#include <QUrl>

namespace relief::studio {
namespace {

class ToastTest : public testing::Test {
 protected:
  ToastTest() {
    window.resize(600, 400);
    window.show();
    EXPECT_TRUE(QTest::qWaitForWindowExposed(&window));
  }
  /// Lets the three seconds pass without waiting for them.
  void time_is_over() {
    for (QTimer* timer : toast.findChildren<QTimer*>()) timer->start(0);
    QTest::qWait(1);
  }

  QWidget window;
  Toast& toast = *new Toast(&window);
};

TEST_F(ToastTest, StandsAtTheBottomMiddleAndTheMouseGoesThrough) {
  toast.say(QStringLiteral("Saved as you work"));
  EXPECT_TRUE(toast.isVisible());
  EXPECT_NEAR(toast.geometry().center().x(), 300, 1);
  EXPECT_GT(toast.geometry().top(), 300);
  EXPECT_TRUE(toast.testAttribute(Qt::WA_TransparentForMouseEvents));
  EXPECT_EQ(toast.accessibleName(), QStringLiteral("Saved as you work"));
}

TEST_F(ToastTest, GoesToTheTopRatherThanOverTheRing) {
  const QRect ring(250, 330, 100, 60);
  toast.say(QStringLiteral("Saved as you work"), ring);
  EXPECT_FALSE(toast.geometry().intersects(ring));
  EXPECT_TRUE(window.rect().contains(toast.geometry()));
}

TEST_F(ToastTest, LongWordsAreWrappedIntoTheWindow) {
  toast.say(QStringLiteral("Saved as you work. ").repeated(20));
  EXPECT_TRUE(window.rect().contains(toast.geometry()));
  window.resize(300, 500);
  EXPECT_TRUE(window.rect().contains(toast.geometry()));
}

TEST_F(ToastTest, VanishesAtOnceWhereMotionIsReduced) {
  set_reduced_motion(true);
  toast.say(QStringLiteral("Saved"));
  time_is_over();
  EXPECT_FALSE(toast.isVisible());
  set_reduced_motion(false);
  toast.say(QStringLiteral("Saved"));
  time_is_over();
  EXPECT_TRUE(toast.isVisible());
  auto* fade = toast.findChild<QPropertyAnimation*>();
  EXPECT_EQ(fade->state(), QAbstractAnimation::Running);
  fade->setCurrentTime(fade->duration());
  EXPECT_FALSE(toast.isVisible());
}

TEST(Banner, IsAnAlertThatStaysUntilActedOn) {
  Banner banner;
  const QSignalSpy closed(&banner, &Banner::closed);
  int off = 0;
  banner.say(Mood::Bad, QStringLiteral("The hand moved too fast; forces are off until you let go."),
             {{QStringLiteral("Forces on"), [&off] { ++off; }}, {QStringLiteral("Leave off"), {}}});
  EXPECT_FALSE(banner.isHidden());
  QAccessibleInterface* face = QAccessible::queryAccessibleInterface(&banner);
  ASSERT_TRUE(face);
  EXPECT_EQ(face->role(), QAccessible::AlertMessage);
  EXPECT_TRUE(face->text(QAccessible::Name).startsWith(QStringLiteral("The hand moved too fast")));
  const auto buttons = banner.findChildren<QPushButton*>();
  ASSERT_EQ(buttons.size(), 2);
  buttons[0]->click();
  EXPECT_EQ(off, 1);
  EXPECT_TRUE(banner.isHidden());
  EXPECT_EQ(closed.size(), 1);
}

TEST(Banner, AnActionMaySayTheNextThing) {
  Banner banner;
  banner.say(Mood::Warn, QStringLiteral("The disk is full."),
             {{QStringLiteral("Try again"), [&banner] { banner.say(Mood::Good, QStringLiteral("Saved.")); }}});
  banner.findChild<QPushButton*>()->click();
  EXPECT_FALSE(banner.isHidden());
  EXPECT_EQ(banner.mood(), Mood::Good);
  EXPECT_EQ(banner.accessibleName(), QStringLiteral("Saved."));
}

TEST(Banner, WhatIsCoveredComesBack) {
  Banner banner;
  const QSignalSpy closed(&banner, &Banner::closed);
  const QString disk = QStringLiteral("disk"), hand = QStringLiteral("hand");
  banner.say(Mood::Warn, QStringLiteral("The disk is full."), {}, disk);
  banner.say(Mood::Bad, QStringLiteral("The hand moved too fast."), {}, hand);
  EXPECT_EQ(banner.accessibleName(), QStringLiteral("The hand moved too fast."));
  banner.retract(hand);
  EXPECT_EQ(banner.accessibleName(), QStringLiteral("The disk is full."));
  EXPECT_EQ(banner.mood(), Mood::Warn);
  banner.say(Mood::Bad, QStringLiteral("The device is lost."), {}, hand);
  banner.retract(disk);  // what is covered goes unseen
  EXPECT_EQ(banner.accessibleName(), QStringLiteral("The device is lost."));
  banner.say(Mood::Bad, QStringLiteral("The device answers again."), {}, hand);
  EXPECT_EQ(closed.size(), 0);
  banner.retract(QStringLiteral("nobody"));
  EXPECT_FALSE(banner.isHidden());
  banner.retract(hand);  // said twice, gone at once
  EXPECT_TRUE(banner.isHidden());
  EXPECT_EQ(closed.size(), 1);
}

TEST(Banner, WhatIsLessBadCoversNothingWorse) {
  Banner banner;
  const QString disk = QStringLiteral("disk"), hand = QStringLiteral("hand"), off = QStringLiteral("off");
  const auto names = [&] { return banner.accessibleName().toStdString(); };
  banner.say(Mood::Warn, QStringLiteral("1 stroke is not saved."), {}, disk);
  banner.say(Mood::Bad, QStringLiteral("The device is lost."), {}, hand);
  banner.say(Mood::Warn, QStringLiteral("2 strokes are not saved."), {}, disk);
  EXPECT_EQ(names(), "The device is lost.");
  EXPECT_EQ(banner.mood(), Mood::Bad);
  banner.say(Mood::Warn, QStringLiteral("Forces are off."), {}, off);
  EXPECT_EQ(names(), "The device is lost.");
  banner.say(Mood::Warn, QStringLiteral("2 strokes are not saved."), {}, disk);  // tried again in vain
  banner.retract(hand);
  EXPECT_EQ(names(), "Forces are off.") << "the newest of two that are equally bad";
  banner.say(Mood::Bad, QStringLiteral("The device is lost."), {}, hand);
  banner.say(Mood::Good, QStringLiteral("The device answers again."), {}, hand);
  EXPECT_EQ(names(), "Forces are off.") << "what is good again makes room";
  banner.retract(off);
  EXPECT_EQ(names(), "2 strokes are not saved.");
  banner.retract(disk);
  EXPECT_EQ(names(), "The device answers again.");
}

TEST(Banner, WordsAndIconAreLegibleOnItsGround) {
  for (const Theme* theme : {&dark_theme(), &light_theme()}) {
    apply(*qApp, *theme, 1);
    Banner banner;
    for (const Mood mood : {Mood::Plain, Mood::Good, Mood::Warn, Mood::Bad}) {
      banner.say(mood, QStringLiteral("Words"));
      EXPECT_GE(contrast(banner.ground(), theme->text), 4.5);
      EXPECT_GE(contrast(banner.ground(), colour_of(mood)), 4.5);
    }
  }
  apply(*qApp, dark_theme(), 1);
}

TEST(Card, SaysTitleAndLinesToAssistiveTools) {
  Card card(QStringLiteral("Certified."),
            {QStringLiteral("Within 0.09 mm of the scan."), QStringLiteral("Nothing was removed.")});
  EXPECT_EQ(card.accessibleName(), QStringLiteral("Certified."));
  EXPECT_EQ(card.accessibleDescription(), QStringLiteral("Within 0.09 mm of the scan. Nothing was removed."));
  const QPushButton* show = card.add_button(QStringLiteral("Show them"), true);
  EXPECT_EQ(show->accessibleName(), QStringLiteral("Show them"));
}

TEST(Card, MoodColoursTheTitle) {
  Card card(QStringLiteral("Tolerant"));
  const auto has = [&card](const QColor& colour) {
    const QImage picture = card.grab().toImage();
    for (int y = 0; y < picture.height(); ++y)
      for (int x = 0; x < picture.width(); ++x)
        if (picture.pixelColor(x, y) == colour) return true;
    return false;
  };
  card.show();
  EXPECT_FALSE(has(current_theme().warn));
  card.set_mood(Mood::Warn);
  EXPECT_TRUE(has(current_theme().warn));
}

class DropAreaTest : public testing::Test {
 protected:
  DropAreaTest() {
    area.resize(400, 300);
    area.show();
  }
  void enter(const QString& file) {
    data.setUrls({QUrl::fromLocalFile(file)});
    QDragEnterEvent event({50, 50}, Qt::CopyAction, &data, Qt::LeftButton, {});
    QApplication::sendEvent(&area, &event);
  }
  void drop() {
    QDropEvent event(QPointF(50, 50), Qt::CopyAction, &data, Qt::LeftButton, {});
    QApplication::sendEvent(&area, &event);
  }

  DropArea area{QStringLiteral("Drop a scan here"), {QStringLiteral("ply"), QStringLiteral("stl")}};
  QMimeData data;
  QSignalSpy dropped{&area, &DropArea::dropped};
};

TEST_F(DropAreaTest, TakesFilesItKnowsInAnyCase) {
  enter(QStringLiteral("/scans/Head.PLY"));
  drop();
  ASSERT_EQ(dropped.size(), 1);
  EXPECT_EQ(dropped[0][0].toStringList(), QStringList{"/scans/Head.PLY"});
}

TEST_F(DropAreaTest, SaysWhatItKnowsWhenItDoesNotKnowAFile) {
  enter(QStringLiteral("/scans/head.txt"));
  EXPECT_EQ(area.accessibleDescription(), QStringLiteral("This kind of file cannot be opened. Known are ply, stl."));
  drop();
  EXPECT_EQ(dropped.size(), 0);
  EXPECT_EQ(area.accessibleDescription(), QStringLiteral("ply, stl"));
}

TEST_F(DropAreaTest, AButtonDoesTheSameForThoseWhoDoNotDrag) {
  const QSignalSpy browse(&area, &DropArea::browseRequested);
  area.findChild<QPushButton*>()->click();
  EXPECT_EQ(browse.size(), 1);
}

class ProgressStripTest : public testing::Test {
 protected:
  ProgressStripTest() { strip.start(QStringLiteral("Reading")); }
  QProgressBar& bar() { return *strip.findChild<QProgressBar*>(); }

  double now = 100;
  ProgressStrip strip{nullptr, [this] { return now; }};
  QSignalSpy cancelled{&strip, &ProgressStrip::cancelRequested};
};

TEST_F(ProgressStripTest, OneFractionForTheWholeThatNeverFalls) {
  strip.set_progress(QStringLiteral("Parting"), 0.5);
  strip.set_progress(QStringLiteral("Sampling"), 0.2);
  EXPECT_EQ(strip.fraction(), 0.5);
  EXPECT_EQ(bar().value(), 500);
  EXPECT_EQ(bar().accessibleName(), QStringLiteral("Convert progress"));
  EXPECT_EQ(bar().accessibleDescription(), QStringLiteral("Sampling, 50 %, "));
}

TEST_F(ProgressStripTest, TimeLeftAfterThreeSeconds) {
  now += 2.9;
  strip.set_progress(QStringLiteral("Parting"), 0.1);
  EXPECT_EQ(strip.time_left(), QString());
  now += 0.1;
  EXPECT_EQ(strip.time_left(), QStringLiteral("About 30 s left"));  // 3 s for a tenth: 27 s more
  now += 57;
  EXPECT_EQ(strip.time_left(), QStringLiteral("About 9 min left"));
  strip.set_progress(QStringLiteral("Parting"), 1);
  EXPECT_EQ(strip.time_left(), QStringLiteral("About 5 s left"));
}

TEST_F(ProgressStripTest, CancelOnceAndNothingMovesAfterwards) {
  auto* button = strip.findChild<QPushButton*>();
  EXPECT_EQ(button->accessibleName(), QStringLiteral("Cancel"));
  button->click();
  button->click();
  EXPECT_EQ(cancelled.size(), 1);
  strip.set_progress(QStringLiteral("Sampling"), 0.9);
  EXPECT_EQ(strip.fraction(), 0);
  strip.start(QStringLiteral("Reading"));
  EXPECT_TRUE(button->isEnabled());
}

}  // namespace
}  // namespace relief::studio
