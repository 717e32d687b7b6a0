#include <relief/base/free_memory.h>
#include <relief/convert/cells.h>
#include <relief/convert/parallel.h>
#include <relief/convert/reducer.h>
#include <relief/convert/sort_unique.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <numeric>
#include <thread>
#include <utility>

namespace relief::detail {
namespace {

constexpr std::size_t kCell = 24000;   // slabs
constexpr std::size_t kWhole = 60000;  // slabs that are reduced without cells
constexpr std::size_t kBeforeQueue = 12000;

/// What has become of a cage that starts as the source's own triangles, whose numbers it has at first.
struct Whole {
  std::vector<Face> faces;  // corners kNone: gone
  std::vector<Ends> ends;
  std::vector<std::uint32_t> part;  // per face; empty: there is one
  CageDraft rest;                   // all else, once it is other than the source's; without faces, parts and ends

  [[nodiscard]] bool is_source() const noexcept { return rest.at.empty(); }
  [[nodiscard]] Box3d box(std::uint32_t f) const noexcept {
    Box3d box;
    for (const std::uint32_t v : faces[f])
      for (const LatticePoint p : ends[v]) box.add(to_double(p));
    return box;
  }
  [[nodiscard]] Vec3d centre(const OrderedSource& source, std::uint32_t f) const noexcept {
    Vec3d sum;
    for (const std::uint32_t v : faces[f]) sum += is_source() ? to_double(source.points[v]) : rest.at[v];
    return sum / 3.0;
  }
};

/// Adds the plane of a source triangle to the quadric of one of its corners.
void add_plane(const OrderedSource& source, std::uint32_t t, Quadric& quadric) {
  const Vec3d n = source.cross_of(t);
  const double size = length(n);
  if (size > 0) quadric.add_plane(n / size, to_double(source.points[source.faces[t][0]]), size / 6);
}

/// Some slabs of a cage, with numbers of their own.
struct Members {
  CageDraft cage;
  std::vector<std::uint32_t> faces, fibres;  // numbers in the whole

