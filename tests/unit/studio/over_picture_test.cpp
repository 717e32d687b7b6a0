#include <gtest/gtest.h>
#include <studio/widgets/axis_ball.h>
#include <studio/widgets/force_meter.h>
#include <studio/widgets/theme.h>

#include <QImage>
#include <QPainter>
#include <QTest>
#include <cmath>
#include <limits>

namespace relief::studio {
namespace {

class AxisBallTest : public testing::Test {
 protected:
  AxisBallTest() { ball.set_square({10, 20, 100, 100}); }
  AxisBall ball;
};

TEST_F(AxisBallTest, FromTheFrontXIsRightYIsUpAndZIsInTheMiddle) {
  EXPECT_GT(ball.position(Axis::X).x(), ball.bounds().center().x() + 30);
  EXPECT_LT(ball.position(Axis::Y).y(), ball.bounds().center().y() - 30);
  EXPECT_EQ(ball.position(Axis::Z), ball.bounds().center());
  EXPECT_EQ(ball.hit(ball.bounds().center()), Axis::Z);  // -z is behind it
  EXPECT_EQ(ball.hit(ball.position(Axis::MinusX)), Axis::MinusX);
  EXPECT_FALSE(ball.hit({12, 22}));
}

TEST_F(AxisBallTest, FromBehindTheNearOneIsMinusZ) {
  ball.set_view({.right = {-1, 0, 0}, .up = {0, 1, 0}, .back = {0, 0, -1}});
  EXPECT_EQ(ball.hit(ball.bounds().center()), Axis::MinusZ);
  EXPECT_EQ(ball.hit(ball.position(Axis::X)), Axis::X);
  EXPECT_LT(ball.position(Axis::X).x(), ball.bounds().center().x());
}

TEST_F(AxisBallTest, EveryAxisIsHitWhereItIsDrawn) {
  const double s = std::sqrt(0.5), t = std::sqrt(1.0 / 3), u = std::sqrt(1.0 / 6);
  ball.set_view({.right = {s, 0, -s}, .up = {-u, 2 * u, -u}, .back = {t, t, t}});
  for (const Axis axis : {Axis::X, Axis::Y, Axis::Z, Axis::MinusX, Axis::MinusY, Axis::MinusZ}) {
    EXPECT_EQ(ball.hit(ball.position(axis)), axis);
    EXPECT_FALSE(title(axis).isEmpty());
  }
}

TEST_F(AxisBallTest, NothingIsPaintedOutsideItsBounds) {
  QImage picture(140, 140, QImage::Format_ARGB32);
  picture.fill(Qt::transparent);
  QPainter painter(&picture);
  for (const Axis axis : {Axis::X, Axis::Y, Axis::MinusX, Axis::MinusY}) {
    ball.set_hovered(axis);
    ball.paint(painter);
  }
  painter.end();
  int inside = 0;
  for (int y = 0; y < 140; ++y) {
    for (int x = 0; x < 140; ++x) {
      if (qAlpha(picture.pixel(x, y)) == 0) continue;
      EXPECT_TRUE(ball.bounds().contains(x + 0.5, y + 0.5)) << x << " " << y;
      ++inside;
    }
  }
  EXPECT_GT(inside, 1000);
}

class ForceMeterTest : public testing::Test {
 protected:
  ForceMeterTest() {
    meter.set_limit(3.3);
    meter.resize(meter.sizeHint());
  }
  /// Pixels of the column that are filled, counted down its middle.
  int filled() {
    const QImage picture = meter.grab().toImage();
    int found = 0;
    for (int y = 30; y < picture.height() - 30; ++y) found += picture.pixelColor(21, y) != current_theme().field;
    return found;
  }
  ForceMeter meter;
};

TEST_F(ForceMeterTest, ColumnGrowsWithTheForce) {
  const int empty = filled();
  meter.set_force(1);
  const int one = filled();
  meter.set_force(2);
  const int two = filled();
  EXPECT_GT(one, empty + 20);
  EXPECT_NEAR(two - one, one - empty, 6);
}

TEST_F(ForceMeterTest, SaysTheForceInWords) {
  meter.set_force(1.94);
  EXPECT_EQ(meter.words(), QStringLiteral("1.9 N"));
  meter.set_force(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(meter.words(), QStringLiteral("0.0 N"));
  meter.set_limit(2);
  EXPECT_EQ(meter.accessibleDescription(), QStringLiteral("0.0 N of at most 2.0 N"));
}

TEST_F(ForceMeterTest, WhatAForceHasComeToIsToldThoughItThenRests) {
  meter.set_force(1);
  meter.set_force(1.4);  // at once, while listeners are still spared
  EXPECT_EQ(meter.accessibleDescription(), QStringLiteral("0.0 N of at most 3.3 N"));
  EXPECT_TRUE(
      QTest::qWaitFor([this] { return meter.accessibleDescription() == QStringLiteral("1.4 N of at most 3.3 N"); }));
}

TEST_F(ForceMeterTest, OffHasNoColumn) {
  const int empty = filled();
  meter.set_force(2);
  meter.set_forces_on(false);
  EXPECT_EQ(filled(), empty);
  EXPECT_EQ(meter.words(), QStringLiteral("off"));
}

TEST_F(ForceMeterTest, BeyondTheLimitItIsStillInside) {
  meter.set_force(100);
  EXPECT_GT(filled(), 100);
  EXPECT_EQ(meter.words(), QStringLiteral("100.0 N"));
}

}  // namespace
}  // namespace relief::studio
