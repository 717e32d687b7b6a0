// Devices by name.
#pragma once

#include <relief/core/snapshot.h>
#include <relief/devices/simulated_hand.h>
#include <relief/haptics/device.h>
#include <relief/haptics/replay_device.h>
#include <relief/haptics/servo.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace relief {

/// What is claimed of a kind of device.
enum class Evidence : std::uint8_t {
  Simulated,       ///< it is made of equations, or of a recording
  ContractTested,  ///< against a fake of ours, made after public documents; never run on hardware
  FieldTested      ///< on the device itself
};
[[nodiscard]] std::string_view name(Evidence evidence) noexcept;

/// Holds what open_device() can open.
struct DeviceListing {
  std::string name;                         ///< what open_device() takes
  std::string description;                  ///< one sentence for people
  Evidence evidence = Evidence::Simulated;  ///< how it has been tried
  DeviceInfo info = {};                     ///< its limits, as far as they are known before it is opened
};
[[nodiscard]] std::vector<DeviceListing> list_devices();

/// "sim:hand", "sim:hand:PRESET", or "sim:hand:FILE.json" with the figures of plant, limits and hand in a file
/// (docs/reference/csv.md). `script` is what the simulated hand does. Errors: NotFound, listing the known
/// names, or of the file; Io; Corrupt, naming the figure that is wrong.
[[nodiscard]] Result<std::unique_ptr<HapticDevice>> open_device(std::string_view name, HandScript script);

/// Returns the default script for a model nobody scripted: presses and strokes all over its surface, the first one
/// within a second, with `buttons` down while the hand is pressed in. Where a side has nothing that can be pressed for
/// sure (a hole, a rim, something thin) it goes to one that has. It knows the surface as it is now. Cost: 1 to 150 ms.
[[nodiscard]] HandScript exploring_hand(const Snapshot& model, const Workspace& workspace, std::uint32_t buttons = 0);

}  // namespace relief
