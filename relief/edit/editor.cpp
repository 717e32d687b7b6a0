#include <relief/base/assert.h>
#include <relief/edit/editor.h>
#include <relief/edit/kernels.h>
#include <relief/edit/region.h>
#include <relief/edit/seams.h>
#include <relief/edit/tile_pool.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace relief {

namespace {

using detail::Slot;
using detail::Sphere;

bool sane(const Brush& brush) noexcept {
  return std::isfinite(brush.radius) && brush.radius > 0 && static_cast<std::size_t>(brush.tool) < tools().size();
}

double unit_range(double x) noexcept { return x > 0 ? std::min(x, 1.0) : 0.0; }

/// The grid of a layer that a tool makes: the finest of the displacement, for colour twice as fine; a power of two, at
/// most 128.
int layer_intervals(const SlabMesh& mesh, Layer layer) noexcept {
  int n = 1;
  for (const Slab& slab : mesh.slabs()) n = std::max(n, slab.intervals);
  const int wanted = layer == Layer::Colour ? 2 * n : n;
  return std::min(static_cast<int>(std::bit_ceil(static_cast<unsigned>(wanted))), kMaxIntervals);
}

/// What a layer holds before a tool first writes it.
TilePtr blank_tile(Layer layer, int intervals) {
  auto tile = std::make_shared<Tile>(layer, intervals, 0.0F);
  if (layer == Layer::Colour)
    for (int c = 0; c < 3; ++c)
      std::fill_n(tile->plane16(c), tile->size(), to_u16(kClayColour[static_cast<std::size_t>(c)]));
  return tile;
}

}  // namespace

struct Editor::State {
  explicit State(SnapshotPtr first)
      : head(std::move(first)),
        region(head->slab_mesh()),
        tiles(head->slab_mesh()),
        spacings(head->slab_mesh().fibres().size(), 0.0F),
        known(head->slab_mesh().slab_count()),
        normals(head->slab_mesh().slab_count()),
        covers(head->slab_mesh().slab_count()),
        beyond(head->slab_mesh().slab_count()),
        around_of(head->slab_mesh().slab_count()) {}

  // ---- The model

  SnapshotPtr head;                    ///< as published last
  SnapshotPtr start;                   ///< as the open stroke found it; null outside strokes
  std::optional<SnapshotDraft> draft;  ///< of the open stroke
  bool unpublished = false;            ///< whether the draft has what the head has not

  [[nodiscard]] const Snapshot& now() const noexcept { return draft ? draft->now() : *head; }

  const SnapshotPtr& publish() {
    if (unpublished) {
      head = draft->finish();
      unpublished = false;
    }
    return head;
  }

  // ---- The open stroke

  Brush brush;
  const ToolInfo* tool = nullptr;
  StrokeResult so_far;
  TilePtr blank;  ///< of the layer that the stroke has to make; null where there was one

  // ---- Buffers kept from dab to dab, so that a dab allocates only what the snapshot keeps

  const detail::Kernels& kernels = detail::best_kernels();
  std::array<std::unique_ptr<detail::GridTables>, kMaxIntervals + 1> grids;
  std::map<std::pair<int, int>, detail::Resampling> resamplings;
  detail::Region region;
  detail::DabTiles tiles;
  std::shared_ptr<detail::TilePool> pool = std::make_shared<detail::TilePool>();
  std::shared_ptr<Tile> spare;  ///< a tile that a computation left unused
  std::vector<float> spacings;  ///< by fibre: of the samples around it, model units; 0 where nobody has asked
  /// What was found out about a slab's displacement, until it changes.
  struct Known {
    std::optional<double> highest;
    std::unique_ptr<Tile> fine;  ///< on the grid of the layer that the stroke writes, where that is another one
  };
  std::vector<Known> known;
  std::vector<SlabId> fine_slabs;  ///< whose `fine` is there
  static constexpr std::size_t kMaxFineBytes = std::size_t{64} << 20U;
  std::vector<std::unique_ptr<Tile>> normals;  ///< by slab: of the surface at the start of a stroke that cuts
  std::vector<SlabId> normal_slabs;
  std::vector<std::unique_ptr<Tile>> covers;  ///< by slab: the open stroke's own plane, see Action::Cover
  std::vector<SlabId> cover_slabs;
  std::vector<std::vector<std::uint8_t>> beyond;  ///< by slab: samples that the open stroke would have taken too far
  std::vector<SlabId> beyond_slabs;
  static constexpr std::size_t kMost = Tile::padded(kMaxIntervals);
  Tile zeros{kMaxIntervals, 1, 0.0F}, mask{kMaxIntervals, 1, 0.0F}, voids{kMaxIntervals, 1, 0.0F},
      guard{kMaxIntervals, 1, 0.0F}, change{kMaxIntervals, 1, 0.0F}, weight{kMaxIntervals, 1, 0.0F},
      places{kMaxIntervals, 3, 0.0F}, outwards{kMaxIntervals, 3, 0.0F};
  std::vector<std::uint8_t> over = std::vector<std::uint8_t>(kMost);

