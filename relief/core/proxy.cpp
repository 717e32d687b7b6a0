#include <relief/core/micro_triangles.h>
#include <relief/core/near_surface.h>
#include <relief/core/proxy.h>
#include <relief/core/pushed_side.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace relief {

namespace {

using Weights = std::array<double, 3>;
using detail::Aside;
using detail::kFollow;
using detail::kRelax;
using detail::LinearForm;
using detail::MicroTriangles;
using detail::point_of;
using detail::same_side;

constexpr int kTries = 64;    // micro-triangles that one walk looks at
constexpr int kFewTries = 8;  // the same where there is no time
/// A cursor's way in a tick, as a share of the slabs' diagonal, from which on it counts as a leap, and what a tick then
/// takes until it is left where it is known to be clear, in units of some 12 ns.
struct Leap {
  double way;
  int work;
};
// 3 m/s and 10 m/s, where the diagonal is 0.15 m: no hand is as fast, and no servo takes the second for one.
constexpr Leap kLeap = {0.02, 400}, kFarLeap = {0.07, 270};
constexpr double kLeastShare = 1e-5;  // of a free way, which a tick looks along whatever it takes
constexpr int kBelowWork = 60;        // to see what is below where the surface was left
constexpr int kWalkWork = 240;        // when walks become short
constexpr int kClearSamples = 64;     // to find a ball without a triangle
constexpr int kSampleWork = 2;        // a sample that is placed in that
constexpr int kTryWork = 5;           // a micro-triangle that a walk looks at
constexpr int kSettle = 100;     // ticks after a change is taken over in which what the point does is of its making
constexpr double kTurn = 0.035;  // rad per tick that the normal may turn at rest
constexpr double kBack = 0.1;  // of the squared depth: what the point may go back of how it came nearer, with the hand
constexpr double kOver = 2;    // lengths of the cursor's way that the point goes back over it in a tick
constexpr double kSteep = 0.25;      // squared cosine from a triangle to a normal that is followed into its plane
constexpr double kLift = 1e-7;       // of the fibre: the point's height above the surface when it sets off
constexpr double kBehind = 1e-9;     // of the slab: how far before its start a way may already go in, for rounding
constexpr double kPad = 1e-4;        // of a cell, and of the fibre: what rounding may do to coordinates
constexpr double kClose = 0.7;       // weight of a corner from which on all triangles around it count as next
constexpr double kGain = 1 - 1e-12;  // squared distance that another triangle must win
constexpr double kAnywhere = std::numeric_limits<double>::infinity();

double det(Vec3d a, Vec3d b, Vec3d c) noexcept { return dot(a, cross(b, c)); }
double distance2(Vec3d a, Vec3d b) noexcept { return dot(a - b, a - b); }

Weights weights_of(const SlabCoord& at) noexcept { return {1 - at.u - at.v, at.u, at.v}; }

bool same(const SlabCorners& a, const SlabCorners& b) noexcept {
  return a.inner == b.inner && a.outer == b.outer && a.order == b.order;
}

/// The place of a triangle that is nearest to p.
SurfacePlace nearest(const MicroTriangle& t, Vec3d p) noexcept {
  const Weights w = nearest_in_triangle(p, t.positions[0], t.positions[1], t.positions[2]);
  return {t, w, t.point(w)};
}

/// Which corners' weights are zero: none in the interior, one on an edge, two at a sample.
struct Feature {
  int zeros = 0;
  std::size_t zero = 0;    ///< on an edge: the corner opposite
  std::size_t corner = 0;  ///< at a sample: which

