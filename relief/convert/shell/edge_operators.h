// Edges that are collapsed and flipped while the slabs around them stay valid.
#pragma once

#include <relief/convert/shell/creases.h>
#include <relief/convert/shell/fibre_height.h>

#include <cstdint>
#include <optional>

namespace relief::detail {

/// Returns what collapsing an edge costs, and where the merged fibre would stand best.
[[nodiscard]] Merge collapse_cost(const LinkedDraft& draft, std::uint32_t u, std::uint32_t v) noexcept;

/// Says how much work a collapse is worth.
struct Effort {
  bool patient = false;   ///< more heights and all directions are tried
  bool thorough = false;  ///< further places and directions are
};

/// Collapses and flips of free edges of a draft. Each is made only where all local checks pass; nothing else changes.
/// What it is given must outlive it.
class EdgeOperators {
 public:
  /// `longest`: of a fibre, lattice steps. `creases`: they stay, unless the effort is thorough.
  EdgeOperators(const SourceIndex& source, LinkedDraft& draft, SlabChecks& checks, StartGrowth& growth, double longest,
                Effort effort = {}, const Creases* creases = nullptr) noexcept
      : source_(source),
        draft_(draft),
        checks_(checks),
        growth_(growth),
        longest_(longest),
        effort_(effort),
        creases_(creases) {}

  /// Merges one end of an edge into the other, which stays as it is, where that costs little more than `most`: tests
  /// half as many slabs as collapse(), which is to be tried next.
  bool half_edge_collapse(std::uint32_t h, double most);
  /// Merges the ends of an edge into a new fibre in the place of its origin.
  bool collapse(std::uint32_t h);
  /// Turns an edge where that gives better shaped triangles or more even valences.
  bool flip(std::uint32_t h);

 private:
  bool collapse_somewhere(std::uint32_t h, bool may_lose);
  bool collapse_to(std::uint32_t h, Vec3d at, double shape_before, bool may_lose);
  [[nodiscard]] bool is_worth_flipping(std::uint32_t h) const;
  /// Returns whether creases stay where an edge is collapsed to a place.
  [[nodiscard]] bool keeps_creases(std::uint32_t h, Vec3d at) const;
  void merge(std::uint32_t h, Vec3d at);

  const SourceIndex& source_;
  LinkedDraft& draft_;
  SlabChecks& checks_;
  StartGrowth& growth_;
  double longest_;
  Effort effort_;
  const Creases* creases_;    // none: there are none
  std::optional<Vec3d> aim_;  // of the star in hand: the direction that best sees the source
};

}  // namespace relief::detail
