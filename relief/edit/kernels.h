// What the tools do to one whole tile: flat, branch-free loops over all its samples, which the compiler turns into
// vectors. Lengths in radii of the tool, displacements as shares of the fibre.
#pragma once

#include <relief/core/snapshot.h>
#include <relief/edit/tools.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace relief::detail {

/// normals() and around() read and write up to so many numbers beyond the last sample, and leave junk at the border.
inline constexpr std::size_t kOverrun = 8;

/// Barycentric weights of corners 0..2 at each sample of a grid, kOverrun beyond.
using GridWeights = std::array<std::vector<float>, 3>;
/// In a slab or, where the grid is that of a part of it, in the whole: of equal places the same bits, whatever the
/// grid.
[[nodiscard]] GridWeights weights_in_whole(int n, const RootPlace& part = {});

/// Holds what all tiles of one n share.
struct GridTables {
  explicit GridTables(int n);
  GridWeights weights;
  std::array<std::vector<std::uint16_t>, 3> edges;  ///< sample numbers along edge k, t = 0..n
};

/// The border of a grid of n intervals: its 3n samples, edge by edge, each edge beginning with its first corner. For
/// each one, the neighbours inside the slab in order, as 4 samples; the last two count only between 3 triangles.
struct BorderTables {
  explicit BorderTables(int n);
  std::vector<std::int32_t> own;
  std::array<std::vector<std::int32_t>, 4> ring;
  std::array<std::vector<float>, 4> share;  ///< in how many of the triangles each takes part
  /// Of the sample at t = 0..n-1 along an edge.
  [[nodiscard]] std::size_t at(int edge, int t) const noexcept {
    return static_cast<std::size_t>(edge) * (own.size() / 3) + static_cast<std::size_t>(t);
  }
  /// Of a sample on the border that is no corner.
  [[nodiscard]] std::size_t of(GridPoint p) const noexcept {
    const int n = static_cast<int>(own.size()) / 3;
    const std::array<int, 3> w = weights(n, p);
    const int edge = w[0] == 0 ? 0 : w[1] == 0 ? 1 : 2;
    return at(edge, w[static_cast<std::size_t>((edge + 2) % 3)]);
  }
};

/// Says how the samples of a grid of m intervals are read from a tile of n intervals: from their three nearest (paper,
/// Sec. 3.2).
struct Resampling {
  Resampling(int n, int m);
  std::array<std::vector<std::int32_t>, 3> index;
  std::array<std::vector<float>, 3> weight;
};

/// The fibres of one slab as the kernels see them: those of its root, relative to the tool's origin, in units of its
/// radius, the corners in order of fibre id. So a shared sample goes through the same operations in each of its slabs
/// and gets the same bits, however they were cut.
struct SlabFrame {
  /// `root`, `weights`: the corners of the root and the weights there.
  SlabFrame(const SlabCorners& root, Vec3d origin, double radius, const GridWeights& weights) noexcept;
  std::array<Vec3f, 3> inner, direction;
  std::array<const float*, 3> weight;
  const float* space = nullptr;  ///< the spacing around each sample; for cut, lift and room
  float space_unit = 1;          ///< of `space`, in radii
};

/// The ball of Carve, swept along a line. The frame's origin is its lowest point.
struct Cutter {
  Vec3f up;     ///< unit: from the lowest point to the centre
  Vec3f along;  ///< the way to the other end; zero for a ball that is not swept
  bool exact;   ///< the ball itself, to the sample
};
/// tan between cutter and surface: walls that stand steeper need smaller spacings, not a wider blend.
inline constexpr float kSteepestRim = 4;
/// In radii: below six spacings per radius a blend takes too much of the depth. It goes from there to four.
inline constexpr float kWidestBlend = 1.0F / 6;

/// In radii: by more than this a cut may miss the ball only if it is told.
inline constexpr float kTold = 0.05F;
/// In spacings, where that is less: by so much a grid misses the ball where fibres stand well, too. A finer grid
/// promises more.
inline constexpr float kToldSpacings = 0.5F;

/// A tile as the stroke found it: displacements, and the unit normals of the surface in the model's axes.
struct Start {
  const float *displacement, *x, *y, *z;
};

/// The plane of Flatten and Clay: through `point` with the unit normal.
struct TargetPlane {
  Vec3f point, normal;
  bool lowers, raises;
};

/// Where a tool begins to fade out before the end of the clay or of the room above: 10 % of what was there at the
/// stroke's start. At least two sample spacings, so that a slope has samples to stand on.
inline constexpr float kFadeShare = 0.1F, kFadeSpacings = 2.0F;

/// Holds what Carve must be lifted by, so that it fades out in the last of the clay, in radii; and how many samples it
/// would have taken beyond the inner end of their fibre, or ask for more than kTold of that.
struct Lift {
  float lift = 0;
  std::size_t limited = 0;
};

