#include <relief/core/near_surface.h>
#include <relief/haptics/contact/point_shell.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relief {

namespace {

// 1,000 equal depths push 2.37 times as hard as one, 1,000^(2/16) (PointsEquallyDeepPushByTheEighthRootOfTheirNumber).
constexpr double kNorm = 16;
// Lengths of its way for which a point is said at once that it is clear (AFreePointIsClearForThreeOfItsWays).
constexpr double kForesight = 3;
// Points in a tick that are looked for below the slabs (LooksForFourPointsAmongTheSlabsATick).
constexpr std::size_t kRays = 4;
constexpr double kRest = 1e-6;  // of the tool's reach: a way that is none
// What takes how long, in the time of a sample, beside the samples that it places or the squares that it looks at.
constexpr int kCheck = 32, kStep = 10;
constexpr int kFirst = 200;  // to begin a contact; to tell a point that it is clear may take no longer

double to_the_15th(double x) noexcept {
  const double x2 = x * x, x4 = x2 * x2, x8 = x4 * x4;
  return x8 * x4 * x2 * x;
}
}  // namespace

PointShell::PointShell(std::span<const Vec3d> points)
    : points_(std::min(points.size(), kMostPoints)), proxies_(points_.size()) {
  Box3d box;
  for (std::size_t k = 0; k < points_.size(); ++k) {
    points_[k].own = points[k];
    box.add(points[k]);
  }
  if (points_.empty()) return;
  ball_.middle = box.centre();
  for (const Point& point : points_) {
    ball_.radius = std::max(ball_.radius, length(point.own - ball_.middle));
    reach_ = std::max(reach_, length(point.own));
  }
}

double PointShell::most_stiffening() const noexcept {
  return std::pow(static_cast<double>(std::max<std::size_t>(points_.size(), 1)), 2 / kNorm);
}

void PointShell::reset() noexcept {
  started_ = false;
  held_ = 0;
  answer_ = {};
}

bool PointShell::clear(const Snapshot& model, const ToolPose& pose) noexcept {
  LocateHint hint;
  // Where no surface is in the ball around the tool it is all on one side.
  MicroTriangles surface(model);
  SlabId nearest = kNoSlab;
  const Vec3d middle = pose.place(ball_.middle);
  if (detail::clear_around(surface, middle, ball_.radius, 2 * ball_.radius, nearest) > ball_.radius) {
    clean_ = 0;
    return !inside(model, middle, hint);
  }
  // What is seen in a slab is above its surface in every tick; what is in none may be below them, and only a ray tells.
  bool all = std::ranges::none_of(points_, [&](const Point& point) {
    const auto contact = probe(model, pose.place(point.own), hint);
    return contact && contact->touching();
  });
  const Box3d& bounds = model.slab_mesh().bounds();
  for (std::size_t rays = 0; all && clean_ < points_.size() && rays < kRays; ++clean_) {
    const Vec3d place = pose.place(points_[clean_].own);
    if (!bounds.contains(place)) continue;
    ++rays;
    all = !inside(model, place, hint);
  }
  const bool done = all && clean_ == points_.size();
  if (!all || done) clean_ = 0;
  return done;
}

bool PointShell::is_buried(const Snapshot& model, const ToolPose& pose) const noexcept {
  LocateHint nothing;
  return !points_.empty() && inside(model, pose.place(points_.front().own), nothing);
}

bool PointShell::stays_clear(MicroTriangles& surface, Point& point, std::optional<SlabCoord>& risen) noexcept {
  if (point.old_model) {
    point.old_model = false;
    work_ += kCheck;
    const auto contact = probe(surface.model(), point.last, hint_);
    if (contact && contact->touching()) {
      risen = contact->at;
      return false;
    }
  }
  const double way = length(point.now - point.last);
  if (way < point.room || way == 0) return true;
  work_ += kCheck;
  // A ball around the middle of the way that has the way in it.
  const double half = 0.5 * way * (1 + 1e-9);
  const double room =
      detail::clear_around(surface, (point.now + point.last) * 0.5, half, kForesight * way, point.nearest, kFirst);
  if (!(room > half)) return false;
  point.last = point.now;
  point.room = room - half;
  return true;
}

void PointShell::work_on(MicroTriangles& surface, Point& point, Proxy& proxy) noexcept {
  waited_ = std::max(waited_, static_cast<int>(tick_ - point.dealt_with) - 1);
  point.dealt_with = tick_;
  const int placed = surface.placed();
  if (!point.held) {
    std::optional<SlabCoord> risen;
    const bool clear = stays_clear(surface, point, risen);
    work_ += surface.placed() - placed;
    if (clear) return;
    proxy.start(surface.mesh(), point.last, risen);
    work_ += kFirst;
  }
  point.held = proxy.step(surface.model(), point.now);
  point.last = point.now;
  point.room = 0;
  point.old_model = false;
  settling_ = settling_ || proxy.settling();
  point.way_out = proxy.way_out();
  point.depth = proxy.depth();
  const int samples = proxy.samples_placed();
  work_ +=
      kStep + samples * 4 / 3;  // as measured: beside a placed sample its triangle is looked at (OnePointIsAsAProxy)
  ++worked_;
  rise_ = std::max(rise_, proxy.rise());
  if (proxy.lost()) {
    work_ += kCheck;
    lost_ = lost_ || inside(surface.model(), point.now, hint_);
  }
}

