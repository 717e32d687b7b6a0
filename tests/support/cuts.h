// Cages whose slabs are cut in four, as tests want them.
#pragma once

#include <relief/core/detail.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>

namespace relief::testing {

/// Cuts slabs at random, and those that must be cut first so that neighbours stay within one level.
class RandomCuts {
 public:
  explicit RandomCuts(SnapshotPtr model, std::uint32_t seed = 1) : model_(std::move(model)), random_(seed) {}

  void cut_one(int most_level) {
    const SlabMesh& mesh = model_->slab_mesh();
    const auto s = static_cast<SlabId>(random_() % mesh.slab_count());
    if (mesh.level(s) < most_level) cut(s);
  }
  void cut(SlabId s) {
    for (int edge = 0; edge < 3; ++edge) {
      const Slab& slab = model_->slab_mesh().slabs()[s];
      const auto k = static_cast<std::size_t>(edge);
      if (is_half(slab.shares[k])) cut(slab.neighbours[k]);
    }
    model_ = with_detail(model_, {.cuts = {s}, .grids = {}}).value();
  }
  [[nodiscard]] const SnapshotPtr& model() const { return model_; }

 private:
  SnapshotPtr model_;
  std::mt19937 random_;
};

inline SnapshotPtr cut_at_random(SnapshotPtr model, int times, int most_level = 4) {
  RandomCuts cuts(std::move(model));
  for (int k = 0; k < times; ++k) cuts.cut_one(most_level);
  return cuts.model();
}

/// Returns how many samples of a model are gone in what was cut from it, lie elsewhere or have other bits.
inline std::size_t samples_lost(const Snapshot& model, const Snapshot& cut) {
  const SlabMesh& mesh = model.slab_mesh();
  std::size_t lost = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const int n = mesh.intervals(s);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) {
        if (mesh.edge_place(s, {i, j}).constrained()) continue;
        const auto there = heir(mesh, cut.slab_mesh(), {s, double(i) / n, double(j) / n, 0});
        const int m = there ? cut.slab_mesh().intervals(there->slab) : 0;
        const double x = there ? there->u * m : 0.5, y = there ? there->v * m : 0.5;
        const GridPoint p = {static_cast<int>(std::lround(x)), static_cast<int>(std::lround(y))};
        const bool is_sample = std::abs(x - p.i) < 1e-9 && std::abs(y - p.j) < 1e-9;
        lost += is_sample &&
                        cut.displacement(there->slab)[sample_index(m, p)] ==
                            model.displacement(s)[sample_index(n, {i, j})] &&
                        sample_position(cut, there->slab, p) == sample_position(model, s, {i, j})
                    ? 0
                    : 1;
      }
  }
  return lost;
}

/// Returns how far two cuts of one cage lie apart at most, of alpha, at random places of the second's slabs.
inline double moved_between(const Snapshot& model, const Snapshot& cut, int places, std::uint32_t seed = 3) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const SlabMesh &was = model.slab_mesh(), &is = cut.slab_mesh();
  double most = 0;
  for (int k = 0; k < places; ++k) {
    const auto s = static_cast<SlabId>(random() % is.slab_count());
    const double u = unit(random), v = unit(random) * (1 - u);
    const auto there = heir(is, was, {s, u, v, 0});
    if (!there) return 1;
    most = std::max(most,
                    std::abs(displacement_at(cut, s, u, v) - displacement_at(model, there->slab, there->u, there->v)));
  }
  return most;
}

/// Returns the least angle of a slab's inner and outer triangle, rad.
inline double least_angle(const SlabCorners& c) {
  double angle = 4;
  for (const auto& of : {c.inner, c.outer})
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d a = normalized(of[(k + 1) % 3] - of[k]), b = normalized(of[(k + 2) % 3] - of[k]);
      angle = std::min(angle, std::atan2(length(cross(a, b)), dot(a, b)));
    }
  return angle;
}

/// Returns the least angle of any slab's triangles, as a share of the least of its root's.
inline double least_angle_of_roots(const SlabMesh& mesh, const SlabMesh& roots) {
  double worst = 1;
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    worst = std::min(worst, least_angle(mesh.corners(s)) / least_angle(roots.corners(mesh.root_place(s).root)));
  return worst;
}

}  // namespace relief::testing
