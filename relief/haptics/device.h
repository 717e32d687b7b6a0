// What Relief knows about a haptic device, and how it talks to one. SI units, axes x right, y up, z towards the user.
#pragma once

#include <relief/base/error.h>
#include <relief/base/vec.h>

#include <cstdint>
#include <string>

namespace relief {

/// Nominal limits; user settings never exceed them.
struct DeviceInfo {
  std::string name = {};
  double max_force = 3.3;           ///< N
  double max_stiffness = 1250;      ///< N/m
  double max_damping = 4;           ///< N*s/m
  double max_force_rate = 2000;     ///< N/s, how fast the commanded force may grow or turn
  double max_torque = 0.1;          ///< N*m, about the tool; a device of three axes gives none
  double continuous_force = 0.88;   ///< N, root mean square with a memory of a minute
  double max_work = 1;              ///< J, what the force may do on the hand within any second
  double max_speed = 1.5;           ///< m/s of the hand, above which the force only brakes
  int delay_ticks = 0;              ///< 0..3, from a command to its force, as far as it is known
  double workspace_radius = 0.075;  ///< m around the origin, in which forces are good; 0: not known
  bool pull = true;                 ///< Relief's thread calls read and write; false: the device's SDK calls Relief
};

/// One reading.
struct DeviceState {
  double t = 0;    ///< s, monotonic, from the device's own start
  Vec3d position;  ///< m
  Vec3d velocity;  ///< m/s; used when `has_velocity`, else estimated from positions
  bool has_velocity = false;
  Quatd orientation = {};  ///< from the tool's frame to the device's, 1e-6 to 1e150 long; used when `has_orientation`
  bool has_orientation = false;
  std::uint32_t buttons = 0;
};

/// What the hand is to feel; device axes.
struct Wrench {
  Vec3d force;   ///< N
  Vec3d torque;  ///< N*m, about the reading's position; a device of three axes takes no notice of it
};

/// What a push device calls with each reading, and then commands what it gets. Neither allocates nor locks.
struct PushTick {
  void* servo = nullptr;
  Wrench (*call)(void* servo, const DeviceState& reading) noexcept = nullptr;
  [[nodiscard]] Wrench operator()(const DeviceState& reading) const noexcept { return call(servo, reading); }
};

/// A haptic device of one of two kinds, as info().pull says. A pull device is read and commanded by Relief's thread; a
/// push device has a thread of its own, or of its SDK, that calls Relief.
class HapticDevice {
 public:
  virtual ~HapticDevice() = default;
  [[nodiscard]] virtual const DeviceInfo& info() const noexcept = 0;
  /// Pull: read() and write() are called at 1 kHz by one thread and must not allocate or lock; both return false when
  /// the device is gone.
  [[nodiscard]] virtual bool read(DeviceState& /*state*/) noexcept { return false; }
  /// Pull: whether nothing more comes, as after the last reading of a recording; asked once per tick by the same
  /// thread. The device is read no more then, and is not lost.
  [[nodiscard]] virtual bool ended() const noexcept { return false; }
  /// Commands force and torque on the hand. A safe stop is an explicit zero, never silence.
  [[nodiscard]] virtual bool write(const Wrench& /*wrench*/) noexcept { return false; }
  /// Push: from now on `tick` is called once per period, by one thread; false when there is no device.
  [[nodiscard]] virtual bool start(PushTick /*tick*/) noexcept { return false; }
  /// Push: once this has returned, `tick` is called no more, and the last command was zero. Also without a start().
  virtual void stop() noexcept {}
};

}  // namespace relief
