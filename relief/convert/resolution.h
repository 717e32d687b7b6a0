// How many samples each slab needs.
#pragma once

#include <relief/convert/sampling.h>

#include <cstddef>
#include <vector>

namespace relief::detail {

/// Per slab the n, a power of two, at which its samples lie at least twice as dense as the corners of the source in it;
/// 8 to 128.
[[nodiscard]] std::vector<int> finest_intervals(const SlabMesh& cage, const SampleSource& source);

/// Per slab the smallest n, its own over a power of two and at least 4, at which the surface through those samples
/// stays within `error` (lattice steps, square to the surface) of all samples; its own where a hole begins in it.
/// `too_coarse` counts the slabs that keep their n, so that finer samples might show more error.
[[nodiscard]] std::vector<int> choose_intervals(const SlabMesh& fine, const SampleNumbers& numbers,
                                                const AlphaField& field, double error, std::size_t& too_coarse);

}  // namespace relief::detail
