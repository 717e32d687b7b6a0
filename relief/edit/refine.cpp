#include <relief/edit/refine.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace relief::detail {

namespace {

/// The most of a steep surface's slope that counts, in lengths along the fibre per length across: finer grids do not
/// help where fibres lean.
constexpr double kMostSlope = 1.5;

/// A fibre of a slab of some cage with the roots of `began`, and where the surface of that crosses it.
struct Crossed {
  Vec3d inner, along;
  double alpha;
  [[nodiscard]] Vec3d at(double share) const noexcept { return inner + along * share; }
};

Crossed crossed(const Snapshot& began, const SlabMesh& mesh, SlabId s, double u, double v) {
  const std::optional<SlabCoord> there = heir(mesh, began.slab_mesh(), {s, u, v, 0});
  const SlabCorners corners = mesh.corners(s);
  const std::array<double, 3> w = {1 - u - v, u, v};
  const Vec3d inner = corners.weighted(corners.inner, w);
  return {inner, corners.weighted(corners.outer, w) - inner,
          there ? displacement_at(began, there->slab, there->u, there->v) : 0.5};
}

double distance(const Crossed& a, const Crossed& b) {
  const double across = std::max(length(a.at(a.alpha) - b.at(a.alpha)), length(a.at(b.alpha) - b.at(b.alpha)));
  return std::min(length(a.at(a.alpha) - b.at(b.alpha)), kMostSlope * across);
}

/// Returns up to where a part of a slab has a surface, from the tile of the slab.
double highest(const Tile& tile, const RootPlace& part) {
  const int n = tile.intervals();
  GridPoint low = {n, n}, high = {0, 0};  // of all samples in and around it
  for (const std::array<int, 3>& corner : part.corners) {
    const GridPoint times = {corner[1] * n, corner[2] * n};
    const int steps = 1 << part.level;
    low = {std::min(low.i, times.i / steps), std::min(low.j, times.j / steps)};
    high = {std::max(high.i, (times.i + steps - 1) / steps), std::max(high.j, (times.j + steps - 1) / steps)};
  }
  float most = 0;
  for (int j = low.j; j <= high.j; ++j)
    for (int i = low.i; i <= std::min(high.i, n - j); ++i) most = std::max(most, tile.plane()[sample_index(n, {i, j})]);
  return static_cast<double>(most);
}

double longest_edge(const Snapshot& began, const SlabMesh& mesh, SlabId s) {
  const auto at = [&](double u, double v) { return crossed(began, mesh, s, u, v); };
  const std::array<Crossed, 3> ends = {at(0, 0), at(1, 0), at(0, 1)}, middles = {at(0.5, 0.5), at(0, 0.5), at(0.5, 0)};
  double longest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t a = (k + 1) % 3, b = (k + 2) % 3;
    longest = std::max({longest, distance(ends[a], ends[b]), 2 * distance(ends[a], middles[k]),
                        2 * distance(middles[k], ends[b]), 2 * distance(middles[a], middles[b])});
  }
  return longest;
}

}  // namespace

int halvings(double edge, int n, double spacing) noexcept {
  int times = 0;
  for (double cell = edge / n; cell > spacing && times < kMaxLevel; cell /= 2) ++times;
  return times;
}

double longest_edge(const Snapshot& began, SlabId s) { return longest_edge(began, began.slab_mesh(), s); }

double RefinePlan::edge(const SlabMesh& mesh, SlabId s) const { return longest_edge(began_, mesh, s); }

bool RefinePlan::wanted(std::span<const SlabId> near, const Need& need) const {
  const SlabMesh& mesh = model_.slab_mesh();
  return std::ranges::any_of(near, [&](SlabId s) {
    return mesh.level(s) < kMaxLevel && edge(mesh, s) > need.spacing * model_.intervals(need.layer, s);
  });
}

bool RefinePlan::settle(SlabId s, const Need& need) {
  int& n = intervals(need.layer, s);
  const double longest = edge(*mesh_, s);
  int most = n;
  while (2 * most <= kMostIntervals) most *= 2;
  if (longest > need.spacing * most) return mesh_->level(s) < kMaxLevel;
  for (; longest > need.spacing * n; n *= 2) raises_ = true;
  return false;
}

void RefinePlan::add_coarser_neighbours(std::vector<SlabId>& cuts) const {
  std::vector<bool> taken(mesh_->slab_count());
  for (const SlabId s : cuts) taken[s] = true;
  for (std::size_t next = 0; next < cuts.size(); ++next) {
    const Slab& slab = mesh_->slabs()[cuts[next]];
    for (std::size_t k = 0; k < 3; ++k) {
      if (!is_half(slab.shares[k])) continue;
      if (taken[slab.neighbours[k]]) continue;
      taken[slab.neighbours[k]] = true;
      cuts.push_back(slab.neighbours[k]);
    }
  }
  std::ranges::sort(cuts);
}

