#include <gtest/gtest.h>
#include <studio/widgets/plot.h>
#include <studio/widgets/theme.h>

#include <QAccessible>
#include <QSignalSpy>
#include <QTest>
#include <limits>
#include <vector>

namespace relief::studio {
namespace {

/// `count` samples at 1 kHz from `start` seconds on, value 1 but for `spike`, which is 5.
std::vector<Sample> samples(double start, std::size_t count, std::size_t spike = SIZE_MAX) {
  std::vector<Sample> made(count);
  for (std::size_t i = 0; i < count; ++i)
    made[i] = {.time = start + 0.001 * static_cast<double>(i), .value = i == spike ? 5.0F : 1.0F};
  return made;
}

TEST(SampleRing, ForgetsTheOldestFirst) {
  SampleRing ring(1000);
  ring.append(samples(0, 700));
  ring.append(samples(0.7, 700));
  EXPECT_EQ(ring.size(), 1000U);
  EXPECT_NEAR(ring[0].time, 0.4, 1e-9);
  EXPECT_NEAR(ring.newest().time, 1.399, 1e-9);
}

TEST(SampleRing, LeavesOutWhatCannotBeDrawn) {
  SampleRing ring(10);
  const Sample odd[] = {{1, 1}, {2, std::numeric_limits<float>::quiet_NaN()}, {0.5, 1}, {std::nan(""), 1}, {3, 2}};
  ring.append(odd);
  EXPECT_EQ(ring.size(), 2U);
  EXPECT_EQ(ring.newest().value, 2);
}

TEST(SampleRing, FindsTheValueAtATime) {
  SampleRing ring(4);
  const Sample some[] = {{0, 9}, {1, 1}, {2, 2}, {3, 3}, {4, 4}};
  ring.append(some);
  EXPECT_FALSE(ring.at(0.5));
  EXPECT_EQ(ring.at(1), 1);
  EXPECT_EQ(ring.at(2.9), 2);
  EXPECT_EQ(ring.at(100), 4);
}

TEST(SampleRing, EnvelopeLosesNoSpike) {
  SampleRing ring;
  ring.append(samples(0, 60'000, 31'234));
  const auto extents = ring.envelope(0, 60, 300);
  ASSERT_EQ(extents.size(), 300U);
  for (std::size_t i = 0; i < extents.size(); ++i) {
    EXPECT_EQ(extents[i].low, 1);
    EXPECT_EQ(extents[i].high, i == 156 ? 5 : 1) << i;
  }
  EXPECT_TRUE(ring.envelope(100, 200, 10)[3].empty());
}

class PlotViewTest : public testing::Test {
 protected:
  PlotViewTest() {
    plot.set_seconds(10);
    plot.set_format([](double value) { return QStringLiteral("%1 N").arg(value, 0, 'f', 1); });
    plot.set_text(QStringLiteral("now"));
    plot.append(samples(0, 10'000, 5'000));
    plot.resize(214, 60);  // a plot of 200 pixels
    plot.show();
    EXPECT_TRUE(QTest::qWaitForWindowActive(&plot));
  }
  int count(const QColor& colour) {
    const QImage picture = plot.grab().toImage();
    int found = 0;
    for (int y = 0; y < picture.height(); ++y)
      for (int x = 0; x < picture.width(); ++x) found += picture.pixelColor(x, y) == colour;
    return found;
  }

  PlotView plot{QStringLiteral("Force"), PlotView::Colour::Good};
  QSignalSpy scrubbed{&plot, &PlotView::scrubbed};
};

TEST_F(PlotViewTest, DrawsTheSpikeTallerThanTheRest) {
  const QImage picture = plot.grab().toImage();
  const auto top_of = [&](int x) {
    for (int y = 22; y < picture.height(); ++y)
      if (picture.pixelColor(x, y).green() > 120) return y;
    return picture.height();
  };
  EXPECT_LT(top_of(107), top_of(60) - 10);
}

TEST_F(PlotViewTest, LimitIsADashedLineThatIsAlwaysInside) {
  EXPECT_EQ(count(current_theme().bad), 0);
  plot.set_limit(50);
  EXPECT_GT(count(current_theme().bad), 60);
  EXPECT_LT(count(current_theme().bad), 195);
}

TEST_F(PlotViewTest, FrozenItKeepsWhatItShowsWhileTheSignalArrives) {
  plot.set_frozen(true);
  const QImage before = plot.grab().toImage();
  plot.append(samples(10, 3'000, 100));
  EXPECT_EQ(plot.grab().toImage(), before);
  plot.set_frozen(false);
  EXPECT_NE(plot.grab().toImage(), before);
}

TEST_F(PlotViewTest, ScrubsWhenFrozenOnly) {
  QTest::mouseClick(&plot, Qt::LeftButton, {}, {107, 40});
  EXPECT_EQ(scrubbed.size(), 0);
  plot.set_frozen(true);
  QTest::mouseClick(&plot, Qt::LeftButton, {}, {57, 40});
  ASSERT_EQ(scrubbed.size(), 1);
  EXPECT_NEAR(scrubbed[0][0].toDouble(), 2.5, 0.06);  // a column is 0.05 s
  EXPECT_EQ(plot.value_at_cursor(), 1);
}

TEST_F(PlotViewTest, ArrowsScrubAndTheWordsFollow) {
  plot.set_frozen(true);
  plot.setFocus();
  plot.set_cursor(5.1);
  EXPECT_EQ(plot.accessibleDescription(), QStringLiteral("1.0 N, 4.90 s before"));
  QTest::keyClick(&plot, Qt::Key_Left);
  ASSERT_EQ(scrubbed.size(), 1);
  EXPECT_NEAR(*plot.cursor(), 5.0, 1e-9);
  QTest::keyClick(&plot, Qt::Key_Right, Qt::ShiftModifier);
  EXPECT_NEAR(*plot.cursor(), 5.01, 1e-9);
  QTest::keyClick(&plot, Qt::Key_End);
  EXPECT_NEAR(*plot.cursor(), 9.999, 1e-9);
  QTest::keyClick(&plot, Qt::Key_Right);
  EXPECT_NEAR(*plot.cursor(), 9.999, 1e-9);
}

TEST_F(PlotViewTest, IsAChartToAssistiveTools) {
  QAccessibleInterface* face = QAccessible::queryAccessibleInterface(&plot);
  ASSERT_TRUE(face);
  EXPECT_EQ(face->role(), QAccessible::Chart);
  EXPECT_EQ(face->text(QAccessible::Name), QStringLiteral("Force"));
  EXPECT_EQ(face->text(QAccessible::Description), QStringLiteral("now"));
}

TEST(PlotView, WithoutSamplesDrawsAnEmptyField) {
  PlotView plot(QStringLiteral("Force"), PlotView::Colour::Blue);
  plot.set_frozen(true);
  QTest::mouseClick(&plot, Qt::LeftButton, {}, {50, 30});
  EXPECT_FALSE(plot.value_at_cursor());
  EXPECT_FALSE(plot.grab().isNull());
}

}  // namespace
}  // namespace relief::studio
