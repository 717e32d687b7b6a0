// Which slabs a tool needs on finer grids, and what must follow them.
#pragma once

#include <relief/core/detail.h>
#include <relief/edit/region.h>

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

namespace relief::detail {

/// A slab gets more intervals up to so many, then it is cut: tiles that are small under a small tool make cheap dabs.
inline constexpr int kMostIntervals = 32;

/// Holds what a tool asks of the grid of a layer.
struct Need {
  Layer layer = Layer::Displacement;
  Sphere sphere;       ///< where
  Vec3d up;            ///< unit, outwards on the side that the tool works on
  double spacing = 0;  ///< the largest that the tool takes, model units
};

/// Holds what a plan may add.
struct DetailBudget {
  std::size_t slabs, samples;  ///< samples of all layers
};

/// A plan for one dab. The cells to refine follow from the need and the surface at the stroke's start, whatever was
/// planned before. Cells beside them are cut as often as levels and grids must fit.
class RefinePlan {
 public:
  /// Plans for `model` on the cage as it is. `began` is the surface at the stroke's start, on the cage of that time.
  RefinePlan(const Snapshot& model, const Snapshot& began) : model_(model), began_(began) {}

  /// Returns whether any of these slabs is too coarse.
  [[nodiscard]] bool wanted(std::span<const SlabId> near, const Need& need) const;
  /// Plans for these slabs. `surface` gives the displacement that counts in a slab of the cage as it is. False where it
  /// would add more than the budget allows.
  [[nodiscard]] bool run(std::span<const SlabId> near, const Need& need,
                         const std::function<const Tile&(SlabId)>& surface, const std::function<bool(SlabId)>& touched,
                         const DetailBudget& budget);
  [[nodiscard]] bool empty() const noexcept { return new_cuts_ == 0 && !raises_; }
  /// Returns all that the stroke needs so far, from the cage that it found: values between samples then do not depend
  /// on the steps in which the grids became fine.
  [[nodiscard]] Detail since_began() const;

 private:
  /// Returns the longest edge of a slab on the surface, or twice that of one of the four that it would be cut into: an
  /// arch is longer than its chord.
  [[nodiscard]] double edge(const SlabMesh& mesh, SlabId s) const;
  [[nodiscard]] int& intervals(Layer layer, SlabId s) { return intervals_[static_cast<std::size_t>(layer)][s]; }
  /// Takes more intervals where that does; whether the slab must be cut.
  [[nodiscard]] bool settle(SlabId s, const Need& need);
  void add_coarser_neighbours(std::vector<SlabId>& cuts) const;
  /// Returns where slabs hang in the edge of one with more than twice their intervals, gives them more; names that one,
  /// to be cut, where they were touched or would get many: cuts add no samples.
  [[nodiscard]] std::vector<SlabId> fit_hanging(const std::function<bool(SlabId)>& touched);
  [[nodiscard]] bool cut(std::vector<SlabId>& cuts, const DetailBudget& budget);
  [[nodiscard]] std::size_t samples() const;

  const Snapshot& model_;
  const Snapshot& began_;
  std::shared_ptr<const SlabMesh> mesh_;  ///< with the cuts so far
  std::array<std::vector<int>, kLayerCount> intervals_;
  std::vector<RootPlace> parts_;  ///< by slab: of which slab of the cage as it is, and which part
  std::size_t new_cuts_ = 0;
  bool raises_ = false;
};

/// Returns how often the spacing of a slab is halved until it is small enough; `edge` long with n intervals.
[[nodiscard]] int halvings(double edge, int n, double spacing) noexcept;
/// Returns the longest edge of a slab of the cage of `began` as a plan counts it.
[[nodiscard]] double longest_edge(const Snapshot& began, SlabId s);

}  // namespace relief::detail
