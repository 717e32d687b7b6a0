#include <relief/core/near_surface.h>
#include <relief/core/point_shell.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relief {

namespace {
constexpr double kNorm = 16;
constexpr double kForesight = 4;   // lengths of its way for which a point is told at once that it is clear
constexpr std::size_t kRays = 16;  // points in a tick that are looked for below the slabs
constexpr int kSearch = 30;        // samples placed that a search, or whatever else a point takes, is worth

double to_the_15th(double x) noexcept {
  const double x2 = x * x, x4 = x2 * x2, x8 = x4 * x4;
  return x8 * x4 * x2 * x;
}
}  // namespace

PointShell::PointShell(std::span<const Vec3d> points)
    : points_(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(std::min(points.size(), kMostPoints))),
      free_(points_.size()),
      proxies_(points_.size()),
      followed_(points_.size(), 0) {}

double PointShell::most_stiffening() const noexcept {
  return std::pow(static_cast<double>(std::max<std::size_t>(points_.size(), 1)), 2 / kNorm);
}

void PointShell::reset() noexcept {
  std::fill(followed_.begin(), followed_.end(), std::uint8_t{0});
  for (Proxy& proxy : proxies_) proxy.reset();
  known_ = false;
  held_ = 0;
}

bool PointShell::clear(const Snapshot& model, const ToolPose& pose) noexcept {
  // What is seen in a slab is above its surface in every tick; what is in none may be below them, and only a ray tells.
  LocateHint hint;
  bool all = std::ranges::none_of(points_, [&](Vec3d own) {
    const auto contact = probe(model, pose.place(own), hint);
    return contact && contact->touching();
  });
  const Box3d& bounds = model.slab_mesh().bounds();
  for (std::size_t rays = 0; all && clean_ < points_.size() && rays < kRays; ++clean_) {
    const Vec3d place = pose.place(points_[clean_]);
    if (!bounds.contains(place)) continue;
    ++rays;
    all = !inside(model, place, hint);
  }
  const bool done = all && clean_ == points_.size();
  if (!all || done) clean_ = 0;
  return done;
}

bool PointShell::stays_clear(detail::MicroTriangles& surface, Free& point, Vec3d now) noexcept {
  if (point.room < 0) {  // another model: has its surface risen past the point?
    work_ += kSearch;
    const auto contact = probe(surface.model(), point.last, hint_);
    if (contact && contact->touching()) rise_ = std::max(rise_, contact->depth);
    point.room = 0;
  }
  const double way = length(now - point.last);
  if (way < point.room) return true;
  for (const double reach : {kForesight * way, way * (1 + 1e-9)}) {
    work_ += kSearch;
    if (!detail::nothing_near(surface, now, reach)) continue;
    point = {now, reach};
    return true;
  }
  return false;
}

void PointShell::work_on(detail::MicroTriangles& surface, std::size_t k, Vec3d now, Ease ease) noexcept {
  Proxy& proxy = proxies_[k];
  Free& point = free_[k];
  // A point that was near the surface follows it when it is changed.
  const bool follows = followed_[k] != 0 && point.room < 0;
  if (!proxy.held() && !follows && stays_clear(surface, point, now)) {
    followed_[k] = 0;
    return;
  }
  if (followed_[k] == 0) {
    proxy.reset();
    static_cast<void>(proxy.step(surface.model(), point.last, ease));
    followed_[k] = 1;
  }
  static_cast<void>(proxy.step(surface.model(), now, ease));
  point = {now, 0};
  work_ += kSearch + proxy.samples_placed();
  ++worked_;
  rise_ = std::max(rise_, proxy.rise());
  lost_ = lost_ || proxy.lost();
}

bool PointShell::step(const Snapshot& model, const ToolPose& pose, Ease ease) noexcept {
  rise_ = grown_ = depth_ = 0;
  lost_ = false;
  worked_ = work_ = 0;
  push_ = twist_ = {};
  const std::size_t count = points_.size();
  if (!known_ || model.number() != model_) {
    for (std::size_t k = 0; k < count; ++k) {
      free_[k].room = known_ ? -1 : 0;
      if (!known_) free_[k].last = pose.place(points_[k]);
    }
    model_ = model.number();
  }
  if (!std::exchange(known_, true)) return false;
  detail::MicroTriangles surface(model);
  const std::size_t first = next_;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t number = (first + k) % count;
    if (work_ >= kWork) {
      next_ = number;
      break;
    }
    work_on(surface, number, pose.place(points_[number]), ease);
  }
  sum(pose);
  return held_ > 0;
}

void PointShell::sum(const ToolPose& pose) noexcept {
  // The way out of a point that was not worked on in this tick stays as it was; only the point has moved.
  const auto depth_of = [&](std::size_t k) noexcept {
    const Proxy& proxy = proxies_[k];
    const Vec3d moved = pose.place(points_[k]) - free_[k].last;
    return std::max(0.0, proxy.depth() - dot(moved, proxy.way_out()));
  };
  double deepest = 0;
  held_ = 0;
  for (std::size_t k = 0; k < points_.size(); ++k) {
    if (!proxies_[k].held()) continue;
    ++held_;
    if (const double depth = depth_of(k); depth > deepest) {
      deepest = depth;
      deepest_ = pose.place(points_[k]);
      surface_ = proxies_[k].surface();
    }
  }
  if (!(deepest > 0)) return;
  double norm = 0;
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const Proxy& proxy = proxies_[k];
    if (!proxy.held()) continue;
    const double share = depth_of(k) / deepest, weight = to_the_15th(share);
    const Vec3d push = proxy.way_out() * weight;
    norm += weight * share;
    push_ += push;
    twist_ += cross(pose.place(points_[k]) - pose.origin, push);
    grown_ += weight * proxy.grown();
  }
  // The gradient of D^2 / 2, where D is the norm: D (depth / D)^15 along each way out.
  depth_ = deepest * std::pow(norm, 1 / kNorm);
  const double scale = deepest * std::pow(norm, 2 / kNorm - 1);
  push_ *= scale;
  twist_ *= scale;
  grown_ *= scale / std::max(depth_, 1e-300);
}

}  // namespace relief
