#include <relief/core/micro_triangles.h>
#include <relief/core/proxy.h>
#include <relief/core/pushed_side.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

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
using detail::turned_by;

constexpr int kTries = 64;           // micro-triangles that one walk looks at
constexpr double kTurn = 0.035;      // rad per tick that the normal may turn at rest
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

/// Moves a place over the surface towards the goal, by `reach` at most, triangle by triangle, as long as each step
/// comes nearer; where it stops by itself no place around is nearer. The way is a polyline on the surface; returns its
/// length. `tries` counts the triangles that it looks at down to 0, where it stops.
double walk(MicroTriangles& surface, SurfacePlace& place, Vec3d goal, double reach, int& tries) noexcept {
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
    }
    if (tries <= 0) break;
    next.triangle.slab = kNoSlab;
    least = best * kGain;
    neighbours(surface, place, [&](const MicroTriangle& t) {
      --tries;
      const SurfacePlace there = nearest(t, goal);
      const double d = distance2(there.position, goal);
      if (!(d < least)) return;
      least = d;
      next = there;
    });
  }
  return gone;
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

/// The first entry of a straight way into the surface.
class Sweep {
 public:
  Sweep(MicroTriangles& surface, Vec3d from, Vec3d to) noexcept : surface_(surface), from_(from), way_(to - from) {}

