// Counts what a piece of code asks of the heap.
#pragma once

#include <cstddef>

namespace relief::bench {

/// Bytes that this thread has asked of malloc and operator new so far, whatever it has given back. 0 under the
/// sanitizers.
[[nodiscard]] std::size_t allocated_bytes() noexcept;

}  // namespace relief::bench