  /// What Action::Even, Swell and Plane know of a slab beside its samples.
  struct Around {
    Tile at{kMaxIntervals, 3, 0.0F};  ///< positions in the dab's frame
    std::vector<float> border;        ///< see Kernels::border(); empty where nobody needs it
    [[nodiscard]] detail::Neighbours surface() const noexcept { return {at.plane(0), at.plane(1), at.plane(2)}; }
  };
  std::vector<std::unique_ptr<Around>> arounds;  ///< of this dab, first `around_count` of them
  std::size_t around_count = 0;
  static constexpr std::size_t kKeptArounds = 64;  ///< from stroke to stroke: 6 MB, what a dab of 10,000 samples needs
  std::vector<std::uint32_t> around_of;            ///< by slab: one more than its number in `arounds`; 0 for none
  std::vector<SlabId> around_slabs;
  std::array<std::unique_ptr<detail::BorderTables>, kMaxIntervals + 1> border_tables;
  std::vector<float> border_sums, border_ways, border_changes;

  const detail::BorderTables& border_table(int n) {
    auto& table = border_tables[static_cast<std::size_t>(n)];
    if (!table) table = std::make_unique<detail::BorderTables>(n);
    return *table;
  }
  [[nodiscard]] const Around* known_around(SlabId s) const noexcept {
    const std::uint32_t number = s == kNoSlab ? 0 : around_of[s];
    return number == 0 ? nullptr : arounds[number - 1].get();
  }
  /// The same, where its border is known, too.
  [[nodiscard]] const Around* known_border(SlabId s) const noexcept {
    const Around* found = known_around(s);
    return found != nullptr && !found->border.empty() ? found : nullptr;
  }

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
    return std::as_const(buffer).plane();
  }

  /// What tools may not change of a slab on a grid of n intervals: what the mask protects (from all tools but those
  /// that write it), and holes altogether.
  const float* protection(SlabId s, int n) {
    const Snapshot& model = now();
    const bool masks = model.has(Layer::Mask) && tool->writes != Layer::Mask;
    const float* masked = masks ? on_grid(model.tile(Layer::Mask, s), n, mask) : std::as_const(zeros).plane();
    if (!model.has(Layer::Void)) return masked;
    const Tile& tile = model.tile(Layer::Void, s);
    if (!(kernels.largest(tile.plane(), tile.size()) > 0.5F)) return masked;
    const float* hole = on_grid(tile, n, voids);
    for (std::size_t k = 0; k < sample_count(n); ++k) guard.plane()[k] = hole[k] > 0.5F ? 1.0F : masked[k];
    return std::as_const(guard).plane();
  }

  double highest(SlabId s) {
    Known& entry = known[s];
    const Tile& tile = now().tile(Layer::Displacement, s);
    if (!entry.highest) entry.highest = static_cast<double>(kernels.largest(tile.plane(), tile.size()));
    return *entry.highest;
  }

  /// The slab's displacement on a grid of m intervals, kept from dab to dab: paint does not change it.
  const float* displacement_on_grid(SlabId s, int m) {
    const Tile& tile = now().tile(Layer::Displacement, s);
    if (tile.intervals() == m) return tile.plane();
    Known& entry = known[s];
    if (!entry.fine || entry.fine->intervals() != m) {
      if (fine_slabs.size() * Tile::padded(m) * sizeof(float) > kMaxFineBytes) forget_fine();
      entry.fine = std::make_unique<Tile>(m, 1, 0.0F);
      fine_slabs.push_back(s);
      on_grid(tile, m, *entry.fine);
    }
    return std::as_const(*entry.fine).plane();
  }
  void forget_fine() {
    for (const SlabId s : fine_slabs) known[s].fine.reset();
    fine_slabs.clear();
  }
  void forget_all() {
    for (Known& entry : known) entry = {};
    fine_slabs.clear();
  }

  /// Of a slab's samples, model units.
  double own_spacing(SlabId s) {
    const SlabCorners k = head->slab_mesh().corners(s);
    double edges = 0;
    for (std::size_t e = 0; e < 3; ++e)
      edges += length((k.inner[e] + k.outer[e]) - (k.inner[(e + 1) % 3] + k.outer[(e + 1) % 3])) / 2;
    return edges / 3 / head->slab_mesh().intervals(s);
  }
  /// Of the samples around a fibre: that of the coarsest slab there.
  float spacing(FibreId f) {
    float& found = spacings[f];
    if (found > 0) return found;
    for (const SlabCorner c : head->slab_mesh().fan(f))
      found = std::max(found, static_cast<float>(own_spacing(c.slab)));
    return found;
  }

  /// The most of its fibres that counts as the last of the clay, or of the room, anywhere in a slab.
  double widest_fade(SlabId s) {
    const SlabMesh& mesh = head->slab_mesh();
    const SlabCorners corners = mesh.corners(s);
    double widest = static_cast<double>(detail::kFadeShare);
    // A fibre between the corners is at least as long as the height of the three above the triangle.
    const Vec3d across = normalized(cross(corners.inner[1] - corners.inner[0], corners.inner[2] - corners.inner[0]));
    double shortest = Box3d::kFar, spaces = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      shortest = std::min(shortest, dot(corners.fibre(k), across));
      spaces = std::max(spaces, static_cast<double>(spacing(mesh.slabs()[s].fibres[k])));
    }
    if (shortest > 0) widest = std::max(widest, static_cast<double>(detail::kFadeSpacings) * spaces / shortest);
    return shortest > 0 ? std::min(widest, 1.0) : 1.0;
  }

  detail::SlabFrame frame(SlabId s, Vec3d origin, int n) {
    const SlabMesh& mesh = head->slab_mesh();
    std::array<float, 3> spaces{};
    for (std::size_t k = 0; k < 3; ++k)
      spaces[k] = spacing(mesh.slabs()[s].fibres[k]) / static_cast<float>(brush.radius);
    return {mesh.corners(s), origin, brush.radius, grid(n), spaces};
  }

  /// Unit normals of the slab's samples at the stroke's start. At its border those of its own triangles alone: this
  /// is for blends, which the seams make one.
  const Tile& start_normals(SlabId s) {
    auto& found = normals[s];
    if (found) return *found;
    const Tile& tile = start_tile(s);
    const int n = tile.intervals();
    found = std::make_unique<Tile>(n, 3, 0.0F);
    normal_slabs.push_back(s);
    const SlabCorners corners = head->slab_mesh().corners(s);
    const detail::SlabFrame f(corners, corners.inner[0], length(corners.fibre(0)), grid(n), {});
    kernels.positions(f, tile.plane(), places.plane(0), places.plane(1), places.plane(2), tile.size());
    const detail::Neighbours surface = {places.plane(0), places.plane(1), places.plane(2)};
    kernels.normals(n, surface, outwards.plane(0), outwards.plane(1), outwards.plane(2));
    for (int c = 0; c < 3; ++c) std::copy_n(std::as_const(outwards).plane(c), tile.size(), found->plane(c));
    const detail::BorderTables& table = border_table(n);
    const std::size_t count = table.own.size();
    border_sums.resize(6 * count);
    kernels.border(table, surface, border_sums.data());
    for (std::size_t k = 0; k < count; ++k) {
      const Vec3f normal = normalized(Vec3f{border_sums[k], border_sums[count + k], border_sums[2 * count + k]});
      for (int c = 0; c < 3; ++c) found->plane(c)[table.own[k]] = normal[static_cast<std::size_t>(c)];
    }
    return *found;
  }

  Tile* cover_of(SlabId s, int n) {
    auto& cover = covers[s];
    if (!cover) {
      cover = std::make_unique<Tile>(n, 1, 0.0F);
      cover_slabs.push_back(s);
    }
    return cover.get();
  }

  /// Counts the samples that `over` names, and keeps them in mind.
  void tell_beyond(SlabId s, std::size_t count, std::size_t limited, DabResult& result) {
    if (limited == 0) return;
    result.limited += limited;
    auto& flags = beyond[s];
    if (flags.empty()) {
      flags.resize(count);
      beyond_slabs.push_back(s);
    }
    for (std::size_t k = 0; k < count; ++k) flags[k] |= over[k];
  }
  /// from + `change` * share, within the fibre.
  void settle(SlabId s, const Tile& from, float share, Tile& to, DabResult& result) {
    const std::size_t limited =
        kernels.settle(from.plane(), std::as_const(change).plane(), share, to.plane(), over.data(), from.size());
    tell_beyond(s, from.size(), limited, result);
  }
  [[nodiscard]] Falloff falloff() const noexcept {
    return brush.falloff == Falloff::Own ? tool->falloff : brush.falloff;
  }

  /// Lets go of what only an open stroke needs.
  void rest() {
    start.reset();
    draft.reset();
    spare.reset();
    blank.reset();
    forget_fine();
    for (const SlabId s : normal_slabs) normals[s].reset();
    normal_slabs.clear();
    for (const SlabId s : cover_slabs) covers[s].reset();
    cover_slabs.clear();
    for (const SlabId s : beyond_slabs) beyond[s] = {};
    beyond_slabs.clear();
    for (const SlabId s : around_slabs) around_of[s] = 0;
    around_slabs.clear();
    around_count = 0;
    if (arounds.size() > kKeptArounds) arounds.resize(kKeptArounds);
    pool->clear();
  }

  DabResult apply(const Dab& dab);
  [[nodiscard]] double fade_out(const Dab& dab, const Sphere& ball, detail::Cutter cutter,
                                std::span<const SlabId> reached, DabResult& result);
  std::size_t cut(SlabId s, const Vec3d& origin, const detail::Cutter& cutter, Tile& result);
  void move_samples(const Dab& dab, Vec3d up, std::span<const SlabId> reached, float amount, DabResult& result);
  void cover_samples(const Dab& dab, std::span<const SlabId> reached, float amount, DabResult& result);
  void find_around(std::span<const SlabId> reached, Vec3d origin, bool borders);
  Around& around(SlabId s, Vec3d origin);
  void change_at_borders(SlabId s, const detail::SlabFrame& frame_of, float* to);
  /// How many samples of two tiles of one shape differ in any channel.
  [[nodiscard]] std::size_t changes_between(const Tile& a, const Tile& b) const {
    if (a.type() == SampleType::U16) return kernels.count_changes16(a.plane16(0), b.plane16(0), a.stride(), a.size());
    return kernels.count_changes(a.plane(), b.plane(), a.stride(), a.channel_count(), a.size());
  }
  /// Of the layer that the stroke writes, before the dab, and before the stroke.
  [[nodiscard]] const Tile& base_tile(SlabId s) const { return tile_in(now(), s); }
  [[nodiscard]] const Tile& start_tile(SlabId s) const { return tile_in(*start, s); }
  [[nodiscard]] const Tile& tile_in(const Snapshot& model, SlabId s) const {
    return model.has(tool->writes) ? model.tile(tool->writes, s) : *blank;
  }
  void add(SlabId s, const Tile& base, Tile* cover, std::size_t changes);
  Tile& result_like(const Tile& base);
};

