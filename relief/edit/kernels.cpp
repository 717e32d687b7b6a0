#include <relief/edit/kernels.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace relief::detail {

GridTables::GridTables(int n) : weights(n, 3, 0.0F) {
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i + j <= n; ++i) {
      const auto w = relief::weights(n, {i, j});
      for (int k = 0; k < 3; ++k)
        weights.plane(k)[sample_index(n, {i, j})] =
            static_cast<float>(w[static_cast<std::size_t>(k)]) / static_cast<float>(n);
    }
  for (int k = 0; k < 3; ++k)
    for (int t = 0; t <= n; ++t)
      edges[static_cast<std::size_t>(k)].push_back(static_cast<std::uint16_t>(sample_index(n, edge_point(n, k, t))));
}

Resampling::Resampling(int n, int m) {
  for (int j = 0; j <= m; ++j)
    for (int i = 0; i + j <= m; ++i) {
      const GridCell cell = cell_at(n, static_cast<double>(i) / m, static_cast<double>(j) / m);
      for (std::size_t k = 0; k < 3; ++k) {
        index[k].push_back(static_cast<std::int32_t>(sample_index(n, cell.corners[k])));
        weight[k].push_back(static_cast<float>(cell.weights[k]));
      }
    }
}

namespace {
/// To float, within what a later square can hold; beyond it no tool reaches.
float narrow(double x) noexcept { return static_cast<float>(std::clamp(x, -1e15, 1e15)); }
}  // namespace

SlabFrame::SlabFrame(const SlabCorners& corners, Vec3d origin, double radius, const GridTables& grid) noexcept {
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t corner = corners.order[k];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      inner[k][axis] = narrow((corners.inner[corner][axis] - origin[axis]) / radius);
      direction[k][axis] = narrow((corners.outer[corner][axis] - corners.inner[corner][axis]) / radius);
    }
    weight[k] = grid.weights.plane(static_cast<int>(corner));
  }
}

namespace {

/// Three weighted corners, in a fixed order.
[[gnu::always_inline]] inline Vec3f mix(const std::array<Vec3f, 3>& ends, float a, float b, float c) noexcept {
  return (ends[0] * a + ends[1] * b) + ends[2] * c;
}

// With o = inner end - lowest point and D the fibre, the sphere is met where A t^2 + 2 B t + C = 0. Taking the lowest
// point as origin makes C small where the tool cuts, and C / (sqrt(B^2 - A C) - B) has no cancellation where B < 0.
[[gnu::always_inline]] inline void carve_body(const SlabFrame& frame, Vec3f up, const float* __restrict from,
                                              float* __restrict to, std::size_t count) noexcept {
  const auto inner = frame.inner, direction = frame.direction;
  const float *wa = frame.weight[0], *wb = frame.weight[1], *wc = frame.weight[2];
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3f o = mix(inner, wa[k], wb[k], wc[k]);
    const Vec3f along = mix(direction, wa[k], wb[k], wc[k]);
    const float a = dot(along, along);
    const float b = dot(o, along) - dot(along, up);
    const float c = dot(o, o) - 2 * dot(o, up);
    const float square = b * b - a * c;
    const float root = std::sqrt(square > 0 ? square : 0.0F);
    const float ratio = c / (root - b);
    const float entry = c > 0 ? ratio : 0.0F;
    const bool cut = (static_cast<int>(square >= 0) & (static_cast<int>(b < 0) | static_cast<int>(c <= 0)) &
                      static_cast<int>(entry < from[k])) != 0;
    to[k] = cut ? entry : from[k];
  }
}

[[gnu::always_inline]] inline void deposit_body(const SlabFrame& frame, float amount, const float* __restrict from,
                                                float* __restrict to, std::size_t count) noexcept {
  const auto inner = frame.inner, direction = frame.direction;
  const float *wa = frame.weight[0], *wb = frame.weight[1], *wc = frame.weight[2];
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3f along = mix(direction, wa[k], wb[k], wc[k]);
    const Vec3f p = mix(inner, wa[k], wb[k], wc[k]) + along * from[k];
    const float share = 1.0F - std::sqrt(dot(p, p));
    const float raised = from[k] + amount * share / std::sqrt(dot(along, along));
    const float capped = raised < 1.0F ? raised : 1.0F;
    to[k] = share > 0 ? capped : from[k];
  }
}

[[gnu::always_inline]] inline void cone_body(const SlabFrame& frame, float intensity,
                                             const float* __restrict displacement, float* __restrict to,
                                             std::size_t count) noexcept {
  const auto inner = frame.inner, direction = frame.direction;
  const float *wa = frame.weight[0], *wb = frame.weight[1], *wc = frame.weight[2];
  for (std::size_t k = 0; k < count; ++k) {
    const Vec3f along = mix(direction, wa[k], wb[k], wc[k]);
    const Vec3f p = mix(inner, wa[k], wb[k], wc[k]) + along * displacement[k];
    const float share = intensity * (1.0F - std::sqrt(dot(p, p)));
    to[k] = share > 0 ? share : 0.0F;
  }
}

[[gnu::always_inline]] inline void blend_body(const float* __restrict share, float value, const float* __restrict from,
                                              float* __restrict to, std::size_t count) noexcept {
  for (std::size_t k = 0; k < count; ++k) to[k] = value * share[k] + from[k] * (1.0F - share[k]);
}

