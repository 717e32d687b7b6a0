#include <relief/base/assert.h>
#include <relief/edit/editor.h>
#include <relief/edit/kernels.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <mutex>
#include <span>
#include <tuple>
#include <type_traits>
#include <utility>

namespace relief {

namespace {

struct Sphere {
  Vec3d centre;
  double radius;
};

/// A tile that a dab computes, or that gets a shared sample from one.
struct Slot {
  SlabId slab = kNoSlab;
  const Tile* base = nullptr;  ///< before the dab
  std::shared_ptr<Tile> tile;  ///< after it; null while nothing has changed
  std::size_t changes = 0;     ///< samples that differ between the two

  [[nodiscard]] const Tile& now() const noexcept { return tile ? *tile : *base; }
};

double distance2(Vec3d p, Vec3d a, Vec3d b) noexcept {
  const Vec3d ab = b - a;
  const double square = dot(ab, ab);
  const double t = square > 0 ? std::clamp(dot(p - a, ab) / square, 0.0, 1.0) : 0.0;
  const Vec3d gap = a + ab * t - p;
  return dot(gap, gap);
}

/// False only when no point of the slab up to `highest` along its fibres lies in the sphere: that part of it is within
/// the convex hull of its six corners.
bool may_meet(SlabCorners corners, double highest, const Sphere& sphere) noexcept {
  const auto middle = [&] {
    return (corners.inner[0] + corners.inner[1] + corners.inner[2] + corners.outer[0] + corners.outer[1] +
            corners.outer[2]) /
               6.0 -
           sphere.centre;
  };
  const auto apart_along = [&](Vec3d way) {
    const Vec3d axis = normalized(way);
    double nearest = Box3d::kFar;
    for (std::size_t k = 0; k < 3; ++k)
      nearest =
          std::min({nearest, dot(corners.inner[k] - sphere.centre, axis), dot(corners.outer[k] - sphere.centre, axis)});
    return nearest > sphere.radius;
  };
  const Vec3d whole = middle();
  for (std::size_t k = 0; k < 3; ++k)
    corners.outer[k] = corners.inner[k] + (corners.outer[k] - corners.inner[k]) * highest;
  return !apart_along(whole) && !apart_along(middle());
}

bool wall_may_meet(const Fibre& a, const Fibre& b, const Sphere& sphere) noexcept {
  Box3d box;
  for (const Vec3d p : {a.inner, a.outer, b.inner, b.outer}) box.add(p);
  return box.distance2(sphere.centre) <= sphere.radius * sphere.radius;
}

bool faces(const SlabCorners& corners, Vec3d normal) noexcept {
  Vec3d mean;
  for (std::size_t k = 0; k < 3; ++k) mean += normalized(corners.outer[k] - corners.inner[k]);
  return dot(mean, normal) > 0;
}

/// The samples that two slabs share along an edge, as one of them numbers them.
struct EdgeSamples {
  std::span<const std::uint16_t> numbers;  ///< of all samples there
  std::size_t stride;                      ///< from one shared sample to the next
  [[nodiscard]] std::size_t operator[](std::size_t t) const noexcept { return numbers[t * stride]; }
};

/// Whether two tiles hold the same bits along an edge of m intervals, its corners aside; `to` runs the other way.
bool same_edge(const Tile& a, EdgeSamples from, const Tile& b, EdgeSamples to, std::size_t m,
               int channel_count) noexcept {
  std::uint32_t differ = 0;
  const auto compare = [&](const auto* va, const auto* vb) {
    using Bits = std::conditional_t<std::is_same_v<decltype(va), const float*>, std::uint32_t, std::uint16_t>;
    for (std::size_t t = 1; t < m; ++t) differ |= std::bit_cast<Bits>(va[from[t]]) ^ std::bit_cast<Bits>(vb[to[m - t]]);
  };
  for (int c = 0; c < channel_count; ++c) {
    if (a.type() == SampleType::U16)
      compare(a.plane16(c), b.plane16(c));
    else
      compare(a.plane(c), b.plane(c));
  }
  return differ == 0;
}

/// How many samples of two tiles of colour differ in any channel.
std::size_t count_changes16(const Tile& a, const Tile& b) noexcept {
  std::uint32_t changes = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    std::uint32_t differ = 0;
    for (int c = 0; c < 3; ++c) differ |= static_cast<std::uint32_t>(a.plane16(c)[k] ^ b.plane16(c)[k]);
    changes += static_cast<std::uint32_t>(differ != 0);
  }
  return changes;
}

bool sane(const Brush& brush) noexcept { return std::isfinite(brush.radius) && brush.radius > 0; }

float unit_range(double x) noexcept { return x > 0 ? static_cast<float>(std::min(x, 1.0)) : 0.0F; }

/// The colour grid that the first paint makes: a power of two, at least twice as fine as the displacement, at most 128.
int colour_intervals(const SlabMesh& mesh) noexcept {
  int n = 1;
  for (const Slab& slab : mesh.slabs()) n = std::max(n, slab.intervals);
  return std::min(static_cast<int>(std::bit_ceil(static_cast<unsigned>(2 * n))), kMaxIntervals);
}

TilePtr clay_tile(int intervals) {
  auto tile = std::make_shared<Tile>(Layer::Colour, intervals, 0.0F);
  for (int c = 0; c < 3; ++c)
    std::fill_n(tile->plane16(c), tile->size(), to_u16(kClayColour[static_cast<std::size_t>(c)]));
  return tile;
}

/// Tiles that no snapshot holds any more, for the next dab: a stroke makes and drops many of few sizes, and giving
/// their memory back to the system each time costs more than the tools. A tile comes back on whatever thread lets go of
/// the last snapshot that held it, which is never the servo's.
class TilePool : public std::enable_shared_from_this<TilePool> {
 public:
  /// A tile of the same shape, with any values.
  std::shared_ptr<Tile> take(const Tile& like) {
    std::unique_ptr<Tile> tile;
    {
      const std::lock_guard lock(mutex_);
      if (auto& idle = idle_[shape(like)]; !idle.empty()) {
        tile = std::move(idle.back());
        idle.pop_back();
        idle_bytes_ -= tile->bytes();
      }
    }
    if (!tile) tile = std::make_unique<Tile>(like);
    return {tile.release(), [pool = shared_from_this()](Tile* done) { pool->give(std::unique_ptr<Tile>(done)); }};
  }
  std::shared_ptr<Tile> copy(const Tile& tile) {
    auto made = take(tile);
    made->copy_values(tile);
    return made;
  }
  /// Frees the tiles that wait.
  void clear() {
    const std::lock_guard lock(mutex_);
    idle_.clear();
    idle_bytes_ = 0;
  }

