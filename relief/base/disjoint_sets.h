// Which of many things hang together.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace relief {

/// Sets of the numbers from 0 to count - 1, at first each by itself, that are joined two by two. A set goes by its
/// least number, so what is said of it does not depend on the order of joining. Nearly constant time per call (Tarjan).
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : above_(count) { std::iota(above_.begin(), above_.end(), 0U); }

  /// Returns the least number of the set that v is in.
  [[nodiscard]] std::uint32_t least(std::uint32_t v) noexcept {
    while (above_[v] != v) v = above_[v] = above_[above_[v]];
    return v;
  }
  void join(std::uint32_t v, std::uint32_t w) noexcept {
    const std::uint32_t a = least(v), b = least(w);
    above_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> above_;  ///< another of the same set, no greater
};

}  // namespace relief
