#include <relief/core/near_surface.h>
#include <relief/core/sweep.h>
#include <relief/haptics/contact/leading_normal.h>
#include <relief/haptics/contact/proxy.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace relief {

namespace {

using detail::distance2;
using detail::kAnywhere;

constexpr double kClearWays = 16;  // ways like the last one for which a clear ball is looked for
constexpr int kClearSamples = 64;  // that may be placed to find one: 1.6 us at 25 ns each

}  // namespace

void Proxy::start(const SlabMesh& mesh, Vec3d place, const std::optional<SlabCoord>& at) noexcept {
  let_go();
  known_ = true;
  last_ = place;
  model_ = 0;  // the surface may have risen
  if (at) above_ = Above{*at, SlabOrigin(mesh, at->slab)};
}

bool Proxy::step(const Snapshot& model, Vec3d cursor) noexcept {
  rise_ = 0;
  lost_ = fresh_ = has_left_ = settling_ = false;
  if (!std::exchange(known_, true)) {
    last_ = cursor;
    model_ = model.number();
    look_below(model, cursor);
    return false;
  }
  MicroTriangles surface(model);
  const bool changed = std::exchange(model_, model.number()) != model.number();
  if (changed || !settled_) {
    const bool was_held = held_, felt = carry(surface);
    settling_ = felt && (was_held || held_);
  }
  const Vec3d move = cursor - last_;
  travel_ = length(move);
  if (!held_) meet(surface, cursor);
  if (held_) pursue(surface, cursor, move, detail::budget(travel_, length(place_.position - cursor)));
  last_ = cursor;
  depth_ = held_ ? length(place_.position - cursor) : 0;
  if (depth_ > 0) way_out_ = (place_.position - cursor) / depth_;
  samples_placed_ = surface.placed();
  return held_;
}

void Proxy::let_go() noexcept {
  held_ = open_ = false;
  settled_ = true;
  ledger_.clear();
  above_.reset();
  under_.slab = kNoSlab;
  normals_ = {};
}

void Proxy::hold(MicroTriangles& surface, const SurfacePlace& place) noexcept {
  held_ = fresh_ = true;
  land(place);
  know_corners(surface.mesh());
  above_.reset();
}

void Proxy::know_corners(const SlabMesh& mesh) noexcept {
  if (slab_ == place_.triangle.slab && foothold_.is_in(mesh)) return;
  slab_ = place_.triangle.slab;
  foothold_.stand_in(mesh, slab_);
  corners_ = mesh.corners(slab_);
  under_.slab = kNoSlab;
}

void Proxy::land(const SurfacePlace& place) noexcept {
  place_ = place;
  ledger_.clear();
}

bool Proxy::carry(MicroTriangles& surface) noexcept {
  const bool recut = held_ && settled_ && !foothold_.is_in(surface.mesh());
  const Vec3d was = place_.position;
  if (held_) {
    lost_ = !measure_again(surface);
    if (lost_) let_go();
  }
  if (recut && held_ && detail::stays_unfelt(length(place_.position - was), depth_)) return false;
  if (!held_ && !risen_past(surface)) look_below(surface.model(), last_);
  ledger_.clear();  // what an edit gives is no gain of the hand
  settled_ = !held_ || pursue(surface, last_, {}, kAnywhere);
  return true;
}

std::optional<SurfacePlace> Proxy::place_in(MicroTriangles& surface) const noexcept {
  SurfacePlace now = place_;
  if (foothold_.is_in(surface.mesh())) {
    if (!surface.has(now.triangle)) return std::nullopt;
    surface.measure(now.triangle);
    now.position = now.triangle.point(now.weights);
    return now;
  }
  SlabCoord at{.slab = now.triangle.slab, .alpha = 0.5};
  for (std::size_t k = 0; k < 3; ++k) {
    at.u += now.weights[k] * now.triangle.corners[k].i / foothold_.intervals();
    at.v += now.weights[k] * now.triangle.corners[k].j / foothold_.intervals();
  }
  return foothold_.find(surface, at, now.position);
}

bool Proxy::measure_again(MicroTriangles& surface) noexcept {
  const auto now = place_in(surface);
  if (!now) return false;
  const Vec3d was = place_.position;
  place_ = *now;
  know_corners(surface.mesh());
  if (place_.position != was) rise_ = dot(place_.position - was, point_of(surface, place_, normals_).normal);
  return true;
}

std::optional<SlabCoord> Proxy::above_in(const SlabMesh& mesh) noexcept {
  if (!above_) return std::nullopt;
  if (const auto at = heir(above_->origin, mesh, above_->at)) return at;
  return locate(mesh, last_, hint_);
}

bool Proxy::risen_past(MicroTriangles& surface) noexcept {
  const auto at = above_in(surface.mesh());
  if (!at || !(displacement_at(surface.model(), at->slab, at->u, at->v) > at->alpha)) return false;
  const auto place = surface.place_at(at->slab, at->u, at->v);
  if (!place) return false;
  hold(surface, *place);
  rise_ = length(place->position - last_);
  return true;
}

void Proxy::meet(MicroTriangles& surface, Vec3d cursor) noexcept {
  if (!is_clear(surface, cursor)) {
    Sweep sweep(surface, last_, cursor, Crossing::In);
    if (const auto place = sweep.run()) return hold(surface, *place);
    open_ = true;
    if (sweep.last_slab() != kNoSlab) hint_.last = {sweep.last_slab(), 1.0 / 3, 1.0 / 3, 0.5};
  }
  look_below(surface.model(), cursor);
}

