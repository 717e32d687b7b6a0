// How the tracked query's time grows with the number of slabs.
#pragma once

#include <nlohmann/json.hpp>

#include <span>

namespace relief::bench {

/// locate() and probe() on spheres of 20 * 4^levels slabs with n = 16, so that the shape stays and only the number of
/// slabs grows: ns of thread CPU time, of each of `frames` frames the least of three passes. The cursor goes 1e-4 of
/// the diagonal per frame, some 0.3 % of it below the surface.
[[nodiscard]] nlohmann::ordered_json growth(std::span<const int> levels, int frames);

}  // namespace relief::bench
