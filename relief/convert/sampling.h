// Displacement and colour of every sample, from rays along the fibres.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/lattice.h>
#include <relief/convert/source_surface.h>
#include <relief/core/snapshot.h>
#include <relief/mesh/triangle_mesh.h>

#include <array>
#include <cstddef>
#include <vector>

namespace relief::detail {

/// The distinct samples of a cage at n intervals per edge, each with a number: fibres first, then edges, then insides.
class SampleNumbers {
 public:
  SampleNumbers(const SlabMesh& mesh, int n);

  [[nodiscard]] int intervals() const noexcept { return n_; }
  [[nodiscard]] std::size_t count() const noexcept { return places_.size(); }
  [[nodiscard]] std::size_t of(SlabId s, GridPoint p) const noexcept {
    return numbers_[s * sample_count(n_) + sample_index(n_, p)];
  }
  /// One copy of each sample, by number: the one in the lowest slab.
  [[nodiscard]] const std::vector<SampleCopy>& places() const noexcept { return places_; }

 private:
  int n_;
  std::vector<std::uint32_t> numbers_;  // of every copy
  std::vector<SampleCopy> places_;
};

/// Values by sample number, and how the rays fared.
template <typename Value>
struct SampledField {
  std::vector<Value> values;
  std::size_t single = 0, none = 0, several = 0;
};

/// Casts one ray per sample along its fibre. Where it meets the source several times the outermost crossing that leaves
/// through the front is taken, unless the samples around, met once, speak for another. A fibre that does not meet the
/// source gets the nearer end where the source passes just beyond that end, else it is filled smoothly from around it.
/// The same for any number of threads. Values are empty when cancelled.
[[nodiscard]] SampledField<float> sample_alpha(const SlabMesh& mesh, const SampleNumbers& numbers,
                                               const SourceSurface& source, const Lattice& lattice,
                                               const Progress& progress);

/// The colour of `coloured`, whose surface `source` is, where the fibre crosses it nearest to the displaced surface, or
/// at the point nearest to that where it does not cross it there. Which way the source's triangles look is no matter.
[[nodiscard]] SampledField<std::array<float, 3>> sample_colour(const Snapshot& model, const SampleNumbers& numbers,
                                                               const SourceSurface& source, const Lattice& lattice,
                                                               const TriangleMesh& coloured, const Progress& progress);

/// Root mean square and greatest distance from the displaced surface to the source, in lattice steps, over an even
/// choice of samples and centres of micro-triangles.
struct Distances {
  double rms = 0, max = 0;
};
[[nodiscard]] Distances measure_distances(const Snapshot& model, const SourceSurface& source, const Lattice& lattice);

}  // namespace relief::detail
