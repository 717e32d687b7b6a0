// What touch takes, beside what it may take.
#pragma once

#include "figures.h"

#include <relief/base/error.h>

#include <nlohmann/json.hpp>

#include <string>

namespace relief::bench {

/// Touch on the sample pumpkin and on two scans, beside its peers, with every tool; with cold caches and in a loop at
/// 1 kHz; with more and more slabs; and its memory. `figures` holds one object per figure: name, surface, value, unit,
/// clock, what is also known of it, and where there is a goal, `goal` ({"at_most": x} or {"at_least": x}) and `met`.
/// Errors: as from convert().
[[nodiscard]] Result<nlohmann::ordered_json> measure_touch(Extent extent);

/// The same as lines for people: the figures beside their goals, how they were taken, the comparison with the peers.
[[nodiscard]] std::string touch_text(const nlohmann::ordered_json& touch);

}  // namespace relief::bench
