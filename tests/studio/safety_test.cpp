// What takes the force away: switched off, a device that is lost, a hand that is too fast. A device that does such
// things is made up, for the simulated hand never fails; the window and all that is behind it are the studio's own.
#include "opened.h"
#include "support/folder.h"
#include "support/shells.h"

#include <gtest/gtest.h>
#include <studio/accessible.h>
#include <studio/desktop_scheme.h>
#include <studio/hand.h>
#include <studio/main_window.h>
#include <studio/text.h>
#include <studio/widgets/banner.h>
#include <studio/widgets/value_bar.h>

#include <QAccessible>
#include <QAction>
#include <QLabel>
#include <QPushButton>
#include <QSettings>
#include <QSignalSpy>
#include <QTest>
#include <atomic>
#include <memory>
#include <utility>

namespace relief::studio {
namespace {

constexpr int kPatience = 20'000;  // ms, on a machine that is busy with other things

/// What the test and the device tell each other. Numbers of readings count from 1.
struct Wire {
  // What is to happen, once there is a force.
  std::atomic<bool> jump{false};   ///< a reading is far from the one before
  std::atomic<bool> lost{false};   ///< the device does not answer
  std::atomic<bool> flaps{false};  ///< it does not for five readings of forty
  std::atomic<bool> gone{false};   ///< nothing will ever come again; at once
  std::atomic<bool> off{false};    ///< there is no force to wait for
  // What has happened.
  std::atomic<std::uint64_t> readings{0};  ///< so many were given, or refused
  std::atomic<std::uint64_t> felt{0};      ///< number of the last one to which a force was commanded
  std::atomic<std::uint64_t> fault{0};     ///< number of the one that jumped, or was the first to be refused
  std::atomic<double> force{0};            ///< N, commanded last
  std::atomic<double> force_at_fault{-1};  ///< N, commanded to the reading of the fault; -1: none was commanded
};

/// A simulated hand that can fail.
class FailingDevice : public HapticDevice {
 public:
  FailingDevice(std::unique_ptr<HapticDevice> hand, std::shared_ptr<Wire> wire)
      : hand_(std::move(hand)), wire_(std::move(wire)) {}
  [[nodiscard]] const DeviceInfo& info() const noexcept override { return hand_->info(); }
  [[nodiscard]] Status open() override { return hand_->open(); }
  [[nodiscard]] DeviceStatus status() const override { return hand_->status(); }
  [[nodiscard]] Status enable(bool forces) override { return hand_->enable(forces); }
  [[nodiscard]] bool read(DeviceState& state) noexcept override {
    const std::uint64_t number = ++wire_->readings;
    const bool felt = wire_->force > 0;
    if ((wire_->lost || (wire_->flaps && number % 40 < 5)) && (felt || refuses_ || wire_->off)) {
      if (!std::exchange(refuses_, true)) wire_->fault = number;
      return false;
    }
    refuses_ = false;
    if (!hand_->read(state)) return false;
    if (felt && wire_->jump.exchange(false)) {
      state.position.x += 0.05;  // m within a millisecond: no hand does that
      wire_->fault = number;
    }
    return true;
  }
  [[nodiscard]] bool ended() const noexcept override { return wire_->gone; }
  [[nodiscard]] bool write(const Wrench& wrench) noexcept override {
    const double force = length(wrench.force);
    const std::uint64_t number = wire_->readings;
    wire_->force = force;
    if (force > 0) wire_->felt = number;
    if (wire_->fault == number) wire_->force_at_fault = force;
    return hand_->write(wrench);
  }

 private:
  std::unique_ptr<HapticDevice> hand_;
  std::shared_ptr<Wire> wire_;
  bool refuses_ = false;
};

class SafetyTest : public ::testing::Test {
 protected:
  SafetyTest() {
    install_accessibility();
    window.resize(1200, 800);
    hand().open_devices_with(
        [wire = wire](const std::string& name, HandScript script) -> Result<std::unique_ptr<HapticDevice>> {
          // Five times as nimble as people want to see it.
          auto made = open_device(name, [script](double t) { return script ? script(5 * t) : HandTarget{}; });
          if (!made) return made;
          return std::make_unique<FailingDevice>(*std::move(made), wire);
        });
    open_in(window, folder, testing::sphere_shell(2, 16));
    window.use_device("simulated");
    EXPECT_TRUE(touches());
  }

