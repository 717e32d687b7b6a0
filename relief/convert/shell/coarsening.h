// Makes slabs fewer and thicker by steps of which each keeps all conditions.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/shell/patch.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

namespace relief::detail {

/// Shares of the time that slabs take until the cells of a partition are swept, and until the whole shell is.
inline constexpr double kCellsSwept = 0.6, kAllSwept = 0.8;

/// Chooses which edges of a patch are collapsed and flipped and which fibres move, and when it is enough.
class Coarsening {
 public:
  /// As in ShellPatch.
  Coarsening(const SourceIndex& source, const BoxTree& tree, double longest, ShellDraft&& draft, const Box3d& room,
             const Progress& progress);

  [[nodiscard]] std::size_t slab_count() const noexcept { return patch_.slab_count(); }
  /// From now on slabs keep edges along creases. They must outlive it.
  void follow(const Creases& creases) noexcept { patch_.follow(creases); }
  /// Slabs that could change at the start.
  [[nodiscard]] std::size_t free_count() const noexcept { return patch_.free_count(); }
  /// Collapses edges in the order in which they lie in memory until `stop` slabs are left or few collapses succeed. The
  /// edges of low cost go first, in some sweeps. False when cancelled.
  bool sweep(std::size_t stop, const Progress& progress);
  /// Collapses edges by cost, with rounds of moves in between, of a draft without fixed fibres. False when cancelled.
  /// After sweep().
  bool reduce(std::size_t target_count, const Progress& progress);
  /// From now on that much may be given up, and more is tried to make slabs fewer.
  void tolerate(const Tolerance& tolerance);
  /// Returns the share of the source's area that lies in no slab; of a triangle that is partly in one half counts.
  [[nodiscard]] double lost() const;
  /// Makes room to carve and to add, with fibres of so many lattice steps at most, and walls that hold creases. False
  /// when cancelled. Nothing can be collapsed after that.
  bool thicken(double longest, const Creases& creases, const Progress& progress);

  [[nodiscard]] const LinkedDraft& draft() const noexcept { return patch_.draft(); }
  /// It is of no more use then.
  [[nodiscard]] ShellDraft take_draft() && { return std::move(patch_).take_draft(); }
  /// Returns whether a fibre could change and has, or a slab around it.
  [[nodiscard]] bool has_changed(std::uint32_t v) const noexcept {
    return draft().is_free(v) && draft().changed[v] > LinkedDraft::kAtFirst;
  }

 private:
  struct Candidate {
    double cost;
    std::uint32_t u, v, stamp_u, stamp_v;
    friend bool operator<(const Candidate& a, const Candidate& b) noexcept {
      if (a.cost != b.cost) return a.cost > b.cost;
      return a.u != b.u ? a.u > b.u : a.v > b.v;
    }
  };

  [[nodiscard]] EdgeOperators edges() noexcept;
  [[nodiscard]] bool is_untried(std::uint32_t h) const noexcept { return draft().changed_at(h) > tried_[h]; }
  /// Notes that nothing can be done about an edge until something around it changes; or that this is not so.
  void note_tried(std::uint32_t h, std::uint32_t when) noexcept { tried_[h] = tried_[draft().twins[h]] = when; }
  [[nodiscard]] double cost_above(double share) const;
  [[nodiscard]] Candidate candidate(std::uint32_t h) const noexcept;
  void fill_queue();
  bool empty_queue(std::size_t target_count, const std::function<void()>& report, const Progress& progress);
  bool collapse_candidate(const Candidate& candidate);
  bool improve_all(const Progress& progress);
  bool lengthen_all(const Progress& progress);
  void flip_all();

  ShellPatch patch_;
  StartGrowth growth_;
  bool thorough_ = false;                // each slab less is worth more work
  std::vector<std::uint32_t> tried_;     // per half-edge: when its collapse last failed
  std::vector<std::uint32_t> improved_;  // per fibre: when it last was
  std::vector<std::uint32_t> stamps_;    // per fibre: counts its merges; candidates with older ones are stale
  std::size_t few_ = 0;                  // at so many slabs or less more is tried
  std::size_t swept_to_ = 0;             // where the last sweep was to end
  std::vector<Candidate> queue_;         // a heap
};

}  // namespace relief::detail