Tile& Editor::State::result_like(const Tile& base) {
  if (!spare || !spare->same_shape(base)) spare = pool->take(base);
  return *spare;
}

/// Takes the spare tile as the result where it differs.
void Editor::State::add(SlabId s, const Tile& base, Tile* cover, std::size_t changes) {
  Slot slot{.slab = s, .base = &base, .tile = nullptr, .cover = cover, .changes = changes};
  if (changes != 0) slot.tile = std::move(spare);
  tiles.add(std::move(slot));
}

// ---- Cut

/// How far the ball must be lifted, in model units, so that it stays out of the last of the clay; counts what it would
/// have taken too far. A function of the cage, the stroke's start and the dab alone.
double Editor::State::fade_out(const Dab& dab, const Sphere& ball, detail::Cutter cutter,
                               std::span<const SlabId> reached, DabResult& result) {
  const SlabMesh& mesh = head->slab_mesh();
  const Vec3d origin = ball.centre - dab.normal * brush.radius;
  const double sweep = brush.radius * length(to_double(cutter.along));
  float most = 0;
  for (const SlabId s : reached) {
    // A ball that stays above the triangle where the last of the clay begins needs no look at samples.
    const SlabCorners corners = mesh.corners(s);
    const double fade = widest_fade(s);
    std::array<Vec3d, 3> last{};
    for (std::size_t k = 0; k < 3; ++k) last[k] = corners.inner[k] + corners.fibre(k) * fade;
    const Vec3d across = normalized(cross(last[1] - last[0], last[2] - last[0]));
    if (dot(ball.centre - last[0], across) > brush.radius + sweep) continue;
    const Tile& first = start_tile(s);
    const int n = first.intervals();
    const detail::Lift found =
        kernels.lift(frame(s, origin, n), cutter, first.plane(), protection(s, n), over.data(), first.size());
    most = std::max(most, found.lift);
    tell_beyond(s, first.size(), found.limited, result);
  }
  return static_cast<double>(most) * brush.radius;
}

