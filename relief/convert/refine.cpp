#include <relief/base/assert.h>
#include <relief/base/steps.h>
#include <relief/base/try.h>
#include <relief/convert/convert.h>
#include <relief/convert/failures.h>
#include <relief/convert/refine.h>
#include <relief/convert/room.h>
#include <relief/core/detail.h>
#include <relief/core/query.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <utility>

namespace relief {

namespace {

constexpr std::array<std::string_view, 3> kNames = {"saturated", "all", "model"};

/// The alpha up to which a sample stands at the end of its fibre. Tools fade out in the last RoomGoals::fade_share of
/// what lies below the surface, or RoomGoals::fade_spacings of samples, at most in its half; and one that goes to its
/// end leaves half of that. What was below is not known: half of the fibre.
float end_of(const SlabMesh& mesh, SlabId s) {
  constexpr double kBelow = 0.5;
  const SlabCorners corners = mesh.corners(s);
  double edges = 0, fibres = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    edges += length(corners.inner[(k + 1) % 3] - corners.inner[k]) / 6;
    edges += length(corners.outer[(k + 1) % 3] - corners.outer[k]) / 6;
    fibres += length(corners.fibre(k)) / 3;
  }
  const RoomGoals goals;
  const double spacings = goals.fade_spacings * edges / (mesh.intervals(s) * fibres);
  return static_cast<float>(std::min(std::max(goals.fade_share * kBelow, spacings), kBelow / 2) / 2);
}

/// A sample that stands at the end of its fibre because tools have brought it there.
struct WornSample {
  SlabId slab = kNoSlab;
  Vec3d position;
  bool below = true;  ///< it is the inner end
};

/// Returns whether conversion has put the surface as near to the end of a fibre as a sample is now: it left little clay
/// in thin walls. A tool that comes to the end has taken more than it leaves, for it fades out in the last half at
/// most; so the surface as it was made lies beyond twice what is left. All along the fibre, however it leans.
bool was_made_there(const Snapshot& made, const SlabCorners& corners, const std::array<double, 3>& shares, float alpha,
                    bool below, PickHint& hint) {
  constexpr double kRounding = 1e-6;  // of a fibre: twenty steps of an alpha
  const double left = below ? double(alpha) : 1 - double(alpha);
  const auto at = [&](double from_end) { return corners.point(shares, below ? from_end : 1 - from_end); };
  const Vec3d from = at(-kRounding), way = at(2 * left + kRounding) - from;
  // Along the border of an open surface a ray may pass beside what lies there.
  const double rounding = kRounding * length(corners.point(shares, 1) - corners.point(shares, 0));
  if (closest_point(made, at(left), hint, rounding).slab != kNoSlab) return true;
  const auto met = raycast(made, {from, way}, hint);
  return met && met->distance <= 1;
}

/// Finds such samples, slab by slab. `made` is the surface as it was when its slabs were new; where it is null, all
/// that stand at an end. Stops when it is cancelled.
std::vector<WornSample> find_worn(const Snapshot& model, const Snapshot* made, const Progress& progress) {
  const SlabMesh& mesh = model.slab_mesh();
  std::vector<WornSample> worn;
  PickHint hint;
  for (SlabId s = 0; s < mesh.slab_count() && !progress.cancelled(); ++s) {
    progress("clay", static_cast<double>(s) / mesh.slab_count());
    const float* alpha = model.displacement(s);
    const int n = mesh.intervals(s);
    const float end = end_of(mesh, s);
    const SlabCorners corners = mesh.corners(s);
    std::size_t index = 0;
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i, ++index) {
        const bool below = alpha[index] <= end;
        if (!below && alpha[index] < 1 - end) continue;
        const std::array<double, 3> shares = {double(n - i - j) / n, double(i) / n, double(j) / n};
        if (made != nullptr && was_made_there(*made, corners, shares, alpha[index], below, hint)) continue;
        worn.push_back({s, sample_position(model, s, {i, j}), below});
      }
  }
  return worn;
}

