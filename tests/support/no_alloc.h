// Counts what a servo tick may not do: allocate, free, lock. Replaces the global operator new and delete and watches
// pthread_mutex_lock in the whole test program, so exactly one source file of a program includes this.
#pragma once

#include <dlfcn.h>
#include <pthread.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>

namespace relief::testing {

struct ForbiddenCalls {
  int news = 0, deletes = 0, locks = 0;
};
inline thread_local ForbiddenCalls* watched_calls = nullptr;

/// While it lives, the calls of this thread are counted. Does not nest.
class NoAllocScope {
 public:
  NoAllocScope() noexcept { watched_calls = &calls_; }
  NoAllocScope(const NoAllocScope&) = delete;
  NoAllocScope& operator=(const NoAllocScope&) = delete;
  ~NoAllocScope() { watched_calls = nullptr; }
  [[nodiscard]] const ForbiddenCalls& calls() const noexcept { return calls_; }

 private:
  mutable ForbiddenCalls calls_;  ///< written through watched_calls, also for a const scope
};

/// False under the sanitizers, which bring their own pthread_mutex_lock.
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
inline constexpr bool kCountsLocks = false;
#else
inline constexpr bool kCountsLocks = true;
#endif

namespace detail {
[[gnu::noinline]] inline void* counted_new(std::size_t size, std::size_t alignment) {
  if (watched_calls != nullptr) ++watched_calls->news;
  void* memory = alignment <= alignof(std::max_align_t)
                     ? std::malloc(size == 0 ? 1 : size)
                     : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
[[gnu::noinline]] inline void counted_delete(void* memory) noexcept {
  if (watched_calls != nullptr) ++watched_calls->deletes;
  std::free(memory);
}
}  // namespace detail
}  // namespace relief::testing

void* operator new(std::size_t size) { return relief::testing::detail::counted_new(size, 1); }
void* operator new[](std::size_t size) { return relief::testing::detail::counted_new(size, 1); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return relief::testing::detail::counted_new(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return relief::testing::detail::counted_new(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept { relief::testing::detail::counted_delete(memory); }
void operator delete[](void* memory) noexcept { relief::testing::detail::counted_delete(memory); }
void operator delete(void* memory, std::size_t /*size*/) noexcept { relief::testing::detail::counted_delete(memory); }
void operator delete[](void* memory, std::size_t /*size*/) noexcept { relief::testing::detail::counted_delete(memory); }
void operator delete(void* memory, std::align_val_t /*alignment*/) noexcept {
  relief::testing::detail::counted_delete(memory);
}
void operator delete[](void* memory, std::align_val_t /*alignment*/) noexcept {
  relief::testing::detail::counted_delete(memory);
}
void operator delete(void* memory, std::size_t /*size*/, std::align_val_t /*alignment*/) noexcept {
  relief::testing::detail::counted_delete(memory);
}
void operator delete[](void* memory, std::size_t /*size*/, std::align_val_t /*alignment*/) noexcept {
  relief::testing::detail::counted_delete(memory);
}

#if !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__)
extern "C" [[gnu::visibility("default")]] int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  using Lock = int (*)(pthread_mutex_t*);
  static Lock next = nullptr;  // not a guarded static: its guard may lock
  if (next == nullptr) next = reinterpret_cast<Lock>(dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  if (relief::testing::watched_calls != nullptr) ++relief::testing::watched_calls->locks;
  return next(mutex);
}
#endif
