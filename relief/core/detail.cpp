#include <relief/base/assert.h>
#include <relief/base/try.h>
#include <relief/core/detail.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>

namespace relief {

namespace {

/// Returns the value between samples, `weights` of `steps` each; those without weight need not exist.
float value_between(const Tile& tile, Layer layer, int channel, const std::array<GridPoint, 3>& corners,
                    const std::array<int, 3>& weights, int steps) noexcept {
  double sum = 0;
  float most = 0;
  const bool by_nearest = layer == Layer::Void || layer == Layer::Folded;
  for (std::size_t k = 0; k < 3; ++k) {
    if (weights[k] == 0) continue;
    const float value = tile.value(channel, sample_index(tile.intervals(), corners[k]));
    sum += static_cast<double>(value) * weights[k];
    if (2 * weights[k] >= steps) most = std::max(most, value);
  }
  return by_nearest ? most : static_cast<float>(sum / steps);
}

}  // namespace

std::vector<RootPlace> parts_after(SlabId before, std::span<const SlabId> cuts) {
  std::vector<RootPlace> parts(before + 3 * cuts.size());
  for (SlabId s = 0; s < before; ++s) parts[s] = {.root = s};
  SlabId next = before;
  for (const SlabId s : cuts) {
    const std::array<RootPlace, 4> four = cut_in_four(parts[s]);
    for (std::size_t c = 0; c < 3; ++c) parts[next++] = four[c];
    parts[s] = four[3];
  }
  return parts;
}

std::shared_ptr<Tile> part_of(const Tile& tile, Layer layer, const RootPlace& part, int m) {
  RELIEF_ASSERT(can_carry(tile.intervals(), part, m));
  const int steps = (m << part.level) / tile.intervals();
  // A plane of floats of no layer stays one.
  std::shared_ptr<Tile> made(sample_type(layer) == SampleType::U16 ? new Tile(layer, m, 0.0F)
                                                                   : new Tile(m, tile.channel_count(), 0.0F));
  std::size_t at = 0;
  for (int j = 0; j <= m; ++j)
    for (int i = 0; i + j <= m; ++i, ++at) {
      const std::array<int, 3> w = part.in_root(weights(m, {i, j}));
      const GridPoint cell = {w[1] / steps, w[2] / steps};
      const int a = w[1] % steps, b = w[2] % steps;
      const GridPoint right = {cell.i + 1, cell.j}, up = {cell.i, cell.j + 1};
      const bool stands = a + b <= steps;
      const std::array<GridPoint, 3> corners = {stands ? cell : GridPoint{cell.i + 1, cell.j + 1}, right, up};
      const std::array<int, 3> shares =
          stands ? std::array{steps - a - b, a, b} : std::array{a + b - steps, steps - b, steps - a};
      for (int c = 0; c < tile.channel_count(); ++c)
        made->set(c, at, value_between(tile, layer, c, corners, shares, steps));
    }
  return made;
}

namespace {

/// Doubles intervals until the grids of all slabs fit together along hanging edges.
Status fit(const SlabMesh& mesh, std::vector<int>& intervals) {
  for (bool changed = true; std::exchange(changed, false);) {
    for (SlabId s = 0; mesh.is_cut() && s < mesh.slab_count(); ++s)
      for (std::size_t k = 0; k < 3; ++k) {
        if (!is_half(mesh.slabs()[s].shares[k])) continue;
        int& across = intervals[mesh.slabs()[s].neighbours[k]];
        int& own = intervals[s];
        while (across % 2 != 0 || across > 2 * own) {
          (across % 2 != 0 ? across : own) *= 2;
          changed = true;
        }
      }
  }
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    if (intervals[s] > kMaxIntervals)
      return fail(Errc::InvalidArgument, "slab " + std::to_string(s) + " would need " + std::to_string(intervals[s]) +
                                             " intervals, more than " + std::to_string(kMaxIntervals));
  return {};
}

/// One layer on its way to another cage.
class LayerCarrier {
 public:
  LayerCarrier(const Snapshot& before, const SlabMesh& after, Layer layer, std::span<const RootPlace> origins,
               std::span<const int> intervals)
      : before_(before), after_(after), layer_(layer), origins_(origins), intervals_(intervals) {}

  std::vector<TilePtr> run() {
    tiles_.resize(after_.slab_count());
    std::vector<SlabId> changed;
    for (SlabId s = 0; s < after_.slab_count(); ++s) {
      const TilePtr& from = before_.shared_tile(layer_, origins_[s].root);
      if (origins_[s].level == 0 && from->intervals() == intervals_[s]) {
        tiles_[s] = from;
        continue;
      }
      tiles_[s] = part_of(*from, layer_, origins_[s], intervals_[s]);
      changed.push_back(s);
    }
    std::vector<SlabId> around = changed;
    for (const SlabId s : changed)
      for (int edge = 0; edge < 3; ++edge)
        after_.for_each_across(s, edge, [&](SlabId other) { around.push_back(other); });
    std::ranges::sort(around);
    const auto repeated = std::ranges::unique(around);
    around.erase(repeated.begin(), repeated.end());
    for (const SlabId s : changed)
      for (int edge = 0; edge < 3; ++edge)
        for (int t = 0; t < intervals_[s]; ++t) join(s, edge_point(intervals_[s], edge, t));
    for (const SlabId s : around) constrain_tile(s);
    return std::move(tiles_);
  }