/// Distances between two surfaces.
struct Distances {
  double most = 0, squares = 0;
  std::size_t count = 0;
};
/// The roots of a cage whose fibres are the same ones in another.
std::vector<std::uint8_t> standing_roots(const SlabMesh& of, const SlabMesh& in) {
  std::vector<std::uint8_t> stand(of.roots().size());
  if (!std::ranges::equal(of.roots(), in.roots(), {}, &Slab::fibres, &Slab::fibres)) return stand;
  for (std::size_t root = 0; root < stand.size(); ++root)
    stand[root] = std::ranges::all_of(of.roots()[root].fibres, [&](FibreId f) {
      const Fibre &a = of.root_fibres()[f], &b = in.root_fibres()[f];
      return a.inner == b.inner && a.outer == b.outer;
    });
  return stand;
}
/// Returns how far a point on a fibre lies from the micro-triangle that this fibre crosses, along its normal; nothing
/// where it stands over another one. No search: where the fibres are the same, so is the place.
std::optional<double> off_facet(const Snapshot& surface, const SlabCoord& at, Vec3d p) {
  const int n = surface.slab_mesh().intervals(at.slab);
  const GridCell cell = cell_at(n, at.u, at.v);
  const Vec3d a = sample_position(surface, at.slab, cell.corners[0]),
              b = sample_position(surface, at.slab, cell.corners[1]),
              c = sample_position(surface, at.slab, cell.corners[2]);
  const Vec3d normal = cross(b - a, c - a);
  const double square = dot(normal, normal), above = dot(p - a, normal);
  constexpr double kOnEdge = -1e-9;  // of the triangle's area
  if (!(square > 0) || dot(cross(b - a, p - a), normal) < kOnEdge * square ||
      dot(cross(c - b, p - b), normal) < kOnEdge * square || dot(cross(a - c, p - c), normal) < kOnEdge * square)
    return std::nullopt;
  return std::abs(above) / std::sqrt(square);
}
/// Adds how far the samples of one surface lie from another.
void add_distances(const Snapshot& of, const Snapshot& from, Distances& found, const Progress& progress) {
  const SlabMesh& mesh = of.slab_mesh();
  const std::vector<std::uint8_t> stand = standing_roots(mesh, from.slab_mesh());
  PickHint hint;
  const auto distance_at = [&](SlabId s, GridPoint at, Vec3d p) -> std::optional<double> {
    const double n = mesh.intervals(s);
    if (stand[mesh.root_place(s).root] != 0)
      if (const auto there = heir(mesh, from.slab_mesh(), {s, at.i / n, at.j / n, 0}))
        if (const auto off = off_facet(from, *there, p)) return off;
    const SurfacePoint near = closest_point(from, p, hint);
    if (near.slab == kNoSlab) return std::nullopt;
    return length(near.position - p);
  };
  for (SlabId s = 0; s < mesh.slab_count() && !progress.cancelled(); ++s) {
    // Odd, so that it is not only looked at samples that others were made between.
    const int n = mesh.intervals(s), step = std::max(1, n / 32) | 1;
    for (int j = 0; j <= n; j += step)
      for (int i = 0; i + j <= n; i += step) {
        const auto off = distance_at(s, {i, j}, sample_position(of, s, {i, j}));
        if (!off) continue;
        found.squares += *off * *off;
        ++found.count;
        found.most = std::max(found.most, *off);
      }
    progress("measure", static_cast<double>(s) / mesh.slab_count());
  }
}
/// Both ways: a part that is gone lies far from what is left, not the other way round.
void measure(const Snapshot& before, const Snapshot& after, Refined& result, const Progress& progress) {
  Distances found;
  add_distances(after, before, found, part_of(progress, "measure", 0, 0.5));
  add_distances(before, after, found, part_of(progress, "measure", 0.5, 1));
  result.moved_max = found.most;
  result.moved_rms = found.count == 0 ? 0 : std::sqrt(found.squares / static_cast<double>(found.count));
}

// ---- Saturated

/// Clay wanted below what has run out, share of the diagonal: what conversion aims at.
constexpr double kClayWanted = 0.08;
/// Share of a slab's samples at an end of their fibres from which on it gets room.
constexpr double kSaturatedShare = 0.01;

/// Radius of a solid that wants room, at least, share of the diagonal: a single sample is a point.
constexpr double kLeastRadius = 1e-3;

