#include <relief/base/assert.h>
#include <relief/core/micro_triangles.h>
#include <relief/edit/editor.h>
#include <relief/edit/kernels.h>
#include <relief/edit/refine.h>
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

/// Returns the grid of a layer that a tool makes: the finest of the displacement, for colour twice as fine; a power of
/// two, at most 128.
int layer_intervals(const SlabMesh& mesh, Layer layer) noexcept {
  int n = 1;
  for (const Slab& slab : mesh.slabs()) n = std::max(n, slab.intervals);
  const int wanted = layer == Layer::Colour ? 2 * n : n;
  return std::min(static_cast<int>(std::bit_ceil(static_cast<unsigned>(wanted))), kMaxIntervals);
}

/// Returns the model with a layer as it is before a tool first writes it.
SnapshotPtr with_blank_layer(const SnapshotPtr& model, Layer layer) {
  SnapshotDraft draft(model);
  const SlabMesh& mesh = model->slab_mesh();
  draft.add_layer(layer, has_own_intervals(layer) ? kOwnIntervals : layer_intervals(mesh, layer), 0.0F);
  std::map<int, TilePtr> blanks;
  for (SlabId s = 0; layer == Layer::Colour && s < mesh.slab_count(); ++s) {
    const int n = draft.tile(layer, s).intervals();
    TilePtr& blank = blanks[n];
    if (!blank) {
      auto made = std::make_shared<Tile>(layer, n, 0.0F);
      for (int c = 0; c < 3; ++c)
        std::fill_n(made->plane16(c), made->size(), to_u16(kClayColour[static_cast<std::size_t>(c)]));
      blank = std::move(made);
    }
    draft.put(layer, s, blank);
  }
  return draft.finish();
}

/// Per slab; what is not there costs a pointer.
template <typename Pointer>
void reset_all(std::vector<Pointer>& of_slabs, std::vector<SlabId>& there, std::size_t slabs) {
  for (const SlabId s : there) of_slabs[s].reset();
  there.clear();
  of_slabs.resize(slabs);
}

}  // namespace

/// Beyond the tool's sphere, in radii, so that the next dabs find it done.
constexpr double kRing = 0.5;
/// What one dab, and all strokes, may add: a dab of 12 spacings per radius adds some ten thousand samples, and this is
/// what keeps a wish for far more from taking all memory.
constexpr std::size_t kMaxSamplesPerDab = std::size_t{1} << 22U, kMaxModelSamples = std::size_t{1} << 28U;
/// What detail may cost one stroke: slabs that it adds, and slabs of all cages that it makes, each of which takes some
/// microseconds. A long way with a tool far smaller than the slabs would otherwise take minutes.
constexpr std::size_t kMaxSlabsPerStroke = 4'000, kMaxRebuiltSlabs = 300'000;

/// How fast the spacing that tools go by falls beside coarser samples, per length. A blend of twice the width that
/// ended at once would be a step in the rim. At twice this value the rim's normals are uneven, too (cuts_test).
constexpr double kSpacingFalls = 0.0625;

struct Editor::State {
  explicit State(SnapshotPtr first) : head(std::move(first)), region(head->slab_mesh()), tiles(head->slab_mesh()) {
    take_cage();
  }

  // ---- The model

  SnapshotPtr head;                    ///< as published last
  SnapshotPtr began;                   ///< as the open stroke found it; null outside strokes
  SnapshotPtr layered;                 ///< the same with the layer that it writes
  SnapshotPtr start;                   ///< the same with the detail that it needs
  std::optional<SnapshotDraft> draft;  ///< of the open stroke
  bool unpublished = false;            ///< whether the draft has what the head has not

  [[nodiscard]] const Snapshot& now() const noexcept { return draft ? draft->now() : start ? *start : *head; }
  /// Of the model as it is now.
  [[nodiscard]] const SlabMesh& cage() const noexcept { return now().slab_mesh(); }
  /// Buffers by slab get the size of the cage, and forget what they know of slabs.
  void take_cage() {
    const std::size_t slabs = cage().slab_count();
    region.take(cage());
    tiles.take(cage());
    forget_all();
    known.resize(slabs);
    reset_all(normals, normal_slabs, slabs);
    reset_all(weights, weight_slabs, slabs);
    reset_all(spaces, space_slabs, slabs);
    reset_all(covers, cover_slabs, slabs);
    for (const SlabId s : beyond_slabs) beyond[s].clear();
    beyond_slabs.clear();
    beyond.resize(slabs);
    for (const SlabId s : around_slabs) around_of[s] = 0;
    around_slabs.clear();
    around_count = 0;
    around_of.resize(slabs);
  }

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
  double radius = 0;                            ///< of the tool's sphere at the open dab, model units
  double wanted = 0;                            ///< spacing that the stroke takes, model units; 0: any
  bool too_fine = false;                        ///< whether the brush wants a smaller one
  std::size_t rebuilt = 0;                      ///< slabs of the cages that the open stroke has made
  std::vector<Sphere> fine_enough;              ///< what the dabs before found so, the last ones
  static constexpr std::size_t kKeptFine = 16;  ///< two for each mirror image
  std::vector<RootPlace> parts;                 ///< by slab: of which slab of the cage of `began`; empty: the same
  LocateHint seat;                              ///< of the last contact

  // ---- Buffers kept from dab to dab, so that a dab allocates only what the snapshot keeps

