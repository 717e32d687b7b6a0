// Lists as sets.
#pragma once

#include <algorithm>
#include <vector>

namespace relief::detail {

/// Brings the values into order and leaves one of each.
template <typename T>
void sort_unique(std::vector<T>& values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

}  // namespace relief::detail
