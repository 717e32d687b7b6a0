// A pen on the viewport, made up: an X server without a tablet has none, so its events are sent to the widget itself.
#include "support/folder.h"
#include "support/shells.h"

#include <relief/session/stroke_text.h>

#include <gtest/gtest.h>
#include <studio/viewport.h>

#include <QPointingDevice>
#include <QSignalSpy>
#include <QTabletEvent>
#include <QTest>
#include <cmath>
#include <limits>

namespace relief::studio {
namespace {

constexpr int kPatience = 20'000;  // ms, on a machine that is busy with other things
constexpr int kEvents = 400;       // of a stroke, one a millisecond

/// A pen that goes from left to right over a ball of radius 1, seen from the front.
class PenTest : public ::testing::Test {
 protected:
  PenTest() { open(); }

  void open() {
    Model ball;
    ball.head = Snapshot::make(testing::sphere_shell(3, 16));
    auto made = ModelFile::create(file, ball);
    ASSERT_TRUE(made) << made.error().message;
    ASSERT_TRUE(bridge.open(file, *std::move(made)));
    QObject::connect(&bridge, &DocumentBridge::snapshotChanged, &view, [this] { view.set_model(bridge.head()); });
    tools.set_diagonal(2 * std::sqrt(3.0));
    tools.set_value("radius", kRadius);
    tools.set_value("strength", kStrength);
    view.resize(600, 600);
    view.set_scene({bridge.head(), nullptr}, Unit::Millimetre, true);
    view.set_camera(look_along(view.camera(), AxisView::Front, {0, 1, 0}));
    view.show();
  }

  void send(QEvent::Type type, QPointF at, double pressure, QPointF tilt = {}) {
    const Qt::MouseButtons down = type == QEvent::TabletRelease ? Qt::NoButton : Qt::LeftButton;
    QTabletEvent event(type, &pen, at, at, pressure, static_cast<float>(tilt.x()), static_cast<float>(tilt.y()), 0, 0,
                       0, Qt::NoModifier, type == QEvent::TabletMove ? Qt::NoButton : Qt::LeftButton, down);
    event.setTimestamp(++now);
    QCoreApplication::sendEvent(&view, &event);
  }
  [[nodiscard]] QPointF place(double share) const { return {150 + 300 * share, 300}; }

  /// A stroke whose pressure is a function of the share of the way; what the document says of it.
  template <typename Pressure>
  StrokeFinished stroke(Pressure&& pressure) {
    QSignalSpy finished(&bridge, &DocumentBridge::strokeFinished);
    send(QEvent::TabletPress, place(0), pressure(0.0));
    for (int k = 1; k <= kEvents; ++k) {
      const double share = k / double{kEvents};
      send(QEvent::TabletMove, place(share), pressure(share));
      if (mouse_too) mouse(QEvent::MouseMove, place(share) + QPointF(0, 40));
    }
    send(QEvent::TabletRelease, place(1), 0);
    EXPECT_TRUE(QTest::qWaitFor([&] { return !finished.isEmpty(); }, kPatience));
    return finished.isEmpty() ? StrokeFinished{} : finished.first().first().value<StrokeFinished>();
  }
  void mouse(QEvent::Type type, QPointF at) {
    QMouseEvent event(type, at, at, Qt::LeftButton, Qt::LeftButton, Qt::NoModifier);
    QCoreApplication::sendEvent(&view, &event);
  }

  /// How deep the surface lies under the ball it was, at a share of the way.
  [[nodiscard]] double depth(double share) const {
    const auto hit = view.hit(place(share));
    return hit ? 1 - length(hit->point.position) : 0;
  }

  /// The strokes of the file, which is closed for it.
  [[nodiscard]] std::vector<Stroke> strokes_in_file() {
    EXPECT_TRUE(bridge.close());
    std::vector<Stroke> read;
    auto model = ModelFile::open(file);
    EXPECT_TRUE(model);
    const auto records = model->strokes();
    EXPECT_TRUE(records);
    for (const StrokeRecord& record : *records) {
      auto stroke = stroke_of(record.details, "the file");
      EXPECT_TRUE(stroke);
      read.push_back(*std::move(stroke));
    }
    return read;
  }

