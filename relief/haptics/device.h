// What Relief knows about a haptic device, and how it talks to one. SI units; axes x right, y up, z towards the user,
// into which a device's own are turned before anything comes here (docs/decisions/0008-devices.md).
#pragma once

#include <relief/base/error.h>
#include <relief/base/vec.h>

#include <cstdint>
#include <string>

namespace relief {

/// Says how many axes of each kind a device has.
struct Freedom {
  int position = 3;  ///< 0..3
  int rotation = 0;  ///< 0..3
  int gripper = 0;   ///< 0 or 1
  /// Returns how many freedoms.
  [[nodiscard]] constexpr int count() const noexcept { return position + rotation + gripper; }
};

enum class Handedness : std::uint8_t { Either, Left, Right };
/// Who holds up the arm's weight: nobody; the device; the vendor's library on this machine, so that the arm drops when
/// it is closed.
enum class GravityCompensation : std::uint8_t { Unknown, None, Device, Library };
[[nodiscard]] std::string_view name(Handedness handedness) noexcept;
[[nodiscard]] std::string_view name(GravityCompensation compensation) noexcept;

/// Nominal limits; user settings never exceed them.
struct DeviceInfo {
  std::string name = {};     ///< as `relief devices` shows it
  std::string serial = {};   ///< what the device is known by among those of its kind; empty: it does not say
  std::string filters = {};  ///< what the vendor's software does to forces and readings ("force gate 0.3"); empty: none
  double max_force = 3.3;    ///< N; 0: a device that gives none
  double max_stiffness = 1250;      ///< N/m
  double max_damping = 4;           ///< N*s/m
  double max_force_rate = 2000;     ///< N/s, how fast the commanded force may grow or turn
  double max_torque = 0.1;          ///< N*m, about the tool; a device of three axes gives none
  double continuous_force = 0.88;   ///< N, root mean square with a memory of a minute
  double max_work = 1;              ///< J, what the force may do on the hand within any second
  double max_speed = 1.5;           ///< m/s of the hand, above which the force only brakes
  int delay_ticks = 0;              ///< 0..3, from a command to its force, as far as it is known
  double delay = 0;                 ///< s, the same where it is not a number of ticks; the longer one counts
  double workspace_radius = 0.075;  ///< m around the origin, in which forces are good; 0: not known
  Box3d workspace = {};             ///< m, the same axis by axis; where it is not empty the radius does not count
  double rate = 1000;               ///< Hz, of the device's own readings; 0: not known
  /// what it measures, and where it has motors
  Freedom sensed = {}, actuated = {};
  Handedness handedness = Handedness::Either;                  ///< for which hand
  GravityCompensation gravity = GravityCompensation::Unknown;  ///< whether it carries its own weight
  bool absolute = true;  ///< positions are measured, not summed up from motions as a mouse's are
  bool pull = true;      ///< Relief's thread calls read and write; false: the device's SDK calls Relief
};

/// One reading.
struct DeviceState {
  double t = 0;               ///< s, monotonic, from the device's own start; the last one's where there is nothing new
  Vec3d position;             ///< m
  Vec3d velocity;             ///< m/s; used when `has_velocity`, else estimated from positions
  bool has_velocity = false;  ///< whether `velocity` holds
  Quatd orientation = {};  ///< from the tool's frame to the device's, 1e-6 to 1e150 long; used when `has_orientation`
  bool has_orientation = false;       ///< whether `orientation` holds
  Vec3d angular_velocity = {};        ///< rad/s, about the device's axes; there when `has_angular_velocity`
  bool has_angular_velocity = false;  ///< whether `angular_velocity` holds
  double gripper = 0;                 ///< m between the fingers; there when `has_gripper`
  double gripper_force = 0;           ///< N with which the fingers are pressed, where that is measured
  bool has_gripper = false;           ///< whether `gripper` holds
  double pressure = 0;                ///< 0..1, of a pen's tip or a trigger; there when `has_pressure`
  bool has_pressure = false;          ///< whether `pressure` holds
  bool forces_off = false;            ///< the device has switched its forces off itself (status() says why)
  /// Bits 0 to 7: the buttons that are down. From bit 8 on: a number, by which a program says which brush it means.
  std::uint32_t buttons = 0;
  /// Buttons that went down, or up, at any time since the last reading: so a click between two readings is not lost. A
  /// device that looks at its buttons only once per reading may leave them 0.
  std::uint32_t pressed = 0, released = 0;  ///< buttons that went down or up since the last reading, a bit each
};

/// Holds what the hand is to feel; device axes.
struct Wrench {
  Vec3d force;         ///< N
  Vec3d torque;        ///< N*m, about the reading's position; a device of three axes takes no notice of it
  double gripper = 0;  ///< N that open the fingers; a device without a gripper takes no notice of it
};

/// Whether a device knows where its arm is.
enum class Calibration : std::uint8_t {
  Done,      ///< it does, or need not be told
  ByPerson,  ///< a person must do something: DeviceStatus::to_do
  ByArm      ///< calibrate() moves the arm, once somebody has said that it may
};
[[nodiscard]] std::string_view name(Calibration calibration) noexcept;

/// Holds what a device says of itself at the moment.
struct DeviceStatus {
  bool connected = false;                       ///< it is open, and answers
  bool powered = false;                         ///< whether its motors have current
  bool forces_on = false;                       ///< a command reaches the motors
  Calibration calibration = Calibration::Done;  ///< whether it knows where it is
  std::string to_do;        ///< what a person must do before it can be used, one sentence; empty: nothing
  std::string force_off;    ///< why its forces are off, in words; empty while they are on, or where it does not say
  std::string trouble;      ///< what went wrong last, in words; empty: nothing, or it does not say
  double temperature = -1;  ///< of the hottest motor, 0 cold, 1 as hot as it may be; -1: not known
  double battery = -1;      ///< of a part without a wire, 0..1; -1: there is none, or not known
};

/// Holds what a push device calls with each reading, and then commands what it gets. Neither allocates nor locks.
struct PushTick {
  void* servo = nullptr;                                                       ///< the servo, for `call`
  Wrench (*call)(void* servo, const DeviceState& reading) noexcept = nullptr;  ///< one tick of the servo
  /// Gives a reading to the servo, and returns the force to send. The device's own thread.
  [[nodiscard]] Wrench operator()(const DeviceState& reading) const noexcept { return call(servo, reading); }
};

/// Whether an arm may move by itself, which somebody in front of it must have said.
enum class ArmMotion : std::uint8_t { Forbidden, Allowed };

/// A haptic device: Relief's thread reads and commands a pull device; a push device calls Relief (info().pull). Order:
/// open, calibrate where status() asks for it (bring_up() does both), enable, then read and write, or start and stop;
/// then disable and close. A call that a device has no use for succeeds. Any thread may call status(); one thread at a
/// time the rest.
class HapticDevice {
 public:
  virtual ~HapticDevice() = default;
  /// Of the device that is open; before that what is known of its kind.
  [[nodiscard]] virtual const DeviceInfo& info() const noexcept = 0;

