#include <relief/base/steps.h>
#include <relief/base/try.h>
#include <relief/core/detail.h>
#include <relief/core/query.h>
#include <relief/file/states.h>
#include <relief/file/tile_codec.h>

#include <algorithm>
#include <array>
#include <set>
#include <utility>

namespace relief::detail {

namespace {

using Tiles = std::array<std::vector<TilePtr>, kLayerCount>;

// Of the time of reading a model: up to here its pages, up to there the strokes since they were whole; then the checks.
constexpr double kPagesShare = 0.6, kStrokesShare = 0.7;

std::size_t present(const LayerTable& layers) {
  return static_cast<std::size_t>(std::ranges::count_if(layers, [](const auto& entry) { return entry.has_value(); }));
}

template <typename Visit>
Status for_each_layer(const LayerTable& layers, Visit&& visit) {
  for (std::size_t k = 0; k < layers.size(); ++k)
    if (layers[k]) RELIEF_CHECK(visit(static_cast<Layer>(k), *layers[k]));
  return {};
}

std::vector<TilePtr> tiles_of(const Snapshot& model, Layer layer) {
  std::vector<TilePtr> tiles;
  for (SlabId s = 0; model.has(layer) && s < model.slab_mesh().slab_count(); ++s)
    tiles.push_back(model.shared_tile(layer, s));
  return tiles;
}

/// A model on its way from stroke to stroke. Whether its cage is one shows in the end.
class Traveller {
 public:
  /// `with_tiles`: else only cage, layers and grids are followed.
  Traveller(const Rows& rows, const Meta& meta, const Progress& progress, bool with_tiles)
      : rows_(rows), meta_(meta), progress_(progress), with_tiles_(with_tiles) {}

  /// Starts at the model at `near_stroke`.
  void start(const FileState& near) {
    cage_ = cage_of(*near.snapshot);
    layers_ = near.layers;
    for (std::size_t k = 0; k < tiles_.size(); ++k) tiles_[k] = tiles_of(*near.snapshot, static_cast<Layer>(k));
  }

  /// Starts where the file says all of it, and comes to a stroke.
  Status run(std::int64_t stroke) {
    RELIEF_TRY(const std::int64_t whole, rows_.cage().last_whole(stroke));
    RELIEF_TRY(const auto changes, rows_.cage().changes(whole, stroke));
    const std::int64_t base = changes.empty() ? stroke : changes.front() - 1;
    RELIEF_TRY(cage_, rows_.cage().read_whole(whole, meta_));
    RELIEF_TRY(layers_, rows_.read_layers(base, meta_));
    RELIEF_CHECK(take_grids(whole));
    if (with_tiles_) {
      // What the cage is made of is looked at before memory is taken for tiles.
      auto mesh = mesh_of(cage_);
      if (!mesh) return rows_.damaged(mesh.error().message);
      mesh_ = *std::move(mesh);
      RELIEF_CHECK(read_pages(base, whole > 0));
    }
    return advance(base, stroke);
  }

  /// Goes over the strokes after `from` up to `to`.
  Status advance(std::int64_t from, std::int64_t to) {
    if (from == to) return {};
    RELIEF_TRY(const auto cages, rows_.cage().changes(from, to));
    RELIEF_TRY(const auto layers, rows_.layer_strokes(from, to));
    std::vector<Rows::PageKey> pages;
    if (with_tiles_) {
      RELIEF_TRY(pages, rows_.page_keys(from, to));
    }
    std::set<std::int64_t> strokes(cages.begin(), cages.end());
    strokes.insert(layers.begin(), layers.end());
    for (const Rows::PageKey& key : pages) strokes.insert(key.stroke);
    Steps steps(progress_, "read", strokes.size(), kPagesShare, kStrokesShare);
    auto page = pages.begin();
    for (const std::int64_t stroke : strokes) {
      if (!steps.next()) return rows_.cancelled();
      const bool has_layers = std::ranges::binary_search(layers, stroke);
      if (has_layers) RELIEF_CHECK(let_layers_go(stroke));
      if (std::ranges::binary_search(cages, stroke)) RELIEF_CHECK(change_cage(stroke));
      if (has_layers) RELIEF_CHECK(begin_layers(stroke));
      for (; page != pages.end() && page->stroke == stroke; ++page) RELIEF_CHECK(apply(*page));
    }
    return {};
  }