std::size_t Editor::State::cut(SlabId s, const Vec3d& origin, const detail::Cutter& cutter, Tile& result) {
  const Tile& base = base_tile(s);
  const int n = base.intervals();
  const Tile& upright = start_normals(s);
  const detail::Start first = {start_tile(s).plane(), upright.plane(0), upright.plane(1), upright.plane(2)};
  kernels.cut(frame(s, origin, n), cutter, first, protection(s, n), base.plane(), result.plane(), base.size());
  return changes_between(base, result);
}

// ---- Raise, Swell, Even, Plane

Editor::State::Around& Editor::State::around(SlabId s, Vec3d origin) {
  if (around_of[s] != 0) return *arounds[around_of[s] - 1];
  if (around_count == arounds.size()) arounds.push_back(std::make_unique<Around>());
  Around& made = *arounds[around_count++];
  around_of[s] = static_cast<std::uint32_t>(around_count);
  around_slabs.push_back(s);
  made.border.clear();
  const Tile& tile = now().tile(Layer::Displacement, s);
  kernels.positions(frame(s, origin, tile.intervals()), tile.plane(), made.at.plane(0), made.at.plane(1),
                    made.at.plane(2), tile.size());
  return made;
}

/// Positions of all reached slabs, and what the triangles of these and of the slabs around them give to the samples
/// they share.
void Editor::State::find_around(std::span<const SlabId> reached, Vec3d origin, bool borders) {
  const SlabMesh& mesh = head->slab_mesh();
  for (const SlabId s : around_slabs) around_of[s] = 0;
  around_slabs.clear();
  around_count = 0;
  const auto with_border = [&](SlabId s) {
    Around& at = around(s, origin);
    if (!at.border.empty()) return;
    const detail::BorderTables& table = border_table(mesh.intervals(s));
    at.border.resize(6 * table.own.size());
    kernels.border(table, std::as_const(at).surface(), at.border.data());
  };
  for (const SlabId s : reached) {
    if (!borders) {
      around(s, origin);
      continue;
    }
    with_border(s);
    for (const FibreId f : mesh.slabs()[s].fibres)
      for (const SlabCorner c : mesh.fan(f))
        if (around_of[c.slab] == 0 && mesh.box(c.slab).distance2(origin) <= brush.radius * brush.radius)
          with_border(c.slab);
  }
}