  explicit Feature(const Weights& w) noexcept {
    for (std::size_t k = 0; k < 3; ++k) {
      if (w[k] == 0) {
        ++zeros;
        zero = k;
      } else {
        corner = k;
      }
    }
  }
};

/// Calls visit(triangle) for the triangles that share the place's edge or sample, without its own at an edge.
template <typename Visit>
void neighbours(MicroTriangles& surface, const SurfacePlace& place, Visit&& visit) noexcept {
  const Feature feature(place.weights);
  if (feature.zeros == 1) {
    const MicroTriangle other = surface.across(place.triangle, feature.zero);
    if (other.slab != kNoSlab) visit(other);
  } else if (feature.zeros == 2) {
    surface.around(place.triangle.slab, place.triangle.corners[feature.corner], visit);
  }
}

/// What a tick may take in which the cursor goes this way.
int work_for(const SlabMesh& mesh, Vec3d from, Vec3d to) noexcept {
  const Vec3d all = mesh.bounds().extent();
  const double way2 = distance2(from, to), all2 = dot(all, all);
  const auto is = [&](const Leap& leap) { return way2 > leap.way * leap.way * all2; };
  return is(kFarLeap) ? kFarLeap.work : is(kLeap) ? kLeap.work : detail::kAnyWork;
}

/// Moves a place over the surface towards the goal, by `reach` at most, triangle by triangle, as long as each step
/// comes nearer; where it stops by itself no place around is nearer. The way is a polyline on the surface; returns its
/// length. `tries` counts the triangles that it looks at down to 0, where it stops. Calls over(triangle) for those that
/// it comes to.
template <typename Over>
double walk(MicroTriangles& surface, SurfacePlace& place, Vec3d goal, double reach, int& tries, Over&& over) noexcept {
  double best = distance2(place.position, goal), gone = 0;
  SurfacePlace next = nearest(place.triangle, goal);
  double least = distance2(next.position, goal);
  if (!(least < best)) next = place;
  for (bool first = true; first || next.triangle.slab != kNoSlab; first = false) {
    if (least < best) {
      const double way = length(next.position - place.position);
      if (gone + way > reach) {
        // Both places lie in the new triangle.
        place = nearest(next.triangle, place.position + (next.position - place.position) * ((reach - gone) / way));
        return reach;
      }
      gone += way;
      best = least;
      place = next;
      if (!first) over(place.triangle);
    }
    if (tries <= 0) break;
    next.triangle.slab = kNoSlab;
    least = best * kGain;
    neighbours(surface, place, [&](const MicroTriangle& t) {
      --tries;
      const Weights w = nearest_in_triangle(goal, t.positions[0], t.positions[1], t.positions[2]);
      if (w[0] == 1 && t.positions[0] == place.position) return;
      const Vec3d there = t.point(w);
      const double d = distance2(there, goal);
      if (!(d < least)) return;
      least = d;
      next = {t, w, there};
    });
  }
  return gone;
}

double walk(MicroTriangles& surface, SurfacePlace& place, Vec3d goal, double reach, int& tries) noexcept {
  return walk(surface, place, goal, reach, tries, [](const MicroTriangle&) {});
}

/// Where the surface bends away from the goal the nearest place of the next triangle may be nearer although the edge
/// between lies farther off. Moves the place to such a one, if its way out is on the side given.
bool hop(MicroTriangles& surface, SurfacePlace& place, Vec3d goal, Vec3d side) noexcept {
  double best = distance2(place.position, goal) * kGain;
  SurfacePlace next;
  const auto look = [&](const MicroTriangle& t) noexcept {
    const Vec3d area = t.area();
    const double off = dot(area, t.positions[0] - goal);
    if (!(off > 0 && off * off < best * dot(area, area))) return;  // its plane is no nearer
    const SurfacePlace there = nearest(t, goal);
    const double d = distance2(there.position, goal);
    if (!(d < best && same_side(there.position - goal, side))) return;
    best = d;
    next = there;
  };
  const auto look_across = [&](const MicroTriangle& t, std::size_t k) noexcept {
    const MicroTriangle other = surface.across(t, k);
    if (other.slab != kNoSlab) look(other);
  };
  // walk() has been in the triangles that share the place itself.
  const Feature feature(place.weights);
  if (feature.zeros == 2) {
    std::array<MicroTriangle, 16> ring;
    std::size_t count = 0;
    neighbours(surface, place, [&](const MicroTriangle& t) noexcept {
      if (count < ring.size()) ring[count++] = t;
    });
    for (std::size_t k = 0; k < count; ++k) look_across(ring[k], 0);
  } else if (const auto close = std::ranges::max_element(place.weights); *close > kClose) {
    surface.around(place.triangle.slab, place.triangle.corners[std::size_t(close - place.weights.begin())], look);
  } else {
    for (std::size_t k = 0; k < 3; ++k)
      if (feature.zeros == 0 || k != feature.zero) look_across(place.triangle, k);
    if (feature.zeros == 1) {
      const MicroTriangle other = surface.across(place.triangle, feature.zero);
      for (std::size_t k = 0; other.slab != kNoSlab && k < 3; ++k) look_across(other, k);
    }
  }
  if (next.triangle.slab == kNoSlab) return false;
  place = next;
  return true;
}

/// Where a straight way goes in through a triangle: the weights of the place; empty where it does not. `from` is the
/// origin of a, b and c.
std::optional<Weights> goes_in(Vec3d way, Vec3d a, Vec3d b, Vec3d c) noexcept {
  // Volumes against the three edges: neighbours see the same edge with the opposite sign, so no gap opens. All are
  // negative where the way goes in.
  const double wa = det(way, b, c), wb = det(way, c, a), wc = det(way, a, b);
  if (!(wa <= 0 && wb <= 0 && wc <= 0)) return std::nullopt;
  const double sum = wa + wb + wc;
  if (!(sum < 0)) return std::nullopt;
  return Weights{wa / sum, wb / sum, wc / sum};
}

/// A place a hair above the surface.
Vec3d lifted(MicroTriangles& surface, const SurfacePlace& place) noexcept {
  return place.position + surface.fibre(place) * kLift;
}

/// Whether the way from a place on the surface to the goal leads off it at once: outwards, or past an open edge.
bool leaves(MicroTriangles& surface, const SurfacePlace& place, Vec3d goal) noexcept {
  const bool above = dot(place.triangle.area(), goal - place.position) > 0;
  if (Feature(place.weights).zeros == 0) return above;
  const Vec3d from = lifted(surface, place), way = goal - from;
  const auto blocks = [&](const MicroTriangle& t) noexcept {
    return goes_in(way, t.positions[0] - from, t.positions[1] - from, t.positions[2] - from).has_value();
  };
  if (!above && blocks(place.triangle)) return false;
  bool blocked = false;
  neighbours(surface, place, [&](const MicroTriangle& t) { blocked = blocked || blocks(t); });
  return !blocked;
}

/// Newton for the coordinates of p (relative to the form's origin), also somewhat outside the slab. False when it does
/// not settle near the slab.
bool solve(const LinearForm& s, Vec3d p, SlabCoord& at) noexcept {
  const double goal2 = s.size2 * 1e-18;
  for (int step = 0; step < 8; ++step) {
    const Vec3d along = s.d + s.e * at.u + s.f * at.v;
    const Vec3d miss = s.a + s.b * at.u + s.c * at.v + along * at.alpha - p;
    if (dot(miss, miss) <= goal2) return true;
    const Vec3d ju = s.b + s.e * at.alpha, jv = s.c + s.f * at.alpha;
    const Vec3d uv = cross(ju, jv);
    const double jacobian = dot(uv, along);
    if (!(jacobian > 0)) return false;
    const double scale = 1 / jacobian;
    at.u -= det(miss, jv, along) * scale;
    at.v -= det(ju, miss, along) * scale;
    at.alpha -= dot(uv, miss) * scale;
    if (!(std::abs(at.u) + std::abs(at.v) + std::abs(at.alpha) < 8)) return false;
  }
  return false;
}

/// The first entry of a straight way into the surface. What it takes is counted; where that is too much, only the
/// beginning of the way is looked at.
class Sweep {
 public:
  /// Adds to `work`, and ends once that is `most`, but not before the way is known up to a share of `least`.
  Sweep(MicroTriangles& surface, Vec3d from, Vec3d to, int& work, int most, double least) noexcept
      : surface_(surface), from_(from), way_(to - from), work_(work), most_(most), least_(least) {
    const Box3d& all = surface.mesh().bounds();
    for (std::size_t k = 0; k < 3; ++k) {
      per_way_[k] = way_[k] == 0 ? 1e300 : 1 / way_[k];
      const double slack = 1e-9 * (all.high[k] - all.low[k]) + 1e-15 * std::abs(from[k]);
      low_from_[k] = from[k] + slack;
      high_from_[k] = from[k] - slack;
    }
  }

  /// Empty where the way does not go in, as far as it is known.
  [[nodiscard]] std::optional<SurfacePlace> run() noexcept {
    put(0, Ahead::Node, surface_.mesh().tree()[0].box);
    while (ahead_count_ > 0) {
      const Ahead next = ahead_[--ahead_count_];
      if (next.enter > end_of_search() || leave_off_at(next.enter)) break;
      if (next.what == Ahead::Node)
        look_into(surface_.mesh().tree()[next.number]);
      else
        search(next);
    }
    if (found_.triangle.slab == kNoSlab || best_ > known_) return std::nullopt;
    return found_;
  }
  /// After run(): whether there is nothing more to know;
  [[nodiscard]] bool done() const noexcept { return !(known_ < std::min(best_, 1.0)); }
  /// the share of the way to the entry or, where it is not known, that is clear,
  [[nodiscard]] double share() const noexcept { return end_of_search(); }
  /// and where that ends.
  [[nodiscard]] Vec3d clear_to() const noexcept { return from_ + way_ * share(); }
  /// The slab that was searched last, in which this place may be.
  [[nodiscard]] SlabId last_slab() const noexcept { return searched_; }