/// One solid for each end of the fibres of a slab that has run out there, as wide as what has.
void want_room(const SlabMesh& mesh, std::span<const WornSample> of_slab, double diagonal, RoomWanted& wanted) {
  const SlabCorners corners = mesh.corners(of_slab.front().slab);
  const Vec3d out = normalized(corners.fibre(0) + corners.fibre(1) + corners.fibre(2));
  std::array<Box3d, 2> boxes;
  for (const WornSample& sample : of_slab) boxes[sample.below ? 0 : 1].add(sample.position);
  for (const bool below : {true, false}) {
    const Box3d& box = boxes[below ? 0 : 1];
    if (box.empty()) continue;
    const double radius = std::max(length(box.extent()) / 2, kLeastRadius * diagonal);
    const Vec3d way = out * (std::max(kClayWanted * diagonal - radius, 0.0) * (below ? -1 : 1));
    (below ? wanted.cut : wanted.fill).push_back({box.centre(), box.centre() + way, radius, out});
  }
}

// ---- Finer grids

/// Returns whether a slab has an odd grid in a layer that no tile can have twice. Then no samples can hang in its
/// edges.
bool is_odd_to_the_limit(const Snapshot& model, SlabId s) {
  for (int k = 0; k < kLayerCount; ++k) {
    const auto layer = static_cast<Layer>(k);
    if (!model.has(layer)) continue;
    const int n = model.intervals(layer, s);
    if (n % 2 != 0 && 2 * n > kMaxIntervals) return true;
  }
  return false;
}

/// Adds a slab to those that are cut, and the slabs that must be cut for that: coarser ones beside it, and those whose
/// edges cannot hold the samples of its parts.
void add_cut(const Snapshot& model, SlabId slab, std::vector<std::uint8_t>& cuts) {
  const SlabMesh& mesh = model.slab_mesh();
  std::vector<SlabId> open = {slab};
  while (!open.empty()) {
    const SlabId s = open.back();
    open.pop_back();
    if (std::exchange(cuts[s], 1) != 0) continue;
    for (int edge = 0; edge < 3; ++edge)
      mesh.for_each_across(s, edge, [&](SlabId other) {
        const int level = mesh.level(other);
        if (level < mesh.level(s) || (level == mesh.level(s) && is_odd_to_the_limit(model, other)))
          open.push_back(other);
      });
  }
}

/// Twice the samples along every edge of the chosen slabs, in all layers or that of the displacement. Those whose tiles
/// would have more than `most` intervals are cut in four.
Detail twice_as_fine(const Snapshot& model, const std::function<bool(SlabId)>& chosen, bool all_layers, int most) {
  const SlabMesh& mesh = model.slab_mesh();
  std::vector<Layer> layers;
  for (int k = 0; k < kLayerCount; ++k) {
    const auto layer = static_cast<Layer>(k);
    if (model.has(layer) && (all_layers || layer == Layer::Displacement)) layers.push_back(layer);
  }
  std::vector<std::uint8_t> cuts(mesh.slab_count());
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    if (chosen(s) && std::ranges::any_of(layers, [&](Layer layer) { return 2 * model.intervals(layer, s) > most; }))
      add_cut(model, s, cuts);
  Detail detail;
  const auto want = [&](SlabId from, SlabId s) {
    if (!chosen(from)) return;
    const bool is_child = cuts[from] != 0;
    for (const Layer layer : layers) {
      // With a cut an even grid is halved and must be doubled for that; an odd one stays, which is twice as fine.
      const int n = model.intervals(layer, from);
      detail.grids.push_back({layer, s, is_child ? n : 2 * n});
    }
  };
  SlabId next = mesh.slab_count();
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    want(s, s);
    if (cuts[s] == 0) continue;
    detail.cuts.push_back(s);
    for (int child = 0; child < 3; ++child) want(s, next++);
  }
  return detail;
}

/// Of the cosine between a fibre and the surface's normal: fibres that lean by more than 65 degrees.
constexpr double kLeanCosine = 0.42261826174069944;
/// Share of a slab's micro-triangles that lean from which on its grid gets finer.
constexpr double kLeaningShare = 0.05;
/// A slab that leans has samples so many times nearer at most: as at 75 degrees, where they lie 4 times as far apart.
constexpr int kMostHalvings = 2;
/// Share of the distances between neighbours in a slab that its spacing is not below.
constexpr double kNearlyAll = 0.95;
/// A tile gets more intervals up to so many, then the slab is cut, as under a tool.
constexpr int kFineIntervals = 32;

