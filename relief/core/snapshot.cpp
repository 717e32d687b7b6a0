#include <relief/base/assert.h>
#include <relief/base/hash.h>
#include <relief/base/paged_memory.h>
#include <relief/core/snapshot.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstring>
#include <new>

namespace relief {

namespace {
constexpr std::array<std::string_view, kLayerCount> kLayerNames = {
    "displacement", "colour", "stiffness", "static-friction", "dynamic-friction", "specularity",
    "mask",         "strata", "void",      "folded"};
constexpr std::size_t kLine = 64;

std::uint64_t next_number() noexcept {
  static std::atomic<std::uint64_t> last{0};
  return last.fetch_add(1, std::memory_order_relaxed) + 1;
}

/// Returns a layer from its tiles, slab by slab.
template <typename TileOf>
PageTable table_of(const SlabMesh& mesh, TileOf&& tile_of) {
  const auto slabs = static_cast<SlabId>(mesh.slab_count());
  PageTable table;
  SlabId s = 0;
  while (s < slabs) {
    auto node = std::make_shared<PageNode>();
    for (SlabId p = 0; p < kPagesPerNode && s < slabs; ++p) {
      auto page = std::make_shared<Page>();
      for (SlabId t = 0; t < kTilesPerPage && s < slabs; ++t, ++s) page->tiles[t] = tile_of(s);
      node->pages[p] = std::move(page);
    }
    table.push_back(std::move(node));
  }
  return table;
}

/// A tile that was in a snapshot before knows its bounds; the others were made as mutable ones, and nobody has seen
/// them. `before` is what stood in its place, if anything.
void know_bounds(const Tile& tile, const Tile* before) {
  if (tile.bounds_known()) return;
  auto& mutable_tile = const_cast<Tile&>(tile);
  if (before != nullptr && before->intervals() == tile.intervals())
    mutable_tile.find_bounds(*before);
  else
    mutable_tile.find_bounds();
  tile.rest();
}

/// Tiles of one value everywhere. Immutable until written, so one serves all slabs of the same n.
class Blanks {
 public:
  Blanks(Layer layer, float value) noexcept : layer_(layer), value_(value) {}
  [[nodiscard]] const TilePtr& of(int n) {
    TilePtr& tile = tiles_[static_cast<std::size_t>(n)];
    if (!tile) {
      auto made = std::make_shared<Tile>(layer_, n, value_);
      if (layer_ == Layer::Displacement || layer_ == Layer::Void) made->find_bounds();
      tile = std::move(made);
    }
    return tile;
  }

 private:
  Layer layer_;
  float value_;
  std::array<TilePtr, kMaxIntervals + 1> tiles_;
};

std::pmr::memory_resource& resource(const std::shared_ptr<PagedMemory>& memory) noexcept {
  return memory ? *memory : *std::pmr::new_delete_resource();
}

/// Keeps the memory until what lies in it is gone.
template <typename T>
struct Keeper {
  using value_type = T;
  std::shared_ptr<PagedMemory> memory;

