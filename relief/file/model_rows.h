// The rows of a model file: its facts, layers, pages of tiles and strokes.
#pragma once

#include <relief/core/model.h>
#include <relief/file/cage_rows.h>
#include <relief/file/database.h>
#include <relief/file/model_file.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relief::detail {

[[nodiscard]] const FileKind& model_kind() noexcept;

inline constexpr std::size_t kFibreBytes = 6 * sizeof(double);        ///< of a fibre in the cage, unpacked
inline constexpr std::size_t kSlabBytes = 4 * sizeof(std::uint32_t);  ///< of a slab
inline constexpr std::int64_t kWholeEvery = 64;  ///< after so many changes a page, or the cage, is written whole again

/// The singular facts of a model: small, rewritten as a whole, kept from damage by one checksum over all.
struct Meta {
  std::int64_t format = kFormatVersion;
  ModelInfo info;
  std::int64_t fibres = 0, slabs = 0;  ///< of the cage as it was made, before all cuts
  std::int64_t current = 0, last = 0;  ///< strokes: in effect; the last that can be redone
  std::string certificate;             ///< what the verifier proved when the file was made, such as "C0 C1 C3"
  bool float_colours = false;          ///< it was of format 1 or 2
  bool first_sculpted = false;         ///< see FirstState

  [[nodiscard]] std::int64_t checksum() const;
  /// Returns the same model in the newest format, which its rows fit, too.
  [[nodiscard]] Meta upgraded() const;
};

/// One layer as it lies in the file: since which stroke, with how many intervals, and what its samples are there.
struct LayerEntry {
  std::int64_t stroke = 0;
  std::int64_t intervals = kOwnIntervals;
  SampleType type = SampleType::F32;
  friend bool operator==(const LayerEntry&, const LayerEntry&) = default;
};
inline constexpr std::int64_t kLayerGone = -1;   ///< LayerEntry::intervals: the stroke took the layer away
inline constexpr std::int64_t kEachItsOwn = -2;  ///< the same: they differ, and stand in the cage's table
using LayerTable = std::array<std::optional<LayerEntry>, kLayerCount>;

/// Returns what a new layer's entry says of its grid.
[[nodiscard]] std::int64_t intervals_entry(Layer layer, const Grid& grid) noexcept;
[[nodiscard]] SampleType type_in_file(Layer layer, const Meta& meta) noexcept;

[[nodiscard]] constexpr SlabId pages_for(SlabId slabs) noexcept { return (slabs + kTilesPerPage - 1) / kTilesPerPage; }
[[nodiscard]] constexpr SlabId tiles_in_page(SlabId slabs, SlabId page) noexcept {
  return slabs - page * kTilesPerPage < kTilesPerPage ? slabs - page * kTilesPerPage : kTilesPerPage;
}
[[nodiscard]] constexpr std::uint64_t all_tiles(SlabId slabs, SlabId page) noexcept {
  return ~std::uint64_t{0} >> (kTilesPerPage - tiles_in_page(slabs, page));
}

/// Bytes of the tiles of a page that `mask` names, and where each begins.
struct PageLayout {
  std::array<std::size_t, kTilesPerPage + 1> begin{};
  std::uint64_t mask = 0;

  /// `mask` names tiles that there are.
  PageLayout(const Grid& grid, Layer layer, SampleType type, SlabId page, std::uint64_t tiles);
  [[nodiscard]] bool has(SlabId t) const { return (mask >> t & 1U) != 0; }
  [[nodiscard]] std::size_t bytes() const { return begin[kTilesPerPage]; }
  template <typename Byte>
  [[nodiscard]] std::span<Byte> tile(std::span<Byte> all, SlabId t) const {
    return all.subspan(begin[t], begin[t + 1] - begin[t]);
  }
};

/// The tiles of one page that a stroke changes.
struct PageChange {
  Layer layer;
  SlabId page;
  std::uint64_t tiles;
  bool whole;  ///< there is nothing that the tiles could differ from
};

using PageTiles = std::array<TilePtr, kTilesPerPage>;

/// Reads and writes the rows of a model. Errors name the file.
class Rows {
 public:
  explicit Rows(const Database& database) : database_(database), cage_(database) {}

  [[nodiscard]] const CageRows& cage() const noexcept { return cage_; }

  // ---- Writing; all inside a transaction that the caller ends.

