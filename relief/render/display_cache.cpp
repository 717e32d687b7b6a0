#include "display_cache.h"

#include <relief/base/assert.h>
#include <relief/core/tessellate.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <tuple>

namespace relief::detail {

namespace {

/// No buffer grows beyond this, whatever the model: far below what OpenGL 4.5 promises for a storage block (128 MiB).
constexpr std::size_t kChunkBytes = std::size_t{64} << 20U;
/// Indices of holes that have changed since, after which all lists are made anew: 2 MB.
constexpr std::size_t kWasted = std::size_t{1} << 20U;
/// Length, as a share of the slabs' diagonal, at which a curvature of its inverse counts as one.
constexpr double kCavityLength = 0.003;

/// A buffer of that many elements, mapped for writing for as long as it lives.
template <typename T>
std::pair<GlBuffer, T*> mapped_buffer(std::size_t count) {
  constexpr GLbitfield kFlags = GL_MAP_WRITE_BIT | GL_MAP_PERSISTENT_BIT | GL_MAP_COHERENT_BIT;
  const std::size_t bytes = std::max<std::size_t>(count, 1) * sizeof(T);
  GlBuffer buffer = make_buffer(bytes, nullptr, kFlags);
  auto* const at = static_cast<T*>(glMapNamedBufferRange(buffer, 0, static_cast<GLsizeiptr>(bytes), kFlags));
  return {std::move(buffer), at};
}

/// Where in the ring of a slab's border samples a grid point lies.
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

Box3d DisplayCache::slab_bounds() const noexcept {
  if (!last_) return {};
  const Box3d& box = last_->slab_mesh().bounds();
  return {box.low - centre_, box.high - centre_};
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

void DisplayCache::rebuild(const Snapshot& model) {
  const SlabMesh& mesh = model.slab_mesh();
  centre_ = mesh.bounds().centre();
  const double size = diagonal(mesh.bounds());
  unit_ = size > 0 ? size : 1;
  // An umbrella's spread against its area, twice that of its triangles, is the mean curvature times a factor of the
  // lattice.
  curvature_ = static_cast<float>(1.732 * kCavityLength);
  slabs_.assign(mesh.slab_count(), {});
  chunks_.clear();
  grids_.clear();
  forget_patterns();
  closed_ = true;
  holed_ = 0;
  std::vector<std::uint32_t> places;
  std::uint32_t ring = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const int n = mesh.intervals(s);
    for (const SlabId other : mesh.slabs()[s].neighbours) closed_ = closed_ && other != kNoSlab;
    const auto [grid, missing] = grids_.try_emplace(n);
    if (missing) {
      grid->second.places_at = static_cast<std::uint32_t>(places.size());
      grid->second.border = std::make_unique<BorderTable>(n);
      const std::vector<std::uint32_t> mine = places_of(n);
      grid->second.slots.resize(mine.size());
      for (std::size_t k = 0; k < mine.size(); ++k) {
        const GridPoint p = {static_cast<int>(mine[k] & 255U), static_cast<int>(mine[k] >> 8U)};
        grid->second.slots[sample_index(n, p)] = static_cast<std::uint16_t>(k);
      }
      places.insert(places.end(), mine.begin(), mine.end());
    }
    // Room for the finest colour tile too, so that a later colour layer never moves a slab to another chunk.
    constexpr SlabId kMost = kChunkBytes / (sample_count(kMaxIntervals) * 4);
    if (chunks_.empty() || chunks_.back().count >= kMost ||
        (chunks_.back().sample_total + sample_count(n)) * sizeof(SampleWord) > kChunkBytes)
      chunks_.emplace_back().first = s;
    Chunk& chunk = chunks_.back();
    SlabState& state = slabs_[s];
    state.chunk = static_cast<std::uint32_t>(chunks_.size() - 1);
    state.number = chunk.count++;
    state.samples_at = static_cast<std::uint32_t>(chunk.sample_total);
    state.ring_at = ring;
    state.slots = &grid->second.slots;
    chunk.sample_total += sample_count(n);
    ring += static_cast<std::uint32_t>(3 * n);
    const SlabCorners c = mesh.corners(s);
    const Vec3d axis = cross(c.inner[1] - c.inner[0], c.inner[2] - c.inner[0]) +
                       cross(c.outer[1] - c.outer[0], c.outer[2] - c.outer[0]);
    state.axis = to_float(normalized(axis));
  }
  rings_.assign(ring, {});
  ring_written_.assign(ring, false);
  for (Chunk& chunk : chunks_)
    std::tie(chunk.samples, chunk.sample_words) = mapped_buffer<SampleWord>(chunk.sample_total);
  places_bytes_ = std::max<std::size_t>(places.size(), 1) * 4;
  places_ = make_buffer(places_bytes_, places.empty() ? nullptr : places.data());
  if (model.has(Layer::Void))
    for (SlabId s = 0; s < mesh.slab_count(); ++s) find_holes(model, s);
}

void DisplayCache::find_holes(const Snapshot& model, SlabId s) {
  bool holes = false;
  if (model.has(Layer::Void))
    for_each_cell(model.slab_mesh().intervals(s),
                  [&](const std::array<GridPoint, 3>& cell) { holes = holes || model.is_hole(s, cell); });
  if (holes != slabs_[s].holed) holed_ += holes ? 1U : -1U;
  slabs_[s].holed = holes;
  const auto old = holed_patterns_.find(s);
  if (old == holed_patterns_.end()) return;
  wasted_ += patterns_[old->second].count;
  holed_patterns_.erase(old);
  if (wasted_ < kWasted) return;
  forget_patterns();
}

void DisplayCache::forget_patterns() {
  pattern_numbers_.clear();
  holed_patterns_.clear();
  patterns_.clear();
  new_indices_.clear();
  index_count_ = wasted_ = 0;
}

void DisplayCache::write_records(const Snapshot& model, const Chunk& chunk) {
  const SlabMesh& mesh = model.slab_mesh();
  std::vector<Record> records;
  records.reserve(chunk.count);
  for (SlabId s = chunk.first; s < chunk.first + chunk.count; ++s) {
    const SlabCorners corners = mesh.corners(s);
    const int n = mesh.intervals(s);
    Record r{};
    for (std::size_t k = 0; k < 3; ++k) {
      r.inner[k] = to_float(corners.inner[k] - centre_);
      r.outer[k] = to_float(corners.outer[k] - centre_);
    }
    r.samples_at = slabs_[s].samples_at;
    r.grid = static_cast<std::uint32_t>(n) | (grids_.at(n).places_at << 8U);
    r.colours_at = slabs_[s].colours_at;
    r.colour_intervals = colour_ ? static_cast<std::uint32_t>(model.tile(Layer::Colour, s).intervals()) : 0;
    records.push_back(r);
  }
  glNamedBufferSubData(chunk.records, 0, static_cast<GLsizeiptr>(records.size() * sizeof(Record)), records.data());
}

void DisplayCache::place_colours(const Snapshot& model) {
  colour_ = model.has(Layer::Colour);
  for (Chunk& chunk : chunks_) {
    chunk.colour_total = 0;
    for (SlabId s = chunk.first; s < chunk.first + chunk.count; ++s) {
      slabs_[s].colours_at = static_cast<std::uint32_t>(chunk.colour_total);
      if (colour_) chunk.colour_total += model.tile(Layer::Colour, s).size();
    }
    std::tie(chunk.colours, chunk.colour_words) = mapped_buffer<std::uint32_t>(chunk.colour_total);
    chunk.records = make_buffer(chunk.count * sizeof(Record), nullptr, GL_DYNAMIC_STORAGE_BIT);
    write_records(model, chunk);
  }
}

namespace {

/// The samples of row-packed arrays on a grid of n intervals that differ.
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

/// The same for the colour layer, on the grid of the displacement.
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
    find_inner_words(positions_, n, changed.j0 - 1, changed.j1 + 1, curvature_, seconds_);
  }
  const int first = std::max(changed.j0 - 1, 0), last = std::min(changed.j1 + 1, n);
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
  const auto halvings = static_cast<float>(n & -n);
  const Grid& grid = grids_.at(n);
  const BorderTable& table = *grid.border;
  for (std::uint32_t k = 0; k < table.places.size(); ++k) {
    const BorderTable::Place& place = table.places[k];
    Umbrella umbrella = slabs_[s].holed ? umbrellas_[place.own] : border_umbrella(positions_, place);
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

/// The second word of a sample on a border, in all slabs that have it; once in an update.
void DisplayCache::write_border(const Snapshot& model, SlabId s, std::uint32_t place) {
  if (ring_written_[slabs_[s].ring_at + place]) return;
  const SlabMesh& mesh = model.slab_mesh();
  copies_.clear();
  Umbrella sum;
  mesh.for_each_copy(s, ring_point(mesh.intervals(s), place), [&](SampleCopy copy) {
    const std::uint32_t at = slabs_[copy.slab].ring_at + ring_index(mesh.intervals(copy.slab), copy.at);
    sum.normal += rings_[at].normal;
    sum.spread += rings_[at].spread;
    copies_.emplace_back(copy, at);
  });
  const std::uint32_t word = second_word(sum.normal, sum.spread, curvature_);
  for (const auto& [copy, at] : copies_) {
    const SlabState& state = slabs_[copy.slab];
    const std::uint16_t slot = (*state.slots)[sample_index(mesh.intervals(copy.slab), copy.at)];
    chunks_[state.chunk].sample_words[state.samples_at + slot][1] = word;
    touch(copy.slab, {copy.at.i, copy.at.j, copy.at.i, copy.at.j});
    ring_written_[at] = true;
    written_.push_back(at);
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
  const bool fresh = !last_ || last_->shared_slab_mesh() != model.shared_slab_mesh();
  const auto cancelled = [&] {
    if (cancel == nullptr || !cancel->load(std::memory_order_relaxed)) return false;
    last_.reset();
    return true;
  };
  changes_ = {};
  changes_.everything = fresh;
  if (cancelled()) return std::nullopt;
  if (!fresh && last_->number() == model.number()) return changes_;
  if (fresh) rebuild(model);
  windows_.assign(mesh.slab_count(), {});
  touched_.clear();
  border_.clear();
  // Where the mask or the holes appear or go, all tiles change.
  const bool all_shapes = fresh || last_->has(Layer::Mask) != model.has(Layer::Mask) ||
                          (last_->has(Layer::Void) && !model.has(Layer::Void));
  bool colours_move = fresh || last_->has(Layer::Colour) != model.has(Layer::Colour);
  std::vector<SlabId> shapes, colours;
  if (all_shapes)
    for (SlabId s = 0; s < mesh.slab_count(); ++s) shapes.push_back(s);
  if (!fresh)
    for_each_change(*last_, model, [&](Layer layer, SlabId s) {
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
  std::ranges::sort(shapes);
  shapes.erase(std::ranges::unique(shapes).begin(), shapes.end());
  changes_.everything = all_shapes || colours_move;
  if (colours_move) {
    place_colours(model);
    colours.clear();
    for (SlabId s = 0; colour_ && s < mesh.slab_count(); ++s) colours.push_back(s);
  }
  // A tile whose holes changed is measured whole.
  std::vector<SlabId> voids;
  if (!fresh && last_->has(Layer::Void) && model.has(Layer::Void))
    for (const SlabId s : shapes)
      if (last_->shared_tile(Layer::Void, s) != model.shared_tile(Layer::Void, s)) voids.push_back(s);
  const bool new_voids = !fresh && last_->has(Layer::Void) != model.has(Layer::Void);

  // First what lies inside the slabs and their shares on the borders, then the sums on the borders.
  for (const SlabId s : shapes) {
    if (cancelled()) return std::nullopt;
    const bool whole = all_shapes || new_voids || std::ranges::binary_search(voids, s);
    const Window changed = changed_samples(model, s, whole);
    if (changed.empty()) continue;
    // Normals change one sample farther than positions.
    const int n = mesh.intervals(s);
    touch(s, {std::max(changed.i0 - 1, 0), std::max(changed.j0 - 1, 0), std::min(changed.i1 + 1, n),
              std::min(changed.j1 + 1, n)});
    measure(model, s, changed, whole);
    note_border(model, s, changed, fresh);
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
    const Window changed = colours_move ? Window{0, 0, n, n} : changed_texels(model, s);
    if (changed.empty()) continue;
    touch(s, changed);
    upload_colours(model, s);
  }
  if (!changes_.everything)
    for (const SlabId s : touched_) changes_.slabs.push_back({s, windows_[s]});
  if (changes_.tiles > 0) total_up();
  last_ = model;
  return std::move(changes_);
}

Detail DisplayCache::detail(int level) {
  return detail(std::vector<std::uint8_t>(slabs_.size(), static_cast<std::uint8_t>(std::clamp(level, 0, 255))));
}

Detail DisplayCache::detail(std::vector<std::uint8_t> levels) {
  RELIEF_ASSERT(levels.size() == slabs_.size() && last_);
  const SlabMesh& mesh = last_->slab_mesh();
  for (SlabId s = 0; s < levels.size(); ++s)
    levels[s] =
        static_cast<std::uint8_t>(std::min<int>(levels[s], std::countr_zero(static_cast<unsigned>(mesh.intervals(s)))));
  // A hole is made of the finest triangles, and stitching must not move its rim.
  if (holed_ > 0)
    for (SlabId s = 0; s < levels.size(); ++s) {
      if (!slabs_[s].holed) continue;
      levels[s] = 0;
      for (const SlabId other : mesh.slabs()[s].neighbours)
        if (other != kNoSlab) levels[other] = 0;
    }
  Detail made;
  made.pattern.reserve(levels.size());
  for (SlabId s = 0; s < levels.size(); ++s) made.pattern.push_back(pattern(s, levels));
  made.levels = std::move(levels);
  if (!new_indices_.empty()) {
    const std::size_t total = index_count_ + new_indices_.size();
    if (total > index_room_ || indices_ == 0) {
      const std::size_t room = total + total / 2;
      GlBuffer larger = make_buffer(room * 2, nullptr, GL_DYNAMIC_STORAGE_BIT);
      if (index_count_ > 0) glCopyNamedBufferSubData(indices_, larger, 0, 0, static_cast<GLsizeiptr>(index_count_ * 2));
      indices_ = std::move(larger);
      index_room_ = room;
    }
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
  std::array<int, 3> edges{};
  std::uint64_t key = static_cast<std::uint64_t>(n) | (static_cast<std::uint64_t>(levels[s]) << 8U);
  for (std::size_t k = 0; k < 3; ++k) {
    const SlabId other = mesh.slabs()[s].neighbours[k];
    edges[k] = n / step;
    if (other != kNoSlab) edges[k] = std::min(edges[k], mesh.intervals(other) >> levels[other]);
    key |= static_cast<std::uint64_t>(edges[k]) << (16 + 8 * k);
  }
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

std::uint64_t DisplayCache::triangle_count(const Detail& detail) const noexcept {
  std::uint64_t total = 0;
  for (const std::uint32_t each : detail.pattern) total += patterns_[each].count / 3;
  return total;
}

std::uint64_t DisplayCache::draw(const Detail& detail, const std::function<bool(SlabId)>& wanted,
                                 const std::function<bool()>& go_on) {
  constexpr std::uint64_t kPortion = 50'000;
  if (vertex_array_ == 0) {
    vertex_array_ = make_vertex_array();
    for (GLuint k = 0; k < 8; ++k) {
      glEnableVertexArrayAttrib(vertex_array_, k);
      glVertexArrayAttribBinding(vertex_array_, k, k == 7 ? 1 : 0);
      if (k < 6)
        glVertexArrayAttribFormat(vertex_array_, k, 3, GL_FLOAT, GL_FALSE, k * static_cast<GLuint>(sizeof(Vec3f)));
      else if (k == 6)
        glVertexArrayAttribIFormat(vertex_array_, k, 4, GL_UNSIGNED_INT, offsetof(Record, samples_at));
      else
        glVertexArrayAttribIFormat(vertex_array_, k, 2, GL_UNSIGNED_INT, 0);
    }
    glVertexArrayBindingDivisor(vertex_array_, 0, 1);
  }
  // The commands of all chunks, in portions that end with a chunk or with enough triangles.
  struct Portion {
    const Chunk* chunk;
    std::size_t first, count;
  };
  std::vector<Portion> portions;
  command_list_.clear();
  std::uint64_t total = 0;
  for (const Chunk& chunk : chunks_) {
    std::uint64_t triangles = 0;
    portions.push_back({&chunk, command_list_.size(), 0});
    for (SlabId s = chunk.first; s < chunk.first + chunk.count; ++s) {
      const Pattern& p = patterns_[detail.pattern[s]];
      if (p.count == 0 || (wanted && !wanted(s))) continue;
      if (go_on && triangles >= kPortion) {
        portions.push_back({&chunk, command_list_.size(), 0});
        triangles = 0;
      }
      command_list_.push_back({p.count, 1, p.first, static_cast<std::int32_t>(slabs_[s].samples_at), slabs_[s].number});
      ++portions.back().count;
      triangles += p.count / 3;
      total += p.count / 3;
    }
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
  glBindBuffer(GL_DRAW_INDIRECT_BUFFER, commands_);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, places_);
  for (const Portion& portion : portions) {
    if (portion.count == 0) continue;
    glVertexArrayVertexBuffer(vertex_array_, 0, portion.chunk->records, 0, sizeof(Record));
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
  std::uint64_t total = places_bytes_ + index_room_ * 2 + command_room_ * sizeof(Command);
  for (const Chunk& chunk : chunks_)
    total += chunk.sample_total * sizeof(SampleWord) + chunk.colour_total * 4 + chunk.count * sizeof(Record);
  return total;
}

}  // namespace relief::detail