 private:
  /// A place on the way, and its coordinates in the slab in hand; they are known inside, and mostly outside, too.
  struct End {
    double t = 0;
    SlabCoord at;
    bool known = false;
  };

  /// The part of the way in the box, widened a little for rounding.
  [[nodiscard]] bool clip(const Box3d& box, double& enter, double& leave) const noexcept {
    for (std::size_t k = 0; k < 3; ++k) {
      const double t0 = (box.low[k] - low_from_[k]) * per_way_[k], t1 = (box.high[k] - high_from_[k]) * per_way_[k];
      enter = std::max(enter, std::min(t0, t1));
      leave = std::min(leave, std::max(t0, t1));
    }
    return enter <= leave;
  }

  /// What the way comes to: a node of the tree, a slab, or the part of the way that is in a slab.
  struct Ahead {
    enum What : std::uint8_t { Node, Slab, Part };
    double enter, leave;
    std::uint32_t number;
    What what;
  };
  [[nodiscard]] double end_of_search() const noexcept { return std::min(best_, known_); }
  /// Whether there is no time left; the way is then not looked at beyond t.
  [[nodiscard]] bool leave_off_at(double t) noexcept {
    if (work_ < most_ || t < least_) return false;
    known_ = std::min(known_, std::max(t, 0.0));
    return true;
  }
  void put(std::uint32_t number, Ahead::What what, const Box3d& box) noexcept {
    work_ += kBoxWork;
    double enter = 0, leave = 1;
    if (clip(box, enter, leave) && enter <= end_of_search()) put({enter, leave, number, what});
  }
  /// The nearest is the last. Where there is no more room, the way is not looked at as far as the farthest.
  void put(const Ahead& one) noexcept {
    if (ahead_count_ == ahead_.size()) {
      if (one.enter >= ahead_[0].enter) {
        known_ = std::min(known_, one.enter);
        return;
      }
      known_ = std::min(known_, ahead_[0].enter);
      std::shift_left(ahead_.begin(), ahead_.end(), 1);
      --ahead_count_;
    }
    std::size_t k = ahead_count_++;
    for (; k > 0 && ahead_[k - 1].enter < one.enter; --k) ahead_[k] = ahead_[k - 1];
    ahead_[k] = one;
  }
  void look_into(const SlabMesh::Node& node) noexcept {
    const SlabMesh& mesh = surface_.mesh();
    if (node.count == 0) {
      const auto left = static_cast<std::uint32_t>(&node - mesh.tree().data()) + 1;
      put(node.first, Ahead::Node, mesh.tree()[node.first].box);
      put(left, Ahead::Node, mesh.tree()[left].box);
    }
    for (std::uint32_t k = node.count; k-- > 0;) {
      const SlabId slab = mesh.tree_slabs()[node.first + k];
      put(slab, Ahead::Slab, mesh.box(slab));
    }
  }

  void search(Ahead part) noexcept {
    work_ += kSlabWork;
    surface_.enter(part.number);
    slab_ = part.number;
    if (part.what == Ahead::Slab) {
      part.what = Ahead::Part;
      if (!clip_to_sides(part.enter, part.leave) || part.enter > end_of_search()) return;
      // Its box begins before it does: something else may come first.
      if (ahead_count_ > 0 && part.enter > ahead_[ahead_count_ - 1].enter) return put(part);
    }
    searched_ = slab_;
    const double enter = part.enter, leave = std::min(part.leave, end_of_search());
    // Coordinates bend too much within triangles that are as large as the slab.
    whole_ = surface_.intervals() <= kCoarse || surface_.stretch() > kFarStitched;
    if (whole_) return all_cells(enter, leave);
    const LinearForm form(surface_.corners(), from_);
    const End a = end(form, enter, middle_);
    piece(form, a, end(form, leave, a.known ? a.at : middle_), 0);
    if (whole_) all_cells(enter, leave);
  }

  [[nodiscard]] End end(const LinearForm& form, double t, const SlabCoord& start) const noexcept {
    work_ += kEndWork;
    End e{.t = t, .at = start};
    // Far outside, Newton may have found another of the three solutions, and inside, though rarely, none.
    const auto close = [](double x) { return x >= -1 && x <= 2; };
    e.known = solve(form, way_ * t, e.at) && close(e.at.u) && close(e.at.v) && close(1 - e.at.u - e.at.v) &&
              close(e.at.alpha);
    if (e.known) return e;
    if (const auto at = coordinates_in(surface_.mesh(), slab_, from_ + way_ * t, kMargin)) {
      e.at = *at;
      e.known = true;
    }
    return e;
  }

  /// One part of the way; halved until its course over the grid is nearly straight.
  void piece(const LinearForm& form, const End& a, const End& b, int depth) noexcept {
    if (whole_ || a.t > end_of_search() || leave_off_at(a.t)) return;
    SlabCoord start = a.known ? a.at : b.known ? b.at : middle_;
    if (a.known && b.known) {
      start = {slab_, (a.at.u + b.at.u) / 2, (a.at.v + b.at.v) / 2, (a.at.alpha + b.at.alpha) / 2};
      const Vec3d along = form.d + form.e * start.u + form.f * start.v;
      const Vec3d ju = form.b + form.e * start.alpha, jv = form.c + form.f * start.alpha;
      const double jacobian = det(ju, jv, along);
      if (jacobian > 0) {
        const auto across = [&](Vec3d x) noexcept {
          return (std::abs(det(x, jv, along)) + std::abs(det(ju, x, along))) / jacobian;
        };
        const auto upwards = [&](Vec3d x) noexcept { return std::abs(det(ju, jv, x)) / jacobian; };
        // How far its course may leave the straight line between its ends: four times the second-order term. How far a
        // flat micro-triangle may leave the straight line between its samples' coordinates: twice that of a cell in
        // which alpha goes from 0 to 1.
        const Vec3d twist = (form.e * (b.at.u - a.at.u) + form.f * (b.at.v - a.at.v)) * (b.at.alpha - a.at.alpha);
        const double n = surface_.intervals();
        // A stitched triangle is as long as the edge's intervals are apart.
        const double longest = 1 + 2 * surface_.stretch();  // cells
        const double bend = across(twist) * n + kPad;
        cell_bend_ = longest * (across(form.e) + across(form.f)) / 2;
        cell_twist_ = longest * (upwards(form.e) + upwards(form.f)) / n;
        const double bend_alpha = upwards(twist) + kPad;
        // Wholly on the far side of a wall, floor or ceiling?
        const Weights wa = weights_of(a.at), wb = weights_of(b.at);
        for (std::size_t k = 0; k < 3; ++k)
          if (wa[k] * n < -bend - cell_bend_ && wb[k] * n < -bend - cell_bend_) return;
        const double above = bend_alpha + cell_twist_;
        if ((a.at.alpha < -above && b.at.alpha < -above) || (a.at.alpha > 1 + above && b.at.alpha > 1 + above)) return;
        const Course course(a, b, surface_.intervals(), bend + surface_.stretch(), bend_alpha);
        if (across(twist) * n <= 0.5 || depth >= kHalvings) return cells(course);
        if (!may_meet(course)) return;
      }
    } else if (!a.known && !b.known && depth >= kHalvings / 2) {
      return;  // too short to come in from there and go out again
    }
    if (depth >= kHalvings) {
      whole_ = true;
      return;
    }
    const End middle = end(form, (a.t + b.t) / 2, start);
    piece(form, a, middle, depth + 1);
    piece(form, middle, b, depth + 1);
  }

