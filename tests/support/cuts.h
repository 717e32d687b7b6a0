// Cages whose slabs are cut in four, as tests want them.
#pragma once

#include <relief/core/detail.h>

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

}  // namespace relief::testing
