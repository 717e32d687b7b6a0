// How single calls are timed, and what is said of many.
#pragma once

#include <relief/base/cpu_time.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

namespace relief::bench {

/// Percentiles of many single measurements, times `scale`.
inline nlohmann::ordered_json percentiles(std::vector<double> values, double scale) {
  std::ranges::sort(values);
  const auto at = [&](double q) {
    return values.empty()
               ? 0.0
               : values[std::min(values.size() - 1, static_cast<std::size_t>(q * static_cast<double>(values.size())))] *
                     scale;
  };
  return {{"count", values.size()}, {"p50", at(0.5)},    {"p90", at(0.9)},
          {"p99", at(0.99)},        {"p999", at(0.999)}, {"max", values.empty() ? 0.0 : values.back() * scale}};
}

/// Times single calls on the clock of the thread's CPU time, which stands still while another thread has the core. What
/// two readings of the clock take, some 0.5 us, is taken off. Seconds, in steps of the clock, often 10 ns.
class CallTimer {
 public:
  CallTimer() {
    for (int k = 0; k < 10'000; ++k) {
      const std::uint64_t before = thread_cpu_ns();
      empty_ = std::min(empty_, thread_cpu_ns() - before);
    }
  }
  template <typename Call>
  double operator()(Call&& call) const {
    const std::uint64_t before = thread_cpu_ns();
    call();
    const std::uint64_t took = thread_cpu_ns() - before;
    return static_cast<double>(took - std::min(took, empty_)) * 1e-9;
  }

 private:
  std::uint64_t empty_ = std::numeric_limits<std::uint64_t>::max();  ///< ns
};

}  // namespace relief::bench