  /// Empty where the way does not go in.
  [[nodiscard]] std::optional<SurfacePlace> run() noexcept {
    double enter = 0, leave = 1;
    surface_.mesh().visit_tree(
        [&](const Box3d& box) {
          enter = 0;
          leave = 1;
          return clip(box, enter, leave) && enter <= best_;
        },
        [&](SlabId s) {
          search(s, enter, std::min(leave, 1.0));
          return false;
        });
    if (found_.triangle.slab == kNoSlab) return std::nullopt;
    return found_;
  }
  /// The share of the way, after run().
  [[nodiscard]] double share() const noexcept { return best_; }

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
      const double slack = 1e-9 * (box.high[k] - box.low[k]) + 1e-15 * std::abs(from_[k]);
      const double low = box.low[k] - slack - from_[k], high = box.high[k] + slack - from_[k];
      if (way_[k] == 0) {
        if (low > 0 || high < 0) return false;
        continue;
      }
      double t0 = low / way_[k], t1 = high / way_[k];
      if (t0 > t1) std::swap(t0, t1);
      enter = std::max(enter, t0);
      leave = std::min(leave, t1);
    }
    return enter <= leave;
  }

  void search(SlabId slab, double enter, double leave) noexcept {
    surface_.enter(slab);
    if (!clip_to_sides(enter, leave) || enter > best_) return;
    slab_ = slab;
    whole_ = false;
    const LinearForm form(surface_.corners(), from_);
    const End a = end(form, enter, middle_);
    piece(form, a, end(form, leave, a.known ? a.at : middle_), 0);
    if (whole_) all_cells();
  }

  [[nodiscard]] End end(const LinearForm& form, double t, const SlabCoord& start) const noexcept {
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
    if (a.t > best_ || whole_) return;
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
        const double bend = across(twist) * n + (across(form.e) + across(form.f)) / 2 + kPad;  // cells
        cell_twist_ = (upwards(form.e) + upwards(form.f)) / n;
        const double bend_alpha = upwards(twist) + kPad;
        // Wholly on the far side of a wall, floor or ceiling?
        const Weights wa = weights_of(a.at), wb = weights_of(b.at);
        for (std::size_t k = 0; k < 3; ++k)
          if (wa[k] * n < -bend && wb[k] * n < -bend) return;
        const double above = bend_alpha + cell_twist_;
        if ((a.at.alpha < -above && b.at.alpha < -above) || (a.at.alpha > 1 + above && b.at.alpha > 1 + above)) return;
        if (across(twist) * n <= 0.5 || depth >= kHalvings) {
          cells(a.at, b.at, bend + surface_.stretch(), bend_alpha);
          return;
        }
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

  /// The part of the way between the planes along the slab's floor, ceiling and walls; false where there is none.
  [[nodiscard]] bool clip_to_sides(double& enter, double& leave) const noexcept {
    const SlabCorners& c = surface_.corners();
    const auto between = [&](Vec3d normal) noexcept {
      double least = kAnywhere, most = -kAnywhere;
      for (std::size_t k = 0; k < 3; ++k)
        for (const Vec3d corner : {c.inner[k], c.outer[k]}) {
          least = std::min(least, dot(normal, corner - from_));
          most = std::max(most, dot(normal, corner - from_));
        }
      const double slack = 1e-9 * (most - least), speed = dot(normal, way_);
      if (speed == 0) return least <= slack && most >= -slack;
      double t0 = (least - slack) / speed, t1 = (most + slack) / speed;
      if (t0 > t1) std::swap(t0, t1);
      enter = std::max(enter, t0);
      leave = std::min(leave, t1);
      return enter <= leave;
    };
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t m = (k + 1) % 3;
      if (!between(cross(c.outer[m] - c.inner[k], c.outer[k] - c.inner[m]))) return false;
    }
    return between(cross(c.inner[1] - c.inner[0], c.inner[2] - c.inner[0])) &&
           between(cross(c.outer[1] - c.outer[0], c.outer[2] - c.outer[0]));
  }

  /// The cells within `pad` cells of the line from a to b whose samples are not all above or below it.
  void cells(const SlabCoord& a, const SlabCoord& b, double pad, double alpha_pad) noexcept {
    const int n = surface_.intervals();
    const double x0 = a.u * n, y0 = a.v * n, x1 = b.u * n, y1 = b.v * n;
    const double low = std::min(a.alpha, b.alpha) - alpha_pad, high = std::max(a.alpha, b.alpha) + alpha_pad;
    const auto row = [&](double y) { return std::clamp(static_cast<int>(std::floor(y)), 0, n - 1); };
    const int last = row(std::max(y0, y1) + pad);
    for (int j = row(std::min(y0, y1) - pad); j <= last; ++j) {
      // The line's stretch over this row.
      double left = std::min(x0, x1), right = std::max(x0, x1);
      if (std::abs(y1 - y0) > 1e-9) {
        const double s0 = std::clamp((j - pad - y0) / (y1 - y0), 0.0, 1.0);
        const double s1 = std::clamp((j + 1 + pad - y0) / (y1 - y0), 0.0, 1.0);
        const double xa = x0 + (x1 - x0) * s0, xb = x0 + (x1 - x0) * s1;
        left = std::min(xa, xb);
        right = std::max(xa, xb);
      }
      const int first_i = std::max(0, static_cast<int>(std::floor(std::max(left - pad, -1.0))));
      const int last_i = std::min(n - 1 - j, static_cast<int>(std::floor(std::min(right + pad, double(n)))));
      for (int i = first_i; i <= last_i; ++i) both(i, j, low, high);
    }
  }

  void all_cells() noexcept {
    const int n = surface_.intervals();
    for (int j = 0; j < n; ++j)
      for (int i = 0; i + j < n; ++i) both(i, j, -1, 2);
  }
  /// The cell that stands on a grid point and the one to the right of it.
  void both(int i, int j, double low, double high) noexcept {
    test({{{i, j}, {i + 1, j}, {i, j + 1}}}, low, high);
    if (i + j + 1 < surface_.intervals()) test({{{i + 1, j}, {i + 1, j + 1}, {i, j + 1}}}, low, high);
  }

  void test(const std::array<GridPoint, 3>& corners, double low, double high) noexcept {
    MicroTriangle triangle = {slab_, corners, {}};
    if (!surface_.stitch(triangle.corners)) return;
    const double d0 = surface_.displacement(triangle.corners[0]), d1 = surface_.displacement(triangle.corners[1]),
                 d2 = surface_.displacement(triangle.corners[2]);
    const double least = std::min({d0, d1, d2}), most = std::max({d0, d1, d2}), pad = cell_twist_ * (most - least);
    if (most + pad < low || least - pad > high) return;
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

  static constexpr int kHalvings = 6;
  static constexpr double kMargin = 0.05;  // of the slab: how far outside its coordinates are asked for

  MicroTriangles& surface_;
  Vec3d from_, way_;
  SlabId slab_ = kNoSlab;
  bool whole_ = false;     ///< the coordinates on the way are not known everywhere in the slab in hand
  double cell_twist_ = 0;  ///< alpha by which the flat micro-triangles of a cell from 0 to 1 may leave the slab's own
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
  Sweep sweep(surface, from, to);
  const auto place = sweep.run();
  if (!place) return std::nullopt;
  detail::CellNormals none;
  return RayHit{point_of(surface, *place, none), std::max(0.0, sweep.share())};
}

