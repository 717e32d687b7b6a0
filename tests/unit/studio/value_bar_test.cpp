#include <gtest/gtest.h>
#include <studio/widgets/theme.h>
#include <studio/widgets/value_bar.h>

#include <QAccessible>
#include <QApplication>
#include <QLineEdit>
#include <QSignalSpy>
#include <QTest>
#include <QVBoxLayout>
#include <QWheelEvent>

namespace relief::studio {
namespace {

class ValueBarTest : public testing::Test {
 protected:
  ValueBarTest() {
    bar.set_range(0, 100);
    bar.set_format(length_format(QStringLiteral("mm")));
    bar.resize(200, 26);
    bar.show();
    EXPECT_TRUE(QTest::qWaitForWindowActive(&bar));
  }
  void move(double x, Qt::KeyboardModifiers keys = {}) {
    QMouseEvent event(QEvent::MouseMove, QPointF(x, 13), bar.mapToGlobal(QPointF(x, 13)), Qt::NoButton, Qt::LeftButton,
                      keys);
    QApplication::sendEvent(&bar, &event);
  }
  void press(int x) { QTest::mousePress(&bar, Qt::LeftButton, {}, {x, 13}); }
  void release(int x) { QTest::mouseRelease(&bar, Qt::LeftButton, {}, {x, 13}); }
  QLineEdit* editor() { return bar.findChild<QLineEdit*>(); }

