// How many samples each slab needs.
#pragma once

#include <relief/convert/sample/fibre_sampling.h>

#include <vector>

namespace relief::detail {

/// Returns per slab the n, a power of two from 8 to 128, that samples at least twice as densely as the source's corners
/// in it. All slabs together get at least an even share of 500,000 samples.
[[nodiscard]] std::vector<int> finest_intervals(const SlabMesh& cage, const SampleSource& source);

/// Returns the m, a power of two up to 128, that samples colour twice as densely as the source's corners or pixels in
/// nearly all slabs. At most 16 samples per colour of the source.
[[nodiscard]] int colour_intervals(const SlabMesh& cage, const SourceRays& source, const Lattice& lattice,
                                   const TriangleMesh& coloured);

/// Returns the smallest n, at least 4 and the samples' own over a power of two, whose surface stays within `error` of
/// all samples. `error`: lattice steps, perpendicular to the surface. A slab in which a hole begins keeps its n.
[[nodiscard]] int coarsest_intervals(const SlabSamples& samples, double error);

}  // namespace relief::detail
