// What strokes keep: bytes in memory and in the file, and what saving and opening take.
#pragma once

#include "../figures.h"

#include <relief/base/error.h>

namespace relief::bench {

/// Bytes of a model per triangle, with one layer and with colour, and bytes that undo of a stroke of 250 dabs holds.
[[nodiscard]] nlohmann::ordered_json measure_memory(Extent extent);

/// Many short strokes through a model file, and the save of one stroke on a large model. The files are in the system's
/// folder for such, and removed. Errors: as from ModelFile.
[[nodiscard]] Result<nlohmann::ordered_json> measure_file(Extent extent);

}  // namespace relief::bench