  /// The part of the way where the surface of the slab in hand may be: between planes along floor and ceiling of what
  /// its samples take up of the slab, and along its walls; false where there is none.
  [[nodiscard]] bool clip_to_sides(double& enter, double& leave) const noexcept {
    const SlabCorners& c = surface_.corners();
    const auto [low, high] = surface_.model().tile(Layer::Displacement, slab_).bounds().range();
    std::array<Vec3d, 6> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d inner = c.inner[k] - from_, along = c.outer[k] - c.inner[k];
      corners[2 * k] = inner + along * (low - kPad);
      corners[2 * k + 1] = inner + along * (high + kPad);
    }
    const auto& [a0, a1, b0, b1, c0, c1] = corners;
    const auto between = [&](Vec3d normal) noexcept {
      double least = kAnywhere, most = -kAnywhere;
      for (const Vec3d corner : corners) {
        const double height = dot(normal, corner);
        least = std::min(least, height);
        most = std::max(most, height);
      }
      const double slack = 1e-9 * (most - least), speed = dot(normal, way_);
      if (speed == 0) return least <= slack && most >= -slack;
      double t0 = (least - slack) / speed, t1 = (most + slack) / speed;
      if (t0 > t1) std::swap(t0, t1);
      enter = std::max(enter, t0);
      leave = std::min(leave, t1);
      return enter <= leave;
    };
    return between(cross(b1 - a1, c1 - a1)) && between(cross(b0 - a0, c0 - a0)) && between(cross(b1 - a0, a1 - b0)) &&
           between(cross(c1 - b0, b1 - c0)) && between(cross(a1 - c0, c1 - a0));
  }

  /// A part of the way over the grid: a straight line from a to b in cells and alpha, give or take.
  struct Course {
    double x, y, alpha, dx, dy, rise, per_x, per_y;
    double begin, takes;      ///< which share of the way it begins at, and is
    double bend, bend_alpha;  ///< how far the way may be from the line, cells and alpha

    Course(const End& a, const End& b, int n, double off, double off_alpha) noexcept
        : x(a.at.u * n),
          y(a.at.v * n),
          alpha(a.at.alpha),
          dx(b.at.u * n - x),
          dy(b.at.v * n - y),
          rise(b.at.alpha - a.at.alpha),
          per_x(per(dx)),
          per_y(per(dy)),
          begin(a.t),
          takes(b.t - a.t),
          bend(off),
          bend_alpha(off_alpha) {}
    /// 1 over it, or 0 where there is hardly any.
    [[nodiscard]] static double per(double step) noexcept { return std::abs(step) > 1e-9 ? 1 / step : 0; }
    /// Leaves of the stretch between `from` and `to` what lies in columns, or rows, from low to high; false where
    /// nothing does.
    [[nodiscard]] bool narrow_x(double low, double high, double& from, double& to) const noexcept {
      return narrow(x, per_x, low, high, from, to);
    }
    [[nodiscard]] bool narrow_y(double low, double high, double& from, double& to) const noexcept {
      return narrow(y, per_y, low, high, from, to);
    }

   private:
    [[nodiscard]] static bool narrow(double start, double per_step, double low, double high, double& from,
                                     double& to) noexcept {
      if (per_step == 0) return start >= low && start <= high;
      const double t0 = (low - start) * per_step, t1 = (high - start) * per_step;
      from = std::max(from, std::min(t0, t1));
      to = std::min(to, std::max(t0, t1));
      return from <= to;
    }
  };
  /// Which stretch of the line may be in the triangles of a square, and within how many cells of it; empty where the
  /// samples are all above or below it.
  struct Stretch {
    double from = 0, to = 1, pad = 0;
  };
  [[nodiscard]] std::optional<Stretch> over(const Course& line, GridPoint at, int side,
                                            const SampleBounds::Between& heights) const noexcept {
    // How far alpha may go in a cell tells how far its flat triangles may be from where it lies in coordinates.
    const double lean = std::abs(heights.slope_i) + std::abs(heights.slope_j);
    const double goes = heights.high - heights.low + lean;
    Stretch part = {.pad = line.bend + cell_bend_ * goes};
    if (!line.narrow_x(at.i - part.pad, at.i + side + part.pad, part.from, part.to) ||
        !line.narrow_y(at.j - part.pad, at.j + side + part.pad, part.from, part.to))
      return std::nullopt;
    // Its height over a sloping plane is linear, too.
    const double half = side * 0.5, slack = line.bend_alpha + cell_twist_ * goes + part.pad * lean;
    const double rise = line.rise - heights.slope_i * line.dx - heights.slope_j * line.dy;
    const double start =
        line.alpha - heights.slope_i * (line.x - at.i - half) - heights.slope_j * (line.y - at.j - half);
    const double first = start + rise * part.from, last = start + rise * part.to;
    if (std::max(first, last) + slack < heights.low || std::min(first, last) - slack > heights.high)
      return std::nullopt;
    return part;
  }
  /// Whether the way may meet a square that is small beside how uncertain its line is, or one of the smallest.
  [[nodiscard]] bool may_meet(const Course& line) noexcept {
    bool may = false;
    squares(0, [&](int level, GridPoint at, int side, const SampleBounds::Between& heights, double) {
      if (may || !over(line, at, side, heights)) return false;
      may = level == 0 || side <= kUncertain * line.bend;
      return !may;
    });
    return may;
  }
  /// Tests the triangles that the way may meet, square by square along it.
  void cells(const Course& line) noexcept {
    const int n = surface_.intervals();
    const int mirrored = (line.dx < 0 ? 1 : 0) + (line.dy < 0 ? 2 : 0);
    squares(mirrored, [&](int level, GridPoint at, int side, const SampleBounds::Between& heights, double) {
      const auto part = over(line, at, side, heights);
      if (!part) return false;
      const double t = line.begin + line.takes * part->from;
      if (t > end_of_search() || leave_off_at(t)) return false;
      const double pad = part->pad;
      for (int row = at.j; level == 0 && row < std::min(n, at.j + side); ++row) {
        double enter = part->from, leave = part->to;
        if (!line.narrow_y(row - pad, row + 1 + pad, enter, leave)) continue;
        const double xa = line.x + line.dx * enter, xb = line.x + line.dx * leave;
        const int left = std::max(at.i, static_cast<int>(std::floor(std::max(std::min(xa, xb) - pad, -1.0))));
        const int right = std::min(
            {at.i + side - 1, n - 1 - row, static_cast<int>(std::floor(std::min(std::max(xa, xb) + pad, double(n))))});
        for (int column = left; column <= right; ++column) {
          double in = enter, out = leave;
          if (!line.narrow_x(column - pad, column + 1 + pad, in, out)) continue;
          const double first = line.alpha + line.rise * in, last = line.alpha + line.rise * out;
          both(column, row, std::min(first, last) - line.bend_alpha, std::max(first, last) + line.bend_alpha);
        }
      }
      return true;
    });
  }

