#include <relief/core/sweep.h>
#include <relief/haptics/contact/ball_mover.h>
#include <relief/haptics/contact/ball_proxy.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relief {

using namespace detail::ball;  // NOLINT(google-build-using-namespace): the machinery of this file
using detail::kAnywhere;
using detail::NearTriangle;

struct BallProxy::Memory : Room {};

BallProxy::OwnMemory::OwnMemory() : memory_(std::make_unique<Memory>()) {}
BallProxy::OwnMemory::OwnMemory(const OwnMemory& other) : memory_(std::make_unique<Memory>(*other.memory_)) {}
BallProxy::OwnMemory::OwnMemory(OwnMemory&&) noexcept = default;
BallProxy::OwnMemory& BallProxy::OwnMemory::operator=(const OwnMemory& other) { return *this = OwnMemory(other); }
BallProxy::OwnMemory& BallProxy::OwnMemory::operator=(OwnMemory&&) noexcept = default;
BallProxy::OwnMemory::~OwnMemory() = default;

void BallProxy::reset() noexcept {
  memory_->forget();
  *this = BallProxy(std::move(memory_));
}

bool BallProxy::is_looking() const noexcept { return unseen_ || memory_->waiting; }

bool BallProxy::clear(const Snapshot& model, Vec3d centre, double radius) noexcept {
  MicroTriangles surface(model);
  return detail::nothing_near(surface, centre, radius);
}

bool BallProxy::step(const Snapshot& model, Vec3d cursor, double radius) noexcept {
  rise_ = 0;
  searches_ = work_ = 0;
  lost_ = settling_ = false;
  const bool changed = std::exchange(model_, model.number()) != model.number();
  if (!std::exchange(known_, true)) {
    last_ = centre_ = cursor;
    cage_ = model.slab_mesh().number();
    return false;
  }
  MicroTriangles surface(model);
  if (changed) {
    memory_->forget();
    follow_surface(surface);
    unseen_ = true;
  }
  // What waits for its way to the cursor goes first: coming to rest where it is would take the time for that.
  if (unseen_ || (!settled_ && memory_->waits == 0)) {
    const bool was_held = held_, felt = carry(surface, radius);
    settling_ = felt && (was_held || held_);
  }
  if (!unseen_) go(surface, cursor, radius);
  work_ = surface.placed();
  depth_ = length(centre_ - cursor);
  if (depth_ > 0) way_out_ = (centre_ - cursor) / depth_;
  return held_ && touches_;
}

bool BallProxy::carry(MicroTriangles& surface, double radius) noexcept {
  Mover ball(surface, *memory_, centre_, radius, 0, kMostWork);
  unseen_ = ball.blind();
  if (unseen_) {
    ball.stay();
    ball.count_wait();
    return true;
  }
  if (!behind_ && is_buried(surface.model(), ball.around(), radius)) {
    // What pushes it out is the nearest side, which may be any: it goes with the place where it touched.
    const Vec3d with = std::exchange(shift_.way, {});
    if (with != Vec3d{}) {
      shift_.carried += length(with);
      centre_ += with;
      memory_->known = false;
      return carry(surface, radius);
    }
    lost_ = true;
  }
  const Shift shift = std::exchange(shift_, {});
  rise_ = std::max(0.0, shift.carried + overlap_in(ball.around(), radius) - overlap_);
  const bool recut = std::exchange(cage_, surface.mesh().number()) != surface.mesh().number();
  if (recut && settled_ && !shift.lost && detail::stays_unfelt(std::max(rise_, length(shift.way)), depth_)) {
    arrive(ball, radius);
    return false;
  }
  const bool waits = shift.leads || (held_ && past_the_middle(surface.model(), last_, radius));
  const Vec3d goal = waits ? centre_ + shift.way : last_;
  const Mover::Way way = ball.advance(goal, kAnywhere, Mover::Until::Reach, true, kSearches, kMostWork, kMostWork);
  arrive(ball, radius);
  if (waits && !way.settled) shift_ = {.way = goal - centre_, .lost = shift.lost, .leads = true};
  settled_ = overlap_ <= kRest * radius && way.settled;
  ledger_.clear();  // what an edit gives is no gain of the hand
  return true;
}

bool BallProxy::is_buried(const Snapshot& model, const Around& around, double radius) const noexcept {
  LocateHint hint;
  const auto contact = probe(model, centre_, hint);
  // Between samples that is not quite the surface of the micro-triangles: of those, only backs are left then.
  return (contact && contact->touching()) || is_behind(around, radius);
}

void BallProxy::follow_surface(MicroTriangles& surface) noexcept {
  if (!touches_) return;
  const bool here = foothold_.is_in(surface.mesh());
  const auto place =
      here ? surface.place_at(surface_.slab, surface_.u, surface_.v)
           : foothold_.find(surface, {surface_.slab, surface_.u, surface_.v, surface_.alpha}, surface_.position);
  touches_ = place.has_value();
  if (!place) {
    surface_ = {};
    shift_ = {.way = {}, .lost = true};
    return;
  }
  const Vec3d was = surface_.position;
  surface_ = point_of(surface, *place, normals_);
  foothold_.stand_in(surface.mesh(), surface_.slab);
  shift_.way += surface_.position - was;
}

bool BallProxy::past_the_middle(const Snapshot& model, Vec3d cursor, double radius) const noexcept {
  // The body that holds the ball's centre reaches a radius farther: the line through the cursor comes out of that where
  // it has been out of the material for so long.
  const Vec3d in = cursor - centre_;
  const double depth = length(in), far = detail::kMiddle * depth - radius;
  if (!(far > 0)) return false;
  MicroTriangles surface(model);  // what this takes is not the mover's
  return Sweep(surface, centre_, centre_ + in * (far / depth), Crossing::Out).run().has_value();
}