  explicit Keeper(std::shared_ptr<PagedMemory> of) noexcept : memory(std::move(of)) {}
  template <typename Other>
  Keeper(const Keeper<Other>& other) noexcept : memory(other.memory) {}
  [[nodiscard]] T* allocate(std::size_t count) {
    return static_cast<T*>(resource(memory).allocate(count * sizeof(T), alignof(T)));
  }
  void deallocate(T* items, std::size_t count) noexcept {
    resource(memory).deallocate(items, count * sizeof(T), alignof(T));
  }
  template <typename Other>
  friend bool operator==(const Keeper& a, const Keeper<Other>& b) noexcept {
    return a.memory == b.memory;
  }
};
}  // namespace

std::string_view name(Layer layer) noexcept { return kLayerNames[static_cast<std::size_t>(layer)]; }

std::optional<Layer> layer_from_name(std::string_view text) noexcept {
  const auto at = std::ranges::find(kLayerNames, text);
  if (at == kLayerNames.end()) return std::nullopt;
  return static_cast<Layer>(at - kLayerNames.begin());
}

LayerRange range(Layer layer) noexcept {
  return layer == Layer::StaticFriction || layer == Layer::DynamicFriction ? LayerRange{0, 4} : LayerRange{0, 1};
}

Tile::Tile(int intervals, int channel_count, SampleType type, float value, std::shared_ptr<PagedMemory> memory)
    : intervals_(static_cast<std::int16_t>(intervals)),
      channel_count_(static_cast<std::int8_t>(channel_count)),
      type_(type),
      values_(resource(memory).allocate(bytes(), kLine)),
      memory_(std::move(memory)) {
  std::memset(values_, 0, bytes());
  for (int c = 0; c < channel_count_; ++c) {
    if (type_ == SampleType::U16)
      std::fill_n(plane16(c), size(), to_u16(value));
    else
      std::fill_n(plane(c), size(), value);
  }
}

Tile::Tile(Layer layer, int intervals, float value, std::shared_ptr<PagedMemory> memory)
    : Tile(intervals, channels(layer), sample_type(layer), value, std::move(memory)) {}

Tile::Tile(int intervals, int channel_count, float value)
    : Tile(intervals, channel_count, SampleType::F32, value, nullptr) {}

std::shared_ptr<Tile> Tile::make(Layer layer, int intervals, float value, std::shared_ptr<PagedMemory> memory) {
  const Keeper<Tile> keeper(memory);
  return std::allocate_shared<Tile>(keeper, layer, intervals, value, std::move(memory));
}

Tile::Tile(const Tile& other)
    : intervals_(other.intervals_),
      channel_count_(other.channel_count_),
      type_(other.type_),
      values_(resource(nullptr).allocate(other.bytes(), kLine)) {
  std::memcpy(values_, other.values_, bytes());
}

Tile::~Tile() {
  if (bounds_ != nullptr) std::pmr::polymorphic_allocator<>(&resource(memory_)).delete_object(bounds_);
  resource(memory_).deallocate(values_, bytes(), kLine);
  rest();
}

std::size_t Tile::bytes() const noexcept {
  return stride() * static_cast<std::size_t>(channel_count_) * relief::bytes(type_);
}

bool Tile::same_shape(const Tile& other) const noexcept {
  return intervals_ == other.intervals_ && channel_count_ == other.channel_count_ && type_ == other.type_;
}

bool Tile::same_values(const Tile& other) const noexcept {
  return same_shape(other) && std::memcmp(values_, other.values_, bytes()) == 0;
}

void Tile::copy_values(const Tile& other) noexcept {
  RELIEF_ASSERT(same_shape(other));
  std::memcpy(values_, other.values_, bytes());
  bounded_ = false;
}

SampleBounds& Tile::make_bounds() {
  if (bounds_ == nullptr) {
    std::pmr::memory_resource* const memory = &resource(memory_);
    bounds_ = std::pmr::polymorphic_allocator<>(memory).new_object<SampleBounds>(intervals_, memory);
  }
  return *bounds_;
}

void Tile::find_bounds() {
  make_bounds().update(std::as_const(*this).plane());
  bounded_ = true;
}

void Tile::find_bounds(const Tile& before) {
  RELIEF_ASSERT(before.bounds_known());
  make_bounds().update(std::as_const(*this).plane(), before.bounds(), before.plane());
  bounded_ = true;
}

void Tile::rest(std::size_t tiles) const noexcept {
  if (!memory_) return;
  if (tiles == 1)
    memory_->rest_at(values_, bytes() + kBeside);
  else
    memory_->rest(bytes() + kBeside, tiles);
}

float constrained_value(const Tile& tile, Layer layer, const EdgePlace& place, int channel) noexcept {
  const auto value = [&](GridPoint p) { return tile.value(channel, sample_index(tile.intervals(), p)); };
  if (layer == Layer::Void || layer == Layer::Folded) return value(place.nearer());
  const double before{value(place.before)}, after{value(place.after)};
  const auto between = static_cast<float>((before * (place.r - place.k) + after * place.k) / place.r);
  return tile.type() == SampleType::U16 ? from_u16(to_u16(between)) : between;
}

void constrain(const SlabMesh& mesh, Layer layer, SlabId s, Tile& tile) noexcept {
  RELIEF_ASSERT(has_own_intervals(layer) && tile.intervals() == mesh.intervals(s));
  constrain(mesh, layer, s, [&](SlabId slab) { return mesh.intervals(slab); }, tile);
}

Snapshot::Snapshot() : number_(next_number()) {
  static const auto none = std::make_shared<const PageTable>();
  tables_.fill(none);
}

SnapshotPtr Snapshot::make(std::shared_ptr<const SlabMesh> slab_mesh, float alpha) {
  Blanks blanks(Layer::Displacement, alpha);
  const SlabMesh& mesh = *slab_mesh;
  return make(std::move(slab_mesh), [&](SlabId s) { return blanks.of(mesh.intervals(s)); });
}

SnapshotPtr Snapshot::make(std::shared_ptr<const SlabMesh> slab_mesh,
                           const std::function<TilePtr(SlabId)>& displacement) {
  const std::shared_ptr<Snapshot> made(new Snapshot);
  made->tables_[static_cast<std::size_t>(Layer::Displacement)] =
      std::make_shared<const PageTable>(table_of(*slab_mesh, [&](SlabId s) {
        TilePtr tile = displacement(s);
        RELIEF_ASSERT(tile && tile->intervals() == slab_mesh->intervals(s));
        RELIEF_ASSERT(tile->channel_count() == channels(Layer::Displacement));
        RELIEF_ASSERT(tile->type() == sample_type(Layer::Displacement));
        know_bounds(*tile, nullptr);
        return tile;
      }));
  made->slab_mesh_ = std::move(slab_mesh);
  return made;
}

SnapshotPtr Snapshot::of_tiles(std::shared_ptr<const SlabMesh> slab_mesh,
                               const std::function<std::vector<TilePtr>(Layer)>& tiles_of) {
  const std::shared_ptr<Snapshot> made(new Snapshot);
  for (std::size_t k = 0; k < kLayerCount; ++k) {
    const auto layer = static_cast<Layer>(k);
    const std::vector<TilePtr> tiles = tiles_of(layer);
    if (tiles.empty()) continue;
    RELIEF_ASSERT(tiles.size() == slab_mesh->slab_count());
    if (layer == Layer::Displacement || layer == Layer::Void)
      for (const TilePtr& tile : tiles) know_bounds(*tile, nullptr);
    made->tables_[k] = std::make_shared<const PageTable>(table_of(*slab_mesh, [&](SlabId s) { return tiles[s]; }));
  }
  RELIEF_ASSERT(made->has(Layer::Displacement));
  made->slab_mesh_ = std::move(slab_mesh);
  return made;
}

SnapshotPtr Snapshot::with_cage(const Snapshot& before, std::shared_ptr<const SlabMesh> slab_mesh,
                                const std::function<std::vector<TilePtr>(Layer)>& tiles_of) {
  const std::shared_ptr<Snapshot> made(new Snapshot);
  for (std::size_t k = 0; k < kLayerCount; ++k) {
    const auto layer = static_cast<Layer>(k);
    if (!before.has(layer)) continue;
    const std::vector<TilePtr> tiles = tiles_of(layer);
    RELIEF_ASSERT(tiles.size() == slab_mesh->slab_count());
    if (layer == Layer::Displacement || layer == Layer::Void)
      for (const TilePtr& tile : tiles) know_bounds(*tile, nullptr);
    PageTable table = table_of(*slab_mesh, [&](SlabId s) { return tiles[s]; });
    const PageTable& old = before.table(layer);
    for (std::size_t n = 0; n < std::min(old.size(), table.size()); ++n) {
      auto node = std::make_shared<PageNode>(*table[n]);
      for (std::size_t p = 0; p < kPagesPerNode; ++p)
        if (node->pages[p] && old[n]->pages[p] && node->pages[p]->tiles == old[n]->pages[p]->tiles)
          node->pages[p] = old[n]->pages[p];
      table[n] = node->pages == old[n]->pages ? old[n] : PageNodePtr(std::move(node));
    }
    made->tables_[k] = std::make_shared<const PageTable>(std::move(table));
  }
  made->slab_mesh_ = std::move(slab_mesh);
  return made;
}

std::uint64_t Snapshot::content_hash() const noexcept {
  Hash64 hash;
  hash.add(slab_mesh_->content_hash());
  for (int k = 0; k < kLayerCount; ++k) {
    const auto layer = static_cast<Layer>(k);
    if (!has(layer)) continue;
    hash.add(static_cast<std::uint64_t>(k));
    for (SlabId s = 0; s < slab_mesh_->slab_count(); ++s) {
      const Tile& t = tile(layer, s);
      hash.add(static_cast<std::uint64_t>(t.intervals()));
      for (int c = 0; c < t.channel_count(); ++c) {
        if (t.type() == SampleType::U16)
          hash.add_values(std::span(t.plane16(c), t.size()));
        else
          hash.add_values(std::span(t.plane(c), t.size()));
      }
    }
  }
  return hash.value();
}

std::size_t Snapshot::bytes() const noexcept {
  std::size_t sum = 0;
  for (int k = 0; k < kLayerCount; ++k) {
    const auto layer = static_cast<Layer>(k);
    if (!has(layer)) continue;
    for (SlabId s = 0; s < slab_mesh_->slab_count(); ++s) {
      const Tile& t = tile(layer, s);
      sum += t.bytes() + (t.bounds_known() ? t.bounds().bytes() : 0);
    }
  }
  return sum;
}

SnapshotDraft::SnapshotDraft(SnapshotPtr base) : base_(std::move(base)), next_(std::make_shared<Snapshot>(*base_)) {
  next_->number_ = next_number();
}

const Tile& SnapshotDraft::tile(Layer layer, SlabId s) const noexcept { return next_->tile(layer, s); }

SnapshotDraft::OwnLayer& SnapshotDraft::layer_for_writing(Layer layer) {
  const auto k = static_cast<std::size_t>(layer);
  OwnLayer& own = own_[k];
  if (!own.table) {
    own.table = std::make_shared<PageTable>(*next_->tables_[k]);
    own.nodes.resize(own.table->size());
    next_->tables_[k] = own.table;
  }
  return own;
}

SnapshotDraft::OwnPage& SnapshotDraft::page_for_writing(Layer layer, SlabId s) {
  OwnLayer& own = layer_for_writing(layer);
  const SlabId p = s / kTilesPerPage;
  OwnPage& page = own.pages[p];
  if (!page.page) {
    PageNodePtr& in_table = (*own.table)[p / kPagesPerNode];
    std::shared_ptr<PageNode>& node = own.nodes[p / kPagesPerNode];
    if (!node) in_table = node = std::make_shared<PageNode>(*in_table);
    PagePtr& in_node = node->pages[p % kPagesPerNode];
    in_node = page.page = std::make_shared<Page>(*in_node);
  }
  return page;
}

Tile& SnapshotDraft::edit(Layer layer, SlabId s) {
  OwnPage& own = page_for_writing(layer, s);
  TilePtr& tile = own.page->tiles[s % kTilesPerPage];
  const std::uint64_t bit = std::uint64_t{1} << (s % kTilesPerPage);
  if ((own.own_tiles & bit) == 0) {
    tile = std::make_shared<Tile>(*tile);
    own.own_tiles |= bit;
    own.new_tiles |= bit;
  }
  // The tile was made here as a mutable one, and nobody else has seen it yet.
  return const_cast<Tile&>(*tile);
}

void SnapshotDraft::add_layer(Layer layer, int m, float value) {
  const bool own_intervals = has_own_intervals(layer);
  RELIEF_ASSERT(own_intervals ? m == kOwnIntervals : m >= 0 && m <= kMaxIntervals);
  RELIEF_ASSERT(layer != Layer::Displacement);
  const SlabMesh& mesh = next_->slab_mesh();
  OwnLayer& own = layer_for_writing(layer);
  Blanks blanks(layer, value);
  // Whole multiples of the displacement's fit together as that does.
  int finest = 1;
  for (const Slab& slab : mesh.slabs()) finest = std::max(finest, slab.intervals);
  const int times = static_cast<int>(std::bit_floor(static_cast<unsigned>(std::max(1, m / finest))));
  const bool follows = m == kOwnIntervals || mesh.is_cut();
  *own.table = table_of(mesh, [&](SlabId s) { return blanks.of(follows ? times * mesh.intervals(s) : m); });
  own.nodes.assign(own.table->size(), nullptr);
  own.pages.clear();
}

void SnapshotDraft::put(Layer layer, SlabId s, TilePtr tile) {
  RELIEF_ASSERT(next_->has(layer));
  RELIEF_ASSERT(tile->channel_count() == channels(layer) && tile->type() == sample_type(layer));
  RELIEF_ASSERT(tile->intervals() == next_->tile(layer, s).intervals());
  OwnPage& own = page_for_writing(layer, s);
  own.page->tiles[s % kTilesPerPage] = std::move(tile);
  const std::uint64_t bit = std::uint64_t{1} << (s % kTilesPerPage);
  own.own_tiles &= ~bit;
  own.new_tiles |= bit;
}

SnapshotPtr SnapshotDraft::finish() {
  for (const Layer layer : {Layer::Displacement, Layer::Void})
    for (const auto& [p, page] : own_[static_cast<std::size_t>(layer)].pages)
      for (std::uint64_t left = page.new_tiles; left != 0; left &= left - 1) {
        const auto t = static_cast<SlabId>(std::countr_zero(left));
        know_bounds(*page.page->tiles[t], base_->has(layer) ? &base_->tile(layer, p * kTilesPerPage + t) : nullptr);
      }
  SnapshotPtr finished = next_;
  base_ = finished;
  next_ = std::make_shared<Snapshot>(*finished);
  next_->number_ = next_number();
  own_ = {};
  return finished;
}

}  // namespace relief
