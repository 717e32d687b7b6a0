// CPU time: what work cost, whatever else the machine was doing.
#pragma once

#include <cstdint>
#include <ctime>

namespace relief {

namespace detail {
[[nodiscard]] inline std::uint64_t clock_ns(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<std::uint64_t>(now.tv_sec) * 1'000'000'000U + static_cast<std::uint64_t>(now.tv_nsec);
}
}  // namespace detail

/// Of the calling thread, ns.
[[nodiscard]] inline std::uint64_t thread_cpu_ns() noexcept { return detail::clock_ns(CLOCK_THREAD_CPUTIME_ID); }
/// Of the calling thread, s.
[[nodiscard]] inline double thread_cpu_seconds() noexcept { return static_cast<double>(thread_cpu_ns()) * 1e-9; }
/// Of all threads of the process, s.
[[nodiscard]] inline double process_cpu_seconds() noexcept {
  return static_cast<double>(detail::clock_ns(CLOCK_PROCESS_CPUTIME_ID)) * 1e-9;
}

}  // namespace relief