  /// The cells of the slab in hand near the way, wherever that runs in its coordinates: what lies between two heights
  /// over a square is in the hull of eight corners. (Not so between sloping planes, where fibres lean.)
  void all_cells(double enter, double leave) noexcept {
    const int parts = surface_.intervals() <= kCoarse ? 1 : kParts;
    for (int k = 0; k < parts; ++k) {
      const double from = enter + (leave - enter) * k / parts, to = enter + (leave - enter) * (k + 1) / parts;
      if (from > end_of_search() || leave_off_at(from)) return;
      all_cells_of(from, to);
    }
  }
  void all_cells_of(double from, double to) noexcept {
    squares(0, [&](int level, GridPoint low, int side, const SampleBounds::Between& heights, double pad) {
      const double n = surface_.intervals();
      const auto [least, most] = range_over(heights, side);
      Box3d hull;
      for (const double i : {-pad, side + pad})
        for (const double j : {-pad, side + pad}) {
          const double u = (low.i + i) / n, v = (low.j + j) / n;
          for (const double alpha : {least, most}) hull.add(surface_.corners().point({1 - u - v, u, v}, alpha));
        }
      double enter = from, leave = to;
      if (!clip(hull, enter, leave) || enter > best_) return false;
      for (int j = low.j; level == 0 && j < low.j + side; ++j)
        for (int i = low.i; i < low.i + side && i + j < surface_.intervals(); ++i) both(i, j, -1, 2);
      return true;
    });
  }
  /// Least and greatest alpha over a square.
  [[nodiscard]] static std::array<double, 2> range_over(const SampleBounds::Between& heights, int side) noexcept {
    const double slope = (std::abs(heights.slope_i) + std::abs(heights.slope_j)) * side / 2;
    return {heights.low - slope, heights.high + slope};
  }
  /// Calls look(level, first sample, side, bounds, how far beyond it its triangles may reach) for the squares of the
  /// slab in hand, from the whole to the smallest; where it says false, the square's parts are left out. Low columns
  /// come first, unless bit 0 of `mirrored` is set, and low rows, unless bit 1 is.
  template <typename Look>
  void squares(int mirrored, Look&& look) noexcept {
    const int n = surface_.intervals(), stretch = surface_.stretch();
    const SampleBounds& bounds = surface_.model().tile(Layer::Displacement, slab_).bounds();
    struct Square {
      int level, i, j;
    };
    std::array<Square, 32> stack;
    std::size_t depth = 0;
    stack[depth++] = {bounds.levels() - 1, 0, 0};
    while (depth > 0) {
      work_ += kSquareWork;
      const auto [level, i, j] = stack[--depth];
      const int side = SampleBounds::side(level);
      const GridPoint low = {i * side, j * side};
      // Stitching draws corners along the slab's edges, to samples outside the square.
      const bool stitched = stretch > 0 && (i == 0 || j == 0 || low.i + low.j + 2 * side >= n);
      const SampleBounds::Between anything = {.low = 0, .high = 1, .slope_i = 0, .slope_j = 0};
      const SampleBounds::Between heights = stitched ? anything : bounds.between(level, i, j);
      if (!look(level, low, side, heights, stitched ? double(stretch) : 0.0) || level == 0) continue;
      const int along = bounds.squares(level - 1);
      for (int k = 3; k >= 0; --k) {
        const int child = k ^ mirrored;
        if (const Square part = {level - 1, 2 * i + (child & 1), 2 * j + (child >> 1)}; part.i + part.j < along)
          stack[depth++] = part;
      }
    }
  }
  /// The cell that stands on a grid point and the one to the right of it.
  void both(int i, int j, double low, double high) noexcept {
    test({{{i, j}, {i + 1, j}, {i, j + 1}}}, low, high);
    if (i + j + 1 < surface_.intervals()) test({{{i + 1, j}, {i + 1, j + 1}, {i, j + 1}}}, low, high);
  }

  void test(const std::array<GridPoint, 3>& corners, double low, double high) noexcept {
    MicroTriangle triangle = {slab_, corners, {}};
    work_ += kTestWork;
    if (!surface_.stitch(triangle.corners)) return;
    const double d0 = surface_.displacement(triangle.corners[0]), d1 = surface_.displacement(triangle.corners[1]),
                 d2 = surface_.displacement(triangle.corners[2]);
    const double least = std::min({d0, d1, d2}), most = std::max({d0, d1, d2}), pad = cell_twist_ * (most - least);
    if (most + pad < low || least - pad > high) return;
    work_ += kMeasureWork;
    surface_.measure(triangle);
    const Vec3d a = triangle.positions[0] - from_, b = triangle.positions[1] - from_, c = triangle.positions[2] - from_;
    const auto weights = goes_in(way_, a, b, c);
    if (!weights) return;
    const Weights& w = *weights;
    const double length2 = dot(way_, way_);
    const double t = dot(a * w[0] + b * w[1] + c * w[2], way_) / length2;
    const double behind =
        kBehind * std::sqrt(distance2(surface_.corners().inner[0], surface_.corners().inner[1]) / length2);
    if (!(t >= -behind && t <= 1 && t < best_)) return;
    best_ = t;
    found_ = {triangle, w, triangle.point(w)};
  }