void Proxy::start(const SlabMesh& mesh, Vec3d place, const std::optional<SlabCoord>& at) noexcept {
  let_go();
  known_ = true;
  last_ = place;
  if (at) above_ = Above{*at, mesh.corners(at->slab)};
}

bool Proxy::step(const Snapshot& model, Vec3d cursor, Ease ease, Look look, Tell tell) noexcept {
  rise_ = grown_ = 0;
  Vec3d eased;  // by which the felt surface comes nearer to the surface
  lost_ = fresh_ = has_left_ = false;
  if (!known_) {
    known_ = true;
    last_ = cursor;
    look_below(model, cursor);
    return false;
  }
  double travel = length(cursor - last_);
  MicroTriangles surface(model);
  if (!held_) {
    meet(surface, cursor);
  } else if (follow_surface(surface)) {
    if (lag_ != Vec3d{}) {
      const double lag = length(lag_), cut = std::min({lag, lag * ease.share, ease.most});
      const Vec3d before = lag_;
      lag_ = lag - cut > 1e-9 * length(corners_.outer[0] - corners_.inner[0]) ? lag_ * ((lag - cut) / lag) : Vec3d{};
      eased = lag_ - before;
      travel += cut;
    }
  } else {
    let_go();
    lost_ = true;
    look_below(model, cursor);
  }
  if (held_ && !pursue(surface, cursor, travel, look, tell)) {
    let_go();
    look_below(model, cursor);
  }
  if (held_) grown_ = dot(eased, way_out_);
  last_ = cursor;
  samples_placed_ = surface.placed();
  return held_;
}

void Proxy::let_go() noexcept {
  held_ = false;
  lag_ = {};
  depth_ = 0;
  above_.reset();
  ahead_.reset();
  normals_ = {};
}

void Proxy::hold(detail::MicroTriangles& surface, const SurfacePlace& place) noexcept {
  held_ = fresh_ = true;
  place_ = place;
  corners_ = surface.mesh().corners(place.triangle.slab);
  tell_surface(surface);
  side_ = surface_.normal;
  above_.reset();
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
        rise_ = length(lag_);
        return;
      }
    }
  }
  if (const auto place = Sweep(surface, last_, cursor).run())
    hold(surface, *place);
  else
    look_below(model, cursor);
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
  rise_ = dot(change, surface_.normal);
  place_ = now;
  return true;
}

bool Proxy::look_ahead(detail::MicroTriangles& surface, SurfacePlace& rest, Vec3d goal, Look look, double& way,
                       std::optional<SurfacePlace>& over) noexcept {
  int tries = kTries;
  way = walk(surface, rest, goal, kAnywhere, tries);
  for (SurfacePlace from = rest; look == Look::Around && tries > 0 && hop(surface, rest, goal, side_); from = rest) {
    tries -= 3;
    const double leap = length(rest.position - from.position);
    // From between the two places it goes on to the second.
    if (!over && way <= leap) over = rest;
    way += leap + walk(surface, rest, goal, kAnywhere, tries);
  }
  if (tries > 0) {
    ahead_.reset();
    return true;
  }
  // It is far: from where the last tick's walk ended, if that is nearer.
  if (ahead_ && surface.has(ahead_->triangle)) {
    surface.measure(ahead_->triangle);
    ahead_->position = ahead_->triangle.point(ahead_->weights);
    if (distance2(ahead_->position, goal) < distance2(rest.position, goal)) {
      tries = kTries;
      walk(surface, *ahead_, goal, kAnywhere, tries);
      rest = *ahead_;
      way = kAnywhere;
    }
  }
  ahead_ = rest;
  return tries > 0;
}