  /// Returns the model where it has come to.
  Result<FileState> arrive(const Snapshot* near) {
    const bool near_cage = near != nullptr && is_of(cage_, near->slab_mesh());
    if (near_cage) {
      mesh_ = near->shared_slab_mesh();
    } else if (!mesh_) {
      auto mesh = mesh_of(cage_);
      if (!mesh) return rows_.damaged(mesh.error().message);
      mesh_ = *std::move(mesh);
    }
    RELIEF_CHECK(check_whole());
    share_with(near);
    const SnapshotPtr made =
        Snapshot::of_tiles(mesh_, [&](Layer layer) { return std::move(tiles_[static_cast<std::size_t>(layer)]); });
    RELIEF_CHECK(check_samples(*made));
    return FileState{made, layers_};
  }

  [[nodiscard]] const CageState& cage() const noexcept { return cage_; }
  [[nodiscard]] const LayerTable& layers() const noexcept { return layers_; }

 private:
  [[nodiscard]] SlabId slab_count() const noexcept { return cage_.slab_count(); }

  /// Returns the grids of layers that are the same everywhere.
  Status take_grids(std::int64_t told_at) {
    for (std::size_t k = 0; k < layers_.size(); ++k)
      if (!layers_[k]) cage_.grids[k].clear();
    RELIEF_CHECK(for_each_layer(layers_, [&](Layer layer, const LayerEntry& entry) -> Status {
      Grid& grid = cage_.grids[static_cast<std::size_t>(layer)];
      if (has_own_intervals(layer) || (entry.stroke <= told_at && !grid.empty())) return {};
      return take_grid(entry, grid);
    }));
    return {};
  }
  Status take_grid(const LayerEntry& entry, Grid& grid) const {
    if (entry.intervals == kEachItsOwn) {
      if (grid.size() != slab_count()) return rows_.damaged("its layers do not make sense");
    } else {
      grid.assign(slab_count(), static_cast<std::uint8_t>(entry.intervals));
    }
    return {};
  }

  Status read_pages(std::int64_t stroke, bool may_need_fewer) {
    const SlabId count = pages_for(slab_count());
    if (!cage_.has_sound_grids()) return rows_.damaged("its grids do not make sense");
    RELIEF_CHECK(for_each_layer(layers_, [&](Layer layer, const LayerEntry& entry) {
      return rows_.check_pages(layer, entry, cage_.grid(layer), stroke, may_need_fewer);
    }));
    Steps steps(progress_, "read", present(layers_) * std::uint64_t{count}, 0, kPagesShare);
    return for_each_layer(layers_, [&](Layer layer, const LayerEntry& entry) -> Status {
      std::vector<TilePtr>& tiles = tiles_[static_cast<std::size_t>(layer)];
      tiles.reserve(slab_count());
      for (SlabId page = 0; page < count; ++page) {
        if (!steps.next()) return rows_.cancelled();
        RELIEF_TRY(const PageTiles read, rows_.read_page(cage_.grid(layer), layer, entry, page, stroke));
        tiles.insert(tiles.end(), read.begin(), read.begin() + tiles_in_page(slab_count(), page));
      }
      return {};
    });
  }

  Status change_cage(std::int64_t stroke) {
    mesh_.reset();
    const CageState before = cage_;
    RELIEF_TRY(const CageRows::Step step, rows_.cage().apply(stroke, cage_));
    if (!cage_.has_sound_grids()) return rows_.damaged("its grids do not make sense");
    if (step.whole) {
      keep_tiles(before);
      return {};
    }
    const std::vector<RootPlace> parts = parts_after(before.slab_count(), step.new_cuts);
    std::size_t carried = 0;
    for (std::size_t k = 0; k < tiles_.size(); ++k) {
      if (tiles_[k].empty()) continue;
      const auto layer = static_cast<Layer>(k);
      const Grid& grid = cage_.grid(layer);
      const std::vector<TilePtr> from = std::exchange(tiles_[k], std::vector<TilePtr>(slab_count()));
      for (SlabId s = 0; s < slab_count(); ++s) {
        const TilePtr& old = from[parts[s].root];
        if (!old) return rows_.page_damage(layer, parts[s].root / kTilesPerPage, stroke, "is missing");
        if (parts[s].level > 0 || old->intervals() != grid[s]) {
          carried += tile_bytes(layer, grid[s], sample_type(layer));
          if (carried > step.may_carry) return rows_.damaged("its cage claims more tiles than it can hold");
        }
        tiles_[k][s] = carried_tile(old, layer, parts[s], grid[s]);
      }
    }
    return {};
  }

