// Counts what a servo tick may not do: allocate, free, lock, call the system. Replaces the global operator new and
// delete, malloc and its kin, and the locks of pthread in the whole test program, so exactly one source file of a
// program includes this.
#pragma once

#include <dlfcn.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <pthread.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <ucontext.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <vector>

namespace relief::testing {

struct ForbiddenCalls {
  int news = 0, deletes = 0;
  int mallocs = 0, frees = 0;  ///< those below new and delete, too; a realloc is one of each
  int locks = 0;               ///< of a mutex or a read-write lock, taken or only tried
  int system_calls = 0;        ///< but for reading a clock and for sleeps; once watch_system_calls() was true
  int sleeps = 0;              ///< clock_nanosleep, once a tick and between ticks allowed to a loop

  /// All that no tick may do.
  [[nodiscard]] int total() const noexcept { return news + deletes + mallocs + frees + locks + system_calls; }
};
inline constinit thread_local ForbiddenCalls* watched_calls = nullptr;

/// While it lives, the calls of this thread are counted. Does not nest.
class WatchedCalls {
 public:
  WatchedCalls() noexcept { watched_calls = &calls_; }
  WatchedCalls(const WatchedCalls&) = delete;
  WatchedCalls& operator=(const WatchedCalls&) = delete;
  ~WatchedCalls() { watched_calls = nullptr; }
  [[nodiscard]] const ForbiddenCalls& calls() const noexcept { return calls_; }

 private:
  mutable ForbiddenCalls calls_;  ///< written through watched_calls, also for a const scope
};

/// False under the sanitizers, which bring their own malloc and locks, and whose own calls would be seen: then only new
/// and delete are counted.
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
inline constexpr bool kCountsEverything = false;
#else
inline constexpr bool kCountsEverything = true;
#endif

namespace detail {

inline void count(int ForbiddenCalls::* kind) noexcept {
  if (watched_calls != nullptr) ++(watched_calls->*kind);
}
[[gnu::noinline]] inline void* counted_new(std::size_t size, std::size_t alignment) {
  count(&ForbiddenCalls::news);
  void* memory = alignment <= alignof(std::max_align_t)
                     ? std::malloc(size == 0 ? 1 : size)
                     : std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
[[gnu::noinline]] inline void counted_delete(void* memory) noexcept {
  count(&ForbiddenCalls::deletes);
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

extern "C" {

// glibc's own, under the names that it keeps for those who replace the public ones.
// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming)
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* memory);
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)

[[gnu::visibility("default")]] void* malloc(std::size_t size) noexcept {
  relief::testing::detail::count(&relief::testing::ForbiddenCalls::mallocs);
  return __libc_malloc(size);
}
[[gnu::visibility("default")]] void* calloc(std::size_t count, std::size_t size) noexcept {
  relief::testing::detail::count(&relief::testing::ForbiddenCalls::mallocs);
  return __libc_calloc(count, size);
}
[[gnu::visibility("default")]] void* realloc(void* memory, std::size_t size) noexcept {
  relief::testing::detail::count(&relief::testing::ForbiddenCalls::mallocs);
  relief::testing::detail::count(&relief::testing::ForbiddenCalls::frees);
  return __libc_realloc(memory, size);
}
[[gnu::visibility("default")]] void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  relief::testing::detail::count(&relief::testing::ForbiddenCalls::mallocs);
  return __libc_memalign(alignment, size);
}
[[gnu::visibility("default")]] int posix_memalign(void** memory, std::size_t alignment, std::size_t size) noexcept {
  relief::testing::detail::count(&relief::testing::ForbiddenCalls::mallocs);
  *memory = __libc_memalign(alignment, size);
  return *memory == nullptr ? ENOMEM : 0;
}
[[gnu::visibility("default")]] void free(void* memory) noexcept {
  relief::testing::detail::count(&relief::testing::ForbiddenCalls::frees);
  __libc_free(memory);
}

}  // extern "C"

namespace relief::testing::detail {

/// The next definition of a function that this program replaces. `next` is no guarded static: its guard may lock.
template <typename Function>
Function* next_of(Function*& next, const char* name) noexcept {
  if (next == nullptr) next = reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
  return next;
}
using MutexCall = int(pthread_mutex_t*);
using RwlockCall = int(pthread_rwlock_t*);
inline constinit MutexCall *next_lock = nullptr, *next_trylock = nullptr;
inline constinit RwlockCall *next_rdlock = nullptr, *next_wrlock = nullptr;

}  // namespace relief::testing::detail

extern "C" {

[[gnu::visibility("default")]] int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
  using namespace relief::testing;
  detail::count(&ForbiddenCalls::locks);
  return detail::next_of(detail::next_lock, "pthread_mutex_lock")(mutex);
}
[[gnu::visibility("default")]] int pthread_mutex_trylock(pthread_mutex_t* mutex) noexcept {
  using namespace relief::testing;
  detail::count(&ForbiddenCalls::locks);
  return detail::next_of(detail::next_trylock, "pthread_mutex_trylock")(mutex);
}
[[gnu::visibility("default")]] int pthread_rwlock_rdlock(pthread_rwlock_t* lock) noexcept {
  using namespace relief::testing;
  detail::count(&ForbiddenCalls::locks);
  return detail::next_of(detail::next_rdlock, "pthread_rwlock_rdlock")(lock);
}
[[gnu::visibility("default")]] int pthread_rwlock_wrlock(pthread_rwlock_t* lock) noexcept {
  using namespace relief::testing;
  detail::count(&ForbiddenCalls::locks);
  return detail::next_of(detail::next_wrlock, "pthread_rwlock_wrlock")(lock);
}

}  // extern "C"