bool Proxy::is_clear(MicroTriangles& surface, Vec3d cursor) noexcept {
  const std::uint64_t number = surface.model().number();
  const double way = length(cursor - last_);
  if (clear_.model == number && std::max(length(cursor - clear_.centre), length(last_ - clear_.centre)) < clear_.radius)
    return true;
  // Beside the surface it would be in vain: after a way that had to be swept it is tried again.
  if (!std::exchange(open_, false)) return false;
  clear_ = {number, cursor, detail::clear_around(surface, cursor, way, kClearWays * way, clear_.nearest, kClearSamples),
            clear_.nearest};
  open_ = clear_.radius > way;
  if (!open_) clear_.radius = 0;  // it is not known
  return open_;
}

void Proxy::look_below(const Snapshot& model, Vec3d cursor) noexcept {
  above_.reset();
  const auto at = locate(model.slab_mesh(), cursor, hint_);
  if (at && !hole_at(model, at->slab, at->u, at->v) && at->alpha >= displacement_at(model, at->slab, at->u, at->v))
    above_ = Above{*at, SlabOrigin(model.slab_mesh(), at->slab)};
}

bool Proxy::pursue(MicroTriangles& surface, Vec3d cursor, Vec3d move, double budget) noexcept {
  const detail::Descent descent = detail::descend(surface, place_, cursor);
  bool rests = descent.ended;
  if (!(descent.way > 0)) {
    place_ = descent.rest;  // another triangle may be the one that the cursor is behind
  } else {
    const Vec3d before = place_.position, out = before - cursor;
    const double little = detail::kToMinimum * length(detail::square_to(out, move));
    if (!(descent.ended && descent.way <= little) && past_the_middle(surface, cursor)) {
      rests = true;
      go_along(surface, cursor, move, descent);
    } else {
      detail::follow(surface, place_, descent, cursor, budget);
      ledger_.settle();
    }
    ledger_.book(before, place_.position, cursor - move * 0.5);
  }
  leave(surface, cursor);
  if (held_) know_corners(surface.mesh());
  return rests;
}

bool Proxy::past_the_middle(MicroTriangles& surface, Vec3d cursor) noexcept {
  const Vec3d end = place_.position + (cursor - place_.position) * detail::kMiddle;
  return Sweep(surface, detail::below(surface, place_), end, Crossing::Out).run().has_value();
}

void Proxy::go_along(MicroTriangles& surface, Vec3d cursor, Vec3d move, const detail::Descent& descent) noexcept {
  const Vec3d out = place_.position - cursor, own = detail::square_to(out, move);
  const double way = length(own), depth = length(out);
  if (!(way > 0)) return;
  const bool near =
      descent.ended && detail::is_near_by(descent.way, depth) && !detail::leads_into_air(surface, descent.rest, cursor);
  if (near || length(descent.rest.position - place_.position - own) <= way) {
    detail::follow(surface, place_, descent, cursor, detail::kToMinimum * way);
    ledger_.settle();
    return;
  }
  // To a minimum that is farther away the point would run round the part: it stays over the hand.
  const Vec3d up = normalized(place_.triangle.area()), past = detail::past(up, move);
  const Vec3d goal = place_.position + past + ledger_.owed();
  SurfacePlace next = place_;
  int tries = detail::kTries;
  if (past != Vec3d{}) detail::walk(surface, next, goal, detail::kAlong * length(past), tries);
  if (ledger_.allows(place_.position, next.position, cursor - move * 0.5)) place_ = next;
  ledger_.owe(goal - place_.position, up, depth);
}

void Proxy::leave(MicroTriangles& surface, Vec3d cursor) noexcept {
  if (!detail::leads_into_air(surface, place_, cursor)) return;
  Sweep sweep(surface, detail::above(surface, place_), cursor, Crossing::In);
  const auto landing = sweep.run();
  if (landing && !(distance2(landing->position, cursor) < distance2(place_.position, cursor))) return;
  has_left_ = true;
  left_at_ = place_.position;
  if (landing) return land(*landing);
  hint_.last = surface.coordinates(place_);
  if (sweep.last_slab() != kNoSlab) hint_.last.slab = sweep.last_slab();
  let_go();
  look_below(surface.model(), cursor);
}

SurfacePoint Proxy::surface(const Snapshot& model) noexcept {
  MicroTriangles surface(model);
  const auto now = model.number() == model_ ? place_ : place_in(surface);
  return now ? point_of(surface, *now, normals_) : SurfacePoint{};
}

Proxy::Description Proxy::describe(const Snapshot& model) noexcept {
  Description now;
  now.surface = surface(model);
  const Vec3d leading =
      detail::facing(way_out_, detail::leading_normal(place_, normals_.normals, now.surface.normal, last_));
  // What is felt changes by no more than the point may go, in depth and direction together.
  const double may = detail::budget(travel_, depth()), deeper = depth() - described_;
  now.turn = fresh_ || !(depth() > 0) ? kAnywhere : std::sqrt(std::max(0.0, may * may - deeper * deeper)) / depth();
  normal_ = turned_by(normal_, leading, now.turn);
  now.normal = normal_;
  described_ = depth();
  if (under_.slab != now.surface.slab) under_ = {now.surface.slab, now.surface.u, now.surface.v, now.surface.alpha};
  const bool inside =
      model.slab_mesh().box(under_.slab).contains(last_) && solve(detail::LinearForm(corners_, last_), {}, under_) &&
      std::min({under_.u, under_.v, 1 - under_.u - under_.v}) >= 0 && under_.alpha >= 0 && under_.alpha <= 1;
  if (!inside) under_.slab = kNoSlab;
  now.alpha = inside ? under_.alpha : now.surface.alpha;
  return now;
}

}  // namespace relief
