#include <relief/haptics/replay_device.h>

#include <utility>

namespace relief {

ReplayDevice::ReplayDevice(DeviceInfo info, std::vector<DeviceState> readings)
    : info_(std::move(info)), readings_(std::move(readings)) {}

DeviceStatus ReplayDevice::status() const {
  return {.connected = true, .powered = true, .to_do = {}, .force_off = "a recording feels no force", .trouble = {}};
}

bool ReplayDevice::read(DeviceState& state) noexcept {
  if (next_ == readings_.size()) return false;
  state = readings_[next_++];
  return true;
}

bool ReplayDevice::write(const Wrench& /*wrench*/) noexcept { return true; }

}  // namespace relief
