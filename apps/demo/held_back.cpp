#include "held_back.h"

#include <relief/core/query.h>

#include <algorithm>
#include <cstddef>
#include <utility>

namespace relief::demo {

double longest_held_back(std::span<const ServoSample> trace, const Snapshot& before, const Snapshot& after) {
  constexpr std::size_t kStride = 10;  // ticks
  constexpr double kFarther = 1.5;     // what no slide over a scan reaches (S23)
  const double least = 1e-4 * length(before.slab_mesh().bounds().size());
  PickHint at_before, at_after;
  const auto nearest = [](const Snapshot& model, Vec3d p, PickHint& hint) {
    return length(closest_point(model, p, hint).position - p);
  };
  double longest = 0, since = 0;
  bool held_back = false;
  for (std::size_t k = 0; k < trace.size(); k += kStride) {
    const ServoSample& s = trace[k];
    const double near =
        s.contact ? std::max(nearest(before, s.cursor, at_before), nearest(after, s.cursor, at_after)) : 0;
    const bool is_held = s.contact && s.depth > kFarther * near + least;
    if (!std::exchange(held_back, is_held)) since = s.t;
    if (is_held) longest = std::max(longest, s.t - since);
  }
  return longest;
}

}  // namespace relief::demo
