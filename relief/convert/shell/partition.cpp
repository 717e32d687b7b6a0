#include <relief/base/free_memory.h>
#include <relief/convert/shell/kd_partition.h>
#include <relief/convert/shell/partition.h>
#include <relief/convert/support/parallel.h>
#include <relief/convert/support/sort_unique.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <numeric>
#include <thread>
#include <utility>

namespace relief::detail {
namespace {

/// Slabs to a cell: with its lists that fits into the caches.
constexpr std::size_t kCell = 24000;
/// Slabs that are reduced without cells: so few cells do not pay.
constexpr std::size_t kWhole = 60000;
/// Where sweeps end and collapses by cost begin: slabs, or times the target. Below it the order matters.
constexpr std::size_t kBeforeQueue = 12000, kBeforeQueueTargets = 8;
/// A level of cells makes slabs fewer by this factor at most, so that those near the cuts keep up.
constexpr std::size_t kLevelFactor = 12;
/// One that leaves more than this share was the last: the rest resists, and patience takes it in less time.
constexpr double kResists = 0.5;
/// Of the slabs, one in so many decides where cells are cut, and the shares of them on a cut's lower side, by turns: so
/// the next level's cuts lie elsewhere.
constexpr std::uint32_t kCutStride = 16;
constexpr std::array<double, 2> kCutShares = {0.5, 0.4};

/// Holds what has become of a draft that starts as the source's own triangles, whose numbers it has at first.
struct Whole {
  std::vector<Face> faces;  // corners kNone: gone
  std::vector<Ends> ends;
  std::vector<std::uint32_t> component;  // per face; empty: there is one
  ShellDraft rest;  // all else, once it is other than the source's; without faces, components and ends

  [[nodiscard]] bool is_source() const noexcept { return rest.at.empty(); }
  [[nodiscard]] std::span<const TriangleReference> list(std::uint32_t f) const noexcept {
    return is_source() ? std::span<const TriangleReference>() : rest.lists.of(f);
  }
  [[nodiscard]] Box3d box(std::uint32_t f) const noexcept {
    Box3d box;
    for (const std::uint32_t v : faces[f])
      for (const LatticePoint p : ends[v]) box.add(to_double(p));
    return box;
  }
  [[nodiscard]] Vec3d centre(const SourceIndex& source, std::uint32_t f) const noexcept {
    Vec3d sum;
    for (const std::uint32_t v : faces[f]) sum += is_source() ? to_double(source.points[v]) : rest.at[v];
    return sum / 3.0;
  }
};

/// Some slabs of a draft, with numbers of their own.
struct Members {
  ShellDraft draft;
  std::vector<std::uint32_t> faces, fibres;  // numbers in the whole

