#include "sample_words.h"

#include <relief/base/lanes.h>

#include <algorithm>

namespace relief::detail {

namespace {

/// Returns the first sample of row j.
constexpr int row_of(int n, int j) { return j * (n + 1) - j * (j - 1) / 2; }

// On a row of fixed j inner end and fibre are linear in i.
[[gnu::always_inline]] inline void positions_body(const FibreFrame& f, int n, const float* alpha, float* x, float* y,
                                                  float* z) {
  const float share = 1.0F / static_cast<float>(n);
  const Vec3f in_i = (f.inner[1] - f.inner[0]) * share, along_i = (f.along[1] - f.along[0]) * share;
  for (int j = 0; j <= n; ++j) {
    const float b = static_cast<float>(j) * share;
    const Vec3f in = f.inner[0] + (f.inner[2] - f.inner[0]) * b, along = f.along[0] + (f.along[2] - f.along[0]) * b;
    const int row = row_of(n, j);
    const float* a = alpha + row;
    float *px = x + row, *py = y + row, *pz = z + row;
    RELIEF_VECTORS
    for (int i = 0; i <= n - j; ++i) {
      const auto t = static_cast<float>(i);
      px[i] = (in.x + in_i.x * t) + (along.x + along_i.x * t) * a[i];
      py[i] = (in.y + in_i.y * t) + (along.y + along_i.y * t) * a[i];
      pz[i] = (in.z + in_i.z * t) + (along.z + along_i.z * t) * a[i];
    }
  }
}

[[gnu::always_inline]] inline void inner_words_body(const float* x, const float* y, const float* z, int n, int first,
                                                    int last, float curvature, std::uint32_t* to) {
  for (int j = std::max(first, 1); j <= std::min(last, n - 2); ++j) {
    const int row = row_of(n, j), up = row_of(n, j + 1), down = row_of(n, j - 1);
    std::uint32_t* out = to + row;
    RELIEF_VECTORS
    for (int i = 1; i < n - j; ++i) {
      // The six samples around this one, counter-clockwise.
      const int a = row + i + 1, b = up + i, c = up + i - 1, d = row + i - 1, e = down + i, g = down + i + 1,
                o = row + i;
      // The cross products of a closed ring add up to those of the diagonals of the two halves of the hexagon.
      const float ca_x = x[c] - x[a], ca_y = y[c] - y[a], ca_z = z[c] - z[a];
      const float db_x = x[d] - x[b], db_y = y[d] - y[b], db_z = z[d] - z[b];
      const float ea_x = x[e] - x[a], ea_y = y[e] - y[a], ea_z = z[e] - z[a];
      const float gd_x = x[g] - x[d], gd_y = y[g] - y[d], gd_z = z[g] - z[d];
      const Vec3f normal = {(ca_y * db_z - ca_z * db_y) + (ea_y * gd_z - ea_z * gd_y),
                            (ca_z * db_x - ca_x * db_z) + (ea_z * gd_x - ea_x * gd_z),
                            (ca_x * db_y - ca_y * db_x) + (ea_x * gd_y - ea_y * gd_x)};
      const Vec3f spread = {2 * (x[a] + x[b] + x[c] + x[d] + x[e] + x[g] - 6 * x[o]),
                            2 * (y[a] + y[b] + y[c] + y[d] + y[e] + y[g] - 6 * y[o]),
                            2 * (z[a] + z[b] + z[c] + z[d] + z[e] + z[g] - 6 * z[o])};
      out[i] = second_word(normal, spread, curvature);
    }
  }
}

[[gnu::always_inline]] inline void first_words_body(const float* alpha, const std::uint8_t* mask, int from, int end,
                                                    std::uint32_t* to) {
  if (mask == nullptr) {
    RELIEF_VECTORS
    for (int k = from; k < end; ++k) to[k] = first_word(alpha[k], 0);
  } else {
    RELIEF_VECTORS
    for (int k = from; k < end; ++k) to[k] = first_word(alpha[k], mask[k]);
  }
}

/// Returns the signed square of a cosine, which is ordered as the cosine.
[[gnu::always_inline]] inline float signed_square(float abx, float aby, float abz, float acx, float acy, float acz,
                                                  Vec3f axis) {
  const float fx = aby * acz - abz * acy, fy = abz * acx - abx * acz, fz = abx * acy - aby * acx;
  const float along = fx * axis.x + fy * axis.y + fz * axis.z, area2 = fx * fx + fy * fy + fz * fz;
  return area2 > 0 ? along * std::abs(along) / area2 : -1.0F;
}

[[gnu::always_inline]] inline float narrowest_body(const float* x, const float* y, const float* z, int n, int first,
                                                   int last, Vec3f axis) {
  std::array<float, kMaxIntervals + kSpare> cosines;
  float least = 1;
  for (int j = std::max(first, 0); j <= std::min(last, n - 1); ++j) {
    const int row = row_of(n, j), up = row_of(n, j + 1), count = n - j;
    // The triangle that stands on the row, and the one to its right that hangs from the next; the last has none.
    float* const to = cosines.data();
    RELIEF_VECTORS
    for (int i = 0; i < count; ++i) {
      const int a = row + i, b = a + 1, c = up + i, d = up + (i + 1 < count ? i + 1 : i);
      const float stands =
          signed_square(x[b] - x[a], y[b] - y[a], z[b] - z[a], x[c] - x[a], y[c] - y[a], z[c] - z[a], axis);
      const float hangs =
          signed_square(x[d] - x[b], y[d] - y[b], z[d] - z[b], x[c] - x[b], y[c] - y[b], z[c] - z[b], axis);
      to[i] = i + 1 < count && hangs < stands ? hangs : stands;
    }
    least = std::min(least, *std::min_element(to, to + count));
  }
  return least < 0 ? -std::sqrt(-least) : std::sqrt(least);
}

struct Kernels {
  void (*positions)(const FibreFrame&, int, const float*, float*, float*, float*);
  void (*inner_words)(const float*, const float*, const float*, int, int, int, float, std::uint32_t*);
  void (*first_words)(const float*, const std::uint8_t*, int, int, std::uint32_t*);
  float (*narrowest)(const float*, const float*, const float*, int, int, int, Vec3f);
};

// The same code for what every machine of a kind has and for what most have: the same bits, as nothing is fused.
#define RELIEF_KERNEL_BUILD(name, ...)                                                                               \
  namespace name {                                                                                                   \
  __VA_ARGS__ void positions(const FibreFrame& f, int n, const float* alpha, float* x, float* y, float* z) {         \
    positions_body(f, n, alpha, x, y, z);                                                                            \
  }                                                                                                                  \
  __VA_ARGS__ void inner_words(const float* x, const float* y, const float* z, int n, int first, int last, float c,  \
                               std::uint32_t* to) {                                                                  \
    inner_words_body(x, y, z, n, first, last, c, to);                                                                \
  }                                                                                                                  \
  __VA_ARGS__ void first_words(const float* alpha, const std::uint8_t* mask, int from, int end, std::uint32_t* to) { \
    first_words_body(alpha, mask, from, end, to);                                                                    \
  }                                                                                                                  \
  __VA_ARGS__ float narrowest(const float* x, const float* y, const float* z, int n, int first, int last,            \
                              Vec3f axis) {                                                                          \
    return narrowest_body(x, y, z, n, first, last, axis);                                                            \
  }                                                                                                                  \
  constexpr Kernels kAll = {positions, inner_words, first_words, narrowest};                                         \
  }
RELIEF_KERNEL_BUILD(baseline, )
#if defined(__x86_64__)
RELIEF_KERNEL_BUILD(avx2, [[gnu::target("avx2")]])
#endif
#undef RELIEF_KERNEL_BUILD
#undef RELIEF_VECTORS

const Kernels& kernels() {
#if defined(__x86_64__)
  static const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;
  if (has_avx2) return avx2::kAll;
#endif
  return baseline::kAll;
}

}  // namespace

void find_positions(const FibreFrame& frame, int n, const float* alpha, SlabPositions& to) {
  kernels().positions(frame, n, alpha, to.x.data(), to.y.data(), to.z.data());
}

std::array<float, 2> range_of(const float* values, std::size_t count) {
  std::array<float, 2> range = {values[0], values[0]};
  std::size_t k = 0;
  if (count >= 4) {
    const auto four = [&](std::size_t from) {
      return Four{values[from], values[from + 1], values[from + 2], values[from + 3]};
    };
    Four low = four(0), high = low;
    for (k = 4; k + 4 <= count; k += 4) {
      low = least(low, four(k));
      high = greatest(high, four(k));
    }
    range = {std::min({low[0], low[1], low[2], low[3]}), std::max({high[0], high[1], high[2], high[3]})};
  }
  for (; k < count; ++k) range = {std::min(range[0], values[k]), std::max(range[1], values[k])};
  return range;
}

void find_inner_words(const SlabPositions& at, int n, int first, int last, float curvature,
                      std::vector<std::uint32_t>& to) {
  kernels().inner_words(at.x.data(), at.y.data(), at.z.data(), n, first, last, curvature, to.data());
}

void find_first_words(const float* alpha, const std::uint8_t* mask, int n, int first, int last,
                      std::vector<std::uint32_t>& to) {
  kernels().first_words(alpha, mask, row_of(n, first), row_of(n, last + 1), to.data());
}

float narrowest(const SlabPositions& at, int n, int first, int last, Vec3f axis) {
  return kernels().narrowest(at.x.data(), at.y.data(), at.z.data(), n, first, last, axis);
}

BorderTable::BorderTable(int n) {
  constexpr std::array<GridPoint, 6> kWays = {{{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}}};
  const auto inside = [&](GridPoint p) { return p.i >= 0 && p.j >= 0 && p.i + p.j <= n; };
  const auto number = [&](GridPoint p) { return static_cast<std::uint16_t>(sample_index(n, p)); };
  for (int edge = 0; edge < 3; ++edge)
    for (int t = 0; t < n; ++t) {
      const GridPoint p = edge_point(n, edge, t);
      std::size_t first = 0;
      while (inside(p + kWays[(first + 5) % 6]) || !inside(p + kWays[first])) ++first;
      Place place{number(p), 0, {}};
      for (std::size_t k = first; k < first + 6 && inside(p + kWays[k % 6]); ++k)
        place.around[place.count++] = number(p + kWays[k % 6]);
      places.push_back(place);
    }
}

Umbrella border_umbrella(const SlabPositions& at, const BorderTable::Place& place) {
  const Vec3f middle = at.at(place.own);
  Umbrella sum;
  Vec3f before = at.at(place.around[0]) - middle;
  for (std::size_t k = 1; k < place.count; ++k) {
    const Vec3f next = at.at(place.around[k]) - middle;
    sum.normal += cross(before, next);
    sum.spread += before + next;
    before = next;
  }
  return sum;
}

Umbrella facet_umbrella(const SlabPositions& at, int n, const Facets& facets, GridPoint p) {
  const Vec3f middle = at.at(sample_index(n, p));
  Umbrella sum;
  Vec3f before, bend_before;
  bool have = false;
  for (const GridPoint way : kAround) {
    const int reach = facets.reach(p, way);
    if (reach > 0) {
      const float share = 1.0F / static_cast<float>(reach);
      const Vec3f next = (at.at(sample_index(n, {p.i + reach * way.i, p.j + reach * way.j})) - middle) * share;
      const Vec3f bend = next * share;
      if (have) {
        sum.normal += cross(before, next);
        sum.spread += bend_before + bend;
      }
      before = next;
      bend_before = bend;
    }
    have = reach > 0;
  }
  return sum;
}

}  // namespace relief::detail
