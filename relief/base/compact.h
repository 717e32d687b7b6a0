// Leaves entries out of several arrays at once, in order.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace relief {

/// Keeps those entries k of arrays of one length for which stays(k), asked once for each, in order; says how many.
template <typename Stays, typename... Entries>
std::size_t keep_entries(Stays&& stays, std::vector<Entries>&... arrays) {
  const std::array<std::size_t, sizeof...(arrays)> sizes = {arrays.size()...};
  std::size_t kept = 0;
  for (std::size_t k = 0; k < sizes.front(); ++k) {
    if (!stays(k)) continue;
    ((arrays[kept] = arrays[k]), ...);
    ++kept;
  }
  (arrays.resize(kept), ...);
  return kept;
}

/// Leaves out the points that no triangle names, from arrays with an entry for each point, and numbers the corners
/// again. Says how many went. Corners must be points.
template <typename... Entries>
std::size_t drop_unused_points(std::vector<std::array<std::uint32_t, 3>>& triangles, std::vector<Entries>&... points) {
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  const std::array<std::size_t, sizeof...(points)> sizes = {points.size()...};
  std::vector<std::uint32_t> number(sizes.front(), kUnused);
  for (const auto& t : triangles)
    for (const std::uint32_t v : t) number[v] = 0;
  std::uint32_t used = 0;
  keep_entries(
      [&](std::size_t v) {
        if (number[v] == kUnused) return false;
        number[v] = used++;
        return true;
      },
      points...);
  for (auto& t : triangles)
    for (std::uint32_t& v : t) v = number[v];
  return number.size() - used;
}

}  // namespace relief
