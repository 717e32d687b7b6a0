// How many samples each slab needs.
#pragma once

#include <relief/convert/sampling.h>

#include <vector>

namespace relief::detail {

/// Per slab the n, a power of two, at which its samples lie at least twice as dense as the corners of the source in it;
/// 8 to 128, and not less than an even share of 500,000 samples comes to.
[[nodiscard]] std::vector<int> finest_intervals(const SlabMesh& cage, const SampleSource& source);

/// The m, a power of two, at which samples of colour lie at least twice as dense as the colours of the source do, its
/// corners or the pixels of its images, in all but the few slabs that have most of them; at most 128, and at most 16
/// samples for each colour of the source.
[[nodiscard]] int colour_intervals(const SlabMesh& cage, const SourceSurface& source, const Lattice& lattice,
                                   const TriangleMesh& coloured);

/// The smallest n, that of the samples over a power of two and at least 4, at which the surface through those samples
/// stays within `error` (lattice steps, square to the surface) of all samples; their own where a hole begins in them.
[[nodiscard]] int coarsest_intervals(const SlabSamples& samples, double error);

}  // namespace relief::detail
