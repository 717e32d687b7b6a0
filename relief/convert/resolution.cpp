#include <relief/convert/parallel.h>
#include <relief/convert/resolution.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace relief::detail {

std::vector<int> finest_intervals(const SlabMesh& cage, const SampleSource& source) {
  constexpr int kGrid = 4, kLeast = 8;
  std::vector<int> intervals(cage.slab_count(), kLeast);
  for_all(cage.slab_count(), 16, {}, [&](std::size_t k) {
    const SlabCorners corners = cage.corners(static_cast<SlabId>(k));
    // Triangles of the source per area, from a few fibres, and the area of the slab's middle.
    double density = 0;
    int met = 0;
    Crossings crossings;
    for (int j = 0; j < kGrid; ++j)
      for (int i = 0; i + j < kGrid; ++i) {
        const double u = (i + 1.0 / 3) / kGrid, v = (j + 1.0 / 3) / kGrid;
        const Line line = fibre_at(corners, source.lattice, {1 - u - v, u, v});
        source.surface.cross(line.origin, line.direction, 0, 1, crossings);
        for (const Crossing& c : crossings.all()) {
          density += 1 / std::max(source.surface.area(c.triangle), 1.0);
          ++met;
        }
      }
    if (met == 0) return;
    const auto middle = [&](const std::array<double, 3>& w) {
      return source.lattice.to_lattice(corners.point(w, 0.5));
    };
    const Vec3d a = middle({1, 0, 0});
    const double area = 0.5 * length(cross(middle({0, 1, 0}) - a, middle({0, 0, 1}) - a));
    const double wanted = 4 * std::sqrt(area * density / met);
    intervals[k] = static_cast<int>(
        std::bit_ceil(static_cast<unsigned>(std::clamp(wanted, double(kLeast), double(kMaxIntervals)))));
  });
  return intervals;
}

std::vector<int> choose_intervals(const SlabMesh& fine, const SampleNumbers& numbers, const AlphaField& field,
                                  double error, std::size_t& too_coarse) {
  std::vector<int> intervals(fine.slab_count());
  std::vector<std::uint8_t> kept(fine.slab_count(), 0);
  for_all(fine.slab_count(), 4, {}, [&](std::size_t k) {
    const auto s = static_cast<SlabId>(k);
    const int most = fine.intervals(s);
    // The slab's own copies, row by row.
    std::vector<float> alpha, steepness;
    std::size_t voids = 0;
    for (int j = 0; j <= most; ++j)
      for (int i = 0; i + j <= most; ++i) {
        const std::size_t number = numbers.of(s, {i, j});
        alpha.push_back(field.values[number]);
        steepness.push_back(field.is_void[number] != 0 ? 0.0F : field.steepness[number]);
        voids += field.is_void[number];
      }
    const auto at = [&](int i, int j) { return double(alpha[sample_index(most, {i, j})]); };
    const auto fits = [&](int n) {
      const int step = most / n;
      for (int j = 0; j <= most; ++j)
        for (int i = 0; i + j <= most; ++i) {
          const int x = i / step * step, y = j / step * step, right = i - x, up = j - y;
          if (right == 0 && up == 0) continue;
          double between = 0;
          if (right + up <= step)
            between = at(x, y) * (step - right - up) + (right > 0 ? at(x + step, y) * right : 0) +
                      (up > 0 ? at(x, y + step) * up : 0);
          else
            between = at(x + step, y + step) * (right + up - step) + at(x, y + step) * (step - right) +
                      at(x + step, y) * (step - up);
          const std::size_t index = sample_index(most, {i, j});
          if (std::abs(between / step - double(alpha[index])) * double(steepness[index]) > error) return false;
        }
      return true;
    };
    int n = most;
    const bool mixed = voids > 0 && voids < alpha.size();
    while (!mixed && n % 2 == 0 && n > 4 && fits(n / 2)) n /= 2;
    intervals[k] = n;
    kept[k] = n == most;
  });
  too_coarse = static_cast<std::size_t>(std::count(kept.begin(), kept.end(), std::uint8_t{1}));
  return intervals;
}

}  // namespace relief::detail
