// Where a contact stands on the surface, kept so that it is found again when the cage is another one.
#pragma once

#include <relief/core/detail.h>

#include <optional>

namespace relief {

class MicroTriangles;
struct SurfacePlace;

namespace detail {

/// Holds what is known of the slab in which something stands. Made for each tick: it costs next to nothing where the
/// slab is the last one, and neither allocates nor locks. The cage that it speaks of may be gone.
class Foothold {
 public:
  void stand_in(const SlabMesh& mesh, SlabId slab) noexcept;
  /// Returns whether the slab is one of this cage.
  [[nodiscard]] bool is_in(const SlabMesh& mesh) const noexcept { return origin_.cage == mesh.number(); }
  /// Of the slab's displacement, where it stands.
  [[nodiscard]] int intervals() const noexcept { return intervals_; }
  /// Finds the surface of a model where the place `at` of the slab was, which lay at `position`. In a cage of the same
  /// roots: the same place of the root. Otherwise: the nearest place within two sample spacings, else what the fibre
  /// through `position` meets. Empty where nothing is. `alpha` speeds it up. Cost: about 0.1 microseconds for the same
  /// roots, 1 to 4 for others.
  [[nodiscard]] std::optional<SurfacePlace> find(MicroTriangles& surface, const SlabCoord& at,
                                                 Vec3d position) const noexcept;

 private:
  [[nodiscard]] std::optional<SurfacePlace> find_near(MicroTriangles& surface, const SlabCoord& at,
                                                      Vec3d position) const noexcept;

  SlabOrigin origin_;
  int intervals_ = 0;
  double spacing_ = 0;  ///< of its samples at most, model units
};

/// Returns whether a contact of such a depth continues unchanged although the cage changed and the surface moved by so
/// much. The bound is below what anybody feels, even if it happens in every tick.
[[nodiscard]] constexpr bool stays_unfelt(double moved, double depth) noexcept { return moved <= 1e-4 * depth; }

}  // namespace detail
}  // namespace relief
