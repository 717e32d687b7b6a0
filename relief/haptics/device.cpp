#include <relief/base/try.h>
#include <relief/haptics/device.h>

#include <algorithm>
#include <cmath>

namespace relief {

std::string_view name(Handedness handedness) noexcept {
  switch (handedness) {
    case Handedness::Either:
      return "either";
    case Handedness::Left:
      return "left";
    case Handedness::Right:
      return "right";
  }
  return "";
}

std::string_view name(GravityCompensation compensation) noexcept {
  switch (compensation) {
    case GravityCompensation::Unknown:
      return "unknown";
    case GravityCompensation::None:
      return "none";
    case GravityCompensation::Device:
      return "device";
    case GravityCompensation::Library:
      return "library";
  }
  return "";
}

std::string_view name(Calibration calibration) noexcept {
  switch (calibration) {
    case Calibration::Done:
      return "done";
    case Calibration::ByPerson:
      return "by a person";
    case Calibration::ByArm:
      return "by moving the arm";
  }
  return "";
}

Status make_ready(HapticDevice& device, ArmMotion motion) {
  const bool asks = device.status().calibration != Calibration::Done;
  const Status calibrated = asks ? device.calibrate(motion) : Status();
  const DeviceStatus now = device.status();
  const std::string name = printable(device.info().name);
  // Its own sentence goes before what a call was refused with.
  if (!now.to_do.empty()) return fail(Errc::DeviceUnavailable, name + ": " + printable(now.to_do, 300));
  if (!calibrated || now.calibration == Calibration::Done) return calibrated;
  return fail(Errc::DeviceUnavailable,
              name + ": does not know where its arm is, so it gets no force; calibrate it with its maker's program");
}

Status bring_up(HapticDevice& device, ArmMotion motion) {
  RELIEF_CHECK(device.open());
  return make_ready(device, motion);
}

Box3d workspace_of(const DeviceInfo& device) noexcept {
  if (!device.workspace.empty()) return device.workspace;
  Box3d box;
  if (const double r = device.workspace_radius; r > 0 && std::isfinite(r)) {
    box.add(Vec3d{-r, -r, -r});
    box.add(Vec3d{r, r, r});
  }
  return box;
}

double tick_of(const DeviceInfo& device) noexcept {
  constexpr double kTick = 1e-3;  // s
  return device.pull || !(device.rate >= 1 && device.rate <= 1e6) ? kTick : 1 / device.rate;
}

int delay_of(const DeviceInfo& device) noexcept {
  // A hair less, so that 2 ms are two ticks of 1 ms and not three.
  const double ticks = std::ceil(device.delay / tick_of(device) - 1e-9);
  return std::max(device.delay_ticks, ticks > 0 ? static_cast<int>(std::min(ticks, 1e3)) : 0);
}

}  // namespace relief
