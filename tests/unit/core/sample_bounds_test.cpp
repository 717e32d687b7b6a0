// Bounds of a tile's samples.
#include <relief/core/grid.h>
#include <relief/core/sample_bounds.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <vector>

namespace relief {
namespace {

TEST(SampleBounds, HoldEverySampleOfEverySquareAndAreTightOnSlopes) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0, 1);
  for (const int n : {1, 2, 3, 4, 5, 7, 8, 9, 15, 31, 32, 33, 63, 64, 100, 128})
    for (const int kind : {0, 1, 2}) {
      std::vector<float> samples(sample_count(n));
      for (int j = 0; j <= n; ++j)
        for (int i = 0; i + j <= n; ++i)
          samples[sample_index(n, {i, j})] = kind == 0   ? unit(random)
                                             : kind == 1 ? 0.2F + 0.5F * static_cast<float>(i) / static_cast<float>(n)
                                                         : static_cast<float>(i % 2);
      SampleBounds bounds(n);
      bounds.update(samples.data());
      EXPECT_EQ(bounds.squares(bounds.levels() - 1), 1);
      double widest = 0;
      for (int level = 0; level < bounds.levels(); ++level) {
        const int side = SampleBounds::side(level);
        for (int j = 0; j < bounds.squares(level); ++j)
          for (int i = 0; i + j < bounds.squares(level); ++i) {
            const auto b = bounds.between(level, i, j);
            if ((i + j + 2) * side <= n) widest = std::max(widest, b.high - b.low);
            for (int dj = 0; dj <= side; ++dj)
              for (int di = 0; di <= side; ++di) {
                const GridPoint p = {i * side + di, j * side + dj};
                if (p.i + p.j > n) continue;
                const double plane = b.slope_i * (di - 0.5 * side) + b.slope_j * (dj - 0.5 * side);
                const double above = double{samples[sample_index(n, p)]} - plane;
                ASSERT_GE(above, b.low) << n << " level " << level << " square " << i << "," << j;
                ASSERT_LE(above, b.high) << n << " level " << level << " square " << i << "," << j;
              }
          }
      }
      EXPECT_TRUE(kind != 1 || widest < 0.01) << n;
    }
}

using Square = std::array<double, 4>;

std::vector<Square> squares_of(const SampleBounds& bounds) {
  std::vector<Square> squares;
  for (int level = 0; level < bounds.levels(); ++level)
    for (int j = 0; j < bounds.squares(level); ++j)
      for (int i = 0; i + j < bounds.squares(level); ++i) {
        const auto [low, high, slope_i, slope_j] = bounds.between(level, i, j);
        squares.push_back({low, high, slope_i, slope_j});
      }
  return squares;
}

TEST(SampleBounds, FollowEditsAsIfMadeAnew) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> unit(0, 1);
  for (const int n : {1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 31, 32, 33, 63, 64, 100, 128}) {
    std::vector<float> before(sample_count(n), 0.5F);
    SampleBounds bounds_before(n);
    bounds_before.update(before.data());
    std::uniform_int_distribution<std::size_t> any(0, before.size() - 1);
    for (int edit = 0; edit < 200; ++edit) {
      std::vector<float> samples = before;
      // Nothing, one sample, some of them, or a disc.
      const int kind = edit % 4;
      if (kind == 1) samples[any(random)] = unit(random);
      if (kind == 2)
        for (int k = 0; k < n; ++k) samples[any(random)] = unit(random);
      const double radius = kind == 3 ? n * 0.7 * static_cast<double>(unit(random)) : 0;
      const double ci = n * static_cast<double>(unit(random)), cj = n * static_cast<double>(unit(random));
      for (int j = 0; j <= n; ++j)
        for (int i = 0; i + j <= n; ++i)
          if ((i - ci) * (i - ci) + (j - cj) * (j - cj) < radius * radius) samples[sample_index(n, {i, j})] *= 0.9F;
      SampleBounds anew(n), followed(n);
      anew.update(samples.data());
      followed.update(samples.data(), bounds_before, before.data());
      ASSERT_EQ(squares_of(followed), squares_of(anew)) << n << " edit " << edit;
      before = samples;
      bounds_before.update(before.data());
    }
  }
}

}  // namespace
}  // namespace relief