 private:
  static constexpr std::size_t kMaxIdleBytes = std::size_t{16} << 20U;

  void give(std::unique_ptr<Tile> tile) {
    const std::lock_guard lock(mutex_);
    if (idle_bytes_ + tile->bytes() > kMaxIdleBytes) return;
    idle_bytes_ += tile->bytes();
    idle_[shape(*tile)].push_back(std::move(tile));
  }
  using Shape = std::tuple<int, int, SampleType>;
  static Shape shape(const Tile& tile) noexcept { return {tile.intervals(), tile.channel_count(), tile.type()}; }

  std::mutex mutex_;
  std::map<Shape, std::vector<std::unique_ptr<Tile>>> idle_;
  std::size_t idle_bytes_ = 0;
};

}  // namespace

struct Editor::Scratch {
  struct Mark {
    std::uint32_t dab = 0;   ///< number of the dab that set it
    std::uint32_t slot = 0;  ///< of the slab in `slots`
  };

  const detail::Kernels& kernels = detail::best_kernels();
  std::array<std::unique_ptr<detail::GridTables>, kMaxIntervals + 1> grids;
  std::map<std::pair<int, int>, detail::Resampling> resamplings;

  std::uint32_t dab = 0;
  std::vector<std::uint32_t> seen_slabs;  ///< number of the dab that last looked at the slab
  std::vector<std::uint32_t> seen_fibres;
  std::vector<Mark> marks;
  /// What was found out about a slab's displacement; good as long as the slab has that tile, which it does not keep
  /// alive.
  struct Known {
    std::weak_ptr<const Tile> tile;
    double highest = 1;          ///< the largest displacement
    std::unique_ptr<Tile> fine;  ///< the displacement on the grid of the colour, once a stroke of paint asked for it
  };
  static constexpr std::size_t kMaxFineBytes = std::size_t{64} << 20U;
  std::vector<Known> known;
  std::vector<SlabId> fine_slabs;  ///< whose `fine` is there
  std::vector<SlabId> reached;
  std::vector<Slot> slots;
  std::size_t computed = 0;  ///< slots[0 .. computed) are the reached slabs, ascending

