// From a tile to what the driver holds of each sample: two words with displacement, mask, normal and hollow.
#pragma once

#include <relief/base/vec.h>
#include <relief/core/facets.h>
#include <relief/core/slab_mesh.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace relief::detail {

/// First word: alpha in steps of 1 / (2^24 - 1), the mask in the upper 8 bits. Second word: octahedral normal, 12 bits
/// a side, and the hollow in the upper 8 bits. 12 bits err by at most 0.06 degrees; 8, by 0.94, show as bands in a
/// highlight.
using SampleWord = std::array<std::uint32_t, 2>;
inline constexpr float kAlphaSteps = 16777215.0F;

/// Holds what a triangle fan gives to its middle: the sum of cross products of its triangles, and that of the offsets
/// from the middle to the other corners, each triangle by itself.
struct Umbrella {
  Vec3f normal, spread;
  friend bool operator==(const Umbrella&, const Umbrella&) = default;
};

/// Returns whether ground that faces these ways, of any lengths, shares a normal where it meets: up to 30 degrees, or
/// where one has no way. So the edges of a box look sharp, and the facets of round ground do not show.
[[nodiscard]] inline bool meet_smoothly(Vec3f a, Vec3f b) noexcept {
  constexpr float kSharp = 0.866F;
  const float along = dot(a, b);
  return along >= 0 && along * along >= kSharp * kSharp * dot(a, a) * dot(b, b);
}

/// Brings to the front of what lies from `first` to `end`: the first, those that meet it, those that meet one of these,
/// and so on. `meet(a, b)` and `exchange(a, b)` take two places. Returns where they end.
template <typename Meet, typename Exchange>
[[nodiscard]] std::size_t gather_group(std::size_t first, std::size_t end, Meet&& meet, Exchange&& exchange) {
  std::size_t last = first + 1;
  for (std::size_t k = first; k < last; ++k)
    for (std::size_t other = last; other < end; ++other)
      if (meet(k, other)) exchange(last++, other);
  return last;
}

/// Rounded up, so that loops may run over the ends of arrays.
inline constexpr std::size_t kSpare = 16;

/// Positions of the samples of a slab, in row-packed order.
struct SlabPositions {
  std::vector<float> x, y, z;
  void resize(int n) {
    for (std::vector<float>* each : {&x, &y, &z}) each->resize(sample_count(n) + kSpare);
  }
  [[nodiscard]] Vec3f at(std::size_t k) const noexcept { return {x[k], y[k], z[k]}; }
};

/// The slab's inner corners and fibres, relative to a point and as shares of a length, so that float resolves the
/// finest grid and squares of areas neither vanish nor overflow.
struct FibreFrame {
  std::array<Vec3f, 3> inner, along;
};
void find_positions(const FibreFrame& frame, int n, const float* alpha, SlabPositions& to);

/// Least and greatest of what is in a row-packed array.
[[nodiscard]] std::array<float, 2> range_of(const float* values, std::size_t count);

/// The second words of the samples inside the slab in rows first..last: those on its border are left as they are.
/// `curvature`: what a mean curvature of one is worth.
void find_inner_words(const SlabPositions& at, int n, int first, int last, float curvature,
                      std::vector<std::uint32_t>& to);
/// The first words of rows first..last; `mask` null, or one byte a sample.
void find_first_words(const float* alpha, const std::uint8_t* mask, int n, int first, int last,
                      std::vector<std::uint32_t>& to);
/// Returns the least cosine between `axis`, unit, and the normals of the micro-triangles in rows first..last of cells;
/// -1 where one has none.
[[nodiscard]] float narrowest(const SlabPositions& at, int n, int first, int last, Vec3f axis);

/// The samples on a slab's border, edge after edge: t = 0..n-1 of edge k at k n + t, each with the samples around it in
/// the slab, in counter-clockwise order; two at corners.
struct BorderTable {
  struct Place {
    std::uint16_t own, count;
    std::array<std::uint16_t, 4> around;
  };
  std::vector<Place> places;
  explicit BorderTable(int n);
};
[[nodiscard]] Umbrella border_umbrella(const SlabPositions& at, const BorderTable::Place& place);

/// Returns the umbrella of a sample of a slab with new samples, or the slab's part of it on the border; as if each of
/// the six lay one spacing off.
[[nodiscard]] Umbrella facet_umbrella(const SlabPositions& at, int n, const Facets& facets, GridPoint p);

/// Returns the second word of a sample with this umbrella.
[[nodiscard]] inline std::uint32_t second_word(Vec3f normal, Vec3f spread, float curvature) noexcept {
  const float sum = std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z) + 1e-37F;
  const float inverse = 1.0F / sum;
  const float a = normal.x * inverse, b = normal.y * inverse;
  const float fold_a = (1.0F - std::abs(b)) * (a < 0 ? -1.0F : 1.0F),
              fold_b = (1.0F - std::abs(a)) * (b < 0 ? -1.0F : 1.0F);
  const float u = normal.z < 0 ? fold_a : a, v = normal.z < 0 ? fold_b : b;
  // Mean curvature from the umbrella, 0 on a plane, positive in a hollow; c / (1 + |c|) keeps it within its byte.
  const float bend = (spread.x * normal.x + spread.y * normal.y + spread.z * normal.z) * curvature;
  const float area2 = normal.x * normal.x + normal.y * normal.y + normal.z * normal.z;
  const float hollow = bend / (area2 + std::abs(bend) + 1e-37F);
  const auto code_u = static_cast<std::int32_t>((u * 0.5F + 0.5F) * 4095.0F + 0.5F),
             code_v = static_cast<std::int32_t>((v * 0.5F + 0.5F) * 4095.0F + 0.5F),
             code_h = static_cast<std::int32_t>((hollow * 0.5F + 0.5F) * 254.0F + 0.5F);
  return static_cast<std::uint32_t>(code_u) | (static_cast<std::uint32_t>(code_v) << 12U) |
         (static_cast<std::uint32_t>(code_h) << 24U);
}
[[nodiscard]] inline std::uint32_t first_word(float alpha, std::uint32_t mask) noexcept {
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(alpha * kAlphaSteps)) | (mask << 24U);
}

}  // namespace relief::detail
