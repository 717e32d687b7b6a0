// Fibres that turn, slide, shrink and grow while their slabs stay valid.
#pragma once

#include <relief/convert/shell/creases.h>
#include <relief/convert/shell/slab_checks.h>

#include <array>
#include <cstdint>

namespace relief::detail {

/// Moves of single free fibres of a draft. Each is made only where all local checks pass, and tried in smaller steps
/// where they do not; nothing else changes. What it is given must outlive it.
class FibreMoves {
 public:
  /// `longest`: of a fibre, lattice steps. `creases`: fibres on them only turn and become longer or shorter.
  FibreMoves(const SourceIndex& source, LinkedDraft& draft, SlabChecks& checks, double longest,
             const Creases* creases = nullptr) noexcept
      : source_(source), draft_(draft), checks_(checks), longest_(longest), creases_(creases) {}

  /// Turns a fibre towards the direction that best sees the source in its star. True where it was turned.
  bool re_aim(std::uint32_t v);
  /// Turns a fibre about its place towards a unit vector, whatever the source is like: all the way, or halves of it
  /// down to the smallest, 1 / 2^halvings. True where it was turned.
  bool turn(std::uint32_t v, Vec3d to, int halvings = kTurnHalvings);
  /// Turns, slides and shortens a fibre where that makes further collapses likelier.
  void improve(std::uint32_t v);
  /// Moves and turns a fibre so that the triangles of both sides around it are seen better: that leaves more room for
  /// others.
  void settle(std::uint32_t v);
  /// Moves a fibre's ends to the middle of those around it, as far as that goes: ends on even surfaces merge best.
  void even_out(std::uint32_t v);
  /// Lengthens a fibre by a share of its length at both ends, or else at one.
  void lengthen(std::uint32_t v, double share);
  /// Moves one end outwards along the fibre by so many lattice steps, or a half, a quarter, an eighth of them where
  /// that fails; by `least` at least, and not beyond the lattice. True where it was moved.
  bool extend(std::uint32_t v, Side side, double steps, double least);
  /// Makes a fibre reach so many lattice steps from its place on each side, by Side. True where it does then.
  bool reach_to(std::uint32_t v, const std::array<double, 2>& reach);
  /// Puts a fibre's place and ends there. True where they are there then.
  bool put(std::uint32_t v, Vec3d at, const Ends& ends);

  /// Of a turn that fails, where nothing else is said.
  static constexpr int kTurnHalvings = 2;

 private:
  void begin(std::uint32_t v);
  /// Returns whether a fibre stands on a crease: it may turn, but stays there.
  [[nodiscard]] bool is_on_crease(std::uint32_t v) const { return creases_ != nullptr && creases_->hold(draft_.at[v]); }
  bool try_ends(Vec3d at, const Ends& ends);
  bool turn_to_source();
  bool turn_towards(Vec3d to, int halvings = kTurnHalvings);
  void slide_to_middle();
  void trim();

  const SourceIndex& source_;
  LinkedDraft& draft_;
  SlabChecks& checks_;
  double longest_;
  const Creases* creases_;  // that fibres stay on; none: there are none
};

}  // namespace relief::detail
