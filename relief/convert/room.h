// More clay under the surface, and more air above it, where a tool wants them: fibres of the cage are made longer and
// turned, and the surface as it stands is sampled again on them.
#pragma once

#include <relief/base/error.h>
#include <relief/base/progress.h>
#include <relief/core/room.h>
#include <relief/core/snapshot.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace relief {

/// Says how much clay there shall be below and above the surface after a change of fibres.
struct RoomGoals {
  double diagonal = 0;    ///< of the source, model units; what follows are shares of it
  double margin = 0.015;  ///< clay below what is cut, and air above what is filled
  double longest = 0.4;   ///< of a fibre; none that is longer is made longer still
  /// Of the surface outside the solids, by sampling it again; fibres that would do more stay.
  double most_moved = 2e-3;
  /// Whether the solids are what tools cut and fill: then the surface moves by no more than half of what these may miss
  /// untold, too. Else they only say where clay is wanted.
  bool for_tools = true;
  /// Tools fade out in the last of the clay. So a cut wants this share of what lies below the surface, and at least so
  /// many sample spacings, where that exceeds the margin.
  double fade_share = 0.1, fade_spacings = 2;
};

/// A fibre of the cage with its new ends.
struct MovedFibre {
  FibreId fibre = 0;  ///< which one
  Fibre now;          ///< where it lies now
};

/// The new samples of a slab in a layer.
struct MovedTile {
  Layer layer = Layer::Displacement;  ///< which field
  SlabId slab = kNoSlab;              ///< which slab
  TilePtr tile;                       ///< its new samples
};

/// Says where a slab still ends before what was wanted of it.
struct RoomLack {
  SlabId slab = kNoSlab;  ///< which slab
  Vec3d near;             ///< where the surface lies there
  double lack = 0;        ///< how much longer the fibre there would have to be, model units
  /// From `near` along the fibre to where it would have to end at least, model units.
  Vec3d way = {};
  bool cuts = true;  ///< the lack is below the surface, else above it
};

/// Holds what was made for a wish. Nothing has moved where there was room before, or nothing could be made that passes
/// all tests.
struct RoomMade {
  std::vector<MovedFibre> moved;     ///< by ascending number
  std::vector<MovedTile> tiles;      ///< of every layer, for all slabs around a moved fibre; ascending within a layer
  std::vector<RoomLack> before;      ///< slabs that lacked room, with the worst place of each
  std::vector<RoomLack> after;       ///< and those that still do
  std::size_t lengthened = 0;        ///< fibres that reach further
  std::size_t turned = 0;            ///< fibres that point elsewhere
  std::size_t given_up = 0;          ///< fibres that had to stay because the surface could not be sampled along them
  std::vector<SampledAnew> sampled;  ///< the slabs of these tiles, ascending
  double surface_moved = 0;  ///< how far the surface lies from the old one at most, outside the solids; model units
  /// Fibres that lean may reach a solid that lies beside the surface above them, and tools then cut all that is
  /// between: the widest such distance, model units. Longer fibres reach further.
  double overhang_before = 0, overhang_after = 0;
  Vec3d overhang_at;       ///< the surface where overhang_after is, model units; zero where that is 0
  bool on_lattice = true;  ///< false: the cage has no lattice that is coarse enough to test it exactly
  /// Where roots were halved first: the same surface on that cage, whose numbers all but `before` has; else null.
  SnapshotPtr split;
  HalvedRoots halved;  ///< which
};

/// Makes room for solids: inner triangles come to lie a margin below cuts, outer ones above fills. Fibres are
/// lengthened, then turned; each step keeps C1 to C4 of the whole cage, tested exactly
/// (docs/explanation/conversion.md). Where that does not reach, though the form does, roots of the cage are halved and
/// it is tried again. All layers around are sampled again. Deterministic. Errors: Cancelled,
/// InvalidArgument (a solid, goal or diagonal that is not finite).
[[nodiscard]] Result<RoomMade> make_room(const Snapshot& surface, const RoomWanted& wanted, const RoomGoals& goals,
                                         const Progress& progress = {});

/// Returns the snapshot with the fibres and tiles that make_room() made from it; it shares all other tiles. O(slabs).
/// The same snapshot where nothing has moved. Errors: Corrupt (not made from this snapshot).
[[nodiscard]] Result<SnapshotPtr> with_room(const SnapshotPtr& surface, const RoomMade& made);

/// Says what a stroke meets where it has no room.
struct RoomBarred {
  RoomBar by = RoomBar::None;  ///< what it is
  double distance = 0;         ///< from `at` along the line that is looked along, model units; 0 for fibres
  Vec3d at = {};               ///< the surface there, model units; zero where nothing bars the way
};
/// Returns what bars the way where the stroke goes deepest into what is in its way. First it looks along the axis of
/// each solid that slabs lack room for, from the surface above the deepest point of a cut or below a filling, so that
/// fibres have no say. Where that meets nothing, it looks from where each slab lacks most: along the axis of the solid
/// that goes farthest there, or along the fibre where only a leaning fibre meets one. `surface`, `wanted` and `goals`
/// are what the room was made from. A few rays for each solid and each slab that lacks.
[[nodiscard]] RoomBarred room_barred(const Snapshot& surface, const RoomWanted& wanted, const RoomMade& made,
                                     const RoomGoals& goals);

/// Both together, for a document (see DocumentSettings::make_room). Where the source's diagonal is not known (0), that
/// of the cage of each surface takes its place, so that who repeats a recording has the same.
[[nodiscard]] RoomMaker room_maker(double source_diagonal);

}  // namespace relief
