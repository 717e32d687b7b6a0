// How far a new fibre reaches to both sides.
#pragma once

#include <relief/convert/shell/slab_checks.h>

#include <array>
#include <optional>
#include <span>

namespace relief::detail {

/// Of the longest fibre: rounding to the lattice must not make it longer.
inline constexpr double kJustBelow = 0.999;

/// Heights of a fibre's end over a place on it, lattice steps.
struct HeightInterval {
  double least = 0, most = 1e30;
  /// Returns the nearest height in it, not quite at its ends.
  [[nodiscard]] double nearest(double height) const noexcept;
};

/// Returns how far a new fibre through `at` along the unit vector d may reach to each side so that the Jacobian can be
/// positive in the slabs around it. Empty where no height works. A filter only: rounded, and not all of C1.
[[nodiscard]] std::optional<std::array<HeightInterval, 2>> heights_along(const LinkedDraft& draft, const Star& star,
                                                                         Vec3d at, Vec3d d) noexcept;

/// Says how much higher than the old fibres merged ones start. On a rough source they must grow nearly each time: then
/// they start higher, so that fewer first tries are in vain.
class StartGrowth {
 public:
  [[nodiscard]] double of(Side side) const noexcept { return growth_[side]; }
  /// Learns from a first try.
  void learn(Fault fault) noexcept;

 private:
  std::array<double, 2> growth_{1, 1};
};

/// The heights that a fibre is tried with, one direction after the other; each fault says what to try next.
class HeightSearch {
 public:
  /// For the fibre through `at` that two others, u and v, become. The directions, unit vectors, must outlive it, and
  /// the draft must stay as it is. `longest`: of a fibre, lattice steps.
  HeightSearch(const LinkedDraft& draft, const Star& star, std::uint32_t u, std::uint32_t v, Vec3d at,
               std::span<const Vec3d> directions, const StartGrowth& growth, double longest) noexcept;

  /// Begins with the first direction, or the next one, that leaves the fibre some height. False when there is none.
  [[nodiscard]] bool start();
  [[nodiscard]] bool next() {
    ++choice_;
    return start();
  }
  /// Shortens both sides alike to the longest fibre; false where it was too long.
  bool fit() noexcept;
  [[nodiscard]] Ends ends() const noexcept {
    return {end_at(kInner, heights_[kInner]), end_at(kOuter, heights_[kOuter])};
  }
  [[nodiscard]] const std::array<double, 2>& heights() const noexcept { return heights_; }

  /// Returns one step up or down a side; false where that would change hardly anything.
  bool grow(Side side) noexcept;
  bool shrink(Side side, double share) noexcept;
  /// Grows a side until the triangle that it met is clear of it. Where that fails the heights stay as they were if not
  /// even the greatest height helps, and are what was tried last otherwise.
  bool grow_clear(Side side, const SlabChecks& checks) noexcept;
  void set_heights(const std::array<double, 2>& heights) noexcept { heights_ = heights; }

 private:
  [[nodiscard]] LatticePoint end_at(Side side, double height) const noexcept {
    return snap(at_ + directions_[choice_] * (side == kOuter ? height : -height));
  }

  const LinkedDraft& draft_;
  const Star& star_;
  std::array<Ends, 2> old_;
  Vec3d at_;
  std::span<const Vec3d> directions_;
  const StartGrowth& growth_;
  double longest_, thickness_;
  std::size_t choice_ = 0;
  std::array<double, 2> heights_{};
  std::array<HeightInterval, 2> intervals_{};
};

}  // namespace relief::detail
