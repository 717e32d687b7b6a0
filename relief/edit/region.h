// Which slabs a tool works on: those that hang together inside its sphere, on the side that faces it.
#pragma once

#include <relief/core/snapshot.h>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace relief::detail {

struct Sphere {
  Vec3d centre;
  double radius;
};

/// False only when no point of the slab up to `highest` along its fibres lies in the sphere, or the fibres point to the
/// other side than `normal`.
[[nodiscard]] bool may_reach(const SlabCorners& corners, double highest, const Sphere& sphere, Vec3d normal) noexcept;

/// Up to where a slab counts along its fibres, and how far around the sphere, model units.
struct Extent {
  Extent(double top, double margin = 0) noexcept
      : highest(top), beside(margin) {}  // NOLINT(google-explicit-constructor)
  double highest, beside;
};

/// Grows from slab to slab; keeps its buffers from dab to dab.
class Region {
 public:
  explicit Region(const SlabMesh& mesh) { take(mesh); }
  /// Goes on in another cage.
  void take(const SlabMesh& mesh);

  /// Returns the slabs that hang together with the seed inside the sphere and whose fibres point to `normal`'s side,
  /// ascending; the seed is always one. `extent` says where a slab is to be met.
  std::span<const SlabId> grow(const SlabMesh& mesh, SlabId seed, const Sphere& sphere, Vec3d normal,
                               const std::function<Extent(SlabId)>& extent);

 private:
  std::uint32_t round_ = 0;
  std::vector<std::uint32_t> seen_slabs_, seen_fibres_;  ///< number of the round that last looked there
  std::vector<SlabId> reached_;
};

}  // namespace relief::detail
