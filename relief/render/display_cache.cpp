#include "display_cache.h"

#include <relief/base/assert.h>
#include <relief/core/tessellate.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>
#include <tuple>
#include <utility>

namespace relief::detail {

namespace {

/// No buffer grows beyond this, whatever the model: far below what OpenGL 4.5 promises for a storage block (128 MiB).
constexpr std::size_t kChunkBytes = std::size_t{64} << 20U;
/// So many slabs may have a place in a chunk that its colours fit into a buffer as well, each on the finest grid.
constexpr SlabId kMostInChunk = kChunkBytes / (sample_count(kMaxIntervals) * sizeof(std::uint32_t));
/// Elements that a chunk for new slabs has at least, so that a hundred small changes of the cage do not make a hundred
/// chunks: half a megabyte of samples.
constexpr std::size_t kLeastGrowth = std::size_t{1} << 16U;
/// Indices of holes that have changed since, after which all lists are made again: 2 MB.
constexpr std::size_t kWasted = std::size_t{1} << 20U;
/// Length, as a share of the slabs' diagonal, at which a curvature of its inverse counts as one.
constexpr double kCavityLength = 0.003;

/// Returns a buffer of that many elements, mapped for writing for as long as it lives.
template <typename T>
std::pair<GlBuffer, T*> mapped_buffer(std::size_t count) {
  constexpr GLbitfield kFlags = GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
  const std::size_t bytes = std::max<std::size_t>(count, 1) * sizeof(T);
  GlBuffer buffer = make_buffer(bytes, nullptr, kFlags);
  auto* const at = static_cast<T*>(glMapNamedBufferRange(buffer, 0, static_cast<GLsizeiptr>(bytes), kFlags));
  return {std::move(buffer), at};
}

/// Room in a buffer for `needed` elements, half as many again where it must be made again; the first `used` stay.
void grow(GlBuffer& buffer, std::size_t& room, std::size_t needed, std::size_t used, std::size_t size) {
  if (needed <= room && buffer != 0) return;
  const std::size_t larger_room = room == 0 ? needed : needed + needed / 2;
  GlBuffer larger = make_buffer(std::max<std::size_t>(larger_room, 1) * size, nullptr, GL_DYNAMIC_STORAGE_BIT);
  if (used > 0) glCopyNamedBufferSubData(buffer, larger, 0, 0, static_cast<GLsizeiptr>(used * size));
  buffer = std::move(larger);
  room = larger_room;
}

/// Returns the box that all slabs lie in, however they are cut.
Box3d box_of_roots(const SlabMesh& mesh) {
  Box3d box;
  for (const Fibre& f : mesh.root_fibres()) {
    box.add(f.inner);
    box.add(f.outer);
  }
  return box;
}

/// Of a colour tile; none where there is no such layer.
constexpr std::size_t texel_count(int m) noexcept { return m > 0 ? sample_count(m) : 0; }

/// Returns where in the ring of a slab's border samples a grid point lies.
std::uint32_t ring_index(int n, GridPoint p) noexcept {
  const std::array<int, 3> w = weights(n, p);
  for (int corner = 0; corner < 3; ++corner)
    if (w[static_cast<std::size_t>(corner)] == n) return static_cast<std::uint32_t>((corner + 2) % 3 * n);
  const int edge = w[0] == 0 ? 0 : w[1] == 0 ? 1 : 2;
  return static_cast<std::uint32_t>(edge * n + w[static_cast<std::size_t>((edge + 2) % 3)]);
}

constexpr GridPoint ring_point(int n, std::uint32_t place) noexcept {
  return edge_point(n, static_cast<int>(place) / n, static_cast<int>(place) % n);
}

}  // namespace

void DisplayCache::Window::add(const Window& other) noexcept {
  if (empty()) {
    *this = other;
  } else if (!other.empty()) {
    *this = {std::min(i0, other.i0), std::min(j0, other.j0), std::max(i1, other.i1), std::max(j1, other.j1)};
  }
}

/// Grid points as i + 256 j, in the order of their slots.
std::vector<std::uint32_t> DisplayCache::places_of(int n) {
  const int coarsest = 1 << std::countr_zero(static_cast<unsigned>(n));
  std::vector<std::uint32_t> places;
  for (int step = coarsest; step > 0; step /= 2)
    for (int j = 0; j <= n; j += step)
      for (int i = 0; i + j <= n; i += step) {
        const bool placed = step < coarsest && i % (2 * step) == 0 && j % (2 * step) == 0;
        if (!placed) places.push_back(static_cast<std::uint32_t>(i + 256 * j));
      }
  return places;
}

DisplayCache::Grid& DisplayCache::grid_of(int n) {
  const auto [at, missing] = grids_.try_emplace(n);
  Grid& grid = at->second;
  if (!missing) return grid;
  grid.places_at = static_cast<std::uint32_t>(grid_places_.size());
  grid.border = std::make_unique<BorderTable>(n);
  const std::vector<std::uint32_t> mine = places_of(n);
  grid.slots.resize(mine.size());
  for (std::size_t k = 0; k < mine.size(); ++k) {
    const GridPoint p = {static_cast<int>(mine[k] & 255U), static_cast<int>(mine[k] >> 8U)};
    grid.slots[sample_index(n, p)] = static_cast<std::uint16_t>(k);
  }
  grid_places_.insert(grid_places_.end(), mine.begin(), mine.end());
  return grid;
}

void DisplayCache::load_places() {
  if (places_loaded_ == grid_places_.size()) return;
  places_loaded_ = grid_places_.size();
  places_ = make_buffer(places_loaded_ * sizeof(grid_places_[0]), grid_places_.data());
}

/// Returns what depends on the slab alone, wherever its samples lie.
void DisplayCache::take_shape(const SlabMesh& mesh, SlabId s) {
  const SlabCorners c = mesh.corners(s);
  const Vec3d axis =
      cross(c.inner[1] - c.inner[0], c.inner[2] - c.inner[0]) + cross(c.outer[1] - c.outer[0], c.outer[2] - c.outer[0]);
  slabs_[s].axis = to_float(normalized(axis));
  slabs_[s].slots = &grid_of(mesh.intervals(s)).slots;
}

void DisplayCache::find_closed(const SlabMesh& mesh) {
  closed_ = std::ranges::all_of(mesh.slabs(), [](const Slab& slab) {
    return std::ranges::find(slab.neighbours, kNoSlab) == slab.neighbours.end();
  });
}

void DisplayCache::rebuild(const Snapshot& model) {
  const SlabMesh& mesh = model.slab_mesh();
  slab_box_ = box_of_roots(mesh);
  centre_ = slab_box_.centre();
  const double size = diagonal(slab_box_);
  unit_ = size > 0 ? size : 1;
  // An umbrella's spread against its area, twice that of its triangles, is the mean curvature times a factor of the
  // lattice.
  curvature_ = static_cast<float>(1.732 * kCavityLength);
  slabs_.assign(mesh.slab_count(), {});
  chunks_.clear();
  grids_.clear();
  grid_places_.clear();
  places_loaded_ = record_room_ = 0;
  forget_patterns();
  find_closed(mesh);
  holed_ = 0;
  std::uint32_t ring = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const int n = mesh.intervals(s);
    take_shape(mesh, s);
    if (chunks_.empty() || chunks_.back().slabs >= kMostInChunk ||
        (chunks_.back().sample_total + sample_count(n)) * sizeof(SampleWord) > kChunkBytes)
      chunks_.emplace_back();
    Chunk& chunk = chunks_.back();
    ++chunk.slabs;
    SlabState& state = slabs_[s];
    state.chunk = static_cast<std::uint32_t>(chunks_.size() - 1);
    state.samples_at = static_cast<std::uint32_t>(chunk.sample_total);
    state.ring_at = ring;
    state.room = n;
    chunk.sample_total += sample_count(n);
    ring += static_cast<std::uint32_t>(3 * n);
  }
  rings_.assign(ring, {});
  ring_written_.assign(ring, false);
  for (Chunk& chunk : chunks_) {
    chunk.sample_room = chunk.sample_total;
    std::tie(chunk.samples, chunk.sample_words) = mapped_buffer<SampleWord>(chunk.sample_room);
  }
  load_places();
  if (model.has(Layer::Void))
    for (SlabId s = 0; s < mesh.slab_count(); ++s) find_holes(model, s);
}

