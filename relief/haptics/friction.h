// Coulomb friction as a spring to an anchor that gives way at the limit.
#pragma once

#include <relief/base/vec.h>

namespace relief {

/// Implicit, so that it neither drifts nor chatters (after Kikuuwe et al. 2006). A tool that touches over some width
/// has a second spring, against turning on the spot. A small state, no allocation.
class Friction {
 public:
  /// Says how rough the surface is.
  struct Setting {
    /// coefficients
    double kinetic = 0, still = 0;
    double stiffness = 0;     ///< N/m, that of the contact
    double normal_force = 0;  ///< N
  };
  /// Holds what friction adds in a tick.
  struct Given {
    /// N; N*m about where the tool touches
    Vec3d force, torque;
    double stored = 0;  ///< J in the springs
  };

  /// Forgets where it held; the next touch begins without.
  void let_go() noexcept { holds_ = sliding_ = false; }
  /// Returns one tick of a tool that touches. `hand` in m; `normal` unit; `arm` in m, from the hand to the contact.
  /// `spread` in m, the extent around it; `turn` in rad, of the tool since the last tick.
  [[nodiscard]] Given step(const Setting& now, Vec3d hand, Vec3d normal, Vec3d arm, double spread, Vec3d turn) noexcept;
  /// The hand has been put elsewhere: what was at `from` is at `to`, turned.
  void move(Vec3d from, Vec3d to, Quatd turned) noexcept { anchor_ = to - turned.turn(from - anchor_); }

 private:
  bool holds_ = false, sliding_ = false;
  Vec3d anchor_;     ///< m, where it holds the tool
  double spin_ = 0;  ///< rad about the normal, from where it holds it
};

}  // namespace relief
