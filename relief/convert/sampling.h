// Displacement and colour of every sample, from rays along the fibres.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/lattice.h>
#include <relief/convert/source_surface.h>
#include <relief/core/snapshot.h>
#include <relief/mesh/triangle_mesh.h>

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace relief::detail {

/// The distinct samples of a cage at m intervals per edge (kOwnIntervals: each slab's own), each with the number of its
/// copy in the lowest slab among all copies, slab by slab and row by row. A constrained sample counts as one of its
/// own.
class SampleNumbers {
 public:
  /// The mesh must outlive it.
  SampleNumbers(const SlabMesh& mesh, int m);

  [[nodiscard]] int intervals(SlabId s) const noexcept { return m_ != kOwnIntervals ? m_ : mesh_->intervals(s); }
  /// Above every number; copies in other slabs leave gaps.
  [[nodiscard]] std::size_t end() const noexcept { return begin_.back(); }
  [[nodiscard]] std::size_t of(SlabId s, GridPoint p) const noexcept {
    SampleCopy first;
    for_each_copy(s, p, [&](const SampleCopy& copy) {
      if (first.slab == kNoSlab) first = copy;
    });
    return begin_[first.slab] + sample_index(intervals(first.slab), first.at);
  }
  /// Calls visit(number, GridPoint) for the samples whose copy in this slab has the number.
  template <typename Visit>
  void for_each(SlabId s, Visit&& visit) const {
    const int n = intervals(s);
    std::size_t copy = begin_[s];
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i, ++copy)
        if (of(s, {i, j}) == copy) visit(copy, GridPoint{i, j});
  }
  /// The copy that has a number.
  [[nodiscard]] SampleCopy place(std::size_t number) const noexcept;
  /// As in SlabMesh.
  template <typename Visit>
  void for_each_copy(SlabId s, GridPoint p, Visit&& visit) const {
    mesh_->for_each_copy(s, [this](SlabId slab) { return intervals(slab); }, p, visit);
  }

 private:
  const SlabMesh* mesh_;
  int m_;
  std::vector<std::size_t> begin_;  // of each slab's copies, and the end
};

/// A fibre in lattice coordinates.
struct Line {
  Vec3d origin, direction;
};
/// The one of a slab at the barycentric weights w.
[[nodiscard]] inline Line fibre_at(const SlabCorners& corners, const Lattice& lattice,
                                   const std::array<double, 3>& w) noexcept {
  const Vec3d in = lattice.to_lattice(corners.weighted(corners.inner, w));
  return {in, lattice.to_lattice(corners.weighted(corners.outer, w)) - in};
}

/// What fibres are cut with.
struct SampleSource {
  const SourceSurface& surface;
  const Lattice& lattice;
  std::size_t phantom_from;  ///< the first of the triangles that close openings
};

struct HitCount {
  std::size_t single = 0, none = 0, several = 0;
  [[nodiscard]] std::size_t all() const noexcept { return single + none + several; }
};

/// By sample number.
struct AlphaField {
  std::vector<float> values;
  std::vector<float> steepness;       ///< lattice steps by which the surface moves along its normal per unit of alpha
  std::vector<std::uint8_t> is_void;  ///< met a phantom triangle
  std::vector<std::uint8_t> folded;   ///< met the source several times; empty where none did
  HitCount hits;
};

/// Casts one ray per sample along its fibre. Where it meets the source several times the outermost crossing that leaves
/// through the front is taken, unless the samples around, met once, speak for another. A fibre that does not meet the
/// source gets the nearer end where the source passes just beyond that end, else it is filled smoothly from around it.
/// The same for any number of threads. Values are empty when cancelled.
[[nodiscard]] AlphaField sample_alpha(const SlabMesh& mesh, const SampleNumbers& numbers, const SampleSource& source,
                                      const Progress& progress);

/// Casts further fibres, spread evenly over all slabs, until with those `already` cast there are a million.
[[nodiscard]] HitCount count_hits(const SlabMesh& mesh, const SampleSource& source, std::size_t already,
                                  const Progress& progress);

/// Writes into the tiles of colour, by slab and with the intervals of `numbers`, the colour of `coloured`, whose
/// surface `source` is, where the fibre crosses it nearest to the displaced surface, or at the point nearest to that
/// where it does not cross it there. Which way the source's triangles look is no matter. False when cancelled.
[[nodiscard]] bool sample_colour(const Snapshot& model, const SampleNumbers& numbers, const SourceSurface& source,
                                 const Lattice& lattice, const TriangleMesh& coloured, std::span<Tile* const> tiles,
                                 const Progress& progress);

}  // namespace relief::detail
