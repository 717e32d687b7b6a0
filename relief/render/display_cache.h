// The tiles of a snapshot as the graphics driver holds them: 8 bytes per sample, derived, rebuilt from the snapshot at
// will.
#pragma once

#include "gl_context.h"
#include "sample_words.h"

#include <relief/core/snapshot.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

namespace relief::detail {

/// Levels of detail, and with them the index lists, of all slabs. Belongs to one cage.
struct Detail {
  std::vector<std::uint8_t> levels;    ///< every 2^level-th sample
  std::vector<std::uint32_t> pattern;  ///< numbers into DisplayCache::patterns_
};

/// Positions are held relative to centre(), so that models far from the origin keep their detail in float. Buffers are
/// written while the driver rests: whoever draws waits for the picture before the next update().
class DisplayCache {
 public:
  struct SlabState {
    Box3d box;  ///< of the displaced surface, relative to centre()
    float min_alpha = 0, max_alpha = 0;
    Vec3f axis;                                    ///< unit, outwards
    float cosine = -1;                             ///< no micro-triangle leans farther from the axis; may be too low
    bool holed = false;                            ///< has cells that are holes
    std::uint32_t chunk = 0, number = 0;           ///< its record: number in the chunk
    std::uint32_t samples_at = 0, colours_at = 0;  ///< in elements from the start of the chunk's buffers
    std::uint32_t ring_at = 0;                     ///< of its border in rings_
    const std::vector<std::uint16_t>* slots = nullptr;  ///< of its grid
  };
  /// A part of a slab's grid: samples from (i0, j0) to (i1, j1), both counted.
  struct Window {
    int i0 = 0, j0 = 0, i1 = -1, j1 = -1;
    [[nodiscard]] bool empty() const noexcept { return i1 < i0 || j1 < j0; }
    void add(const Window& other) noexcept;
  };
  struct ChangedSlab {
    SlabId slab = kNoSlab;
    Window window;  ///< holds all samples of which anything changed, also if only the normal
  };
  /// What an update changed.
  struct Changes {
    std::uint64_t tiles = 0;         ///< uploaded, in part or whole
    bool everything = false;         ///< another cage, other layers, or the first snapshot
    std::vector<ChangedSlab> slabs;  ///< whose picture may differ; not filled when everything does
  };

  /// Brings the cache to the snapshot: only tiles whose pointers differ are looked at, and of these only the rows that
  /// do, with those beside them and the borders of neighbours whose normals change with them. Context current. Nothing
  /// when `cancel` became true, and the next update starts anew.
  /// Cost: about 10 ns per sample of the rows, on one thread.
  [[nodiscard]] std::optional<Changes> update(const Snapshot& model, const std::atomic<bool>* cancel = nullptr);

  /// One level for all slabs, as far as each n has it.
  [[nodiscard]] Detail detail(int level);
  /// Level by slab (asserted: one for each), lowered where a grid has fewer, and to 0 in and beside slabs with holes.
  [[nodiscard]] Detail detail(std::vector<std::uint8_t> levels);

  /// Draws slabs with the program in use, stitched and without holes as tessellate() does it: an edge has the level of
  /// the coarser of its two slabs. Vertex stage: see kPlace. `wanted` empty: all slabs. Where `go_on` is given, draws
  /// in portions of about 50,000 triangles and stops when it says false. Returns the number of triangles.
  std::uint64_t draw(const Detail& detail, const std::function<bool(SlabId)>& wanted = {},
                     const std::function<bool()>& go_on = {});
  [[nodiscard]] std::uint64_t triangle_count(const Detail& detail) const noexcept;

  [[nodiscard]] Vec3d centre() const noexcept { return centre_; }
  /// Bounds of the displaced surface relative to centre(), exact.
  [[nodiscard]] const Box3d& bounds() const noexcept { return bounds_; }
  /// Bounds of the slabs relative to centre(): the same whatever the displacement.
  [[nodiscard]] Box3d slab_bounds() const noexcept;
  [[nodiscard]] std::span<const SlabState> slabs() const noexcept { return slabs_; }
  /// The box of a window of a slab with the samples up to `beside` steps around it, relative to centre(), for the
  /// displacement that a snapshot of the same cage has there.
  [[nodiscard]] Box3d box_of(const Snapshot& model, SlabId s, const Window& window, int beside);
  /// The snapshot that it holds; none before the first update.
  [[nodiscard]] const std::optional<Snapshot>& model() const noexcept { return last_; }
  /// The lowest displaced height along a unit direction, relative to centre(); exact along an axis, else never too
  /// high.
  [[nodiscard]] double lowest(Vec3d up) const noexcept;
  [[nodiscard]] float min_alpha() const noexcept { return min_alpha_; }
  [[nodiscard]] float max_alpha() const noexcept { return max_alpha_; }
  /// Whether every edge of the cage has a slab on either side, and there are no holes.
  [[nodiscard]] bool closed() const noexcept { return closed_ && holed_ == 0; }
  [[nodiscard]] bool has_colour() const noexcept { return colour_; }
  [[nodiscard]] bool has_mask() const noexcept { return last_ && last_->has(Layer::Mask); }
  /// Of all its buffers: samples, colours, records, indices, grid places, commands.
  [[nodiscard]] std::uint64_t gpu_bytes() const noexcept;

