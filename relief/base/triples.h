// A view of triples of numbers, wherever they lie.
#pragma once

#include <array>
#include <cstddef>
#include <cstring>
#include <iterator>
#include <ranges>
#include <type_traits>

namespace relief {

/// The rows of an array, or what lies at the same place in each of a row of structures. Does not own them.
template <typename T>
  requires std::is_arithmetic_v<T>
class Triples {
 public:
  using value_type = std::array<T, 3>;

  Triples() = default;
  /// Three numbers at `first`, and each so many bytes after the last.
  Triples(const T* first, std::size_t count, std::size_t stride) noexcept
      : first_(reinterpret_cast<const std::byte*>(first)), count_(count), stride_(stride) {}
  /// Not of a temporary, whose rows would be gone.
  template <std::ranges::contiguous_range Rows>
    requires std::ranges::sized_range<Rows> && std::ranges::borrowed_range<Rows> &&
                 std::is_same_v<std::ranges::range_value_t<Rows>, value_type>
  Triples(Rows&& rows) noexcept
      : first_(reinterpret_cast<const std::byte*>(std::ranges::data(rows))), count_(std::ranges::size(rows)) {}

  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  [[nodiscard]] bool empty() const noexcept { return count_ == 0; }
  [[nodiscard]] value_type operator[](std::size_t k) const noexcept {
    value_type triple;
    std::memcpy(triple.data(), first_ + k * stride_, sizeof(triple));
    return triple;
  }

  class Iterator {
   public:
    using value_type = Triples::value_type;
    using difference_type = std::ptrdiff_t;
    using iterator_concept = std::forward_iterator_tag;

    Iterator() = default;
    Iterator(const Triples& of, std::size_t at) noexcept : of_(of), at_(at) {}
    [[nodiscard]] value_type operator*() const noexcept { return of_[at_]; }
    Iterator& operator++() noexcept {
      ++at_;
      return *this;
    }
    Iterator operator++(int) noexcept { return {of_, at_++}; }
    friend bool operator==(const Iterator& a, const Iterator& b) noexcept { return a.at_ == b.at_; }

   private:
    Triples of_;
    std::size_t at_ = 0;
  };
  [[nodiscard]] Iterator begin() const noexcept { return {*this, 0}; }
  [[nodiscard]] Iterator end() const noexcept { return {*this, count_}; }

 private:
  const std::byte* first_ = nullptr;
  std::size_t count_ = 0, stride_ = sizeof(value_type);
};

}  // namespace relief