/// How a slab's samples lie on the surface.
struct Lie {
  bool leans = false;
  double spacing = 0;  ///< of neighbours, which one in twenty exceeds; model units
};
Lie lie_of(const Snapshot& model, SlabId s) {
  const int n = model.slab_mesh().intervals(s);
  const SlabCorners corners = model.slab_mesh().corners(s);
  std::vector<double> edges;
  std::size_t leaning = 0, count = 0;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i + j < n; ++i) {
      const Vec3d a = sample_position(model, s, {i, j}), b = sample_position(model, s, {i + 1, j}),
                  c = sample_position(model, s, {i, j + 1});
      for (const double edge : {length(b - a), length(c - a), length(c - b)}) edges.push_back(edge);
      const std::array<double, 3> w = {double(n - i - j) / n, double(i) / n, double(j) / n};
      const Vec3d along = corners.point(w, 1) - corners.point(w, 0), normal = cross(b - a, c - a);
      ++count;
      leaning += dot(normal, along) < kLeanCosine * length(normal) * length(along) ? 1 : 0;
    }
  const auto at = edges.begin() + static_cast<std::ptrdiff_t>(kNearlyAll * static_cast<double>(edges.size() - 1));
  std::ranges::nth_element(edges, at);
  return {static_cast<double>(leaning) > kLeaningShare * static_cast<double>(count), *at};
}
/// Of a root's own samples, on a surface across the fibres in their middle: mean over its edges.
double upright_spacing(const SlabMesh& mesh, SlabId root) {
  const Slab& slab = mesh.roots()[root];
  const auto middle = [&](std::size_t k) {
    const Fibre& f = mesh.root_fibres()[slab.fibres[k]];
    return (f.inner + f.outer) / 2;
  };
  return (length(middle(1) - middle(0)) + length(middle(2) - middle(1)) + length(middle(0) - middle(2))) / 3 /
         slab.intervals;
}

/// Where fibres lean, samples lie far apart on the surface. Grids get finer there until these lie as near as those of
/// the root would on a surface across its fibres, or kMostHalvings times.
Status make_finer_where_leaning(SnapshotPtr& model, Refined& result, const Progress& progress) {
  for (bool is_first = true; !progress.cancelled(); is_first = false) {
    const SlabMesh& mesh = model->slab_mesh();
    std::vector<std::uint8_t> coarse(mesh.slab_count());
    std::size_t leaning = 0, wanted = 0;
    for (SlabId s = 0; s < mesh.slab_count(); ++s) {
      const RootPlace place = mesh.root_place(s);
      const Lie lie = lie_of(*model, s);
      leaning += lie.leans ? 1 : 0;
      const int n = mesh.roots()[place.root].intervals;
      const bool may_halve = (mesh.intervals(s) << place.level) < (n << kMostHalvings);
      coarse[s] = lie.leans && may_halve && lie.spacing > std::numbers::sqrt2 * upright_spacing(mesh, place.root);
      wanted += coarse[s];
    }
    if (is_first) {
      result.slabs_leaning = leaning;
      result.slabs_finer = wanted;
    }
    if (wanted == 0) return {};
    const auto chosen = [&](SlabId s) { return coarse[s] != 0; };
    RELIEF_TRY(model, with_detail(model, twice_as_fine(*model, chosen, false, kFineIntervals)));
  }
  return {};
}

Status make_room_where_saturated(const Model& model, std::span<const WornSample> worn, const Snapshot* made_as,
                                 Refined& result, const Progress& progress) {
  RoomWanted wanted;
  const SlabMesh& mesh = model.head->slab_mesh();
  const double diagonal = source_diagonal(model);
  for (std::size_t first = 0, last = 0; first < worn.size(); first = last) {
    const SlabId s = worn[first].slab;
    while (last < worn.size() && worn[last].slab == s) ++last;
    if (static_cast<double>(last - first) > kSaturatedShare * static_cast<double>(sample_count(mesh.intervals(s))))
      want_room(mesh, worn.subspan(first, last - first), diagonal, wanted);
  }
  SnapshotPtr head = model.head;
  if (!wanted.empty()) {
    RELIEF_TRY(const RoomMade made, make_room(*head, wanted, {.diagonal = diagonal, .for_tools = false}, progress));
    result.fibres_moved = made.moved.size();
    result.fibres_lacking = made.after.size();
    RELIEF_TRY(head, with_room(head, made));
    result.saturated_after = find_worn(*head, made_as, progress).size();
  }
  RELIEF_CHECK(make_finer_where_leaning(head, result, progress));
  if (head == model.head) return {};
  measure(*model.head, *head, result, progress);
  result.model.head = head;
  return {};
}

// ---- Model