  static constexpr double kRadius = 0.15, kStrength = 0.6;
  testing::Folder folder;
  std::filesystem::path file = folder / "ball.relief";
  QPointingDevice pen{"Test pen",
                      7,
                      QInputDevice::DeviceType::Stylus,
                      QPointingDevice::PointerType::Pen,
                      QInputDevice::Capability::Position | QInputDevice::Capability::Pressure,
                      1,
                      3,
                      QString(),
                      QPointingDeviceUniqueId::fromNumericId(7)};
  DocumentBridge bridge;
  ToolState tools;
  Viewport view{bridge, tools};
  double wanted = 1;  ///< of the ring, as a share of the radius
  quint64 now = 1000;
  bool mouse_too = false;
};

double ramp(double share) { return 0.1 + 0.9 * share; }

TEST_F(PenTest, EveryEventIsTakenWithItsPressure) {
  stroke(ramp);
  EXPECT_EQ(view.stroke_events(), 1 + kEvents);
  const std::vector<Stroke> strokes = strokes_in_file();
  ASSERT_EQ(strokes.size(), 1U);
  std::size_t next = 0;  // places at which the hand rested may come twice
  for (int k = 0; k <= kEvents; ++k) {
    const double sent = ramp(k / double{kEvents});
    while (next < strokes[0].points.size() && std::abs(strokes[0].points[next].pressure - sent) > 1e-9) ++next;
    ASSERT_LT(next, strokes[0].points.size()) << "pressure " << sent << " of event " << k;
    EXPECT_NEAR(strokes[0].points[next].t, 1e-3 * k, 2e-3);
  }
}

TEST_F(PenTest, TheCutGrowsWithThePressure) {
  stroke(ramp);
  double before = 0;
  for (const double share : {0.1, 0.3, 0.5, 0.7, 0.9}) {
    const double now_deep = depth(share);
    EXPECT_GT(now_deep, before + 0.005) << share;
    EXPECT_NEAR(now_deep, kStrength * kRadius * ramp(share), 0.35 * kStrength * kRadius) << share;
    before = now_deep;
  }
}

TEST_F(PenTest, WithoutPressureTheCutIsEven) {
  tools.set_use_pressure(false);
  stroke(ramp);
  for (const double share : {0.1, 0.3, 0.5, 0.7, 0.9}) EXPECT_NEAR(depth(share), kStrength * kRadius, 0.015) << share;
}

TEST_F(PenTest, TheOtherEndDoesTheOpposite) {
  QPointingDevice eraser("Test pen", 8, QInputDevice::DeviceType::Stylus, QPointingDevice::PointerType::Eraser,
                         QInputDevice::Capability::Position | QInputDevice::Capability::Pressure, 1, 3, QString(),
                         QPointingDeviceUniqueId::fromNumericId(7));
  const auto event = [&](QEvent::Type type, double share) {
    QTabletEvent tablet(type, &eraser, place(share), place(share), 1, 0, 0, 0, 0, 0, Qt::NoModifier,
                        type == QEvent::TabletMove ? Qt::NoButton : Qt::LeftButton,
                        type == QEvent::TabletRelease ? Qt::NoButton : Qt::LeftButton);
    tablet.setTimestamp(++now);
    QCoreApplication::sendEvent(&view, &tablet);
  };
  QSignalSpy finished(&bridge, &DocumentBridge::strokeFinished);
  event(QEvent::TabletPress, 0.3);
  for (int k = 0; k <= 200; ++k) event(QEvent::TabletMove, 0.3 + 0.002 * k);
  event(QEvent::TabletRelease, 0.7);
  ASSERT_TRUE(QTest::qWaitFor([&] { return !finished.isEmpty(); }, kPatience));
  EXPECT_EQ(finished.first().first().value<StrokeFinished>().tool, Tool::Deposit);
  EXPECT_LT(depth(0.5), 0) << "it rises";
}

TEST_F(PenTest, AMouseBesideItIsNotHeard) {
  // Some drivers send the mouse's events too, at full pressure.
  mouse_too = true;
  stroke([](double) { return 0.3; });
  EXPECT_EQ(view.stroke_events(), 1 + kEvents);
  for (const Stroke& each : strokes_in_file())
    for (const StrokePoint& point : each.points) EXPECT_NEAR(point.pressure, 0.3, 1e-9);
}

TEST_F(PenTest, APressureThatIsNoNumberIsNone) {
  stroke([](double share) { return share < 0.5 ? 0.5 : std::numeric_limits<double>::quiet_NaN(); });
  for (const Stroke& each : strokes_in_file())
    for (const StrokePoint& point : each.points) EXPECT_TRUE(point.pressure >= 0 && point.pressure <= 1);
}

TEST_F(PenTest, TheRingIsAsWideAsTheDab) {
  const PressureCurve curve{.low = 0.1, .high = 0.8, .exponent = 0.5};
  tools.set_pressure(curve);
  const auto near = [&](double pressure) {
    send(QEvent::TabletMove, place(0.5), pressure);
    return QTest::qWaitFor([&] { return std::abs(view.ring_radius() - kRadius * wanted) < 1e-9; }, kPatience);
  };
  for (const int drives : {1, 2, 0}) {  // radius, both, strength
    tools.set_value("pressure_drives", drives);
    for (const double pressure : {0.0, 0.25, 0.5, 1.0}) {
      wanted = drives == 0 || pressure == 0 ? 1 : curve(pressure);
      EXPECT_TRUE(near(pressure)) << drives << ' ' << pressure << ": " << view.ring_radius();
    }
  }
  tools.set_value("pressure_drives", 1);
  wanted = curve(0.25);
  ASSERT_TRUE(near(0.25));
  const QImage light = view.grab().toImage();
  wanted = curve(0.5);
  ASSERT_TRUE(near(0.5));
  EXPECT_NE(view.grab().toImage(), light);
  wanted = 1;
  tools.set_use_pressure(false);
  EXPECT_TRUE(near(0.25)) << "pressure is off";
  tools.set_use_pressure(true);
  QMouseEvent moved(QEvent::MouseMove, place(0.5), place(0.5), Qt::NoButton, Qt::NoButton, Qt::NoModifier);
  QCoreApplication::sendEvent(&view, &moved);
  EXPECT_TRUE(QTest::qWaitFor([&] { return std::abs(view.ring_radius() - kRadius) < 1e-9; }, kPatience)) << "a mouse";
}

TEST_F(PenTest, TheCutIsAsWideAsTheRing) {
  tools.set_value("pressure_drives", 1);
  const auto deep = [&](double away) {  // below the ball, model units to the side of the way's middle
    const auto seen = seen_at(view.camera(), Vec3d{0, away, std::sqrt(1 - away * away)}, view.width(), view.height());
    const auto hit = seen ? view.hit(*seen) : std::nullopt;
    return hit ? 1 - length(hit->point.position) : 1;
  };
  const double ring = 0.5 * kRadius, within = 0.7 * ring, outside = 1.3 * ring;
  const double within_before = deep(within), outside_before = deep(outside);
  QSignalSpy finished(&bridge, &DocumentBridge::strokeFinished);
  send(QEvent::TabletPress, place(0), 0.5);
  for (int k = 1; k <= kEvents; ++k) send(QEvent::TabletMove, place(k / double{kEvents}), 0.5);
  EXPECT_TRUE(QTest::qWaitFor([&] { return std::abs(view.ring_radius() - ring) < 1e-9; }, kPatience));
  send(QEvent::TabletRelease, place(1), 0);
  ASSERT_TRUE(QTest::qWaitFor([&] { return !finished.isEmpty(); }, kPatience));
  EXPECT_GT(deep(within), within_before + 0.01);
  EXPECT_NEAR(deep(outside), outside_before, 0.001);
}

TEST_F(PenTest, ItsNamePressureAndTiltAreTold) {
  QSignalSpy told(&view, &Viewport::pointerKnown);
  send(QEvent::TabletMove, place(0.5), 0.43, {12, 5});
  ASSERT_FALSE(told.isEmpty());
  EXPECT_EQ(told.first()[0].toString(), "Test pen");
  EXPECT_NEAR(told.first()[1].toDouble(), 0.43, 1e-3);
  EXPECT_NEAR(told.first()[2].toDouble(), 13, 0.1);
}

TEST_F(PenTest, AFlatPenWorksWithLessPressureWhereThatIsWanted) {
  // Leaning sideways and forwards: the angle whose cosine is 1 / sqrt(1 + tan^2 + tan^2).
  const QPointF lean{45, 30};
  const double upright = 1 / std::sqrt(1 + 1 + 1.0 / 3);
  const auto tap = [&](bool use, QPointF tilt, double share) {
    tools.set_use_tilt(use);
    QSignalSpy told(&view, &Viewport::pointerKnown);
    QSignalSpy finished(&bridge, &DocumentBridge::strokeFinished);
    send(QEvent::TabletPress, place(0.5), 0.8, tilt);
    for (int k = 0; k < 20; ++k) send(QEvent::TabletMove, place(0.5), 0.8, tilt);
    send(QEvent::TabletRelease, place(0.5), 0, tilt);
    EXPECT_TRUE(QTest::qWaitFor([&] { return !finished.isEmpty(); }, kPatience));
    const double deep = depth(0.5);
    bridge.post(Undo{});
    bridge.document()->settle();
    view.set_model(bridge.head());
    EXPECT_NEAR(told.first()[1].toDouble(), 0.8 * share, 0.02);
    return deep;
  };
  const double full = kStrength * kRadius * 0.8;
  EXPECT_NEAR(tap(false, lean, 1), full, 0.1 * full);
  EXPECT_NEAR(tap(true, {}, 1), full, 0.1 * full);
  EXPECT_NEAR(tap(true, lean, upright), upright * full, 0.1 * full);
  EXPECT_NEAR(tap(true, {90, 0}, 0), 0, 0.1 * full);
}

/// The map for a pen alone, without keys.
class PenNavigationTest : public PenTest {
 protected:
  PenNavigationTest() { view.set_map(NavigationMap::Pen); }

