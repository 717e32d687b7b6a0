// One immutable version of a model: the cage and, layer by layer, the tiles.
#pragma once

#include <relief/base/assert.h>
#include <relief/core/sample_bounds.h>
#include <relief/core/slab_mesh.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace relief {

class PagedMemory;

/// One field over the surface. Displacement is alpha, 0 to 1 along the fibre; Colour is sRGB-encoded red, green and
/// blue, 0 to 1; the others are one number each. Displacement, Void and Folded share each slab's grid. The other layers
/// have grids of their own, under the same rules where slabs meet.
enum class Layer : std::uint8_t {
  Displacement,
  Colour,
  Stiffness,        ///< share of the force law's stiffness, 0..1
  StaticFriction,   ///< coefficient, 0..4
  DynamicFriction,  ///< coefficient, 0..4
  Specularity,      ///< 0..1
  Mask,             ///< 0 free, 1 protected from tools
  Strata,           ///< alpha of a buried boundary between materials
  Void,             ///< 0 surface, 1 hole (see is_hole)
  Folded,           ///< 1 where the fibre met the source several times, of which the sample holds one, or not at all
};
inline constexpr int kLayerCount = 10;

/// Stands for the number of intervals where each slab has its own.
inline constexpr int kOwnIntervals = 0;
[[nodiscard]] constexpr bool has_own_intervals(Layer layer) noexcept {
  return layer == Layer::Displacement || layer == Layer::Void || layer == Layer::Folded;
}

[[nodiscard]] constexpr int channels(Layer layer) noexcept { return layer == Layer::Colour ? 3 : 1; }
/// "displacement", "colour", "stiffness", "static-friction", ...
[[nodiscard]] std::string_view name(Layer layer) noexcept;
[[nodiscard]] std::optional<Layer> layer_from_name(std::string_view text) noexcept;
/// The range of values a layer may hold.
struct LayerRange {
  /// least and greatest value
  float low, high;
};
[[nodiscard]] LayerRange range(Layer layer) noexcept;

/// What a sample is kept as: a float, or 0..65535 for 0..1.
enum class SampleType : std::uint8_t { F32, U16 };
/// Colour needs no more than 16 bits, and has three channels.
[[nodiscard]] constexpr SampleType sample_type(Layer layer) noexcept {
  return layer == Layer::Colour ? SampleType::U16 : SampleType::F32;
}
[[nodiscard]] constexpr std::size_t bytes(SampleType type) noexcept {
  return type == SampleType::U16 ? sizeof(std::uint16_t) : sizeof(float);
}
/// Returns the nearest of 16 bits to 0..1; the nearer end for what is beyond, 0 for what is not a number. A colour of 8
/// bits, k / 255, becomes 257 k.
[[nodiscard]] constexpr std::uint16_t to_u16(float value) noexcept {
  return static_cast<std::uint16_t>((value > 0 ? value < 1 ? value : 1.0F : 0.0F) * 65535.0F + 0.5F);
}
/// 0..1; to_u16() gives it back.
[[nodiscard]] constexpr float from_u16(std::uint16_t sample) noexcept { return sample / 65535.0F; }

/// The samples of one slab in one layer: `channels` planes of (n+1)(n+2)/2 samples, each plane padded to a whole number
/// of 64-byte lines and aligned to one. The padding holds zeros and takes part in nothing.
class Tile {
 public:
  /// As a layer has them, in ordinary memory, or the values in that given.
  Tile(Layer layer, int intervals, float value, std::shared_ptr<PagedMemory> memory = nullptr);
  /// Returns the same, but all of it is in that memory.
  [[nodiscard]] static std::shared_ptr<Tile> make(Layer layer, int intervals, float value,
                                                  std::shared_ptr<PagedMemory> memory);
  /// Floats of no layer, to compute with.
  Tile(int intervals, int channel_count, float value);
  /// In ordinary memory.
  Tile(const Tile& other);
  Tile& operator=(const Tile&) = delete;
  Tile(Tile&&) = delete;
  Tile& operator=(Tile&&) = delete;
  ~Tile();

