// Displacement and colour of every sample, from rays along the fibres.
#pragma once

#include <relief/base/paged_memory.h>
#include <relief/base/progress.h>
#include <relief/convert/geometry/lattice.h>
#include <relief/convert/sample/source_rays.h>
#include <relief/core/snapshot.h>
#include <relief/mesh/triangle_mesh.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace relief::detail {

/// The distinct samples of a cage at m intervals per edge (kOwnIntervals: each slab's own). Each has the number of its
/// copy in the lowest slab, slab by slab and row by row. A constrained sample counts as distinct.
class SampleNumbers {
 public:
  /// The mesh must outlive it.
  SampleNumbers(const SlabMesh& mesh, int m);

  [[nodiscard]] int intervals(SlabId s) const noexcept { return m_ != kOwnIntervals ? m_ : mesh_->intervals(s); }
  /// Returns the first number that a slab's copies may have.
  [[nodiscard]] std::size_t begin(SlabId s) const noexcept { return begin_[s]; }
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
  /// Returns the copy that has a number.
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

/// Returns the fibre of a slab at the barycentric weights w. The corners are lattice points, whose coordinates on the
/// lattice are exact; places between them would be rounded by the distance from the model's origin.
[[nodiscard]] inline Line fibre_at(const SlabCorners& corners, const Lattice& lattice,
                                   const std::array<double, 3>& w) noexcept {
  const auto at = [&](const std::array<Vec3d, 3>& ends) {
    return corners.weighted({lattice.to_lattice(ends[0]), lattice.to_lattice(ends[1]), lattice.to_lattice(ends[2])}, w);
  };
  const Vec3d in = at(corners.inner);
  return {in, at(corners.outer) - in};
}

/// Holds what fibres are cut with.
struct SampleSource {
  const SourceRays& surface;
  const Lattice& lattice;
  std::size_t phantom_from;  ///< the first of the triangles that close openings
};

struct HitCount {
  std::size_t single = 0, none = 0, several = 0;
  [[nodiscard]] std::size_t all() const noexcept { return single + none + several; }
  HitCount& operator+=(const HitCount& b) noexcept {
    single += b.single;
    none += b.none;
    several += b.several;
    return *this;
  }
};

/// How a fibre meets the source: once, several times, just beyond one of its ends, not at all.
enum class Met : std::uint8_t { Once, Often, Beyond, Never };

/// Holds what the fibres of one slab met on its grid, row by row.
struct SlabSamples {
  int intervals;
  std::vector<float> alpha;
  std::vector<float> steepness;  ///< lattice steps by which the surface moves along its normal per unit of alpha
  std::vector<Met> met;
  std::vector<std::uint8_t> is_void;  ///< met a fill triangle

  explicit SlabSamples(int n)
      : intervals(n),
        alpha(sample_count(n)),
        steepness(sample_count(n)),
        met(sample_count(n)),
        is_void(sample_count(n)) {}
};

/// Says where samples lie (see Tile), and what is known of them until they are settled.
struct SampleMemory {
  std::shared_ptr<PagedMemory> tiles, scratch;
};

/// Holds what is kept of a slab's samples; in scratch memory except for the tile.
struct SlabAlpha {
  std::shared_ptr<Tile> tile;
  std::span<Met> met;               ///< empty where all met the source once
  std::span<std::uint8_t> is_void;  ///< empty where none is
};
struct SampledAlpha {
  std::vector<SlabAlpha> slabs;
  std::vector<int> intervals;  ///< by slab: of its tile
  HitCount hits;               ///< of all samples that were cast, shared ones once
};

/// Casts one ray per sample of some slabs along its fibre, and settles multiple and missing hits by the slab's own
/// samples. A sample depends on the fibres of its slab alone, one on an edge on its two. So copies in two slabs have
/// the same bits where both hit once. In the order of `slabs`; empty when cancelled.
[[nodiscard]] std::vector<SlabSamples> sample_slabs(const SlabMesh& mesh, std::span<const SlabId> slabs,
                                                    const SampleSource& source, const Progress& progress);

/// Casts one ray per sample of `finest` along its fibre, and keeps every 2^k-th along the edges, with n as `choose`
/// says. Of several hits the outermost front exit counts. A fibre without a hit gets the end that the source passes
/// just beyond. Memory: what is kept. Empty when cancelled.
[[nodiscard]] SampledAlpha sample_alpha(const SlabMesh& finest, const SampleSource& source,
                                        const std::function<int(const SlabSamples&)>& choose,
                                        const SampleMemory& memory, const Progress& progress);

/// Returns where fibres met the source several times, takes another crossing if the samples around, met once, speak for
/// it; where they never met it, fills the samples smoothly from around them. The mesh has the n that were chosen. The
/// same for any number of threads. False when cancelled.
[[nodiscard]] bool settle_alpha(const SlabMesh& mesh, const SampleSource& source, std::vector<SlabAlpha>& slabs,
                                const SampleMemory& memory, const Progress& progress);

/// Casts further fibres, spread evenly over all slabs, until with those `already` cast there are a million.
[[nodiscard]] HitCount count_hits(const SlabMesh& mesh, const SampleSource& source, std::size_t already,
                                  const Progress& progress);

/// A tile of colour and its planes. The planes are fetched before threads write: asking a tile is not thread-safe.
struct ColourTile {
  const Tile* tile;
  std::uint16_t* planes;
};
/// Writes the colours of `coloured`, whose surface `source` is, into the tiles of colour, by slab at the intervals of
/// `numbers`. Each comes from where the fibre crosses it nearest to the displaced surface, else from the nearest point.
/// The orientation of triangles does not matter. False when cancelled.
[[nodiscard]] bool sample_colour(const Snapshot& model, const SampleNumbers& numbers, const SourceRays& source,
                                 const Lattice& lattice, const TriangleMesh& coloured,
                                 std::span<const ColourTile> tiles, const Progress& progress);

}  // namespace relief::detail
