#include <relief/core/grid.h>

#include <algorithm>
#include <cmath>

namespace relief {

GridCell cell_at(int n, double u, double v) noexcept {
  u = std::min(std::max(u, 0.0), 1.0);
  v = std::min(std::max(v, 0.0), 1.0);
  if (u + v > 1) {
    // The nearest point of the long edge: both weights give way alike.
    const double excess = (u + v - 1) / 2;
    u = std::clamp(u - excess, 0.0, 1.0);
    v = 1 - u;
  }
  const double x = u * n, y = v * n;
  int i = std::min(static_cast<int>(x), n - 1);
  int j = std::min(static_cast<int>(y), n - 1);
  if (i + j > n - 1) {
    // Only rounding, or a point on the long edge, gets here: step back into the last cell.
    if (x - i < y - j)
      --i;
    else
      --j;
    if (i < 0) {
      i = 0;
      j = n - 1;
    }
    if (j < 0) {
      j = 0;
      i = n - 1;
    }
  }
  const double a = x - i, b = y - j;
  if (a + b <= 1 || i + j == n - 1) return {{{{i, j}, {i + 1, j}, {i, j + 1}}}, {1 - a - b, a, b}};
  return {{{{i + 1, j}, {i + 1, j + 1}, {i, j + 1}}}, {1 - b, a + b - 1, 1 - a}};
}

}  // namespace relief
