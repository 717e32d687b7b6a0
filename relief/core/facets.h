// Which samples of a finer grid only repeat the triangles of the coarser one before it.
#pragma once

#include <relief/core/slab_mesh.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace relief::detail {

/// Samples farther away than that are not worth their time: an old triangle of more spacings shows its edges faintly.
inline constexpr int kFarthest = 16;

/// What a displacement may be off the mean of its two ends and still lie between them, as a share of the fibre: eight
/// roundings to a float, of a value and of ends that were themselves made so.
inline constexpr float kBetween = 1e-6F;

/// The directions to the six samples around one, counter-clockwise; the first again at the end.
inline constexpr std::array<GridPoint, 7> kAround = {{{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}, {1, 0}}};

/// The grid of a slab that has finer samples than its root had (with_detail()). The new samples lie on the old
/// triangles, whose edges would be seen and felt as creases. So normals look over them: from each sample in six
/// directions, as far as the old samples lay apart, but not as far as to one that a tool has changed.
class Facets {
 public:
  /// Of slab s, whose displacements are `alpha`, row-packed.
  Facets(const SlabMesh& mesh, SlabId s, const float* alpha) noexcept : n_(mesh.intervals(s)), alpha_(alpha) {
    if (!mesh.has_detail()) return;
    const RootPlace place = mesh.root_place(s);
    step_ = std::min((n_ << place.level) / mesh.roots()[place.root].intervals, std::min(n_ & -n_, kFarthest));
  }
  /// Returns how many spacings apart the samples of the root lie; 1: none are new.
  [[nodiscard]] int step() const noexcept { return step_; }
  /// Returns whether a sample is new and no longer between the two ones that it was made from.
  [[nodiscard]] bool is_changed(GridPoint p) const noexcept {
    const int both = p.i | p.j, low = both & -both;
    if (low == 0 || low >= step_) return false;
    const int i = p.i & low, j = p.j & low;
    const GridPoint a = {p.i + i, p.j + (i != 0 ? -j : j)}, b = {p.i - i, p.j + (i != 0 ? j : -j)};
    return !(std::abs(at(p) - 0.5F * (at(a) + at(b))) <= kBetween);
  }
  /// Returns how many samples the normal at p looks ahead in a direction; 0 where the slab ends.
  [[nodiscard]] int reach(GridPoint p, GridPoint way) const noexcept {
    const int most = is_changed(p) ? 1 : step_;
    for (int k = 1;; ++k) {
      const GridPoint q = {p.i + k * way.i, p.j + k * way.j};
      if (q.i < 0 || q.j < 0 || q.i + q.j > n_) return k - 1;
      if (is_changed(q)) return std::max(k - 1, 1);
      if (k == most) return k;
    }
  }

 private:
  [[nodiscard]] float at(GridPoint p) const noexcept { return alpha_[sample_index(n_, p)]; }

  int n_, step_ = 1;
  const float* alpha_;
};

}  // namespace relief::detail