  std::shared_ptr<TilePool> pool = std::make_shared<TilePool>();
  std::shared_ptr<Tile> spare;  ///< a tile that a computation left unused
  Tile share{kMaxIntervals, 1, 0.0F};
  Tile mask{kMaxIntervals, 1, 0.0F};
  Tile voids{kMaxIntervals, 1, 0.0F};
  Tile guard{kMaxIntervals, 1, 0.0F};
  Tile colour{kMaxIntervals, 2, 0.0F};  ///< one channel before the dab, and after it

  TilePtr clay;
  std::optional<SnapshotDraft> draft;  ///< continues from dab to dab

  explicit Scratch(const SlabMesh& mesh)
      : seen_slabs(mesh.slab_count()),
        seen_fibres(mesh.fibres().size()),
        marks(mesh.slab_count()),
        known(mesh.slab_count()) {}

  const detail::GridTables& grid(int n) {
    auto& tables = grids[static_cast<std::size_t>(n)];
    if (!tables) tables = std::make_unique<detail::GridTables>(n);
    return *tables;
  }

  /// The tile's values on a grid of m intervals: the tile itself, or `buffer`.
  const float* on_grid(const Tile& tile, int m, Tile& buffer) {
    if (tile.intervals() == m) return tile.plane();
    const auto at = resamplings.try_emplace({tile.intervals(), m}, tile.intervals(), m).first;
    kernels.resample(at->second, tile.plane(), buffer.plane(), sample_count(m));
    return buffer.plane();
  }

  /// What tools may not change of a slab on a grid of n intervals: what the mask protects, and holes altogether; null
  /// for nothing.
  const float* protection(const Snapshot& model, SlabId s, int n) {
    const float* masked = model.has(Layer::Mask) ? on_grid(model.tile(Layer::Mask, s), n, mask) : nullptr;
    if (!model.has(Layer::Void)) return masked;
    const Tile& tile = model.tile(Layer::Void, s);
    if (!(kernels.largest(tile.plane(), tile.size()) > 0.5F)) return masked;
    const float* hole = on_grid(tile, n, voids);
    for (std::size_t k = 0; k < sample_count(n); ++k)
      guard.plane()[k] = hole[k] > 0.5F ? 1.0F : masked != nullptr ? masked[k] : 0.0F;
    return guard.plane();
  }

  Known& know(const Snapshot& model, SlabId s) {
    const TilePtr& tile = model.shared_tile(Layer::Displacement, s);
    Known& entry = known[s];
    if (entry.tile.owner_before(tile) || tile.owner_before(entry.tile))
      entry = {
          .tile = tile, .highest = static_cast<double>(kernels.largest(tile->plane(), tile->size())), .fine = nullptr};
    return entry;
  }

  /// The slab's displacement on a grid of m intervals, kept from dab to dab: paint does not change it.
  const float* displacement_on_grid(const Snapshot& model, SlabId s, int m) {
    const Tile& tile = model.tile(Layer::Displacement, s);
    if (tile.intervals() == m) return tile.plane();
    Known& entry = know(model, s);
    if (!entry.fine || entry.fine->intervals() != m) {
      if (fine_slabs.size() * Tile::padded(m) * sizeof(float) > kMaxFineBytes) forget_fine();
      entry.fine = std::make_unique<Tile>(m, 1, 0.0F);
      fine_slabs.push_back(s);
      on_grid(tile, m, *entry.fine);
    }
    return entry.fine->plane();
  }
  void forget_fine() {
    for (const SlabId s : fine_slabs) known[s].fine.reset();
    fine_slabs.clear();
  }

  void next_dab() {
    if (++dab != 0) return;
    // After 2^32 dabs the old numbers would look new.
    std::ranges::fill(seen_slabs, 0U);
    std::ranges::fill(seen_fibres, 0U);
    std::ranges::fill(marks, Mark{});
    dab = 1;
  }

  /// Lets go of what only an open stroke needs.
  void rest() {
    draft.reset();
    spare.reset();
    forget_fine();
    pool->clear();
  }

  /// Fills `reached` with the slabs that the tool works on, ascending.
  void grow(const Snapshot& model, SlabId seed, const Sphere& sphere, Vec3d normal);
  /// Writes every shared sample of the computed slabs to all its copies, then what constrained samples follow from
  /// them. The lowest computed slab owns the value.
  template <typename BaseTile>
  void commit(const SlabMesh& mesh, Layer layer, const BaseTile& base_tile);

