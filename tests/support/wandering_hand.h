// A hand that wanders about a place by chance, the same way each time.
#pragma once

#include <relief/base/vec.h>

#include <random>

namespace relief::testing {

/// Some thousandths per tick, about the outer flank of torus_shell()'s tube: in and out of its surface.
class WanderingHand {
 public:
  [[nodiscard]] Vec3d next() {
    way_ = way_ * 0.95 + Vec3d{normal_(random_), normal_(random_), normal_(random_)} * 1e-3 +
           (Vec3d{2, 0.7, 0} - hand_) * 2e-4;
    return hand_ += way_;
  }

 private:
  std::mt19937 random_{7};
  std::normal_distribution<double> normal_;
  Vec3d hand_ = {2, 1.5, 0}, way_;
};

}  // namespace relief::testing
