// Judges what a device says: whether a force can be made of a reading.
#pragma once

#include <relief/haptics/device.h>
#include <relief/haptics/fault.h>
#include <relief/haptics/workspace.h>

#include <array>
#include <cstdint>

namespace relief {

/// Says how a device's readings are taken.
struct ReadingSettings {
  /// s for which a button must have been up before it counts as released, so that a contact that bounces or drops out
  /// does not cut a stroke in two; 0: at once. A press counts at once. What is not a number counts as 0.
  double debounce = 20e-3;
};

/// The readings of one device, one after the other. A small state, no clock, no allocation.
class Readings {
 public:
  /// s between two readings, after which the hand may be anywhere: a longer time is a fault. A reading's neighbours may
  /// be rounded.
  static constexpr double kMaxGap = 0.05 - 1e-6;
  /// s without news that are no fault: the force is held, and a slow hand goes 2 mm meanwhile.
  static constexpr double kSilence = 20e-3;

  /// For a device with such limits.
  explicit Readings(const DeviceInfo& device) noexcept;

  /// Takes new settings.
  void set(const ReadingSettings& settings) noexcept { settings_ = settings; }

  /// A reading as it has been judged beside the ones before.
  struct Judged {
    std::uint32_t faults = 0;    ///< ServoFault bits; 0: a force can be made of it
    std::uint32_t warnings = 0;  ///< ServoFault bits of what is odd, and keeps no force back
    /// The reading is the last one again: what was felt is to be held. Without faults only as long as that may be.
    bool news = true;
    bool has_position = false;  ///< the position itself is usable
    double dt = 1e-3;           ///< s, since the last reading
    Vec3d step;                 ///< m, since the last reading
    Vec3d velocity;             ///< m/s: the device's own, or filtered; zero after a fault
    Quatd orientation;          ///< unit; the last good one where this one is none
    Vec3d turn;                 ///< rad, of the tool since the last good reading
    std::uint32_t buttons = 0;  ///< as DeviceState has them, without what a contact that bounces makes of them
  };
  /// To be called once per tick. `space` says where in the model the reading leads to.
  [[nodiscard]] Judged judge(const DeviceState& reading, const Workspace& space) noexcept;
  /// The next reading comes after something that it does not show itself: a fault of that name.
  void interrupt(ServoFault why) noexcept { interrupted_ |= bit(why); }

  /// Returns how much later than a device's stiffness is good for one tick in a thousand comes, s; 0 while none does.
  [[nodiscard]] double late() const noexcept { return late_; }
  /// Share of the device's stiffness that is good for such ticks; it moves with them little by little.
  [[nodiscard]] double softer() const noexcept { return softer_; }

 private:
  /// Takes in the reading's time; whether the step from the last one's is good.
  [[nodiscard]] bool judge_time(double t, Judged& now) noexcept;
  /// Takes in the time between two ticks.
  void judge_period(double dt) noexcept;
  [[nodiscard]] std::uint32_t judge_buttons(const DeviceState& reading, double dt) noexcept;
  [[nodiscard]] bool usable(Vec3d position, const Workspace& space) const noexcept;
  void judge_motion(const DeviceState& reading, bool timed, Judged& now) noexcept;
  void judge_orientation(const DeviceState& reading, Judged& now) noexcept;
  /// Returns whether the arm looks as if it did not know where it is.
  [[nodiscard]] bool looks_uncalibrated(const DeviceState& reading, const Judged& now) noexcept;

  ReadingSettings settings_;
  // What the device states of itself; m and s.
  double radius_;  ///< 0: none
  Box3d box_;      ///< empty: none
  double tick_;
  bool absolute_;

  std::uint32_t interrupted_ = 0;
  bool has_time_ = false, has_position_ = false;
  double last_t_ = 0;
  double silent_ = 0;                     ///< s without news
  double period_ = 0;                     ///< s: one tick in a thousand comes later than that after the one before
  double late_ = 0;                       ///< s: how much of that is too late
  double softer_ = 1;                     ///< share of the device's stiffness that is good for such ticks
  double frozen_ = 0;                     ///< s, for which the device's velocity says that it moves and it stays
  Vec3d last_position_;                   ///< m
  Vec3d velocity_;                        ///< m/s
  Quatd orientation_, last_orientation_;  ///< the last good one, and that of the last reading without a fault
  double still_ = 0;                      ///< s, for which the position has not moved
  Quatd still_from_;                      ///< the orientation when that began
  bool turned_ = false;                   ///< away from it since then
  std::uint32_t down_ = 0;                ///< buttons that count as down
  std::array<double, 8> up_{};            ///< s, for which each of these has been up
};

}  // namespace relief