  /// n, along each edge
  [[nodiscard]] int intervals() const noexcept { return intervals_; }
  /// Values per sample.
  [[nodiscard]] int channel_count() const noexcept { return channel_count_; }
  /// Returns how a value is stored.
  [[nodiscard]] SampleType type() const noexcept { return type_; }
  /// Samples of the grid.
  [[nodiscard]] std::size_t size() const noexcept { return sample_count(intervals_); }
  /// Samples per plane including the padding.
  [[nodiscard]] std::size_t stride() const noexcept { return padded(intervals_, type_); }
  /// Values that a plane takes in memory, n intervals.
  [[nodiscard]] static constexpr std::size_t padded(int n, SampleType type = SampleType::F32) noexcept {
    const std::size_t in_line = 64 / relief::bytes(type);
    return (sample_count(n) + in_line - 1) / in_line * in_line;
  }
  /// Returns the samples of a channel; asserts that they are of that type.
  [[nodiscard]] const float* plane(int channel = 0) const noexcept { return plane_as<float>(channel); }
  /// Returns one channel's samples, to be written; F32 tiles.
  [[nodiscard]] float* plane(int channel = 0) noexcept {
    bounded_ = false;
    return plane_as<float>(channel);
  }
  /// Returns one channel's samples; U16 tiles.
  [[nodiscard]] const std::uint16_t* plane16(int channel) const noexcept { return plane_as<std::uint16_t>(channel); }
  /// Returns one channel's samples, to be written; U16 tiles.
  [[nodiscard]] std::uint16_t* plane16(int channel) noexcept { return plane_as<std::uint16_t>(channel); }
  /// Returns a sample as a number in the layer's range, whatever it is kept as; exact.
  [[nodiscard]] float value(int channel, std::size_t k) const noexcept {
    return type_ == SampleType::U16 ? from_u16(plane16(channel)[k]) : plane(channel)[k];
  }
  /// Keeps what comes nearest to a number.
  void set(int channel, std::size_t k, float value) noexcept {
    if (type_ == SampleType::U16)
      plane16(channel)[k] = to_u16(value);
    else
      plane(channel)[k] = value;
  }
  /// Takes over all values of a tile of the same shape.
  void copy_values(const Tile& other) noexcept;
  /// Of the planes.
  [[nodiscard]] std::size_t bytes() const noexcept;
  static constexpr std::size_t kBeside = 192;  ///< about what a small tile takes beside its planes: itself, its bounds
  /// Equal intervals, channels and type.
  [[nodiscard]] bool same_shape(const Tile& other) const noexcept;
  /// Equal values, bit for bit.
  [[nodiscard]] bool same_values(const Tile& other) const noexcept;

  /// Between which values the samples of the one plane lie; of Displacement and Void tiles in a snapshot.
  [[nodiscard]] const SampleBounds& bounds() const noexcept { return *bounds_; }
  /// Makes bounds() true. Whoever asks for a plane to write makes it untrue; SnapshotDraft::finish() and
  /// Snapshot::make() mend it.
  void find_bounds();
  /// The same, fast where the two differ little: `before` knows its bounds and has the same intervals.
  void find_bounds(const Tile& before);
  /// Returns whether bounds() has been computed.
  [[nodiscard]] bool bounds_known() const noexcept { return bounded_; }

  /// Returns where its values and bounds lie, and it too if make() made it; null: in ordinary memory.
  [[nodiscard]] const std::shared_ptr<PagedMemory>& memory() const noexcept { return memory_; }
  /// What goes through many tiles says that it is done with this one, or with that many like it: they need not stay
  /// resident.
  void rest(std::size_t tiles = 1) const noexcept;

 private:
  Tile(int intervals, int channel_count, SampleType type, float value, std::shared_ptr<PagedMemory> memory);
  template <typename Sample>
  [[nodiscard]] Sample* plane_as(int channel) const noexcept {
    constexpr SampleType kType = sizeof(Sample) == sizeof(float) ? SampleType::F32 : SampleType::U16;
    RELIEF_ASSERT(type_ == kType);
    return static_cast<Sample*>(values_) + static_cast<std::size_t>(channel) * padded(intervals_, kType);
  }
  [[nodiscard]] SampleBounds& make_bounds();

  std::int16_t intervals_;
  std::int8_t channel_count_;
  SampleType type_;
  bool bounded_ = false;
  void* values_;
  std::shared_ptr<PagedMemory> memory_;
  SampleBounds* bounds_ = nullptr;
};
using TilePtr = std::shared_ptr<const Tile>;

/// Returns the value that a constrained sample must have, from its tile. Void, Folded: that of the nearer end.
/// Otherwise linear between the two ends, rounded once, and the same counted from either end.
[[nodiscard]] float constrained_value(const Tile& tile, Layer layer, const EdgePlace& place, int channel = 0) noexcept;
/// Gives the constrained samples of a tile that lies on the slab's own grid their values. Whoever writes such a tile
/// calls this last.
void constrain(const SlabMesh& mesh, Layer layer, SlabId s, Tile& tile) noexcept;
/// Returns the same where slab k has a tile of intervals_of(k).
template <std::invocable<SlabId> IntervalsOf>
void constrain(const SlabMesh& mesh, Layer layer, SlabId s, IntervalsOf&& intervals_of, Tile& tile) noexcept {
  mesh.for_each_constrained(s, intervals_of, [&](GridPoint p, const EdgePlace& place) {
    for (int c = 0; c < tile.channel_count(); ++c)
      tile.set(c, sample_index(tile.intervals(), p), constrained_value(tile, layer, place, c));
  });
}