  Members(const SourceIndex& source, const Whole& whole, std::vector<std::uint32_t>&& members)
      : faces(std::move(members)) {
    fibres.reserve(3 * faces.size());
    for (const std::uint32_t f : faces) fibres.insert(fibres.end(), whole.faces[f].begin(), whole.faces[f].end());
    sort_unique(fibres);
    draft.ends.reserve(fibres.size());
    draft.at.reserve(fibres.size());
    draft.quadrics.reserve(fibres.size());
    draft.faces.reserve(faces.size());
    if (!whole.component.empty()) draft.component.reserve(faces.size());
    draft.from.reserve(faces.size());
    draft.lists.reserve(faces.size());
    for (const std::uint32_t v : fibres) {
      draft.ends.push_back(whole.ends[v]);
      draft.at.push_back(whole.is_source() ? to_double(source.points[v]) : whole.rest.at[v]);
      draft.quadrics.push_back(whole.is_source() ? Quadric{} : whole.rest.quadrics[v]);
    }
    for (const std::uint32_t f : faces) {
      Face face{};
      for (std::size_t k = 0; k < 3; ++k) {
        face[k] = static_cast<std::uint32_t>(std::lower_bound(fibres.begin(), fibres.end(), whole.faces[f][k]) -
                                             fibres.begin());
        if (whole.is_source()) add_plane(source, f, draft.quadrics[face[k]]);
      }
      draft.faces.push_back(face);
      if (!whole.component.empty()) draft.component.push_back(whole.component[f]);
      draft.from.push_back(whole.is_source() ? f : whole.rest.from[f]);
      draft.lists.append(whole.list(f));
    }
  }
};

/// Holds what is new about fibres and slabs of members of a draft, of those that still stand.
struct Changes {
  std::vector<std::uint32_t> fibres, faces;  // numbers in the whole
  std::vector<Vec3d> at;
  std::vector<Quadric> quadrics;
  ReferenceLists lists;
};

/// Puts faces and ends back into the whole, and gives the rest.
Changes put_back(Whole& whole, const Members& members, const Coarsening& coarsening) {
  Changes changes;
  const LinkedDraft& draft = coarsening.draft();
  std::vector<std::uint8_t> stands(members.fibres.size(), 0);
  for (std::uint32_t f = 0; f < members.faces.size(); ++f) {
    Face& face = whole.faces[members.faces[f]];
    const Face& mine = draft.faces[f];
    if (!draft.alive(f)) {
      face = mine;
      continue;
    }
    for (const std::uint32_t v : mine) stands[v] = 1;
    if (!coarsening.has_changed(mine[0]) && !coarsening.has_changed(mine[1]) && !coarsening.has_changed(mine[2]))
      continue;
    for (std::size_t k = 0; k < 3; ++k) face[k] = members.fibres[mine[k]];
    changes.faces.push_back(members.faces[f]);
    changes.lists.append(draft.lists.of(f));
  }
  for (std::uint32_t v = 0; v < members.fibres.size(); ++v) {
    if (!coarsening.has_changed(v) || stands[v] == 0) continue;
    whole.ends[members.fibres[v]] = draft.ends[v];
    changes.fibres.push_back(members.fibres[v]);
    changes.at.push_back(draft.at[v]);
    changes.quadrics.push_back(draft.quadrics[v]);
  }
  // They wait until all cells are ready.
  changes.lists.shrink_to_fit();
  changes.quadrics.shrink_to_fit();
  changes.at.shrink_to_fit();
  return changes;
}

/// Leaves out what is gone, and puts in what is new. Fibres are numbered as slabs first name them.
void compact(const SourceIndex& source, Whole& whole, const std::vector<Changes>& changed) {
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
  ReferenceLists lists;
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
    const Place place = face_places[f];
    from.push_back(place.in != kNone ? kNone : was_source ? f : whole.rest.from[f]);
    lists.append(place.in != kNone ? changed[place.in].lists.of(place.index) : whole.list(f));
    if (!whole.component.empty()) whole.component[faces] = whole.component[f];
    whole.faces[faces++] = whole.faces[f];
  }
  whole.faces.resize(faces);
  whole.faces.shrink_to_fit();
  if (!whole.component.empty()) whole.component.resize(faces);
  whole.component.shrink_to_fit();
  free_memory(face_places);
  lists.shrink_to_fit();
  whole.rest.from = std::move(from);
  whole.rest.lists = std::move(lists);

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

/// Returns all that a draft is, which is of no more use then.
ShellDraft take_all(const SourceIndex& source, Whole&& whole) {
  if (whole.is_source()) return finest_draft(source, std::move(whole.ends), std::move(whole.component));
  ShellDraft draft = std::move(whole.rest);
  draft.faces = std::move(whole.faces);
  draft.ends = std::move(whole.ends);
  draft.component = std::move(whole.component);
  return draft;
}

bool reduce_in_cells(const SourceIndex& source, const Creases& creases, const BoxTree& tree, double longest,
                     std::size_t goal, int level, Whole& whole, const Progress& progress) {
  const auto count = static_cast<std::uint32_t>(whole.faces.size());
  std::vector<Vec3d> sample;
  sample.reserve(count / kCutStride + 1);
  for (std::uint32_t f = 0; f < count; f += kCutStride) sample.push_back(whole.centre(source, f));
  const KdPartition cells(sample, kCell / kCutStride, kCutShares[static_cast<std::size_t>(level % 2)]);
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
    Coarsening coarsening(source, tree, longest, std::move(mine.draft), cells.box(c), quiet);
    coarsening.follow(creases);
    const std::size_t fixed = coarsening.slab_count() - coarsening.free_count();
    if (!coarsening.sweep(fixed + static_cast<std::size_t>(share * double(coarsening.free_count())), quiet)) return;
    changed[c] = put_back(whole, mine, coarsening);
    const std::size_t finished = ++ready;
    if (std::this_thread::get_id() == caller && level == 0)
      progress("reduce", kCellsSwept * double(finished) / double(cells.count()));
  });
  if (!done) return false;
  compact(source, whole, changed);
  return true;
}

}  // namespace

bool Partition::reduce(const Progress& progress) {
  Whole whole;
  whole.faces = source_.faces;
  whole.ends = std::move(ends_);
  if (Components components = find_components(source_.points.size(), source_.faces); components.count > 1)
    whole.component = std::move(components.of_face);
  const std::size_t stop = std::max(kBeforeQueue, kBeforeQueueTargets * target_);
  for (int level = 0; whole.faces.size() > std::max(kWhole, 2 * stop); ++level) {
    const std::size_t before = whole.faces.size();
    if (!reduce_in_cells(source_, creases_, *tree_, longest_, std::max(stop, before / kLevelFactor), level, whole,
                         progress))
      return false;
    if (double(whole.faces.size()) > kResists * double(before)) break;
  }
  last_ = std::make_unique<Coarsening>(source_, *tree_, longest_, take_all(source_, std::move(whole)), everywhere(),
                                       progress);
  last_->follow(creases_);
  tree_.reset();
  return last_->sweep(stop, progress) && last_->reduce(target_, progress);
}

Shell Partition::shell() && {
  Shell shell;
  shell.faces.reserve(slab_count());
  ShellDraft draft = std::move(*last_).take_draft();
  last_.reset();
  draft.lists = {};
  std::vector<std::uint32_t> number(draft.ends.size(), kNone);
  for (const Side side : {kInner, kOuter}) shell.ends[side].reserve(draft.ends.size());
  for (std::uint32_t f = 0; f < draft.faces.size(); ++f) {
    if (!draft.alive(f)) continue;
    Face face{};
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& n = number[draft.faces[f][k]];
      if (n == kNone) {
        n = static_cast<std::uint32_t>(shell.ends[kInner].size());
        for (const Side side : {kInner, kOuter}) shell.ends[side].push_back(draft.ends[draft.faces[f][k]][side]);
      }
      face[k] = n;
    }
    shell.faces.push_back(face);
  }
  return shell;
}

}  // namespace relief::detail
