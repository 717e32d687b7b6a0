// The viewport's hand without a screen: pens and fingers, with events as Qt makes them.
#include <relief/session/stroke_text.h>

#include <gtest/gtest.h>
#include <studio/viewport.h>
#include <support/driver.h>

#include <QSignalSpy>
#include <QTemporaryDir>
#include <QTest>
#include <cmath>
#include <numbers>

namespace relief::studio {
namespace {

/// A studio's viewport over a ball of radius 1, and what a pen does to it.
class ViewportTest : public ::testing::Test {
 protected:
  void SetUp() override {
    Model model;
    model.info.mode = Mode::Tolerant;
    model.info.source = "ball";
    model.info.source_diagonal = 3.4;
    model.head = testing::fine_sphere();
    auto file = ModelFile::create(place(), model);
    ASSERT_TRUE(file) << file.error().message;
    ASSERT_TRUE(bridge.open(place(), *std::move(file)));
    tools.set_diagonal(3.4);
    view.resize(800, 600);
    view.set_scene({bridge.head(), nullptr}, Unit::Millimetre, true);
    ASSERT_TRUE(view.hit({400, 300}));
  }
  std::filesystem::path place() const { return folder_.filePath("ball.relief").toStdString(); }

  void pen(QEvent::Type type, QPointF at, double pressure, const QPointingDevice& device) {
    const bool up = type == QEvent::TabletRelease;
    QTabletEvent event(type, &device, at, at, pressure, 12, -5, 0, 0, 0, Qt::NoModifier,
                       type == QEvent::TabletMove ? Qt::NoButton : Qt::LeftButton, up ? Qt::NoButton : Qt::LeftButton);
    event.setTimestamp(++time_);
    QApplication::sendEvent(&view, &event);
    EXPECT_TRUE(event.isAccepted()) << "else Qt makes a mouse event of it";
  }
  /// From left to right over the ball's middle, pressure rising from 0.1 to 1; the pressures that were sent.
  std::vector<double> draw(const QPointingDevice& device, bool with_mouse = false) {
    std::vector<double> sent;
    constexpr int kSteps = 400;
    for (int k = 0; k <= kSteps; ++k) {
      const double share = double(k) / kSteps, pressure = 0.1 + 0.9 * share;
      const QPointF at(300 + 200 * share, 300);
      pen(k == 0 ? QEvent::TabletPress : QEvent::TabletMove, at, pressure, device);
      sent.push_back(pressure);
      if (!with_mouse) continue;
      QMouseEvent event(QEvent::MouseMove, at + QPointF(0, 40), at, Qt::NoButton, Qt::LeftButton, Qt::NoModifier);
      QApplication::sendEvent(&view, &event);
    }
    pen(QEvent::TabletRelease, {500, 300}, 0, device);
    bridge.document()->settle();
    return sent;
  }
  /// The last stroke as the file keeps it.
  Stroke journal() {
    EXPECT_TRUE(bridge.close());
    auto file = ModelFile::open(place());
    const auto strokes = file->strokes();
    EXPECT_FALSE(strokes->empty());
    auto stroke = stroke_of(strokes->back().details, "stroke");
    EXPECT_TRUE(stroke) << stroke.error().message;
    return *stroke;
  }
  double depth_at(double x, const Snapshot& before, const Snapshot& after) const {
    const Ray3d ray = view.ray({x, 300});
    return raycast(after, ray)->distance - raycast(before, ray)->distance;
  }

  DocumentBridge bridge;
  ToolState tools;
  Viewport view{bridge, tools};
  QPointingDevice pen_device{"Made-up pen",
                             7,
                             QInputDevice::DeviceType::Stylus,
                             QPointingDevice::PointerType::Pen,
                             QInputDevice::Capability::Pressure | QInputDevice::Capability::XTilt,
                             1,
                             3};
  QPointingDevice eraser_device{"Made-up pen",
                                8,
                                QInputDevice::DeviceType::Stylus,
                                QPointingDevice::PointerType::Eraser,
                                QInputDevice::Capability::Pressure,
                                1,
                                3};