/// Returns whether a micro-triangle is left out of the surface, from its corners in Layer::Void: two or more are above
/// 0.5.
[[nodiscard]] constexpr bool is_hole(float a, float b, float c) noexcept {
  return (a > 0.5F && (b > 0.5F || c > 0.5F)) || (b > 0.5F && c > 0.5F);
}

inline constexpr SlabId kTilesPerPage = 64, kPagesPerNode = 64;
/// The tiles of 64 consecutive slabs in one layer; those beyond the last slab are null.
struct Page {
  std::array<TilePtr, kTilesPerPage> tiles;  ///< of slabs that follow each other; null where the layer has none
};
using PagePtr = std::shared_ptr<const Page>;
/// 64 consecutive pages; those beyond the last are null.
struct PageNode {
  std::array<PagePtr, kPagesPerNode> pages;  ///< in the order of the slabs
};
using PageNodePtr = std::shared_ptr<const PageNode>;
/// A layer in the order of slabs. Table, nodes, pages and tiles are copied when something below them is first written.
/// So a change of one tile costs the same in any model: one pointer per 4,096 slabs, a node and a page.
using PageTable = std::vector<PageNodePtr>;

class Snapshot;
using SnapshotPtr = std::shared_ptr<const Snapshot>;

/// Immutable; safe to read from any thread for as long as somebody holds it. Copying one copies a pointer per layer.
class Snapshot {
 public:
  /// Returns a model with a displacement of `alpha` everywhere, each tile with its slab's n, and no other layer.
  [[nodiscard]] static SnapshotPtr make(std::shared_ptr<const SlabMesh> slab_mesh, float alpha = 0.5F);
  /// Returns the same with the displacement that each slab in turn is given, with its n: nobody has seen these tiles
  /// yet, or they know their bounds.
  [[nodiscard]] static SnapshotPtr make(std::shared_ptr<const SlabMesh> slab_mesh,
                                        const std::function<TilePtr(SlabId)>& displacement);

  /// Returns a model of these tiles: `tiles_of` gives those of each layer, one per slab, or none of a layer that it
  /// lacks. Nobody has seen them yet, or they know their bounds.
  [[nodiscard]] static SnapshotPtr of_tiles(std::shared_ptr<const SlabMesh> slab_mesh,
                                            const std::function<std::vector<TilePtr>(Layer)>& tiles_of);

  /// Returns the layers of a model on another cage: `tiles_of` gives those of each layer that it has, one per slab.
  /// Pages whose tiles are all the old ones are shared. Nobody has seen new tiles yet, or they know their bounds.
  [[nodiscard]] static SnapshotPtr with_cage(const Snapshot& before, std::shared_ptr<const SlabMesh> slab_mesh,
                                             const std::function<std::vector<TilePtr>(Layer)>& tiles_of);

  /// Returns the cage.
  [[nodiscard]] const SlabMesh& slab_mesh() const noexcept { return *slab_mesh_; }
  /// Returns the cage, to be kept beyond the snapshot.
  [[nodiscard]] const std::shared_ptr<const SlabMesh>& shared_slab_mesh() const noexcept { return slab_mesh_; }
  /// Returns whether the layer is there.
  [[nodiscard]] bool has(Layer layer) const noexcept { return !table(layer).empty(); }
  /// Returns the samples of slab s in a layer that is there.
  [[nodiscard]] const Tile& tile(Layer layer, SlabId s) const noexcept { return *shared_tile(layer, s); }
  /// Returns the same, to be kept beyond the snapshot.
  [[nodiscard]] const TilePtr& shared_tile(Layer layer, SlabId s) const noexcept {
    const SlabId page = s / kTilesPerPage;
    return table(layer)[page / kPagesPerNode]->pages[page % kPagesPerNode]->tiles[s % kTilesPerPage];
  }
  /// Of the slab's tile.
  [[nodiscard]] int intervals(Layer layer, SlabId s) const noexcept {
    return has_own_intervals(layer) ? slab_mesh_->intervals(s) : tile(layer, s).intervals();
  }
  /// Returns the displacements of slab s, alpha in [0, 1].
  [[nodiscard]] const float* displacement(SlabId s) const noexcept { return tile(Layer::Displacement, s).plane(); }
  /// Returns whether a micro-triangle of the slab's grid is a hole.
  [[nodiscard]] bool is_hole(SlabId s, const std::array<GridPoint, 3>& cell) const noexcept {
    if (!has(Layer::Void)) return false;
    const float* voids = tile(Layer::Void, s).plane();
    const int n = slab_mesh_->intervals(s);
    return relief::is_hole(voids[sample_index(n, cell[0])], voids[sample_index(n, cell[1])],
                           voids[sample_index(n, cell[2])]);
  }
  /// Empty where the model has no such layer.
  [[nodiscard]] const PageTable& table(Layer layer) const noexcept { return *tables_[static_cast<std::size_t>(layer)]; }
  /// Another one for each snapshot that this process has made; never 0.
  [[nodiscard]] std::uint64_t number() const noexcept { return number_; }
  /// Equal for equal content (cage, layers, values), whatever the history; O(model).
  [[nodiscard]] std::uint64_t content_hash() const noexcept;
  /// Bytes of all tiles, with their bounds.
  [[nodiscard]] std::size_t bytes() const noexcept;

