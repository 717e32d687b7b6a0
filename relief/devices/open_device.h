// Devices by name.
#pragma once

#include <relief/core/snapshot.h>
#include <relief/devices/simulated_hand.h>
#include <relief/haptics/device.h>
#include <relief/haptics/servo.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace relief {

/// A recorded path as a device: plays readings one per read(), ignores forces, has ended() after the last.
class ReplayDevice final : public HapticDevice {
 public:
  ReplayDevice(DeviceInfo info, std::vector<DeviceState> readings);
  [[nodiscard]] const DeviceInfo& info() const noexcept override { return info_; }
  /// Its forces are never on: nobody is there.
  [[nodiscard]] DeviceStatus status() const override;
  [[nodiscard]] bool read(DeviceState& state) noexcept override;
  [[nodiscard]] bool ended() const noexcept override { return next_ == readings_.size(); }
  [[nodiscard]] bool write(const Wrench& wrench) noexcept override;

 private:
  DeviceInfo info_;
  std::vector<DeviceState> readings_;
  std::size_t next_ = 0;
};

/// What is claimed of a kind of device.
enum class Evidence : std::uint8_t {
  Simulated,       ///< it is made of equations, or of a recording
  ContractTested,  ///< against a fake of ours, made after public documents; never run on hardware
  FieldTested      ///< on the device itself
};
[[nodiscard]] std::string_view name(Evidence evidence) noexcept;

struct DeviceListing {
  std::string name;  ///< what open_device() takes
  std::string description;
  Evidence evidence = Evidence::Simulated;
  DeviceInfo info = {};
};
[[nodiscard]] std::vector<DeviceListing> list_devices();

/// "sim:hand", "sim:hand:PRESET", or "sim:hand:FILE.json" with the figures of plant, limits and hand in a file
/// (docs/command-line.md). `script` is what the simulated hand does. Errors: NotFound, listing the known names, or of
/// the file; Io; Corrupt, naming the figure that is wrong.
[[nodiscard]] Result<std::unique_ptr<HapticDevice>> open_device(std::string_view name, HandScript script);

/// The default script for a model nobody scripted: presses and strokes all over its surface, the first one within a
/// second. It knows the surface as it is now.
[[nodiscard]] HandScript exploring_hand(const Snapshot& model, const Workspace& workspace);

}  // namespace relief