  const detail::Kernels& kernels = detail::best_kernels();
  std::array<std::unique_ptr<detail::GridTables>, kMaxIntervals + 1> grids;
  std::map<std::pair<int, int>, detail::Resampling> resamplings;
  detail::Region region;
  detail::DabTiles tiles;
  std::shared_ptr<detail::TilePool> pool = std::make_shared<detail::TilePool>();
  std::shared_ptr<Tile> spare;  ///< a tile that a computation left unused
  /// Holds what was found out about a slab's displacement, until it changes.
  struct Known {
    std::optional<double> highest, highest_at_start;
    std::unique_ptr<Tile> fine;  ///< on the grid of the layer that the stroke writes, where that is another one
  };
  std::vector<Known> known;
  std::vector<SlabId> fine_slabs;  ///< whose `fine` is there
  static constexpr std::size_t kMaxFineBytes = std::size_t{64} << 20U;
  std::vector<std::unique_ptr<Tile>> normals;  ///< by slab: of the surface at the start of a stroke that cuts
  std::vector<SlabId> normal_slabs;
  std::vector<std::unique_ptr<Tile>> first_normals;  ///< the same by slab of `began`, on its grids
  std::vector<SlabId> first_normal_slabs;
  /// Holds the spacing of samples in a slab of `began`.
  struct Spacing {
    double widest = 0;            ///< model units; 0 where nobody has asked
    std::unique_ptr<Tile> plane;  ///< at each sample, in radii of the brush; null where nobody has asked
  };
  std::vector<Spacing> spacings;              ///< by slab of `began`
  std::vector<std::shared_ptr<Tile>> spaces;  ///< by slab: the planes of parts
  std::vector<SlabId> space_slabs;
  /// Of a grid of a slab that is a part of a root.
  struct PartWeights {
    int n = 0;
    detail::GridWeights in_root;
  };
  std::vector<std::unique_ptr<PartWeights>> weights;  ///< by slab
  std::vector<SlabId> weight_slabs;
  static constexpr std::size_t kMaxWeightBytes = std::size_t{64} << 20U;
  std::vector<std::unique_ptr<Tile>> covers;  ///< by slab: the open stroke's own plane, see Action::Cover
  std::vector<SlabId> cover_slabs;
  std::vector<std::vector<std::uint8_t>> beyond;  ///< by slab: samples that the open stroke would have taken too far
  std::vector<SlabId> beyond_slabs;
  static constexpr std::size_t kMost = Tile::padded(kMaxIntervals);
  Tile zeros{kMaxIntervals, 1, 0.0F}, mask{kMaxIntervals, 1, 0.0F}, voids{kMaxIntervals, 1, 0.0F},
      guard{kMaxIntervals, 1, 0.0F}, change{kMaxIntervals, 1, 0.0F}, weight{kMaxIntervals, 1, 0.0F},
      places{kMaxIntervals, 3, 0.0F}, outwards{kMaxIntervals, 3, 0.0F};
  std::vector<std::uint8_t> over = std::vector<std::uint8_t>(kMost);

  /// Holds what Action::Even, Swell and Plane know of a slab beside its samples.
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
  /// Returns the same, where its border is known, too.
  [[nodiscard]] const Around* known_border(SlabId s) const noexcept {
    const Around* found = known_around(s);
    return found != nullptr && !found->border.empty() ? found : nullptr;
  }

  const detail::GridTables& grid(int n) {
    auto& tables = grids[static_cast<std::size_t>(n)];
    if (!tables) tables = std::make_unique<detail::GridTables>(n);
    return *tables;
  }

  /// Returns the tile's values on a grid of m intervals: the tile itself, or `buffer`.
  const float* on_grid(const Tile& tile, int m, Tile& buffer) {
    if (tile.intervals() == m) return tile.plane();
    const auto at = resamplings.try_emplace({tile.intervals(), m}, tile.intervals(), m).first;
    kernels.resample(at->second, tile.plane(), buffer.plane(), sample_count(m));
    return std::as_const(buffer).plane();
  }

  /// Returns what tools may not change of a slab on a grid of n intervals: what the mask protects (from all tools but
  /// those that write it), and holes altogether.
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
  double highest_at_start(SlabId s) {
    Known& entry = known[s];
    const Tile& tile = start->tile(Layer::Displacement, s);
    if (!entry.highest_at_start)
      entry.highest_at_start = static_cast<double>(kernels.largest(tile.plane(), tile.size()));
    return *entry.highest_at_start;
  }

  /// Returns the slab's displacement on a grid of m intervals, kept from dab to dab: paint does not change it.
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

  /// Of which slab of the cage of `began` a slab is, and which part.
  [[nodiscard]] RootPlace part(SlabId s) const { return parts.empty() ? RootPlace{.root = s} : parts[s]; }