 private:
  [[nodiscard]] bool is_computed(SlabId s) const noexcept { return marks[s].dab == dab && marks[s].slot < computed; }
  template <typename BaseTile>
  std::size_t slot_of(SlabId s, const BaseTile& base_tile) {
    if (marks[s].dab != dab) {
      marks[s] = {.dab = dab, .slot = static_cast<std::uint32_t>(slots.size())};
      slots.push_back({.slab = s, .base = &base_tile(s), .tile = nullptr, .changes = 0});
    }
    return marks[s].slot;
  }
  using Values = std::array<float, 3>;  ///< of a sample, by channel
  void put_sample(Slot& to, std::size_t index, const Values& values, int channel_count);
  void copy_sample(const Slot& from, std::size_t from_index, Slot& to, std::size_t to_index, int channel_count);
};

void Editor::Scratch::grow(const Snapshot& model, SlabId seed, const Sphere& sphere, Vec3d normal) {
  const SlabMesh& mesh = model.slab_mesh();
  reached.clear();
  const double square = sphere.radius * sphere.radius;
  const auto visit = [&](SlabId s) {
    if (s == kNoSlab || seen_slabs[s] == dab) return;
    seen_slabs[s] = dab;
    if (s != seed) {
      if (mesh.box(s).distance2(sphere.centre) > square) return;
      const SlabCorners corners = mesh.corners(s);
      if (!faces(corners, normal) || !may_meet(corners, know(model, s).highest, sphere)) return;
    }
    reached.push_back(s);
  };
  visit(seed);
  for (std::size_t next = 0; next < reached.size(); ++next) {
    const Slab& slab = mesh.slabs()[reached[next]];
    // The sphere may lie beyond the seed altogether, when the normal leans against the fibres: its neighbours always
    // count.
    const bool first = next == 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Fibre& fibre = mesh.fibres()[slab.fibres[k]];
      const SlabId across = slab.neighbours[k];
      if (across != kNoSlab && seen_slabs[across] != dab &&
          (first ||
           wall_may_meet(mesh.fibres()[slab.fibres[(k + 1) % 3]], mesh.fibres()[slab.fibres[(k + 2) % 3]], sphere)))
        visit(across);
      if (seen_fibres[slab.fibres[k]] == dab) continue;
      seen_fibres[slab.fibres[k]] = dab;
      if (first || distance2(sphere.centre, fibre.inner, fibre.outer) <= square)
        for (const SlabCorner corner : mesh.fan(slab.fibres[k])) visit(corner.slab);
    }
  }
  std::ranges::sort(reached);
}

void Editor::Scratch::copy_sample(const Slot& from, std::size_t from_index, Slot& to, std::size_t to_index,
                                  int channel_count) {
  Values values{};
  for (int c = 0; c < channel_count; ++c) values[static_cast<std::size_t>(c)] = from.now().value(c, from_index);
  put_sample(to, to_index, values, channel_count);
}

void Editor::Scratch::put_sample(Slot& to, std::size_t index, const Values& values, int channel_count) {
  const Tile& before = to.now();
  bool same = true;
  for (int c = 0; c < channel_count; ++c)
    same = same && std::bit_cast<std::uint32_t>(values[static_cast<std::size_t>(c)]) ==
                       std::bit_cast<std::uint32_t>(before.value(c, index));
  if (same) return;
  if (!to.tile) to.tile = pool->copy(*to.base);
  bool was_changed = false, is_changed = false;
  for (int c = 0; c < channel_count; ++c) {
    const float value = values[static_cast<std::size_t>(c)], base = to.base->value(c, index);
    was_changed = was_changed || before.value(c, index) != base;
    is_changed = is_changed || value != base;
    to.tile->set(c, index, value);
  }
  to.changes += static_cast<std::size_t>(is_changed);
  to.changes -= static_cast<std::size_t>(was_changed);
}