/// Returns whether what the cache holds under a number is another slab, or on another grid.
bool DisplayCache::reshaped(const Snapshot& model, SlabId s) const {
  const SlabMesh &before = last_->slab_mesh(), &now = model.slab_mesh();
  if (s >= before.slab_count() || before.intervals(s) != now.intervals(s)) return true;
  const RootPlace was = before.root_place(s), is = now.root_place(s);
  if (before.roots()[was.root].intervals != now.roots()[is.root].intervals) return true;
  if (was.root != is.root || was.level != is.level || was.corners != is.corners) return true;
  if (before.roots_number() != now.roots_number()) {
    const SlabCorners old = before.field(s).root, now_at = now.field(s).root;
    if (old.inner != now_at.inner || old.outer != now_at.outer) return true;
  }
  return colour_ && last_->intervals(Layer::Colour, s) != model.intervals(Layer::Colour, s);
}

/// Of another cage; none where all is to be made again: everything is counted from elsewhere, most slabs differ, or
/// places that are too large or lost take as much as all others.
std::optional<std::vector<SlabId>> DisplayCache::reshaped_slabs(const Snapshot& model) const {
  const SlabMesh& mesh = model.slab_mesh();
  const Box3d box = box_of_roots(mesh);
  if (model.has(Layer::Colour) != colour_ || box.low != slab_box_.low || box.high != slab_box_.high)
    return std::nullopt;
  std::size_t held = 0, needed = 0;
  for (const Chunk& chunk : chunks_) held += chunk.sample_total;
  std::vector<SlabId> slabs;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    needed += sample_count(mesh.intervals(s));
    if (reshaped(model, s)) slabs.push_back(s);
  }
  if (held > 2 * needed + kLeastGrowth || 2 * slabs.size() > mesh.slab_count()) return std::nullopt;
  return slabs;
}

/// Room for the slabs of another cage; their samples are not written yet.
void DisplayCache::follow_cage(const Snapshot& model, std::span<const SlabId> reshaped) {
  const SlabMesh& mesh = model.slab_mesh();
  while (slabs_.size() > mesh.slab_count()) {
    const auto s = static_cast<SlabId>(slabs_.size() - 1);
    if (slabs_[s].holed) --holed_;
    forget_pattern(s);
    give_up(s);
    slabs_.pop_back();
  }
  slabs_.resize(mesh.slab_count());
  find_closed(mesh);
  for (const SlabId s : reshaped) {
    take_shape(mesh, s);
    settle(model, s);
    find_holes(model, s);
    // What is left of a slab with holes has index lists of its own, stitched to the slabs that lay beside it.
    for (int edge = 0; edge < 3; ++edge) mesh.for_each_across(s, edge, [&](SlabId other) { forget_pattern(other); });
  }
  load_places();
  write_records(model, reshaped);
}

