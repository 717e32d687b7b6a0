// Arrays that give back what they hold.
#pragma once

namespace relief {

/// Empties arrays and gives their memory back. To assign {} to a std::vector keeps it.
template <typename... Array>
void free_memory(Array&... arrays) noexcept {
  ((arrays = Array()), ...);
}

}  // namespace relief
