// One immutable version of a model: the cage and, layer by layer, the tiles.
#pragma once

#include <relief/core/sample_bounds.h>
#include <relief/core/slab_mesh.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

namespace relief {

class PagedMemory;

/// One field over the surface. Displacement is alpha, 0..1 along the fibre; Colour is sRGB-encoded red, green, blue
/// 0..1; the others are one number each, with the ranges given. Displacement, Void and Folded lie on each slab's own
/// grid, the others on one of m intervals in all slabs.
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
  float low, high;
};
[[nodiscard]] LayerRange range(Layer layer) noexcept;

/// The samples of one slab in one layer: `channels` planes of (n+1)(n+2)/2 floats, each plane padded to a whole number
/// of 64-byte lines and aligned to one. The padding holds zeros and takes part in nothing.
class Tile {
 public:
  /// Its values in ordinary memory, or in that given.
  Tile(int intervals, int channel_count, float value, std::shared_ptr<PagedMemory> memory = nullptr);
  /// The same, but all of it is in that memory.
  [[nodiscard]] static std::shared_ptr<Tile> make(int intervals, int channel_count, float value,
                                                  std::shared_ptr<PagedMemory> memory);
  /// In ordinary memory.
  Tile(const Tile& other);
  Tile& operator=(const Tile&) = delete;
  Tile(Tile&&) = delete;
  Tile& operator=(Tile&&) = delete;
  ~Tile();

  [[nodiscard]] int intervals() const noexcept { return intervals_; }
  [[nodiscard]] int channel_count() const noexcept { return channel_count_; }
  [[nodiscard]] std::size_t size() const noexcept { return sample_count(intervals_); }
  /// Samples per plane including the padding.
  [[nodiscard]] std::size_t stride() const noexcept { return padded(intervals_); }
  [[nodiscard]] const float* plane(int channel = 0) const noexcept {
    return values_ + static_cast<std::size_t>(channel) * stride();
  }
  [[nodiscard]] float* plane(int channel = 0) noexcept {
    bounded_ = false;
    return values_ + static_cast<std::size_t>(channel) * stride();
  }
  [[nodiscard]] static constexpr std::size_t padded(int n) noexcept { return (sample_count(n) + 15) / 16 * 16; }
  /// Of the planes.
  [[nodiscard]] std::size_t bytes() const noexcept;
  static constexpr std::size_t kBeside = 192;  ///< about what a small tile takes beside its planes: itself, its bounds
  /// Equal values, bit for bit.
  [[nodiscard]] bool same_values(const Tile& other) const noexcept;

  /// Between which values the samples of the first plane lie; of Displacement and Void tiles in a snapshot.
  [[nodiscard]] const SampleBounds& bounds() const noexcept { return *bounds_; }
  /// Makes bounds() true. Whoever asks for a plane to write makes it untrue; SnapshotDraft::finish() and
  /// Snapshot::make() mend it.
  void find_bounds();
  [[nodiscard]] bool bounds_known() const noexcept { return bounded_; }

  /// Where its values and bounds lie, and it too if make() made it; null: in ordinary memory.
  [[nodiscard]] const std::shared_ptr<PagedMemory>& memory() const noexcept { return memory_; }
  /// What goes through many tiles says that it is done with this one, or with that many like it: they need not stay
  /// resident.
  void rest(std::size_t tiles = 1) const noexcept;

 private:
  std::int16_t intervals_;
  std::int8_t channel_count_;
  bool bounded_ = false;
  float* values_;
  std::shared_ptr<PagedMemory> memory_;
  SampleBounds* bounds_ = nullptr;
};
using TilePtr = std::shared_ptr<const Tile>;

/// The value that a constrained sample must have, from its tile in a layer of own intervals. Void, Folded: that of the
/// nearer end. Otherwise linear between the two ends, rounded once, and the same counted from either end.
[[nodiscard]] float constrained_value(const Tile& tile, Layer layer, const EdgePlace& place) noexcept;
/// Gives the constrained samples of the tile their values. Whoever writes a tile of own intervals calls this last.
void constrain(const SlabMesh& mesh, Layer layer, SlabId s, Tile& tile) noexcept;

/// Whether a micro-triangle is left out of the surface, from its corners in Layer::Void: two or more are above 0.5.
[[nodiscard]] constexpr bool is_hole(float a, float b, float c) noexcept {
  return (a > 0.5F && (b > 0.5F || c > 0.5F)) || (b > 0.5F && c > 0.5F);
}

inline constexpr SlabId kTilesPerPage = 64;
/// The tiles of 64 consecutive slabs in one layer; the unit of copy-on-write above the tile.
struct Page {
  std::array<TilePtr, kTilesPerPage> tiles;
};
using PagePtr = std::shared_ptr<const Page>;
using PageTable = std::vector<PagePtr>;

class Snapshot;
using SnapshotPtr = std::shared_ptr<const Snapshot>;

