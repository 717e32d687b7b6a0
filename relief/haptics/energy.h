// The account of what a contact's springs give and get.
#pragma once

namespace relief {

/// Holds what came from nowhere is the work that was done on the hand and what the springs hold more than before, less
/// what others put into them. J.
class EnergyAccount {
 public:
  /// Returns one tick. `work`: done on the hand since the last one; `stored`: in the springs now; `gift`: of that, what
  /// an edit, a setting or a moved workspace put in. Returns what was made; negative where energy was lost.
  [[nodiscard]] double book(double work, double stored, double gift) noexcept {
    const double made = work + stored - gift - stored_;
    stored_ = stored;
    return made;
  }
  /// The springs hold so much, whoever put it in.
  void set(double stored) noexcept { stored_ = stored; }
  /// Energy in the spring, J.
  [[nodiscard]] double stored() const noexcept { return stored_; }

 private:
  double stored_ = 0;
};

}  // namespace relief
