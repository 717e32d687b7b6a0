// How often a picture of the model's triangles covers each pixel.
#pragma once

#include "display_cache.h"
#include "picture.h"

namespace relief::detail {

/// Signed coverage per pixel: front faces +1, back faces -1, depth test off; 0 everywhere on a closed model without
/// cracks. The count of pixels covered, and of those that differ from 0.
struct SignedCoverage {
  std::uint64_t covered = 0, cracks = 0;
};
/// Context current. Error: Io.
[[nodiscard]] Result<SignedCoverage> signed_coverage(DisplayCache& cache, const DrawnLevels& detail,
                                                     const Camera& camera, int width, int height);

}  // namespace relief::detail
