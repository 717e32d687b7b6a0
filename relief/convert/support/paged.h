// A value whose arrays lie in temporary files while nobody needs them.
#pragma once

#include <relief/base/free_memory.h>
#include <relief/base/paged_memory.h>
#include <relief/mesh/triangle_mesh.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

namespace relief {

/// Returns what a mesh has per point and per triangle; images and notes stay in memory.
[[nodiscard]] inline auto arrays_of(TriangleMesh& mesh) noexcept {
  return std::tie(mesh.positions, mesh.triangles, mesh.colours, mesh.material_of, mesh.uvs);
}

}  // namespace relief

namespace relief::detail {

/// Holds a value whose arrays rest() takes out of the resident set (see PagedMemory); whoever asks for the value next
/// has them back. An array for which no file is available stays where it is. `arrays_of(T&)`, found beside T, names the
/// arrays as a tuple of references; their entries are trivially copyable. One thread.
template <typename T>
class Paged {
 public:
  Paged() = default;
  /// `pages`: whether rest() does anything.
  explicit Paged(T value, bool pages = true) : value_(std::move(value)), pages_(pages) {}

  /// Returns the value, in memory: back from the files where it was there. References hold until the next rest().
  [[nodiscard]] T& get() {
    page_in();
    return value_;
  }
  [[nodiscard]] const T& get() const {
    page_in();
    return value_;
  }
  [[nodiscard]] T take() && {
    page_in();
    return std::move(value_);
  }
  /// Nobody needs the value for now.
  void rest() {
    if (!pages_ || !resting_.empty()) return;
    std::apply([&](auto&... arrays) { (page_out(arrays), ...); }, arrays_of(value_));
  }
  [[nodiscard]] bool pages() const noexcept { return pages_; }

 private:
  struct Resting {
    std::unique_ptr<PagedMemory> memory;  ///< none: the array stayed
    void* first = nullptr;
    std::size_t count = 0;
  };

  template <typename E>
    requires std::is_trivially_copyable_v<E>
  void page_out(std::vector<E>& array) {
    Resting& at = resting_.emplace_back();
    auto memory = std::make_unique<PagedMemory>(0);
    auto* const first =
        static_cast<E*>(memory->allocate(std::max<std::size_t>(array.size(), 1) * sizeof(E), alignof(E)));
    if (memory->file_bytes() == 0) return;
    at = {std::move(memory), first, array.size()};
    copy(array.data(), first, at.count, *at.memory, first);
    at.memory->rest_all();
    free_memory(array);
  }
  template <typename E>
  static void page_in(std::vector<E>& array, Resting at) {
    if (at.memory == nullptr) return;
    array.resize(at.count);
    auto* const first = static_cast<E*>(at.first);
    copy(first, array.data(), at.count, *at.memory, first);
  }
  /// One array after the other: little is in memory twice.
  void page_in() const {
    if (resting_.empty()) return;
    auto at = resting_.begin();
    std::apply([&](auto&... arrays) { (page_in(arrays, std::move(*at++)), ...); }, arrays_of(value_));
    resting_.clear();
  }
  /// In pieces, of which few are resident in the file at a time.
  template <typename E>
  static void copy(const E* from, E* to, std::size_t count, PagedMemory& memory, const E* in_file) {
    constexpr std::size_t kPiece =
        (std::size_t{1} << 20) / sizeof(E);  // 1 MiB, a quarter of what PagedMemory waits for
    for (std::size_t k = 0; k < count; k += kPiece) {
      const std::size_t size = std::min(kPiece, count - k);
      std::copy_n(from + k, size, to + k);
      memory.rest_at(in_file + k, size * sizeof(E));
    }
  }

  mutable T value_{};
  mutable std::vector<Resting> resting_;  // by array; none: all are in memory
  bool pages_ = false;
};

}  // namespace relief::detail