  /// Of the samples of a slab of `began`, model units; as it will be once the stroke has refined it.
  double own_spacing(SlabId s) {
    const SlabMesh& mesh = began->slab_mesh();
    const SlabCorners k = mesh.corners(s);
    double edges = 0;
    for (std::size_t e = 0; e < 3; ++e)
      edges += length((k.inner[e] + k.outer[e]) - (k.inner[(e + 1) % 3] + k.outer[(e + 1) % 3])) / 2;
    const int n = mesh.intervals(s);
    const double all = edges / 3 / n;
    if (!(wanted > 0) || tool->writes != Layer::Displacement) return all;
    return std::ldexp(all, -detail::halvings(detail::longest_edge(*began, s), n, wanted));
  }
  /// A side of a slab of `began` that other slabs share: an edge, half of one, or a corner.
  struct Side {
    double spacing;      ///< of the coarsest other slab, model units
    std::size_t corner;  ///< this one, or that across the edge
    bool is_edge;
    Vec3d from, way;  ///< where it lies half-way along the fibres; a corner has no way
  };
  /// Calls visit(Side) for each.
  template <typename Visit>
  void for_each_side(SlabId s, Visit&& visit) {
    const SlabMesh& mesh = began->slab_mesh();
    const std::array<Vec3d, 3> middle = middle_triangle(s);
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3d from = middle[(k + 1) % 3], way = middle[(k + 2) % 3] - from;
      if (mesh.slabs()[s].shares[k] == EdgeShare::Halves) way *= 0.5;
      mesh.for_each_across(s, static_cast<int>(k), [&](SlabId other) {
        visit(Side{own_spacing(other), k, true, from, way});
        from += way;
      });
      double coarsest = 0;
      mesh.for_each_at(mesh.slabs()[s].fibres[k],
                       [&](SlabId other) { coarsest = std::max(coarsest, own_spacing(other)); });
      visit(Side{coarsest, k, false, middle[k], {}});
    }
  }
  /// Half-way along the fibres of a slab of `began`.
  [[nodiscard]] std::array<Vec3d, 3> middle_triangle(SlabId s) const {
    const SlabCorners k = began->slab_mesh().corners(s);
    return {(k.inner[0] + k.outer[0]) / 2.0, (k.inner[1] + k.outer[1]) / 2.0, (k.inner[2] + k.outer[2]) / 2.0};
  }
  /// Returns the largest in a slab.
  double widest_spacing(SlabId s) {
    const SlabId first = part(s).root;
    double& widest = spacings[first].widest;
    if (!(widest > 0)) for_each_side(first, [&](const Side& side) { widest = std::max(widest, side.spacing); });
    return widest;
  }
  /// Returns how far beside a ball a cut blends in a slab, at most, model units. A blend of width h radii at right
  /// angles ends within h + sqrt(1 + h^2) radii of the centre, so within 1.1 h of the ball for h up to 1/6.
  double blend_beside(SlabId s) {
    return 1.1 * std::min(widest_spacing(s), static_cast<double>(detail::kWidestBlend) * radius);
  }
  /// Of a slab of `began`, at its samples. Where coarser ones lie beside it, it falls from theirs evenly with the
  /// distance, and so does the width of blends.
  const Tile& spacing_at_first(SlabId s) {
    auto& found = spacings[s].plane;
    if (found) return *found;
    const int n = began->tile(Layer::Displacement, s).intervals();
    const double own = own_spacing(s);
    const std::array<Vec3d, 3> middle = middle_triangle(s);
    const double area = length(cross(middle[1] - middle[0], middle[2] - middle[0]));
    found = std::make_unique<Tile>(n, 1, static_cast<float>(own / brush.radius));
    float* const plane = found->plane();
    for_each_side(s, [&](const Side& side) {
      if (!(side.spacing > own)) return;
      const std::size_t a = side.corner, b = (a + 1) % 3, c = (a + 2) % 3;
      const double square = dot(side.way, side.way), per_square = square > 0 ? 1 / square : 0.0;
      // A row of samples lies at least so far from the side as from its edge, or from the row through its corner.
      const double row = area / length(middle[c] - middle[b]) / n;
      const int rows = static_cast<int>(std::min((side.spacing - own) / (kSpacingFalls * row), n + 0.0));
      for (int k = 0; k <= rows; ++k) {
        std::array<int, 3> w{};
        w[a] = side.is_edge ? k : n - k;
        for (w[b] = 0; w[b] <= n - w[a]; ++w[b]) {
          w[c] = n - w[a] - w[b];
          const Vec3d p = (middle[0] * w[0] + middle[1] * w[1] + middle[2] * w[2]) / n - side.from;
          const double along = std::clamp(dot(p, side.way) * per_square, 0.0, 1.0);
          float& at = plane[sample_index(n, {w[1], w[2]})];
          const double there = side.spacing - kSpacingFalls * length(p - side.way * along);
          at = std::max(at, static_cast<float>(there / brush.radius));
        }
      }
    });
    return *found;
  }
  /// Of a slab as the stroke found it, or of a part of it.
  const float* spacing_of(SlabId s, int n) {
    const RootPlace of = part(s);
    const Tile& first = spacing_at_first(of.root);
    if (of.level == 0 && first.intervals() == n) return first.plane();
    if (!spaces[s]) {
      spaces[s] = part_of(first, Layer::Displacement, of, n);
      space_slabs.push_back(s);
    }
    return std::as_const(*spaces[s]).plane();
  }

  /// Returns the most of its fibres that counts as the last of the clay, or of the room, anywhere in a slab.
  double widest_fade(SlabId s) {
    const SlabCorners corners = cage().corners(s);
    double widest = static_cast<double>(detail::kFadeShare);
    // A fibre between the corners is at least as long as the height of the three above the triangle.
    const Vec3d across = normalized(cross(corners.inner[1] - corners.inner[0], corners.inner[2] - corners.inner[0]));
    double shortest = Box3d::kFar;
    for (std::size_t k = 0; k < 3; ++k) shortest = std::min(shortest, dot(corners.fibre(k), across));
    if (shortest > 0)
      widest = std::max(widest, static_cast<double>(detail::kFadeSpacings) * widest_spacing(s) / shortest);
    return shortest > 0 ? std::min(widest, 1.0) : 1.0;
  }

  /// Of a slab that is a part of a root.
  const detail::GridWeights& weights_of(SlabId s, int n, const RootPlace& in_root) {
    if (weights[s] && weights[s]->n == n) return weights[s]->in_root;
    if (weight_slabs.size() * 3 * sample_count(n) * sizeof(float) > kMaxWeightBytes)
      reset_all(weights, weight_slabs, weights.size());
    if (!weights[s]) weight_slabs.push_back(s);
    weights[s] = std::make_unique<PartWeights>(PartWeights{n, detail::weights_in_whole(n, in_root)});
    return weights[s]->in_root;
  }
  detail::SlabFrame frame(SlabId s, Vec3d origin, int n) {
    const SampleField field = cage().field(s);
    const detail::GridWeights& in_root = field.place.level > 0 ? weights_of(s, n, field.place) : grid(n).weights;
    return {field.root, origin, radius, in_root};
  }
  /// The same for kernels that ask for the spacing of the displacement's samples.
  detail::SlabFrame spaced_frame(SlabId s, Vec3d origin, int n) {
    detail::SlabFrame made = frame(s, origin, n);
    made.space = spacing_of(s, n);
    made.space_unit = static_cast<float>(brush.radius / radius);
    return made;
  }

  /// Unit normals of the slab's samples at the stroke's start: those of the grid that the stroke found, so that they do
  /// not depend on what became of it.
  const Tile& start_normals(SlabId s) {
    const RootPlace of = part(s);
    const Tile& first = normals_at_first(of.root);
    const int n = start_tile(s).intervals();
    if (of.level == 0 && first.intervals() == n) return first;
    if (!normals[s]) {
      normals[s] = std::make_unique<Tile>(*part_of(first, Layer::Displacement, of, n));
      normal_slabs.push_back(s);
    }
    return *normals[s];
  }
  /// Of a slab of `began`. At its border those of all slabs there: with its own triangles alone, a blend would depend
  /// on which of them owns a sample.
  const Tile& normals_at_first(SlabId s) {
    auto& found = first_normals[s];
    if (found) return *found;
    const Tile& tile = began->tile(Layer::Displacement, s);
    const int n = tile.intervals();
    found = std::make_unique<Tile>(n, 3, 0.0F);
    first_normal_slabs.push_back(s);
    const SlabCorners corners = began->slab_mesh().corners(s);
    const detail::SlabFrame f(corners, corners.inner[0], length(corners.fibre(0)), grid(n).weights);
    kernels.positions(f, tile.plane(), places.plane(0), places.plane(1), places.plane(2), tile.size());
    const detail::Neighbours surface = {places.plane(0), places.plane(1), places.plane(2)};
    kernels.normals(n, surface, outwards.plane(0), outwards.plane(1), outwards.plane(2));
    for (int c = 0; c < 3; ++c) std::copy_n(std::as_const(outwards).plane(c), tile.size(), found->plane(c));
    for (int edge = 0; edge < 3; ++edge)
      for (int t = 0; t < n; ++t) {
        const GridPoint at = edge_point(n, edge, t);
        const Vec3f normal = to_float(detail::triangle_normal(*began, s, at));
        for (int c = 0; c < 3; ++c) found->plane(c)[sample_index(n, at)] = normal[static_cast<std::size_t>(c)];
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

  /// Releases what only an open stroke needs.
  void rest() {
    const bool other_cage = start && start->shared_slab_mesh() != head->shared_slab_mesh();
    start.reset();
    layered.reset();
    began.reset();
    draft.reset();
    spare.reset();
    parts.clear();
    fine_enough.clear();
    reset_all(first_normals, first_normal_slabs, 0);
    spacings.clear();
    reset_all(spaces, space_slabs, spaces.size());
    if (other_cage) return take_cage();
    forget_fine();
    reset_all(normals, normal_slabs, normals.size());
    reset_all(weights, weight_slabs, weights.size());
    reset_all(covers, cover_slabs, covers.size());
    for (const SlabId s : beyond_slabs) beyond[s] = {};
    beyond_slabs.clear();
    for (const SlabId s : around_slabs) around_of[s] = 0;
    around_slabs.clear();
    around_count = 0;
    for (Known& entry : known) entry.highest_at_start.reset();
  }
  /// The same, and keeps little for the next one.
  void close() {
    rest();
    if (arounds.size() > kKeptArounds) arounds.resize(kKeptArounds);
    pool->clear();
  }

  struct Reach;
  void begin();
  [[nodiscard]] SlabId seed_of(const Dab& dab);
  void refine(const Reach& reach, SlabId seed, DabResult& result);
  void count_added(const DetailChange& finer, DabResult& result) const;
  void change_detail(const DetailChange& finer);
  [[nodiscard]] SnapshotPtr carried(const Snapshot& before, const Snapshot& made,
                                    std::span<const RootPlace> origins) const;
  DabResult apply(const Dab& dab);
  [[nodiscard]] double fade_out(const Dab& dab, const Sphere& ball, detail::Cutter cutter,
                                std::span<const SlabId> reached, DabResult& result);
  std::size_t cut(SlabId s, const Vec3d& origin, const detail::Cutter& cutter, Tile& result, bool& beside);
  void move_samples(const Dab& dab, Vec3d up, std::span<const SlabId> reached, float amount, DabResult& result);
  void cover_samples(const Dab& dab, std::span<const SlabId> reached, float amount, DabResult& result);
  void find_around(std::span<const SlabId> reached, Vec3d origin, bool borders);
  Around& around(SlabId s, Vec3d origin);
  void change_at_borders(SlabId s, const detail::SlabFrame& frame_of, float* to);
  void add_edge(SlabId s, int edge, const detail::BorderTables& table);
  void add_hanging_edge(SlabId s, int edge, const detail::BorderTables& table);
  void add_fan(FibreId fibre, const detail::BorderTables& table, std::size_t own);
  void add_border(const Around& other, const detail::BorderTables& twins, std::size_t twin, std::size_t own,
                  float ways);
  /// Returns how many samples of two tiles of one shape differ in any channel.
  [[nodiscard]] std::size_t changes_between(const Tile& a, const Tile& b) const {
    if (a.type() == SampleType::U16) return kernels.count_changes16(a.plane16(0), b.plane16(0), a.stride(), a.size());
    return kernels.count_changes(a.plane(), b.plane(), a.stride(), a.channel_count(), a.size());
  }
  /// Of the layer that the stroke writes, before the dab, and before the stroke.
  [[nodiscard]] const Tile& base_tile(SlabId s) const { return tile_in(now(), s); }
  [[nodiscard]] const Tile& start_tile(SlabId s) const { return tile_in(*start, s); }
  [[nodiscard]] const Tile& tile_in(const Snapshot& model, SlabId s) const { return model.tile(tool->writes, s); }
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

/// Returns how far the ball must be lifted, in model units, so that it stays out of the last of the clay; counts what
/// it would have taken too far. A function of the cage, the stroke's start and the dab alone.
double Editor::State::fade_out(const Dab& dab, const Sphere& ball, detail::Cutter cutter,
                               std::span<const SlabId> reached, DabResult& result) {
  const SlabMesh& mesh = cage();
  const Vec3d origin = ball.centre - dab.normal * radius;
  const double sweep = radius * length(to_double(cutter.along));
  float most = 0;
  for (const SlabId s : reached) {
    // A ball that stays above the triangle where the last of the clay begins needs no look at samples.
    const SlabCorners corners = mesh.corners(s);
    const double fade = widest_fade(s);
    std::array<Vec3d, 3> last{};
    for (std::size_t k = 0; k < 3; ++k) last[k] = corners.inner[k] + corners.fibre(k) * fade;
    const Vec3d across = normalized(cross(last[1] - last[0], last[2] - last[0]));
    if (dot(ball.centre - last[0], across) > radius + sweep) continue;
    const Tile& first = start_tile(s);
    const int n = first.intervals();
    const detail::Lift found =
        kernels.lift(spaced_frame(s, origin, n), cutter, first.plane(), protection(s, n), over.data(), first.size());
    most = std::max(most, found.lift);
    tell_beyond(s, first.size(), found.limited, result);
  }
  return static_cast<double>(most) * radius;
}

std::size_t Editor::State::cut(SlabId s, const Vec3d& origin, const detail::Cutter& cutter, Tile& result,
                               bool& beside) {
  const Tile& base = base_tile(s);
  const int n = base.intervals();
  const Tile& upright = start_normals(s);
  const detail::Start first = {start_tile(s).plane(), upright.plane(0), upright.plane(1), upright.plane(2)};
  beside |= kernels.cut(spaced_frame(s, origin, n), cutter, first, protection(s, n), base.plane(), result.plane(),
                        base.size());
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
  const SlabMesh& mesh = cage();
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
    const auto visit = [&](SlabId beside) {
      if (around_of[beside] == 0 && mesh.box(beside).distance2(origin) <= radius * radius) with_border(beside);
    };
    for (int k = 0; k < 3; ++k) {
      mesh.for_each_at(mesh.slabs()[s].fibres[static_cast<std::size_t>(k)], visit);
      if (mesh.slabs()[s].shares[static_cast<std::size_t>(k)] == EdgeShare::Halves)
        mesh.for_each_at(mesh.hanging(s, k).middle, visit);
    }
  }
}

/// Returns what Kernels::around() gives inside the slab, at the samples of its border: from the triangles of all slabs
/// there.
void Editor::State::change_at_borders(SlabId s, const detail::SlabFrame& f, float* to) {
  const SlabMesh& mesh = cage();
  const int n = mesh.intervals(s);
  const detail::BorderTables& table = border_table(n);
  const std::size_t count = table.own.size();
  border_sums = known_border(s)->border;
  border_ways.assign(count, 6);
  border_changes.resize(count);
  for (int edge = 0; edge < 3; ++edge) {
    const auto k = static_cast<std::size_t>(edge);
    if (mesh.slabs()[s].shares[k] != EdgeShare::Whole)
      add_hanging_edge(s, edge, table);
    else if (mesh.slabs()[s].neighbours[k] != kNoSlab)
      add_edge(s, edge, table);
    // Edge k begins at corner (k + 1) % 3.
    add_fan(mesh.slabs()[s].fibres[(k + 1) % 3], table, table.at(edge, 0));
  }
  kernels.border_change(f, table, tool->action == Action::Swell, border_sums.data(), border_ways.data(),
                        border_changes.data());
  for (std::size_t k = 0; k < count; ++k) to[table.own[k]] = border_changes[k];
}

/// Adds what the slab across gives to the samples along an edge.
void Editor::State::add_edge(SlabId s, int edge, const detail::BorderTables& table) {
  const SlabMesh& mesh = cage();
  const SlabId across = mesh.slabs()[s].neighbours[static_cast<std::size_t>(edge)];
  const Around* other = known_border(across);
  if (other == nullptr) return;
  const int n = mesh.intervals(s), m = mesh.intervals(across), shared = std::min(n, m);
  const int twin_edge = mesh.mirror_edge(s, edge);
  const detail::BorderTables& twins = border_table(m);
  for (int t = 1; t < shared; ++t)
    add_border(*other, twins, twins.at(twin_edge, m - t * (m / shared)), table.at(edge, t * (n / shared)), 6);
}

/// Returns the same along half of the edge of a coarser slab, or where two finer ones lie across.
void Editor::State::add_hanging_edge(SlabId s, int edge, const detail::BorderTables& table) {
  const SlabMesh& mesh = cage();
  const int n = mesh.intervals(s);
  const auto intervals_of = [&](SlabId slab) { return mesh.intervals(slab); };
  const bool halves = mesh.slabs()[s].shares[static_cast<std::size_t>(edge)] == EdgeShare::Halves;
  for (int t = 1; t < n; ++t) {
    if (halves && 2 * t == n) {
      add_fan(mesh.hanging(s, edge).middle, table, table.at(edge, t));
      continue;
    }
    const SampleCopy twin = mesh.twin_of(s, edge, t, intervals_of);
    const Around* other = twin.slab == kNoSlab ? nullptr : known_border(twin.slab);
    if (other == nullptr) continue;
    const detail::BorderTables& twins = border_table(mesh.intervals(twin.slab));
    add_border(*other, twins, twins.of(twin.at), table.at(edge, t), 6);
  }
}

/// Puts together what all slabs at a fibre give, in their order.
void Editor::State::add_fan(FibreId fibre, const detail::BorderTables& table, std::size_t own) {
  const SlabMesh& mesh = cage();
  border_ways[own] = 0;
  for (std::size_t c = 0; c < 6; ++c) border_sums[c * table.own.size() + own] = 0;
  const HangingEdge* hangs = mesh.hanging_at(fibre);
  const auto add_beside = [&] {
    if (const Around* other = known_border(hangs->slab)) {
      const int n = mesh.intervals(hangs->slab);
      const detail::BorderTables& twins = border_table(n);
      add_border(*other, twins, twins.at(hangs->edge, n / 2), own, 6);
    }
    hangs = nullptr;
  };
  for (const SlabCorner c : mesh.fan(fibre)) {
    if (hangs != nullptr && hangs->slab < c.slab) add_beside();
    if (const Around* other = known_border(c.slab)) {
      const detail::BorderTables& twins = border_table(mesh.intervals(c.slab));
      add_border(*other, twins, twins.at(static_cast<int>((c.corner + 2) % 3), 0), own, 2);
    }
  }
  if (hangs != nullptr) add_beside();
}

void Editor::State::add_border(const Around& other, const detail::BorderTables& twins, std::size_t twin,
                               std::size_t own, float ways) {
  const std::size_t count = border_ways.size(), twin_count = twins.own.size();
  for (std::size_t c = 0; c < 6; ++c) border_sums[c * count + own] += other.border[c * twin_count + twin];
  border_ways[own] += ways;
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
      const detail::SlabFrame f = spaced_frame(s, origin, base.intervals());
      find_change(s, f);
      share = std::min(share, kernels.room(f, std::as_const(weight).plane(), std::as_const(change).plane(),
                                           start_tile(s).plane(), base.plane(), base.size()));
    }
  // The sample under the tool ends it all. On the coarse grid of a tip even that one has not all of the weight; what it
  // lacked went on rising, and the tip became flat.
  if (share < 1) {
    float most = 0;
    for (const SlabId s : reached) {
      const Tile& base = base_tile(s);
      weigh(s, frame(s, origin, base.intervals()));
      most = std::max(most, kernels.largest(std::as_const(weight).plane(), base.size()));
    }
    share = 1 - (1 - share) / most;
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
  // In radii of the dab. It is that of the brush whatever the dab's size: the layer is even.
  const double height =
      (brush.height != 0 && std::isfinite(brush.height) ? brush.height / brush.radius : kLayerHeight) / dab.size;
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

// ---- Detail

/// Says where a dab works.
struct Editor::State::Reach {
  Reach(const Dab& given, const Brush& brush, double radius, const ToolInfo& tool)
      : dab(given), up(normalized(given.normal)), cuts(tool.action == Action::Cut) {
    dab.normal = up;
    // The sphere's lowest point, cursor + k * normal, or the centre: the origin of the kernels' frame.
    const double band = brush.resilience > 0 && std::isfinite(brush.resilience) ? brush.resilience : 0.0;
    lowest = dab.cursor + up * band;
    ball = {cuts ? lowest + up * radius : dab.contact, radius};
    const Vec3d sweep = cuts && dab.swept ? dab.from - ball.centre : Vec3d{};
    sphere = {ball.centre + sweep * 0.5, radius + length(sweep) / 2};
    cutter = {.up = to_float(up), .along = to_float(sweep / radius), .exact = brush.exact};
  }
  Dab dab;
  Vec3d up;
  bool cuts;
  Vec3d lowest;
  Sphere ball, sphere;
  detail::Cutter cutter = {};
};

void Editor::State::begin() {
  spacings.resize(began->slab_mesh().slab_count());
  first_normals.resize(began->slab_mesh().slab_count());
  // One spacing for the stroke, whatever the sizes of its dabs: what a cut leaves does not depend on their order.
  const double light = brush.pressure_drives == PressureDrives::Strength ? 1.0 : kLightRadius;
  const double asked = brush.detail * brush.radius * light;
  // On a finer grid smoothing would only do less: there is nothing finer than the grid to even out.
  const bool refines = asked > 0 && std::isfinite(asked) && tool->action != Action::Even;
  wanted = refines ? std::max(asked, kFinestDetail * diagonal(began->slab_mesh().bounds())) : 0;
  too_fine = wanted > asked;
  rebuilt = 0;
}

/// Returns the slab of a dab's contact, whose number may be that of a cage before.
SlabId Editor::State::seed_of(const Dab& dab) {
  if (!cage().is_cut()) return dab.slab;
  const auto found = locate(cage(), dab.contact, seat);
  return found ? found->slab : dab.slab;
}

/// Makes the grid under the tool as fine as it needs it, and that around it, so that the next dabs find it done.
void Editor::State::refine(const Reach& reach, SlabId seed, DabResult& result) {
  const Sphere& sphere = reach.sphere;
  const auto holds = [&](const Sphere& fine) {
    return length(fine.centre - sphere.centre) + sphere.radius <= fine.radius;
  };
  if (!(wanted > 0) || std::ranges::any_of(fine_enough, holds)) return;
  const Sphere ring = {sphere.centre, sphere.radius + radius * kRing};
  const auto highest_there = [&](SlabId s) { return reach.cuts ? highest_at_start(s) : highest(s); };
  const auto surface_there = [&](SlabId s) -> const Tile& {
    return (reach.cuts ? *start : now()).tile(Layer::Displacement, s);
  };
  const auto touched = [&](SlabId s) {
    return draft && draft->now().shared_tile(tool->writes, s) != start->shared_tile(tool->writes, s);
  };
  result.detail_limited = too_fine;
  const auto near = region.grow(cage(), seed, ring, reach.up, highest_there);
  detail::RefinePlan plan(*start, *began);
  detail::Need need = {.layer = tool->writes, .sphere = ring, .up = reach.up, .spacing = wanted};
  if (plan.wanted(near, need)) {
    const std::size_t added = cage().slab_count() - began->slab_mesh().slab_count();
    if (added >= kMaxSlabsPerStroke || rebuilt >= kMaxRebuiltSlabs) {
      result.detail_limited = true;
      return;
    }
    std::size_t samples = 0;
    for (SlabId s = 0; s < cage().slab_count(); ++s) samples += sample_count(cage().intervals(s));
    const detail::DetailBudget budget = {
        kMaxSlabsPerStroke - added,
        std::min(kMaxSamplesPerDab, kMaxModelSamples - std::min(samples, kMaxModelSamples))};
    // What is not available is had as far as it goes.
    bool planned = plan.run(near, need, surface_there, touched, budget);
    while (!planned && plan.wanted(near, need)) {
      result.detail_limited = true;
      need.spacing *= 2;
      planned = plan.run(near, need, surface_there, touched, budget);
    }
    if (planned && !plan.empty()) {
      if (const auto made = DetailChange::make(layered, plan.since_began())) {
        rebuilt += made->slab_mesh().slab_count();
        count_added(*made, result);
        change_detail(*made);
      } else {
        result.detail_limited = true;
      }
    }
  }
  if (fine_enough.size() == kKeptFine) fine_enough.erase(fine_enough.begin());
  fine_enough.push_back(ring);
}

/// Counts what a change adds: samples of all layers.
void Editor::State::count_added(const DetailChange& finer, DabResult& result) const {
  result.slabs_added += finer.slab_mesh().slab_count() - cage().slab_count();
  for (int k = 0; k < kLayerCount; ++k) {
    const auto layer = static_cast<Layer>(k);
    if (!start->has(layer)) continue;
    for (SlabId s = 0; s < finer.slab_mesh().slab_count(); ++s)
      result.samples_added += sample_count(finer.intervals(layer, s));
    for (SlabId s = 0; s < cage().slab_count(); ++s) result.samples_added -= sample_count(start->intervals(layer, s));
  }
}

/// The open stroke goes on in another cage: all that it has of slabs goes with it.
void Editor::State::change_detail(const DetailChange& finer) {
  const SnapshotPtr before = start;
  const auto old_covers = std::exchange(covers, {});
  const auto old_beyond = std::exchange(beyond, {});
  cover_slabs.clear();
  beyond_slabs.clear();
  start = finer.of(*layered);
  const std::vector<RootPlace> origins = parts_after(before->slab_mesh(), start->slab_mesh());
  if (draft) {
    head = carried(*before, *draft->finish(), origins);
    draft.emplace(head);
    unpublished = false;
  }
  take_cage();
  parts = parts_after(began->slab_mesh(), cage());
  for (SlabId s = 0; s < cage().slab_count(); ++s) {
    const RootPlace& from = origins[s];
    const int n = start->intervals(tool->writes, s);
    if (old_covers[from.root]) {
      covers[s] = std::make_unique<Tile>(*part_of(*old_covers[from.root], Layer::Mask, from, n));
      cover_slabs.push_back(s);
    }
    if (const auto& flags = old_beyond[from.root]; !flags.empty()) {
      Tile all(before->intervals(tool->writes, from.root), 1, 0.0F);
      for (std::size_t k = 0; k < flags.size(); ++k) all.plane()[k] = flags[k];
      const auto some = part_of(all, Layer::Void, from, n);
      for (std::size_t k = 0; k < some->size(); ++k) beyond[s].push_back(some->plane()[k] > 0.5F ? 1 : 0);
      beyond_slabs.push_back(s);
    }
  }
}

/// Returns what the stroke has made of its start so far, in the cage of the start as it is now: samples that it has not
/// changed are those of the start.
SnapshotPtr Editor::State::carried(const Snapshot& before, const Snapshot& made,
                                   std::span<const RootPlace> origins) const {
  const Layer layer = tool->writes;
  const SlabMesh& mesh = start->slab_mesh();
  std::vector<std::shared_ptr<Tile>> touched(mesh.slab_count());
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const SlabId from = origins[s].root;
    if (made.shared_tile(layer, from) == before.shared_tile(layer, from)) continue;
    const Tile& fresh = start->tile(layer, s);
    touched[s] = std::make_shared<Tile>(fresh);
    const auto is = part_of(made.tile(layer, from), layer, origins[s], fresh.intervals());
    const auto was = part_of(before.tile(layer, from), layer, origins[s], fresh.intervals());
    for (int c = 0; c < fresh.channel_count(); ++c)
      for (std::size_t k = 0; k < fresh.size(); ++k)
        if (is->value(c, k) != was->value(c, k)) touched[s]->set(c, k, is->value(c, k));
  }
  const auto intervals_of = [&](SlabId s) { return start->intervals(layer, s); };
  // Changed samples between old ones come from either side of an edge; the lower slab's count.
  const auto join = [&](SlabId s, GridPoint p) {
    SampleCopy owner;
    mesh.for_each_copy(s, intervals_of, p, [&](const SampleCopy& copy) {
      if (!touched[copy.slab]) return;
      if (owner.slab == kNoSlab) owner = copy;
      for (int c = 0; c < touched[s]->channel_count(); ++c)
        touched[copy.slab]->set(c, sample_index(intervals_of(copy.slab), copy.at),
                                touched[owner.slab]->value(c, sample_index(intervals_of(owner.slab), owner.at)));
    });
  };
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    for (int edge = 0; touched[s] && edge < 3; ++edge)
      for (int t = 0; t < intervals_of(s); ++t) {
        const GridPoint p = edge_point(intervals_of(s), edge, t);
        if (!edge_place(intervals_of(s), mesh.edge_intervals(s, intervals_of), p).constrained()) join(s, p);
      }
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    if (touched[s]) constrain(mesh, layer, s, intervals_of, *touched[s]);
  return Snapshot::with_cage(*start, start->shared_slab_mesh(), [&](Layer of) {
    std::vector<TilePtr> all;
    for (SlabId s = 0; s < mesh.slab_count(); ++s)
      all.push_back(of == layer && touched[s] ? TilePtr(touched[s]) : start->shared_tile(of, s));
    return all;
  });
}

// ---- The dab

DabResult Editor::State::apply(const Dab& given) {
  radius = brush.radius * given.size;
  const Reach reach(given, brush, radius, *tool);
  const Dab& dab = reach.dab;
  const Vec3d up = reach.up;
  const double driven = unit_range(brush.strength) * (tool->by_pressure ? unit_range(dab.pressure) : 1.0);
  const auto amount = static_cast<float>(tool->rate * driven * std::clamp(dab.seconds, 0.0, 1e6));

  DabResult result;
  refine(reach, seed_of(dab), result);
  const SlabMesh& mesh = cage();
  const auto reached = region.grow(mesh, seed_of(dab), reach.sphere, up, [&](SlabId s) -> detail::Extent {
    if (!reach.cuts || brush.exact) return highest(s);
    return {highest(s), blend_beside(s)};
  });

  result.slabs = reached.size();
  tiles.begin();
  if (reach.cuts) {
    const double lift = fade_out(dab, reach.ball, reach.cutter, reached, result);
    const Vec3d origin = reach.lowest + up * lift;
    for (const SlabId s : reached) {
      const Tile& base = base_tile(s);
      const std::size_t changes = cut(s, origin, reach.cutter, result_like(base), result.beside);
      add(s, base, nullptr, changes);
    }
  } else if (tool->action == Action::Cover) {
    cover_samples(dab, reached, amount, result);
  } else {
    move_samples(dab, up, reached, amount, result);
  }
  tiles.commit(
      mesh, tool->writes,
      {.base = [&](SlabId s) -> const Tile& { return base_tile(s); },
       .cover =
           [&](SlabId s) { return tool->action == Action::Cover ? cover_of(s, base_tile(s).intervals()) : nullptr; },
       .rank = [&](SlabId s) { return part(s).root; }},
      *pool, [&](int n) -> const detail::GridTables& { return grid(n); });

  for (const Slot& slot : tiles.slots()) result.samples += slot.changes;
  if (result.samples == 0) return result;
  if (!draft) draft.emplace(start);
  for (Slot& slot : tiles.slots()) {
    if (!slot.tile) continue;
    if (tool->writes == Layer::Displacement) {
      known[slot.slab].highest.reset();
      known[slot.slab].fine.reset();
    }
    draft->put(tool->writes, slot.slab, std::move(slot.tile));
  }
  unpublished = true;
  return result;
}

// ---- The editor

void StrokeResult::add(const DabResult& dab, Vec3d contact) noexcept {
  if (limited == 0 && dab.limited > 0) limited_at = contact;
  if (!detail_limited && dab.detail_limited) detail_limited_at = contact;
  if (!beside && dab.beside) beside_at = contact;
  ++dabs;
  limited += dab.limited;
  slabs_added += dab.slabs_added;
  samples_added += dab.samples_added;
  detail_limited = detail_limited || dab.detail_limited;
  beside = beside || dab.beside;
}

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
  const bool other_cage = head->shared_slab_mesh() != state_->head->shared_slab_mesh();
  state_->head = std::move(head);
  if (other_cage)
    state_->take_cage();
  else
    state_->forget_all();
}

