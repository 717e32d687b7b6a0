// How a device's workspace lies over the model.
#pragma once

#include <relief/core/model.h>
#include <relief/haptics/device.h>

#include <string_view>

namespace relief {

/// model = rotation * (device - device_origin) / metres_per_unit + model_origin.
struct Workspace {
  double metres_per_unit = 1;  ///< m at the device per model unit
  Vec3d device_origin = {};    ///< m
  Vec3d model_origin = {};     ///< model units
  Quatd rotation = {};         ///< unit, but in settings of any length; from the device's axes to the model's

  /// From device coordinates, m, to the model.
  [[nodiscard]] Vec3d to_model(Vec3d device) const noexcept {
    return turned_to_model(device - device_origin) / metres_per_unit + model_origin;
  }
  /// From the model to device coordinates, m.
  [[nodiscard]] Vec3d to_device(Vec3d model) const noexcept {
    return turned_to_device((model - model_origin) * metres_per_unit) + device_origin;
  }
  /// Returns what has a direction and its own unit (a force, a velocity, a turn) along the other's axes.
  [[nodiscard]] Vec3d turned_to_model(Vec3d device) const noexcept {
    return rotation == Quatd{} ? device : rotation.turn(device);
  }
  /// Returns a direction of the model, as the device has it.
  [[nodiscard]] Vec3d turned_to_device(Vec3d model) const noexcept {
    return rotation == Quatd{} ? model : rotation.conjugate().turn(model);
  }
  /// From the tool's frame to the device's, or to the model's.
  [[nodiscard]] Quatd orientation_to_model(Quatd device) const noexcept {
    return rotation == Quatd{} ? device : rotation * device;
  }
  /// From the model's axes to the device's; the fingers have none.
  [[nodiscard]] Wrench command_to_device(const Wrench& model) const noexcept {
    return {turned_to_device(model.force), turned_to_device(model.torque), model.gripper};
  }
  /// Returns the same with such a device origin that `device` lies at `model`.
  [[nodiscard]] Workspace through(Vec3d device, Vec3d model) const noexcept {
    Workspace moved = *this;
    moved.device_origin = device - turned_to_device((model - model_origin) * metres_per_unit);
    return moved;
  }
  /// Returns the same with a rotation of unit length; one that leads nowhere where there is none.
  [[nodiscard]] Workspace with_unit_rotation() const noexcept;
  friend bool operator==(const Workspace&, const Workspace&) noexcept = default;
};

/// The model lies in the middle of the device's workspace, its diagonal 0.15 m long, or what fits: into the box
/// along each axis, or into the ball of the radius. `model` is its box; `size` its diagonal, where that is known better
/// than by the box; `rotation` as in Workspace.
[[nodiscard]] Workspace fit_workspace(const DeviceInfo& device, const Box3d& model, double size = 0,
                                      Quatd rotation = {}) noexcept;

/// Returns the same for a model, whose scan may say how large it is; at the given scale where that is above 0.
[[nodiscard]] Workspace fit_workspace(const DeviceInfo& device, const Model& model, double metres_per_unit = 0,
                                      Quatd rotation = {}) noexcept;

/// Returns the rotation that a map of axes means: for x, y and z of the model, the device's axis that it is, with a
/// minus sign where it runs the other way. "x,y,z" turns nothing; with "y,-x,z" a hand that goes up goes along the
/// model's x. Errors: InvalidArgument for a bad map or a mirror.
[[nodiscard]] Result<Quatd> rotation_of_axes(std::string_view map);

}  // namespace relief
