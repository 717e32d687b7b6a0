// Arrays that nobody needs for a while.
#pragma once

#include <relief/base/free_memory.h>
#include <relief/base/paged_memory.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

namespace relief::detail {

/// Keeps what is in arrays in temporary files, out of the resident set (see PagedMemory), until it gives it back; the
/// arrays are empty meanwhile, and stay so when it is destroyed before that. An array for which no file can be had
/// stays as it is. One thread.
class LaidAside {
 public:
  /// The arrays must outlive it and stay where they are.
  template <typename... T>
    requires(std::is_trivially_copyable_v<T> && ...)
  void take(std::vector<T>&... arrays) {
    (take_one(arrays), ...);
  }
  /// One after the other: little is in memory twice.
  void give_back() {
    for (auto& restore : restores_) std::exchange(restore, nullptr)();
    restores_.clear();
  }

 private:
  template <typename T>
  void take_one(std::vector<T>& array) {
    const std::size_t count = array.size();
    auto memory = std::make_unique<PagedMemory>(0);
    auto* const kept = static_cast<T*>(memory->allocate(std::max<std::size_t>(count, 1) * sizeof(T), alignof(T)));
    if (memory->file_bytes() == 0) return;
    copy(array.data(), kept, count, *memory, kept);
    memory->rest_all();
    free_memory(array);
    restores_.emplace_back([&array, kept, count, memory = std::move(memory)] {
      array.resize(count);
      copy(kept, array.data(), count, *memory, kept);
    });
  }
  /// In pieces, of which few are resident in the file at a time.
  template <typename T>
  static void copy(const T* from, T* to, std::size_t count, PagedMemory& memory, const T* in_file) {
    constexpr std::size_t kPiece = (std::size_t{1} << 20) / sizeof(T);
    for (std::size_t k = 0; k < count; k += kPiece) {
      const std::size_t size = std::min(kPiece, count - k);
      std::copy_n(from + k, size, to + k);
      memory.rest_at(in_file + k, size * sizeof(T));
    }
  }

  std::vector<std::move_only_function<void()>> restores_;
};

}  // namespace relief::detail
