// What dabs take, beside what they may take.
#pragma once

#include "../figures.h"

#include <relief/base/error.h>

#include <nlohmann/json.hpp>

#include <string>

namespace relief::bench {

/// Whole dabs of every tool at three sizes, beside a plain mesh; through the engine with a mouse's pick; with more and
/// more slabs; cuts beside the exact ball; what strokes keep in memory and in a file. `figures` as figure() makes
/// them, with `percentiles` and `more` (numbers by their names, such as how many samples changed).
/// Errors: as from convert() and ModelFile.
[[nodiscard]] Result<nlohmann::ordered_json> measure_dabs(Extent extent);

/// The same as lines for people: the figures beside their goals, and how they were taken.
[[nodiscard]] std::string dab_text(const nlohmann::ordered_json& dab);

}  // namespace relief::bench
