#include <relief/base/assert.h>
#include <relief/base/try.h>
#include <relief/convert/failures.h>
#include <relief/convert/room.h>
#include <relief/convert/room/fibre_lengthening.h>
#include <relief/convert/room/old_surface.h>
#include <relief/convert/room/reach_wanted.h>
#include <relief/convert/room/root_split.h>
#include <relief/convert/room/solids.h>
#include <relief/convert/room/surface_resampling.h>
#include <relief/convert/support/sort_unique.h>
#include <relief/convert/support/words.h>
#include <relief/core/model.h>
#include <relief/core/query.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <unordered_map>
#include <utility>

namespace relief {
namespace {

using namespace detail;

bool is_usable(const RoomWanted& wanted, const RoomGoals& goals) noexcept {
  const auto sound = [](std::span<const Capsule> capsules) {
    return std::ranges::all_of(capsules, [](const Capsule& c) {
      return is_finite(c.a) && is_finite(c.b) && is_finite(c.axis) && std::isfinite(c.radius) && c.radius > 0;
    });
  };
  return sound(wanted.cut) && sound(wanted.fill) && std::isfinite(goals.diagonal) && goals.diagonal > 0 &&
         std::isfinite(goals.margin) && std::isfinite(goals.longest) && goals.fade_share >= 0 && goals.fade_share < 1 &&
         std::isfinite(goals.fade_spacings);
}

/// Of the radius of a solid: by so much the surface beside it may move, half of what the tool itself may miss untold.
/// Both misses add up.
constexpr double kMoved = kBeside / 2;

/// Returns how far the surface may move beside what tools cut and fill, of the diagonal.
double may_move(const RoomWanted& wanted, const RoomGoals& goals) noexcept {
  double most = goals.most_moved;
  for (const auto* solids : {&wanted.cut, &wanted.fill})
    for (const Capsule& c : *solids) most = std::min(most, kMoved * c.radius / goals.diagonal);
  return most;
}

/// Returns the slabs whose roots have a moved fibre.
std::vector<SlabId> slabs_around(const SlabMesh& mesh, std::span<const MovedFibre> moved) {
  std::vector<std::uint8_t> has_moved(mesh.root_fibres().size());
  for (const MovedFibre& m : moved) has_moved[m.fibre] = 1;
  std::vector<SlabId> slabs;
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    if (std::ranges::any_of(mesh.roots()[mesh.root_place(s).root].fibres, [&](FibreId f) { return has_moved[f] != 0; }))
      slabs.push_back(s);
  return slabs;
}

Result<SlabMesh> with_fibres(const SlabMesh& mesh, std::span<const MovedFibre> moved) {
  std::vector<Fibre> fibres(mesh.root_fibres().begin(), mesh.root_fibres().end());
  for (const MovedFibre& m : moved) {
    if (m.fibre >= fibres.size()) return no_room(NoRoom::OtherCage);
    fibres[m.fibre] = m.now;
  }
  return mesh.with_root_fibres(std::move(fibres));
}

/// Returns the surface at the samples of the roots' own grids: enough to see what lacks where.
SnapshotPtr root_view(const Snapshot& surface) {
  const SlabMesh& mesh = surface.slab_mesh();
  std::vector<SlabMesh::Face> faces;
  for (const Slab& root : mesh.roots()) faces.push_back({root.fibres, root.intervals});
  const auto fibres = mesh.root_fibres();
  auto roots = SlabMesh::make({fibres.begin(), fibres.end()}, faces);
  RELIEF_ASSERT(roots.has_value());  // it was one before it was cut
  return Snapshot::make(std::make_shared<const SlabMesh>(*std::move(roots)), [&](SlabId root) {
    const int n = mesh.roots()[root].intervals;
    auto tile = std::make_shared<Tile>(Layer::Displacement, n, 0.0F);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) {
        std::array<double, 3> w = {double(n - i - j) / n, double(i) / n, double(j) / n};
        const SlabId s = mesh.descend(root, w);
        tile->set(0, sample_index(n, {i, j}), static_cast<float>(displacement_at(surface, s, w[1], w[2])));
      }
    return tile;
  });
}

/// The surface without detail: as it is where it has none.
class WithoutDetail {
 public:
  explicit WithoutDetail(const Snapshot& surface)
      : made_(surface.slab_mesh().has_detail() ? root_view(surface) : nullptr), surface_(made_ ? *made_ : surface) {}
  [[nodiscard]] const Snapshot& operator*() const noexcept { return surface_; }

