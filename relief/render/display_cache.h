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
struct DrawnLevels {
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
    Vec3f axis;          ///< unit, outwards
    float cosine = -1;   ///< no micro-triangle leans farther from the axis; may be too low
    bool holed = false;  ///< has cells that are holes
    std::uint32_t chunk = 0;
    std::uint32_t samples_at = 0, colours_at = 0;       ///< in elements from the start of the chunk's buffers
    std::uint32_t ring_at = 0;                          ///< of its border in rings_
    int room = 0, colour_room = 0;                      ///< intervals of the finest grids that fit where its own lie
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
    Window window;          ///< holds all samples of which anything changed, also if only the normal
    bool reshaped = false;  ///< there was none of this number, or it had another place or grid
  };
  /// Holds what an update changed.
  struct Changes {
    std::uint64_t tiles = 0;         ///< uploaded, in part or whole
    bool everything = false;         ///< most of another cage, other layers, or the first snapshot
    bool cage = false;               ///< another cage: also what lies beside reshaped slabs may be stitched otherwise
    std::vector<ChangedSlab> slabs;  ///< whose picture may differ; not filled when everything does
  };

  /// Brings the cache to the snapshot: only tiles whose pointers differ are looked at, and of these only the rows that
  /// do, with those beside them and the borders of neighbours whose normals change with them. Of another cage, the
  /// slabs that have another place, grid or colour grid than the last one's of their number. The buffers then hold what
  /// a new cache would have. Context current. Nothing when `cancel` became true, and the next update starts again.
  /// Cost: about 10 ns per sample of the rows, on one thread; for another cage also about 50 ns per slab.
  [[nodiscard]] std::optional<Changes> update(const Snapshot& model, const std::atomic<bool>* cancel = nullptr);

  /// Returns one level for all slabs, as far as each n has it.
  [[nodiscard]] DrawnLevels detail(int level);
  /// Level by slab (asserted: one for each), lowered where a grid has fewer, where two slabs across an edge would have
  /// fewer samples on it than the one, and to 0 in and beside slabs with holes.
  [[nodiscard]] DrawnLevels detail(std::vector<std::uint8_t> levels);

  /// Draws slabs with the program in use, in order of their numbers, stitched and without holes as tessellate() does
  /// it: an edge has the level of the coarser of its two slabs. Vertex stage: see kPlace. `wanted` empty: all slabs.
  /// Where `go_on` is given, draws in portions of about 50,000 triangles and stops when it says false. Returns the
  /// number of triangles.
  std::uint64_t draw(const DrawnLevels& detail, const std::function<bool(SlabId)>& wanted = {},
                     const std::function<bool()>& go_on = {});
  [[nodiscard]] std::uint64_t triangle_count(const DrawnLevels& detail) const noexcept;

  [[nodiscard]] Vec3d centre() const noexcept { return centre_; }
  /// Bounds of the displaced surface relative to centre(), exact.
  [[nodiscard]] const Box3d& bounds() const noexcept { return bounds_; }
  /// Bounds of the slabs relative to centre(): the same whatever the displacement and the cuts.
  [[nodiscard]] Box3d slab_bounds() const noexcept { return {slab_box_.low - centre_, slab_box_.high - centre_}; }
  [[nodiscard]] std::span<const SlabState> slabs() const noexcept { return slabs_; }
  /// Returns the box of a window of a slab with the samples up to `beside` steps around it, relative to centre(), for
  /// the displacement that a snapshot of the same cage has there.
  [[nodiscard]] Box3d box_of(const Snapshot& model, SlabId s, const Window& window, int beside);
  /// Returns the snapshot that it holds; none before the first update.
  [[nodiscard]] const std::optional<Snapshot>& model() const noexcept { return last_; }
  /// Returns the lowest displaced height along a unit direction, relative to centre(); exact along an axis, else never
  /// too high.
  [[nodiscard]] double lowest(Vec3d up) const noexcept;
  [[nodiscard]] float min_alpha() const noexcept { return min_alpha_; }
  [[nodiscard]] float max_alpha() const noexcept { return max_alpha_; }
  /// Returns whether every edge of the cage has a slab on either side, and there are no holes.
  [[nodiscard]] bool closed() const noexcept { return closed_ && holed_ == 0; }
  [[nodiscard]] bool has_colour() const noexcept { return colour_; }
  [[nodiscard]] bool has_mask() const noexcept { return last_ && last_->has(Layer::Mask); }
  /// Of all its buffers: samples, colours, records, indices, grid places, commands.
  [[nodiscard]] std::uint64_t gpu_bytes() const noexcept;

 private:
  /// Slabs whose samples lie in one buffer, and their colours in another.
  struct Chunk {
    SlabId slabs = 0;                                ///< that have been given a place here
    std::size_t sample_total = 0, colour_total = 0;  ///< given away
    std::size_t sample_room = 0, colour_room = 0;    ///< of the buffers
    GlBuffer samples, colours;
    SampleWord* sample_words = nullptr;     ///< mapped for writing
    std::uint32_t* colour_words = nullptr;  ///< mapped for writing
  };
  /// A slab as the vertex stage reads it.
  struct Record {
    std::array<Vec3f, 3> inner, outer;                             ///< of its root, relative to the centre
    std::uint32_t samples_at, grid, colours_at, colour_intervals;  ///< grid: n, and its first place times 256
    /// Which part of its root it is, which has the same shape: where the weights of corners 0 and 1, times 2^level,
    /// begin in the root; with the first the level times 2^24, with the second 2^31 if it is turned round. Then its
    /// number.
    std::array<std::uint32_t, 3> part;
  };
  /// Holds what all slabs of a grid share.
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
  [[nodiscard]] bool reshaped(const Snapshot& model, SlabId s) const;
  [[nodiscard]] std::optional<std::vector<SlabId>> reshaped_slabs(const Snapshot& model) const;
  void follow_cage(const Snapshot& model, std::span<const SlabId> reshaped);
  [[nodiscard]] Grid& grid_of(int n);
  void load_places();
  void take_shape(const SlabMesh& mesh, SlabId s);
  void find_closed(const SlabMesh& mesh);
  void settle(const Snapshot& model, SlabId s);
  void give_up(SlabId s);
  [[nodiscard]] Chunk& chunk_with_room(std::size_t samples, std::size_t colours);
  void place_colours(const Snapshot& model);
  void write_records(const Snapshot& model, std::span<const SlabId> slabs);
  [[nodiscard]] Window changed_samples(const Snapshot& model, SlabId s, bool fresh) const;
  void measure(const Snapshot& model, SlabId s, const Window& changed, bool fresh);
  void measure_holed(const Snapshot& model, SlabId s);
  void find_masks(const Snapshot& model, SlabId s);
  void note_border(const Snapshot& model, SlabId s, const Window& changed, bool fresh);
  void write_border(const Snapshot& model, SlabId s, std::uint32_t place);
  void upload_colours(const Snapshot& model, SlabId s);
  void find_holes(const Snapshot& model, SlabId s);
  void forget_pattern(SlabId s);
  void forget_patterns();
  [[nodiscard]] static std::vector<std::uint32_t> places_of(int n);
  void fit_levels(std::vector<std::uint8_t>& levels) const;
  [[nodiscard]] std::uint32_t pattern(SlabId s, std::span<const std::uint8_t> levels);
  void total_up();
  void place(const Snapshot& model, SlabId s);
  [[nodiscard]] Window changed_texels(const Snapshot& model, SlabId s) const;
  void touch(SlabId s, const Window& window);

  std::optional<Snapshot> last_;
  Box3d slab_box_;  ///< of the roots
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
  /// them. Multiplied by the power of two in n and in the size of the slab's root, so that across an edge between slabs
  /// of different n or level the sideways parts of the offsets cancel.
  std::vector<Umbrella> rings_;
  std::vector<bool> ring_written_;  ///< in this update
  std::map<int, Grid> grids_;
  std::vector<std::uint32_t> grid_places_;
  GlBuffer places_;
  std::size_t places_loaded_ = 0;
  GlBuffer records_;  ///< by slab
  std::size_t record_room_ = 0;
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
