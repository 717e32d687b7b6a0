// Cuts with a ball, beside the exact ball and beside a plain mesh.
#pragma once

#include "../figures.h"

#include <relief/base/error.h>

namespace relief::bench {

/// On a flat sheet, a sphere and a converted pumpkin, balls of 6, 12 and 25 spacings of samples, exact and blended, and
/// a plain mesh of the same spacing whose vertices are clipped: figures with the rms distance of the cut surface from
/// the true one in spacings, the greatest, and how much the rim differs from its mean over half a radius each way
/// (`more`: max, rim ripple, rim ripple in degrees). And the ball of 0.5 % of the diagonal in a default conversion.
/// Errors: as from convert().
[[nodiscard]] Result<nlohmann::ordered_json> measure_cuts(Extent extent);

/// The rim of a ball of 12 spacings, cut into the sheet and the sphere after their grids were halved: how uneven its
/// height is, in spacings of before, and its normal.
[[nodiscard]] nlohmann::ordered_json measure_rims(Extent extent);

}  // namespace relief::bench
