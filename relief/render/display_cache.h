// The tiles of a snapshot as the graphics driver holds them: 8 bytes per sample, derived, rebuilt from the snapshot at
// will.
#pragma once

#include "gl_context.h"

#include <relief/core/snapshot.h>

#include <array>
#include <atomic>
#include <compare>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <vector>

namespace relief::detail {

/// Positions are held relative to centre(), so that models far from the origin keep their detail in float.
class DisplayCache {
 public:
  /// Brings the cache to the snapshot: only tiles whose pointers differ are packed and uploaded, and the neighbours
  /// whose normals change with them. Context current. Returns the number of tiles uploaded;
  /// nothing when `cancel` became true, and the next update starts anew.
  [[nodiscard]] std::optional<std::uint64_t> update(const Snapshot& model, const std::atomic<bool>* cancel = nullptr);

  /// Draws all slabs with the program in use, at every 2^level-th sample as far as each n has it, stitched and without
  /// holes as tessellate() does it. Vertex stage: see kSurfaceVertex. Returns the number of triangles.
  std::uint64_t draw(int level);
  /// The same in portions of about 100,000 triangles; stops where `go_on` says false.
  std::uint64_t draw(int level, const std::function<bool()>& go_on);
  [[nodiscard]] std::uint64_t triangle_count(int level) const noexcept;

  [[nodiscard]] Vec3d centre() const noexcept { return centre_; }
  /// Bounds of the displaced surface relative to centre().
  [[nodiscard]] const Box3d& bounds() const noexcept { return bounds_; }
  /// The lowest displaced height along a unit direction, relative to centre(); exact along an axis, else never too
  /// high.
  [[nodiscard]] double lowest(Vec3d up) const noexcept;
  [[nodiscard]] float min_alpha() const noexcept { return min_alpha_; }
  [[nodiscard]] float max_alpha() const noexcept { return max_alpha_; }
  /// Whether every edge of the cage has a slab on either side, and there are no holes.
  [[nodiscard]] bool closed() const noexcept { return closed_; }
  [[nodiscard]] bool has_colour() const noexcept { return colour_; }

 private:
  /// What the triangles of one slab give to a sample on its border; the sums over all slabs around it are the same bits
  /// for all of them. Both are multiplied by the power of two in n, so that across an edge between slabs of different n
  /// the sideways parts of the offsets cancel.
  struct Share {
    Vec3f normal;  ///< sum of cross products: area-weighted
    Vec3f spread;  ///< sum of offsets to the other corners of the triangles
    friend bool operator==(const Share&, const Share&) = default;
  };
  struct SlabState {
    std::vector<Share> ring;  ///< edge k, t = 0..n-1 at k * n + t
    Box3d box;
    float min_alpha = 0, max_alpha = 0;
    std::uint32_t chunk = 0;
    std::size_t samples_at = 0, colours_at = 0;  ///< in elements from the start of the chunk's buffers
  };
  /// The micro-triangles of a slab: those of its grid stitched to its edges, without the holes that a slab may have.
  struct Grid {
    int intervals = 0;
    std::array<int, 3> edges{};
    SlabId holed = kNoSlab;  ///< the slab whose holes they are
    friend auto operator<=>(const Grid&, const Grid&) = default;
  };
  /// Slabs of one grid whose samples lie in one buffer; one instanced draw.
  struct Chunk {
    Grid grid;
    std::vector<std::uint64_t> triangles;  ///< of one slab, by level
    std::vector<SlabId> slabs;
    std::size_t sample_total = 0, colour_total = 0;
    GlBuffer samples, colours, records;
  };
  /// Sample numbers of the triangles of a grid at one level.
  struct Pattern {
    GlBuffer indices;
    GLsizei count = 0;
  };

  void rebuild(const Snapshot& model);
  void place_colours(const Snapshot& model);
  void measure(const Snapshot& model, SlabId s);
  void pack(const Snapshot& model, SlabId s);
  void upload_colours(const Snapshot& model, SlabId s);
  /// Calls visit(corners, on the grid of the slab) for the triangles of a grid at one level.
  template <typename Visit>
  static void for_each_triangle(const Snapshot& model, const Grid& grid, int level, Visit&& visit);
  [[nodiscard]] static std::uint64_t triangles_of(const Snapshot& model, const Grid& grid, int level);
  [[nodiscard]] const Pattern& pattern(const Grid& grid, int level);
  [[nodiscard]] GLuint grid_table(int n);
  void total_up();

  std::optional<Snapshot> last_;
  Vec3d centre_;
  double cavity_scale_ = 1;  ///< length, in model units, at which a curvature of its inverse counts as one
  Box3d bounds_;
  float min_alpha_ = 0, max_alpha_ = 1;
  bool closed_ = true, colour_ = false;
  std::vector<SlabState> slabs_;
  std::vector<Chunk> chunks_;
  std::map<std::pair<Grid, int>, Pattern> patterns_;  ///< by grid and level
  std::map<int, GlBuffer> grid_tables_;
  GlVertexArray vertex_array_;
  // Scratch of one slab, kept to spare allocations.
  std::vector<Vec3f> positions_, normals_, spreads_;
  std::vector<std::array<std::uint32_t, 2>> words_;
  std::vector<std::uint32_t> texels_;
};

}  // namespace relief::detail