 private:
  SnapshotPtr made_;
  const Snapshot& surface_;
};

/// A room, and what is lacking in it.
struct Attempt {
  RoomMade made;
  double lack = 0;       ///< as in Lengthened
  bool is_sound = true;  ///< as in Lengthened
};
/// `roots`: the surface without detail. `untested`: as in lengthen_for(). The surface is sampled only where what would
/// be lacking then is_worth() it.
Result<Attempt> room_by(RoomWay way, const Snapshot& surface, const Snapshot& roots, const RoomWanted& wanted,
                        const RoomGoals& goals, std::span<const FibreId> untested,
                        const std::function<bool(const Attempt&)>& is_worth, const Progress& progress) {
  // All begins again with less freedom for fibres along which the surface cannot be sampled.
  constexpr int kTries = 4;
  Restrained restrained;
  for (int tries = 1;; ++tries) {
    Attempt attempt;
    RoomMade& made = attempt.made;
    Lengthened longer = lengthen_for(roots, wanted, goals, way, restrained, untested, progress);
    if (progress.cancelled()) return cancelled(Work::Room);
    attempt.is_sound = longer.is_sound;
    made.before = std::move(longer.before);
    made.after = std::move(longer.after);
    made.on_lattice = longer.on_lattice;
    made.overhang_before = longer.overhang_before.wide;
    const Lengthened::Overhang& left = longer.moved.empty() ? longer.overhang_before : longer.overhang_after;
    made.overhang_after = left.wide;
    made.overhang_at = left.at;
    made.given_up = restrained.staying.size();
    attempt.lack = longer.moved.empty() ? longer.lack_before : longer.lack_after;
    if (longer.moved.empty() || !is_worth(attempt)) return attempt;
    RELIEF_TRY(const SlabMesh mesh, with_fibres(surface.slab_mesh(), longer.moved));
    const std::vector<SlabId> slabs = slabs_around(mesh, longer.moved);
    Resampled anew = resample(surface, mesh, longer, slabs, wanted, goals.most_moved * goals.diagonal, progress);
    if (progress.cancelled()) return cancelled(Work::Room);
    if (!anew.unmet.empty() && tries < kTries) {
      restrained.add(anew.unmet);
      continue;
    }
    if (!anew.unmet.empty()) {
      made.after = made.before;
      made.overhang_after = longer.overhang_before.wide;
      made.overhang_at = longer.overhang_before.at;
      made.given_up += longer.moved.size();
      attempt.lack = longer.lack_before;
      return attempt;
    }
    made.moved = std::move(longer.moved);
    made.tiles = std::move(anew.tiles);
    made.lengthened = longer.lengthened;
    made.turned = longer.turned;
    made.sampled = std::move(anew.sampled);
    made.surface_moved = anew.moved_most;
    return attempt;
  }
}

/// Returns how far a tool is off somewhere, at most.
double worst(const RoomMade& made) noexcept {
  double most = made.overhang_after;
  for (const RoomLack& lack : made.after) most = std::max(most, lack.lack);
  return most;
}

bool is_enough(const RoomMade& made, const RoomGoals& goals) noexcept {
  return made.after.empty() && made.overhang_after <= Room::kLeastOverhang * goals.diagonal;
}

/// Room between the roots that there are.
Result<RoomMade> room_between_roots(const Snapshot& surface, const RoomWanted& wanted, const RoomGoals& goals,
                                    const Progress& progress) {
  const WithoutDetail roots(surface);
  const auto always = [](const Attempt&) { return true; };
  RELIEF_TRY(Attempt first, room_by(RoomWay::Grow, surface, *roots, wanted, goals, {}, always, progress));
  if (is_enough(first.made, goals) || !first.made.on_lattice) return std::move(first.made);
  const auto lacks_less = [&](const Attempt& second) { return second.lack < first.lack; };
  RELIEF_TRY(Attempt second, room_by(RoomWay::Shrink, surface, *roots, wanted, goals, {}, lacks_less, progress));
  return std::move(second.lack < first.lack ? second.made : first.made);
}

/// Room between halves of these; nothing has moved where there are none that hold.
Result<RoomMade> room_between_halves(const Snapshot& surface, const RoomWanted& wanted, RoomGoals goals,
                                     const Progress& progress) {
  const std::optional<SplitRoots> split = split_roots(surface, wanted, progress);
  if (progress.cancelled()) return cancelled(Work::Room);
  if (!split) return RoomMade{};
  // What halving has moved already may not be moved again.
  goals.most_moved -= split->surface_moved / goals.diagonal;
  if (!(goals.most_moved > 0)) return RoomMade{};
  const WithoutDetail roots(*split->model);
  // Halves that do not give all are of no use to the caller.
  const auto gives_all = [](const Attempt& all) { return all.made.after.empty(); };
  RELIEF_TRY(Attempt attempt,
             room_by(RoomWay::Shrink, *split->model, *roots, wanted, goals, split->fibres, gives_all, progress));
  if (!attempt.is_sound || attempt.made.moved.empty()) return RoomMade{};
  attempt.made.split = split->model;
  attempt.made.halved = split->halved;
  attempt.made.surface_moved += split->surface_moved;
  return std::move(attempt.made);
}

}  // namespace