/// Says where samples lie.
struct Neighbours {
  const float *x, *y, *z;  ///< in the frame
};

/// One build of the kernels. `from` and `to` must not overlap. All builds give the same bits: no fused multiply-add,
/// and square root and division are exact to the last bit in each.
struct Kernels {
  /// Cuts: alpha becomes min(from, start blended with the fibre's entry into the cutter), see
  /// docs/decisions/0010-strokes.md. `protect` keeps its share. Returns whether samples that it takes stood beside
  /// the cutter and its blend by more than kTold or kToldSpacings.
  bool (*cut)(const SlabFrame& frame, const Cutter& cutter, const Start& start, const float* protect, const float* from,
              float* to, std::size_t count);
  /// See Lift; `over` gets 1 at the samples that count as limited.
  Lift (*lift)(const SlabFrame& frame, const Cutter& cutter, const float* start, const float* protect,
               std::uint8_t* over, std::size_t count);
  /// Writes the fall-off of the distance from the surface at each sample to the origin, times 1 - protect.
  void (*weigh)(const SlabFrame& frame, Falloff falloff, const float* displacement, const float* protect, float* to,
                std::size_t count);
  /// Writes amount * weight along the fibre, as a displacement.
  void (*raise)(const SlabFrame& frame, float amount, const float* weight, float* change, std::size_t count);
  /// Writes the way towards the plane, times 1 - exp(-amount * weight).
  void (*flatten)(const SlabFrame& frame, const TargetPlane& plane, float amount, const float* displacement,
                  const float* weight, float* change, std::size_t count);
  /// Multiplies change by 1 - exp(-amount * weight).
  void (*approach)(float amount, const float* weight, float* change, std::size_t count);
  /// Multiplies change by amount * weight.
  void (*scale)(float amount, const float* weight, float* change, std::size_t count);
  /// Returns the least of 1 - weight * (1 - room / fade) over the samples that rise, where room is what is left above
  /// them and fade where it begins to end; 1 where there is room for all.
  float (*room)(const SlabFrame& frame, const float* weight, const float* change, const float* start, const float* from,
                std::size_t count);
  /// Writes from + change * share, kept within 0..1. Returns how many would have gone beyond with all of the change;
  /// those have 1 in `over`.
  std::size_t (*settle)(const float* from, const float* change, float share, float* to, std::uint8_t* over,
                        std::size_t count);
  /// cover += (1 - cover) * (1 - exp(-amount * weight)), from one plane to another.
  void (*cover)(float amount, const float* weight, const float* from, float* to, std::size_t count);
  /// start + (value - start) * cover.
  void (*mix)(const float* cover, float value, const float* start, float* to, std::size_t count);
  /// The same to 16 bits, rounded.
  void (*mix16)(const float* cover, float value, const std::uint16_t* start, std::uint16_t* to, std::size_t count);
  void (*positions)(const SlabFrame& frame, const float* displacement, float* x, float* y, float* z, std::size_t count);
  /// Inside the slab (not at its border): unit normals of the surface.
  void (*normals)(int n, const Neighbours& at, float* x, float* y, float* z);
  /// For samples inside the slab: how far the mean of the six neighbours lies above each one, along its fibre. With
  /// `swell`: what one radius along the surface's normal is along the fibre.
  void (*around)(const SlabFrame& frame, int n, bool swell, const Neighbours& at, float* change);
  /// What the slab's own triangles give to its border: six planes of 3n numbers, twice their area times the normal and
  /// the sum of the ways to their other corners.
  void (*border)(const BorderTables& table, const Neighbours& at, float* sums);
  /// What around() gives, at the border: from such sums over all slabs, over so many ways.
  void (*border_change)(const SlabFrame& frame, const BorderTables& table, bool swell, const float* sums,
                        const float* ways, float* change);
  /// Sums of weight and of weight * position over the samples: {w, wx, wy, wz}.
  std::array<double, 4> (*mean)(const float* weight, const float* x, const float* y, const float* z, std::size_t count);
  void (*resample)(const Resampling& table, const float* from, float* to, std::size_t count);
  /// How many samples differ in any of the planes, which lie `stride` floats apart; 1 or 3 planes.
  std::size_t (*count_changes)(const float* a, const float* b, std::size_t stride, int planes, std::size_t count);
  /// The same of 3 planes of 16 bits.
  std::size_t (*count_changes16)(const std::uint16_t* a, const std::uint16_t* b, std::size_t stride, std::size_t count);
  /// The largest value, at least 0.
  float (*largest)(const float* values, std::size_t count);
};

/// Returns the build for any machine of the architecture.
[[nodiscard]] const Kernels& baseline_kernels() noexcept;
/// Returns the fastest build that this machine can run.
[[nodiscard]] const Kernels& best_kernels() noexcept;

}  // namespace relief::detail
