// Forces that do not step where it is not the hand that changes what is felt.
#pragma once

#include <relief/haptics/device.h>

namespace relief {

/// Blends the force where the surface is edited under the tool, or the workspace moves: there the law's force steps
/// though the hand did nothing. The given force continues from its last value. What it lacks of the law's fades with a
/// time constant of 15 ms, by at most 0.045 N per tick. The hand's own motion is felt at once. No allocation.
class ForceBlend {
 public:
  /// Something else than the hand has changed what is felt since the last tick, in which this was given.
  void moved(const Wrench& last) noexcept;
  /// Returns whether something is left of a change.
  [[nodiscard]] bool blending() const noexcept { return pending_ || lacking_ != Vec3d{}; }
  /// Returns one tick while blending(): what the law asks for, and how much of its change the hand itself has made;
  /// what to give instead. N, N*m; `dt` in s.
  [[nodiscard]] Wrench step(const Wrench& law, Vec3d by_hand, double dt) noexcept;
  /// After step(): what the last force would have been in this tick by the hand's doing alone, N.
  [[nodiscard]] Vec3d from() const noexcept { return from_; }
  /// There is no force in this tick, and nothing to lead over.
  void rest() noexcept { *this = {}; }

 private:
  bool pending_ = false;
  Wrench last_ = {};  ///< as it was given
  Vec3d from_;
  Vec3d lacking_ = {};  ///< N: the force that was given, less what the law asked for
};

}  // namespace relief
