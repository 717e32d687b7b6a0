// What a change that the hand did not make did to what is felt, taken over little by little.
#pragma once

#include <relief/base/vec.h>

#include <algorithm>
#include <limits>

namespace relief {

/// A contact comes to rest on an edited surface, or in a workspace that was moved, in the same tick; what is felt does
/// not. It is the contact's own vector and an offset, which is set so that nothing jumps and then fades. Model units.
class Blend {
 public:
  /// How quickly it fades in one tick: by a share, and at most by so many model units.
  struct Ease {
    double share = 1;
    double most = std::numeric_limits<double>::infinity();
  };

  void reset() noexcept { *this = {}; }
  [[nodiscard]] Vec3d offset() const noexcept { return offset_; }
  [[nodiscard]] bool fading() const noexcept { return offset_ != Vec3d{}; }
  /// The contact's own vector has changed by so much, and not by the hand's doing.
  void absorb(Vec3d change) noexcept {
    offset_ -= change;
    whole_ = std::max(whole_, length(offset_));
  }
  /// One tick; `besides`: what it fades more than that, model units.
  void fade(const Ease& ease, double besides = 0) noexcept {
    const double had = length(offset_);
    if (!(had > 0)) return;
    const double left = had - std::min(had * ease.share, ease.most) - besides;
    if (left > kNone * whole_)
      offset_ *= left / had;
    else
      reset();
  }

 private:
  static constexpr double kNone = 1e-6;  ///< of the whole: nothing that can be felt is left

  Vec3d offset_;
  double whole_ = 0;  ///< its greatest length since there was none
};

}  // namespace relief
