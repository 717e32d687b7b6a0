#include <relief/base/assert.h>
#include <relief/base/steps.h>
#include <relief/base/try.h>
#include <relief/convert/convert.h>
#include <relief/convert/refine.h>
#include <relief/convert/room.h>
#include <relief/core/detail.h>
#include <relief/core/query.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>

namespace relief {

namespace {

constexpr std::array<std::string_view, 3> kNames = {"saturated", "all", "model"};

std::size_t saturated(const Snapshot& model, SlabId s) {
  const float* alpha = model.displacement(s);
  const auto count = sample_count(model.slab_mesh().intervals(s));
  return static_cast<std::size_t>(std::count_if(alpha, alpha + count, [](float a) { return a <= 0 || a >= 1; }));
}

std::size_t saturated(const Snapshot& model) {
  std::size_t sum = 0;
  for (SlabId s = 0; s < model.slab_mesh().slab_count(); ++s) sum += saturated(model, s);
  return sum;
}

/// Distances between two surfaces.
struct Distances {
  double most = 0, squares = 0;
  std::size_t count = 0;
};
/// Adds how far the samples of one surface lie from another.
void add_distances(const Snapshot& of, const Snapshot& from, Distances& found, const Progress& progress) {
  const SlabMesh& mesh = of.slab_mesh();
  PickHint hint;
  for (SlabId s = 0; s < mesh.slab_count() && !progress.cancelled(); ++s) {
    const int n = mesh.intervals(s), step = std::max(1, n / 32);
    for (int j = 0; j <= n; j += step)
      for (int i = 0; i + j <= n; i += step) {
        const Vec3d p = sample_position(of, s, {i, j});
        const SurfacePoint near = closest_point(from, p, hint);
        if (near.slab == kNoSlab) continue;
        const double off = length(near.position - p);
        found.squares += off * off;
        ++found.count;
        found.most = std::max(found.most, off);
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

/// One solid for each end of the fibres of a slab that has run out there, as wide as what has.
void want_room(const Snapshot& model, SlabId s, double diagonal, RoomWanted& wanted) {
  const SlabMesh& mesh = model.slab_mesh();
  const int n = mesh.intervals(s);
  const SlabCorners corners = mesh.corners(s);
  const Vec3d out = normalized(corners.fibre(0) + corners.fibre(1) + corners.fibre(2));
  for (const bool below : {true, false}) {
    Box3d box;
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) {
        const float alpha = model.displacement(s)[sample_index(n, {i, j})];
        if (below ? alpha <= 0 : alpha >= 1) box.add(sample_position(model, s, {i, j}));
      }
    if (box.empty()) continue;
    const double radius = std::max(length(box.extent()) / 2, 1e-3 * diagonal);
    const Vec3d way = out * (std::max(kClayWanted * diagonal - radius, 0.0) * (below ? -1 : 1));
    (below ? wanted.cut : wanted.fill).push_back({box.centre(), box.centre() + way, radius, out});
  }
}

Status make_room_where_saturated(const Model& model, double diagonal, Refined& result, const Progress& progress) {
  RoomWanted wanted;
  for (SlabId s = 0; s < model.head->slab_mesh().slab_count(); ++s)
    if (static_cast<double>(saturated(*model.head, s)) >
        kSaturatedShare * static_cast<double>(sample_count(model.head->slab_mesh().intervals(s))))
      want_room(*model.head, s, diagonal, wanted);
  if (wanted.empty()) return {};
  RELIEF_TRY(const RoomMade made, make_room(*model.head, wanted, {.diagonal = diagonal}, progress));
  result.fibres_moved = made.moved.size();
  result.fibres_lacking = made.after.size();
  if (made.moved.empty()) return {};
  RELIEF_TRY(result.model.head, with_room(model.head, made));
  measure(*model.head, *result.model.head, result, progress);
  return {};
}

// ---- All

/// Returns whether a grid of twice as many intervals, cut in four if those are too many for one tile, is available.
bool can_double(int n) noexcept { return 2 * n <= kMaxIntervals || n % 2 == 0; }

/// Slabs that must be cut because they lie beside one that is cut and is finer already.
void add_coarser(const SlabMesh& mesh, SlabId s, std::vector<std::uint8_t>& cuts) {
  if (std::exchange(cuts[s], 1) != 0) return;
  for (std::size_t k = 0; k < 3; ++k)
    if (is_half(mesh.slabs()[s].shares[k])) add_coarser(mesh, mesh.slabs()[s].neighbours[k], cuts);
}

/// Twice the samples along every edge, in every layer.
Detail twice_as_fine(const Snapshot& model, std::size_t& left) {
  const SlabMesh& mesh = model.slab_mesh();
  std::vector<std::uint8_t> cuts(mesh.slab_count());
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    for (int k = 0; k < kLayerCount; ++k) {
      const auto layer = static_cast<Layer>(k);
      if (!model.has(layer)) continue;
      const int n = model.intervals(layer, s);
      if (2 * n > kMaxIntervals && n % 2 == 0) add_coarser(mesh, s, cuts);
    }
  Detail detail;
  const auto want = [&](SlabId from, SlabId s, bool is_child) {
    for (int k = 0; k < kLayerCount; ++k) {
      const auto layer = static_cast<Layer>(k);
      if (!model.has(layer)) continue;
      const int n = model.intervals(layer, from);
      const bool halves = is_child && n % 2 == 0;
      if (halves || 2 * n <= kMaxIntervals) detail.grids.push_back({layer, s, halves ? n : 2 * n});
    }
  };
  SlabId next = mesh.slab_count();
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    if (!can_double(mesh.intervals(s))) ++left;
    want(s, s, cuts[s] != 0);
    if (cuts[s] == 0) continue;
    detail.cuts.push_back(s);
    for (int child = 0; child < 3; ++child) want(s, next++, true);
  }
  return detail;
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
  if (progress.cancelled()) return fail(Errc::Cancelled, "the work was cancelled");
  RELIEF_TRY(Conversion made, convert(std::move(surface), settings, progress));
  SnapshotDraft draft(made.model.head);
  bring_layers(*model.head, draft, progress);
  result.model.head = draft.finish();
  measure(*model.head, *result.model.head, result, progress);
  return {};
}

}  // namespace

std::string_view name(RefineWhere where) noexcept { return kNames[static_cast<std::size_t>(where)]; }

std::optional<RefineWhere> refine_where_from_name(std::string_view text) noexcept {
  const auto found = std::ranges::find(kNames, text);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<RefineWhere>(found - kNames.begin());
}

Result<Refined> refine(const Model& model, RefineWhere where, const Progress& progress) {
  Refined result{.model = {model.info, nullptr}};
  result.saturated_before = result.saturated_after = saturated(*model.head);
  const double diagonal = source_diagonal(model);
  switch (where) {
    case RefineWhere::Saturated:
      RELIEF_CHECK(make_room_where_saturated(model, diagonal, result, progress));
      break;
    case RefineWhere::All: {
      const Detail detail = twice_as_fine(*model.head, result.slabs_left);
      if (detail.empty()) break;
      RELIEF_TRY(result.model.head, with_detail(model.head, detail));
      break;
    }
    case RefineWhere::Model:
      RELIEF_CHECK(make_anew(model, result, progress));
      break;
  }
  if (progress.cancelled()) return fail(Errc::Cancelled, "cancelled");
  if (result.model.head) result.saturated_after = saturated(*result.model.head);
  return result;
}

}  // namespace relief
