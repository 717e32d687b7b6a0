// A device made of equations: a plant (mass, friction, encoder, amplifier, delay) held by a spring-and-damper hand that
// follows a script.
#pragma once

#include <relief/haptics/device.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

namespace relief {

/// The device's body, sensor and amplifier. One axis like the other two.
struct Plant {
  double mass = 0.045;              ///< kg
  double viscous = 0.1;             ///< N*s/m
  double coulomb = 0.26;            ///< N
  double encoder_step = 55e-6;      ///< m; 0 for a perfect sensor
  double max_force = 3.3;           ///< N, saturation of the amplifier
  double slew = 5e3;                ///< N/s; 0 for an amplifier without a limit, likewise for dac_step and lag
  double dac_step = 0;              ///< N
  double lag = 0.5e-3;              ///< s, first order
  double resonance = 0;             ///< Hz of one structural mode between motor and handle, half the mass each; 0 none
  double resonance_damping = 0.02;  ///< share of critical
  int delay_ticks = 0;              ///< 0..3, from command to force
  /// 0..3 extra ticks of delay, one per command, repeated; the amplifier holds the newest command that has arrived.
  std::vector<std::uint8_t> jitter = {};
  double watchdog = 5e-3;  ///< s without a command, after which the firmware commands zero; 0 none
  /// s: from when on, and for how long, it does not answer
  double silent_at = 0, silent_for = 0;
  int substeps = 20;  ///< integration steps per tick, at least 20
};

/// The person: pulls the handle towards a target with a spring, and damps its motion, with tremor.
struct Hand {
  double stiffness = 300;  ///< N/m
  double damping = 3;      ///< N*s/m against the ground, so that a target may jump
  double max_force = 1.5;  ///< N, how hard the spring pulls at most, wherever the target is
  double tremor = 0;       ///< m, amplitude of a 10 Hz shake
  /// N: an adversary that draws energy out of the contact. Along the line in which the motor pushes, and while it does,
  /// the hand pushes on with so much at most: in where the handle goes in, out where it comes out.
  double pump = 0;
};

/// A named plant: "touch-like", "premium-like", "falcon-like", "inverse3-like".
struct PlantPreset {
  std::string_view name;  ///< what --plant calls it
  Plant plant;            ///< its mechanics
  DeviceInfo info;        ///< what such a device says of itself
};
[[nodiscard]] const std::vector<PlantPreset>& plant_presets();

/// Holds what the hand wants at time t (s): a position in device metres, and the buttons.
struct HandTarget {
  Vec3d position;             ///< where the hand wants to be, m
  std::uint32_t buttons = 0;  ///< those that are down, a bit each
};
using HandScript = std::function<HandTarget(double t)>;

/// Work since the start, J, each done on the moving parts (so the two losses are negative or zero). Their sum is what
/// the kinetic energy and the energy in the structure have gained.
struct WorkDone {
  double motor = 0;  ///< inertia of the motor, kg
  double hand = 0;   ///< of the hand, kg
  /// structure: its damper only
  double viscous = 0, coulomb = 0, structure = 0;
};

/// Integrates plant and hand over one tick of 1 ms per write(). Deterministic: no clock, no random numbers. The script
/// must not allocate.
class SimulatedHand final : public HapticDevice {
 public:
  /// A device of such a kind in such a hand; the script says where the hand wants to be.
  SimulatedHand(const PlantPreset& preset, const Hand& hand, HandScript script);
  [[nodiscard]] const DeviceInfo& info() const noexcept override { return info_; }
  /// It is open, with its forces on, from the start; after close() this switches it on again, with its forces off.
  [[nodiscard]] Status open() override;
  [[nodiscard]] DeviceStatus status() const override;
  /// Off: the motor gives no force, whatever is commanded.
  [[nodiscard]] Status enable(bool forces) override;
  /// From then on it does not answer.
  void close() noexcept override;
  [[nodiscard]] bool read(DeviceState& state) noexcept override;
  /// Three axes: no torque is felt.
  [[nodiscard]] bool write(const Wrench& wrench) noexcept override;

  /// A tick of 1 ms in which no command comes: the last one is held until the watchdog bites.
  void idle() noexcept;

  /// Returns the true state, for tests and reports.
  [[nodiscard]] Vec3d handle_position() const noexcept { return handle_.at; }
  /// Of the handle, m/s.
  [[nodiscard]] Vec3d handle_velocity() const noexcept { return handle_.velocity; }
  /// N, what the motor pushes with now, after delay and amplifier.
  [[nodiscard]] Vec3d motor_force() const noexcept { return amplifier_; }
  /// Work since the start, J.
  [[nodiscard]] const WorkDone& work() const noexcept { return work_; }
  /// J, kinetic and in the structure's spring.
  [[nodiscard]] double energy() const noexcept;
  /// Puts the handle there; motor and structure at rest relative to it.
  void set_state(Vec3d position, Vec3d velocity) noexcept;

 private:
  struct Body {
    Vec3d at, velocity;
  };
  struct Command {
    Vec3d force;
    std::uint64_t arrives = 0;  ///< tick
  };
  /// Returns whether its plant has it not answer in this tick.
  [[nodiscard]] bool silent() const noexcept;
  /// One tick with this command.
  void advance(Vec3d force) noexcept;
  void amplify(Vec3d command) noexcept;
  void move(Vec3d target) noexcept;
  [[nodiscard]] Vec3d pumping() const noexcept;
  [[nodiscard]] Vec3d target_at(double t, std::uint32_t& buttons) const noexcept;

  /// Any thread may ask for these; on the heap, so that a hand can be moved.
  struct Switches {
    std::atomic<bool> open{true}, forces{true}, silent{false};
  };

  DeviceInfo info_;
  std::unique_ptr<Switches> switches_ = std::make_unique<Switches>();
  Plant plant_;
  Hand hand_;
  HandScript script_;
  double step_ = 0;                 ///< s, one sub-step
  double lag_share_ = 1;            ///< of the way that the amplifier goes in one sub-step
  double spring_ = 0, damper_ = 0;  ///< the structure's, N/m and N*s/m
  std::uint64_t tick_ = 0;
  Body handle_, motor_;                ///< equal without a structural mode
  Vec3d slewed_, amplifier_;           ///< N, after the slew limit, and after the lag
  std::array<Command, 8> pipeline_{};  ///< ring of the last commands, by tick
  Vec3d held_;                         ///< N, the newest command that has arrived
  std::uint64_t held_tick_ = 0;        ///< when it was given
  Vec3d commanded_;                    ///< N, by the last write()
  int silent_ = 0;                     ///< ticks without a command, in a row
  Vec3d target_;
  std::uint32_t buttons_ = 0;
  WorkDone work_;
};

}  // namespace relief