void PointShell::start(const Snapshot& model, const ToolPose& pose) noexcept {
  started_ = true;
  pose_ = pose;
  model_ = model.number();
  cage_ = model.slab_mesh().number();
  most_depth_ = 0;
  for (Point& point : points_) {
    const Vec3d place = pose.place(point.own);
    point = {.own = point.own, .now = place, .last = place, .dealt_with = tick_};
  }
}

void PointShell::move(const Snapshot& model, const ToolPose& pose) noexcept {
  const bool other = model.number() != model_, other_cage = model.slab_mesh().number() != cage_;
  model_ = model.number();
  cage_ = model.slab_mesh().number();
  // Where the cage is another one each held point tells for itself whether that is felt.
  settling_ = other && !other_cage;
  for (Point& point : points_) {
    point.old_model = point.old_model || (other && !(other_cage && point.held));
    if (other && !point.held) {
      if (length(point.now - point.last) < point.room) point.last = point.now;
      point.room = 0;
    }
    point.now = pose.place(point.own);
  }
}

bool PointShell::step(const Snapshot& model, const ToolPose& pose) noexcept {
  rise_ = 0;
  lost_ = false;
  held_ = worked_ = work_ = waited_ = 0;
  const Answer before = std::exchange(answer_, {});
  ++tick_;
  if (!started_) {
    start(model, pose);
    return false;
  }
  const bool same_model = model.number() == model_;
  move(model, pose);
  MicroTriangles surface(model);
  // From where the last tick came to its end.
  for (std::size_t k = 0; k < points_.size() && work_ < kWork; ++k) {
    work_on(surface, points_[next_], proxies_[next_]);
    next_ = next_ + 1 < points_.size() ? next_ + 1 : 0;
  }
  sum(pose.origin);
  if (answer_.depth > 0) surface_ = proxies_[deepest_].surface(model);
  // What an edit changes is blended in the servo.
  if (same_model && !settling_ && before.depth > 0) follow(before, pose);
  pose_ = pose;
  return held_ > 0 || answer_.depth > 0;
}

void PointShell::follow(const Answer& before, const ToolPose& pose) noexcept {
  const Answer rests = answer_;
  const Vec3d move = pose.origin - pose_.origin;
  const double turn = 2 * std::acos(std::min(1.0, std::abs(dot(pose.orientation, pose_.orientation))));
  // Where the tool would be if nothing gave way, from where it is.
  const Vec3d was = before.push - move;
  const double way = std::max(length(rests.push - was), length(rests.twist - before.twist) / reach_);
  const double may = std::max(detail::budget(length(move) + reach_ * turn, length(was)), kRest * reach_);
  if (!(way > may)) return;
  const double share = may / way;
  answer_.push = was + (rests.push - was) * share;
  answer_.twist = before.twist + (rests.twist - before.twist) * share;
  answer_.depth = before.depth + (rests.depth - before.depth) * share;
}

void PointShell::sum(Vec3d origin) noexcept {
  most_depth_ = 0;
  for (std::size_t k = 0; k < points_.size(); ++k) {
    if (!points_[k].held) continue;
    ++held_;
    settling_ = settling_ || points_[k].old_model;
    if (const double depth = points_[k].depth_now(); depth > most_depth_) {
      most_depth_ = depth;
      deepest_ = k;
    }
  }
  if (!(most_depth_ > 0)) return;
  double norm = 0, weights = 0, around = 0;
  Vec3d mean;  // from the deepest point
  const Vec3d centre = points_[deepest_].now, across = points_[deepest_].way_out;
  for (const Point& point : points_) {
    if (!point.held) continue;
    const double share = point.depth_now() / most_depth_, weight = to_the_15th(share);
    const Vec3d push = point.way_out * weight;
    norm += weight * share;
    const Vec3d from = point.now - centre, aside = from - across * dot(from, across);
    weights += weight;
    mean += from * weight;
    around += dot(aside, aside) * weight;
    answer_.push += push;
    answer_.twist += cross(point.now - origin, push);
  }
  mean = mean / weights;
  touched_ = centre + mean;
  const Vec3d aside = mean - across * dot(mean, across);
  spread_ = std::sqrt(std::max(0.0, around / weights - dot(aside, aside)));
  // The gradient of D^2 / 2, where D is the norm: D (depth / D)^15 along each way out.
  answer_.depth = most_depth_ * std::pow(norm, 1 / kNorm);
  const double scale = most_depth_ * std::pow(norm, 2 / kNorm - 1);
  answer_.push *= scale;
  answer_.twist *= scale;
}

}  // namespace relief
