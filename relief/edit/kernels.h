// What the tools do to one whole tile: flat, branch-free loops over all its samples, which the compiler turns into
// vectors.
#pragma once

#include <relief/core/snapshot.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace relief::detail {

/// What all tiles of one n share.
struct GridTables {
  explicit GridTables(int n);
  Tile weights;                                     ///< planes 0..2: barycentric weights of corners 0..2 at each sample
  std::array<std::vector<std::uint16_t>, 3> edges;  ///< sample numbers along edge k, t = 0..n
};

/// How the samples of a grid of m intervals are read from a tile of n intervals: from their three nearest (paper,
/// Sec. 3.2).
struct Resampling {
  Resampling(int n, int m);
  std::array<std::vector<std::int32_t>, 3> index;
  std::array<std::vector<float>, 3> weight;
};

/// The fibres of one slab as the kernels see them: relative to the tool's origin, in units of its radius, the corners
/// in order of fibre id. So a shared sample goes through the same operations in each of its slabs and gets the same
/// bits.
struct SlabFrame {
  SlabFrame(const SlabCorners& corners, Vec3d origin, double radius, const GridTables& grid) noexcept;
  std::array<Vec3f, 3> inner, direction;
  std::array<const float*, 3> weight;
};

/// One build of the kernels. `from` and `to` must not overlap. All builds give the same bits: no fused multiply-add,
/// and square root and division are exact to the last bit in each.
struct Kernels {
  /// Lowers each sample to where its fibre enters the sphere of radius 1 whose lowest point is the frame's origin and
  /// whose centre lies at `up` (unit), if that is below the sample; 0 where the fibre begins inside. Error: some 1e-7
  /// of |inner| / |direction|, whatever the radius.
  void (*carve)(const SlabFrame& frame, Vec3f up, const float* from, float* to, std::size_t count);
  /// Raises each sample by amount * (1 - distance to the origin), measured along the fibre; at most to 1.
  void (*deposit)(const SlabFrame& frame, float amount, const float* from, float* to, std::size_t count);
  /// intensity * (1 - distance of the surface at each sample to the origin), 0 beyond distance 1.
  void (*cone)(const SlabFrame& frame, float intensity, const float* displacement, float* to, std::size_t count);
  /// value * share + from * (1 - share) (paper, Sec. 5).
  void (*blend)(const float* share, float value, const float* from, float* to, std::size_t count);
  /// Gives back what a mask protects: to = from where mask is 1, in proportion between.
  void (*protect)(const float* mask, const float* from, float* to, std::size_t count);
  /// share *= 1 - mask.
  void (*fade)(const float* mask, float* share, std::size_t count);
  void (*resample)(const Resampling& table, const float* from, float* to, std::size_t count);
  /// How many samples differ in any of the planes, which lie `stride` floats apart; 1 or 3 planes.
  std::size_t (*count_changes)(const float* a, const float* b, std::size_t stride, int planes, std::size_t count);
  /// The largest value, at least 0.
  float (*largest)(const float* values, std::size_t count);
};

/// The build for any machine of the architecture.
[[nodiscard]] const Kernels& baseline_kernels() noexcept;
/// The fastest build that this machine can run.
[[nodiscard]] const Kernels& best_kernels() noexcept;

}  // namespace relief::detail
