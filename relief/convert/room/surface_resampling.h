// The old surface on fibres that have moved.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/room.h>
#include <relief/convert/room/fibre_lengthening.h>

#include <cstddef>
#include <span>
#include <vector>

namespace relief::detail {

struct Resampled {
  std::vector<MovedTile> tiles;
  /// Moved fibres beside which the surface leaves the slabs or is not met well enough; there are no tiles then.
  std::vector<FibreId> unmet;
  std::vector<SampledAnew> sampled;  ///< as in RoomMade
  double moved_most = 0;             ///< from the new surface to the old one, outside the solids; model units
};
/// Samples all layers of `slabs`, ascending, all those around moved fibres. `mesh` is the cage with these. The surface
/// outside the solids may move by `most_moved`, model units.
[[nodiscard]] Resampled resample(const Snapshot& surface, const SlabMesh& mesh, const Lengthened& longer,
                                 std::span<const SlabId> slabs, const RoomWanted& wanted, double most_moved,
                                 const Progress& progress);

}  // namespace relief::detail