/// What Kernels::around() gives inside the slab, at the samples of its border: from the triangles of all slabs there.
void Editor::State::change_at_borders(SlabId s, const detail::SlabFrame& f, float* to) {
  const SlabMesh& mesh = head->slab_mesh();
  const int n = mesh.intervals(s);
  const detail::BorderTables& table = border_table(n);
  const std::size_t count = table.own.size();
  border_sums = known_border(s)->border;
  border_ways.assign(count, 6);
  border_changes.resize(count);
  for (int edge = 0; edge < 3; ++edge) {
    const SlabId across = mesh.slabs()[s].neighbours[static_cast<std::size_t>(edge)];
    if (const Around* other = known_border(across)) {
      const int m = mesh.intervals(across), shared = std::min(n, m), twin_edge = mesh.mirror_edge(s, edge);
      const detail::BorderTables& twins = border_table(m);
      for (int t = 1; t < shared; ++t) {
        const std::size_t own = table.at(edge, t * (n / shared)), twin = twins.at(twin_edge, m - t * (m / shared));
        for (std::size_t c = 0; c < 6; ++c) border_sums[c * count + own] += other->border[c * twins.own.size() + twin];
        border_ways[own] = 12;
      }
    }
    // Edge k begins at corner (k + 1) % 3.
    const std::size_t own = table.at(edge, 0);
    border_ways[own] = 0;
    for (std::size_t c = 0; c < 6; ++c) border_sums[c * count + own] = 0;
    for (const SlabCorner c : mesh.fan(mesh.slabs()[s].fibres[static_cast<std::size_t>((edge + 1) % 3)])) {
      const Around* other = known_border(c.slab);
      if (other == nullptr) continue;
      const detail::BorderTables& twins = border_table(mesh.intervals(c.slab));
      const std::size_t twin = twins.at(static_cast<int>((c.corner + 2) % 3), 0);
      for (std::size_t k = 0; k < 6; ++k) border_sums[k * count + own] += other->border[k * twins.own.size() + twin];
      border_ways[own] += 2;
    }
  }
  kernels.border_change(f, table, tool->action == Action::Swell, border_sums.data(), border_ways.data(),
                        border_changes.data());
  for (std::size_t k = 0; k < count; ++k) to[table.own[k]] = border_changes[k];
}

