// How a device's workspace lies over the model.
#pragma once

#include <relief/haptics/device.h>

namespace relief {

/// model = (device - device_origin) / metres_per_unit + model_origin. Axes are the same: no rotation.
struct Workspace {
  double metres_per_unit = 1;
  Vec3d device_origin = {};  ///< m
  Vec3d model_origin = {};   ///< model units
  [[nodiscard]] Vec3d to_model(Vec3d device) const noexcept {
    return (device - device_origin) / metres_per_unit + model_origin;
  }
  [[nodiscard]] Vec3d to_device(Vec3d model) const noexcept {
    return (model - model_origin) * metres_per_unit + device_origin;
  }
};
/// The model's diagonal becomes 0.15 m (or what fits the device), its centre the device's origin.
[[nodiscard]] Workspace fit_workspace(const DeviceInfo& device, const Box3d& model) noexcept;

}  // namespace relief
