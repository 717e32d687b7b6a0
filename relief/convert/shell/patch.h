// A piece of a shell whose inner fibres may change while its rim stays.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/geometry/box_tree.h>
#include <relief/convert/shell/edge_operators.h>
#include <relief/convert/shell/fibre_moves.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

/// A draft over a source whose free fibres and edges may change under all local checks. Fixed fibres and slabs without
/// a free fibre keep their bits. The draft must hold every slab that a free one may reach: C3 is tested against these
/// alone. Without source triangles only C1 to C3 are tested. One thread.
class ShellPatch {
 public:
  /// Makes the fibres of slabs strictly within the room free; nothing that changes leaves the room. So patches with
  /// disjoint rooms may be worked on at once. `tree` holds boxes around the source's triangles, for slabs without a
  /// list (ShellDraft::from). `longest`: of a fibre, lattice steps. `source` must outlive the patch. Cancelled: discard
  /// it.
  ShellPatch(const SourceIndex& source, const BoxTree& tree, double longest, ShellDraft&& draft, const Box3d& room,
             const Progress& progress);
  /// Free are the fibres that are not `fixed`, by fibre, and not on a boundary loop of the draft. Nothing that changes
  /// leaves the room.
  ShellPatch(const SourceIndex& source, const BoxTree& tree, double longest, ShellDraft&& draft,
             std::span<const std::uint8_t> fixed, const Progress& progress, const Box3d& room = everywhere());

  [[nodiscard]] const LinkedDraft& draft() const noexcept { return draft_; }
  [[nodiscard]] std::size_t slab_count() const noexcept { return draft_.alive_count; }
  /// Slabs of which all corners could change at the start.
  [[nodiscard]] std::size_t free_count() const noexcept { return free_count_; }
  [[nodiscard]] const SourceIndex& source() const noexcept { return source_; }
  [[nodiscard]] double longest() const noexcept { return longest_; }
  [[nodiscard]] const Tolerance& tolerance() const noexcept { return checks_.tolerance(); }

  /// A free fibre whose star fails a check as it stands, and the first check that it fails.
  struct FibreFault {
    std::uint32_t fibre;
    Fault fault;
  };
  /// Tests the stars of all free fibres as they are: C1, C2, C3, C5, C6. Empty: all hold. A star or so many
  /// microseconds as it holds triangles, about.
  [[nodiscard]] std::vector<FibreFault> check();

  /// How far a fibre is to reach from its place on the surface (ShellDraft::at), by Side, lattice steps.
  using Reach = std::array<double, 2>;
  [[nodiscard]] Reach reach(std::uint32_t v) const noexcept;
  /// By fibre and side: the draft's clock when a step last failed.
  using FailedSteps = std::vector<std::uint32_t>;
  /// Lengthens free fibres until each reaches as far as wanted on both sides, the one that lacks most first. A step
  /// adds at most a quarter, and halves up to three times where a check fails. Ends move along their fibres; none
  /// shortens, or exceeds longest(). `wanted`: by fibre. What `failed` names is not tried until the star changes; it
  /// starts empty. False when cancelled; what was done stays.
  bool lengthen(std::span<const Reach> wanted, FailedSteps& failed, const Progress& progress);
  /// Turns free fibres towards the directions that best see the source around them, until none turns any more or a few
  /// times over. Returns how many turns were made.
  std::size_t re_aim(const Progress& progress);

  /// Single steps, for a caller that chooses where. What they return must not outlive the patch.
  [[nodiscard]] FibreMoves moves() noexcept { return {source_, draft_, checks_, longest_, creases_}; }
  [[nodiscard]] EdgeOperators edges(StartGrowth& growth, Effort effort) noexcept {
    return {source_, draft_, checks_, growth, longest_, effort, creases_};
  }

  /// From now on fibres on creases stay there. They must outlive the patch.
  void follow(const Creases& creases) noexcept { creases_ = creases.empty() ? nullptr : &creases; }
  /// From now on fibres may be so long, lattice steps.
  void allow(double longest) noexcept { longest_ = longest; }
  /// Puts the place of each free fibre (ShellDraft::at) where the source crosses it. `tree`: of boxes around the
  /// source's triangles.
  void place_on_source(const BoxTree& tree);
  /// From now on that much may be given up.
  void tolerate(const Tolerance& tolerance);
  /// Frees what only collapses need.
  void free_quadrics();
  /// The patch is of no more use then.
  [[nodiscard]] ShellDraft take_draft() && { return std::move(draft_); }

 private:
  void find_lists(const BoxTree& tree, const Progress& progress);

  const SourceIndex& source_;
  double longest_;
  LinkedDraft draft_;
  SlabChecks checks_;
  const Creases* creases_ = nullptr;
  std::size_t free_count_ = 0;
};

/// Returns a finished shell as a draft over a source, for a patch. The place of a fibre is where the source crosses it
/// first from outside, its middle where none does. `tree`: of boxes around the source's triangles.
[[nodiscard]] ShellDraft draft_of(const Shell& shell, const SourceIndex& source, const BoxTree& tree);

/// Returns where a source crosses a fibre first from outside; the fibre's middle where it does not.
[[nodiscard]] Vec3d surface_on(const Ends& fibre, const SourceIndex& source, const BoxTree& tree);
/// Returns how far it is from a place on a source to where the source is met next in a direction (a unit vector),
/// lattice steps, at most `most`.
[[nodiscard]] double depth_below(Vec3d surface, Vec3d inwards, double most, const SourceIndex& source,
                                 const BoxTree& tree);

/// Boxes around the triangles of a source.
[[nodiscard]] BoxTree tree_of(const SourceIndex& source);

}  // namespace relief::detail
