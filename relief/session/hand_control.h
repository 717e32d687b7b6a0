// What a person sets at a session that runs: force limit, clutch, scale, where the tool is.
#pragma once

#include <relief/session/session.h>

#include <atomic>

namespace relief {

/// The settings of a session's servo as a person changes them. Each change goes to the session at once, or with the
/// next flush() where its queue is full. One thread; forces() any.
class HandControl {
 public:
  /// of the workspace that fits the model
  static constexpr double kLeastScale = 0.1, kMostScale = 10;

  /// `settings` are those that the session was made with, its workspace the one of scale 1.
  HandControl(Session& session, const DeviceInfo& device, const ServoSettings& settings);

  /// N; at most the device's, at least 0.
  void limit_force(double most);
  /// True: the device moves, and the tool stays where it is.
  void clutch(bool held);
  /// The tool is at `place` (model units), wherever the device is. The place should be in free space: in the solid
  /// there is no force until the tool has left it.
  void recentre(Vec3d place);
  /// How large the model is in the hand, beside the workspace's; clamped to kLeastScale..kMostScale. `tool`: its place
  /// in the model (model units), where it stays.
  void scale(double factor, Vec3d tool);
  /// All of the law but the force limit, which stays.
  void touch_with(const ForceSettings& force);
  /// No force from the next tick on, or forces again once the hand has lifted off.
  void forces(bool on) noexcept;
  /// Tries again what found the queue full; whether all is with the session.
  bool flush();

  /// Returns the greatest force, N.
  [[nodiscard]] double force_limit() const noexcept { return settings_.force.max_force; }
  /// Returns whether the hand moves without the tool.
  [[nodiscard]] bool clutched() const noexcept { return settings_.clutch.held; }
  /// Returns the scale that was requested.
  [[nodiscard]] double scale() const noexcept { return scale_; }
  /// Returns whether forces are on.
  [[nodiscard]] bool forces() const noexcept { return forces_.load(std::memory_order_relaxed); }
  /// Returns what the servo is given.
  [[nodiscard]] const ServoSettings& settings() const noexcept { return settings_; }

 private:
  Session& session_;
  const double device_force_;  ///< N
  const double fitted_;        ///< m per model unit at scale 1
  ServoSettings settings_;
  double scale_ = 1;
  bool due_ = false;
  std::atomic<bool> forces_{true};
};

}  // namespace relief
