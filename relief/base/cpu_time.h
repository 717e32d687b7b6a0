// CPU time: what work cost, whatever else the machine was doing; and the time that passed meanwhile.
#pragma once

#include <chrono>
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

/// From when it was made.
class Stopwatch {
 public:
  /// Of all threads of the process, s.
  [[nodiscard]] double cpu() const noexcept { return process_cpu_seconds() - cpu_; }
  /// As time passed, s.
  [[nodiscard]] double wall() const noexcept {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_).count();
  }

 private:
  double cpu_ = process_cpu_seconds();
  std::chrono::steady_clock::time_point wall_ = std::chrono::steady_clock::now();
};

}  // namespace relief