void Editor::State::move_samples(const Dab& dab, Vec3d up, std::span<const SlabId> reached, float amount,
                                 DabResult& result) {
  const Action action = tool->action;
  const bool halo = tool->halo() > 0;
  const Vec3d origin = dab.contact;
  if (halo || action == Action::Plane) find_around(reached, origin, halo);

  const auto weigh = [&](SlabId s, const detail::SlabFrame& f) {
    const Tile& base = base_tile(s);
    kernels.weigh(f, falloff(), base.plane(), protection(s, base.intervals()), weight.plane(), base.size());
  };
  detail::TargetPlane plane{{}, to_float(up), tool->lowers, tool->raises};
  if (action == Action::Plane) {
    std::array<double, 4> sum{};
    for (const SlabId s : reached) {
      const Tile& base = base_tile(s);
      weigh(s, frame(s, origin, base.intervals()));
      const Around& at = *known_around(s);
      const auto part =
          kernels.mean(std::as_const(weight).plane(), at.at.plane(0), at.at.plane(1), at.at.plane(2), base.size());
      for (std::size_t k = 0; k < 4; ++k) sum[k] += part[k];
    }
    if (!(sum[0] > 0)) return;
    plane.point = to_float(Vec3d{sum[1], sum[2], sum[3]} / sum[0] + up * tool->value);
  }

  const auto find_change = [&](SlabId s, const detail::SlabFrame& f) {
    const Tile& base = base_tile(s);
    const int n = base.intervals();
    weigh(s, f);
    const float* w = std::as_const(weight).plane();
    if (action == Action::Raise) {
      kernels.raise(f, amount, w, change.plane(), base.size());
    } else if (action == Action::Plane) {
      kernels.flatten(f, plane, amount, base.plane(), w, change.plane(), base.size());
    } else {
      kernels.around(f, n, action == Action::Swell, known_around(s)->surface(), change.plane());
      change_at_borders(s, f, change.plane());
      if (action == Action::Swell)
        kernels.scale(amount, w, change.plane(), base.size());
      else
        kernels.approach(amount, w, change.plane(), base.size());
    }
  };
  // What grows without an end of its own fades out as a whole, so that it keeps its shape.
  float share = 1;
  const bool grows = action == Action::Raise || action == Action::Swell || (action == Action::Plane && tool->value > 0);
  if (grows)
    for (const SlabId s : reached) {
      if (highest(s) < 1 - widest_fade(s)) continue;
      const Tile& base = base_tile(s);
      const detail::SlabFrame f = frame(s, origin, base.intervals());
      find_change(s, f);
      share = std::min(share, kernels.room(f, std::as_const(weight).plane(), std::as_const(change).plane(),
                                           start_tile(s).plane(), base.plane(), base.size()));
    }
  for (const SlabId s : reached) {
    const Tile& base = base_tile(s);
    find_change(s, frame(s, origin, base.intervals()));
    Tile& to = result_like(base);
    settle(s, base, std::max(share, 0.0F), to, result);
    add(s, base, nullptr, changes_between(base, to));
  }
}

