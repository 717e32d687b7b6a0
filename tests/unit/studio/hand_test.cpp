#include "support/folder.h"
#include "support/shells.h"

#include <relief/session/replay.h>

#include <gtest/gtest.h>
#include <studio/device_panel.h>
#include <studio/hand.h>
#include <studio/hand_overlay.h>
#include <studio/hand_sound.h>
#include <studio/hand_text.h>
#include <studio/panic_keys.h>
#include <studio/text.h>
#include <studio/widgets/plot.h>
#include <studio/widgets/value_bar.h>

#include <QDialog>
#include <QImage>
#include <QLabel>
#include <QLineEdit>
#include <QMenu>
#include <QPainter>
#include <QPushButton>
#include <QSignalSpy>
#include <QTest>
#include <QVBoxLayout>
#include <algorithm>
#include <cmath>
#include <set>

namespace relief::studio {
namespace {

constexpr int kPatience = 20'000;  // ms, on a machine that is busy with other things

/// A ball of radius 1 in a file, open.
class HandTest : public ::testing::Test {
 protected:
  HandTest() {
    open();
    QObject::connect(&hand, &Hand::said, [this](const QString& words) { said.append(words); });
  }
  void open() {
    const auto file = folder / "ball.relief";
    std::filesystem::remove(file);
    Model ball;
    ball.head = Snapshot::make(testing::sphere_shell(2, 16));
    auto made = ModelFile::create(file, ball);
    ASSERT_TRUE(made) << made.error().message;
    ASSERT_TRUE(bridge.open(file, *std::move(made)));
  }
  /// Whether it comes about.
  template <typename Condition>
  [[nodiscard]] static bool comes(Condition&& condition) {
    return QTest::qWaitFor(condition, kPatience);
  }
  [[nodiscard]] double force() const { return length(hand.monitor().last().force); }

  testing::Folder folder;
  DocumentBridge bridge;
  ToolState tools;
  Hand hand{bridge, tools};
  QStringList said;
};

TEST_F(HandTest, TheSimulatedHandTouchesByItselfAndLeavesNoTrace) {
  const std::uint64_t before = bridge.head()->content_hash();
  hand.choose("simulated");
  ASSERT_TRUE(hand.active());
  EXPECT_TRUE(comes([&] { return force() > 0.2; }));
  EXPECT_TRUE(comes([&] { return hand.safety().state == HandState::Touching; }));
  hand.choose("none");
  EXPECT_FALSE(hand.active());
  EXPECT_EQ(bridge.head()->content_hash(), before);
  EXPECT_TRUE(said.isEmpty()) << said.join(' ').toStdString();
}

TEST_F(HandTest, ForcesGoOffAndComeBack) {
  hand.choose("simulated");
  ASSERT_TRUE(comes([&] { return force() > 0.2; }));
  hand.set_forces(false);
  ASSERT_TRUE(comes([&] { return hand.safety().cause == ServoFault::ForcesOff; }));
  EXPECT_EQ(force(), 0);
  EXPECT_EQ(safety_sentence(hand.safety(), !hand.forces()), "Forces are off. You switched them off.");
  hand.set_forces(true);
  EXPECT_TRUE(comes([&] { return force() > 0.2; }));
}

TEST_F(HandTest, ItsSessionEndsBeforeTheDocumentAndBeginsWithTheNext) {
  hand.choose("simulated");
  ASSERT_TRUE(comes([&] { return hand.monitor().taken() > 20; }));
  ASSERT_TRUE(bridge.close());
  EXPECT_FALSE(hand.active());
  EXPECT_EQ(hand.id(), "simulated");
  open();
  EXPECT_TRUE(hand.active());
  EXPECT_TRUE(comes([&] { return hand.monitor().taken() > 20; }));
}

/// Knows where its arm is once it has been asked to look while a person has put it into its place.
class ParkedArm final : public HapticDevice {
 public:
  explicit ParkedArm(const bool& parked) : parked_(parked) { info_.name = "arm"; }
  [[nodiscard]] const DeviceInfo& info() const noexcept override { return info_; }
  [[nodiscard]] DeviceStatus status() const override {
    DeviceStatus status;
    if (!known_) status.calibration = Calibration::ByPerson;
    if (!known_) status.to_do = "put the pen into the inkwell";
    return status;
  }
  [[nodiscard]] Status calibrate(ArmMotion /*motion*/) override {
    known_ = parked_;
    return {};
  }
  [[nodiscard]] bool read(DeviceState& state) noexcept override {
    state.t = 1e-3 * ++ticks_;
    return true;
  }
  [[nodiscard]] bool write(const Wrench& /*wrench*/) noexcept override { return true; }

