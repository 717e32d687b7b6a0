// Smaller slabs under a tool: roots of the cage that are halved, so that fibres between them can turn and grow.
#pragma once

#include <relief/base/progress.h>
#include <relief/core/room.h>
#include <relief/core/snapshot.h>

#include <optional>
#include <vector>

namespace relief::detail {

/// The same surface on a cage in which roots were halved. The first half keeps the root's number, others follow the
/// last root; slabs that were cut from roots come after these. Old samples keep their values, and all outside the roots
/// that were halved are there bit for bit.
struct SplitRoots {
  SnapshotPtr model;
  std::vector<FibreId> fibres;  ///< the new ones, whose stars nobody has tested
  HalvedRoots halved;           ///< how numbers change
  /// The surface lies no farther from the old one outside the solids, model units: triangles between the samples are
  /// others.
  double surface_moved = 0;
};

/// Halves roots whose surface lies in the solids, where it faces the tool, until none has an edge there that is longer
/// than kSplitEdge of the solid's radius; and as many beside them as it takes for slabs to meet along whole edges
/// (newest vertex bisection, Mitchell 1989). Every second time a grid gets half the intervals, so spacings stay. What
/// is cut in four already stays as it is. Empty where nothing can be halved, and when cancelled. Deterministic;
/// O(slabs) and about a millisecond for each root that is halved.
[[nodiscard]] std::optional<SplitRoots> split_roots(const Snapshot& surface, const RoomWanted& wanted,
                                                    const Progress& progress = {});

/// Of the radius of a solid: where slabs are wider, fibres that turn towards the tool meet those beside them. On deep
/// cuts into a scanned head, 0.9 and 0.3 reach fewer places than 0.45.
inline constexpr double kSplitEdge = 0.45;

/// Roots that are added at most. A ball takes some 250; more than eight balls side by side would take a second and
/// more, for which no tool waits.
inline constexpr SlabId kMostAdded = 2048;

}  // namespace relief::detail
