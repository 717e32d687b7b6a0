// Between which sloping planes the samples of a tile lie, block by block: what lets a search skip most of a slab.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <vector>

namespace relief {

/// Bounds of a tile's samples over squares of its grid. Level 0 has squares of kSide cells; each higher level doubles
/// the side, up to one square. Square (i, j) holds the samples from side * i to side * (i + 1), both included, towards
/// corner 1, and likewise j towards corner 2. Memory: about 17 % of the tile.
class SampleBounds {
 public:
  static constexpr int kSide = 4;  ///< squares along an edge of the coarsest level

  /// The samples lie between low and high, plus slope_i and slope_j per grid step from the square's centre.
  struct Between {
    /// least and greatest sample, and the greatest slopes along i and j
    double low, high, slope_i, slope_j;
  };

  /// For a grid of n intervals; to be filled by update(). The memory must outlive it.
  explicit SampleBounds(int n, std::pmr::memory_resource* memory = std::pmr::new_delete_resource());
  /// Takes in the (n+1)(n+2)/2 samples, each 0..1; one to two nanoseconds for each.
  void update(const float* samples) noexcept;
  /// Computes the same bits from the bounds of other samples on the same grid. Cost: 0.15 nanoseconds per equal sample,
  /// and a little more than a fresh one in squares that differ.
  void update(const float* samples, const SampleBounds& before, const float* samples_before) noexcept;

  /// Returns how many levels there are.
  [[nodiscard]] int levels() const noexcept { return levels_; }
  /// Squares along an edge: square (i, j) exists where i, j >= 0 and i + j is less.
  [[nodiscard]] int squares(int level) const noexcept { return (((n_ + kSide - 1) / kSide - 1) >> level) + 1; }
  /// Squares along an edge of a level.
  [[nodiscard]] static constexpr int side(int level) noexcept { return kSide << level; }
  /// Returns the bounds of a square of a level.
  [[nodiscard]] Between between(int level, int i, int j) const noexcept {
    const Packed& p = squares_[index(level, i, j)];
    return {p.low * (1 / kSteps), p.high * (1 / kSteps), p.slope_i * (1 / kSlopes), p.slope_j * (1 / kSlopes)};
  }
  /// Returns the same for the samples up to so many cells around a square, as stitching draws triangles' corners along
  /// the slab's edges: those of the squares around one that is as large as that.
  [[nodiscard]] Between around(int level, int i, int j, int cells) const noexcept;
  /// Has the memory fetch what between() reads of a square of a level and of those beside it in its row.
  void fetch(int level, int i, int j) const noexcept { __builtin_prefetch(&squares_[index(level, i, j)]); }
  /// Least and greatest of all samples, or a little beyond.
  [[nodiscard]] std::array<double, 2> range() const noexcept {
    const auto [low, high, slope_i, slope_j] = between(levels_ - 1, 0, 0);
    const double half = side(levels_ - 1) / 2.0, far = n_ - half;
    const double a = -(slope_i + slope_j) * half, b = slope_i * far - slope_j * half,
                 c = slope_j * far - slope_i * half;
    return {std::max(0.0, low + std::min({a, b, c})), std::min(1.0, high + std::max({a, b, c}))};
  }
  /// Memory held, bytes.
  [[nodiscard]] std::size_t bytes() const noexcept { return squares_.size() * sizeof(Packed); }

 private:
  static constexpr double kSteps = 65535, kSlopes = 32767;
  struct Packed {
    std::uint16_t low, high;
    std::int16_t slope_i, slope_j;
    friend bool operator==(const Packed&, const Packed&) noexcept = default;
  };
  [[nodiscard]] std::size_t index(int level, int i, int j) const noexcept {
    const int m = squares(level), before = j * m - j * (j - 1) / 2;
    return static_cast<std::size_t>(begin_[static_cast<std::size_t>(level)]) + static_cast<std::size_t>(before + i);
  }
  /// Returns what bounds a square: at level 0 its samples, above the squares that it is made of.
  [[nodiscard]] Packed bound(const float* samples, int level, int i, int j) const noexcept {
    return level == 0 ? bound(samples, i, j) : bound(level, i, j);
  }
  [[nodiscard]] Packed bound(const float* samples, int i, int j) const noexcept;
  [[nodiscard]] Packed bound(int level, int i, int j) const noexcept;

  std::int16_t n_, levels_ = 1;
  std::array<std::int16_t, 6> begin_{};  ///< by level: its first square
  std::pmr::vector<Packed> squares_;
};

}  // namespace relief
