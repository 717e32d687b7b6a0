// A servo that is led along places in the model, and models whose answer is known in closed form.
#pragma once

#include "support/shells.h"

#include <relief/haptics/servo.h>

namespace relief::testing {

/// A device so strong that no limit is in the way of the bare law.
inline DeviceInfo strong_device() {
  return {.name = "strong",
          .max_force = 1e3,
          .max_stiffness = 1e5,
          .max_damping = 100,
          .max_force_rate = 1e9,
          .workspace_radius = 0};
}

/// Without the guard, which stands between the law and the motor.
inline ServoSettings settings_with(double stiffness, double damping = 0, double friction = 0,
                                   double metres_per_unit = 0.1) {
  return {.workspace = {.metres_per_unit = metres_per_unit},
          .force = {.stiffness = stiffness, .damping = damping, .friction = friction, .guard = false}};
}

/// Drives a servo along cursor positions in model units, 1 ms apart.
class Driver {
 public:
  Driver(const ServoSettings& settings, const DeviceInfo& device) : servo_(settings, device) {}
  ServoSample at(const Snapshot& model, Vec3d cursor, double dt = 1e-3) { return at(model, cursor, Quatd{}, dt); }
  ServoSample at(const Snapshot& model, Vec3d cursor, Quatd orientation, double dt = 1e-3) {
    t_ += dt;
    DeviceState state;
    state.t = t_;
    state.position = servo_.settings().workspace.to_device(cursor);
    state.orientation = orientation;
    state.has_orientation = true;
    return servo_.step(model, state);
  }
  /// In the newest model, but as the servo's thread does: while a tool looks around, the model is the one that it looks
  /// around in.
  ServoSample at(const SnapshotPtr& newest, Vec3d cursor) {
    if (!model_ || !servo_.is_looking()) model_ = newest;
    return at(*model_, cursor);
  }
  /// The model of that tick.
  [[nodiscard]] const SnapshotPtr& seen() const { return model_; }
  Servo& servo() { return servo_; }

 private:
  Servo servo_;
  SnapshotPtr model_;
  double t_ = 0;
};

/// A snapshot whose surface is where field(p) is 0: below 0 inside, so that it grows along every fibre.
template <typename Field>
SnapshotPtr shaped(const std::shared_ptr<const SlabMesh>& mesh, Field&& field) {
  SnapshotDraft draft(Snapshot::make(mesh));
  for (SlabId s = 0; s < mesh->slab_count(); ++s) {
    const int n = mesh->intervals(s);
    const SlabCorners corners = mesh->corners(s);
    Tile& tile = draft.edit(Layer::Displacement, s);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) {
        const auto w = weights(n, {i, j});
        const std::array<double, 3> b = {double(w[0]) / n, double(w[1]) / n, double(w[2]) / n};
        double low = 0, high = 1;
        for (int step = 0; step < 40; ++step) {
          const double middle = (low + high) / 2;
          (field(corners.point(b, middle)) < 0 ? low : high) = middle;
        }
        tile.plane()[sample_index(n, {i, j})] = static_cast<float>((low + high) / 2);
      }
    constrain(*mesh, Layer::Displacement, s, tile);
  }
  return draft.finish();
}

/// Below 0 inside a sphere of radius 1 around `centre`.
inline auto sphere_field(Vec3d centre = {}) {
  return [centre](Vec3d p) { return length(p - centre) - 1; };
}
/// Below 0 inside the tube of torus_shell().
inline double torus_field(Vec3d p) { return std::hypot(std::hypot(p.x, p.z) - 2, p.y) - 0.8; }

/// The sphere of radius 1, sampled finely.
inline SnapshotPtr fine_sphere() { return shaped(sphere_shell(2, 64), sphere_field()); }

/// The plane y = 0.
inline SnapshotPtr flat_plane(int cells = 4, int n = 8) {
  return displaced(plane_shell(cells, n), [](Vec3d) { return 0.5; });
}

}  // namespace relief::testing