  template <typename Condition>
  [[nodiscard]] static bool comes(Condition&& condition) {
    return QTest::qWaitFor(condition, kPatience);
  }
  [[nodiscard]] Hand& hand() { return *window.findChild<Hand*>(); }
  [[nodiscard]] Banner& banner() { return *window.findChild<Banner*>(); }
  [[nodiscard]] QString status() { return window.findChild<QLabel*>("status")->accessibleDescription(); }
  /// A force is commanded to a reading that is still to come.
  [[nodiscard]] bool touches() {
    const std::uint64_t now = wire->readings;
    return comes([&] { return wire->felt > now; });
  }
  void is_alert(const QString& words) {
    ASSERT_TRUE(comes([&] { return !banner().isHidden() && banner().accessibleName() == words; }))
        << banner().accessibleName().toStdString();
    EXPECT_TRUE(banner().isVisible());
    EXPECT_EQ(QAccessible::queryAccessibleInterface(&banner())->role(), QAccessible::AlertMessage);
    const auto* label = banner().findChild<QLabel*>("banner.words");
    ASSERT_NE(label, nullptr);
    EXPECT_EQ(label->text(), words);
    EXPECT_EQ(status(), words);
  }
  /// Whether forces are back by then depends on where the hand was.
  void answers_again() {
    ASSERT_TRUE(comes([&] { return banner().accessibleName().startsWith("The device answers again"); }));
    is_alert(banner().accessibleName());
  }
  /// No reading of `ticks` that follow is answered with a force, from `first` on.
  void stays_off(std::uint64_t first, std::uint64_t ticks = 50) {
    ASSERT_TRUE(comes([&] { return wire->readings >= first + ticks; }));
    EXPECT_LT(wire->felt, first);
  }
  void press(const QString& name) {
    QPushButton* found = nullptr;
    ASSERT_TRUE(comes([&] {
      for (auto* button : banner().findChildren<QPushButton*>())
        if (button->isVisible() && button->text() == name) found = button;
      return found != nullptr;
    })) << name.toStdString();
    found->click();
  }

