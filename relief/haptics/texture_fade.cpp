#include <relief/haptics/texture_fade.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relief {

namespace {
constexpr double kFelt = 0.87, kFaded = 0.97;  // turns per tick up to which all is felt, and from which nothing is
constexpr double kCount = 1.0 / 32;            // share of the last tick in the mean of turns
constexpr double kTrend = 8;                   // ticks over which the means of slopes and normals go
constexpr double kClear = 0.5;   // of the root mean square that a slope must be off the mean to be on a side
constexpr int kMostPieces = 32;  // of one tick's way
}  // namespace

TextureFade::Fade TextureFade::step(const Snapshot& model, const SurfacePoint& at, Vec3d normal) noexcept {
  const SlabMesh& mesh = model.slab_mesh();
  const SlabCorners corners = mesh.corners(at.slab);
  const std::array<double, 3> w = {1 - at.u - at.v, at.u, at.v};
  const Vec3d fibre = corners.weighted(corners.outer, w) - corners.weighted(corners.inner, w);
  const double thick = length(fibre), height = at.alpha * thick;
  turns_ -= turns_ * kCount;
  if (last_.slab == kNoSlab) {
    heights_.fill(height);
    normal_ = normal;
  } else {
    const bool same_slab = at.slab == last_.slab;
    const double du = at.u - last_.u, dv = at.v - last_.v;
    const double cells =
        same_slab ? mesh.intervals(at.slab) * std::max({std::abs(du), std::abs(dv), std::abs(du + dv)}) : 0;
    // Waves are two cells long at least, so that none is too fine for a way within a cell.
    const int pieces = std::clamp(static_cast<int>(2 * cells), 1, kMostPieces);
    const double way = length(at.position - last_position_);
    double sum = (height_ + height) / 2;
    for (int k = 1; k < pieces; ++k) {
      const double part = double(k) / pieces;
      const double there = displacement_at(model, at.slab, last_.u + du * part, last_.v + dv * part) *
                           (fibre_ + (thick - fibre_) * part);
      sum += there;
      run_over(way / pieces, there, pieces);
    }
    if (pieces > 1) run_over(way / pieces, height, pieces);
    heights_[tick_] = sum / pieces;
    tick_ = (tick_ + 1) % kTicks;
    normal_ = normalized(normal_ + (normal - normal_) / kTrend);
  }
  last_ = {at.slab, at.u, at.v, at.alpha};
  last_position_ = at.position;
  fibre_ = thick;
  height_ = height;
  const double share = std::clamp((turns_ - kFelt) / (kFaded - kFelt), 0.0, 1.0);
  return {share, share > 0 && thick > 0 ? fibre * (above_line() / thick) : Vec3d{}, normal_};
}

void TextureFade::run_over(double way, double height, int pieces) noexcept {
  if (!(way > 0)) return;
  const double slope = (height - std::exchange(height_, height)) / way;
  slope_ += (slope - slope_) / (kTrend * pieces);
  const double off = slope - slope_;
  unevenness_ += (off * off - unevenness_) / (kTrend * pieces);
  if (off * off > kClear * kClear * unevenness_ && (off > 0) != rising_) {
    rising_ = off > 0;
    turns_ += kCount;
  }
}

double TextureFade::above_line() const noexcept {
  // Least squares over the middles of the ticks, half a tick further to now.
  constexpr double kN = kTicks, kMiddle = (kN - 1) / 2;
  double line = 0;
  for (std::size_t k = 0; k < kTicks; ++k)  // the oldest comes first
    line += heights_[(tick_ + k) % kTicks] * (1 / kN + 6 * (double(k) - kMiddle) / (kN * kN - 1));
  return height_ - line;
}

}  // namespace relief
