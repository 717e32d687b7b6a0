// How single calls are timed, and what is said of many.
#pragma once

#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <vector>

namespace relief::bench {

/// Percentiles of many single measurements, in the unit given.
inline nlohmann::ordered_json percentiles(std::vector<double> values, double scale) {
  std::ranges::sort(values);
  const auto at = [&](double q) {
    return values.empty()
               ? 0.0
               : values[std::min(values.size() - 1, static_cast<std::size_t>(q * static_cast<double>(values.size())))] *
                     scale;
  };
  return {{"count", values.size()},
          {"p50", at(0.5)},
          {"p99", at(0.99)},
          {"p999", at(0.999)},
          {"max", values.empty() ? 0.0 : values.back() * scale}};
}

/// Single calls are timed on the steady clock, whose empty cost is taken off; preemption shows in the tail.
class CallTimer {
 public:
  CallTimer() {
    double least = 1;
    for (int k = 0; k < 1000; ++k) {
      const auto a = std::chrono::steady_clock::now();
      const auto b = std::chrono::steady_clock::now();
      least = std::min(least, std::chrono::duration<double>(b - a).count());
    }
    empty_ = least;
  }
  template <typename Call>
  double operator()(Call&& call) const {
    const auto a = std::chrono::steady_clock::now();
    call();
    const auto b = std::chrono::steady_clock::now();
    return std::max(0.0, std::chrono::duration<double>(b - a).count() - empty_);
  }

 private:
  double empty_ = 0;
};

}  // namespace relief::bench