Result<RoomMade> make_room(const Snapshot& surface, const RoomWanted& wanted, const RoomGoals& goals,
                           const Progress& progress) {
  if (!is_usable(wanted, goals)) return no_room(NoRoom::NoNumbers);
  RoomGoals within = goals;
  if (goals.for_tools) within.most_moved = may_move(wanted, goals);
  RELIEF_TRY(RoomMade made, room_between_roots(surface, wanted, within, progress));
  // Whoever wants room asks again while there is some. Nobody gets other slabs unless they give all that is lacking: in
  // a thin wall they could not. What hangs over is cut, and told.
  if (!made.moved.empty() || made.after.empty() || !made.on_lattice) return made;
  RELIEF_TRY(RoomMade finer, room_between_halves(surface, wanted, within, progress));
  const bool is_reached = !finer.moved.empty() && finer.after.empty() && worst(finer) < worst(made);
  if (is_reached) finer.before = std::move(made.before);
  return std::move(is_reached ? finer : made);
}

Result<SnapshotPtr> with_room(const SnapshotPtr& surface, const RoomMade& made) {
  if (made.moved.empty()) return surface;
  const Snapshot& before = made.split ? *made.split : *surface;
  RELIEF_TRY(SlabMesh mesh, with_fibres(before.slab_mesh(), made.moved));
  const auto shared = std::make_shared<const SlabMesh>(std::move(mesh));
  std::array<std::unordered_map<SlabId, TilePtr>, kLayerCount> fresh;
  for (const MovedTile& t : made.tiles) {
    if (t.slab >= shared->slab_count() || !before.has(t.layer) || !t.tile->same_shape(before.tile(t.layer, t.slab)))
      return no_room(NoRoom::OtherModel);
    fresh[static_cast<std::size_t>(t.layer)][t.slab] = t.tile;
  }
  return Snapshot::with_cage(before, shared, [&](Layer layer) {
    std::vector<TilePtr> tiles;
    for (SlabId s = 0; s < shared->slab_count(); ++s) tiles.push_back(before.shared_tile(layer, s));
    for (const auto& [s, tile] : fresh[static_cast<std::size_t>(layer)]) tiles[s] = tile;
    return tiles;
  });
}

RoomMaker room_maker(double source_diagonal) {
  return [source_diagonal](const SnapshotPtr& surface, const RoomWanted& wanted,
                           const Progress& progress) -> Result<Room> {
    ModelInfo info;
    info.source_diagonal = source_diagonal;
    const double diagonal = relief::source_diagonal({.info = info, .head = surface});
    const RoomGoals goals = {.diagonal = diagonal};
    RELIEF_TRY(const RoomMade made, make_room(*surface, wanted, goals, progress));
    Room room;
    room.fibres = made.moved.size();
    room.lacking = made.after.size();
    room.surface_moved = made.surface_moved;
    const RoomBarred barred = room_barred(*surface, wanted, made, goals);
    room.bar = barred.by;
    room.bar_distance = barred.distance;
    room.bar_at = barred.at;
    if (made.overhang_after > Room::kLeastOverhang * diagonal) {
      room.overhang = made.overhang_after;
      room.overhang_at = made.overhang_at;
    }
    room.sampled = made.sampled;
    room.halved = made.halved;
    if (!made.moved.empty()) {
      RELIEF_TRY(room.model, with_room(surface, made));
    }
    return room;
  };
}

}  // namespace relief