 private:
  friend class SnapshotDraft;
  Snapshot();
  std::uint64_t number_;
  std::shared_ptr<const SlabMesh> slab_mesh_;
  std::array<std::shared_ptr<const PageTable>, kLayerCount> tables_;  ///< never null
};

/// Makes the next snapshot from one: tiles are copied when they are first written. One thread.
class SnapshotDraft {
 public:
  /// Begins as `base`.
  explicit SnapshotDraft(SnapshotPtr base);

  /// Returns the tile as it stands in the draft; the displacement of edit() shows here at once.
  [[nodiscard]] const Tile& tile(Layer layer, SlabId s) const noexcept;
  /// Returns the tile for writing: copied from the base the first time, the same one after that. Valid until finish().
  [[nodiscard]] Tile& edit(Layer layer, SlabId s);
  /// Adds a layer with m intervals per slab edge (1..128; kOwnIntervals: each slab's own), or replaces it, filled with
  /// `value` in every channel. On a cage with cuts m counts for the finest grid: the others are as much coarser as
  /// those of the displacement.
  void add_layer(Layer layer, int m, float value);
  /// Puts a ready tile in place; its intervals, channels and type must fit the layer.
  void put(Layer layer, SlabId s, TilePtr tile);
  /// Returns what the draft began as.
  [[nodiscard]] const Snapshot& base() const noexcept { return *base_; }
  /// Returns what finish() would give: its tiles are there, their bounds and its number are not.
  [[nodiscard]] const Snapshot& now() const noexcept { return *next_; }

  /// Returns the next snapshot; the draft then continues from it.
  [[nodiscard]] SnapshotPtr finish();

 private:
  /// Holds what this draft has made since the last finish(): nothing of a layer that it has not written.
  struct OwnPage {
    std::shared_ptr<Page> page;
    std::uint64_t own_tiles = 0;  ///< bit t: tile t was made by edit(), so it may be written
    std::uint64_t new_tiles = 0;  ///< bit t: tile t was made by edit() or put in place
  };
  struct OwnLayer {
    std::shared_ptr<PageTable> table;
    std::vector<std::shared_ptr<PageNode>> nodes;  ///< by number; null for the base's
    std::unordered_map<SlabId, OwnPage> pages;     ///< by number
  };
  OwnLayer& layer_for_writing(Layer layer);
  OwnPage& page_for_writing(Layer layer, SlabId s);

  SnapshotPtr base_;
  std::shared_ptr<Snapshot> next_;
  std::array<OwnLayer, kLayerCount> own_;
};

/// Calls visit(Layer, SlabId) for each tile of `to` whose pointer differs between two snapshots, in order of slabs.
/// Slabs that `from` did not have count as changed, and so does a layer that only `to` has. Cost: a pointer per 4,096
/// slabs, and the nodes and pages that differ.
template <typename Visit>
void for_each_change(const Snapshot& from, const Snapshot& to, Visit&& visit) {
  static const PageNode no_pages;
  static const Page no_tiles;
  for (int k = 0; k < kLayerCount; ++k) {
    const auto layer = static_cast<Layer>(k);
    const auto &before = from.table(layer), &after = to.table(layer);
    for (SlabId n = 0; n < after.size(); ++n) {
      const PageNode &a = n >= before.size() ? no_pages : *before[n], &b = *after[n];
      if (&a == &b) continue;
      for (SlabId p = 0; p < kPagesPerNode; ++p) {
        if (a.pages[p] == b.pages[p] || !b.pages[p]) continue;
        const Page &old_page = a.pages[p] ? *a.pages[p] : no_tiles, &new_page = *b.pages[p];
        for (SlabId t = 0; t < kTilesPerPage; ++t)
          if (old_page.tiles[t] != new_page.tiles[t] && new_page.tiles[t])
            visit(layer, (n * kPagesPerNode + p) * kTilesPerPage + t);
      }
    }
  }
}

}  // namespace relief
