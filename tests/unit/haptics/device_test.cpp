// What a device states of itself, and what the interface promises where a kind of device has nothing to do.
#include <relief/haptics/device.h>
#include <relief/haptics/fault.h>

#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <string>

namespace relief {
namespace {

TEST(DeviceInfo, ItsWorkspaceIsTheBoxOrTheOneAroundTheRadius) {
  DeviceInfo device = {.workspace_radius = 0.04};
  EXPECT_EQ(workspace_of(device).low, (Vec3d{-0.04, -0.04, -0.04}));
  EXPECT_EQ(workspace_of(device).high, (Vec3d{0.04, 0.04, 0.04}));
  device.workspace.add(Vec3d{0, 0.1, 0.2});
  device.workspace.add(Vec3d{0.3, 0.4, 0.5});
  EXPECT_EQ(workspace_of(device).low, (Vec3d{0, 0.1, 0.2}));
  EXPECT_EQ(workspace_of(device).high, (Vec3d{0.3, 0.4, 0.5}));
  for (const double unknown : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_TRUE(workspace_of({.workspace_radius = unknown}).empty());
}

TEST(DeviceInfo, ItsDelayIsTheLongerOneInTicks) {
  EXPECT_EQ(delay_of({}), 0);
  EXPECT_EQ(delay_of({.delay_ticks = 2}), 2);
  EXPECT_EQ(delay_of({.delay = 0.002}), 2);
  EXPECT_EQ(delay_of({.delay = 0.0021}), 3);
  EXPECT_EQ(delay_of({.delay_ticks = 3, .delay = 0.001}), 3);
  EXPECT_EQ(delay_of({.delay = 0.001, .rate = 4000, .pull = false}), 4) << "ticks of a push device are its own";
  EXPECT_EQ(delay_of({.delay = std::numeric_limits<double>::quiet_NaN()}), 0);
}

TEST(DeviceInfo, ATickIsAMillisecondWhereReliefAsks) {
  EXPECT_EQ(tick_of({.rate = 4000}), 1e-3);
  EXPECT_EQ(tick_of({.rate = 4000, .pull = false}), 0.25e-3);
  EXPECT_EQ(tick_of({.rate = 0, .pull = false}), 1e-3) << "not known";
}

TEST(Device, EveryNameIsAWordOfItsOwn) {
  std::set<std::string_view> names;
  for (const auto h : {Handedness::Either, Handedness::Left, Handedness::Right}) names.insert(name(h));
  for (const auto g : {GravityCompensation::Unknown, GravityCompensation::None, GravityCompensation::Device,
                       GravityCompensation::Library})
    names.insert(name(g));
  for (const auto c : {Calibration::Done, Calibration::ByPerson, Calibration::ByArm}) names.insert(name(c));
  for (std::uint32_t b = 1; b <= bit(ServoFault::ForcesOff); b <<= 1U) names.insert(name(static_cast<ServoFault>(b)));
  EXPECT_EQ(names.size(), 3U + 4U + 3U + 21U);
  EXPECT_FALSE(names.contains(""));
}

/// A device that has nothing to open, to calibrate or to switch.
class Plain final : public HapticDevice {
 public:
  const DeviceInfo& info() const noexcept override { return info_; }

 private:
  DeviceInfo info_;
};

TEST(Device, WhatAKindHasNoUseForIsDone) {
  Plain device;
  EXPECT_TRUE(device.open());
  EXPECT_TRUE(device.calibrate(ArmMotion::Forbidden));
  EXPECT_TRUE(device.enable(true));
  const DeviceStatus status = device.status();
  EXPECT_TRUE(status.connected && status.powered && status.forces_on);
  EXPECT_EQ(status.calibration, Calibration::Done);
  EXPECT_EQ(status.to_do + status.force_off + status.trouble, "");
  device.stop();
  device.close();
}

/// Does not know where its arm is, and finds out as its kind has it.
class Lost final : public HapticDevice {
 public:
  explicit Lost(Calibration kind) : kind_(kind) {}
  const DeviceInfo& info() const noexcept override { return info_; }
  Status open() override {
    calls += "open ";
    return opens ? Status() : fail(Errc::DeviceUnavailable, "no device on the bus");
  }
  DeviceStatus status() const override {
    DeviceStatus status;
    status.calibration = known ? Calibration::Done : kind_;
    status.to_do = to_do;
    return status;
  }
  Status calibrate(ArmMotion motion) override {
    calls += motion == ArmMotion::Allowed ? "move " : "look ";
    if (kind_ == Calibration::ByArm && motion == ArmMotion::Forbidden)
      return fail(Errc::InvalidArgument, "arm: would have to move");
    known = finds;
    if (known) to_do.clear();
    return {};
  }
  bool opens = true, finds = true, known = false;
  std::string to_do, calls;

 private:
  DeviceInfo info_ = {.name = "arm"};
  Calibration kind_;
};

TEST(BringUp, ADeviceThatKnowsWhereItIsIsOnlyOpened) {
  Lost device(Calibration::Done);
  EXPECT_TRUE(bring_up(device, ArmMotion::Allowed));
  EXPECT_EQ(device.calls, "open ");
}

TEST(BringUp, AnArmMovesOnlyWhereThatIsAllowed) {
  Lost device(Calibration::ByArm);
  const Status refused = bring_up(device);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "arm: would have to move");
  EXPECT_FALSE(device.known);
  EXPECT_TRUE(make_ready(device, ArmMotion::Allowed));
  EXPECT_EQ(device.calls, "open look move ");
}

TEST(BringUp, WhatAPersonMustDoIsSaidAndOnceItIsDoneTheDeviceIsReady) {
  Lost device(Calibration::ByPerson);
  device.to_do = "put the pen\ninto the inkwell";
  device.finds = false;
  const Status refused = bring_up(device);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::DeviceUnavailable);
  EXPECT_EQ(refused.error().message, "arm: put the pen\\x0ainto the inkwell");
  device.finds = true;
  EXPECT_TRUE(bring_up(device));
  EXPECT_EQ(device.calls, "open look open look ");
}

TEST(BringUp, ADeviceThatIsNoWiserAfterItGetsNoForce) {
  Lost device(Calibration::ByPerson);
  device.finds = false;
  const Status refused = bring_up(device);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("does not know where its arm is"), std::string::npos);
}

TEST(BringUp, WhatAPersonMustDoCountsForADeviceThatKnowsWhereItIs) {
  Lost device(Calibration::Done);
  device.to_do = "switch on its power";
  const Status refused = bring_up(device);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "arm: switch on its power");
}

TEST(BringUp, WhatCannotBeOpenedIsNotAskedToLook) {
  Lost device(Calibration::ByPerson);
  device.opens = false;
  const Status refused = bring_up(device);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().message, "no device on the bus");
  EXPECT_EQ(device.calls, "open ");
}

}  // namespace
}  // namespace relief
