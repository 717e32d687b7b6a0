// Relief against its peers: the same surface, the same ways of the cursor, in one run.
#pragma once

#include <relief/core/snapshot.h>

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace relief::bench {

/// A path that slides over the surface `depth` below it: the nearest surface points of a great turn around the model.
[[nodiscard]] std::vector<Vec3d> slide_path(const Snapshot& model, double depth, int count);

/// Relief's queries and its contact, the paper's algorithm and the peers, on one surface and the same ways of the
/// cursor: slide, tap, press, jump. Times in ns per frame, warm and cold; memory, build times and accuracy beside them,
/// for each and on every way; what pushes with many points has no accuracy, the exact closest point is it.
/// Warm: of each frame the least of three passes, so that preemption goes and hard frames stay. Cold: 16 MB of other
/// memory are read and changed before each frame. `build_seconds`: CPU, of the conversion that made the model.
[[nodiscard]] nlohmann::ordered_json compare_on(const Snapshot& model, double build_seconds, int frames);

/// What compare_on() found on one or more surfaces, by their names, as lines for people.
[[nodiscard]] std::string comparison_table(const nlohmann::ordered_json& on_surfaces);

}  // namespace relief::bench
