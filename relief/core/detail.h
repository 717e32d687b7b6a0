// Finer grids where tools work: slabs that are cut in four and tiles with more intervals, on the surface as it is.
#pragma once

#include <relief/base/error.h>
#include <relief/core/query.h>
#include <relief/core/snapshot.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace relief {

/// The least intervals that the tile of one slab in one layer is to have.
struct GridWanted {
  Layer layer = Layer::Displacement;  ///< which field
  SlabId slab = kNoSlab;              ///< which slab
  int intervals = 0;                  ///< intervals per edge that it needs
};

/// Cuts in their order, numbered as in SlabMesh::cut(), and grids of the slabs that there are after them. Void and
/// Folded follow the displacement.
struct Detail {
  std::vector<SlabId> cuts;       ///< slabs to cut in four, in this order
  std::vector<GridWanted> grids;  ///< grids to make finer
  /// Returns whether nothing is to change.
  [[nodiscard]] bool empty() const noexcept { return cuts.empty() && grids.empty(); }
};

/// Returns the same surface on finer grids. Intervals are doubled as often as `detail` wants, and where slabs would not
/// fit otherwise (SlabMesh::refined). Old samples keep their values; new ones lie on the triangles around them, to the
/// rounding of a float. Holes may grow by half a spacing. Unchanged slabs keep their tiles. Errors: those of
/// SlabMesh::cut() and refined(), InvalidArgument (no such slab, over kMaxIntervals).
[[nodiscard]] Result<SnapshotPtr> with_detail(const SnapshotPtr& model, const Detail& detail);

/// Holds what with_detail() does, worked out once for several snapshots of one cage whose layers have the same grids:
/// those of an open stroke go to one new cage together.
class DetailChange {
 public:
  /// Errors: those of with_detail().
  [[nodiscard]] static Result<DetailChange> make(const SnapshotPtr& model, const Detail& detail);
  /// Says which part of a slab of `model` each slab of another cage is, which lies on the same fibres between fibres
  /// (`origins`, RootPlace::root is that slab), and its intervals by layer: those of a part can_carry() its slab's.
  [[nodiscard]] static DetailChange of_parts(const Snapshot& model, std::shared_ptr<const SlabMesh> after,
                                             std::vector<RootPlace> origins,
                                             std::array<std::vector<int>, kLayerCount> intervals);
  /// Returns the model, or one with other values on the same grids, in the new cage.
  [[nodiscard]] SnapshotPtr of(const Snapshot& model) const;
  /// Returns the cage after the change.
  [[nodiscard]] const SlabMesh& slab_mesh() const noexcept { return *after_; }
  /// Returns which slab of the cage before a slab is of, and which part of it: that one stands for the root.
  [[nodiscard]] const RootPlace& origin(SlabId s) const noexcept { return origins_[s]; }
  /// Of a slab's tile.
  [[nodiscard]] int intervals(Layer layer, SlabId s) const noexcept {
    return intervals_[static_cast<std::size_t>(layer)][s];
  }

 private:
  std::vector<RootPlace> origins_;                       ///< by slab
  std::array<std::vector<int>, kLayerCount> intervals_;  ///< by slab; empty for layers that the model lacks
  std::shared_ptr<const SlabMesh> after_;
};

/// Holds what must be known of a slab to find its places in other cages: its own cage may be gone by then.
struct SlabOrigin {
  /// number() and roots_number() of its cage
  std::uint64_t cage = 0, roots = 0;
  SlabId slab = kNoSlab;  ///< the slab, as numbered in that cage
  RootPlace place;        ///< where it lies in its root

  SlabOrigin() = default;
  /// Where slab s of a cage lies.
  SlabOrigin(const SlabMesh& mesh, SlabId s) noexcept
      : cage(mesh.number()), roots(mesh.roots_number()), slab(s), place(mesh.root_place(s)) {}
};

// ---- The rule by which samples are carried to finer grids. Files leave out what it gives: who changes it gives the
// new one another number, and leaves this one for what was written before.
inline constexpr int kCarryRule = 1;

/// Of each slab after cuts of a cage of `before` slabs: the slab that it is a part of (as `root`), and which part.
/// Every cut is of a slab that there is by then, none kMaxLevel times or more.
[[nodiscard]] std::vector<RootPlace> parts_after(SlabId before, std::span<const SlabId> cuts);
/// Returns the same of a cage that was cut from another.
[[nodiscard]] inline std::vector<RootPlace> parts_after(const SlabMesh& before, const SlabMesh& after) {
  return parts_after(before.slab_count(), after.cuts().subspan(before.cuts().size()));
}
/// Of how many intervals a grid of n becomes with each cut of its slab.
[[nodiscard]] constexpr int after_cuts(int n, int times) noexcept {
  for (; times > 0 && n % 2 == 0; --times) n /= 2;
  return n;
}
/// Returns whether the grid of m intervals of a part has all samples of its slab's grid of n that lie in it.
[[nodiscard]] constexpr bool can_carry(int n, const RootPlace& part, int m) noexcept {
  return (m << part.level) % n == 0;
}
/// Returns the part of a tile on a grid of m intervals, which can_carry(). Between the tile's samples, values lie on
/// the plane of the three around; for Void and Folded the value with at least half of the weight counts.
[[nodiscard]] std::shared_ptr<Tile> part_of(const Tile& tile, Layer layer, const RootPlace& part, int m);

/// Returns the place in another cage that a place in one has; empty where their roots differ. Coordinates up to a
/// slab's size outside lead to the nearest child. Exact; a place in the middle of an edge belongs to one slab there. No
/// allocation, no lock; some nanoseconds per level.
[[nodiscard]] std::optional<SlabCoord> heir(const SlabMesh& from, const SlabMesh& to, const SlabCoord& at) noexcept;
/// Returns the same for a place in the slab of which this is known.
[[nodiscard]] std::optional<SlabCoord> heir(const SlabOrigin& from, const SlabMesh& to, const SlabCoord& at) noexcept;

}  // namespace relief