#endif

#if defined(__x86_64__) && !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__)

extern "C" {
/// Calls the system from the one place that the kernel's filter lets through. Returns what the kernel returns.
long relief_call_system(long number, long a, long b, long c, long d, long e, long f);
/// The address that the kernel sees such a call come from.
extern const char relief_called_system;  // NOLINT(readability-identifier-naming)
}
asm(R"(
  .pushsection .text
relief_call_system:
  movq %rdi, %rax
  movq %rsi, %rdi
  movq %rdx, %rsi
  movq %rcx, %rdx
  movq %r8, %r10
  movq %r9, %r8
  movq 8(%rsp), %r9
  syscall
relief_called_system:
  ret
  .popsection
)");

namespace relief::testing {
namespace detail {

/// The kernel stopped a system call: it is counted, and then made. (That a call changes the signal mask does not last
/// beyond this; a thread that is watched must start neither thread nor process.)
inline void on_system_call(int /*signal*/, siginfo_t* info, void* context) {
  count(info->si_syscall == SYS_clock_nanosleep ? &ForbiddenCalls::sleeps : &ForbiddenCalls::system_calls);
  auto& registers = static_cast<ucontext_t*>(context)->uc_mcontext.gregs;
  registers[REG_RAX] = relief_call_system(info->si_syscall, registers[REG_RDI], registers[REG_RSI], registers[REG_RDX],
                                          registers[REG_R10], registers[REG_R8], registers[REG_R9]);
}

}  // namespace detail

/// From here on each system call of this thread that a WatchedCalls sees is counted, for good. False where the system
/// does not offer that.
[[nodiscard]] inline bool watch_system_calls() {
  // A stack of its own, since a thread that ends gives back the rest of its own one.
  static thread_local std::array<std::byte, 65536> stack;
  stack_t own{};
  own.ss_sp = stack.data();
  own.ss_size = stack.size();
  struct sigaction action = {};
  action.sa_sigaction = detail::on_system_call;
  action.sa_flags = SA_SIGINFO | SA_ONSTACK;
  if (sigaltstack(&own, nullptr) != 0 || sigaction(SIGSYS, &action, nullptr) != 0) return false;

  const auto from = reinterpret_cast<std::uintptr_t>(&relief_called_system);
  std::vector<sock_filter> program = {BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr))};
  for (const int allowed : {SYS_clock_gettime, SYS_rt_sigreturn, SYS_exit, SYS_exit_group}) {
    program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<unsigned>(allowed), 0, 1));
    program.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
  }
  constexpr unsigned kFrom = offsetof(seccomp_data, instruction_pointer);  // its low half comes first
  program.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kFrom));
  program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<unsigned>(from), 0, 3));
  program.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kFrom + 4));
  program.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<unsigned>(from >> 32U), 0, 1));
  program.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
  program.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRAP));
  const sock_fprog filter = {static_cast<unsigned short>(program.size()), program.data()};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) == 0;
}

}  // namespace relief::testing

#else

namespace relief::testing {
[[nodiscard]] inline bool watch_system_calls() { return false; }
}  // namespace relief::testing

#endif