std::vector<SlabId> RefinePlan::fit_hanging(const std::function<bool(SlabId)>& touched) {
  std::vector<SlabId> too_dense;
  for (bool changed = true; std::exchange(changed, false);)
    for (SlabId s = 0; s < mesh_->slab_count(); ++s) {
      const Slab& slab = mesh_->slabs()[s];
      for (std::size_t k = 0; k < 3; ++k) {
        if (!is_half(slab.shares[k])) continue;
        const SlabId coarse = slab.neighbours[k];
        for (std::vector<int>& n : intervals_) {
          if (n.empty() || n[coarse] <= 2 * n[s]) continue;
          if (touched(parts_[s].root) && mesh_->level(coarse) < kMaxLevel) {
            too_dense.push_back(coarse);
            continue;
          }
          while (n[coarse] > 2 * n[s]) n[s] *= 2;
          changed = true;
        }
      }
    }
  std::ranges::sort(too_dense);
  const auto repeated = std::ranges::unique(too_dense);
  too_dense.erase(repeated.begin(), repeated.end());
  return too_dense;
}

bool RefinePlan::cut(std::vector<SlabId>& cuts, const DetailBudget& budget) {
  add_coarser_neighbours(cuts);
  if (mesh_->slab_count() + 3 * cuts.size() > model_.slab_mesh().slab_count() + budget.slabs) return false;
  auto next = mesh_->cut(cuts);
  if (!next) return false;
  mesh_ = std::make_shared<const SlabMesh>(*std::move(next));
  for (const SlabId s : cuts) {
    const auto [at_a, at_b, at_c, centre] = cut_in_four(parts_[s]);
    parts_.insert(parts_.end(), {at_a, at_b, at_c});
    parts_[s] = centre;
    for (std::vector<int>& n : intervals_) {
      if (n.empty()) continue;
      if (n[s] % 2 == 0) n[s] /= 2;
      n.insert(n.end(), 3, n[s]);
    }
  }
  new_cuts_ += cuts.size();
  return true;
}

std::size_t RefinePlan::samples() const {
  std::size_t sum = 0;
  for (const std::vector<int>& of_layer : intervals_)
    for (const int n : of_layer) sum += sample_count(n);
  return sum;
}

bool RefinePlan::run(std::span<const SlabId> near, const Need& need, const std::function<const Tile&(SlabId)>& surface,
                     const std::function<bool(SlabId)>& touched, const DetailBudget& budget) {
  mesh_ = model_.shared_slab_mesh();
  new_cuts_ = 0;
  raises_ = false;
  parts_.clear();
  for (SlabId s = 0; s < mesh_->slab_count(); ++s) parts_.push_back({.root = s});
  for (std::size_t k = 0; k < kLayerCount; ++k) {
    const auto layer = static_cast<Layer>(k);
    intervals_[k].clear();
    // Those that follow the displacement count with it.
    if (!model_.has(layer) || (has_own_intervals(layer) && layer != Layer::Displacement)) continue;
    for (SlabId s = 0; s < mesh_->slab_count(); ++s) intervals_[k].push_back(model_.intervals(layer, s));
  }
  const std::size_t before = samples();
  std::vector<SlabId> open(near.begin(), near.end());
  for (;;) {
    std::vector<SlabId> cuts;
    for (const SlabId s : open)
      if (settle(s, need)) cuts.push_back(s);
    if (cuts.empty()) cuts = fit_hanging(touched);
    if (cuts.empty()) break;
    const SlabId count = mesh_->slab_count();
    std::vector<bool> is_open(count);
    for (const SlabId s : open) is_open[s] = true;
    if (!cut(cuts, budget)) return false;
    open.clear();
    SlabId child = count;
    for (const SlabId s : cuts) {
      for (const SlabId part : {s, child, child + 1, child + 2}) {
        const double radius = need.sphere.radius;
        if (is_open[s] && mesh_->box(part).distance2(need.sphere.centre) <= radius * radius &&
            may_reach(mesh_->corners(part), highest(surface(parts_[part].root), parts_[part]), need.sphere, need.up))
          open.push_back(part);
      }
      child += 3;
    }
  }
  return samples() <= before + budget.samples;
}

Detail RefinePlan::since_began() const {
  Detail all;
  const auto cuts = mesh_->cuts().subspan(began_.slab_mesh().cuts().size());
  all.cuts.assign(cuts.begin(), cuts.end());
  for (std::size_t k = 0; k < kLayerCount; ++k)
    for (SlabId s = 0; s < intervals_[k].size(); ++s)
      all.grids.push_back({.layer = static_cast<Layer>(k), .slab = s, .intervals = intervals_[k][s]});
  return all;
}

}  // namespace relief::detail
