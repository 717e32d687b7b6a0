// Stands before glibc's malloc in the whole program; not under the sanitizers, which bring their own.
#include "allocations.h"

namespace {
thread_local std::size_t allocated = 0;
}  // namespace

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
extern "C" {

// glibc's own, under the names that it keeps for those who replace the public ones.
// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming)
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)

[[gnu::visibility("default")]] void* malloc(std::size_t size) noexcept {
  allocated += size;
  return __libc_malloc(size);
}
[[gnu::visibility("default")]] void* calloc(std::size_t count, std::size_t size) noexcept {
  allocated += count * size;
  return __libc_calloc(count, size);
}
[[gnu::visibility("default")]] void* realloc(void* memory, std::size_t size) noexcept {
  allocated += size;
  return __libc_realloc(memory, size);
}
[[gnu::visibility("default")]] void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  allocated += size;
  return __libc_memalign(alignment, size);
}

}  // extern "C"
#endif

namespace relief::bench {

std::size_t allocated_bytes() noexcept { return allocated; }

}  // namespace relief::bench
