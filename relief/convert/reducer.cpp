#include <relief/convert/cells.h>
#include <relief/convert/parallel.h>
#include <relief/convert/reducer.h>

#include <algorithm>
#include <atomic>
#include <numeric>
#include <utility>

namespace relief::detail {
namespace {

constexpr std::size_t kCell = 24000;   // slabs
constexpr std::size_t kWhole = 60000;  // slabs that are reduced without cells
constexpr std::size_t kBeforeQueue = 12000;

/// The cage of the source's own triangles.
CageDraft finest_cage(const OrderedSource& source, std::vector<Ends>&& ends) {
  CageDraft cage;
  const std::size_t points = source.points.size(), faces = source.faces.size();
  cage.faces = source.faces;
  cage.part = find_parts(points, source.faces).of_face;
  cage.ends = std::move(ends);
  cage.at.reserve(points);
  for (const LatticePoint p : source.points) cage.at.push_back(to_double(p));
  cage.quadrics.resize(points);
  for (std::uint32_t t = 0; t < faces; ++t) {
    const Vec3d n = source.cross_of(t);
    const double size = length(n);
    if (!(size > 0)) continue;
    for (const std::uint32_t v : source.faces[t])
      cage.quadrics[v].add_plane(n / size, cage.at[source.faces[t][0]], size / 6);
  }
  cage.lists.resize(faces);
  cage.from.resize(faces);
  std::iota(cage.from.begin(), cage.from.end(), 0U);
  return cage;
}

/// A part of a cage with numbers of its own.
struct Part {
  CageDraft cage;
  std::vector<std::uint32_t> faces, fibres;  // numbers in the whole

