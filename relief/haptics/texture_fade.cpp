#include <relief/haptics/texture_fade.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relief {

namespace {
constexpr double kFelt = 0.9, kFaded = 1;  // turns per tick up to which all is felt, and from which nothing is
constexpr double kCount = 1.0 / 32;        // share of the last tick in the mean of turns: faded after 120 ms (S11)
constexpr double kTrend = 8;     // ticks over which the means of slopes and normals go: four waves of two ticks
constexpr double kClear = 0.5;   // of the root mean square that a slope must be off the mean to be on a side
constexpr int kMostPieces = 32;  // of one tick's way, which bounds its cost: 16 cells
constexpr int kMostTurns = 2;    // that count in one tick: one wave, which is too fine by half already
constexpr double kWave = 0.25;   // share of the last turn in the mean of their heights: over two waves

double displacement_in_root(const Snapshot& model, SlabId root, double u, double v) noexcept {
  std::array<double, 3> w = {1 - u - v, u, v};
  const SlabId slab = model.slab_mesh().descend(root, w);
  return displacement_at(model, slab, w[1], w[2]);
}
}  // namespace

TextureFade::Fade TextureFade::step(const Snapshot& model, const SurfacePoint& at, Vec3d normal,
                                    double unfelt) noexcept {
  const SlabMesh& mesh = model.slab_mesh();
  const SlabCorners corners = mesh.corners(at.slab);
  const std::array<double, 3> w = {1 - at.u - at.v, at.u, at.v};
  const RootPlace place = mesh.root_place(at.slab);
  const double parts = 1 << place.level;
  const std::array<double, 3> in_root = place.in_root(w);
  const InRoot now = {mesh.roots_number(), place.root, in_root[1] / parts, in_root[2] / parts};
  const Vec3d fibre = corners.weighted(corners.outer, w) - corners.weighted(corners.inner, w);
  const double thick = length(fibre), height = at.alpha * thick;
  if (last_.root == kNoSlab) {
    heights_.fill(height);
    normal_ = normal;
  } else {
    if (now.roots != last_.roots) shift_to(height);
    const bool same_root = now.roots == last_.roots && now.root == last_.root;
    const double du = now.u - last_.u, dv = now.v - last_.v;
    const double cells =
        same_root ? mesh.intervals(at.slab) * parts * std::max({std::abs(du), std::abs(dv), std::abs(du + dv)}) : 0;
    // Waves are two cells long at least, so that none is too fine for a way within a cell.
    const int pieces = std::clamp(static_cast<int>(2 * cells), 1, kMostPieces);
    const double way = length(at.position - last_position_);
    double sum = (height_ + height) / 2;
    int turns = 0;
    for (int k = 1; k < pieces; ++k) {
      const double part = double(k) / pieces;
      const double there = displacement_in_root(model, now.root, last_.u + du * part, last_.v + dv * part) *
                           (fibre_ + (thick - fibre_) * part);
      sum += there;
      turns += run_over(way / pieces, there, pieces, unfelt) ? 1 : 0;
    }
    if (pieces > 1) turns += run_over(way / pieces, height, pieces, unfelt) ? 1 : 0;
    // What lies between two roots is not looked at.
    if (same_root) turns_ = std::min(turns_ + (std::min(turns, kMostTurns) - turns_) * kCount, kFaded);
    heights_[tick_] = sum / pieces;
    tick_ = (tick_ + 1) % kTicks;
    normal_ = normalized(normal_ + (normal - normal_) / kTrend);
  }
  last_ = now;
  last_position_ = at.position;
  fibre_ = thick;
  height_ = height;
  const double share = std::clamp((turns_ - kFelt) / (kFaded - kFelt), 0.0, 1.0);
  if (!(share > 0 && thick > 0)) return {0, {}, normal_};
  return {share, fibre * (std::clamp(above_line(), -wave_, wave_) / thick), normal_};
}

bool TextureFade::run_over(double way, double height, int pieces, double unfelt) noexcept {
  if (!(way > 0)) return false;
  const double slope = (height - std::exchange(height_, height)) / way;
  slope_ += (slope - slope_) / (kTrend * pieces);
  const double off = slope - slope_;
  unevenness_ += (off * off - unevenness_) / (kTrend * pieces);
  if ((off > 0) == rising_ || !(off * off > kClear * kClear * unevenness_)) {
    swing_ += off * way;
    return false;
  }
  rising_ = off > 0;
  const double high = std::abs(std::exchange(swing_, off * way));
  // A single step of the surface is no wave: the mean grows by a quarter of itself per turn at most.
  wave_ += (std::min(high, 2 * std::max(wave_, unfelt)) - wave_) * kWave;
  return high > unfelt;
}

void TextureFade::shift_to(double height) noexcept {
  for (double& h : heights_) h += height - height_;
  height_ = height;
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