 private:
  /// Where slabs meet, the one that had the coarser grid knows what lies between its samples; the others may have
  /// rounded some of it before.
  void join(SlabId s, GridPoint p) {
    const auto intervals_of = [&](SlabId slab) { return intervals_[slab]; };
    SampleCopy owner;
    int coarsest = 0;
    after_.for_each_copy(s, intervals_of, p, [&](const SampleCopy& at) {
      const SlabId from = origins_[at.slab].root;
      const int steps = before_.intervals(layer_, from) << before_.slab_mesh().level(from);
      if (owner.slab != kNoSlab && steps >= coarsest) return;
      owner = at;
      coarsest = steps;
    });
    after_.for_each_copy(s, intervals_of, p, [&](const SampleCopy& at) {
      if (at.slab != owner.slab) copy(owner, at);
    });
  }
  void copy(const SampleCopy& from, const SampleCopy& to) {
    const std::size_t a = sample_index(intervals_[from.slab], from.at), b = sample_index(intervals_[to.slab], to.at);
    for (int c = 0; c < tiles_[to.slab]->channel_count(); ++c) {
      const float value = tiles_[from.slab]->value(c, a);
      if (value == tiles_[to.slab]->value(c, b)) continue;
      auto own = std::make_shared<Tile>(*tiles_[to.slab]);
      own->set(c, b, value);
      tiles_[to.slab] = std::move(own);
    }
  }

  /// What was constrained otherwise may differ in the last bit.
  void constrain_tile(SlabId s) {
    std::shared_ptr<Tile> own;
    after_.for_each_constrained(
        s, [&](SlabId slab) { return intervals_[slab]; },
        [&](GridPoint p, const EdgePlace& place) {
          const std::size_t at = sample_index(intervals_[s], p);
          for (int c = 0; c < tiles_[s]->channel_count(); ++c) {
            const float value = constrained_value(own ? *own : *tiles_[s], layer_, place, c);
            if (value == tiles_[s]->value(c, at)) continue;
            if (!own) own = std::make_shared<Tile>(*tiles_[s]);
            own->set(c, at, value);
          }
        });
    if (own) tiles_[s] = own;
  }

  const Snapshot& before_;
  const SlabMesh& after_;
  Layer layer_;
  std::span<const RootPlace> origins_;
  std::span<const int> intervals_;
  std::vector<TilePtr> tiles_;
};

}  // namespace

Result<DetailChange> DetailChange::make(const SnapshotPtr& model, const Detail& detail) {
  DetailChange made;
  const SlabMesh& before = model->slab_mesh();
  RELIEF_TRY(const SlabMesh cut, before.cut(detail.cuts));
  made.origins_ = parts_after(before, cut);
  auto& intervals = made.intervals_;
  for (std::size_t k = 0; k < kLayerCount; ++k) {
    const auto layer = static_cast<Layer>(k);
    if (!model->has(layer) || (has_own_intervals(layer) && layer != Layer::Displacement)) continue;
    for (const RootPlace& origin : made.origins_)
      intervals[k].push_back(after_cuts(model->intervals(layer, origin.root), origin.level));
  }
  for (const GridWanted& grid : detail.grids) {
    std::vector<int>& of_layer = intervals[static_cast<std::size_t>(grid.layer)];
    if (grid.slab >= cut.slab_count())
      return fail(Errc::InvalidArgument, "slab " + std::to_string(grid.slab) + " does not exist");
    if (!of_layer.empty())
      while (of_layer[grid.slab] < grid.intervals) of_layer[grid.slab] *= 2;
  }
  for (std::vector<int>& of_layer : intervals)
    if (!of_layer.empty()) RELIEF_CHECK(fit(cut, of_layer));
  for (const Layer layer : {Layer::Void, Layer::Folded})
    if (model->has(layer))
      intervals[static_cast<std::size_t>(layer)] = intervals[static_cast<std::size_t>(Layer::Displacement)];
  RELIEF_TRY(SlabMesh after, cut.refined(intervals[static_cast<std::size_t>(Layer::Displacement)]));
  made.after_ = std::make_shared<const SlabMesh>(std::move(after));
  return made;
}

DetailChange DetailChange::of_parts(const Snapshot& model, std::shared_ptr<const SlabMesh> after,
                                    std::vector<RootPlace> origins,
                                    std::array<std::vector<int>, kLayerCount> intervals) {
  RELIEF_ASSERT(origins.size() == after->slab_count());
  for (int k = 0; k < kLayerCount; ++k)
    RELIEF_ASSERT(intervals[static_cast<std::size_t>(k)].size() ==
                  (model.has(static_cast<Layer>(k)) ? origins.size() : 0));
  DetailChange made;
  made.origins_ = std::move(origins);
  made.intervals_ = std::move(intervals);
  made.after_ = std::move(after);
  return made;
}

SnapshotPtr DetailChange::of(const Snapshot& model) const {
  return Snapshot::with_cage(model, after_, [&](Layer layer) {
    return LayerCarrier(model, *after_, layer, origins_, intervals_[static_cast<std::size_t>(layer)]).run();
  });
}

Result<SnapshotPtr> with_detail(const SnapshotPtr& model, const Detail& detail) {
  RELIEF_TRY(const DetailChange change, DetailChange::make(model, detail));
  return change.of(*model);
}

std::optional<SlabCoord> heir(const SlabMesh& from, const SlabMesh& to, const SlabCoord& at) noexcept {
  if (at.slab >= from.slab_count()) return std::nullopt;
  return heir(SlabOrigin(from, at.slab), to, at);
}

std::optional<SlabCoord> heir(const SlabOrigin& from, const SlabMesh& to, const SlabCoord& at) noexcept {
  if (from.roots != to.roots_number()) return std::nullopt;
  if (from.cage == to.number()) return at;
  std::array<double, 3> w = from.place.in_root(std::array{1 - at.u - at.v, at.u, at.v});
  for (double& x : w) x /= 1 << from.place.level;
  const SlabId slab = to.descend(from.place.root, w);
  return SlabCoord{slab, w[1], w[2], at.alpha};
}

}  // namespace relief
