// RELIEF_ASSERT states what the caller owes; it stays on in release builds and ends the program with the place and the
// words.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace relief::detail {
[[noreturn]] inline void assertion_failed(const char* condition, const char* file, int line) noexcept {
  std::fprintf(stderr, "relief: broken assumption %s at %s:%d\n", condition, file, line);
  std::abort();
}
}  // namespace relief::detail

#define RELIEF_ASSERT(condition) \
  ((condition) ? static_cast<void>(0) : ::relief::detail::assertion_failed(#condition, __FILE__, __LINE__))
