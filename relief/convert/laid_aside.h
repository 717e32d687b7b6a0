// Arrays that nobody needs for a while.
#pragma once

#include <relief/base/free_memory.h>
#include <relief/base/paged_memory.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <optional>
#include <type_traits>
#include <vector>

namespace relief::detail {

/// Keeps what is in arrays in a temporary file, out of the resident set (see PagedMemory), until it gives it back; the
/// arrays are empty meanwhile, and stay so when it is destroyed before that. One thread.
class LaidAside {
 public:
  /// The arrays must outlive it and stay where they are.
  template <typename... T>
    requires(std::is_trivially_copyable_v<T> && ...)
  void take(std::vector<T>&... arrays) {
    if (!memory_) memory_.emplace(0);
    (take_one(arrays), ...);
    memory_->rest_all();
  }
  void give_back() {
    for (const auto& restore : restores_) restore();
    restores_.clear();
    memory_.reset();
  }

 private:
  template <typename T>
  void take_one(std::vector<T>& array) {
    const std::size_t count = array.size();
    auto* const kept = static_cast<T*>(memory_->allocate(std::max<std::size_t>(count, 1) * sizeof(T), alignof(T)));
    copy(array.data(), kept, count, kept);
    free_memory(array);
    restores_.push_back([this, &array, kept, count] {
      array.resize(count);
      copy(kept, array.data(), count, kept);
    });
  }
  /// In pieces, of which few are resident in the file at a time.
  template <typename T>
  void copy(const T* from, T* to, std::size_t count, const T* in_file) {
    constexpr std::size_t kPiece = (std::size_t{1} << 20) / sizeof(T);
    for (std::size_t k = 0; k < count; k += kPiece) {
      const std::size_t size = std::min(kPiece, count - k);
      std::copy_n(from + k, size, to + k);
      memory_->rest_at(in_file + k, size * sizeof(T));
    }
  }

  std::optional<PagedMemory> memory_;
  std::vector<std::function<void()>> restores_;
};

}  // namespace relief::detail
