// Clay that does not end: what its acceptance table asks for, each figure beside its goal.
#pragma once

#include "../figures.h"

#include <relief/base/error.h>

#include <nlohmann/json.hpp>

#include <string>

namespace relief::bench {

/// Clay of default conversions; small balls, cuts of 5 and 9 % of the diagonal and repeated work in them; what finer
/// grids cost and move; what readers cost on them; a stroke by the screen's frames. `figures` as figure() makes them.
/// Models: scans of the test data where they are at hand, else the samples; Form: one small sample. Errors: as from
/// convert().
[[nodiscard]] Result<nlohmann::ordered_json> measure_clay(Extent extent);

/// The same as lines for people.
[[nodiscard]] std::string clay_text(const nlohmann::ordered_json& clay);

/// What queries, ticks and dabs cost where slabs were cut, as shares of what they cost on uncut slabs of the same
/// spacing, in one run.
[[nodiscard]] nlohmann::ordered_json measure_readers(Extent extent);

}  // namespace relief::bench
