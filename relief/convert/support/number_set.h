// A set of small numbers that costs nothing to empty.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace relief::detail {

/// Holds numbers below a bound; 4 bytes for each that is possible. One thread.
class NumberSet {
 public:
  /// Empties it; from now on numbers are below `bound`.
  void reset(std::size_t bound) {
    if (rounds_.size() < bound) rounds_.resize(bound, 0);
    ++round_;
  }
  /// Returns false where it was there.
  bool add(std::uint32_t n) noexcept {
    if (rounds_[n] == round_) return false;
    rounds_[n] = round_;
    return true;
  }
  [[nodiscard]] bool has(std::uint32_t n) const noexcept { return rounds_[n] == round_; }

 private:
  std::vector<std::uint32_t> rounds_;  // by number: the round in which it was last added
  std::uint32_t round_ = 0;
};

}  // namespace relief::detail
