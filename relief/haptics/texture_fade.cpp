#include <relief/haptics/texture_fade.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relief {

namespace {
// Turns per tick up to which all is felt, and from which nothing is (ItEndsAsSoonAsAfterAnyFasterHand).
constexpr double kFelt = 0.9, kFaded = 1;
// Share of the last tick in the mean of turns: faded after 120 ms (S11, NothingIsTakenOffWhatCanBeFelt).
constexpr double kCount = 1.0 / 32;
// Ticks over which the means of slopes and normals go: four waves of two ticks (WhatItRanOverLatelyIsThatOfEightTicks).
constexpr double kTrend = 8;
// Of the root mean square that a slope must be off the mean to be on a side (NothingIsTakenOffWhatCanBeFelt).
constexpr double kClear = 0.5;
// Of one tick's way, which bounds its cost: 16 cells (OfATicksWayItLooksAtThirtyTwoPieces).
constexpr int kMostPieces = 32;
// That count in one tick: one wave, which is too fine by half already (ATickInThreeThatRunsOverManyWavesIsNotMost).
constexpr int kMostTurns = 2;
// Share of the last turn in the mean of their heights: over two waves (WhatIsTakenOffGrowsByAQuarterPerTurn).
constexpr double kWave = 0.25;

// Of the way: so near to its start the tool touched in the last tick, if it touches with what it touched with then.
// Else it has changed over to another of its points, or to another crest. Any share tells the two apart.
constexpr double kSamePlace = 0.5;

double displacement_in_root(const Snapshot& model, SlabId root, double u, double v) noexcept {
  std::array<double, 3> w = {1 - u - v, u, v};
  const SlabId slab = model.slab_mesh().descend(root, w);
  return displacement_at(model, slab, w[1], w[2]);
}

/// How u and v change along a way, as far as that lies in the slab.
std::array<double, 2> along(const SlabCorners& corners, const SurfacePoint& at, Vec3d way) noexcept {
  const auto corner = [&](std::size_t k) {
    return corners.inner[k] + (corners.outer[k] - corners.inner[k]) * at.alpha;
  };
  const Vec3d first = corner(0), a = corner(1) - first, b = corner(2) - first, across = cross(a, b);
  const double area2 = dot(across, across);
  if (!(area2 > 0)) return {0, 0};
  return {dot(cross(way, b), across) / area2, dot(cross(a, way), across) / area2};
}
}  // namespace

TextureFade::InRoot TextureFade::in_root(const SlabMesh& mesh, const RootPlace& place, double u, double v) noexcept {
  const double parts = 1 << place.level;
  const std::array<double, 3> w = place.in_root(std::array<double, 3>{1 - u - v, u, v});
  return {mesh.roots_number(), place.root, w[1] / parts, w[2] / parts};
}

TextureFade::Fade TextureFade::step(const Snapshot& model, const Felt& felt, double unfelt) noexcept {
  const SurfacePoint& at = felt.at;
  const SlabMesh& mesh = model.slab_mesh();
  const SlabCorners corners = mesh.corners(at.slab);
  const RootPlace place = mesh.root_place(at.slab);
  const InRoot now = in_root(mesh, place, at.u, at.v);
  const std::array<double, 3> w = {1 - at.u - at.v, at.u, at.v};
  const Vec3d fibre = corners.weighted(corners.outer, w) - corners.weighted(corners.inner, w);
  const double thick = length(fibre), height = at.alpha * thick;
  // Over the inner end of the fibre. The height of the tool is that of its origin; of a point it is the surface's.
  const double held = thick > 0 ? height + dot(felt.held - at.position, fibre) / thick : 0;
  if (last_.root == kNoSlab) {
    heights_.fill(held);
    held_ = held;
    normal_ = felt.normal;
  } else {
    const Vec3d step = felt.held - origin_, start = at.position - step;
    const bool same_cage = now.roots == last_.roots;
    InRoot from = last_;
    if (!same_cage || !(length(start - last_position_) <= kSamePlace * length(step))) {
      shift_to(thick > 0 ? held - dot(step, fibre) / thick : 0);
      const auto [du, dv] = along(corners, at, -step);
      from = in_root(mesh, place, at.u + du, at.v + dv);
      if (!from.is_in_its_root()) from = now;
      height_ = displacement_in_root(model, from.root, from.u, from.v) * thick;
    }
    const bool same_root = same_cage && now.root == from.root;
    const double du = now.u - from.u, dv = now.v - from.v;
    const double cells = same_root ? mesh.intervals(at.slab) * double(1 << place.level) *
                                         std::max({std::abs(du), std::abs(dv), std::abs(du + dv)})
                                   : 0;
    // Waves are two cells long at least, so that none is too fine for a way within a cell.
    const int pieces = std::clamp(static_cast<int>(2 * cells), 1, kMostPieces);
    const double way = length(step), ends = (height_ + height) / 2;
    double sum = ends;
    int turns = 0;
    for (int k = 1; k < pieces; ++k) {
      const double part = double(k) / pieces;
      const double there = displacement_in_root(model, now.root, from.u + du * part, from.v + dv * part) *
                           (fibre_ + (thick - fibre_) * part);
      sum += there;
      turns += run_over(way / pieces, there, pieces, unfelt) ? 1 : 0;
    }
    if (pieces > 1) turns += run_over(way / pieces, height, pieces, unfelt) ? 1 : 0;
    // What lies between two roots is not looked at.
    if (same_root) turns_ = std::min(turns_ + (std::min(turns, kMostTurns) - turns_) * kCount, kFaded);
    // Of a point it is known where it was between two ticks. A wider tool rests on the highest places there.
    heights_[tick_] = (held_ + held) / 2 + (felt.is_point ? sum / pieces - ends : 0);
    tick_ = (tick_ + 1) % kTicks;
    normal_ = normalized(normal_ + (felt.normal - normal_) / kTrend);
  }
  last_ = now;
  last_position_ = at.position;
  origin_ = felt.held;
  fibre_ = thick;
  height_ = height;
  held_ = held;
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
  for (double& h : heights_) h += height - held_;
  held_ = height;
}

double TextureFade::above_line() const noexcept {
  // Least squares over the middles of the ticks, half a tick further to now.
  constexpr double kN = kTicks, kMiddle = (kN - 1) / 2;
  double line = 0;
  for (std::size_t k = 0; k < kTicks; ++k)  // the oldest comes first
    line += heights_[(tick_ + k) % kTicks] * (1 / kN + 6 * (double(k) - kMiddle) / (kN * kN - 1));
  return held_ - line;
}

}  // namespace relief
