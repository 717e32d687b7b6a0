// Forces that do not step where the model is moved under the tool.
#pragma once

#include <relief/haptics/device.h>

namespace relief {

/// Where the workspace changes, the law's force steps though the hand did nothing. What is given then goes on from what
/// was given last, and what it lacks of the law's fades with a time constant of 15 ms; beside the hand's own way, which
/// is felt at once, it changes by 0.045 N in a tick at most meanwhile. A small state, no allocation.
class ForceBlend {
 public:
  /// The model was moved since the last tick, in which `last` was asked for, and what touches it has turned with it.
  void moved(const Wrench& last, Quatd turned) noexcept;
  /// Whether something is left of a change.
  [[nodiscard]] bool blending() const noexcept { return pending_ || lacking_ != Vec3d{}; }
  /// One tick while blending(): what the law asks for, and how much of its change the hand itself has made; what to
  /// give instead. N, N*m; `dt` in s.
  [[nodiscard]] Wrench step(const Wrench& law, Vec3d by_hand, double dt) noexcept;
  /// There is no force in this tick, and nothing to lead over.
  void rest() noexcept { *this = {}; }

 private:
  bool pending_ = false;
  Wrench last_ = {};    ///< as it was given
  Vec3d lacking_ = {};  ///< N: the force that was given, less what the law asked for
};

}  // namespace relief
