// A mouse or pen as a force probe: a device whose tool goes where a program points.
#pragma once

#include <relief/base/mailbox.h>
#include <relief/core/query.h>
#include <relief/haptics/device.h>
#include <relief/haptics/workspace.h>

#include <atomic>
#include <cstdint>

namespace relief {

/// A place under the pointer. Lengths in m, directions of unit length, along the device's axes.
struct PointerPlace {
  bool over = false;          ///< on the model; else `surface` is a place beside it, and `depth` has no meaning
  Vec3d surface;              ///< on the surface
  Vec3d normal;               ///< outwards there
  Vec3d towards_eye;          ///< from there to the eye that sees it; the way is free
  double rise = 0;            ///< along towards_eye from `surface` to the front of the whole model
  double depth = 0;           ///< the tool below the surface, along the normal; negative: it hovers above
  double pressure = 0;        ///< 0..1, of a pen
  std::uint32_t buttons = 0;  ///< as DeviceState has them
};

/// Returns the place where a ray from the eye, in model units, meets the model; beside it, the place of the ray nearest
/// to the model's middle. Depth, pressure and buttons are the caller's. Costs one raycast().
[[nodiscard]] PointerPlace pointer_place(const Snapshot& model, const Ray3d& ray, const Workspace& workspace,
                                         PickHint& hint) noexcept;

/// Holds what the servo has answered.
struct PointerFeel {
  Vec3d position;  ///< m, where the tool is
  Vec3d force;     ///< N, on the hand that a mouse has not
};

/// The cursor's resistance (pseudo-haptics, Lecuyer 2009): while the pointer is pressed in, it goes on by less than the
/// mouse, the less the more force there is. What eyes see so, hands take for stiffness.
class PointerResistance {
 public:
  static constexpr double kLeast = 0.35;  ///< of the mouse's way, under any force
  static constexpr double kHalf = 1.5;    ///< N at which half of the difference is taken

  /// Returns the pointer's way for a way 1 of the mouse, kLeast..1.
  [[nodiscard]] static double gain(double force) noexcept;
  /// Returns the pointer's ray for the mouse's. Where it is not pressed, the same.
  [[nodiscard]] Ray3d step(const Ray3d& mouse, bool pressed, double force) noexcept;

 private:
  bool pressed_ = false;
  Ray3d mouse_, pointer_;
};

/// A pull device whose tool follows what point() was told last. It takes events of 60 Hz to 1 kHz, also uneven ones,
/// and makes an even way of them at 1 kHz, one and a half event intervals late: the tool goes on to each place in a
/// straight line at a constant speed, slower than events come, so that it is never there before the next one. Where the
/// next place lies behind a silhouette, the tool rises in front of the model, crosses over and comes down again, since
/// between the two lies material. The force of the virtual spring between tool and contact is the servo's own; nobody
/// feels it, felt() tells it.
///
/// Time goes on by 1 ms per read(): the same places in the same ticks give the same readings.
class PointerDevice final : public HapticDevice {
 public:
  static constexpr double kFastest = 2.5;   ///< m/s of the tool, below what a contact follows (HandLimit)
  static constexpr double kDeepest = 0.02;  ///< m, below the surface
  static constexpr double kLag = 1.5;       ///< event intervals from an event to the tool's arrival
  static constexpr double kShortest = 4e-3, kLongest = 30e-3;  ///< s, of that time

  /// The tool starts in front of the model, on its way to `start`.
  explicit PointerDevice(const PointerPlace& start);
  [[nodiscard]] const DeviceInfo& info() const noexcept override { return info_; }
  [[nodiscard]] DeviceStatus status() const override;
  [[nodiscard]] Status enable(bool forces) override;
  [[nodiscard]] bool read(DeviceState& state) noexcept override;
  [[nodiscard]] bool write(const Wrench& wrench) noexcept override;

  /// One thread, not necessarily that of read(); wait-free. A place that is not finite is left out.
  void point(const PointerPlace& place) noexcept;
  /// False where nothing new was felt since the last call. One thread, not necessarily another; wait-free.
  [[nodiscard]] bool felt(PointerFeel& feel) noexcept { return feel_.take(feel); }

 private:
  /// The parts of the way over a silhouette.
  enum class Leg : std::uint8_t { None, Out, Across, In };

  [[nodiscard]] static Vec3d goal_of(const PointerPlace& place) noexcept;
  [[nodiscard]] static Vec3d front_of(const PointerPlace& place) noexcept;
  [[nodiscard]] static bool behind_silhouette(const PointerPlace& from, const PointerPlace& to) noexcept;
  void arrive(const PointerPlace& place) noexcept;
  /// One tick on the way over a silhouette.
  void fly() noexcept;
  /// Goes to a place at the greatest speed; whether it is there.
  bool hurry_to(Vec3d place) noexcept;

  DeviceInfo info_;
  Mailbox<PointerPlace> places_;
  Mailbox<PointerFeel> feel_;
  std::atomic<std::uint32_t> pressed_{0}, released_{0};
  std::uint32_t told_buttons_ = 0;  ///< by point(), of its thread
  std::atomic<bool> forces_{true};
  // The thread of read() and write() alone.
  std::uint64_t tick_ = 0;
  PointerPlace place_;
  Vec3d position_;
  double left_ = 0;      ///< ticks to the goal
  double since_ = 0;     ///< ticks since the last place
  double interval_ = 0;  ///< ticks between places, as the longest lately
  Leg leg_ = Leg::In;
  Vec3d front_;  ///< where Leg::Out leads
};

}  // namespace relief