  testing::Folder folder;
  QSettings settings{text(folder / "studio.conf"), QSettings::IniFormat};
  DesktopScheme desktop;
  std::shared_ptr<Wire> wire = std::make_shared<Wire>();
  MainWindow window{settings, desktop};
};

TEST_F(SafetyTest, AHandThatTouchesAlarmsNobody) {
  const std::uint64_t begun = wire->readings;
  ASSERT_TRUE(comes([&] { return wire->readings > begun + 300; }));
  EXPECT_TRUE(touches());
  EXPECT_TRUE(banner().isHidden());
}

TEST_F(SafetyTest, ForcesThatAreSwitchedOff) {
  ASSERT_TRUE(comes([&] { return wire->force > 0; }));
  window.findChild<QAction*>("forces-off")->trigger();
  // The tick that is being worked on may have its force; from the next one on there is none.
  const std::uint64_t off = wire->readings + 1;
  is_alert("Forces are off. You switched them off.");
  stays_off(off);
  press("Forces on again");
  EXPECT_TRUE(banner().isHidden());
  EXPECT_TRUE(touches());
}

TEST_F(SafetyTest, TheMostForceOfThePreferencesHoldsAtOnce) {
  const double devices = hand().most_force();
  ASSERT_GT(devices, 0);
  window.findChild<QAction*>("preferences")->trigger();
  auto* most = window.findChild<ValueBar*>("forces-most");
  ASSERT_NE(most, nullptr);
  const auto choose = [&](double share) {
    most->set_real_value(share);
    emit most->editFinished();
  };
  choose(0.1);
  EXPECT_DOUBLE_EQ(hand().most_force(), 0.1 * devices);
  EXPECT_DOUBLE_EQ(hand().force_limit(), 0.1 * devices);
  const std::uint64_t capped = wire->readings + 2;
  for (int k = 0; k < 200; ++k) {
    ASSERT_TRUE(comes([&] { return wire->readings > capped + std::uint64_t(k); }));
    EXPECT_LE(wire->force, 0.1 * devices * (1 + 1e-9));
  }
  hand().set_force_limit(0.05 * devices);
  choose(1);
  EXPECT_DOUBLE_EQ(hand().force_limit(), 0.05 * devices) << "what the panel had set";
  hand().set_force_limit(0.3 * devices);
  choose(0.1);
  EXPECT_DOUBLE_EQ(hand().force_limit(), 0.1 * devices);
  choose(1);
  EXPECT_DOUBLE_EQ(hand().force_limit(), 0.3 * devices) << "a cap below it is no reason to forget it";
  hand().set_force_limit(devices);
  EXPECT_DOUBLE_EQ(hand().force_limit(), devices);
}

TEST_F(SafetyTest, AHandThatIsTooFast) {
  wire->jump = true;
  is_alert("The hand moved too fast; forces are off until you let go.");
  EXPECT_EQ(wire->force_at_fault, 0);
  // It lifts off by and by, and then feels again.
  EXPECT_TRUE(touches());
  EXPECT_FALSE(banner().isHidden()) << "it stays until somebody has read it";
  press("I have read it");
  EXPECT_TRUE(banner().isHidden());
}

TEST_F(SafetyTest, ADeviceThatIsLostAndAnswersAgain) {
  wire->lost = true;
  is_alert("The device does not answer; it is tried again.");
  EXPECT_EQ(wire->force_at_fault, 0) << "an explicit zero";
  stays_off(wire->fault);
  wire->lost = false;
  answers_again();
  EXPECT_TRUE(touches());
}

TEST_F(SafetyTest, ALineThatComesAndGoesAlarmsOnce) {
  const QSignalSpy told(&hand(), &Hand::alarm);
  wire->off = wire->flaps = true;
  const std::uint64_t begun = wire->readings;
  ASSERT_TRUE(comes([&] { return wire->readings > begun + 1000; }));
  is_alert("The device does not answer; it is tried again.");
  EXPECT_EQ(told.size(), 1) << "though it was lost 25 times";
  wire->off = wire->flaps = false;
  answers_again();
  EXPECT_EQ(told.size(), 2);
}

TEST_F(SafetyTest, ADeviceThatIsLostForGood) {
  wire->gone = true;
  is_alert("The device is lost. Choose it again once it answers.");
  EXPECT_FALSE(hand().active());
  EXPECT_EQ(wire->force, 0);
  wire->gone = false;
  window.use_device("simulated");
  EXPECT_TRUE(banner().isHidden()) << "it is chosen again";
  EXPECT_TRUE(touches());
}

TEST_F(SafetyTest, ARecordingThatIsPlayedIsAnotherSession) {
  const QString file = text(folder / "hand.rlog");
  hand().record(file);
  ASSERT_TRUE(hand().recording());
  ASSERT_TRUE(touches());
  hand().stop_recording();
  wire->jump = true;
  is_alert("The hand moved too fast; forces are off until you let go.");
  window.findChild<QPushButton*>("hand-play")->click();
  EXPECT_EQ(hand().id(), "replay:" + file);
  EXPECT_TRUE(banner().isHidden()) << banner().accessibleName().toStdString();
}

TEST_F(SafetyTest, ForcesThatAreSwitchedOffCoverNoAlarm) {
  wire->jump = true;
  is_alert("The hand moved too fast; forces are off until you let go.");
  for (int k = 0; k < 2; ++k) {
    window.findChild<QAction*>("forces-off")->trigger();
    EXPECT_EQ(banner().accessibleName(), "The hand moved too fast; forces are off until you let go.");
    EXPECT_EQ(status(), "Forces are off. You switched them off.");
    if (k == 0) window.findChild<QAction*>("forces-on")->trigger();
  }
  press("I have read it");
  EXPECT_EQ(banner().accessibleName(), "Forces are off. You switched them off.");
  press("Forces on again");
  EXPECT_TRUE(banner().isHidden());
}

TEST_F(SafetyTest, OneThatIsSwitchedOnAgainHidesNoOther) {
  window.findChild<QAction*>("forces-off")->trigger();
  is_alert("Forces are off. You switched them off.");
  wire->off = wire->lost = true;
  is_alert("The device does not answer; it is tried again.");
  window.findChild<QAction*>("forces-on")->trigger();
  EXPECT_EQ(banner().accessibleName(), "The device does not answer; it is tried again.");
  EXPECT_FALSE(banner().isHidden());
  press("I have read it");
  EXPECT_TRUE(banner().isHidden());
}

}  // namespace
}  // namespace relief::studio
