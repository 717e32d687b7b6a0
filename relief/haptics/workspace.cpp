#include <relief/haptics/workspace.h>

#include <algorithm>
#include <cmath>

namespace relief {

Workspace fit_workspace(const DeviceInfo& device, const Box3d& model) noexcept {
  const double size = diagonal(model);
  if (!(size > 0) || !std::isfinite(size)) return {};
  const double room = device.workspace_radius > 0 ? std::min(0.15, 2 * device.workspace_radius) : 0.15;
  return {.metres_per_unit = room / size, .device_origin = {}, .model_origin = model.centre()};
}

}  // namespace relief
