// What the verifier, which shares no code with the conversion, says of a conversion.
#pragma once

#include <relief/convert/convert.h>

#include <cstddef>

namespace relief::demo {

/// How many of the conditions C0 to C7 the verifier refuses, of the slabs and the mended source that they hold.
[[nodiscard]] std::size_t failed_conditions(const Conversion& made);

}  // namespace relief::demo
