#include <relief/core/grid.h>

#include <gtest/gtest.h>

#include <set>

namespace relief {
namespace {

class GridOfSize : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Grid, GridOfSize, ::testing::Values(1, 2, 3, 15, 16, 31, 32, 63, 128));

TEST_P(GridOfSize, IndicesFillTheTileOnce) {
  const int n = GetParam();
  std::set<std::size_t> seen;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i + j <= n; ++i) seen.insert(sample_index(n, {i, j}));
  EXPECT_EQ(seen.size(), sample_count(n));
  EXPECT_EQ(*seen.rbegin(), sample_count(n) - 1);
}

TEST_P(GridOfSize, EdgesRunFromCornerToCorner) {
  const int n = GetParam();
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(edge_point(n, k, 0), corner_point(n, (k + 1) % 3));
    EXPECT_EQ(edge_point(n, k, n), corner_point(n, (k + 2) % 3));
    for (int t = 0; t <= n; ++t) EXPECT_EQ(weights(n, edge_point(n, k, t))[static_cast<std::size_t>(k)], 0);
  }
  EXPECT_EQ(corner_point(n, 0), (GridPoint{0, 0}));
  EXPECT_EQ(corner_point(n, 1), (GridPoint{n, 0}));
  EXPECT_EQ(corner_point(n, 2), (GridPoint{0, n}));
}

TEST_P(GridOfSize, CellWeightsReproduceThePlace) {
  const int n = GetParam();
  for (int a = 0; a <= 97; ++a)
    for (int b = 0; a + b <= 97; ++b) {
      const double u = a / 97.0, v = b / 97.0;
      const GridCell cell = cell_at(n, u, v);
      double x = 0, y = 0, sum = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto w = weights(n, cell.corners[k]);
        ASSERT_GE(std::min({w[0], w[1], w[2]}), 0);
        ASSERT_GE(cell.weights[k], -1e-12);
        x += cell.weights[k] * w[1];
        y += cell.weights[k] * w[2];
        sum += cell.weights[k];
      }
      EXPECT_NEAR(x / n, u, 1e-12);
      EXPECT_NEAR(y / n, v, 1e-12);
      EXPECT_NEAR(sum, 1, 1e-12);
    }
}

TEST_P(GridOfSize, PlacesOutsideAreClamped) {
  const int n = GetParam();
  for (const auto& [u, v] : {std::pair{-0.1, 0.5}, {0.5, -3.0}, {0.8, 0.8}, {2.0, -1.0}, {1e30, 1e30}, {-1e-17, 1.0}}) {
    const GridCell cell = cell_at(n, u, v);
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto w = weights(n, cell.corners[k]);
      EXPECT_GE(std::min({w[0], w[1], w[2]}), 0) << u << " " << v;
      EXPECT_GE(cell.weights[k], -1e-12);
      sum += cell.weights[k];
    }
    EXPECT_NEAR(sum, 1, 1e-12);
  }
}

}  // namespace
}  // namespace relief