  ValueBar bar{QStringLiteral("Radius")};
  QSignalSpy edited{&bar, &ValueBar::valueEdited}, finished{&bar, &ValueBar::editFinished};
};

TEST_F(ValueBarTest, DragMovesByTheWayOfTheHand) {
  bar.set_real_value(40);
  press(10);
  move(60);
  EXPECT_NEAR(bar.real_value(), 65, 1e-9);
  EXPECT_EQ(finished.size(), 0);
  release(60);
  EXPECT_EQ(edited.size(), 1);
  EXPECT_EQ(finished.size(), 1);
}

TEST_F(ValueBarTest, ShiftDragsATenthOfTheWay) {
  bar.set_real_value(40);
  press(10);
  move(60, Qt::ShiftModifier);
  release(60);
  EXPECT_NEAR(bar.real_value(), 42.5, 1e-9);
}

TEST_F(ValueBarTest, DragBeyondTheEndStaysThereUntilTheHandIsBack) {
  bar.set_real_value(90);
  press(10);
  move(110);
  EXPECT_EQ(bar.real_value(), 100);
  move(50);
  EXPECT_EQ(bar.real_value(), 100);
  move(20);
  EXPECT_NEAR(bar.real_value(), 95, 1e-9);
  release(20);
}

TEST_F(ValueBarTest, ClickJumps) {
  press(150);
  release(150);
  EXPECT_NEAR(bar.real_value(), 75, 1e-9);
  EXPECT_EQ(edited.size(), 1);
  EXPECT_EQ(finished.size(), 1);
}

TEST_F(ValueBarTest, EscapeTakesADragBack) {
  bar.set_real_value(40);
  press(10);
  move(60);
  QTest::keyClick(&bar, Qt::Key_Escape);
  EXPECT_EQ(bar.real_value(), 40);
  move(90);
  release(90);
  EXPECT_EQ(bar.real_value(), 40);
}

TEST_F(ValueBarTest, DoubleClickTypesAndForgetsTheJumpOfItsFirstClick) {
  bar.set_real_value(40);
  press(150);
  release(150);
  QTest::mouseDClick(&bar, Qt::LeftButton, {}, {150, 13});
  EXPECT_EQ(bar.real_value(), 40);
  ASSERT_TRUE(editor());
  EXPECT_EQ(editor()->text(), QStringLiteral("40.0 mm"));
  QTest::keyClicks(editor(), QStringLiteral("8.5 mm"));
  QTest::keyClick(editor(), Qt::Key_Return);
  EXPECT_EQ(bar.real_value(), 8.5);
  EXPECT_EQ(bar.text(), QStringLiteral("8.5 mm"));
}

TEST_F(ValueBarTest, EscapeLeavesTheValueAsItWasBeforeTyping) {
  bar.set_real_value(40);
  bar.setFocus();
  QTest::keyClick(&bar, Qt::Key_F2);
  ASSERT_TRUE(editor());
  QTest::keyClicks(editor(), QStringLiteral("8"));
  QTest::keyClick(editor(), Qt::Key_Escape);
  EXPECT_EQ(bar.real_value(), 40);
  EXPECT_EQ(edited.size(), 0);
}

TEST_F(ValueBarTest, WhatIsNoValueStaysOpenToBeMended) {
  bar.set_real_value(40);
  bar.setFocus();
  QTest::keyClick(&bar, Qt::Key_Return);
  ASSERT_TRUE(editor());
  QTest::keyClicks(editor(), QStringLiteral("wide"));
  QTest::keyClick(editor(), Qt::Key_Return);
  ASSERT_TRUE(editor());
  EXPECT_TRUE(editor()->isVisible());
  EXPECT_EQ(bar.real_value(), 40);
  QTest::keyClicks(editor(), QStringLiteral("7"));
  QTest::keyClick(editor(), Qt::Key_Return);
  EXPECT_EQ(bar.real_value(), 7);
}

TEST_F(ValueBarTest, TypedValuesAreBroughtIntoTheRange) {
  bar.setFocus();
  QTest::keyClick(&bar, Qt::Key_Return);
  ASSERT_TRUE(editor());
  QTest::keyClicks(editor(), QStringLiteral("20 cm"));
  QTest::keyClick(editor(), Qt::Key_Return);
  EXPECT_EQ(bar.real_value(), 100);
}

TEST_F(ValueBarTest, KeysStep) {
  bar.set_real_value(50);
  bar.setFocus();
  QTest::keyClick(&bar, Qt::Key_Right);
  EXPECT_NEAR(bar.real_value(), 51, 1e-9);
  QTest::keyClick(&bar, Qt::Key_PageUp);
  EXPECT_NEAR(bar.real_value(), 61, 1e-9);
  QTest::keyClick(&bar, Qt::Key_Left, Qt::ShiftModifier);
  EXPECT_NEAR(bar.real_value(), 60.9, 1e-9);
  EXPECT_EQ(edited.size(), 3);
  EXPECT_EQ(finished.size(), 3);
}

TEST_F(ValueBarTest, StepOfTheRangeIsWhatAnArrowDoes) {
  bar.set_range(0, 1, ValueBar::Scale::Linear, 0.05);
  bar.set_real_value(0.5);
  bar.setFocus();
  QTest::keyClick(&bar, Qt::Key_Right);
  EXPECT_NEAR(bar.real_value(), 0.55, 1e-9);
}

TEST_F(ValueBarTest, LogarithmicScaleStepsByRatios) {
  bar.set_range(0.1, 1000, ValueBar::Scale::Logarithmic);
  bar.set_real_value(10);
  EXPECT_EQ(bar.value(), 500);
  bar.setFocus();
  QTest::keyClick(&bar, Qt::Key_Right);
  EXPECT_NEAR(bar.real_value(), 10 * std::pow(10, 0.04), 1e-9);
}

TEST_F(ValueBarTest, KeepsWhatIsFinerThanTheSlidersSteps) {
  bar.set_real_value(33.333);
  EXPECT_DOUBLE_EQ(bar.real_value(), 33.333);
  EXPECT_EQ(edited.size(), 0);
}

TEST_F(ValueBarTest, WheelNeedsFocus) {
  bar.set_real_value(50);
  const auto wheel = [this] {
    QWheelEvent event({100, 13}, bar.mapToGlobal(QPointF(100, 13)), {}, {0, 120}, {}, {}, Qt::NoScrollPhase, false);
    QApplication::sendEvent(&bar, &event);
    return event.isAccepted();
  };
  bar.clearFocus();
  EXPECT_FALSE(wheel());
  EXPECT_EQ(bar.real_value(), 50);
  bar.setFocus();
  EXPECT_TRUE(wheel());
  EXPECT_GT(bar.real_value(), 50);
}

TEST_F(ValueBarTest, IsASliderWithTheValueInWordsToAssistiveTools) {
  bar.set_real_value(8.5);
  QAccessibleInterface* face = QAccessible::queryAccessibleInterface(&bar);
  ASSERT_TRUE(face);
  EXPECT_EQ(face->role(), QAccessible::Slider);
  EXPECT_EQ(face->text(QAccessible::Name), QStringLiteral("Radius"));
  EXPECT_EQ(face->text(QAccessible::Description), QStringLiteral("8.5 mm"));
  ASSERT_TRUE(face->valueInterface());
  face->valueInterface()->setCurrentValue(600);
  EXPECT_NEAR(bar.real_value(), 60, 1e-9);
  EXPECT_EQ(edited.size(), 1);
  EXPECT_EQ(finished.size(), 1);
  EXPECT_EQ(face->text(QAccessible::Description), QStringLiteral("60.0 mm"));
}

TEST_F(ValueBarTest, FillsFromTheRightWhereTextRunsThatWay) {
  bar.setLayoutDirection(Qt::RightToLeft);
  press(50);
  release(50);
  EXPECT_NEAR(bar.real_value(), 75, 1e-9);
  bar.clearFocus();  // its ring has the same colour
  const QImage picture = bar.grab().toImage();
  EXPECT_EQ(picture.pixelColor(190, 23), current_theme().accent);
  EXPECT_NE(picture.pixelColor(10, 23), current_theme().accent);
}

TEST_F(ValueBarTest, TextOnTheFilledPartIsLegible) {
  for (const Theme* theme : {&dark_theme(), &light_theme()}) {
    apply(*qApp, *theme, 1);
    bar.set_real_value(100);
    const QColor fill = bar.grab().toImage().pixelColor(100, 4);
    EXPECT_NE(fill, theme->field);
    EXPECT_GE(contrast(theme->text, fill), 4.5) << fill.name().toStdString();
  }
  apply(*qApp, dark_theme(), 1);
}

TEST(ValueFormats, WriteAndRead) {
  const ValueFormat length = length_format(QStringLiteral("mm"));
  EXPECT_EQ(length.text(7.5), QStringLiteral("7.5 mm"));
  EXPECT_EQ(length.text(7.25), QStringLiteral("7.25 mm"));
  EXPECT_EQ(length.text(0.085), QStringLiteral("0.085 mm"));
  EXPECT_EQ(length.text(0), QStringLiteral("0.0 mm"));
  EXPECT_EQ(length.text(123.4), QStringLiteral("123 mm"));
  EXPECT_EQ(length.parse(QStringLiteral(" 8.5mm ")), 8.5);
  EXPECT_EQ(length.parse(QStringLiteral("8,5")), 8.5);
  EXPECT_EQ(length.parse(QStringLiteral("2 cm")), 20);
  EXPECT_EQ(length.parse(QStringLiteral("1 in")), 25.4);
  for (const char* no : {"", "mm", "8 %", "8 8", "8 furlongs", "1.2.3", "inf", "nan"})
    EXPECT_FALSE(length.parse(QString::fromLatin1(no))) << no;
  EXPECT_EQ(percent_format().text(0.6), QStringLiteral("60 %"));
  EXPECT_EQ(percent_format().parse(QStringLiteral("60 %")), 0.6);
  EXPECT_EQ(percent_format().parse(QStringLiteral("60")), 0.6);
  EXPECT_FALSE(percent_format().parse(QStringLiteral("60 mm")));
  EXPECT_EQ(degree_format().parse(QStringLiteral("12°")), 12);
  EXPECT_EQ(plain_format(2).text(1.5), QStringLiteral("1.50"));
  const ValueFormat none = length_format({});
  EXPECT_EQ(none.text(7.5), QStringLiteral("7.5"));
  EXPECT_FALSE(none.parse(QStringLiteral("2 cm")));
}

}  // namespace
}  // namespace relief::studio