[[gnu::always_inline]] inline void protect_body(const float* __restrict mask, const float* __restrict from,
                                                float* __restrict to, std::size_t count) noexcept {
  for (std::size_t k = 0; k < count; ++k) {
    const float part = from[k] + (to[k] - from[k]) * (1.0F - mask[k]);
    to[k] = mask[k] > 0 ? part : to[k];
  }
}

[[gnu::always_inline]] inline void fade_body(const float* __restrict mask, float* __restrict share,
                                             std::size_t count) noexcept {
  for (std::size_t k = 0; k < count; ++k) share[k] *= 1.0F - mask[k];
}

[[gnu::always_inline]] inline void resample_body(const Resampling& table, const float* __restrict from,
                                                 float* __restrict to, std::size_t count) noexcept {
  const std::int32_t *ia = table.index[0].data(), *ib = table.index[1].data(), *ic = table.index[2].data();
  const float *wa = table.weight[0].data(), *wb = table.weight[1].data(), *wc = table.weight[2].data();
  for (std::size_t k = 0; k < count; ++k) to[k] = (from[ia[k]] * wa[k] + from[ib[k]] * wb[k]) + from[ic[k]] * wc[k];
}

[[gnu::always_inline]] inline std::size_t count_body(const float* __restrict a, const float* __restrict b,
                                                     std::size_t stride, int planes, std::size_t count) noexcept {
  const std::size_t second = planes == 3 ? stride : 0, third = 2 * second;
  std::uint32_t changes = 0;
  for (std::size_t k = 0; k < count; ++k)
    changes += static_cast<std::uint32_t>(a[k] != b[k]) | static_cast<std::uint32_t>(a[k + second] != b[k + second]) |
               static_cast<std::uint32_t>(a[k + third] != b[k + third]);
  return changes;
}

// Values are not negative, so their bits sort as they do, and integers may be taken in any order.
[[gnu::always_inline]] inline float largest_body(const float* __restrict values, std::size_t count) noexcept {
  std::int32_t most = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const auto bits = std::bit_cast<std::int32_t>(values[k]);
    most = bits > most ? bits : most;
  }
  return std::bit_cast<float>(most);
}

namespace baseline {
void carve(const SlabFrame& frame, Vec3f up, const float* from, float* to, std::size_t count) {
  carve_body(frame, up, from, to, count);
}
void deposit(const SlabFrame& frame, float amount, const float* from, float* to, std::size_t count) {
  deposit_body(frame, amount, from, to, count);
}
void cone(const SlabFrame& frame, float intensity, const float* displacement, float* to, std::size_t count) {
  cone_body(frame, intensity, displacement, to, count);
}
void blend(const float* share, float value, const float* from, float* to, std::size_t count) {
  blend_body(share, value, from, to, count);
}
void protect(const float* mask, const float* from, float* to, std::size_t count) {
  protect_body(mask, from, to, count);
}
void fade(const float* mask, float* share, std::size_t count) { fade_body(mask, share, count); }
void resample(const Resampling& table, const float* from, float* to, std::size_t count) {
  resample_body(table, from, to, count);
}
std::size_t count_changes(const float* a, const float* b, std::size_t stride, int planes, std::size_t count) {
  return count_body(a, b, stride, planes, count);
}
float largest(const float* values, std::size_t count) { return largest_body(values, count); }
constexpr Kernels kAll = {carve, deposit, cone, blend, protect, fade, resample, count_changes, largest};
}  // namespace baseline

#if defined(__x86_64__)
namespace avx2 {
[[gnu::target("avx2")]] void carve(const SlabFrame& frame, Vec3f up, const float* from, float* to, std::size_t count) {
  carve_body(frame, up, from, to, count);
}
[[gnu::target("avx2")]] void deposit(const SlabFrame& frame, float amount, const float* from, float* to,
                                     std::size_t count) {
  deposit_body(frame, amount, from, to, count);
}
[[gnu::target("avx2")]] void cone(const SlabFrame& frame, float intensity, const float* displacement, float* to,
                                  std::size_t count) {
  cone_body(frame, intensity, displacement, to, count);
}
[[gnu::target("avx2")]] void blend(const float* share, float value, const float* from, float* to, std::size_t count) {
  blend_body(share, value, from, to, count);
}
[[gnu::target("avx2")]] void protect(const float* mask, const float* from, float* to, std::size_t count) {
  protect_body(mask, from, to, count);
}
[[gnu::target("avx2")]] void fade(const float* mask, float* share, std::size_t count) { fade_body(mask, share, count); }
[[gnu::target("avx2")]] void resample(const Resampling& table, const float* from, float* to, std::size_t count) {
  resample_body(table, from, to, count);
}
[[gnu::target("avx2")]] std::size_t count_changes(const float* a, const float* b, std::size_t stride, int planes,
                                                  std::size_t count) {
  return count_body(a, b, stride, planes, count);
}
[[gnu::target("avx2")]] float largest(const float* values, std::size_t count) { return largest_body(values, count); }
constexpr Kernels kAll = {carve, deposit, cone, blend, protect, fade, resample, count_changes, largest};
}  // namespace avx2
#endif

}  // namespace

const Kernels& baseline_kernels() noexcept { return baseline::kAll; }

const Kernels& best_kernels() noexcept {
#if defined(__x86_64__)
  static const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;
  if (has_avx2) return avx2::kAll;
#endif
  return baseline::kAll;
}

}  // namespace relief::detail
