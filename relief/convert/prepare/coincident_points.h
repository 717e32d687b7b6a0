// Points that lie where others do, as where two corners touch.
#pragma once

#include <relief/convert/prepare/closed_source.h>

#include <cstddef>

namespace relief::detail {

/// Moves points that lie on others away from these, by 10 % of their shortest edge and at most `farthest`, but at least
/// by what two slabs need side by side. All in lattice steps. They move out of the solid behind their own faces where
/// the others lie in it, as at two notches that meet in a point; else into it. Returns how many.
std::size_t separate_coincident_points(ClosedSource& source, double farthest);

}  // namespace relief::detail
