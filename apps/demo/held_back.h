// Whether contact held the hand back where it should have let it go on.
#pragma once

#include <relief/core/snapshot.h>
#include <relief/haptics/servo.h>

#include <span>

namespace relief::demo {

/// Returns the longest time, s, in which the tool, a point, was held by a place that lies more than 1.5 times as far
/// from it as the nearest one: so holds a contact point that got stuck behind an edge. The nearest place is sought on
/// the models `before` and `after` the strokes, and the farther of both counts. One tick in ten is looked at; about 5
/// us each.
[[nodiscard]] double longest_held_back(std::span<const ServoSample> trace, const Snapshot& before,
                                       const Snapshot& after);

}  // namespace relief::demo