 private:
  QTemporaryDir folder_;
  ulong time_ = 1000;
};

std::vector<double> pressures_of(const Stroke& stroke) {
  std::vector<double> all;
  for (const StrokePoint& point : stroke.points) all.push_back(point.pressure);
  return all;
}

TEST_F(ViewportTest, APensPressureArrivesWholeAndCutsDeeperAsItGrows) {
  QSignalSpy told(&view, &Viewport::pointerKnown);
  const SnapshotPtr before = bridge.head();
  const std::vector<double> sent = draw(pen_device);
  const SnapshotPtr after = bridge.head();
  EXPECT_EQ(view.stroke_events(), 401);
  const double first = depth_at(330, *before, *after), middle = depth_at(400, *before, *after),
               last = depth_at(480, *before, *after);
  EXPECT_LT(first, 0.7 * middle);
  EXPECT_LT(middle, 0.9 * last);
  ASSERT_FALSE(told.isEmpty());
  EXPECT_EQ(told.last().at(0).toString(), "Made-up pen");
  // Leaning by 12 degrees along x and 5 along y.
  const double degree = std::numbers::pi / 180;
  EXPECT_NEAR(told.last().at(2).toDouble(), std::atan(std::hypot(std::tan(12 * degree), std::tan(5 * degree))) / degree,
              1e-6);
  const Stroke stroke = journal();
  EXPECT_EQ(stroke.brush.tool, Tool::Carve);
  EXPECT_EQ(pressures_of(stroke), sent);
  EXPECT_NEAR(stroke.points.back().t - stroke.points.front().t, 0.4, 1e-9) << "the window system's clock";
}

TEST_F(ViewportTest, WithoutPressureAPenIsAMouse) {
  tools.set_use_pressure(false);
  draw(pen_device);
  for (const double pressure : pressures_of(journal())) EXPECT_EQ(pressure, 1);
}

TEST_F(ViewportTest, TheEraserDoesTheOpposite) {
  const SnapshotPtr before = bridge.head();
  draw(eraser_device);
  EXPECT_LT(depth_at(400, *before, *bridge.head()), 0) << "nearer to the eye: built up";
  EXPECT_EQ(journal().brush.tool, Tool::Deposit);
}

TEST_F(ViewportTest, MouseEventsBesideAPenAreNotStrokes) {
  draw(pen_device, true);
  EXPECT_EQ(view.stroke_events(), 401);
}

TEST_F(ViewportTest, PressureThatIsNoNumberIsNone) {
  pen(QEvent::TabletPress, {400, 300}, std::numeric_limits<double>::infinity(), pen_device);
  pen(QEvent::TabletMove, {420, 300}, std::numeric_limits<double>::quiet_NaN(), pen_device);
  pen(QEvent::TabletMove, {440, 300}, 7, pen_device);
  pen(QEvent::TabletRelease, {440, 300}, -1, pen_device);
  bridge.document()->settle();
  const auto known = pressures_of(journal());
  EXPECT_EQ(known, (std::vector<double>{0, 0, 1}));
}

TEST_F(ViewportTest, APenBesideTheModelTurnsIt) {
  const Camera before = view.camera();
  pen(QEvent::TabletPress, {10, 10}, 0.5, pen_device);
  pen(QEvent::TabletMove, {60, 10}, 0.5, pen_device);
  pen(QEvent::TabletRelease, {60, 10}, 0, pen_device);
  EXPECT_NE(view.camera().eye, before.eye);
  bridge.document()->settle();
  EXPECT_EQ(bridge.document()->statistics().strokes, 0U);
}

TEST_F(ViewportTest, OneFingerTurnsTwoZoomAndThreeUndo) {
  view.show();
  std::unique_ptr<QPointingDevice> screen(QTest::createTouchDevice());
  const Camera before = view.camera();
  QTest::touchEvent(&view, screen.get()).press(0, {400, 300});
  QTest::touchEvent(&view, screen.get()).move(0, {460, 300});
  QTest::touchEvent(&view, screen.get()).release(0, {460, 300});
  EXPECT_NE(view.camera().eye, before.eye);
  EXPECT_NEAR(length(view.camera().eye - view.camera().target), length(before.eye - before.target), 1e-9);
  const double height = height_at_target(view.camera());
  QTest::touchEvent(&view, screen.get()).press(0, {380, 300}).press(1, {420, 300});
  QTest::touchEvent(&view, screen.get()).move(0, {360, 300}).move(1, {440, 300});
  QTest::touchEvent(&view, screen.get()).release(0, {360, 300}).release(1, {440, 300});
  EXPECT_NEAR(height_at_target(view.camera()), height / 2, 1e-6) << "fingers twice as far apart";
  QSignalSpy undo(&view, &Viewport::undoAsked);
  QTest::touchEvent(&view, screen.get()).press(0, {380, 300}).press(1, {420, 300}).press(2, {400, 340});
  QTest::touchEvent(&view, screen.get()).release(0, {380, 300}).release(1, {420, 300}).release(2, {400, 340});
  EXPECT_EQ(undo.count(), 1);
  bridge.document()->settle();
  EXPECT_EQ(bridge.document()->statistics().strokes, 0U);
}

TEST_F(ViewportTest, AFingerSculptsWhereItWasTold) {
  view.show();
  view.set_touch_sculpts(true);
  std::unique_ptr<QPointingDevice> screen(QTest::createTouchDevice());
  QTest::touchEvent(&view, screen.get()).press(0, {400, 300});
  QTest::touchEvent(&view, screen.get()).move(0, {440, 300});
  QTest::touchEvent(&view, screen.get()).release(0, {440, 300});
  bridge.document()->settle();
  EXPECT_EQ(bridge.document()->statistics().strokes, 1U);
}

TEST_F(ViewportTest, ARestingPointerGoesOnWorking) {
  tools.choose("deposit");
  const SnapshotPtr before = bridge.head();
  QMouseEvent press(QEvent::MouseButtonPress, {400, 300}, {400, 300}, Qt::LeftButton, Qt::LeftButton, Qt::NoModifier);
  QApplication::sendEvent(&view, &press);
  QTest::qWait(300);
  QMouseEvent up(QEvent::MouseButtonRelease, {400, 300}, {400, 300}, Qt::LeftButton, Qt::NoButton, Qt::NoModifier);
  QApplication::sendEvent(&view, &up);
  bridge.document()->settle();
  EXPECT_EQ(view.stroke_events(), 1);
  const double height = -depth_at(400, *before, *bridge.head());
  // A tap would be a tenth of a second of work; strength x radius per second.
  EXPECT_GT(height, 1.5 * 0.1 * tools.value("strength") * tools.value("radius"));
}

}  // namespace
}  // namespace relief::studio