template <typename BaseTile>
void Editor::Scratch::commit(const SlabMesh& mesh, Layer layer, const BaseTile& base_tile) {
  const int channel_count = channels(layer);
  for (std::size_t own = 0; own < computed; ++own) {
    const SlabId s = slots[own].slab;
    const Slab& slab = mesh.slabs()[s];
    for (int k = 0; k < 3; ++k) {
      const SlabId across = slab.neighbours[static_cast<std::size_t>(k)];
      if (across == kNoSlab) continue;
      const bool twin_computed = is_computed(across);
      if (twin_computed && across < s) continue;
      if (!slots[own].tile && !(twin_computed && slots[marks[across].slot].tile)) continue;
      const std::size_t twin = slot_of(across, base_tile);
      const int n = slots[own].base->intervals(), twin_n = slots[twin].base->intervals();
      const auto m = static_cast<std::size_t>(std::min(n, twin_n));
      const EdgeSamples from = {grid(n).edges[static_cast<std::size_t>(k)], static_cast<std::size_t>(n) / m};
      const EdgeSamples to = {grid(twin_n).edges[static_cast<std::size_t>(mesh.mirror_edge(s, k))],
                              static_cast<std::size_t>(twin_n) / m};
      if (same_edge(slots[own].now(), from, slots[twin].now(), to, m, channel_count)) continue;
      for (std::size_t t = 1; t < m; ++t) copy_sample(slots[own], from[t], slots[twin], to[m - t], channel_count);
    }
  }
  for (std::size_t own = 0; own < computed; ++own)
    for (const FibreId fibre : mesh.slabs()[slots[own].slab].fibres) {
      // Slabs come in ascending order, so the first computed one at a fibre owns it; growth has marked fibres with
      // `dab`.
      const auto fan = mesh.fan(fibre);
      const auto owner = std::ranges::find_if(fan, [&](SlabCorner c) { return is_computed(c.slab); });
      if (owner->slab != slots[own].slab) continue;
      if (std::ranges::none_of(fan,
                               [&](SlabCorner c) { return is_computed(c.slab) && slots[marks[c.slab].slot].tile; }))
        continue;
      const int n = slots[own].base->intervals();
      const std::size_t from = sample_index(n, corner_point(n, owner->corner));
      for (const SlabCorner c : fan)
        if (c.slab != owner->slab) {
          const std::size_t to = slot_of(c.slab, base_tile);
          const int m = slots[to].base->intervals();
          copy_sample(slots[own], from, slots[to], sample_index(m, corner_point(m, c.corner)), channel_count);
        }
    }
  if (!has_own_intervals(layer)) return;
  for (Slot& slot : slots) {
    if (!slot.tile) continue;
    mesh.for_each_constrained(slot.slab, [&](GridPoint p, const EdgePlace& place) {
      put_sample(slot, sample_index(slot.tile->intervals(), p), {constrained_value(*slot.tile, layer, place)}, 1);
    });
    if (slot.changes == 0 && slot.tile->same_values(*slot.base)) slot.tile.reset();
  }
}

Editor::Editor(SnapshotPtr head)
    : head_(std::move(head)), history_{head_}, scratch_(std::make_shared<Scratch>(head_->slab_mesh())) {}

void Editor::begin_stroke(const Brush& brush, std::string label) {
  RELIEF_ASSERT(!in_stroke_);
  RELIEF_ASSERT(sane(brush));
  brush_ = brush;
  label_ = std::move(label);
  in_stroke_ = true;
}