  /// After a change that told all of the cage, tiles of another grid are told, too.
  void keep_tiles(const CageState& before) {
    for (std::size_t k = 0; k < tiles_.size(); ++k) {
      if (tiles_[k].empty()) continue;
      const auto layer = static_cast<Layer>(k);
      tiles_[k].resize(slab_count());
      for (SlabId s = 0; s < slab_count(); ++s)
        if (s >= before.slab_count() || before.levels[s] != cage_.levels[s] || !tiles_[k][s] ||
            tiles_[k][s]->intervals() != cage_.grid(layer)[s])
          tiles_[k][s] = nullptr;
    }
  }

  /// Returns those that the stroke takes away or brings.
  Status let_layers_go(std::int64_t stroke) {
    RELIEF_TRY(layers_, rows_.read_layers(stroke, meta_));
    for (std::size_t k = 0; k < layers_.size(); ++k) {
      if (layers_[k] && layers_[k]->stroke != stroke) continue;
      tiles_[k].clear();
      cage_.grids[k].clear();
    }
    return {};
  }
  Status begin_layers(std::int64_t stroke) {
    return for_each_layer(layers_, [&](Layer layer, const LayerEntry& entry) -> Status {
      const auto k = static_cast<std::size_t>(layer);
      if (entry.stroke != stroke) return {};
      if (!has_own_intervals(layer)) RELIEF_CHECK(take_grid(entry, cage_.grids[k]));
      if (with_tiles_) tiles_[k].resize(slab_count());
      return {};
    });
  }

  Status apply(const Rows::PageKey& key) {
    const auto& entry = layers_[static_cast<std::size_t>(key.layer)];
    auto& tiles = tiles_[static_cast<std::size_t>(key.layer)];
    if (!entry || tiles.size() != slab_count())
      return rows_.page_damage(key.layer, key.page, key.stroke, "does not fit the cage");
    return rows_.apply_row(key, cage_.grid(key.layer), *entry, tiles);
  }

  Status check_whole() const {
    return for_each_layer(layers_, [&](Layer layer, const LayerEntry&) -> Status {
      const auto& tiles = tiles_[static_cast<std::size_t>(layer)];
      for (SlabId s = 0; s < slab_count(); ++s)
        if (s >= tiles.size() || !tiles[s])
          return rows_.damaged("a tile of " + std::string(name(layer)) + " is missing");
      return {};
    });
  }

  void share_with(const Snapshot* near) {
    if (near == nullptr) return;
    for (std::size_t k = 0; k < tiles_.size(); ++k) {
      const auto layer = static_cast<Layer>(k);
      if (!near->has(layer)) continue;
      const SlabId both = std::min(static_cast<SlabId>(tiles_[k].size()), near->slab_mesh().slab_count());
      for (SlabId s = 0; s < both; ++s)
        if (tiles_[k][s]->same_values(near->tile(layer, s))) tiles_[k][s] = near->shared_tile(layer, s);
    }
  }

  Status check_samples(const Snapshot& made) const {
    Steps steps(progress_, "read", present(layers_) * std::uint64_t{slab_count()}, kStrokesShare, 1);
    return for_each_layer(layers_, [&](Layer layer, const LayerEntry&) -> Status {
      for (SlabId s = 0; s < slab_count(); ++s) {
        if (!steps.next()) return rows_.cancelled();
        if (const Status sound = validate(made, layer, s); !sound) return rows_.damaged(sound.error().message);
        made.tile(layer, s).rest(4);  // with its neighbours
      }
      return {};
    });
  }

