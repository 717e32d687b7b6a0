// What frames take, beside what they may take.
#pragma once

#include "../figures.h"

#include <relief/base/error.h>

#include <nlohmann/json.hpp>

#include <string>

namespace relief::bench {

/// Whole frames beside a classic renderer, memory, frames of a stroke, of a moving camera and of nothing, and what the
/// display takes to follow a dab. `figures` as figure() makes them. Errors: as from convert() and FrameRenderer.
[[nodiscard]] Result<nlohmann::ordered_json> measure_frames(Extent extent);

/// The same as lines for people.
[[nodiscard]] std::string frames_text(const nlohmann::ordered_json& frames);

}  // namespace relief::bench
