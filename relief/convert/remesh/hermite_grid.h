// Which corners of a sparse grid lie in a solid, and where and how steeply its skin crosses the edges between them.
#pragma once

#include <relief/base/progress.h>
#include <relief/base/vec.h>
#include <relief/convert/geometry/half_edges.h>
#include <relief/convert/remesh/source_skin.h>

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

namespace relief::detail {

/// A corner of the grid, and the cell whose lowest corner it is. 0 <= x, y, z < 2^20.
using Voxel = Vec3<std::int32_t>;

/// Corner k = 0..7 of a cell: bit a of k says that it is the upper one along axis a.
[[nodiscard]] constexpr Voxel corner_of(Voxel cell, unsigned k) noexcept {
  return cell + Voxel{static_cast<std::int32_t>(k & 1U), static_cast<std::int32_t>(k >> 1U & 1U),
                      static_cast<std::int32_t>(k >> 2U & 1U)};
}
[[nodiscard]] constexpr Vec3d place_of(Voxel v) noexcept { return {double(v.x), double(v.y), double(v.z)}; }

/// Says where the surface of the solid passes an edge of the grid from inside to outside.
struct GridCrossing {
  Voxel low;                       ///< the lower end of the edge
  std::uint8_t axis = 0;           ///< of the edge
  bool low_inside = false;         ///< which end lies in the solid
  float t = 0;                     ///< 0..1 along the edge
  std::uint32_t triangle = kNone;  ///< of the skin; none where a hole is closed
  Vec3f normal;                    ///< unit, outwards

  [[nodiscard]] Vec3d at() const noexcept {
    Vec3d p = place_of(low);
    p[axis] += double(t);
    return p;
  }
};

/// Signs at the corners of the cells that the surface passes, and the crossings of their edges ("Hermite data", Ju et
/// al. 2002). The surface bounds where the skin winds around more than half. A corner's sign is asked once, so the
/// result closes whatever lies on a corner. The order of cells and crossings is the same for any number of threads.
class HermiteGrid {
 public:
  /// Nothing when cancelled. About 10 microseconds and 200 bytes per cell.
  [[nodiscard]] static std::optional<HermiteGrid> around(const Skin& skin, const Progress& progress);

  /// Cells with corners on both sides, and per cell the corners inside, bit by bit.
  [[nodiscard]] std::span<const Voxel> cells() const noexcept { return cells_; }
  [[nodiscard]] unsigned inside_of(std::size_t cell) const noexcept { return inside_[cell]; }
  [[nodiscard]] std::span<const GridCrossing> crossings() const noexcept { return crossings_; }
  /// kNone where the surface does not pass.
  [[nodiscard]] std::uint32_t cell_at(Voxel cell) const noexcept { return index_of(cell, 3); }
  [[nodiscard]] std::uint32_t crossing_at(Voxel low, unsigned axis) const noexcept { return index_of(low, axis); }
  /// Some of the skin within eight voxels or so lies in the solid, or twice in one place: it is not the solid's
  /// surface.
  [[nodiscard]] bool has_buried_skin(Vec3d near) const noexcept;

 private:
  static constexpr int kSide = 8;  // corners of a block along an axis
  /// One bit per corner of a block, x first.
  struct Bits {
    std::array<std::uint64_t, 8> words{};
    [[nodiscard]] bool has(unsigned k) const noexcept { return (words[k >> 6U] >> (k & 63U) & 1U) != 0; }
    void set(unsigned k) noexcept { words[k >> 6U] |= std::uint64_t{1} << (k & 63U); }
    [[nodiscard]] std::uint32_t count_before(unsigned k) const noexcept {
      std::uint32_t count = 0;
      for (unsigned w = 0; w < k >> 6U; ++w) count += static_cast<std::uint32_t>(std::popcount(words[w]));
      return count + static_cast<std::uint32_t>(std::popcount(words[k >> 6U] & ((std::uint64_t{1} << (k & 63U)) - 1)));
    }
  };
  struct Block {
    Voxel low;
    Bits wanted, known, inside;
    std::array<Bits, 3> hit;               // by axis: a triangle meets the edge upwards from here
    std::array<Bits, 4> listed;            // crossings by axis, and cells
    std::array<std::uint32_t, 4> first{};  // of what is listed
    Bits near_buried;                      // skin that is not the solid's surface
  };
  /// A triangle meets an edge of the grid.
  struct Hit {
    std::uint64_t edge;
    float t;
    std::uint32_t triangle;
  };
  using Corners = std::array<std::uint8_t, 9 * 9 * 9>;  // of a block and those beyond it: 1 outside, 2 inside

  explicit HermiteGrid(const Skin& skin) : skin_(&skin) {}
  [[nodiscard]] bool find_hits(const Progress& progress);
  void rasterise(std::uint32_t triangle, std::vector<Hit>& hits) const;
  void want_cells_at_hits();
  [[nodiscard]] bool find_signs(const Progress& progress);
  void find_signs(Block& block) const;
  [[nodiscard]] bool close_holes(const Progress& progress);
  void sort_blocks();
  [[nodiscard]] bool list_cells(const Progress& progress);
  [[nodiscard]] bool list_crossings(const Progress& progress);
  void mark_near_buried(Voxel edge);
  [[nodiscard]] GridCrossing crossing_on(Voxel low, unsigned axis, bool low_inside, bool& buried) const;
  [[nodiscard]] GridCrossing crossing_between_hits(GridCrossing edge) const;
  [[nodiscard]] Corners corners_around(const Block& block) const;

  [[nodiscard]] static std::uint64_t key(Voxel v, unsigned axis) noexcept {
    return (std::uint64_t(static_cast<std::uint32_t>(v.z)) << 42U |
            std::uint64_t(static_cast<std::uint32_t>(v.y)) << 22U |
            std::uint64_t(static_cast<std::uint32_t>(v.x)) << 2U | axis);
  }
  [[nodiscard]] static std::uint64_t block_key(Voxel v) noexcept { return key({v.x >> 3, v.y >> 3, v.z >> 3}, 0); }
  [[nodiscard]] static unsigned within(Voxel v) noexcept {
    return static_cast<unsigned>((v.x & 7) | (v.y & 7) << 3 | (v.z & 7) << 6);
  }
  [[nodiscard]] const Block* find(Voxel v) const noexcept;
  Block& block_with(Voxel v);
  [[nodiscard]] std::uint32_t index_of(Voxel v, unsigned list) const noexcept;

  const Skin* skin_;
  std::vector<Hit> hits_;  // by edge and t
  std::vector<Block> blocks_;
  std::unordered_map<std::uint64_t, std::uint32_t> block_of_;
  std::vector<Voxel> cells_;
  std::vector<std::uint8_t> inside_;
  std::vector<GridCrossing> crossings_;
};

}  // namespace relief::detail
