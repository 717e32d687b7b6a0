// Arrays that give back what they hold.
#pragma once

#include <vector>

namespace relief {

/// Empties arrays and gives their memory back, which to assign {} does not.
template <typename... T>
void free_memory(std::vector<T>&... arrays) noexcept {
  ((arrays = std::vector<T>()), ...);
}

}  // namespace relief