  Members(const OrderedSource& source, const Whole& whole, std::vector<std::uint32_t>&& members)
      : faces(std::move(members)) {
    fibres.reserve(3 * faces.size());
    for (const std::uint32_t f : faces) fibres.insert(fibres.end(), whole.faces[f].begin(), whole.faces[f].end());
    sort_unique(fibres);
    cage.ends.reserve(fibres.size());
    cage.at.reserve(fibres.size());
    cage.quadrics.reserve(fibres.size());
    cage.faces.reserve(faces.size());
    if (!whole.part.empty()) cage.part.reserve(faces.size());
    cage.from.reserve(faces.size());
    cage.lists.reserve(faces.size());
    for (const std::uint32_t v : fibres) {
      cage.ends.push_back(whole.ends[v]);
      cage.at.push_back(whole.is_source() ? to_double(source.points[v]) : whole.rest.at[v]);
      cage.quadrics.push_back(whole.is_source() ? Quadric{} : whole.rest.quadrics[v]);
    }
    for (const std::uint32_t f : faces) {
      Face face{};
      for (std::size_t k = 0; k < 3; ++k) {
        face[k] = static_cast<std::uint32_t>(std::lower_bound(fibres.begin(), fibres.end(), whole.faces[f][k]) -
                                             fibres.begin());
        if (whole.is_source()) add_plane(source, f, cage.quadrics[face[k]]);
      }
      cage.faces.push_back(face);
      if (!whole.part.empty()) cage.part.push_back(whole.part[f]);
      cage.from.push_back(whole.is_source() ? f : whole.rest.from[f]);
      const std::span<const Entry> list = whole.is_source() ? std::span<const Entry>() : whole.rest.list(f);
      cage.lists.push_back({static_cast<std::uint32_t>(cage.pool.size()), static_cast<std::uint32_t>(list.size())});
      cage.pool.insert(cage.pool.end(), list.begin(), list.end());
    }
  }
};

/// What is new about fibres and slabs of members of a cage, of those that still stand.
struct Changes {
  std::vector<std::uint32_t> fibres, faces;  // numbers in the whole
  std::vector<Vec3d> at;
  std::vector<Quadric> quadrics;
  std::vector<CageDraft::List> lists;
  std::vector<Entry> pool;
};

/// Puts faces and ends back into the whole, and gives the rest.
Changes put_back(Whole& whole, const Members& members, const SlabReducer& reducer) {
  Changes changes;
  const CageDraft& cage = reducer.cage();
  std::vector<std::uint8_t> stands(members.fibres.size(), 0);
  for (std::uint32_t f = 0; f < members.faces.size(); ++f) {
    Face& face = whole.faces[members.faces[f]];
    const Face& mine = cage.faces[f];
    if (!cage.alive(f)) {
      face = mine;
      continue;
    }
    for (const std::uint32_t v : mine) stands[v] = 1;
    if (!reducer.has_changed(mine[0]) && !reducer.has_changed(mine[1]) && !reducer.has_changed(mine[2])) continue;
    for (std::size_t k = 0; k < 3; ++k) face[k] = members.fibres[mine[k]];
    const std::span<const Entry> list = cage.list(f);
    changes.faces.push_back(members.faces[f]);
    changes.lists.push_back({static_cast<std::uint32_t>(changes.pool.size()), static_cast<std::uint32_t>(list.size())});
    changes.pool.insert(changes.pool.end(), list.begin(), list.end());
  }
  for (std::uint32_t v = 0; v < members.fibres.size(); ++v) {
    if (!reducer.has_changed(v) || stands[v] == 0) continue;
    whole.ends[members.fibres[v]] = cage.ends[v];
    changes.fibres.push_back(members.fibres[v]);
    changes.at.push_back(cage.at[v]);
    changes.quadrics.push_back(cage.quadrics[v]);
  }
  // They wait until all cells are ready.
  changes.pool.shrink_to_fit();
  changes.quadrics.shrink_to_fit();
  changes.at.shrink_to_fit();
  return changes;
}

/// Leaves out what is gone, and puts in what is new. Fibres are numbered as slabs first name them.
void compact(const OrderedSource& source, Whole& whole, const std::vector<Changes>& changed) {
  struct Place {
    std::uint32_t in = kNone, index = 0;
  };
  std::vector<Place> face_places(whole.faces.size()), fibre_places(whole.ends.size());
  for (std::uint32_t c = 0; c < changed.size(); ++c) {
    for (std::uint32_t k = 0; k < changed[c].faces.size(); ++k) face_places[changed[c].faces[k]] = {c, k};
    for (std::uint32_t k = 0; k < changed[c].fibres.size(); ++k) fibre_places[changed[c].fibres[k]] = {c, k};
  }
  const bool was_source = whole.is_source();
  std::vector<std::uint32_t> number(whole.ends.size(), kNone), from;
  std::vector<CageDraft::List> lists;
  std::vector<Entry> pool;
  const auto left = static_cast<std::size_t>(
      std::count_if(whole.faces.begin(), whole.faces.end(), [](const Face& face) { return face[0] != kNone; }));
  from.reserve(left);
  lists.reserve(left);
  std::uint32_t fibres = 0;
  std::size_t faces = 0;
  for (std::uint32_t f = 0; f < whole.faces.size(); ++f) {
    if (whole.faces[f][0] == kNone) continue;
    for (std::uint32_t& v : whole.faces[f]) {
      if (number[v] == kNone) number[v] = fibres++;
      v = number[v];
    }
    std::span<const Entry> list;
    const Place place = face_places[f];
    if (place.in != kNone) {
      const CageDraft::List at = changed[place.in].lists[place.index];
      list = std::span(changed[place.in].pool).subspan(at.begin, at.count);
    } else if (!was_source) {
      list = whole.rest.list(f);
    }
    from.push_back(place.in != kNone ? kNone : was_source ? f : whole.rest.from[f]);
    lists.push_back({static_cast<std::uint32_t>(pool.size()), static_cast<std::uint32_t>(list.size())});
    pool.insert(pool.end(), list.begin(), list.end());
    if (!whole.part.empty()) whole.part[faces] = whole.part[f];
    whole.faces[faces++] = whole.faces[f];
  }
  whole.faces.resize(faces);
  whole.faces.shrink_to_fit();
  if (!whole.part.empty()) whole.part.resize(faces);
  whole.part.shrink_to_fit();
  free_memory(face_places);
  pool.shrink_to_fit();
  whole.rest.from = std::move(from);
  whole.rest.lists = std::move(lists);
  whole.rest.pool = std::move(pool);

  const auto renumber = [&](auto& values, auto&& value) {
    std::remove_reference_t<decltype(values)> kept(fibres);
    for (std::uint32_t v = 0; v < number.size(); ++v)
      if (number[v] != kNone) kept[number[v]] = value(v, fibre_places[v]);
    values = std::move(kept);
  };
  renumber(whole.ends, [&](std::uint32_t v, Place) { return whole.ends[v]; });
  renumber(whole.rest.at, [&](std::uint32_t v, Place place) {
    if (place.in != kNone) return changed[place.in].at[place.index];
    return was_source ? to_double(source.points[v]) : whole.rest.at[v];
  });
  renumber(whole.rest.quadrics, [&](std::uint32_t v, Place place) {
    if (place.in != kNone) return changed[place.in].quadrics[place.index];
    return was_source ? Quadric{} : whole.rest.quadrics[v];
  });
  // Fibres that no cell has changed have the quadrics of the source's triangles around them.
  if (was_source)
    for (std::uint32_t t = 0; t < source.faces.size(); ++t)
      for (const std::uint32_t v : source.faces[t])
        if (number[v] != kNone && fibre_places[v].in == kNone) add_plane(source, t, whole.rest.quadrics[number[v]]);
}

/// All that a cage is, which is of no more use then.
CageDraft take_all(const OrderedSource& source, Whole&& whole) {
  const bool was_source = whole.is_source();
  CageDraft cage = std::move(whole.rest);
  cage.faces = std::move(whole.faces);
  cage.ends = std::move(whole.ends);
  cage.part = std::move(whole.part);
  if (!was_source) return cage;
  cage.at.reserve(source.points.size());
  for (const LatticePoint p : source.points) cage.at.push_back(to_double(p));
  cage.quadrics.resize(source.points.size());
  for (std::uint32_t t = 0; t < source.faces.size(); ++t)
    for (const std::uint32_t v : source.faces[t]) add_plane(source, t, cage.quadrics[v]);
  cage.lists.resize(cage.faces.size());
  cage.from.resize(cage.faces.size());
  std::iota(cage.from.begin(), cage.from.end(), 0U);
  return cage;
}

bool reduce_in_cells(const OrderedSource& source, const BoxTree& tree, double longest, std::size_t goal, int level,
                     Whole& whole, const Progress& progress) {
  const auto count = static_cast<std::uint32_t>(whole.faces.size());
  // A choice of the slabs cuts space; each time in other places.
  constexpr std::uint32_t kStride = 16;
  std::vector<Vec3d> sample;
  sample.reserve(count / kStride + 1);
  for (std::uint32_t f = 0; f < count; f += kStride) sample.push_back(whole.centre(source, f));
  const Cells cells(sample, kCell / kStride, level % 2 == 0 ? 0.5 : 0.4);
  std::vector<std::vector<std::uint32_t>> members(cells.count());
  for (std::uint32_t f = 0; f < count; ++f)
    cells.for_each(whole.box(f), [&](std::uint32_t c) { members[c].push_back(f); });

  std::vector<Changes> changed(cells.count());
  const double share = double(goal) / double(count);
  const Progress quiet = {.report = {}, .cancel = progress.cancel};
  const auto caller = std::this_thread::get_id();
  std::atomic<std::size_t> ready = 0;
  const bool done = for_all(cells.count(), 1, progress, [&](std::size_t c) {
    Members mine(source, whole, std::move(members[c]));
    SlabReducer reducer(source, tree, longest, std::move(mine.cage), cells.box(c), quiet);
    const std::size_t fixed = reducer.slab_count() - reducer.free_count();
    if (!reducer.sweep(fixed + static_cast<std::size_t>(share * double(reducer.free_count())), quiet)) return;
    changed[c] = put_back(whole, mine, reducer);
    const std::size_t finished = ++ready;
    if (std::this_thread::get_id() == caller && level == 0)
      progress("reduce", 0.6 * double(finished) / double(cells.count()));
  });
  if (!done) return false;
  compact(source, whole, changed);
  return true;
}

}  // namespace

bool Reducer::reduce(const Progress& progress) {
  Whole whole;
  whole.faces = source_.faces;
  whole.ends = std::move(ends_);
  if (Parts parts = find_parts(source_.points.size(), source_.faces); parts.count > 1)
    whole.part = std::move(parts.of_face);
  const std::size_t stop = std::max(kBeforeQueue, 8 * target_);
  for (int level = 0; whole.faces.size() > std::max(kWhole, 2 * stop); ++level) {
    const std::size_t before = whole.faces.size();
    if (!reduce_in_cells(source_, *tree_, longest_, std::max(stop, before / 12), level, whole, progress)) return false;
    if (10 * whole.faces.size() > 5 * before) break;  // the rest resists: patience takes it in less time
  }
  Box3d everywhere;
  everywhere.low = {-Box3d::kFar, -Box3d::kFar, -Box3d::kFar};
  everywhere.high = {Box3d::kFar, Box3d::kFar, Box3d::kFar};
  last_ = std::make_unique<SlabReducer>(source_, *tree_, longest_, take_all(source_, std::move(whole)), everywhere,
                                        progress);
  tree_.reset();
  return last_->sweep(stop, progress) && last_->reduce(target_, progress);
}

Shell Reducer::shell() && {
  Shell shell;
  shell.faces.reserve(slab_count());
  shell.from.reserve(slab_count());
  CageDraft cage = std::move(*last_).take_cage();
  last_.reset();
  free_memory(cage.lists, cage.pool);
  std::vector<std::uint32_t> number(cage.ends.size(), kNone);
  for (const Side side : {kInner, kOuter}) shell.ends[side].reserve(cage.ends.size());
  for (std::uint32_t f = 0; f < cage.faces.size(); ++f) {
    if (!cage.alive(f)) continue;
    Face face{};
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& n = number[cage.faces[f][k]];
      if (n == kNone) {
        n = static_cast<std::uint32_t>(shell.ends[kInner].size());
        for (const Side side : {kInner, kOuter}) shell.ends[side].push_back(cage.ends[cage.faces[f][k]][side]);
      }
      face[k] = n;
    }
    shell.from.push_back(static_cast<std::uint32_t>(shell.faces.size()));
    shell.faces.push_back(face);
  }
  return shell;
}

}  // namespace relief::detail