void BallProxy::go(MicroTriangles& surface, Vec3d cursor, double radius) noexcept {
  const Vec3d move = cursor - std::exchange(last_, cursor);
  const bool free = !touches_;  // until the ball has landed
  const int doubled = std::clamp(late_ - kMostWaits + 1, 0, kMostDoubled);
  // What carrying took where the model has changed does not count.
  const Limits limits = {surface.placed(), kWork << doubled};
  const int work = limits.most();
  const Vec3d out = centre_ - last_;
  const double depth = length(out);
  Mover ball(surface, *memory_, centre_, radius, free ? depth : 0, work);
  bool flies = false;  // straight, to a cursor that is too far away for one tick
  if (free) {
    const Mover::Way way = ball.advance(last_, kAnywhere, Mover::Until::Reach, false, kSearches, work, work);
    flies = way.straight && (way.cut || ball.searches() >= kSearches);
    ledger_.clear();
  } else {
    if (past_the_middle(surface.model(), last_, radius)) {
      go_along(ball, move, limits);
    } else {
      const double reach = std::max(detail::budget(length(move), depth), kRest * radius);
      static_cast<void>(ball.advance(last_, reach, Mover::Until::Reach, false, kSearches, work, work));
      ledger_.settle();
    }
    ledger_.book(centre_, ball.centre(), last_ - move * 0.5);
  }
  arrive(ball, radius);
  ball.count_wait();
  touch(surface, ball.around(), radius, flies);
  searches_ += ball.searches();
}

void BallProxy::go_along(Mover& ball, Vec3d move, const Limits& limits) noexcept {
  const int work = limits.most();
  const Vec3d out = centre_ - last_, own = detail::square_to(out, move);
  const double way = length(own), depth = length(out);
  const NearTriangle* barrier = that_pushes_most(ball.around(), out / depth, kAnywhere);
  if (barrier == nullptr) {
    // The straight segment leads into the air.
    const double reach = detail::budget(length(move), depth);
    static_cast<void>(ball.advance(last_, reach, Mover::Until::Touch, false, kSearches, work, work));
    ledger_.clear();
    return;
  }
  if (!(way > 0)) return;
  const Vec3d up = -normalized(barrier->nearest), past = detail::past(up, move);
  const Mover::Way ahead = ball.advance(last_, detail::kToMinimum * way, Mover::Until::Rest, false, kSearches / 2,
                                        limits.half(), limits.half());
  const Vec3d rest = ball.centre();
  const bool near = ahead.settled && detail::is_near_by(ahead.slid, depth) && rest != last_;
  if (near || length(rest - centre_ - own) <= way) {
    ball.put_back_within();
    ledger_.settle();
    return;
  }
  // To a minimum that is farther away the ball would run round the part: it stays over the hand.
  ball.put_back_to_start();
  const Vec3d beside = centre_ + past + detail::square_to(up, ledger_.owed());
  const double far = length(past);
  static_cast<void>(
      ball.advance(beside - up * far, detail::kAlong * far, Mover::Until::Reach, false, kSearches / 2, work, work));
  if (!ledger_.allows(centre_, ball.centre(), last_ - move * 0.5)) ball.put_back_to_start();
  ledger_.owe(beside - ball.centre(), up, depth);
}

void BallProxy::arrive(Mover& ball, double radius) noexcept {
  ball.stay();
  centre_ = ball.centre();
  held_ = centre_ != last_;
  overlap_ = overlap_in(ball.around(), radius);
  behind_ = is_behind(ball.around(), radius);
}

std::optional<SurfacePoint> BallProxy::place_ahead(MicroTriangles& surface, const Around& around,
                                                   double radius) noexcept {
  const Vec3d way = last_ - centre_;
  if (const NearTriangle* touched = that_pushes_most(around, normalized(-way), radius * (1 + kSkin))) {
    double u = 0, v = 0;
    const int n = surface.mesh().intervals(touched->slab);
    for (std::size_t k = 0; k < 3; ++k) {
      // Not on its rim: beyond that may be a hole.
      const double weight = touched->weights[k] + kSlack * (1.0 / 3 - touched->weights[k]);
      u += weight * touched->corners[k].i / n;
      v += weight * touched->corners[k].j / n;
    }
    return point_at(surface, touched->slab, u, v, normals_);
  }
  // A ball that has not landed yet gets no place from what is ahead, and one in free flight keeps the last one.
  if (surface_.slab == kNoSlab) return std::nullopt;
  MicroTriangles ahead(surface.model());  // what this takes is not the mover's
  const double depth = length(way);
  const auto place = Sweep(ahead, centre_, last_ + way * (radius / depth), Crossing::In).run();
  if (!place) return std::nullopt;
  return point_of(surface, *place, normals_);
}

void BallProxy::touch(MicroTriangles& surface, const Around& around, double radius, bool flies) noexcept {
  if (flies || !held_) {
    surface_ = {};
    normals_ = {};
  } else if (const auto place = place_ahead(surface, around, radius)) {
    surface_ = *place;
  }
  touches_ = surface_.slab != kNoSlab;
  under_way_ = held_ && !touches_;
  if (touches_) foothold_.stand_in(surface.mesh(), surface_.slab);
  late_ = held_ && !touches_ ? late_ + 1 : 0;
}

}  // namespace relief
