#include <gtest/gtest.h>
#include <studio/widgets/curve_editor.h>
#include <studio/widgets/theme.h>

#include <QSignalSpy>
#include <QTest>

namespace relief::studio {
namespace {

using Handle = CurveEditor::Handle;

class CurveEditorTest : public testing::Test {
 protected:
  CurveEditorTest() {
    editor.resize(216, 116);  // a plot of 200 x 100
    editor.show();
    EXPECT_TRUE(QTest::qWaitForWindowActive(&editor));
    editor.setFocus();
  }
  void drag(Handle handle, QPointF by) {
    const QPointF from = editor.position(handle);
    QTest::mousePress(&editor, Qt::LeftButton, {}, from.toPoint());
    QTest::mouseMove(&editor, (from + by).toPoint());
    QTest::mouseRelease(&editor, Qt::LeftButton, {}, (from + by).toPoint());
  }

  CurveEditor editor;
  QSignalSpy edited{&editor, &CurveEditor::curveEdited}, finished{&editor, &CurveEditor::editFinished};
};

TEST_F(CurveEditorTest, EndsMoveAlongTheirEdges) {
  drag(Handle::Low, {40, -30});
  drag(Handle::High, {-20, 50});
  EXPECT_NEAR(editor.curve().low, 0.2, 1e-9);
  EXPECT_NEAR(editor.curve().high, 0.9, 1e-9);
  EXPECT_EQ(editor.curve().exponent, 1);
  EXPECT_EQ(finished.size(), 2);
}

TEST_F(CurveEditorTest, TheMiddleBendsTheCurveThroughTheHand) {
  drag(Handle::Bend, {0, 25});
  EXPECT_NEAR(editor.curve()(0.5), 0.25, 1e-9);
  EXPECT_NEAR(editor.curve().exponent, 2, 1e-9);
  EXPECT_EQ(editor.curve().low, 0);
}

TEST_F(CurveEditorTest, EndsDoNotPassEachOther) {
  drag(Handle::Low, {500, 0});
  EXPECT_NEAR(editor.curve().low, 0.95, 1e-9);
  drag(Handle::High, {-500, 0});
  EXPECT_EQ(editor.curve().high, 1);
}

TEST_F(CurveEditorTest, WorksByKeys) {
  QTest::keyClick(&editor, Qt::Key_Down);
  EXPECT_NEAR(editor.curve()(0.5), 0.45, 1e-9);
  QTest::keyClick(&editor, Qt::Key_Tab);
  EXPECT_EQ(editor.current(), Handle::High);
  QTest::keyClick(&editor, Qt::Key_Left);
  QTest::keyClick(&editor, Qt::Key_Left, Qt::ShiftModifier);
  EXPECT_NEAR(editor.curve().high, 0.94, 1e-9);
  QTest::keyClick(&editor, Qt::Key_Backtab, Qt::ShiftModifier);
  QTest::keyClick(&editor, Qt::Key_Backtab, Qt::ShiftModifier);
  EXPECT_EQ(editor.current(), Handle::Low);
  QTest::keyClick(&editor, Qt::Key_Right);
  EXPECT_NEAR(editor.curve().low, 0.05, 1e-9);
  QTest::keyClick(&editor, Qt::Key_Home);
  EXPECT_EQ(editor.curve(), PressureCurve{});
  EXPECT_EQ(edited.size(), 5);
}

TEST_F(CurveEditorTest, SetCurveEmitsNothingAndStaysWithinReach) {
  editor.set_curve({.low = 0.5, .high = 0.5, .exponent = 100});
  EXPECT_EQ(edited.size(), 0);
  EXPECT_GT(editor.curve().high, editor.curve().low);
  EXPECT_EQ(editor.curve().exponent, 5);
}

TEST_F(CurveEditorTest, SaysWhatItIsInWords) {
  editor.set_curve({.low = 0.1, .high = 0.8, .exponent = 2});
  EXPECT_TRUE(editor.accessibleDescription().contains(QStringLiteral("Starts at 10 % pressure, full at 80 %")));
  EXPECT_FALSE(editor.accessibleName().isEmpty());
}

TEST_F(CurveEditorTest, ShowsTheLivePressure) {
  const auto green = [this] {
    const QImage picture = editor.grab().toImage();
    int found = 0;
    for (int y = 0; y < picture.height(); ++y)
      for (int x = 103; x < 114; ++x) found += picture.pixelColor(x, y) == current_theme().good;
    return found;
  };
  EXPECT_EQ(green(), 0);
  editor.set_live_pressure(0.5);
  EXPECT_GT(green(), 10);
  editor.set_live_pressure(std::nullopt);
  EXPECT_EQ(green(), 0);
}

}  // namespace
}  // namespace relief::studio
