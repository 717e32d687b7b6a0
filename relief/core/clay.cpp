#include <relief/core/clay.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace relief {
namespace {

constexpr float kIsHole = 0.5F;

/// Lengths of clay on one side.
class Side {
 public:
  explicit Side(double thin) noexcept : thin_(thin) {}
  void add_sample(double length) noexcept { thin_samples_ += length < thin_; }
  void add_fibre(double length, Vec3d at) { fibres_.emplace_back(length, at); }

  /// Of so many samples in all.
  [[nodiscard]] ClaySide summary(std::size_t samples, double diagonal) && {
    ClaySide side;
    if (fibres_.empty()) return side;
    std::ranges::stable_sort(fibres_, {}, &std::pair<double, Vec3d>::first);
    const auto thin = std::ranges::lower_bound(fibres_, thin_, {}, &std::pair<double, Vec3d>::first);
    side.least = fibres_.front().first / diagonal;
    side.least_at = fibres_.front().second;
    side.tenth = fibres_[fibres_.size() / 10].first / diagonal;
    side.median = fibres_[fibres_.size() / 2].first / diagonal;
    side.thin_fibres = double(thin - fibres_.begin()) / double(fibres_.size());
    side.thin_samples = double(thin_samples_) / double(samples);
    return side;
  }

 private:
  double thin_;
  std::size_t thin_samples_ = 0;
  std::vector<std::pair<double, Vec3d>> fibres_;
};

}  // namespace

Clay measure_clay(const Snapshot& model, double diagonal) {
  const SlabMesh& mesh = model.slab_mesh();
  Side below(ClaySide::kThin * diagonal), above(ClaySide::kThin * diagonal);
  std::vector<std::uint8_t> seen(mesh.fibres().size(), 0);
  Clay clay;
  std::size_t samples = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const int n = mesh.intervals(s);
    const SlabCorners corners = mesh.corners(s);
    const std::array<Vec3d, 3> fibres = {corners.fibre(0), corners.fibre(1), corners.fibre(2)};
    const float* alphas = model.displacement(s);
    const float* voids = model.has(Layer::Void) ? model.tile(Layer::Void, s).plane() : nullptr;
    const auto is_void = [&](std::size_t k) { return voids != nullptr && voids[k] > kIsHole; };
    const Vec3d along_1 = (fibres[1] - fibres[0]) / n, along_2 = (fibres[2] - fibres[0]) / n;
    std::size_t k = 0;
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n - j; ++i, ++k) {
        if (is_void(k)) continue;
        const double whole = length(fibres[0] + along_1 * i + along_2 * j), alpha = double(alphas[k]);
        ++samples;
        below.add_sample(alpha * whole);
        above.add_sample((1 - alpha) * whole);
      }
    for (int corner = 0; corner < 3; ++corner) {
      const auto c = static_cast<std::size_t>(corner);
      const std::size_t at = sample_index(n, corner_point(n, corner));
      if (is_void(at) || std::exchange(seen[mesh.slabs()[s].fibres[c]], 1) != 0) continue;
      const double whole = length(fibres[c]), alpha = double(alphas[at]);
      const Vec3d place = corners.inner[c] + fibres[c] * alpha;
      ++clay.fibres;
      below.add_fibre(alpha * whole, place);
      above.add_fibre((1 - alpha) * whole, place);
    }
    model.tile(Layer::Displacement, s).rest();
    if (voids != nullptr) model.tile(Layer::Void, s).rest();
  }
  clay.below = std::move(below).summary(samples, diagonal);
  clay.above = std::move(above).summary(samples, diagonal);
  return clay;
}

}  // namespace relief
