// Bounds of a tile's samples.
#include <relief/core/grid.h>
#include <relief/core/sample_bounds.h>

#include <gtest/gtest.h>

#include <algorithm>
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

TEST(SampleBounds, HoldTheSamplesAroundASquareToo) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> unit(0, 1);
  for (const int n : {8, 31, 64})
    for (const bool sloping : {false, true}) {
      std::vector<float> samples(sample_count(n));
      for (int j = 0; j <= n; ++j)
        for (int i = 0; i + j <= n; ++i)
          samples[sample_index(n, {i, j})] =
              sloping ? 0.2F + 0.5F * static_cast<float>(i) / static_cast<float>(n) : unit(random);
      SampleBounds bounds(n);
      bounds.update(samples.data());
      double widest = 0;
      for (const int cells : {1, 2, 4, 16})
        for (int level = 0; level < bounds.levels(); ++level) {
          const int side = SampleBounds::side(level);
          for (int j = 0; j < bounds.squares(level); ++j)
            for (int i = 0; i + j < bounds.squares(level); ++i) {
              const auto b = bounds.around(level, i, j, cells);
              if (cells <= 2) widest = std::max(widest, b.high - b.low);
              for (int dj = -cells; dj <= side + cells; ++dj)
                for (int di = -cells; di <= side + cells; ++di) {
                  const GridPoint p = {i * side + di, j * side + dj};
                  if (p.i < 0 || p.j < 0 || p.i + p.j > n) continue;
                  const double plane = b.slope_i * (di - 0.5 * side) + b.slope_j * (dj - 0.5 * side);
                  const double above = double{samples[sample_index(n, p)]} - plane;
                  ASSERT_GE(above, b.low - 1e-12) << n << " level " << level << " square " << i << "," << j;
                  ASSERT_LE(above, b.high + 1e-12) << n << " level " << level << " square " << i << "," << j;
                }
            }
        }
      EXPECT_TRUE(!sloping || widest < 0.6) << n << ' ' << widest;
    }
}

}  // namespace
}  // namespace relief