/// Immutable; safe to read from any thread for as long as somebody holds it. Copying one copies a pointer per layer.
class Snapshot {
 public:
  /// A model with a displacement of `alpha` everywhere, each tile with its slab's n, and no other layer.
  [[nodiscard]] static SnapshotPtr make(std::shared_ptr<const SlabMesh> slab_mesh, float alpha = 0.5F);
  /// The same with the displacement that each slab in turn is given, with its n: nobody has seen these tiles yet, or
  /// they know their bounds.
  [[nodiscard]] static SnapshotPtr make(std::shared_ptr<const SlabMesh> slab_mesh,
                                        const std::function<TilePtr(SlabId)>& displacement);

  [[nodiscard]] const SlabMesh& slab_mesh() const noexcept { return *slab_mesh_; }
  [[nodiscard]] const std::shared_ptr<const SlabMesh>& shared_slab_mesh() const noexcept { return slab_mesh_; }
  [[nodiscard]] bool has(Layer layer) const noexcept { return !pages(layer).empty(); }
  [[nodiscard]] const Tile& tile(Layer layer, SlabId s) const noexcept {
    return *pages(layer)[s / kTilesPerPage]->tiles[s % kTilesPerPage];
  }
  [[nodiscard]] const float* displacement(SlabId s) const noexcept { return tile(Layer::Displacement, s).plane(); }
  /// Whether a micro-triangle of the slab's grid is a hole.
  [[nodiscard]] bool is_hole(SlabId s, const std::array<GridPoint, 3>& cell) const noexcept {
    if (!has(Layer::Void)) return false;
    const float* voids = tile(Layer::Void, s).plane();
    const int n = slab_mesh_->intervals(s);
    return relief::is_hole(voids[sample_index(n, cell[0])], voids[sample_index(n, cell[1])],
                           voids[sample_index(n, cell[2])]);
  }
  /// The pages of a layer in order of slabs; empty where the model has no such layer.
  [[nodiscard]] const PageTable& pages(Layer layer) const noexcept { return *tables_[static_cast<std::size_t>(layer)]; }
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
  explicit SnapshotDraft(SnapshotPtr base);

  /// The tile as it stands in the draft; the displacement of edit() shows here at once.
  [[nodiscard]] const Tile& tile(Layer layer, SlabId s) const noexcept;
  /// The tile for writing: copied from the base the first time, the same one after that. Valid until finish().
  [[nodiscard]] Tile& edit(Layer layer, SlabId s);
  /// Adds a layer with m intervals per slab edge (1..128; kOwnIntervals for Void), or replaces it, filled with `value`
  /// in every channel.
  void add_layer(Layer layer, int m, float value);
  /// Puts a ready tile in place; its intervals and channels must fit the layer.
  void put(Layer layer, SlabId s, TilePtr tile);
  [[nodiscard]] const Snapshot& base() const noexcept { return *base_; }
  /// What finish() would give: its tiles are there, their bounds and its number are not.
  [[nodiscard]] const Snapshot& now() const noexcept { return *next_; }

  /// The next snapshot; the draft then continues from it.
  [[nodiscard]] SnapshotPtr finish();

 private:
  /// What this draft has made since the last finish(): nothing of a layer that it has not written.
  struct OwnPage {
    std::shared_ptr<Page> page;
    std::uint64_t own_tiles = 0;  ///< bit t: tile t was made by edit(), so it may be written
    std::uint64_t new_tiles = 0;  ///< bit t: tile t was made by edit() or put in place
  };
  struct OwnLayer {
    std::shared_ptr<PageTable> table;
    std::vector<OwnPage> pages;          ///< by page number
    std::vector<std::size_t> own_pages;  ///< numbers of those that are set
  };
  OwnLayer& layer_for_writing(Layer layer);
  OwnPage& page_for_writing(Layer layer, SlabId s);

  SnapshotPtr base_;
  std::shared_ptr<Snapshot> next_;
  std::array<OwnLayer, kLayerCount> own_;
};

/// Calls visit(Layer, SlabId) for each tile whose pointer differs between two snapshots of the same cage, in order.
/// Cost: the number of pages plus the tiles of pages that differ. A layer present in `to` only counts as changed
/// throughout; one that only `from` has is not visited.
template <typename Visit>
void for_each_change(const Snapshot& from, const Snapshot& to, Visit&& visit) {
  for (int k = 0; k < kLayerCount; ++k) {
    const auto layer = static_cast<Layer>(k);
    const auto &a = from.pages(layer), &b = to.pages(layer);
    for (std::size_t page = 0; page < b.size(); ++page) {
      if (page < a.size() && a[page] == b[page]) continue;
      for (SlabId t = 0; t < kTilesPerPage; ++t) {
        const TilePtr& now = b[page]->tiles[t];
        if (now && (page >= a.size() || a[page]->tiles[t] != now))
          visit(layer, static_cast<SlabId>(page) * kTilesPerPage + t);
      }
    }
  }
}

}  // namespace relief
