// Memory for arrays that together may be more than should stay resident.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <limits>
#include <memory_resource>
#include <mutex>
#include <span>
#include <type_traits>
#include <vector>

namespace relief {

/// Gives ordinary memory up to a limit, and beyond it pages of a temporary file that has no name: in $TMPDIR, or else
/// in /var/tmp or /tmp. Where no such file can be made or grow, it goes on with ordinary memory. Whoever is done with a
/// piece says so by rest(); every few MiB all pages of the file then leave the resident set, and come back, with what
/// was written to them, when they are touched again. Pieces lie close together, and are given back all at once, with
/// it. Any thread.
class PagedMemory final : public std::pmr::memory_resource {
 public:
  static constexpr std::size_t kNoLimit = std::numeric_limits<std::size_t>::max();

  explicit PagedMemory(std::size_t in_memory) noexcept : left_(in_memory) {}
  PagedMemory(const PagedMemory&) = delete;
  PagedMemory& operator=(const PagedMemory&) = delete;
  ~PagedMemory() override;

  /// Zeros. Nothing takes them apart again.
  template <typename T>
    requires std::is_trivial_v<T>
  [[nodiscard]] std::span<T> zeros(std::size_t count) {
    T* const first = static_cast<T*>(allocate(count * sizeof(T), alignof(T)));
    std::fill_n(first, count, T{});
    return {first, count};
  }
  /// So many pieces of so many bytes are done with, for now. Others may be reading or writing them.
  void rest(std::size_t bytes, std::size_t pieces = 1) noexcept;
  /// The same for the piece that begins here. What goes from one piece to the next asks for less of the file.
  void rest_at(const void* piece, std::size_t bytes) noexcept;
  /// All pieces are done with, for now.
  void rest_all() noexcept;
  /// Returns what it has taken of the file.
  [[nodiscard]] std::size_t file_bytes() const noexcept { return file_bytes_.load(std::memory_order_relaxed); }

 private:
  struct Chunk {
    std::byte* begin;
    std::size_t size;
    bool in_file;
  };
  void* do_allocate(std::size_t bytes, std::size_t alignment) override;
  void do_deallocate(void*, std::size_t, std::size_t) override {}
  [[nodiscard]] bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }
  void touched(std::size_t bytes) noexcept;
  void add_chunk(std::size_t least);
  /// Returns whether there is a file, and this much more of it.
  [[nodiscard]] bool lengthen_file(std::size_t size);

  std::mutex mutex_;
  std::size_t left_;  ///< of ordinary memory
  int file_ = -1;
  bool file_failed_ = false;
  std::vector<Chunk> chunks_;
  std::size_t used_ = 0;  ///< of the last chunk
  std::atomic<std::size_t> file_bytes_ = 0, touched_ = 0, last_around_ = 0;
};

}  // namespace relief