/// Returns a place for its samples, colours and border: where they lie, if they fit there.
void DisplayCache::settle(const Snapshot& model, SlabId s) {
  const int n = model.slab_mesh().intervals(s), m = colour_ ? model.intervals(Layer::Colour, s) : 0;
  SlabState& state = slabs_[s];
  if (n <= state.room && m <= state.colour_room) return;
  give_up(s);
  Chunk& chunk = chunk_with_room(sample_count(n), texel_count(m));
  ++chunk.slabs;
  state.chunk = static_cast<std::uint32_t>(&chunk - chunks_.data());
  state.samples_at = static_cast<std::uint32_t>(chunk.sample_total);
  state.colours_at = static_cast<std::uint32_t>(chunk.colour_total);
  state.ring_at = static_cast<std::uint32_t>(rings_.size());
  state.room = n;
  state.colour_room = m;
  chunk.sample_total += sample_count(n);
  chunk.colour_total += texel_count(m);
  rings_.resize(rings_.size() + static_cast<std::size_t>(3 * n));
  ring_written_.resize(rings_.size());
}

/// Its place may be given to another if it was the last to get one; else it is lost until all is made again.
void DisplayCache::give_up(SlabId s) {
  SlabState& state = slabs_[s];
  if (state.room == 0) return;
  Chunk& chunk = chunks_[state.chunk];
  const std::size_t samples = sample_count(state.room), colours = texel_count(state.colour_room),
                    ring = 3 * static_cast<std::size_t>(state.room);
  if (state.samples_at + samples == chunk.sample_total && state.colours_at + colours == chunk.colour_total &&
      state.ring_at + ring == rings_.size()) {
    --chunk.slabs;
    chunk.sample_total -= samples;
    chunk.colour_total -= colours;
    rings_.resize(state.ring_at);
    ring_written_.resize(state.ring_at);
  }
  state.room = state.colour_room = 0;
}

DisplayCache::Chunk& DisplayCache::chunk_with_room(std::size_t samples, std::size_t colours) {
  if (Chunk& last = chunks_.back(); last.sample_total + samples <= last.sample_room &&
                                    last.colour_total + colours <= last.colour_room && last.slabs < kMostInChunk)
    return last;
  std::size_t all_samples = 0, all_colours = 0;
  for (const Chunk& chunk : chunks_) {
    all_samples += chunk.sample_total;
    all_colours += chunk.colour_total;
  }
  const auto room = [](std::size_t wanted, std::size_t all) {
    return std::max(wanted, std::clamp(all / 8, kLeastGrowth, kChunkBytes / sizeof(SampleWord)));
  };
  Chunk& chunk = chunks_.emplace_back();
  chunk.sample_room = room(samples, all_samples);
  std::tie(chunk.samples, chunk.sample_words) = mapped_buffer<SampleWord>(chunk.sample_room);
  chunk.colour_room = colour_ ? room(colours, all_colours) : 0;
  std::tie(chunk.colours, chunk.colour_words) = mapped_buffer<std::uint32_t>(chunk.colour_room);
  return chunk;
}

void DisplayCache::find_holes(const Snapshot& model, SlabId s) {
  bool holes = false;
  if (model.has(Layer::Void))
    for_each_cell(model.slab_mesh().intervals(s),
                  [&](const std::array<GridPoint, 3>& cell) { holes = holes || model.is_hole(s, cell); });
  if (holes != slabs_[s].holed) holed_ += holes ? 1U : -1U;
  slabs_[s].holed = holes;
  forget_pattern(s);
}

/// Of a slab with holes, which has its own.
void DisplayCache::forget_pattern(SlabId s) {
  const auto old = holed_patterns_.find(s);
  if (old == holed_patterns_.end()) return;
  wasted_ += patterns_[old->second].count;
  holed_patterns_.erase(old);
  if (wasted_ >= kWasted) forget_patterns();
}

/// Their numbers then stand for others, so that none of what has been drawn with them can be kept.
void DisplayCache::forget_patterns() {
  changes_.everything = true;
  pattern_numbers_.clear();
  holed_patterns_.clear();
  patterns_.clear();
  new_indices_.clear();
  index_count_ = wasted_ = 0;
}

/// Of these slabs, by ascending number.
void DisplayCache::write_records(const Snapshot& model, std::span<const SlabId> slabs) {
  const SlabMesh& mesh = model.slab_mesh();
  if (record_room_ == 0) records_ = {};  // as large as it must be
  grow(records_, record_room_, mesh.slab_count(), record_room_, sizeof(Record));
  std::vector<Record> records;
  for (std::size_t k = 0; k < slabs.size(); ++k) {
    const SlabId s = slabs[k];
    const SampleField field = mesh.field(s);
    const auto& corners = field.place.corners;
    const bool turned = corners[0][0] < corners[1][0];
    Record& r = records.emplace_back();
    for (std::size_t c = 0; c < 3; ++c) {
      r.inner[c] = to_float(field.root.inner[c] - centre_);
      r.outer[c] = to_float(field.root.outer[c] - centre_);
    }
    const int n = mesh.intervals(s);
    r.samples_at = slabs_[s].samples_at;
    r.grid = static_cast<std::uint32_t>(n) | (grids_.at(n).places_at << 8U);
    r.colours_at = slabs_[s].colours_at;
    r.colour_intervals = colour_ ? static_cast<std::uint32_t>(model.intervals(Layer::Colour, s)) : 0;
    r.part = {static_cast<std::uint32_t>(corners[1][0]) | (static_cast<std::uint32_t>(field.place.level) << 24U),
              static_cast<std::uint32_t>(corners[0][1]) | (turned ? 1U << 31U : 0U), s};
    if (k + 1 < slabs.size() && slabs[k + 1] == s + 1) continue;
    glNamedBufferSubData(records_, static_cast<GLintptr>((s + 1 - records.size()) * sizeof(Record)),
                         static_cast<GLsizeiptr>(records.size() * sizeof(Record)), records.data());
    records.clear();
  }
}