// ---- Cover

void Editor::State::cover_samples(const Dab& dab, std::span<const SlabId> reached, float amount, DabResult& result) {
  const Layer layer = tool->writes;
  const double height = brush.height != 0 && std::isfinite(brush.height) ? brush.height / brush.radius : 0.1;
  for (const SlabId s : reached) {
    const Tile& base = base_tile(s);
    const int n = base.intervals();
    const std::size_t count = base.size();
    const detail::SlabFrame f = frame(s, dab.contact, n);
    kernels.weigh(f, falloff(), displacement_on_grid(s, n), protection(s, n), weight.plane(), count);
    Tile* cover = cover_of(s, n);
    kernels.cover(amount, std::as_const(weight).plane(), std::as_const(*cover).plane(), change.plane(), count);
    std::copy_n(std::as_const(change).plane(), count, cover->plane());
    const Tile& first = start_tile(s);
    Tile& to = result_like(base);
    if (tool->by_height) {
      kernels.raise(f, static_cast<float>(height), std::as_const(*cover).plane(), change.plane(), count);
      settle(s, first, 1, to, result);
    } else {
      for (int c = 0; c < channels(layer); ++c) {
        const float* covered = std::as_const(*cover).plane();
        if (base.type() == SampleType::U16)
          kernels.mix16(covered,
                        static_cast<float>(unit_range(static_cast<double>(brush.colour[static_cast<std::size_t>(c)]))),
                        first.plane16(c), to.plane16(c), count);
        else
          kernels.mix(covered, static_cast<float>(unit_range(tool->value)), first.plane(c), to.plane(c), count);
      }
    }
    add(s, base, cover, changes_between(base, to));
  }
}

// ---- The dab

DabResult Editor::State::apply(const Dab& dab) {
  const SlabMesh& mesh = head->slab_mesh();
  const Vec3d up = normalized(dab.normal);
  const bool cuts = tool->action == Action::Cut;
  const double radius = brush.radius;
  const double strength = unit_range(brush.strength);
  const double driven = strength * (tool->by_pressure ? unit_range(dab.pressure) : 1.0);
  const auto amount = static_cast<float>(tool->rate * driven * std::clamp(dab.seconds, 0.0, 1e6));
  // The sphere's lowest point, cursor + k * normal, or the centre: the origin of the kernels' frame.
  const double band = brush.resilience > 0 && std::isfinite(brush.resilience) ? brush.resilience : 0.0;
  Dab at = dab;
  at.normal = up;
  const Vec3d lowest = dab.cursor + up * band;
  const Sphere ball = {cuts ? lowest + up * radius : dab.contact, radius};
  const Vec3d sweep = cuts && dab.swept ? dab.from - ball.centre : Vec3d{};
  const Sphere sphere = {ball.centre + sweep * 0.5, radius + length(sweep) / 2};
  const detail::Cutter cutter = {.up = to_float(up), .along = to_float(sweep / radius), .exact = brush.exact};

  const auto reached = region.grow(mesh, dab.slab, sphere, up, [&](SlabId s) {
    if (!cuts || brush.exact) return highest(s);
    // A blend takes something off samples that lie below the ball, too, but for less than this part of their fibre.
    const SlabCorners corners = mesh.corners(s);
    double widest = 0;
    for (std::size_t k = 0; k < 3; ++k)
      widest = std::max(widest, static_cast<double>(detail::kSteepestRim * spacing(mesh.slabs()[s].fibres[k])) /
                                    length(corners.fibre(k)));
    return std::min(highest(s) + widest, 1.0);
  });

  DabResult result{.slabs = reached.size()};
  tiles.begin();
  if (cuts) {
    const double lift = fade_out(at, ball, cutter, reached, result);
    const Vec3d origin = lowest + up * lift;
    for (const SlabId s : reached) {
      const Tile& base = base_tile(s);
      const std::size_t changes = cut(s, origin, cutter, result_like(base));
      add(s, base, nullptr, changes);
    }
  } else if (tool->action == Action::Cover) {
    cover_samples(at, reached, amount, result);
  } else {
    move_samples(at, up, reached, amount, result);
  }
  tiles.commit(
      mesh, tool->writes,
      {.base = [&](SlabId s) -> const Tile& { return base_tile(s); },
       .cover =
           [&](SlabId s) { return tool->action == Action::Cover ? cover_of(s, base_tile(s).intervals()) : nullptr; }},
      *pool, [&](int n) -> const detail::GridTables& { return grid(n); });

  for (const Slot& slot : tiles.slots()) result.samples += slot.changes;
  if (result.samples == 0) return result;
  if (!draft) draft.emplace(head);
  if (!now().has(tool->writes)) {
    draft->add_layer(tool->writes, blank->intervals(), 0.0F);
    for (SlabId s = 0; s < mesh.slab_count(); ++s) draft->put(tool->writes, s, blank);
  }
  for (Slot& slot : tiles.slots()) {
    if (!slot.tile) continue;
    if (tool->writes == Layer::Displacement) known[slot.slab] = {};
    draft->put(tool->writes, slot.slab, std::move(slot.tile));
  }
  unpublished = true;
  return result;
}

