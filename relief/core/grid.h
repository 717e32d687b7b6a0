// The uniform triangular grid on which every tile lies: n intervals per edge, (n+1)(n+2)/2 samples. Slabs that share
// an edge may differ in n by a power of two; the edge then has the intervals of the coarser one.
#pragma once

#include <relief/base/vec.h>

#include <array>
#include <cstddef>
#include <cstdint>

namespace relief {

inline constexpr int kMaxIntervals = 128;

/// A place on the grid: i steps towards corner 1 and j steps towards corner 2, 0 <= i, j and i + j <= n. Its
/// barycentric weights are (n-i-j, i, j)/n, so corner 0 is (0,0), corner 1 is (n,0), corner 2 is (0,n).
struct GridPoint {
  /// column and row, from 0 to n, i + j at most n
  int i = 0, j = 0;
  friend constexpr bool operator==(GridPoint, GridPoint) noexcept = default;
  friend constexpr GridPoint operator+(GridPoint a, GridPoint b) noexcept { return {a.i + b.i, a.j + b.j}; }
  friend constexpr GridPoint operator-(GridPoint a, GridPoint b) noexcept { return {a.i - b.i, a.j - b.j}; }
};

[[nodiscard]] constexpr std::size_t sample_count(int n) noexcept {
  return static_cast<std::size_t>(n + 1) * static_cast<std::size_t>(n + 2) / 2;
}
/// Row-packed: row j holds the samples (0..n-j, j).
[[nodiscard]] constexpr std::size_t sample_index(int n, GridPoint p) noexcept {
  const int row = p.j * (n + 1) - p.j * (p.j - 1) / 2;
  return static_cast<std::size_t>(row) + static_cast<std::size_t>(p.i);
}
/// Returns the integer weights of the three corners; they add up to n.
[[nodiscard]] constexpr std::array<int, 3> weights(int n, GridPoint p) noexcept { return {n - p.i - p.j, p.i, p.j}; }

/// Grid point with the given integer weights of corners 0, 1, 2.
[[nodiscard]] constexpr GridPoint from_weights(const std::array<int, 3>& w) noexcept { return {w[1], w[2]}; }

namespace detail {
/// Returns whether a grid of n intervals has such a sample.
[[nodiscard]] constexpr bool on_grid(int n, GridPoint p) noexcept { return p.i >= 0 && p.j >= 0 && p.i + p.j <= n; }
}  // namespace detail

/// Edge k lies opposite corner k and runs from corner (k+1)%3 to corner (k+2)%3; t = 0..n counts along it.
[[nodiscard]] constexpr GridPoint edge_point(int n, int k, int t) noexcept {
  std::array<int, 3> w{};
  w[static_cast<std::size_t>((k + 1) % 3)] = n - t;
  w[static_cast<std::size_t>((k + 2) % 3)] = t;
  return from_weights(w);
}
[[nodiscard]] constexpr GridPoint corner_point(int n, int corner) noexcept {
  return edge_point(n, (corner + 2) % 3, 0);
}

/// Says where a grid point lies among the samples that its slab shares across an edge: k of r steps from one to the
/// next, counted along the edge. k = 0 for all others, which are both ends themselves.
struct EdgePlace {
  /// the samples of the coarser grid on both sides
  GridPoint before, after;
  /// how many of r parts it lies behind `before`
  int k = 0, r = 1;
  /// Returns whether the neighbour lacks the sample, so that its value follows from those of the two ends.
  [[nodiscard]] constexpr bool constrained() const noexcept { return k != 0; }
  /// Returns the shared sample that stands for this one in triangles: the nearer, of two alike the one before.
  [[nodiscard]] constexpr GridPoint nearer() const noexcept { return 2 * k <= r ? before : after; }
};
/// On a grid of n intervals whose edges have `edges` of them, each n or a divisor of it.
[[nodiscard]] constexpr EdgePlace edge_place(int n, const std::array<int, 3>& edges, GridPoint p) noexcept {
  const std::array<int, 3> w = weights(n, p);
  for (int edge = 0; edge < 3; ++edge) {
    const int m = edges[static_cast<std::size_t>(edge)];
    if (w[static_cast<std::size_t>(edge)] != 0 || m == n) continue;
    const int t = w[static_cast<std::size_t>((edge + 2) % 3)], r = n / m, k = t % r;
    if (k != 0) return {edge_point(n, edge, t - k), edge_point(n, edge, t - k + r), k, r};
  }
  return {p, p, 0, 1};
}

/// The micro-triangles of a grid of n intervals, row by row, counter-clockwise seen from outside. Calls
/// visit(std::array<GridPoint, 3>).
template <typename Visit>
constexpr void for_each_cell(int n, Visit&& visit) {
  for (int j = 0; j < n; ++j)
    for (int i = 0; i + j < n; ++i) {
      visit(std::array<GridPoint, 3>{{{i, j}, {i + 1, j}, {i, j + 1}}});
      if (i + j + 1 < n) visit(std::array<GridPoint, 3>{{{i + 1, j}, {i + 1, j + 1}, {i, j + 1}}});
    }
}
/// The same with edges stitched: constrained samples give way to the nearer shared one, and triangles that collapse are
/// left out. So the triangles of neighbouring slabs meet edge to edge.
template <typename Visit>
constexpr void for_each_cell(int n, const std::array<int, 3>& edges, Visit&& visit) {
  if (edges == std::array{n, n, n}) return for_each_cell(n, visit);
  for_each_cell(n, [&](const std::array<GridPoint, 3>& cell) {
    std::array<GridPoint, 3> to = cell;
    for (GridPoint& p : to) p = edge_place(n, edges, p).nearer();
    if (to[0] != to[1] && to[1] != to[2] && to[2] != to[0]) visit(to);
  });
}

/// The micro-triangle that holds (u, v), and the weights of its three samples: the paper's "three nearest" (Sec. 3.2).
/// (u, v) is clamped into the triangle first.
struct GridCell {
  std::array<GridPoint, 3> corners;  ///< counter-clockwise seen from outside
  std::array<double, 3> weights;     ///< add up to 1
};
[[nodiscard]] GridCell cell_at(int n, double u, double v) noexcept;
/// Returns the weights that cell_at(n, u, v) gives if it gives these corners, which it has given before. False if it
/// gives others, and in the cells along the edge opposite corner 0.
[[nodiscard]] constexpr bool weights_in(int n, const std::array<GridPoint, 3>& cell, double u, double v,
                                        std::array<double, 3>& w) noexcept {
  const int i = cell[2].i, j = cell[0].j;
  const double a = u * n - i, b = v * n - j;
  if (!(a >= 0 && a < 1 && b >= 0 && b < 1 && i + j < n - 1)) return false;
  const bool stands = a + b <= 1;
  w[0] = stands ? 1 - a - b : 1 - b;
  w[1] = stands ? a : a + b - 1;
  w[2] = stands ? b : 1 - a;
  return stands == (cell[0].i == i);
}

}  // namespace relief
