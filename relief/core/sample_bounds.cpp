#include <relief/base/assert.h>
#include <relief/base/lanes.h>
#include <relief/core/grid.h>
#include <relief/core/sample_bounds.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace relief {

namespace {

using detail::Four;
using detail::FourInts;

template <typename Vector>
Vector load(const float* from) noexcept {
  Vector values;
  std::memcpy(&values, from, sizeof(Vector));
  return values;
}

/// What a height in steps is stored as, when it is within what can be stored.
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

bool differ(float a, float b) noexcept { return std::bit_cast<std::uint32_t>(a) != std::bit_cast<std::uint32_t>(b); }
bool four_differ(const float* a, const float* b) noexcept {
  return detail::bits_of(load<FourInts>(a) != load<FourInts>(b)) != 0;
}

/// A row of squares of a level: bit i for square i.
using Squares = std::uint64_t;

/// The squares of level 0 that a row of samples crosses from the first in which two grids differ to the last.
Squares squares_between(const float* a, const float* b, int count) noexcept {
  constexpr int kSide = SampleBounds::kSide;
  int first = 0, last = count - 1;
  while (first + 4 <= count && !four_differ(a + first, b + first)) first += 4;
  while (first < count && !differ(a[first], b[first])) ++first;
  if (first == count) return 0;
  while (last - 3 > first && !four_differ(a + last - 3, b + last - 3)) last -= 4;
  while (!differ(a[last], b[last])) --last;
  // A sample between two squares belongs to both.
  return (Squares{2} << (last / kSide)) - (Squares{1} << (std::max(first - 1, 0) / kSide));
}

/// By row, the squares of level 0 in which two grids of n intervals differ, those between them, and some that do not
/// exist.
std::array<Squares, kMaxIntervals / SampleBounds::kSide + 1> differing_squares(int n, const float* a,
                                                                               const float* b) noexcept {
  constexpr int kSide = SampleBounds::kSide;
  std::array<Squares, kMaxIntervals / kSide + 1> differing{};
  for (int j = 0; j <= n; ++j) {
    const int count = n - j + 1;
    const Squares squares = squares_between(a, b, count);
    const auto row = static_cast<std::size_t>(j / kSide);
    differing[row] |= squares;
    if (j % kSide == 0 && row > 0) differing[row - 1] |= squares;
    a += count;
    b += count;
  }
  return differing;
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
  auto stale = differing_squares(n_, samples_before, samples);
  for (int level = 0; level < levels_; ++level) {
    decltype(stale) above{};
    for (int j = 0; j < squares(level); ++j) {
      const Squares existing = (Squares{1} << (squares(level) - j)) - 1;
      for (Squares left = stale[static_cast<std::size_t>(j)] & existing; left != 0; left &= left - 1) {
        const int i = std::countr_zero(left);
        Packed& square = squares_[index(level, i, j)];
        const Packed now = bound(samples, level, i, j);
        if (now == square) continue;
        square = now;
        above[static_cast<std::size_t>(j / 2)] |= Squares{1} << (i / 2);
      }
    }
    stale = above;
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
      const Four a = load<Four>(row) - left - down, b = load<Four>(row + 1) - right - down;
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
  for (int dj = 0; dj <= kSide && j0 + dj <= n_; ++dj)
    for (int di = 0; di <= kSide && i0 + di + j0 + dj <= n_; ++di) {
      low = std::min(low, *at(di, dj));
      high = std::max(high, *at(di, dj));
    }
  return {rounded_down(double{std::max(low, 0.0F)} * kSteps), rounded_up(double{std::min(high, 1.0F)} * kSteps), 0, 0};
}

SampleBounds::Packed SampleBounds::bound(int level, int i, int j) const noexcept {
  const double half = 0.5 * side(level - 1);  // of the smaller squares, and how far their centres are from this one's
  struct Part {
    Between between;
    double i, j;
  };
  std::array<Part, 4> parts;
  int count = 0;
  double slope_i = 0, slope_j = 0;
  for (int k = 0; k < 4; ++k) {
    const int ci = 2 * i + (k & 1), cj = 2 * j + (k >> 1);
    if (ci + cj >= squares(level - 1)) continue;
    const Between b = between(level - 1, ci, cj);
    parts[static_cast<std::size_t>(count++)] = {b, (k & 1) != 0 ? half : -half, (k >> 1) != 0 ? half : -half};
    slope_i += b.slope_i;
    slope_j += b.slope_j;
  }
  Packed made = {65535, 0, static_cast<std::int16_t>(slope_i / count * kSlopes),
                 static_cast<std::int16_t>(slope_j / count * kSlopes)};
  for (const bool level_planes : {false, true}) {
    if (level_planes) made.slope_i = made.slope_j = 0;
    double low = 1, high = 0;
    for (int k = 0; k < count; ++k) {
      const auto& [b, to_i, to_j] = parts[static_cast<std::size_t>(k)];
      const double by_i = made.slope_i / kSlopes, by_j = made.slope_j / kSlopes;
      const double lower = by_i * to_i + by_j * to_j;
      const double spread = (std::abs(b.slope_i - by_i) + std::abs(b.slope_j - by_j)) * half;
      low = std::min(low, b.low - lower - spread);
      high = std::max(high, b.high - lower + spread);
    }
    if (!level_planes && (low < 0 || high > 1)) continue;
    // The samples themselves are within 0..1.
    made.low = rounded_down(std::max(low, 0.0) * kSteps);
    made.high = rounded_up(std::min(high, 1.0) * kSteps);
    break;
  }
  return made;
}

}  // namespace relief
