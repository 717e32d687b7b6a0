// Judges what a device says: whether a force can be made of a reading.
#pragma once

#include <relief/haptics/device.h>
#include <relief/haptics/workspace.h>

#include <cstdint>

namespace relief {

/// The readings of one device, one after the other. A small state, no clock, no allocation.
class Readings {
 public:
  explicit Readings(const DeviceInfo& device) noexcept;

  /// A reading as it has been judged beside the ones before.
  struct Judged {
    std::uint32_t faults = 0;   ///< ServoFault bits; 0: a force can be made of it
    bool has_position = false;  ///< the position itself is usable
    double dt = 1e-3;           ///< s, since the last reading
    double travel = 0;          ///< m, since the last reading
    Vec3d velocity;             ///< m/s: the device's own, or filtered; zero after a fault
    Quatd orientation;          ///< unit; the last good one where this one is none
    Vec3d turn;                 ///< rad, of the tool since the last good reading
  };
  /// To be called once per tick. `space` says where in the model the reading leads to.
  [[nodiscard]] Judged judge(const DeviceState& reading, const Workspace& space) noexcept;
  /// The next reading comes after a standstill that its own time does not show: a fault.
  void stalled() noexcept { stalled_ = true; }
  /// The next position is not compared with those before.
  void forget_position() noexcept { has_position_ = false; }

  /// How much later than a device's stiffness is good for one tick in a thousand comes, s; 0 while none does.
  [[nodiscard]] double late() const noexcept { return late_; }
  /// Share of the device's stiffness that is good for such ticks; it moves with them little by little.
  [[nodiscard]] double softer() const noexcept { return softer_; }

 private:
  /// Takes in the reading's time; whether the step from the last one's is good.
  [[nodiscard]] bool judge_time(double t, Judged& now) noexcept;
  /// Takes in the time between two ticks.
  void judge_period(double dt) noexcept;
  [[nodiscard]] bool usable(Vec3d position, const Workspace& space) const noexcept;
  void judge_orientation(const DeviceState& reading, Judged& now) noexcept;

  double radius_ = 0;  ///< m, of the workspace that the device states; 0: none
  bool stalled_ = false;
  bool has_time_ = false, has_position_ = false;
  double last_t_ = 0;
  double period_ = 0;    ///< s: one tick in a thousand comes later than that after the one before, or none
  double late_ = 0;      ///< s: how much of that is too late
  double softer_ = 1;    ///< share of the device's stiffness that is good for such ticks
  double frozen_ = 0;    ///< s, for which the device's velocity says that it moves and its position stays
  Vec3d last_position_;  ///< m
  Vec3d velocity_;       ///< m/s
  Quatd orientation_, last_orientation_;  ///< the last good one, and that of the last reading without a fault
};

}  // namespace relief