void Editor::begin_stroke(const Brush& brush) {
  RELIEF_ASSERT(!in_stroke());
  RELIEF_ASSERT(sane(brush));
  State& state = *state_;
  state.brush = brush;
  state.tool = &info(brush.tool);
  state.so_far = {};
  state.began = state.head;
  state.layered =
      state.began->has(state.tool->writes) ? state.began : with_blank_layer(state.began, state.tool->writes);
  state.start = state.layered;
  state.begin();
}

DabResult Editor::dab(const Dab& dab) {
  RELIEF_ASSERT(in_stroke());
  const Vec3d up = normalized(dab.normal);
  const bool good = dab.slab < state_->cage().slab_count() && is_finite(dab.contact) && is_finite(dab.cursor) &&
                    is_finite(up) && std::abs(dot(up, up) - 1) <= 1e-6 && std::isfinite(dab.pressure) &&
                    std::isfinite(dab.seconds) && (!dab.swept || is_finite(dab.from)) &&
                    state_->brush.radius * dab.size > 0 && dab.size <= 1;
  if (!good) return {};
  const DabResult result = state_->apply(dab);
  state_->so_far.add(result, dab.contact);
  return result;
}

StrokeResult Editor::end_stroke() {
  RELIEF_ASSERT(in_stroke());
  State& state = *state_;
  state.publish();
  StrokeResult result = state.so_far;
  if (state.draft)
    for_each_change(*state.start, *state.head, [&](Layer layer, SlabId s) {
      result.samples += state.changes_between(state.start->tile(layer, s), state.head->tile(layer, s));
    });
  result.limited = 0;  // those that differ, not those of all dabs
  for (const SlabId s : state.beyond_slabs)
    result.limited += static_cast<std::size_t>(std::ranges::count(state.beyond[s], 1));
  result.changed = result.samples > 0;
  if (!result.changed) {
    // Detail alone is none.
    result.slabs_added = result.samples_added = 0;
    state.head = state.began;
    state.forget_all();
  }
  state.close();
  return result;
}

void Editor::cancel_stroke() {
  RELIEF_ASSERT(in_stroke());
  state_->head = state_->began;
  state_->unpublished = false;
  state_->forget_all();
  state_->close();
}

}  // namespace relief
