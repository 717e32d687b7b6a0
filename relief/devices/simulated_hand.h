// A device made of equations: a plant (mass, friction, encoder, amplifier, delay) held by a spring-and-damper hand that
// follows a script.
#pragma once

#include <relief/haptics/device.h>

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

namespace relief {

/// The device's body, sensor and amplifier. One axis like the other two.
struct Plant {
  double mass = 0.045;             ///< kg
  double viscous = 0.1;            ///< N*s/m
  double coulomb = 0.26;           ///< N
  double encoder_step = 55e-6;     ///< m; 0 for a perfect sensor
  double max_force = 3.3;          ///< N, saturation of the amplifier
  double slew = 5e3;               ///< N/s
  double dac_step = 0;             ///< N
  double lag = 0.5e-3;             ///< s, first order
  double resonance = 0;            ///< Hz of one structural mode between motor and handle; 0 none
  double resonance_damping = 0.02; ///< share of critical
  int delay_ticks = 0;             ///< 0..3, from command to force
  int substeps = 20;               ///< integration steps per tick, at least 20
};

/// The person: pulls the handle towards a target with a spring and a damper, with tremor.
struct Hand {
  double stiffness = 300;          ///< N/m
  double damping = 3;              ///< N*s/m
  double tremor = 0;               ///< m, amplitude of a 10 Hz shake
};

/// A named plant: "touch-like", "premium-like", "falcon-like", "inverse3-like".
struct PlantPreset {
  std::string_view name;
  Plant plant;
  DeviceInfo info;
};
[[nodiscard]] const std::vector<PlantPreset>& plant_presets();

/// What the hand wants at time t (s): a position in device metres, and the buttons.
struct HandTarget {
  Vec3d position;
  std::uint32_t buttons = 0;
};
using HandScript = std::function<HandTarget(double t)>;

/// Integrates plant and hand over one tick of 1 ms per write(). Deterministic: no clock, no random numbers. The script must
/// not allocate.
class SimulatedHand final : public HapticDevice {
 public:
  SimulatedHand(const PlantPreset& preset, const Hand& hand, HandScript script);
  [[nodiscard]] const DeviceInfo& info() const noexcept override { return info_; }
  [[nodiscard]] bool read(DeviceState& state) noexcept override;
  [[nodiscard]] bool write(Vec3d force) noexcept override;

  /// The true state, for tests: position of the handle, velocity, force on it.
  [[nodiscard]] Vec3d handle_position() const noexcept { return handle_; }
  [[nodiscard]] Vec3d handle_velocity() const noexcept { return handle_velocity_; }
  void set_state(Vec3d position, Vec3d velocity) noexcept;

 private:
  DeviceInfo info_;
  Plant plant_;
  Hand hand_;
  HandScript script_;
  std::uint64_t tick_ = 0;
  Vec3d handle_, handle_velocity_;
  Vec3d motor_, motor_velocity_;   ///< only with a structural mode
  Vec3d amplifier_;                ///< force now at the motor
  std::array<Vec3d, 4> pipeline_{};///< delayed commands
  HandTarget target_;
};

}  // namespace relief