// ---- The editor

Editor::Editor(SnapshotPtr head) : state_(std::make_unique<State>(std::move(head))) {}
Editor::Editor(Editor&&) noexcept = default;
Editor& Editor::operator=(Editor&&) noexcept = default;
Editor::~Editor() = default;

const SnapshotPtr& Editor::head() { return state_->publish(); }
const SnapshotPtr& Editor::start() const noexcept { return state_->start; }
bool Editor::in_stroke() const noexcept { return state_->start != nullptr; }

Vec3d Editor::position(SlabId slab, double u, double v) const noexcept {
  const Snapshot& model = state_->now();
  return model.slab_mesh().corners(slab).point({1 - u - v, u, v}, displacement_at(model, slab, u, v));
}

void Editor::set_head(SnapshotPtr head) {
  RELIEF_ASSERT(!in_stroke());
  RELIEF_ASSERT(head->slab_mesh().slab_count() == state_->head->slab_mesh().slab_count());
  state_->head = std::move(head);
  state_->forget_all();
}

void Editor::begin_stroke(const Brush& brush) {
  RELIEF_ASSERT(!in_stroke());
  RELIEF_ASSERT(sane(brush));
  State& state = *state_;
  state.brush = brush;
  state.tool = &info(brush.tool);
  state.so_far = {};
  state.start = state.head;
  if (!state.start->has(state.tool->writes))
    state.blank = blank_tile(state.tool->writes, layer_intervals(state.head->slab_mesh(), state.tool->writes));
}

DabResult Editor::dab(const Dab& dab) {
  RELIEF_ASSERT(in_stroke());
  const Vec3d up = normalized(dab.normal);
  const bool good = dab.slab < state_->head->slab_mesh().slab_count() && is_finite(dab.contact) &&
                    is_finite(dab.cursor) && is_finite(up) && std::abs(dot(up, up) - 1) <= 1e-6 &&
                    std::isfinite(dab.pressure) && std::isfinite(dab.seconds) && (!dab.swept || is_finite(dab.from));
  if (!good) return {};
  const DabResult result = state_->apply(dab);
  ++state_->so_far.dabs;
  return result;
}

StrokeResult Editor::end_stroke() {
  RELIEF_ASSERT(in_stroke());
  State& state = *state_;
  state.publish();
  StrokeResult result = state.so_far;
  for_each_change(*state.start, *state.head, [&](Layer layer, SlabId s) {
    const Tile &before = state.start_tile(s), &after = state.head->tile(layer, s);
    if (&before != &after) result.samples += state.changes_between(before, after);
  });
  for (const SlabId s : state.beyond_slabs)
    result.limited += static_cast<std::size_t>(std::ranges::count(state.beyond[s], 1));
  result.changed = result.samples > 0;
  if (!result.changed && state.head != state.start) {
    state.head = state.start;
    state.forget_all();
  }
  state.rest();
  return result;
}

void Editor::cancel_stroke() {
  RELIEF_ASSERT(in_stroke());
  state_->head = state_->start;
  state_->unpublished = false;
  state_->forget_all();
  state_->rest();
}

}  // namespace relief