  Part(const CageDraft& whole, std::vector<std::uint32_t>&& members) : faces(std::move(members)) {
    fibres.reserve(3 * faces.size());
    for (const std::uint32_t f : faces) fibres.insert(fibres.end(), whole.faces[f].begin(), whole.faces[f].end());
    std::sort(fibres.begin(), fibres.end());
    fibres.erase(std::unique(fibres.begin(), fibres.end()), fibres.end());
    for (const std::uint32_t v : fibres) {
      cage.ends.push_back(whole.ends[v]);
      cage.at.push_back(whole.at[v]);
      cage.quadrics.push_back(whole.quadrics[v]);
    }
    for (const std::uint32_t f : faces) {
      Face face{};
      for (std::size_t k = 0; k < 3; ++k)
        face[k] = static_cast<std::uint32_t>(std::lower_bound(fibres.begin(), fibres.end(), whole.faces[f][k]) -
                                             fibres.begin());
      cage.faces.push_back(face);
      cage.part.push_back(whole.part[f]);
      cage.from.push_back(whole.from[f]);
      const std::span<const Entry> list = whole.list(f);
      cage.lists.push_back({static_cast<std::uint32_t>(cage.pool.size()), static_cast<std::uint32_t>(list.size())});
      cage.pool.insert(cage.pool.end(), list.begin(), list.end());
    }
  }
};

/// The lists of the slabs that a part could change.
struct NewLists {
  std::vector<std::uint32_t> faces;
  std::vector<CageDraft::List> lists;
  std::vector<Entry> pool;
};

/// Puts a part back, except for its lists.
NewLists put_back(CageDraft& whole, const Part& part, const SlabReducer& reducer) {
  NewLists result;
  const CageDraft& cage = reducer.cage();
  for (std::uint32_t v = 0; v < part.fibres.size(); ++v) {
    if (!reducer.is_free(v)) continue;
    whole.ends[part.fibres[v]] = cage.ends[v];
    whole.at[part.fibres[v]] = cage.at[v];
    whole.quadrics[part.fibres[v]] = cage.quadrics[v];
  }
  for (std::uint32_t f = 0; f < part.faces.size(); ++f) {
    Face& face = whole.faces[part.faces[f]];
    if (!cage.alive(f)) {
      face = cage.faces[f];
      continue;
    }
    const Face& mine = cage.faces[f];
    if (!reducer.is_free(mine[0]) && !reducer.is_free(mine[1]) && !reducer.is_free(mine[2])) continue;
    for (std::size_t k = 0; k < 3; ++k) face[k] = part.fibres[mine[k]];
    whole.from[part.faces[f]] = kNone;
    const std::span<const Entry> list = cage.list(f);
    result.faces.push_back(part.faces[f]);
    result.lists.push_back({static_cast<std::uint32_t>(result.pool.size()), static_cast<std::uint32_t>(list.size())});
    result.pool.insert(result.pool.end(), list.begin(), list.end());
  }
  return result;
}

/// Leaves out what is gone, and puts the new lists in.
void compact(CageDraft& cage, const std::vector<NewLists>& changed) {
  struct Place {
    std::uint32_t part = kNone, index = 0;
  };
  std::vector<Place> places(cage.faces.size());
  for (std::uint32_t p = 0; p < changed.size(); ++p)
    for (std::uint32_t k = 0; k < changed[p].faces.size(); ++k) places[changed[p].faces[k]] = {p, k};
  CageDraft kept;
  std::vector<std::uint32_t> number(cage.ends.size(), kNone);
  for (std::uint32_t f = 0; f < cage.faces.size(); ++f) {
    if (!cage.alive(f)) continue;
    Face face{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = cage.faces[f][k];
      if (number[v] == kNone) {
        number[v] = static_cast<std::uint32_t>(kept.ends.size());
        kept.ends.push_back(cage.ends[v]);
        kept.at.push_back(cage.at[v]);
        kept.quadrics.push_back(cage.quadrics[v]);
      }
      face[k] = number[v];
    }
    kept.faces.push_back(face);
    kept.part.push_back(cage.part[f]);
    kept.from.push_back(cage.from[f]);
    std::span<const Entry> list = cage.list(f);
    if (places[f].part != kNone) {
      const NewLists& in = changed[places[f].part];
      const CageDraft::List at = in.lists[places[f].index];
      list = std::span(in.pool).subspan(at.begin, at.count);
    }
    kept.lists.push_back({static_cast<std::uint32_t>(kept.pool.size()), static_cast<std::uint32_t>(list.size())});
    kept.pool.insert(kept.pool.end(), list.begin(), list.end());
  }
  cage = std::move(kept);
}

}  // namespace

bool Reducer::thin_shell(const Progress& progress) {
  thin_ = make_thin_shell(source_, longest_, progress);
  return !progress.cancelled();
}

bool Reducer::reduce_in_cells(CageDraft& cage, std::size_t goal, int level, const Progress& progress) {
  const std::size_t count = cage.faces.size();
  const auto centre = [&](std::size_t f) {
    return (cage.at[cage.faces[f][0]] + cage.at[cage.faces[f][1]] + cage.at[cage.faces[f][2]]) / 3.0;
  };
  // A choice of the slabs cuts space; each time in other places.
  constexpr std::size_t kStride = 16;
  std::vector<Vec3d> sample;
  sample.reserve(count / kStride + 1);
  for (std::size_t f = 0; f < count; f += kStride) sample.push_back(centre(f));
  const Cells cells(sample, kCell / kStride, level % 2 == 0 ? 0.5 : 0.4);
  std::vector<std::vector<std::uint32_t>> members(cells.count());
  for (std::uint32_t f = 0; f < count; ++f)
    cells.for_each(cage.box(f), [&](std::uint32_t c) { members[c].push_back(f); });

  std::vector<NewLists> changed(cells.count());
  std::atomic<std::size_t> done = 0;
  const double share = double(goal) / double(count);
  const Progress quiet = {.report = {}, .cancel = progress.cancel};
  const bool whole = for_all(cells.count(), 1, progress, [&](std::size_t c) {
    Part part(cage, std::move(members[c]));
    SlabReducer reducer(source_, *thin_.tree, longest_, std::move(part.cage), cells.box(c));
    const std::size_t fixed = reducer.slab_count() - reducer.free_count();
    if (!reducer.sweep(fixed + static_cast<std::size_t>(share * double(reducer.free_count())), quiet)) return;
    changed[c] = put_back(cage, part, reducer);
    ++done;
  });
  if (!whole) return false;
  compact(cage, changed);
  return true;
}

bool Reducer::reduce(const Progress& progress) {
  CageDraft cage = finest_cage(source_, std::move(thin_.ends));
  const std::size_t stop = std::max(kBeforeQueue, 8 * target_);
  for (int level = 0; cage.faces.size() > std::max(kWhole, 2 * stop); ++level) {
    const std::size_t before = cage.faces.size();
    progress("reduce", 0.1 * level);
    if (!reduce_in_cells(cage, std::max(stop, before / 12), level, progress)) return false;
    if (10 * cage.faces.size() > 8 * before) break;
  }
  Box3d everywhere;
  everywhere.low = {-Box3d::kFar, -Box3d::kFar, -Box3d::kFar};
  everywhere.high = {Box3d::kFar, Box3d::kFar, Box3d::kFar};
  last_.emplace(source_, *thin_.tree, longest_, std::move(cage), everywhere);
  thin_.tree.reset();
  return last_->sweep(stop, progress) && last_->reduce(target_, progress);
}

Shell Reducer::shell() const {
  const CageDraft& cage = last_->cage();
  Shell shell;
  std::vector<std::uint32_t> number(cage.ends.size(), kNone);
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