/// Brings the layers that conversion does not know, from the nearest place of the old surface. A shared sample is
/// looked up once, so its copies are equal.
void bring_layers(const Snapshot& from, SnapshotDraft& to, const Progress& progress) {
  const SlabMesh& mesh = to.base().slab_mesh();
  for (int k = 0; k < kLayerCount && !progress.cancelled(); ++k) {
    const auto layer = static_cast<Layer>(k);
    if (!from.has(layer) || layer == Layer::Displacement || layer == Layer::Colour || has_own_intervals(layer))
      continue;
    int m = 1;
    for (SlabId s = 0; s < from.slab_mesh().slab_count(); ++s) m = std::max(m, from.intervals(layer, s));
    to.add_layer(layer, m, 0.0F);
    PickHint hint;
    for (SlabId s = 0; s < mesh.slab_count() && !progress.cancelled(); ++s) {
      Tile& tile = to.edit(layer, s);
      for (int j = 0; j <= m; ++j)
        for (int i = 0; i + j <= m; ++i) {
          SampleCopy first;
          mesh.for_each_copy(
              s, [m](SlabId) { return m; }, {i, j},
              [&](const SampleCopy& copy) {
                if (first.slab == kNoSlab) first = copy;
              });
          const std::size_t at = sample_index(m, {i, j});
          if (first.slab != s || first.at != GridPoint{i, j}) {
            if (first.slab < s || (first.slab == s && sample_index(m, first.at) < at)) {
              tile.set(0, at, to.tile(layer, first.slab).value(0, sample_index(m, first.at)));
              continue;
            }
          }
          const Vec3d p = surface_point(to.base(), s, double(i) / m, double(j) / m).position;
          const SurfacePoint place = closest_point(from, p, hint);
          if (place.slab != kNoSlab)
            tile.set(0, at, static_cast<float>(layer_at(from, layer, place.slab, place.u, place.v, 0)));
        }
      progress("layers", static_cast<double>(s) / mesh.slab_count());
    }
  }
}

Status make_anew(const Model& model, Refined& result, const Progress& progress) {
  ConvertSettings settings;
  settings.slabs = static_cast<int>(model.head->slab_mesh().roots().size());
  settings.unit = model.info.unit;
  if (model.info.mode != Mode::Preview) settings.mode = model.info.mode;
  TriangleMesh surface = to_mesh(*model.head, 0, {.report = {}, .cancel = progress.cancel});
  if (progress.cancelled()) return detail::cancelled(detail::Work::Other);
  RELIEF_TRY(Conversion made, convert(std::move(surface), settings, progress));
  SnapshotDraft draft(made.model.head);
  bring_layers(*model.head, draft, progress);
  result.model.head = draft.finish();
  measure(*model.head, *result.model.head, result, progress);
  result.saturated_after = 0;  // as they are made
  return {};
}

}  // namespace

std::string_view name(RefineWhere where) noexcept { return kNames[static_cast<std::size_t>(where)]; }

std::optional<RefineWhere> refine_where_from_name(std::string_view text) noexcept {
  const auto found = std::ranges::find(kNames, text);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<RefineWhere>(found - kNames.begin());
}

Result<Refined> refine(const Model& model, RefineWhere where, const SnapshotPtr& as_made, const Progress& progress) {
  const Snapshot* const made = as_made.get();
  Refined result{.model = {model.info, nullptr}};
  // New slabs for what nobody has touched would only lose a little.
  if (where == RefineWhere::Model && made != nullptr && made->content_hash() == model.head->content_hash())
    return result;
  const std::vector<WornSample> worn = find_worn(*model.head, made, progress);
  if (progress.cancelled()) return detail::cancelled(detail::Work::Other);
  result.saturated_before = result.saturated_after = worn.size();
  switch (where) {
    case RefineWhere::Saturated:
      RELIEF_CHECK(make_room_where_saturated(model, worn, made, result, progress));
      break;
    case RefineWhere::All: {
      const Detail detail = twice_as_fine(*model.head, [](SlabId) { return true; }, true, kMaxIntervals);
      RELIEF_TRY(result.model.head, with_detail(model.head, detail));
      measure(*model.head, *result.model.head, result, progress);
      result.saturated_after = find_worn(*result.model.head, made, progress).size();
      break;
    }
    case RefineWhere::Model:
      RELIEF_CHECK(make_anew(model, result, progress));
      break;
  }
  if (progress.cancelled()) return detail::cancelled(detail::Work::Other);
  return result;
}

}  // namespace relief
