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

}  // namespace
}  // namespace relief