  static constexpr int kCoarse = 4, kFarStitched = 2;
  static constexpr int kHalvings = 6;
  static constexpr double kUncertain = 20;  // times how far the way may be from its line: a square that is small
  static constexpr double kMargin = 0.05;   // of the slab: how far outside its coordinates are asked for
  static constexpr int kParts = 8;          // of a way through a slab whose coordinates do not tell where it runs
  static constexpr int kBoxWork = 1, kSlabWork = 8, kEndWork = 10, kSquareWork = 2, kTestWork = 3, kMeasureWork = 3;

  MicroTriangles& surface_;
  Vec3d from_, way_, per_way_;
  Vec3d low_from_, high_from_;  ///< as a box widened a little for rounding is asked about
  int& work_;
  int most_;
  double least_;
  double known_ = kAnywhere;  ///< beyond this share of the way nothing more is looked for
  std::array<Ahead, 96> ahead_;
  std::size_t ahead_count_ = 0;
  SlabId slab_ = kNoSlab, searched_ = kNoSlab;
  bool whole_ = false;  ///< the coordinates on the way are not known everywhere in the slab in hand
  /// By how much the flat micro-triangles of a cell from alpha 0 to 1 may leave the slab's own: cells along the grid,
  /// and alpha.
  double cell_bend_ = 0, cell_twist_ = 0;
  SlabCoord middle_ = {kNoSlab, 1.0 / 3, 1.0 / 3, 0.5};
  double best_ = std::nextafter(1.0, 2.0);
  SurfacePlace found_;
};

/// The interpolated normal at the place beside the given one whose own normal leads to the goal. The nearest place
/// stands still at samples and leaps from triangle to triangle; this one goes evenly. It turns no further from the
/// normal at the place than the way out does.
Vec3d leading_normal(const SurfacePlace& place, const std::array<Vec3d, 3>& normals, Vec3d normal,
                     Vec3d goal) noexcept {
  const auto& [a, b, c] = place.triangle.positions;
  const Vec3d area = place.triangle.area(), out = place.position - goal;
  const double area2 = dot(area, area), height = dot(out, area), depth2 = dot(out, out);
  if (!(height > 0)) return normal;
  // The weights of b and c grow along these.
  const Vec3d to_b = cross(c - a, area) / area2, to_c = cross(area, b - a) / area2;
  const Vec3d by_b = normals[1] - normals[0], by_c = normals[2] - normals[0], start = goal - a;
  Vec3d n = normal;
  for (int step = 0; step < 2; ++step) {
    const double along = dot(n, area);
    if (!(along * along > kSteep * area2 * dot(n, n))) return normal;
    const Vec3d p = start + n * (height / along);  // in the plane of the triangle
    n = normals[0] + by_b * dot(p, to_b) + by_c * dot(p, to_c);
  }
  n = normalized(n);
  const double turn2 = distance2(n, normal), most2 = distance2(out / std::sqrt(depth2), normal);
  return turn2 <= most2 ? n : normalized(normal + (n - normal) * std::sqrt(most2 / turn2));
}

}  // namespace

std::optional<RayHit> first_entry(const Snapshot& model, Vec3d from, Vec3d to) noexcept {
  MicroTriangles surface(model);
  int work = 0;
  double begin = 0;  // share of the way that is known to be clear
  for (Vec3d start = from;;) {
    Sweep sweep(surface, start, to, work, detail::kAnyWork, 0);
    const auto place = sweep.run();
    if (!place && sweep.done()) return std::nullopt;
    const double share = begin + (1 - begin) * sweep.share();
    if (place) {
      detail::CellNormals none;
      return RayHit{point_of(surface, *place, none), std::max(0.0, share)};
    }
    start = sweep.clear_to();
    begin = share;
  }
}

void Proxy::start(const SlabMesh& mesh, Vec3d place, const std::optional<SlabCoord>& at) noexcept {
  let_go();
  known_ = true;
  late_ = false;
  last_ = here_ = place;
  if (at) above_ = Above{*at, mesh.corners(at->slab)};
}

bool Proxy::step(const Snapshot& model, Vec3d cursor, Ease ease, Look look, Tell tell) noexcept {
  rise_ = grown_ = 0;
  Vec3d eased;  // by which the felt surface comes nearer to the surface
  lost_ = fresh_ = has_left_ = late_ = false;
  work_ = 0;
  here_ = cursor;
  if (!known_) {
    known_ = true;
    last_ = cursor;
    look_below(model, cursor);
    return false;
  }
  most_work_ = work_for(model.slab_mesh(), last_, cursor);
  double cut = 0;
  MicroTriangles surface(model);
  if (!held_) {
    meet(surface, cursor);
  } else if (follow_surface(surface)) {
    if (lag_ != Vec3d{} && !yielding_) {
      const double lag = length(lag_);
      cut = std::min({lag, lag * ease.share, ease.most});
      const Vec3d before = lag_;
      lag_ = lag - cut > 1e-9 * length(corners_.outer[0] - corners_.inner[0]) ? lag_ * ((lag - cut) / lag) : Vec3d{};
      eased = lag_ - before;
    }
  } else {
    let_go();
    lost_ = true;
    look_below(model, cursor);
  }
  if (held_) pursue(surface, cursor, {cut, ease.most - cut}, look, tell);
  if (held_ && !yielding_) grown_ = dot(eased, way_out_);
  last_ = here_;
  samples_placed_ = surface.placed();
  return held_;
}

int Proxy::tries_left() const noexcept {
  return leaps() ? std::clamp((kWalkWork - work_) / kTryWork, kFewTries, kTries) : kTries;
}

bool Proxy::leaps() const noexcept { return most_work_ < detail::kAnyWork; }

void Proxy::let_go() noexcept {
  held_ = open_ = yielding_ = false;
  unsettled_ = 0;
  lag_ = {};
  nearer_ = depth_ = 0;
  above_.reset();
  ahead_.reset();
  under_.slab = kNoSlab;
  normals_ = {};
}

void Proxy::hold(detail::MicroTriangles& surface, const SurfacePlace& place) noexcept {
  held_ = fresh_ = true;
  corners_ = surface.mesh().corners(place.triangle.slab);
  land(surface, place);
  above_.reset();
}

void Proxy::land(detail::MicroTriangles& surface, const SurfacePlace& place) noexcept {
  place_ = place;
  tell_surface(surface);
  side_ = surface_.normal;
}