  const Rows& rows_;
  const Meta& meta_;
  const Progress& progress_;
  bool with_tiles_;
  CageState cage_;
  LayerTable layers_;
  Tiles tiles_;
  std::shared_ptr<const SlabMesh> mesh_;  ///< of the cage, where it is known
};

/// Returns the model at another stroke, from the one at hand; both have the same cage and layers. Nothing where that
/// takes more than the rows of pages.
Result<SnapshotPtr> exchange_tiles(const Rows& rows, const SnapshotPtr& from, const LayerTable& layers,
                                   std::int64_t from_stroke, std::int64_t to_stroke, const Progress& progress) {
  const auto [first, last] = std::minmax(from_stroke, to_stroke);
  RELIEF_TRY(const auto keys, rows.page_keys(first, last));
  std::set<std::pair<Layer, SlabId>> touched;
  for (const Rows::PageKey& key : keys) touched.emplace(key.layer, key.page);
  Steps pages(progress, "read", touched.size());
  SnapshotDraft draft(from);
  const CageState cage = cage_of(*from);
  const SlabId slabs = cage.slab_count();
  // Else what a page was before may have been carried there.
  RELIEF_TRY(const std::int64_t whole_cage, rows.cage().last_whole(to_stroke));
  RELIEF_TRY(const auto carried, rows.cage().changes(whole_cage, to_stroke));
  std::vector<std::pair<Layer, SlabId>> changed;
  for (const auto& [layer, page] : touched) {
    if (!pages.next()) return rows.cancelled();
    const auto& entry = layers[static_cast<std::size_t>(layer)];
    if (!entry || page >= pages_for(slabs)) continue;
    const Grid& grid = cage.grid(layer);
    RELIEF_TRY(auto tiles, rows.read_differences(*from, layer, *entry, grid, page, first, last));
    if (!tiles) {
      if (!carried.empty()) return nullptr;
      RELIEF_TRY(tiles, rows.read_page(grid, layer, *entry, page, to_stroke));
    }
    for (SlabId t = 0; t < tiles_in_page(slabs, page); ++t) {
      const SlabId s = page * kTilesPerPage + t;
      if (!(*tiles)[t] || (*tiles)[t]->same_values(from->tile(layer, s))) continue;
      draft.put(layer, s, (*tiles)[t]);
      changed.emplace_back(layer, s);
    }
  }
  SnapshotPtr moved = draft.finish();
  for (const auto& [layer, s] : changed) {
    if (progress.cancelled()) return rows.cancelled();
    if (const Status sound = validate(*moved, layer, s); !sound) return rows.damaged(sound.error().message);
  }
  return moved;
}

}  // namespace

Result<FileState> read_state(const Rows& rows, const Meta& meta, std::int64_t stroke, const Snapshot* near,
                             const Progress& progress) {
  Traveller traveller(rows, meta, progress, true);
  RELIEF_CHECK(traveller.run(stroke));
  return traveller.arrive(near);
}

Result<FileState> move_state(const Rows& rows, const Meta& meta, std::int64_t stroke, const FileState& near,
                             std::int64_t near_stroke, const Progress& progress) {
  RELIEF_TRY(const LayerTable layers, rows.read_layers(stroke, meta));
  const auto [first, last] = std::minmax(stroke, near_stroke);
  RELIEF_TRY(const auto cages, rows.cage().changes(first, last));
  if (cages.empty() && layers == near.layers) {
    RELIEF_TRY(SnapshotPtr moved, exchange_tiles(rows, near.snapshot, layers, near_stroke, stroke, progress));
    if (moved) return FileState{std::move(moved), layers};
  }
  // Of floats that were rounded when they were read, what came later cannot be told.
  if (near_stroke < stroke && !meta.float_colours && meta.format >= 3) {
    Traveller traveller(rows, meta, progress, true);
    traveller.start(near);
    if (traveller.advance(near_stroke, stroke)) return traveller.arrive(near.snapshot.get());
    if (progress.cancelled()) return rows.cancelled();
    // What lies on the way may be damaged, and yet not be needed.
  }
  return read_state(rows, meta, stroke, near.snapshot.get(), progress);
}

Result<bool> has_shape_of(const Rows& rows, const Meta& meta, std::int64_t stroke, const Snapshot& model) {
  const Progress quiet;
  Traveller traveller(rows, meta, quiet, false);
  RELIEF_CHECK(traveller.run(stroke));
  const CageState& told = traveller.cage();
  for (std::size_t k = 0; k < kLayerCount; ++k)
    if (model.has(static_cast<Layer>(k)) != traveller.layers()[k].has_value()) return false;
  return is_of(told, model.slab_mesh()) && told.grids == cage_of(model).grids;
}

}  // namespace relief::detail