 private:
  DeviceInfo info_;
  const bool& parked_;
  bool known_ = false;
  int ticks_ = 0;
};

TEST_F(HandTest, ADeviceThatDoesNotKnowWhereItIsIsRefusedWithWhatToDo) {
  bool parked = false;
  hand.open_devices_with([&](const std::string&, const HandScript&) -> Result<std::unique_ptr<HapticDevice>> {
    return std::make_unique<ParkedArm>(parked);
  });
  hand.choose("simulated");
  EXPECT_FALSE(hand.active());
  EXPECT_EQ(said, QStringList{"arm: put the pen into the inkwell"});
  parked = true;
  hand.choose("simulated");
  EXPECT_TRUE(hand.active());
  EXPECT_TRUE(comes([&] { return hand.monitor().taken() > 20; }));
  EXPECT_EQ(said.size(), 1);
}

TEST_F(HandTest, TheMouseProbesWithTheForceOfItsDepth) {
  tools.choose("touch");
  hand.choose("mouse");
  ASSERT_TRUE(hand.probes());
  const Ray3d ray = {{0, 0, 5}, {0, 0, -1}};
  hand.point(ray, false, 0);
  ASSERT_TRUE(comes([&] { return hand.safety().state == HandState::Free; }));
  hand.point(ray, true, 0);
  EXPECT_TRUE(comes([&] { return std::abs(force() - 400 * hand.probe_depth()) < 0.05; })) << force();
  hand.turn_depth(2);
  EXPECT_NEAR(hand.probe_depth(), 3e-3, 1e-9);
  EXPECT_TRUE(comes([&] { return std::abs(force() - 1.2) < 0.05; })) << force();
  hand.set_force_limit(0.5);
  EXPECT_TRUE(comes([&] { return std::abs(force() - 0.5) < 1e-6; })) << force();
  EXPECT_TRUE(comes([&] { return hand.safety().cause == ServoFault::ForceClamped; }));
  hand.leave();
  EXPECT_TRUE(comes([&] { return force() == 0; }));
}

TEST_F(HandTest, ACapBindsTheLimit) {
  hand.choose("simulated");
  EXPECT_NEAR(hand.force_limit(), 3.3, 1e-12);
  hand.set_force_cap(0.6);
  EXPECT_NEAR(hand.force_limit(), 0.6 * 3.3, 1e-12);
  hand.set_force_limit(3);
  EXPECT_NEAR(hand.force_limit(), 0.6 * 3.3, 1e-12);
}

TEST_F(HandTest, WhatIsRecordedIsCheckedAndPlayed) {
  hand.choose("simulated");
  const QString file = text(folder / "hand.rlog");
  hand.record(file);
  ASSERT_TRUE(hand.recording()) << said.join(' ').toStdString();
  ASSERT_TRUE(comes([&] { return hand.monitor().taken() > 400; }));
  hand.stop_recording();
  EXPECT_FALSE(hand.recording());
  EXPECT_TRUE(hand.active());
  auto replay = Replay::open(path(file));
  ASSERT_TRUE(replay) << replay.error().message;
  const auto checked = verify(*replay, bridge.head());
  ASSERT_TRUE(checked);
  EXPECT_TRUE(checked->holds());
  EXPECT_GT(checked->ticks, 400U);
  hand.choose("replay:" + file);
  ASSERT_TRUE(hand.active()) << said.join(' ').toStdString();
  EXPECT_TRUE(comes([&] { return !hand.active(); })) << "it ends";
  EXPECT_EQ(hand.id(), "none");
}

TEST_F(HandTest, ADeviceThatIsNoneIsToldAndNothingRuns) {
  hand.choose("no such device");
  EXPECT_FALSE(hand.active());
  EXPECT_EQ(hand.id(), "none");
  ASSERT_EQ(said.size(), 1);
  EXPECT_TRUE(said.first().contains("no such device"));
  hand.choose("replay:/no/such/file.rlog");
  EXPECT_EQ(said.size(), 2);
}

// ---- The panel

template <typename W>
W* child(QWidget& in, const char* name) {
  return in.findChild<W*>(QString::fromLatin1(name));
}

TEST_F(HandTest, ThePanelShowsFreezesAndScrubs) {
  QMenu devices;
  DevicePanel panel(hand, devices);
  panel.show();
  auto* force_plot = child<PlotView>(panel, "plot-force");
  EXPECT_FALSE(force_plot->isVisible()) << "nothing to plot without a device";
  hand.choose("simulated");
  EXPECT_TRUE(force_plot->isVisible());
  ASSERT_TRUE(comes([&] { return force() > 0.2; }));
  auto* state = child<QLabel>(panel, "hand-state");
  EXPECT_TRUE(comes([&] { return state->text() == "Holding the surface. All is well."; }))
      << state->text().toStdString();
  EXPECT_EQ(state->accessibleDescription(), state->text());
  child<QPushButton>(panel, "hand-freeze")->setChecked(true);
  EXPECT_TRUE(force_plot->frozen());
  const double at = hand.monitor()[hand.monitor().size() / 2].t;
  emit force_plot->scrubbed(at);
  for (const char* other : {"plot-depth", "plot-period", "plot-time"})
    EXPECT_EQ(child<PlotView>(panel, other)->cursor(), at) << "one cursor for all";
  const std::optional<float> period = child<PlotView>(panel, "plot-period")->value_at_cursor();
  ASSERT_TRUE(period);
  EXPECT_GT(*period, 0);
  EXPECT_TRUE(child<QLabel>(panel, "hand-at-cursor")->text().contains(QString::number(at, 'f', 3)));
  emit child<ValueBar>(panel, "force-limit")->valueEdited(1.5);
  EXPECT_EQ(hand.force_limit(), 1.5);
  child<QPushButton>(panel, "hand-forces-off")->setChecked(true);
  EXPECT_FALSE(hand.forces());
  EXPECT_EQ(state->text(), "Forces are off. You switched them off.");
}

TEST_F(HandTest, EachControlOfThePanelHasANameOfItsOwn) {
  QMenu devices;
  DevicePanel panel(hand, devices);
  std::set<QString> names;
  for (const QWidget* each : panel.findChildren<QWidget*>()) {
    const bool control = qobject_cast<const QPushButton*>(each) != nullptr ||
                         qobject_cast<const ValueBar*>(each) != nullptr ||
                         qobject_cast<const PlotView*>(each) != nullptr;
    if (!control) continue;
    EXPECT_FALSE(each->accessibleName().isEmpty()) << each->objectName().toStdString();
    EXPECT_TRUE(names.insert(each->accessibleName()).second) << each->accessibleName().toStdString();
  }
  EXPECT_EQ(names.size(), 14U);
}

// ---- Words, keys, sound, overlay

TEST(HandText, EachCauseHasASentenceOfItsOwn) {
  std::set<QString> sentences;
  for (const ServoFault cause : {ServoFault::DeviceLost, ServoFault::TooFast, ServoFault::SurfaceJumped,
                                 ServoFault::Stalled, ServoFault::Reconnected, ServoFault::ForcesOff,
                                 ServoFault::StartInside, ServoFault::BadPosition, ServoFault::BadTime}) {
    const QString words = safety_sentence({.state = HandState::NoForce, .cause = cause, .lift_off = true}, false);
    EXPECT_TRUE(words.endsWith('.')) << words.toStdString();
    EXPECT_TRUE(sentences.insert(words).second) << words.toStdString();
  }
  for (const ServoFault cause : {ServoFault::ForceClamped, ServoFault::LoadLimited, ServoFault::SpeedLimited,
                                 ServoFault::LateTicks, ServoFault::Uncalibrated})
    EXPECT_TRUE(sentences.insert(safety_sentence({.state = HandState::Limited, .cause = cause}, false)).second);
  EXPECT_EQ(safety_sentence({.state = HandState::NoForce, .cause = ServoFault::TooFast, .lift_off = true}, false),
            "The hand moved too fast; forces are off until you let go.");
  EXPECT_TRUE(alarm_sentence({.cause = ServoFault::StartInside}).isEmpty());
  EXPECT_FALSE(alarm_sentence({.cause = ServoFault::DeviceLost}).isEmpty());
  EXPECT_EQ(alarm_sentence({.cause = ServoFault::Reconnected}),
            "The device answers again; forces come back when you lift off.");
  EXPECT_EQ(alarm_sentence({.cause = ServoFault::Reconnected, .over = true}), "The device answers again.");
}

TEST(HandText, ALossStandsAsLongAsItTakesToRead) {
  const auto words = alarm_sentence({.cause = ServoFault::DeviceLost}).split(' ').size();
  const double seconds = static_cast<double>(words) * 60 / 200;
  EXPECT_GE(SafetyWatch::kSteady, seconds);
  EXPECT_LT(SafetyWatch::kSteady, 2 * seconds) << "nobody waits for nothing";
}

TEST(PanicKeys, PauseAndEscTwiceWhateverHasTheFocus) {
  int off = 0;
  PanicKeys keys([&] { ++off; });
  QWidget window;
  auto* column = new QVBoxLayout(&window);
  auto* field = new QLineEdit(&window);
  column->addWidget(field);
  window.show();
  ASSERT_TRUE(QTest::qWaitForWindowExposed(&window));
  field->setFocus();
  QWindow* const to = window.windowHandle();
  QTest::keyClick(to, Qt::Key_Pause);
  EXPECT_EQ(off, 0) << "not on yet";
  keys.set_on(true);
  QTest::keyClick(to, Qt::Key_Pause);
  EXPECT_EQ(off, 1);
  QTest::keyClick(to, Qt::Key_Escape);
  EXPECT_EQ(off, 1);
  QTest::keyClick(to, Qt::Key_Escape);
  EXPECT_EQ(off, 2);
  QTest::keyClick(to, Qt::Key_Escape);
  QTest::keyClick(to, Qt::Key_A);
  QTest::keyClick(to, Qt::Key_Escape);
  EXPECT_EQ(off, 2) << "another key between them";
  EXPECT_EQ(field->text(), "a") << "the keys still go where they were meant for";
  QDialog dialog(&window);
  dialog.setModal(true);
  dialog.show();
  ASSERT_TRUE(QTest::qWaitForWindowExposed(&dialog));
  QTest::keyClick(dialog.windowHandle(), Qt::Key_Pause);
  EXPECT_EQ(off, 3) << "under a dialog";
  keys.set_on(false);
  QTest::keyClick(to, Qt::Key_Pause);
  EXPECT_EQ(off, 3);
}

TEST(HandSound, GivesWhatTheContactSoundsLikeAndNeedsNoLoudspeaker) {
  HandSound sound;
  sound.set_on(true);
  sound.run(true);
  EXPECT_EQ(sound.wants(), sound.trouble().isEmpty()) << "it plays, or says why not";
  sound.run(false);
  EXPECT_FALSE(sound.wants());
  HandSound quiet;
  for (int k = 0; k < 20; ++k) quiet.tick({.contact = true, .carving = false, .slip = 0.2F, .force = 2});
  const QByteArray bytes = quiet.read(20 * ContactSound::kPerTick * qint64(sizeof(float)));
  ASSERT_EQ(bytes.size(), 20 * ContactSound::kPerTick * qint64(sizeof(float)));
  const auto* samples = reinterpret_cast<const float*>(bytes.constData());
  EXPECT_GT(*std::max_element(samples, samples + 20 * ContactSound::kPerTick), 0.01F);
}

TEST(HandOverlay, PaintsOnlyWithinItsBounds) {
  OverlayView view;
  view.size = QSizeF(400, 300);
  view.camera.eye = {0, 0, 5};
  view.camera.target = {};
  HandOverlay overlay;
  EXPECT_TRUE(overlay.bounds(view).isEmpty());
  int painted = 0;
  for (int k = 0; k < 60; ++k) {
    ServoSample sample;
    sample.cursor = {std::sin(k), 0.7 * std::cos(1.7 * k), 0.5};
    sample.contact = k % 3 != 0;
    sample.contact_point = sample.cursor + Vec3d{0.05, 0.02 * k / 10, 0.1};
    sample.normal = normalized(Vec3d{std::sin(2 * k), 0.3, 1});
    sample.force = sample.normal * (0.1 * k);
    overlay.shown = {.sample = sample, .force_limit = 3, .has_orientation = false};
    QImage image(400, 300, QImage::Format_ARGB32_Premultiplied);
    image.fill(Qt::transparent);
    QPainter painter(&image);
    painter.setRenderHint(QPainter::Antialiasing);
    overlay.paint(painter, view);
    painter.end();
    const QRect allowed = overlay.bounds(view).toAlignedRect();
    for (int y = 0; y < 300; ++y)
      for (int x = 0; x < 400; ++x) {
        if (qAlpha(image.pixel(x, y)) == 0) continue;
        ++painted;
        ASSERT_TRUE(allowed.contains(x, y)) << k << ": " << x << ", " << y;
      }
  }
  EXPECT_GT(painted, 10'000);
}

}  // namespace
}  // namespace relief::studio