void Proxy::meet(detail::MicroTriangles& surface, Vec3d cursor) noexcept {
  const Snapshot& model = surface.model();
  if (above_) {
    // Has the surface risen past the place where the cursor was?
    const SlabCoord at = above_->at;
    if (at.slab >= surface.mesh().slab_count() || !same(surface.mesh().corners(at.slab), above_->corners)) {
      above_.reset();
    } else if (displacement_at(model, at.slab, at.u, at.v) > at.alpha) {
      if (const auto place = surface.place_at(at.slab, at.u, at.v)) {
        hold(surface, *place);
        lag_ = last_ - place_.position;
        unsettled_ = kSettle;
        rise_ = length(lag_);
        return;
      }
    }
  }
  if (is_clear(surface, cursor)) {
    look_below(model, cursor);
    return;
  }
  Sweep sweep(surface, last_, cursor, work_, most_work_, kLeastShare);
  if (const auto place = sweep.run()) {
    hold(surface, *place);
    return;
  }
  late_ = !sweep.done();
  if (late_) here_ = sweep.clear_to();
  open_ = !late_;
  if (sweep.last_slab() != kNoSlab) hint_.last = {sweep.last_slab(), 1.0 / 3, 1.0 / 3, 0.5};
  look_below(model, here_);
}

bool Proxy::is_clear(detail::MicroTriangles& surface, Vec3d cursor) noexcept {
  constexpr double kFar = 16;  // ways like this one
  const std::uint64_t number = surface.model().number();
  const double way = length(cursor - last_);
  if (clear_.model == number && std::max(length(cursor - clear_.centre), length(last_ - clear_.centre)) < clear_.radius)
    return true;
  // Beside the surface, and on a far way, it would be in vain: after a way that had to be swept it is tried again.
  if (!std::exchange(open_, false) || leaps()) return false;
  const int placed = surface.placed();
  clear_ = {number, cursor, detail::clear_around(surface, cursor, way, kFar * way, clear_.nearest, kClearSamples),
            clear_.nearest};
  work_ += kSampleWork * (surface.placed() - placed);
  open_ = clear_.radius > way;
  if (!open_) clear_.radius = 0;  // it is not known
  return open_;
}

void Proxy::look_below(const Snapshot& model, Vec3d cursor) noexcept {
  above_.reset();
  const auto at = locate(model.slab_mesh(), cursor, hint_);
  if (at && !hole_at(model, at->slab, at->u, at->v) && at->alpha >= displacement_at(model, at->slab, at->u, at->v))
    above_ = Above{*at, model.slab_mesh().corners(at->slab)};
}

bool Proxy::follow_surface(detail::MicroTriangles& surface) noexcept {
  const SlabMesh& mesh = surface.mesh();
  const SlabId slab = place_.triangle.slab;
  if (slab >= mesh.slab_count()) return false;
  surface.enter(slab);
  if (!same(surface.corners(), corners_)) return false;
  SurfacePlace now = place_;
  if (!surface.has(now.triangle)) return false;
  const SlabCoord at = surface.coordinates(now);
  if (!(std::abs(at.u - surface_.u) + std::abs(at.v - surface_.v) < 1e-9)) return false;
  surface.measure(now.triangle);
  if (now.triangle.positions == place_.triangle.positions) return true;
  now.position = now.triangle.point(now.weights);
  if (!told_) tell_surface(surface);
  const Vec3d change = now.position - place_.position;
  lag_ -= change;
  unsettled_ = kSettle;
  rise_ = dot(change, surface_.normal);
  place_ = now;
  return true;
}

bool Proxy::look_ahead(detail::MicroTriangles& surface, SurfacePlace& rest, Vec3d goal, Look look, double& way,
                       std::optional<SurfacePlace>& over, bool& round) noexcept {
  const int most = tries_left();
  int tries = most;
  round = false;
  const auto look_at = [&](const MicroTriangle& t) noexcept { round = round || dot(t.area(), side_) < 0; };
  way = walk(surface, rest, goal, kAnywhere, tries, look_at);
  for (SurfacePlace from = rest; look == Look::Around && tries > 0 && hop(surface, rest, goal, side_); from = rest) {
    tries -= 3;
    const double leap = length(rest.position - from.position);
    // From between the two places it goes on to the second.
    if (!over && way <= leap) over = rest;
    look_at(rest.triangle);
    way += leap + walk(surface, rest, goal, kAnywhere, tries, look_at);
  }
  work_ += kTryWork * (most - tries);
  if (tries > 0) {
    ahead_.reset();
    return true;
  }
  // It is far: from where the last tick's walk ended, if that is nearer.
  if (ahead_ && surface.has(ahead_->triangle)) {
    surface.measure(ahead_->triangle);
    ahead_->position = ahead_->triangle.point(ahead_->weights);
    if (distance2(ahead_->position, goal) < distance2(rest.position, goal)) {
      const int more = tries = tries_left();
      round = round || ahead_round_;
      walk(surface, *ahead_, goal, kAnywhere, tries, look_at);
      work_ += kTryWork * (more - tries);
      rest = *ahead_;
      way = kAnywhere;
    }
  }
  ahead_ = rest;
  ahead_round_ = round;
  return tries > 0;
}