  void drag(QPointF from, QPointF to) {
    send(QEvent::TabletPress, from, 0.5);
    for (int k = 1; k <= 20; ++k) send(QEvent::TabletMove, from + (to - from) * (k / 20.0), 0.5);
    send(QEvent::TabletRelease, to, 0);
  }
  void space(QEvent::Type type) {
    QKeyEvent event(type, Qt::Key_Space, Qt::NoModifier);
    QCoreApplication::sendEvent(&view, &event);
  }
  /// Two taps, so many ms and pixels apart.
  void tap_twice(QPointF at, quint64 pause, double apart = 0) {
    drag(at, at);
    now += pause;
    drag(at + QPointF(apart, 0), at + QPointF(apart, 0));
  }
  /// The camera has gone around what it looks at, as far from it as before.
  void has_turned() const {
    EXPECT_GT(length(view.camera().eye - start.eye), 0.2 * away(start));
    EXPECT_LT(length(view.camera().target - start.target), 1e-9);
    EXPECT_NEAR(away(view.camera()), away(start), 1e-9 * away(start));
  }
  [[nodiscard]] static double away(const Camera& camera) { return length(camera.eye - camera.target); }

  const QPointF beside{20, 560}, beside_too{220, 560};
  const Camera start = view.camera();
};

TEST_F(PenNavigationTest, ADragBesideTheModelTurns) {
  ASSERT_FALSE(view.hit(beside));
  const QSignalSpy finished(&bridge, &DocumentBridge::strokeFinished);
  drag(beside, beside_too);
  has_turned();
  // The control: on the model it is a stroke, and the camera stays.
  const Camera turned = view.camera();
  ASSERT_TRUE(view.hit(place(0.5)));
  drag(place(0.4), place(0.6));
  EXPECT_TRUE(QTest::qWaitFor([&] { return finished.size() == 1; }, kPatience)) << finished.size();
  EXPECT_EQ(view.camera(), turned);
}

TEST_F(PenNavigationTest, WithSpaceItTurnsOnTheModelToo) {
  const QSignalSpy finished(&bridge, &DocumentBridge::strokeFinished);
  space(QEvent::KeyPress);
  drag(place(0.2), place(0.9));
  space(QEvent::KeyRelease);
  has_turned();
  const Camera turned = view.camera();
  drag(place(0.4), place(0.6));  // the control: without it
  EXPECT_TRUE(QTest::qWaitFor([&] { return !finished.isEmpty(); }, kPatience));
  EXPECT_EQ(finished.size(), 1) << "and none for the first drag";
  EXPECT_EQ(view.camera(), turned);
}

TEST_F(PenNavigationTest, ADoubleTapBesideTheModelShowsAllOfIt) {
  Camera aside = start;  // the ball is to the right, and smaller
  aside.target = aside.target - Vec3d{0.3, 0, 0};
  aside.eye = aside.target + (start.eye - start.target) * 1.2;
  const auto taps = [&](quint64 pause, double apart) {
    view.set_camera(aside);
    tap_twice(beside, pause, apart);
    now += 10'000;
    return view.camera();
  };
  view.set_camera(aside);
  ASSERT_FALSE(view.hit(beside));
  view.frame_all();
  const Camera all = view.camera();
  ASSERT_NE(all, aside);
  EXPECT_EQ(taps(100, 0), all);
  EXPECT_EQ(taps(100, 2), all) << "no hand meets one pixel twice";
  // The controls: too late, too far, on the model, and by another map.
  EXPECT_EQ(taps(2000, 0), aside);
  EXPECT_EQ(taps(100, 40), aside);
  view.set_camera(aside);
  tap_twice(place(0.5), 100);
  EXPECT_EQ(view.camera(), aside);
  view.set_map(NavigationMap::Blender);
  EXPECT_EQ(taps(100, 0), aside);
}

}  // namespace
}  // namespace relief::studio
