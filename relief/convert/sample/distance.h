// How far the displaced surface lies from another, and back.
#pragma once

#include <relief/convert/convert.h>
#include <relief/convert/geometry/lattice.h>
#include <relief/convert/sample/source_rays.h>
#include <relief/core/query.h>
#include <relief/core/snapshot.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

/// Says where a slab is farthest off.
struct Farthest {
  double distance = 0;  ///< lattice steps
  float u = 0, v = 0;   ///< to one part in 10^7; places on a grid whose n is a power of two exactly

  Farthest() = default;
  Farthest(double how_far, double at_u, double at_v) noexcept
      : distance(how_far), u(static_cast<float>(at_u)), v(static_cast<float>(at_v)) {}
};
struct Measured {
  Distance distance;            ///< lattice steps
  std::vector<Farthest> slabs;  ///< by slab
};

/// The displaced surface of a model, stitched and without its holes. Root mean squares are taken over an even choice of
/// 12,000 points. The greatest distances are looked for everywhere: what lies nearer than a bound that is quickly
/// found cannot be the greatest. The same for any number of threads; without meaning when cancelled.
class MeasuredSurface {
 public:
  /// Both must outlive it.
  MeasuredSurface(const Snapshot& model, const Lattice& lattice, const Progress& progress);

  /// Where the samples of the first surface lie. OnIt: on the other surface; the greatest distance is searched in the
  /// micro-triangles that the bends around them allow to lie farthest off. Anywhere: in the middles of all
  /// micro-triangles that are not known to be nearer.
  enum class Samples { OnIt, Anywhere };
  [[nodiscard]] Measured to(const SourceRays& other, Samples samples, const Progress& progress) const;
  /// From points spread over these triangles, by area, and from all their corners, to this surface; they are in model
  /// units, and what is not finite is left out. Of those outside all slabs, where there are very many, a choice.
  [[nodiscard]] Measured from(std::span<const Vec3d> points, std::span<const Face> faces,
                              const Progress& progress) const;
  /// Returns whether a place of another surface has its like here. `ray`, in model units, starts at the place and is as
  /// long as its reach; it looks along the normal of the place both ways. What answers is the solid that the slabs
  /// stand on, where this surface follows it, or this surface; or the solid anywhere within `moved`, model units, by
  /// which it may have been moved aside. Some 2 us, 20 where nothing answers.
  [[nodiscard]] bool answers(const Ray3d& ray, const SourceRays& solid, double moved, LocateHint& hint) const;

 private:
  using Cell = std::array<GridPoint, 3>;
  struct BentCell {
    double bend = -1;  ///< how far its inside may lie from what the samples lie on, lattice steps; below 0: no cell
    std::array<std::array<std::uint8_t, 2>, 3> at{};

    BentCell() = default;
    BentCell(double how_far, const Cell& corners) noexcept;
    [[nodiscard]] Cell corners() const noexcept;
  };
  static_assert(kMaxIntervals < 256);
  struct Place {
    Vec3d position;  ///< model units
    SlabId slab;
    double u, v;
  };
  /// The slab that a point lies in, kNoSlab outside all, and how far it is from the surface at most, model units.
  struct Near {
    double most = 0;
    SlabId slab = kNoSlab;
  };
  /// The most bent first, as many as there is room for.
  void find_bent(SlabId s, std::span<BentCell> bent) const;
  [[nodiscard]] std::size_t slabs() const noexcept { return model_.slab_mesh().slab_count(); }
  [[nodiscard]] std::vector<Place> even_places() const;
  /// To the micro-triangles so many cells about the place where the point lies in its slab, and beyond the edges that
  /// are as near.
  [[nodiscard]] Near distance_within(Vec3d model_point, int reach, LocateHint& hint) const;
  /// Whether a slab holds a place of the solid, and its surface is there within reach or, of all that its fibre meets,
  /// nearest to the place: it is for want of samples that it lies farther off then. Holes count like the rest.
  [[nodiscard]] bool follows(Vec3d at, const SourceRays& solid, double reach, LocateHint& hint) const;
  [[nodiscard]] double square_within(SlabId slab, double u, double v, Vec3d model_point, int reach) const;
  /// Done with the tiles of a slab, and of about so many others.
  void rest(SlabId s, std::size_t others = 0) const noexcept;
  [[nodiscard]] Near along_the_fibre(Vec3d model_point, LocateHint& hint) const;
  const Snapshot& model_;
  const Lattice& lattice_;
  std::size_t room_ = 0;        // for a slab's bent cells
  std::vector<BentCell> bent_;  // by slab
  std::size_t cells_ = 0;       // of all slabs
};

}  // namespace relief::detail