  [[nodiscard]] Status write_meta(const Meta& meta) const;
  /// Returns which stroke is in effect.
  [[nodiscard]] Status write_place(const Meta& meta) const;
  [[nodiscard]] Status write_layer(Layer layer, const LayerEntry& entry) const;
  /// Writes tiles of `now` in one row: as they are when the page is whole, else as differences to those of before(s),
  /// which have the same shape.
  [[nodiscard]] Status write_page(const PageChange& change, SampleType type, std::int64_t stroke,
                                  const std::function<const Tile&(SlabId)>& before, const Snapshot& now) const;
  [[nodiscard]] Status write_stroke(const StrokeRecord& stroke, std::int64_t row_count) const;
  [[nodiscard]] Status drop_strokes_after(std::int64_t stroke) const;
  /// Returns how often a page was changed since it was last written whole.
  [[nodiscard]] Result<std::int64_t> changes_since_whole(Layer layer, SlabId page) const;

  // ---- Reading

  [[nodiscard]] Result<Meta> read_meta() const;
  /// Returns the layers in effect at a stroke. A damaged row matters until a later one of its layer takes its place.
  [[nodiscard]] Result<LayerTable> read_layers(std::int64_t stroke, const Meta& meta) const;
  /// Returns the strokes after the first and up to the last one named with which a layer came or went, in order.
  [[nodiscard]] Result<std::vector<std::int64_t>> layer_strokes(std::int64_t after, std::int64_t last) const;

  struct PageKey {
    std::int64_t stroke = 0;
    Layer layer = Layer::Displacement;
    SlabId page = 0;
  };
  /// Returns the rows of pages of the strokes after the first and up to the last one named, in their order.
  [[nodiscard]] Result<std::vector<PageKey>> page_keys(std::int64_t after, std::int64_t last) const;
  /// Returns the journal: strokes 1 to `last`.
  [[nodiscard]] Result<std::vector<StrokeRecord>> read_strokes(std::int64_t last) const;
  /// Returns the tiles of a page that the strokes after `after` up to `last` changed, on the other side of them than in
  /// `known`: a difference leads both ways. Nothing where one of them wrote the page whole, or fails its checksum.
  [[nodiscard]] Result<std::optional<PageTiles>> read_differences(const Snapshot& known, Layer layer,
                                                                  const LayerEntry& entry, const Grid& grid,
                                                                  SlabId page, std::int64_t after,
                                                                  std::int64_t last) const;
  /// Returns the tiles of a page as they stood after a stroke: its last whole row, then each later change. No slab of
  /// it has got another grid since.
  [[nodiscard]] Result<PageTiles> read_page(const Grid& grid, Layer layer, const LayerEntry& entry, SlabId page,
                                            std::int64_t stroke) const;
  /// Takes over what one row says, into the tiles of all slabs.
  [[nodiscard]] Status apply_row(const PageKey& key, const Grid& grid, const LayerEntry& entry,
                                 std::vector<TilePtr>& tiles) const;
  /// That every page of a layer is there at a stroke before memory is taken for it, so that what a file asks for is in
  /// proportion to its size. A cage that came later may need fewer pages than one before it.
  [[nodiscard]] Status check_pages(Layer layer, const LayerEntry& entry, const Grid& grid, std::int64_t stroke,
                                   bool may_need_fewer) const;
  /// Returns the first stroke that lacks rows which it wrote: from it on no state can be trusted; one after the last
  /// where all have theirs. Where a record is damaged, so that it cannot tell how many there were, the table of pages
  /// and its index vouch for each other. Error: Corrupt (the journal has a gap).
  [[nodiscard]] Result<std::int64_t> first_incomplete(const Meta& meta) const;

  [[nodiscard]] std::unexpected<Error> damaged(std::string_view what) const { return database_.damaged(what); }
  [[nodiscard]] std::unexpected<Error> cancelled() const { return database_.cancelled(); }
  [[nodiscard]] std::unexpected<Error> page_damage(Layer layer, SlabId page, std::int64_t stroke,
                                                   std::string_view what) const;

 private:
  /// One row of pages whose checksum holds.
  struct PageRow {
    std::int64_t stroke = 0;
    bool whole = false;
    std::uint64_t tiles = 0;
    std::span<const std::byte> data;
  };
  [[nodiscard]] Result<PageRow> page_row(const Statement& row, Layer layer, SlabId page) const;
  /// Returns the samples of the tiles that a row holds, into `samples`; where each begins.
  [[nodiscard]] Result<PageLayout> unpack_row(const PageRow& row, const LayerEntry& entry, const Grid& grid,
                                              Layer layer, SlabId page, std::vector<std::byte>& samples) const;
  [[nodiscard]] Status write_place(const Meta& meta, Statement& put) const;

  const Database& database_;
  CageRows cage_;
};

}  // namespace relief::detail
