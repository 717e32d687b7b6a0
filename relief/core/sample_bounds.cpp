#include <relief/base/assert.h>
#include <relief/base/lanes.h>
#include <relief/core/grid.h>
#include <relief/core/sample_bounds.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>

namespace relief {

namespace {

using detail::Four;

Four load(const float* from) noexcept {
  Four values;
  std::memcpy(&values, from, sizeof values);
  return values;
}

/// Returns what a height in steps is stored as, when it is within what can be stored.
std::uint16_t rounded_down(double steps) noexcept { return static_cast<std::uint16_t>(static_cast<int>(steps)); }
std::uint16_t rounded_up(double steps) noexcept {
  const int whole = static_cast<int>(steps);
  return static_cast<std::uint16_t>(whole + static_cast<int>(whole < steps));
}

/// Of four floats. Of 0 and -0 either.
float least_of(Four a) noexcept {
  a = detail::least(a, __builtin_shufflevector(a, a, 2, 3, 0, 1));
  return std::min(a[0], a[1]);
}
float greatest_of(Four a) noexcept {
  a = detail::greatest(a, __builtin_shufflevector(a, a, 2, 3, 0, 1));
  return std::max(a[0], a[1]);
}

/// Returns the first and the last row in which the samples of two grids differ; n + 1 and what is no matter for none.
std::array<int, 2> differing_rows(int n, const float* a, const float* b) noexcept {
  const auto same = [&](int j) {
    const std::size_t row = sample_index(n, {0, j});
    return std::memcmp(a + row, b + row, static_cast<std::size_t>(n - j + 1) * sizeof(float)) == 0;
  };
  int first = 0, last = n;
  while (first <= n && same(first)) ++first;
  while (last > first && same(last)) --last;
  return {first, last};
}

/// Returns whether two grids of n intervals have the same samples in square (i, j) of level 0.
bool same_in_square(int n, int i, int j, const float* a, const float* b) noexcept {
  constexpr int kSide = SampleBounds::kSide;
  const GridPoint corner = {i * kSide, j * kSide};
  const int there = n - corner.i - corner.j;  // how far the grid goes on
  std::size_t row = sample_index(n, corner);
  for (int dj = 0; dj <= std::min(kSide, there); row += static_cast<std::size_t>(n + 1 - (corner.j + dj)), ++dj) {
    const bool whole = there - dj >= kSide;
    if (std::memcmp(a + row, b + row, sizeof(float) * (whole ? kSide : static_cast<std::size_t>(there - dj))) != 0)
      return false;
    // The last one by itself: the others are compared at once.
    const std::size_t last = row + static_cast<std::size_t>(std::min(kSide, there - dj));
    if (std::bit_cast<std::uint32_t>(a[last]) != std::bit_cast<std::uint32_t>(b[last])) return false;
  }
  return true;
}

}  // namespace

SampleBounds::SampleBounds(int n, std::pmr::memory_resource* memory)
    : n_(static_cast<std::int16_t>(n)), squares_(memory) {
  RELIEF_ASSERT(n >= 1 && n <= kMaxIntervals);
  int count = 0;
  for (std::int16_t level = 0;; ++level) {
    const int m = squares(level);
    begin_[static_cast<std::size_t>(level)] = static_cast<std::int16_t>(count);
    count += m * (m + 1) / 2;
    levels_ = static_cast<std::int16_t>(level + 1);
    if (m == 1) break;
  }
  squares_.resize(static_cast<std::size_t>(count));
}

void SampleBounds::update(const float* samples) noexcept {
  for (int level = 0; level < levels_; ++level)
    for (int j = 0; j < squares(level); ++j)
      for (int i = 0; i + j < squares(level); ++i) squares_[index(level, i, j)] = bound(samples, level, i, j);
}

void SampleBounds::update(const float* samples, const SampleBounds& before, const float* samples_before) noexcept {
  RELIEF_ASSERT(before.n_ == n_);
  squares_ = before.squares_;
  const auto [first, last] = differing_rows(n_, samples, samples_before);
  if (first > n_) return;
  // Bit i of row j: whether a square that square (i, j) of the next level is made of has changed.
  std::array<std::uint32_t, kMaxIntervals / kSide / 2> above{};
  const auto renew = [&](int level, int i, int j) {
    Packed& square = squares_[index(level, i, j)];
    const Packed now = bound(samples, level, i, j);
    if (now == square) return;
    square = now;
    above[static_cast<std::size_t>(j / 2)] |= std::uint32_t{1} << (i / 2);
  };
  for (int j = std::max(first - 1, 0) / kSide; j <= std::min(last / kSide, squares(0) - 1); ++j)
    for (int i = 0; i + j < squares(0); ++i)
      if (!same_in_square(n_, i, j, samples, samples_before)) renew(0, i, j);
  for (int level = 1; level < levels_; ++level) {
    const auto stale = std::exchange(above, {});
    for (int j = 0; j < squares(level); ++j)
      for (std::uint32_t left = stale[static_cast<std::size_t>(j)]; left != 0; left &= left - 1)
        renew(level, std::countr_zero(left), j);
  }
}

SampleBounds::Packed SampleBounds::bound(const float* samples, int i, int j) const noexcept {
  const int i0 = i * kSide, j0 = j * kSide;
  const auto at = [&](int di, int dj) noexcept { return samples + sample_index(n_, {i0 + di, j0 + dj}); };
  float low = 1, high = 0;
  if (i0 + j0 + 2 * kSide <= n_) {
    // A whole square: a slope through three of its corners, then the least and the greatest height above that.
    const auto steps = [](float rise) noexcept {
      return static_cast<std::int16_t>(rise * static_cast<float>(kSlopes / kSide));
    };
    const std::int16_t slope_i = steps(*at(kSide, 0) - *at(0, 0)), slope_j = steps(*at(0, kSide) - *at(0, 0));
    constexpr auto kSlope = static_cast<float>(1 / kSlopes);
    const float by_i = slope_i * kSlope, by_j = slope_j * kSlope;
    const Four left = {-2 * by_i, -by_i, 0, by_i}, right = left + by_i;
    Four lowest = {1, 1, 1, 1}, highest = {};
    const float* row = at(0, 0);
    for (int r = 0; r <= kSide; row += n_ + 1 - (j0 + r), ++r) {
      const float down = static_cast<float>(r - 2) * by_j;
      const Four a = load(row) - left - down, b = load(row + 1) - right - down;
      lowest = detail::least(lowest, detail::least(a, b));
      highest = detail::greatest(highest, detail::greatest(a, b));
    }
    constexpr float kRounding = 1e-6F;
    low = least_of(lowest) - kRounding;
    high = greatest_of(highest) + kRounding;
    // Where the sloping planes leave what can be stored, level ones do.
    if (low >= 0 && high <= 1)
      return {rounded_down(double{low} * kSteps), rounded_up(double{high} * kSteps), slope_i, slope_j};
    low = 1;
    high = 0;
  }
  const float* row = at(0, 0);
  const int there = n_ - i0 - j0;  // how far the grid goes on
  for (int dj = 0; dj <= std::min(kSide, there); row += n_ + 1 - (j0 + dj), ++dj)
    for (int di = 0; di <= std::min(kSide, there - dj); ++di) {
      low = std::min(low, row[di]);
      high = std::max(high, row[di]);
    }
  return {rounded_down(double{std::max(low, 0.0F)} * kSteps), rounded_up(double{std::min(high, 1.0F)} * kSteps), 0, 0};
}

SampleBounds::Packed SampleBounds::bound(int level, int i, int j) const noexcept {
  // Heights in whole parts of 1 / (kSteps * kSlopes), so that nothing is rounded before the end.
  constexpr auto kHeight = static_cast<std::int64_t>(kSlopes), kSlope = static_cast<std::int64_t>(kSteps);
  constexpr std::int64_t kOne = kHeight * kSlope;
  // Of the smaller squares, and how far their centres are from this one's; a slope of one over that way.
  const std::int64_t half = side(level - 1) / 2, way = half * kSlope;
  std::array<Packed, 4> parts;
  std::array<std::int64_t, 4> to_i, to_j;  // towards their centres: 1 or -1
  std::size_t count = 0;
  int slope_i = 0, slope_j = 0;
  for (int k = 0; k < 4; ++k) {
    const int ci = 2 * i + (k & 1), cj = 2 * j + (k >> 1);
    if (ci + cj >= squares(level - 1)) continue;
    const Packed& part = parts[count] = squares_[index(level - 1, ci, cj)];
    to_i[count] = (k & 1) != 0 ? 1 : -1;
    to_j[count] = (k >> 1) != 0 ? 1 : -1;
    slope_i += part.slope_i;
    slope_j += part.slope_j;
    ++count;
  }
  slope_i /= static_cast<int>(count);
  slope_j /= static_cast<int>(count);
  std::int64_t low = 0, high = 0;
  const auto bound_by = [&](int by_i, int by_j) {
    low = kOne;
    high = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const Packed& part = parts[k];
      const std::int64_t lower = (by_i * to_i[k] + by_j * to_j[k]) * way;
      const std::int64_t spread = (std::abs(part.slope_i - by_i) + std::abs(part.slope_j - by_j)) * way;
      low = std::min(low, part.low * kHeight - lower - spread);
      high = std::max(high, part.high * kHeight - lower + spread);
    }
  };
  bound_by(slope_i, slope_j);
  // Where the sloping planes leave what can be stored, level ones do; the samples themselves are within 0..1.
  if (low < 0 || high > kOne) {
    slope_i = slope_j = 0;
    bound_by(0, 0);
    low = std::max<std::int64_t>(low, 0);
    high = std::min(high, kOne);
  }
  return {static_cast<std::uint16_t>(low / kHeight), static_cast<std::uint16_t>((high + kHeight - 1) / kHeight),
          static_cast<std::int16_t>(slope_i), static_cast<std::int16_t>(slope_j)};
}

SampleBounds::Between SampleBounds::around(int level, int i, int j, int cells) const noexcept {
  Between found = between(level, i, j);
  int large = level, large_i = i, large_j = j;
  while (side(large) < cells && large + 1 < levels_) {
    ++large;
    large_i /= 2;
    large_j /= 2;
  }
  const double half = 0.5 * side(level), large_half = 0.5 * side(large);
  const int m = squares(large);
  for (int b = std::max(0, large_j - 1); b <= large_j + 1; ++b)
    for (int a = std::max(0, large_i - 1); a <= large_i + 1 && a + b < m; ++a) {
      const Between other = between(large, a, b);
      // From this square's sloping planes, at the other's centre and at its corners.
      const double off = found.slope_i * ((2 * a + 1) * large_half - (2 * i + 1) * half) +
                         found.slope_j * ((2 * b + 1) * large_half - (2 * j + 1) * half);
      const double turn =
          (std::abs(other.slope_i - found.slope_i) + std::abs(other.slope_j - found.slope_j)) * large_half;
      found.low = std::min(found.low, other.low - off - turn);
      found.high = std::max(found.high, other.high - off + turn);
    }
  return found;
}

}  // namespace relief