DabResult Editor::dab(const Dab& dab) {
  RELIEF_ASSERT(in_stroke_);
  const Snapshot& model = *head_;
  const SlabMesh& mesh = model.slab_mesh();
  const Vec3d up = normalized(dab.normal);
  if (dab.slab >= mesh.slab_count() || !is_finite(dab.contact) || !is_finite(dab.cursor) || !is_finite(up) ||
      std::abs(dot(up, up) - 1) > 1e-6 || !std::isfinite(dab.pressure) || !std::isfinite(dab.seconds))
    return {};
  Scratch& scratch = *scratch_;
  const detail::Kernels& kernels = scratch.kernels;
  const double radius = brush_.radius;
  const bool carving = brush_.tool == Tool::Carve;
  const bool painting = brush_.tool == Tool::Paint;
  // The sphere's lowest point, cursor + k * normal, or the centre: the origin of the kernels' frame.
  const double band = brush_.resilience > 0 && std::isfinite(brush_.resilience) ? brush_.resilience : 0.0;
  const Vec3d origin = carving ? dab.cursor + up * band : dab.contact;
  const Sphere sphere = {carving ? origin + up * radius : origin, radius};
  const float strength = unit_range(brush_.strength);
  const float intensity = strength * unit_range(dab.pressure);
  const auto amount = static_cast<float>(static_cast<double>(strength) * std::clamp(dab.seconds, 0.0, 1e9));

  scratch.next_dab();
  scratch.grow(model, dab.slab, sphere, up);

  const Layer layer = painting ? Layer::Colour : Layer::Displacement;
  const bool fresh_layer = !model.has(layer);
  if (fresh_layer && !scratch.clay) scratch.clay = clay_tile(colour_intervals(mesh));
  const auto base_tile = [&](SlabId s) -> const Tile& { return fresh_layer ? *scratch.clay : model.tile(layer, s); };

  scratch.slots.clear();
  scratch.computed = scratch.reached.size();
  for (const SlabId s : scratch.reached) {
    const Tile& base = base_tile(s);
    const int n = base.intervals();
    const std::size_t count = base.size();
    const detail::SlabFrame frame(mesh.corners(s), origin, radius, scratch.grid(n));
    const float* protect = scratch.protection(model, s, n);
    if (!scratch.spare || !scratch.spare->same_shape(base)) scratch.spare = scratch.pool->take(base);
    Tile& result = *scratch.spare;
    if (painting) {
      const float* displacement = scratch.displacement_on_grid(model, s, n);
      float* share = scratch.share.plane();
      kernels.cone(frame, intensity, displacement, share, count);
      if (protect != nullptr) kernels.fade(protect, share, count);
      float *const from = scratch.colour.plane(0), *const to = scratch.colour.plane(1);
      for (int c = 0; c < 3; ++c) {
        std::transform(base.plane16(c), base.plane16(c) + count, from, from_u16);
        kernels.blend(share, unit_range(static_cast<double>(brush_.colour[static_cast<std::size_t>(c)])), from, to,
                      count);
        std::transform(to, to + count, result.plane16(c), to_u16);
      }
    } else {
      if (carving)
        kernels.carve(frame, to_float(up), base.plane(), result.plane(), count);
      else
        kernels.deposit(frame, amount, base.plane(), result.plane(), count);
      if (protect != nullptr) kernels.protect(protect, base.plane(), result.plane(), count);
    }
    const std::size_t changes = painting ? count_changes16(base, result)
                                         : kernels.count_changes(base.plane(), result.plane(), base.stride(), 1, count);
    Slot slot{.slab = s, .base = &base, .tile = nullptr, .changes = changes};
    if (changes != 0) slot.tile = std::move(scratch.spare);
    scratch.marks[s] = {.dab = scratch.dab, .slot = static_cast<std::uint32_t>(scratch.slots.size())};
    scratch.slots.push_back(std::move(slot));
  }
  scratch.commit(mesh, layer, base_tile);

  DabResult result{.slabs = scratch.computed, .samples = 0};
  for (const Slot& slot : scratch.slots) result.samples += slot.changes;
  if (result.samples == 0) return result;

  if (!scratch.draft || &scratch.draft->base() != head_.get()) scratch.draft.emplace(head_);
  if (fresh_layer) {
    scratch.draft->add_layer(layer, scratch.clay->intervals(), 0.0F);
    for (SlabId s = 0; s < mesh.slab_count(); ++s) scratch.draft->put(layer, s, scratch.clay);
  }
  for (Slot& slot : scratch.slots)
    if (slot.tile) scratch.draft->put(layer, slot.slab, std::move(slot.tile));
  head_ = scratch.draft->finish();
  return result;
}

bool Editor::end_stroke() {
  RELIEF_ASSERT(in_stroke_);
  in_stroke_ = false;
  scratch_->rest();
  if (head_ == history_[position_]) return false;
  history_.resize(position_ + 1);
  labels_.resize(position_);
  history_.push_back(head_);
  labels_.push_back(std::move(label_));
  ++position_;
  return true;
}

void Editor::cancel_stroke() {
  RELIEF_ASSERT(in_stroke_);
  in_stroke_ = false;
  scratch_->rest();
  head_ = history_[position_];
}

bool Editor::undo() {
  if (in_stroke_ || position_ == 0) return false;
  head_ = history_[--position_];
  return true;
}

bool Editor::redo() {
  if (in_stroke_ || position_ + 1 == history_.size()) return false;
  head_ = history_[++position_];
  return true;
}

std::string_view Editor::undo_label() const noexcept {
  return position_ > 0 ? labels_[position_ - 1] : std::string_view{};
}

std::string_view Editor::redo_label() const noexcept {
  return position_ < labels_.size() ? labels_[position_] : std::string_view{};
}

}  // namespace relief
