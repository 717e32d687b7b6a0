// The displaced surface of some slabs as it stands, to be sampled again on other fibres.
#pragma once

#include <relief/convert/sample/source_rays.h>
#include <relief/core/snapshot.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

/// A place in a slab, by weights of its corners 1 and 2.
struct SlabPlace {
  SlabId slab = kNoSlab;
  double u = 0, v = 0;
};

/// The micro-triangles of slabs, stitched, holes last; no vertex twice.
struct OldSurface {
  std::vector<Vec3d> points;  ///< model units
  std::vector<Face> faces;
  std::size_t phantom_from = 0;                   ///< the first hole
  std::vector<SlabId> slab_of;                    ///< by face
  std::vector<std::array<GridPoint, 3>> cell_of;  ///< by face, on the slab's own grid

  OldSurface(const Snapshot& surface, std::span<const SlabId> slabs);
  /// Of weights of a face's corners.
  [[nodiscard]] SlabPlace place(const Snapshot& surface, std::uint32_t face,
                                const std::array<double, 3>& weights) const noexcept;
};

}  // namespace relief::detail