 private:
  /// Consecutive slabs whose samples lie in one buffer.
  struct Chunk {
    SlabId first = 0, count = 0;
    std::size_t sample_total = 0, colour_total = 0;
    GlBuffer samples, colours, records;
    SampleWord* sample_words = nullptr;     ///< mapped for writing
    std::uint32_t* colour_words = nullptr;  ///< mapped for writing
  };
  /// A slab as the vertex stage reads it.
  struct Record {
    std::array<Vec3f, 3> inner, outer;                             ///< relative to the centre
    std::uint32_t samples_at, grid, colours_at, colour_intervals;  ///< grid: n, and its first place times 256
  };
  /// What all slabs of a grid share.
  struct Grid {
    std::uint32_t places_at = 0;
    std::unique_ptr<BorderTable> border;
    /// Where in the buffer a sample lies, by its row-packed number: those of the coarsest level first, so that each
    /// level is what comes before the next, and a coarse one is read from few places.
    std::vector<std::uint16_t> slots;
  };
  /// From the grid of a layer to that of the displacement.
  struct Resampling {
    std::vector<std::array<std::uint16_t, 3>> from;
    std::vector<std::array<float, 3>> weight;
  };
  /// Sample numbers of the triangles of a grid at one level, stitched.
  struct Pattern {
    std::uint32_t first = 0, count = 0;  ///< in indices_
  };
  /// As OpenGL reads it.
  struct Command {
    std::uint32_t count, instances, first_index;
    std::int32_t base_vertex;
    std::uint32_t base_instance;
  };

  void rebuild(const Snapshot& model);
  void place_colours(const Snapshot& model);
  void write_records(const Snapshot& model, const Chunk& chunk);
  [[nodiscard]] Window changed_samples(const Snapshot& model, SlabId s, bool fresh) const;
  void measure(const Snapshot& model, SlabId s, const Window& changed, bool fresh);
  void measure_holed(const Snapshot& model, SlabId s);
  void find_masks(const Snapshot& model, SlabId s);
  void note_border(const Snapshot& model, SlabId s, const Window& changed, bool fresh);
  void write_border(const Snapshot& model, SlabId s, std::uint32_t place);
  void upload_colours(const Snapshot& model, SlabId s);
  void find_holes(const Snapshot& model, SlabId s);
  void forget_patterns();
  [[nodiscard]] static std::vector<std::uint32_t> places_of(int n);
  [[nodiscard]] std::uint32_t pattern(SlabId s, std::span<const std::uint8_t> levels);
  void total_up();
  void place(const Snapshot& model, SlabId s);
  [[nodiscard]] Window changed_texels(const Snapshot& model, SlabId s) const;
  void touch(SlabId s, const Window& window);

  std::optional<Snapshot> last_;
  Vec3d centre_;
  double unit_ = 1;      ///< model units in one of the kernels' lengths
  float curvature_ = 1;  ///< for second_word()
  Box3d bounds_;
  float min_alpha_ = 0, max_alpha_ = 1;
  bool closed_ = true, colour_ = false;
  std::uint32_t holed_ = 0;  ///< slabs
  std::vector<SlabState> slabs_;
  std::vector<Chunk> chunks_;
  /// What each slab gives to the samples on its border; the sums over all slabs around one are the same bits for all of
  /// them. Multiplied by the power of two in n, so that across an edge between slabs of different n the sideways parts
  /// of the offsets cancel.
  std::vector<Umbrella> rings_;
  std::vector<bool> ring_written_;  ///< in this update
  std::map<int, Grid> grids_;
  GlBuffer places_;
  std::uint64_t places_bytes_ = 0;
  std::map<std::pair<int, int>, Resampling> resamplings_;
  std::unordered_map<std::uint64_t, std::uint32_t> pattern_numbers_;  ///< by n, level and levels of the edges
  std::unordered_map<SlabId, std::uint32_t> holed_patterns_;
  std::vector<Pattern> patterns_;
  std::size_t wasted_ = 0;                  ///< indices of patterns that no longer hold
  std::vector<std::uint16_t> new_indices_;  ///< not yet in the buffer
  GlBuffer indices_;
  std::size_t index_count_ = 0, index_room_ = 0;
  GlBuffer commands_;
  std::size_t command_room_ = 0;
  GlVertexArray vertex_array_;
  // Scratch, kept to spare allocations.
  SlabPositions positions_;
  std::vector<std::uint32_t> firsts_, seconds_;
  std::vector<std::uint8_t> masks_;
  std::vector<Umbrella> umbrellas_;
  std::vector<std::pair<SlabId, std::uint32_t>> border_;      ///< places to be written
  std::vector<std::pair<SampleCopy, std::uint32_t>> copies_;  ///< with their places in rings_
  std::vector<std::uint32_t> written_;
  std::vector<Window> windows_;
  std::vector<SlabId> touched_;
  std::vector<Command> command_list_;
  Changes changes_;
};

}  // namespace relief::detail