  /// Finds the device and takes hold of it, its forces off. After close(), or where it was lost, the same one again.
  /// May take seconds. Errors: DeviceUnavailable, saying what is missing and the remedy.
  [[nodiscard]] virtual Status open() { return {}; }
  /// May lock and take milliseconds. The loop asks it only before forces are switched on, and where the device has been
  /// lost.
  [[nodiscard]] virtual DeviceStatus status() const {
    return {.connected = true, .powered = true, .forces_on = true, .to_do = {}, .force_off = {}, .trouble = {}};
  }
  /// Lets the device find out where its arm is. Never moves the arm by itself unless that is allowed. May take a
  /// minute. Errors: InvalidArgument (it would have to move), DeviceUnavailable, saying what a person must do.
  [[nodiscard]] virtual Status calibrate(ArmMotion /*motion*/) { return {}; }
  /// Switches the forces on, beginning with zero, or off. Errors: DeviceUnavailable, saying why not.
  [[nodiscard]] virtual Status enable(bool /*forces*/) { return {}; }
  /// Forces off, and releases the device. Also when it is closed, or gone.
  virtual void close() noexcept {}

  /// Pull: read() and write() are called at 1 kHz by one thread and must not allocate or lock; both return false when
  /// the device does not answer. What is the matter status() then says.
  [[nodiscard]] virtual bool read(DeviceState& /*state*/) noexcept { return false; }
  /// Pull: whether nothing more comes, as after the last reading of a recording; asked once per tick by the same
  /// thread. The device is read no more then, and is not lost.
  [[nodiscard]] virtual bool ended() const noexcept { return false; }
  /// Commands force and torque on the hand. A safe stop is an explicit zero, never silence.
  [[nodiscard]] virtual bool write(const Wrench& /*wrench*/) noexcept { return false; }
  /// Push: from now on `tick` is called once per period, by one thread; false when there is no device. What is the
  /// matter status() then says. May come again after stop().
  [[nodiscard]] virtual bool start(PushTick /*tick*/) noexcept { return false; }
  /// Push: once this has returned, `tick` is called no more, and the last command was zero. Also without a start(), and
  /// where the device has fallen silent.
  virtual void stop() noexcept {}
};

/// Makes an open device ready for enable(): one that does not know where its arm is finds it out, its arm moving only
/// where that is allowed. Errors: DeviceUnavailable, saying what a person must do, and what calibrate() says.
[[nodiscard]] Status make_ready(HapticDevice& device, ArmMotion motion = ArmMotion::Forbidden);
/// Opens a device and makes it ready. May take a minute. Errors: those of open() and of make_ready().
[[nodiscard]] Status bring_up(HapticDevice& device, ArmMotion motion = ArmMotion::Forbidden);

/// m, in which forces are good: the box that the device states, else the one around its radius; empty where neither is
/// known.
[[nodiscard]] Box3d workspace_of(const DeviceInfo& device) noexcept;
/// s from one reading to the next: of a push device as its rate has it, else 1 ms, in which Relief calls it.
[[nodiscard]] double tick_of(const DeviceInfo& device) noexcept;
/// Ticks from a command to its force, whichever way it is stated.
[[nodiscard]] int delay_of(const DeviceInfo& device) noexcept;

}  // namespace relief