/// Returns all of them again, and the records that tell of them.
void DisplayCache::place_colours(const Snapshot& model) {
  colour_ = model.has(Layer::Colour);
  for (Chunk& chunk : chunks_) chunk.colour_total = 0;
  for (SlabId s = 0; s < slabs_.size(); ++s) {
    SlabState& state = slabs_[s];
    Chunk& chunk = chunks_[state.chunk];
    state.colours_at = static_cast<std::uint32_t>(chunk.colour_total);
    state.colour_room = colour_ ? model.intervals(Layer::Colour, s) : 0;
    chunk.colour_total += texel_count(state.colour_room);
  }
  for (Chunk& chunk : chunks_) {
    chunk.colour_room = chunk.colour_total;
    std::tie(chunk.colours, chunk.colour_words) = mapped_buffer<std::uint32_t>(chunk.colour_room);
  }
  std::vector<SlabId> all(slabs_.size());
  std::iota(all.begin(), all.end(), 0U);
  write_records(model, all);
}

namespace {

/// Returns the samples of row-packed arrays on a grid of n intervals that differ.
template <typename Sample>
DisplayCache::Window differing(int n, const Sample* before, const Sample* now) {
  DisplayCache::Window window;
  for (int j = 0; j <= n; ++j) {
    const std::size_t row = sample_index(n, {0, j}), count = static_cast<std::size_t>(n - j + 1);
    if (std::memcmp(before + row, now + row, count * sizeof(Sample)) == 0) continue;
    const auto same = [&](int i) {
      return before[row + static_cast<std::size_t>(i)] == now[row + static_cast<std::size_t>(i)];
    };
    int first = 0, last = n - j;
    while (first < last && same(first)) ++first;
    while (last > first && same(last)) --last;
    window.add({first, j, last, j});
  }
  return window;
}

}  // namespace

/// Samples whose first words may differ from those in the buffer.
DisplayCache::Window DisplayCache::changed_samples(const Snapshot& model, SlabId s, bool fresh) const {
  const int n = model.slab_mesh().intervals(s);
  if (fresh || slabs_[s].holed ||
      (model.has(Layer::Mask) && last_->shared_tile(Layer::Mask, s) != model.shared_tile(Layer::Mask, s)))
    return {0, 0, n, n};
  return differing(n, last_->displacement(s), model.displacement(s));
}

/// Returns the same for the colour layer, on the grid of the displacement.
DisplayCache::Window DisplayCache::changed_texels(const Snapshot& model, SlabId s) const {
  const Tile &before = last_->tile(Layer::Colour, s), &now = model.tile(Layer::Colour, s);
  const int n = model.slab_mesh().intervals(s), m = now.intervals();
  Window texels;
  for (int c = 0; c < 3; ++c) texels.add(differing(m, before.plane16(c), now.plane16(c)));
  if (texels.empty()) return texels;
  // A texel shows up to the next ones.
  const auto from = [&](int at) { return std::max(0, (at - 1) * n / m); };
  const auto to = [&](int at) { return std::min(n, ((at + 1) * n + m - 1) / m); };
  return {from(texels.i0), from(texels.j0), to(texels.i1), to(texels.j1)};
}

void DisplayCache::find_masks(const Snapshot& model, SlabId s) {
  const Tile& tile = model.tile(Layer::Mask, s);
  const int n = model.slab_mesh().intervals(s), m = tile.intervals();
  const auto [at, missing] = resamplings_.try_emplace({m, n});
  Resampling& table = at->second;
  if (missing)
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) {
        const GridCell cell = cell_at(m, static_cast<double>(i) / n, static_cast<double>(j) / n);
        auto& from = table.from.emplace_back();
        auto& weight = table.weight.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) {
          from[k] = static_cast<std::uint16_t>(sample_index(m, cell.corners[k]));
          weight[k] = static_cast<float>(cell.weights[k]);
        }
      }
  masks_.resize(sample_count(n));
  const float* mask = tile.plane();
  for (std::size_t k = 0; k < masks_.size(); ++k) {
    float sum = 0;
    for (std::size_t c = 0; c < 3; ++c) sum += mask[table.from[k][c]] * table.weight[k][c];
    masks_[k] = static_cast<std::uint8_t>(std::clamp(sum, 0.0F, 1.0F) * 255.0F + 0.5F);
  }
}

/// Positions of all samples of the slab, relative to its first inner corner.
void DisplayCache::place(const Snapshot& model, SlabId s) {
  const SlabCorners corners = model.slab_mesh().corners(s);
  FibreFrame frame{};
  for (std::size_t k = 0; k < 3; ++k) {
    frame.inner[k] = to_float((corners.inner[k] - corners.inner[0]) * (1 / unit_));
    frame.along[k] = to_float((corners.outer[k] - corners.inner[k]) * (1 / unit_));
  }
  const int n = model.slab_mesh().intervals(s);
  positions_.resize(n);
  find_positions(frame, n, model.displacement(s), positions_);
}

