#include <relief/convert/sample/resolution.h>
#include <relief/convert/support/parallel.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>

namespace relief::detail {

namespace {

/// Returns how much of something that each triangle of the source has `of(triangle)` of lies in a slab, from a few
/// fibres; nothing where none of them meets it.
template <typename Of>
std::optional<double> amount_in(const SlabCorners& corners, const SourceRays& source, const Lattice& lattice, Of&& of) {
  constexpr int kGrid = 4;
  double density = 0;  // per area
  int met = 0;
  Crossings crossings;
  for (int j = 0; j < kGrid; ++j)
    for (int i = 0; i + j < kGrid; ++i) {
      const double u = (i + 1.0 / 3) / kGrid, v = (j + 1.0 / 3) / kGrid;
      const Line line = fibre_at(corners, lattice, {1 - u - v, u, v});
      source.cross(line.origin, line.direction, 0, 1, crossings);
      for (const Crossing& c : crossings.all()) {
        density += of(c.triangle) / std::max(source.area(c.triangle), 1.0);
        ++met;
      }
    }
  if (met == 0) return std::nullopt;
  const auto middle = [&](const std::array<double, 3>& w) { return lattice.to_lattice(corners.point(w, 0.5)); };
  const Vec3d a = middle({1, 0, 0});
  const double area = 0.5 * length(cross(middle({0, 1, 0}) - a, middle({0, 0, 1}) - a));
  return area * density / met;
}

int power_of_two(double wanted, int least) noexcept {
  return static_cast<int>(
      std::bit_ceil(static_cast<unsigned>(std::clamp(wanted, double(least), double(kMaxIntervals)))));
}

/// Corners that have a colour, of which neighbours share each, or pixels of the image.
double colours_of(const TriangleMesh& mesh, std::uint32_t triangle) noexcept {
  constexpr double kCorners = 0.5;
  if (mesh.uvs.empty()) return kCorners;
  const std::shared_ptr<const Image>& image = mesh.materials[mesh.material_of[triangle]].image;
  if (!image) return kCorners;
  const TriangleUv& uv = mesh.uvs[triangle];
  const auto side = [&](std::size_t k, std::size_t axis) { return double(uv[k][axis]) - double(uv[0][axis]); };
  const double share = 0.5 * std::abs(side(1, 0) * side(2, 1) - side(1, 1) * side(2, 0));
  return std::max(kCorners, share * image->width * image->height);
}

}  // namespace

std::vector<int> finest_intervals(const SlabMesh& cage, const SampleSource& source) {
  constexpr int kLeast = 8;
  constexpr double kAnyway = 5e5;  // samples that all slabs may share: sources of few corners have sharp edges
  const auto evenly =
      static_cast<unsigned>(std::sqrt(2 * kAnyway / double(std::max<std::size_t>(cage.slab_count(), 1))));
  const int least = std::clamp(static_cast<int>(std::bit_floor(evenly)), kLeast, kMaxIntervals);
  std::vector<int> intervals(cage.slab_count(), least);
  for_all(cage.slab_count(), 16, {}, [&](std::size_t k) {
    const auto triangles = amount_in(cage.corners(static_cast<SlabId>(k)), source.surface, source.lattice,
                                     [](std::uint32_t) { return 1.0; });
    if (triangles) intervals[k] = power_of_two(4 * std::sqrt(*triangles), least);
  });
  return intervals;
}

int colour_intervals(const SlabMesh& cage, const SourceRays& source, const Lattice& lattice,
                     const TriangleMesh& coloured) {
  constexpr double kMostSlabs = 0.95;
  constexpr double kMostSamples = 16;  // per colour of the source: a few dense slabs do not make all tiles large
  std::vector<double> amounts(cage.slab_count(), 0);
  for_all(cage.slab_count(), 16, {}, [&](std::size_t k) {
    const auto colours = amount_in(cage.corners(static_cast<SlabId>(k)), source, lattice,
                                   [&](std::uint32_t t) { return colours_of(coloured, t); });
    amounts[k] = colours.value_or(0);
  });
  if (amounts.empty()) return 1;
  double all = 0;
  for (const double amount : amounts) all += amount;
  const auto at = amounts.begin() + static_cast<std::ptrdiff_t>(kMostSlabs * double(amounts.size() - 1));
  std::nth_element(amounts.begin(), at, amounts.end());
  int m = power_of_two(2 * std::sqrt(2 * *at), 1);  // m intervals make about m^2 / 2 samples
  while (m > 1 && double(sample_count(m)) * double(amounts.size()) > kMostSamples * all) m /= 2;
  return m;
}

int coarsest_intervals(const SlabSamples& samples, double error) {
  const int most = samples.intervals;
  const auto at = [&](int i, int j) { return double(samples.alpha[sample_index(most, {i, j})]); };
  const auto fits = [&](int n) {
    const int step = most / n;
    for (int j = 0; j <= most; ++j)
      for (int i = 0; i + j <= most; ++i) {
        const int x = i / step * step, y = j / step * step, right = i - x, up = j - y;
        const std::size_t index = sample_index(most, {i, j});
        if ((right == 0 && up == 0) || samples.is_void[index] != 0) continue;
        double between = 0;
        if (right + up <= step)
          between = at(x, y) * (step - right - up) + (right > 0 ? at(x + step, y) * right : 0) +
                    (up > 0 ? at(x, y + step) * up : 0);
        else
          between = at(x + step, y + step) * (right + up - step) + at(x, y + step) * (step - right) +
                    at(x + step, y) * (step - up);
        if (std::abs(between / step - double(samples.alpha[index])) * double(samples.steepness[index]) > error)
          return false;
      }
    return true;
  };
  const auto voids = static_cast<std::size_t>(std::count(samples.is_void.begin(), samples.is_void.end(), 1));
  if (voids > 0 && voids < samples.is_void.size()) return most;
  int n = most;
  while (n % 2 == 0 && n > 4 && fits(n / 2)) n /= 2;
  return n;
}

}  // namespace relief::detail
