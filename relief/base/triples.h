// A view of triples of numbers, wherever they lie.
#pragma once

#include <array>
#include <cstddef>
#include <cstring>
#include <iterator>
#include <ranges>
#include <type_traits>

namespace relief {

/// The rows of an array, or what lies at one place in each of a row of structures. Does not own them.
template <typename T>
  requires std::is_arithmetic_v<T>
class Triples {
 public:
  using value_type = std::array<T, 3>;  ///< what an element is read as

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

  /// Returns how many triples.
  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  /// Returns whether there is none.
  [[nodiscard]] bool empty() const noexcept { return count_ == 0; }
  /// Triple k, by value.
  [[nodiscard]] value_type operator[](std::size_t k) const noexcept {
    value_type triple;
    std::memcpy(triple.data(), first_ + k * stride_, sizeof(triple));
    return triple;
  }

  /// Goes over the triples in order.
  class Iterator {
   public:
    using value_type = Triples::value_type;              ///< what it leads to
    using difference_type = std::ptrdiff_t;              ///< a distance between two of them
    using iterator_concept = std::forward_iterator_tag;  ///< each triple can be read again

    Iterator() = default;
    /// At triple `at`.
    Iterator(const Triples& of, std::size_t at) noexcept : of_(of), at_(at) {}
    /// Returns the triple, by value.
    [[nodiscard]] value_type operator*() const noexcept { return of_[at_]; }
    /// Goes on to the next one.
    Iterator& operator++() noexcept {
      ++at_;
      return *this;
    }
    /// Goes on, and returns where it was.
    Iterator operator++(int) noexcept { return {of_, at_++}; }
    friend bool operator==(const Iterator& a, const Iterator& b) noexcept { return a.at_ == b.at_; }

   private:
    Triples of_;
    std::size_t at_ = 0;
  };
  /// Returns the first triple.
  [[nodiscard]] Iterator begin() const noexcept { return {*this, 0}; }
  /// Behind the last triple.
  [[nodiscard]] Iterator end() const noexcept { return {*this, count_}; }

 private:
  const std::byte* first_ = nullptr;
  std::size_t count_ = 0, stride_ = sizeof(value_type);
};

}  // namespace relief