Box3d DisplayCache::box_of(const Snapshot& model, SlabId s, const Window& window, int beside) {
  place(model, s);
  const int n = model.slab_mesh().intervals(s);
  Vec3f low = positions_.at(sample_index(n, {std::min(window.i0, n - window.j0), window.j0})), high = low;
  for (int j = std::max(0, window.j0 - beside); j <= std::min(n, window.j1 + beside); ++j) {
    const std::size_t row = sample_index(n, {0, j});
    for (int i = std::max(0, window.i0 - beside); i <= std::min(n - j, window.i1 + beside); ++i) {
      const Vec3f p = positions_.at(row + static_cast<std::size_t>(i));
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  }
  const Vec3d shift = model.slab_mesh().corners(s).inner[0] - centre_;
  return {to_double(low) * unit_ + shift, to_double(high) * unit_ + shift};
}

namespace {
/// How far from changed samples normals change. A new sample tells whether it is changed by ends that lie up to half of
/// a step away.
int changes_beside(const Facets& facets) { return facets.step() > 1 ? 2 * facets.step() : 1; }
}  // namespace

/// Bounds of the whole slab; words inside it, of the rows of the window and of those beside them.
void DisplayCache::measure(const Snapshot& model, SlabId s, const Window& changed, bool fresh) {
  const SlabMesh& mesh = model.slab_mesh();
  const int n = mesh.intervals(s);
  const float* alpha = model.displacement(s);
  const std::size_t count = sample_count(n);
  place(model, s);
  SlabState& state = slabs_[s];
  const auto [low_x, high_x] = range_of(positions_.x.data(), count);
  const auto [low_y, high_y] = range_of(positions_.y.data(), count);
  const auto [low_z, high_z] = range_of(positions_.z.data(), count);
  const Vec3d shift = mesh.corners(s).inner[0] - centre_;
  state.box = {to_double({low_x, low_y, low_z}) * unit_ + shift, to_double({high_x, high_y, high_z}) * unit_ + shift};
  std::tie(state.min_alpha, state.max_alpha) = std::tuple_cat(range_of(alpha, count));

  const bool masked = model.has(Layer::Mask);
  if (masked) find_masks(model, s);
  firsts_.resize(count + kSpare);
  seconds_.resize(count + kSpare);
  if (state.holed) {
    state.cosine = -1;
    measure_holed(model, s);
  } else {
    const float cosine = narrowest(positions_, n, changed.j0 - 1, changed.j1, state.axis);
    state.cosine = fresh ? cosine : std::min(state.cosine, cosine);
  }
  const Facets facets(mesh, s, alpha);
  const int beside = changes_beside(facets);
  const int first = std::max(changed.j0 - beside, 0), last = std::min(changed.j1 + beside, n);
  if (facets.step() == 1 && !state.holed) find_inner_words(positions_, n, first, last, curvature_, seconds_);
  if (facets.step() > 1 && !state.holed)
    for (int j = std::max(first, 1); j <= std::min(last, n - 2); ++j)
      for (int i = 1; i + j < n; ++i) {
        const Umbrella umbrella = facet_umbrella(positions_, n, facets, {i, j});
        seconds_[sample_index(n, {i, j})] = second_word(umbrella.normal, umbrella.spread, curvature_);
      }
  find_first_words(alpha, masked ? masks_.data() : nullptr, n, first, last, firsts_);
  SampleWord* const to = chunks_[state.chunk].sample_words + state.samples_at;
  const std::uint16_t* const slots = grids_.at(n).slots.data();
  for (int j = std::max(first, 1); j <= std::min(last, n - 2); ++j) {
    const std::size_t row = sample_index(n, {0, j});
    for (std::size_t k = row + 1; k < row + static_cast<std::size_t>(n - j); ++k)
      to[slots[k]] = {firsts_[k], seconds_[k]};
  }
}

/// Umbrellas of all samples without the holes, and the words inside the slab.
void DisplayCache::measure_holed(const Snapshot& model, SlabId s) {
  const int n = model.slab_mesh().intervals(s);
  umbrellas_.assign(sample_count(n), {});
  for_each_cell(n, [&](const std::array<GridPoint, 3>& cell) {
    if (model.is_hole(s, cell)) return;
    std::array<std::size_t, 3> at{};
    for (std::size_t k = 0; k < 3; ++k) at[k] = sample_index(n, cell[k]);
    const Vec3f a = positions_.at(at[0]), b = positions_.at(at[1]), c = positions_.at(at[2]);
    const Vec3f area = cross(b - a, c - a);
    for (const std::size_t k : at) umbrellas_[k].normal += area;
    umbrellas_[at[0]].spread += (b - a) + (c - a);
    umbrellas_[at[1]].spread += (c - b) + (a - b);
    umbrellas_[at[2]].spread += (a - c) + (b - c);
  });
  for (std::size_t k = 0; k < umbrellas_.size(); ++k)
    seconds_[k] = second_word(umbrellas_[k].normal, umbrellas_[k].spread, curvature_);
}

/// After measure(): which samples on the border must be written, here and in the slabs around.
void DisplayCache::note_border(const Snapshot& model, SlabId s, const Window& changed, bool fresh) {
  const SlabMesh& mesh = model.slab_mesh();
  const int n = mesh.intervals(s);
  const auto halvings = std::ldexp(static_cast<float>(n & -n), mesh.level(s));
  const Grid& grid = grids_.at(n);
  const BorderTable& table = *grid.border;
  const Facets facets(mesh, s, model.displacement(s));
  for (std::uint32_t k = 0; k < table.places.size(); ++k) {
    const BorderTable::Place& place = table.places[k];
    Umbrella umbrella = slabs_[s].holed      ? umbrellas_[place.own]
                        : facets.step() == 1 ? border_umbrella(positions_, place)
                                             : facet_umbrella(positions_, n, facets, ring_point(n, k));
    umbrella.normal *= halvings;
    umbrella.spread *= halvings;
    Umbrella& kept = rings_[slabs_[s].ring_at + k];
    if (fresh || !(kept == umbrella)) border_.emplace_back(s, k);
    kept = umbrella;
  }
  // The first words of this slab's border, as it alone has them.
  SampleWord* const to = chunks_[slabs_[s].chunk].sample_words + slabs_[s].samples_at;
  const int first = std::max(changed.j0 - 1, 0), last = std::min(changed.j1 + 1, n);
  for (const BorderTable::Place& place : table.places)
    if (place.own >= sample_index(n, {0, first}) && place.own <= sample_index(n, {n - last, last}))
      to[grid.slots[place.own]][0] = firsts_[place.own];
}

/// Writes the second word of a sample on a border, in all slabs that have it; once in an update. Roots that meet at an
/// edge are lit each by itself.
void DisplayCache::write_border(const Snapshot& model, SlabId s, std::uint32_t place) {
  if (ring_written_[slabs_[s].ring_at + place]) return;
  const SlabMesh& mesh = model.slab_mesh();
  copies_.clear();
  mesh.for_each_copy(s, ring_point(mesh.intervals(s), place), [&](SampleCopy copy) {
    copies_.emplace_back(copy, slabs_[copy.slab].ring_at + ring_index(mesh.intervals(copy.slab), copy.at));
  });
  const auto meet = [&](std::size_t a, std::size_t b) {
    return mesh.root_place(copies_[a].first.slab).root == mesh.root_place(copies_[b].first.slab).root ||
           meet_smoothly(rings_[copies_[a].second].normal, rings_[copies_[b].second].normal);
  };
  const auto exchange = [&](std::size_t a, std::size_t b) { std::swap(copies_[a], copies_[b]); };
  for (std::size_t first = 0, end = 0; first < copies_.size(); first = end) {
    end = gather_group(first, copies_.size(), meet, exchange);
    Umbrella sum;
    for (std::size_t k = first; k < end; ++k) {
      sum.normal += rings_[copies_[k].second].normal;
      sum.spread += rings_[copies_[k].second].spread;
    }
    const std::uint32_t word = second_word(sum.normal, sum.spread, curvature_);
    for (std::size_t k = first; k < end; ++k) {
      const auto& [copy, at] = copies_[k];
      const SlabState& state = slabs_[copy.slab];
      const std::uint16_t slot = (*state.slots)[sample_index(mesh.intervals(copy.slab), copy.at)];
      chunks_[state.chunk].sample_words[state.samples_at + slot][1] = word;
      touch(copy.slab, {copy.at.i, copy.at.j, copy.at.i, copy.at.j});
      ring_written_[at] = true;
      written_.push_back(at);
    }
  }
}

void DisplayCache::touch(SlabId s, const Window& window) {
  if (windows_[s].empty()) {
    touched_.push_back(s);
    ++changes_.tiles;
  }
  windows_[s].add(window);
}

void DisplayCache::upload_colours(const Snapshot& model, SlabId s) {
  const Tile& tile = model.tile(Layer::Colour, s);
  const std::uint16_t *red = tile.plane16(0), *green = tile.plane16(1), *blue = tile.plane16(2);
  std::uint32_t* const to = chunks_[slabs_[s].chunk].colour_words + slabs_[s].colours_at;
  const auto nearest = [](std::uint32_t v) { return (v + 128U) / 257U; };
  for (std::size_t k = 0; k < tile.size(); ++k)
    to[k] = nearest(red[k]) | (nearest(green[k]) << 8U) | (nearest(blue[k]) << 16U) | 0xff000000U;
}

void DisplayCache::total_up() {
  bounds_ = {};
  min_alpha_ = 1;
  max_alpha_ = 0;
  for (const SlabState& state : slabs_) {
    bounds_.add(state.box);
    min_alpha_ = std::min(min_alpha_, state.min_alpha);
    max_alpha_ = std::max(max_alpha_, state.max_alpha);
  }
}

std::optional<DisplayCache::Changes> DisplayCache::update(const Snapshot& model, const std::atomic<bool>* cancel) {
  const SlabMesh& mesh = model.slab_mesh();
  const bool cage = !last_ || last_->shared_slab_mesh() != model.shared_slab_mesh();
  const auto cancelled = [&] {
    if (cancel == nullptr || !cancel->load(std::memory_order_relaxed)) return false;
    last_.reset();
    return true;
  };
  changes_ = {};
  if (cancelled()) return std::nullopt;
  if (!cage && last_->number() == model.number()) return changes_;
  const auto others = last_ && cage ? reshaped_slabs(model) : std::nullopt;
  const bool fresh = cage && !others;
  const std::vector<SlabId> reshaped = others.value_or(std::vector<SlabId>());
  changes_.cage = cage;
  if (fresh)
    rebuild(model);
  else if (cage)
    follow_cage(model, reshaped);
  const auto is_reshaped = [&](SlabId s) { return std::ranges::binary_search(reshaped, s); };
  windows_.assign(mesh.slab_count(), {});
  touched_.clear();
  border_.clear();
  // Where the mask or the holes appear or go, all tiles change.
  const bool all_shapes = fresh || last_->has(Layer::Mask) != model.has(Layer::Mask) ||
                          (last_->has(Layer::Void) && !model.has(Layer::Void));
  bool colours_move = fresh || last_->has(Layer::Colour) != model.has(Layer::Colour);
  std::vector<SlabId> shapes = reshaped, colours;
  if (colour_) colours = reshaped;
  if (all_shapes) {
    shapes.resize(mesh.slab_count());
    std::iota(shapes.begin(), shapes.end(), 0U);
  }
  if (!fresh)
    for_each_change(*last_, model, [&](Layer layer, SlabId s) {
      if (is_reshaped(s)) return;
      if (layer == Layer::Void) find_holes(model, s);
      if (!all_shapes && (layer == Layer::Displacement || layer == Layer::Mask || layer == Layer::Void))
        shapes.push_back(s);
      if (layer != Layer::Colour) return;
      colours.push_back(s);
      if (last_->has(layer) && last_->tile(layer, s).intervals() != model.tile(layer, s).intervals())
        colours_move = true;
    });
  if (!fresh && all_shapes && !model.has(Layer::Void))
    for (SlabId s = 0; s < mesh.slab_count(); ++s) find_holes(model, s);
  for (std::vector<SlabId>* list : {&shapes, &colours}) {
    std::ranges::sort(*list);
    list->erase(std::ranges::unique(*list).begin(), list->end());
  }
  changes_.everything = changes_.everything || all_shapes || colours_move;
  if (colours_move) {
    place_colours(model);
    colours.resize(colour_ ? mesh.slab_count() : 0);
    std::iota(colours.begin(), colours.end(), 0U);
  }
  // A tile whose holes changed is measured whole.
  std::vector<SlabId> voids;
  if (!fresh && last_->has(Layer::Void) && model.has(Layer::Void))
    for (const SlabId s : shapes)
      if (!is_reshaped(s) && last_->shared_tile(Layer::Void, s) != model.shared_tile(Layer::Void, s))
        voids.push_back(s);
  const bool new_voids = !fresh && last_->has(Layer::Void) != model.has(Layer::Void);

  // First what lies inside the slabs and their shares on the borders, then the sums on the borders.
  for (const SlabId s : shapes) {
    if (cancelled()) return std::nullopt;
    const bool whole = all_shapes || new_voids || is_reshaped(s) || std::ranges::binary_search(voids, s);
    const Window changed = changed_samples(model, s, whole);
    if (changed.empty()) continue;
    const int n = mesh.intervals(s), beside = changes_beside({mesh, s, model.displacement(s)});
    touch(s, {std::max(changed.i0 - beside, 0), std::max(changed.j0 - beside, 0), std::min(changed.i1 + beside, n),
              std::min(changed.j1 + beside, n)});
    measure(model, s, changed, whole);
    note_border(model, s, changed, fresh || is_reshaped(s));
  }
  written_.clear();
  for (std::size_t k = 0; k < border_.size(); ++k) {
    if (k % 4096 == 0 && cancelled()) return std::nullopt;
    write_border(model, border_[k].first, border_[k].second);
  }
  for (const std::uint32_t at : written_) ring_written_[at] = false;
  for (const SlabId s : colours) {
    if (cancelled()) return std::nullopt;
    const int n = mesh.intervals(s);
    if (!windows_[s].empty()) ++changes_.tiles;
    const Window changed = colours_move || is_reshaped(s) ? Window{0, 0, n, n} : changed_texels(model, s);
    if (changed.empty()) continue;
    touch(s, changed);
    upload_colours(model, s);
  }
  if (!changes_.everything)
    for (const SlabId s : touched_) changes_.slabs.push_back({s, windows_[s], is_reshaped(s)});
  if (changes_.tiles > 0) total_up();
  last_ = model;
  return std::move(changes_);
}

DrawnLevels DisplayCache::detail(int level) {
  return detail(std::vector<std::uint8_t>(slabs_.size(), static_cast<std::uint8_t>(std::clamp(level, 0, 255))));
}

void DisplayCache::fit_levels(std::vector<std::uint8_t>& levels) const {
  const SlabMesh& mesh = last_->slab_mesh();
  for (SlabId s = 0; s < levels.size(); ++s)
    levels[s] = static_cast<std::uint8_t>(std::countr_zero(static_cast<unsigned>(level_step(mesh, s, levels[s]))));
  // A hole is made of the finest triangles, and stitching must not move its rim.
  for (SlabId s = 0; holed_ > 0 && s < levels.size(); ++s) {
    if (!slabs_[s].holed) continue;
    levels[s] = 0;
    for (int edge = 0; edge < 3; ++edge) mesh.for_each_across(s, edge, [&](SlabId other) { levels[other] = 0; });
  }
  // Along an edge with two slabs across, the one draws all the samples that its level has: the two need them, too.
  // Finer levels have all, so this ends.
  for (bool lowered = mesh.is_cut(); std::exchange(lowered, false);)
    for (SlabId s = 0; s < levels.size(); ++s)
      for (std::size_t k = 0; k < 3; ++k) {
        const Slab& slab = mesh.slabs()[s];
        if (!is_half(slab.shares[k])) continue;
        const SlabId across = slab.neighbours[k];
        while (2 * (slab.intervals >> levels[s]) < mesh.intervals(across) >> levels[across]) {
          --levels[s];
          lowered = true;
        }
      }
}

DrawnLevels DisplayCache::detail(std::vector<std::uint8_t> levels) {
  RELIEF_ASSERT(levels.size() == slabs_.size() && last_);
  fit_levels(levels);
  DrawnLevels made;
  made.pattern.reserve(levels.size());
  for (SlabId s = 0; s < levels.size(); ++s) made.pattern.push_back(pattern(s, levels));
  made.levels = std::move(levels);
  if (!new_indices_.empty()) {
    const std::size_t total = index_count_ + new_indices_.size();
    grow(indices_, index_room_, total, index_count_, sizeof(new_indices_[0]));
    glNamedBufferSubData(indices_, static_cast<GLintptr>(index_count_ * 2),
                         static_cast<GLsizeiptr>(new_indices_.size() * 2), new_indices_.data());
    index_count_ = total;
    new_indices_.clear();
  }
  return made;
}

std::uint32_t DisplayCache::pattern(SlabId s, std::span<const std::uint8_t> levels) {
  const SlabMesh& mesh = last_->slab_mesh();
  const int n = mesh.intervals(s), step = 1 << levels[s];
  const std::array<int, 3> edges =
      mesh.edge_intervals(s, [&](SlabId slab) { return mesh.intervals(slab) >> levels[slab]; });
  std::uint64_t key = static_cast<std::uint64_t>(n) | (static_cast<std::uint64_t>(levels[s]) << 8U);
  for (std::size_t k = 0; k < 3; ++k) key |= static_cast<std::uint64_t>(edges[k]) << (16 + 8 * k);
  const std::vector<std::uint16_t>& slots = grids_.at(n).slots;
  const auto add = [&](auto&& shows) {
    Pattern made{static_cast<std::uint32_t>(index_count_ + new_indices_.size()), 0};
    for_each_cell(n / step, edges, [&](std::array<GridPoint, 3> cell) {
      for (GridPoint& p : cell) p = {p.i * step, p.j * step};
      if (!shows(cell)) return;
      for (const GridPoint p : cell) new_indices_.push_back(slots[sample_index(n, p)]);
      made.count += 3;
    });
    patterns_.push_back(made);
    return static_cast<std::uint32_t>(patterns_.size() - 1);
  };
  if (slabs_[s].holed) {
    const auto known = holed_patterns_.find(s);
    if (known != holed_patterns_.end()) return known->second;
    return holed_patterns_[s] = add([&](const auto& cell) { return !last_->is_hole(s, cell); });
  }
  const auto known = pattern_numbers_.find(key);
  if (known != pattern_numbers_.end()) return known->second;
  return pattern_numbers_[key] = add([](const auto&) { return true; });
}

std::uint64_t DisplayCache::triangle_count(const DrawnLevels& detail) const noexcept {
  std::uint64_t total = 0;
  for (const std::uint32_t each : detail.pattern) total += patterns_[each].count / 3;
  return total;
}

std::uint64_t DisplayCache::draw(const DrawnLevels& detail, const std::function<bool(SlabId)>& wanted,
                                 const std::function<bool()>& go_on) {
  constexpr std::uint64_t kPortion = 50'000;
  if (vertex_array_ == 0) {
    vertex_array_ = make_vertex_array();
    for (GLuint k = 0; k < 9; ++k) {
      glEnableVertexArrayAttrib(vertex_array_, k);
      glVertexArrayAttribBinding(vertex_array_, k, k == 7 ? 1 : 0);
      if (k < 6)
        glVertexArrayAttribFormat(vertex_array_, k, 3, GL_FLOAT, GL_FALSE, k * static_cast<GLuint>(sizeof(Vec3f)));
      else if (k == 6)
        glVertexArrayAttribIFormat(vertex_array_, k, 4, GL_UNSIGNED_INT, offsetof(Record, samples_at));
      else if (k == 8)
        glVertexArrayAttribIFormat(vertex_array_, k, 3, GL_UNSIGNED_INT, offsetof(Record, part));
      else
        glVertexArrayAttribIFormat(vertex_array_, k, 2, GL_UNSIGNED_INT, 0);
    }
    glVertexArrayBindingDivisor(vertex_array_, 0, 1);
  }
  // In portions that end where the next slab is of another chunk, or with enough triangles.
  struct Portion {
    const Chunk* chunk;
    std::size_t first, count;
  };
  std::vector<Portion> portions;
  command_list_.clear();
  std::uint64_t total = 0, triangles = 0;
  for (SlabId s = 0; s < slabs_.size(); ++s) {
    const Pattern& p = patterns_[detail.pattern[s]];
    if (p.count == 0 || (wanted && !wanted(s))) continue;
    const Chunk* const chunk = &chunks_[slabs_[s].chunk];
    if (portions.empty() || portions.back().chunk != chunk || (go_on && triangles >= kPortion)) {
      portions.push_back({chunk, command_list_.size(), 0});
      triangles = 0;
    }
    command_list_.push_back({p.count, 1, p.first, static_cast<std::int32_t>(slabs_[s].samples_at), s});
    ++portions.back().count;
    triangles += p.count / 3;
    total += p.count / 3;
  }
  if (command_list_.empty()) return 0;
  if (command_list_.size() > command_room_) {
    command_room_ = std::max(command_list_.size(), slabs_.size());
    commands_ = make_buffer(command_room_ * sizeof(Command), nullptr, GL_DYNAMIC_STORAGE_BIT);
  }
  glNamedBufferSubData(commands_, 0, static_cast<GLsizeiptr>(command_list_.size() * sizeof(Command)),
                       command_list_.data());
  glBindVertexArray(vertex_array_);
  glVertexArrayElementBuffer(vertex_array_, indices_);
  glVertexArrayVertexBuffer(vertex_array_, 0, records_, 0, sizeof(Record));
  glBindBuffer(GL_DRAW_INDIRECT_BUFFER, commands_);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, places_);
  for (const Portion& portion : portions) {
    glVertexArrayVertexBuffer(vertex_array_, 1, portion.chunk->samples, 0, sizeof(SampleWord));
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 2, portion.chunk->colours);
    glMultiDrawElementsIndirect(GL_TRIANGLES, GL_UNSIGNED_SHORT,
                                reinterpret_cast<const void*>(portion.first * sizeof(Command)),
                                static_cast<GLsizei>(portion.count), sizeof(Command));
    if (go_on && !go_on()) break;
  }
  return total;
}

double DisplayCache::lowest(Vec3d up) const noexcept {
  double least = Box3d::kFar;
  for (const SlabState& state : slabs_) {
    const Box3d& b = state.box;
    least = std::min(least, up.x * (up.x > 0 ? b.low.x : b.high.x) + up.y * (up.y > 0 ? b.low.y : b.high.y) +
                                up.z * (up.z > 0 ? b.low.z : b.high.z));
  }
  return least;
}

std::uint64_t DisplayCache::gpu_bytes() const noexcept {
  std::uint64_t total = places_loaded_ * sizeof(grid_places_[0]) + index_room_ * 2 + command_room_ * sizeof(Command) +
                        record_room_ * sizeof(Record);
  for (const Chunk& chunk : chunks_) total += chunk.sample_room * sizeof(SampleWord) + chunk.colour_room * 4;
  return total;
}

}  // namespace relief::detail
