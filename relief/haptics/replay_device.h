// A device that plays what another one gave.
#pragma once

#include <relief/haptics/device.h>

#include <cstddef>
#include <vector>

namespace relief {

/// A recorded path as a device: plays readings one per read(), ignores forces, has ended() after the last.
class ReplayDevice final : public HapticDevice {
 public:
  /// Gives the readings in their order, then says that it has ended.
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

}  // namespace relief