bool Proxy::pursue(detail::MicroTriangles& surface, Vec3d cursor, double travel, Look look, Tell tell) noexcept {
  Vec3d goal = cursor - lag_;
  const Vec3d out = place_.position - goal, move = cursor - last_;
  // Where would the point come to rest?
  SurfacePlace rest = place_;
  double way = 0;
  std::optional<SurfacePlace> over;
  const bool settled = look_ahead(surface, rest, goal, look, way, over);
  bool off = leaves(surface, rest, goal);
  const Vec3d rest_out = rest.position - goal;
  if (way > 0) {
    // The side that the point is pushed out to turns half as fast as the cursor goes round the point.
    const Aside aside(move, out);
    const double reach = kFollow * travel + kRelax * length(out);
    int tries = kTries;
    // Unless the cursor itself has gone there, the point neither goes round to another side nor slips off the part.
    if (settled && same_side(rest_out, side_) && (!off || way <= kFollow * travel)) {
      if (way > reach) {
        walk(surface, place_, over ? over->position : goal, reach, tries);
        off = leaves(surface, place_, goal);
      } else {
        place_ = rest;
        if (dot(rest_out, rest_out) > 0) side_ = turned_by(side_, normalized(rest_out), aside.turn);
      }
    } else {
      if (!told_) tell_surface(surface);
      walk(surface, place_, place_.position + aside.move, length(aside.move), tries);
      if (same_side(out, surface_.normal)) side_ = turned_by(side_, normalized(out), aside.turn);
      off = leaves(surface, place_, goal);
    }
  }
  bool free = false;
  if (off) {
    const auto landing = Sweep(surface, lifted(surface, place_), goal).run();
    free = !landing;
    if (free || distance2(landing->position, goal) < distance2(place_.position, goal) * kGain) {
      has_left_ = true;
      left_at_ = place_.position;
    }
    if (has_left_ && landing) {
      place_ = *landing;
      tell_surface(surface);
      side_ = surface_.normal;
    }
  }
  if (free) {
    // A surface that has risen may still be felt lower than it is.
    if (lag_ == Vec3d{}) return false;
    if (!Sweep(surface, lifted(surface, place_), cursor).run()) return false;
    goal = place_.position;
    has_left_ = false;
  }
  corners_ = surface.mesh().corners(place_.triangle.slab);
  describe(surface, goal, cursor, length(move), tell);
  return true;
}

void Proxy::tell_surface(detail::MicroTriangles& surface) noexcept {
  surface_ = point_of(surface, place_, normals_);
  told_ = true;
}

const SurfacePoint& Proxy::told_surface(const Snapshot& model) noexcept {
  if (told_) return surface_;
  MicroTriangles surface(model);
  surface_.normal = surface.has(place_.triangle) ? point_of(surface, place_, normals_).normal : way_out_;
  return surface_;
}

void Proxy::describe(detail::MicroTriangles& surface, Vec3d goal, Vec3d cursor, double travel, Tell tell) noexcept {
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
  normal_ = fresh_ || !(depth_ > 0) ? leading : turned_by(normal_, leading, kFollow * travel / depth_ + kTurn);
  way_out_ = depth_ > 0 ? out / depth_ : normal_;
  alpha_ = surface_.alpha;
  SlabCoord at = {surface_.slab, surface_.u, surface_.v, surface_.alpha};
  if (surface.mesh().box(at.slab).contains(cursor) && solve(LinearForm(corners_, cursor), {}, at) &&
      std::min({at.u, at.v, 1 - at.u - at.v}) >= 0 && at.alpha >= 0 && at.alpha <= 1)
    alpha_ = at.alpha;
}

}  // namespace relief