void Proxy::pursue(detail::MicroTriangles& surface, Vec3d cursor, Own own, Look look, Tell tell) noexcept {
  Vec3d goal = cursor - lag_;
  const Vec3d out = place_.position - goal, move = cursor - last_;
  const double travel = length(move);
  // The spring gains what a move of the point adds to the squared distance from the middle of the cursor's way.
  const Vec3d middle = goal - move * 0.5;
  const double distance_before = distance2(place_.position, middle);
  // Where would the point come to rest?
  SurfacePlace rest = place_;
  double way = 0;
  std::optional<SurfacePlace> over;
  bool round = false;
  const bool settled = look_ahead(surface, rest, goal, look, way, over, round);
  bool off = leaves(surface, rest, goal);
  const Vec3d rest_out = rest.position - goal;
  if (way > 0) {
    const Aside aside(move, out, side_, unsettled_ > 0);
    const double reach = kFollow * travel + std::min(kRelax * length(out) + kFollow * own.eased, own.most);
    const int most = tries_left();
    int tries = most;
    // A cursor that is out again has the place where the point would come to rest behind it.
    const bool out_again = off && dot(rest_out, side_) < 0;
    // Unless the cursor itself has gone there, the point neither goes round to another side, nor to another sheet round
    // the edge of this one, nor slips off the part.
    if (settled && !round && same_side(out_again ? -rest_out : rest_out, side_) && (!off || way <= kFollow * travel)) {
      if (way > reach) {
        walk(surface, place_, over ? over->position : goal, reach, tries);
        off = leaves(surface, place_, goal);
      } else {
        place_ = rest;
        if (!out_again && dot(rest_out, rest_out) > 0) side_ = turned_by(side_, normalized(rest_out), aside.turn);
      }
    } else {
      if (!told_) tell_surface(surface);
      // Nobody would have put into the spring what it gets if the point goes farther away than it has come nearer.
      const SurfacePlace before = place_;
      double back = nearer_;
      if (same_side(out, side_) || unsettled_ > 0) {
        walk(surface, place_, place_.position + aside.move, length(aside.move), tries);
        back = std::min(back, kBack * dot(out, out));
      } else {  // it has slipped down a rim, say, and the cursor has come back past it: to over the cursor again
        walk(surface, place_, goal + side_ * length(out), kOver * travel, tries);
      }
      if (distance2(place_.position, middle) > distance_before + back) place_ = before;
      if (same_side(out, surface_.normal)) side_ = turned_by(side_, normalized(out), aside.turn);
      off = leaves(surface, place_, goal);
    }
    work_ += kTryWork * (most - tries);
  }
  // A tool that was only pressed on, or comes back straight, has not come out past a rim: there the point waits for it.
  const bool pressed_past = !yielding_ && unsettled_ == 0 && same_side(place_.position - goal, side_) &&
                            !(std::min(detail::way_past(move, out), detail::way_past(move, side_)) > 0);
  // Lets go, and is as far as a sweep from here has looked.
  const auto come_off = [&](const Sweep& sweep) noexcept {
    const Snapshot& model = surface.model();
    SlabCoord at = surface.coordinates(place_);
    let_go();
    late_ = !sweep.done();
    if (late_) here_ = sweep.clear_to();
    hint_.last = at;
    if (sweep.last_slab() != kNoSlab) hint_.last.slab = sweep.last_slab();
    if (sweep.share() > 0) {
      look_below(model, here_);
    } else if (!hole_at(model, at.slab, at.u, at.v)) {
      // It has not yet set out. It is mostly on a wall, and whose that place is takes long to find out.
      at.alpha = displacement_at(model, at.slab, at.u, at.v) + kLift;
      above_ = Above{at, surface.mesh().corners(at.slab)};
    }
  };
  bool free = false, fell = false;
  if (off && !pressed_past) {
    Sweep sweep(surface, lifted(surface, place_), goal, work_, most_work_ - kBelowWork, 0);
    const auto landing = sweep.run();
    free = !landing;
    if (free || distance2(landing->position, goal) < distance2(place_.position, goal) * kGain) {
      has_left_ = true;
      left_at_ = place_.position;
    }
    if (free && unsettled_ == 0) {
      come_off(sweep);
      return;
    }
    if (has_left_ && landing) {
      if (unsettled_ > 0) {  // the surface is gone, not the hand: it is felt where it was
        fell = true;
        const Vec3d leap = landing->position - place_.position;
        lag_ -= leap;
        goal += leap;
      }
      land(surface, *landing);
    }
  }
  if (free) {
    // Where an edit has taken the material from around the point, it is felt to give way before the point lets go, or
    // comes to what lies behind; a surface that has risen may still be felt lower than it is.
    const Vec3d felt = way_out_ * depth_ - move;        // as it was, but for the hand
    const double gives = 0.5 * (own.eased + own.most);  // the normal may turn, too
    // The hand's own way shortens it, wherever that leads.
    const double left = dot(felt, way_out_) > 0 ? std::min(length(felt), depth_) - gives - travel : 0;
    if (left > 0) {
      goal = place_.position - normalized(felt) * left;
      lag_ = cursor - goal;
      yielding_ = true;
      grown_ = -gives;
      own.most = gives;
    } else {
      Sweep sweep(surface, lifted(surface, place_), cursor, work_, most_work_ - kBelowWork, 0);
      const auto landing = sweep.run();
      if (!landing) {
        come_off(sweep);
        return;
      }
      fell = std::exchange(yielding_, false);
      if (fell) {
        land(surface, *landing);
        lag_ = cursor - place_.position;
      }
      goal = place_.position;
    }
    has_left_ = fell;
  } else {
    yielding_ = false;
  }
  if (lag_ == Vec3d{} && unsettled_ > 0) unsettled_ = place_.position == rest.position ? 0 : unsettled_ - 1;
  nearer_ = fell ? 0 : std::min(nearer_ + distance_before - distance2(place_.position, middle), dot(out, out));
  corners_ = surface.mesh().corners(place_.triangle.slab);
  describe(surface, goal, cursor, travel, own.most, tell);
}

void Proxy::tell_surface(detail::MicroTriangles& surface) noexcept {
  surface_ = point_of(surface, place_, normals_);
  told_ = true;
}

const SurfacePoint& Proxy::told_surface(const Snapshot& model) noexcept {
  if (told_) return surface_;
  MicroTriangles surface(model);
  SurfacePlace now = place_;
  if (surface.has(now.triangle)) {
    surface.measure(now.triangle);
    now.position = now.triangle.point(now.weights);
    surface_ = point_of(surface, now, normals_);
  } else {
    surface_.normal = way_out_;
  }
  return surface_;
}

void Proxy::describe(detail::MicroTriangles& surface, Vec3d goal, Vec3d cursor, double travel, double most,
                     Tell tell) noexcept {
  const Vec3d out = place_.position - goal;
  depth_ = length(out);
  if (tell == Tell::WayOut && depth_ > 0) {
    const SlabCoord at = surface.coordinates(place_);
    surface_ = {at.slab, at.u, at.v, at.alpha, place_.position, {}};
    told_ = false;
    way_out_ = out / depth_;
    return;
  }
  tell_surface(surface);
  const Vec3d leading = leading_normal(place_, normals_.normals, surface_.normal, goal);
  turn_ = fresh_ || !(depth_ > 0) ? kAnywhere : kFollow * travel / depth_ + std::min(kTurn, most / depth_);
  normal_ = turned_by(normal_, leading, turn_);
  way_out_ = depth_ > 0 ? out / depth_ : normal_;
  if (under_.slab != surface_.slab) under_ = {surface_.slab, surface_.u, surface_.v, surface_.alpha};
  const bool inside =
      surface.mesh().box(surface_.slab).contains(cursor) && solve(LinearForm(corners_, cursor), {}, under_) &&
      std::min({under_.u, under_.v, 1 - under_.u - under_.v}) >= 0 && under_.alpha >= 0 && under_.alpha <= 1;
  if (!inside) under_.slab = kNoSlab;
  alpha_ = inside ? under_.alpha : surface_.alpha;
}

}  // namespace relief
