#include <relief/core/micro_triangles.h>
#include <relief/core/proxy.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace relief {

namespace {

using Weights = std::array<double, 3>;
using detail::LinearForm;

constexpr int kSteps = 64;       // micro-triangles per tick
constexpr int kFlights = 3;      // times per tick that the point may leave the surface and meet it again
constexpr int kPieces = 8;       // of the walk in a tick
constexpr double kPiece = 0.25;  // of the depth: the longest
constexpr double kFollow = 10;   // lengths of the cursor's way that the point may go in a tick
constexpr double kRelax = 0.02;  // and this share of the depth, so that it settles under a resting cursor
constexpr double kTurn = 0.035;  // rad per tick that the normal may turn at rest
constexpr double kStable = 0.6;  // share of the shell's radius of curvature down to which the nearest point is stable
constexpr double kFacing =
    0.9;  // cosine between the normal and the way out that the point does not fall below by itself
constexpr double kAstray = 0.5;      // cosine of the way out to the way that it came in, or to the normal
constexpr double kTurned = 0.85;     // the same for a surface that does not face the cursor any more
constexpr double kFar = 0.06;        // of the diagonal: deeper than any part is pressed through
constexpr double kLift = 1e-7;       // of the fibre: the point's height above the surface when it sets off
constexpr double kBehind = 1e-9;     // of the slab: how far before its start a way may already go in, for rounding
constexpr double kGain = 1 - 1e-12;  // squared distance that another triangle must win

double det(Vec3d a, Vec3d b, Vec3d c) noexcept { return dot(a, cross(b, c)); }
double distance2(Vec3d a, Vec3d b) noexcept { return dot(a - b, a - b); }

GridPoint operator+(GridPoint a, GridPoint b) noexcept { return {a.i + b.i, a.j + b.j}; }
GridPoint operator-(GridPoint a, GridPoint b) noexcept { return {a.i - b.i, a.j - b.j}; }
/// A step on the grid, turned by 60 degrees counter-clockwise seen from outside.
GridPoint turned(GridPoint step) noexcept { return {-step.j, step.i + step.j}; }
bool on_grid(int n, GridPoint p) noexcept { return p.i >= 0 && p.j >= 0 && p.i + p.j <= n; }

Weights weights_of(const SlabCoord& at) noexcept { return {1 - at.u - at.v, at.u, at.v}; }

bool same(const SlabCorners& a, const SlabCorners& b) noexcept {
  return a.inner == b.inner && a.outer == b.outer && a.order == b.order;
}

/// The micro-triangles of one snapshot; remembers the slab in hand.
class Surface {
 public:
  explicit Surface(const Snapshot& model) noexcept : model_(model) {}

  [[nodiscard]] const SlabMesh& mesh() const noexcept { return model_.slab_mesh(); }
  void enter(SlabId slab) noexcept {
    if (slab == slab_) return;
    slab_ = slab;
    corners_ = mesh().corners(slab);
    n_ = mesh().intervals(slab);
    displacement_ = model_.displacement(slab);
  }
  [[nodiscard]] int intervals() const noexcept { return n_; }
  [[nodiscard]] const SlabCorners& corners() const noexcept { return corners_; }
  [[nodiscard]] double displacement(GridPoint p) const noexcept { return double{displacement_[sample_index(n_, p)]}; }
  [[nodiscard]] Vec3d position(GridPoint p) const noexcept {
    return detail::sample_position(corners_, n_, p, displacement(p));
  }

  [[nodiscard]] std::array<Vec3d, 3> positions(const MicroTriangle& t) noexcept {
    enter(t.slab);
    return {position(t.corners[0]), position(t.corners[1]), position(t.corners[2])};
  }
  [[nodiscard]] SlabCoord coordinates(const SurfacePlace& place) noexcept {
    enter(place.triangle.slab);
    SlabCoord at{.slab = place.triangle.slab};
    for (std::size_t k = 0; k < 3; ++k) {
      at.u += place.weights[k] * place.triangle.corners[k].i / n_;
      at.v += place.weights[k] * place.triangle.corners[k].j / n_;
      at.alpha += place.weights[k] * displacement(place.triangle.corners[k]);
    }
    return at;
  }
  /// The whole fibre through a place, from inner to outer end.
  [[nodiscard]] Vec3d fibre(const SurfacePlace& place) noexcept {
    const Weights w = weights_of(coordinates(place));
    return corners_.weighted(corners_.outer, w) - corners_.weighted(corners_.inner, w);
  }
  [[nodiscard]] SurfacePlace place_at(SlabId slab, double u, double v) noexcept {
    enter(slab);
    const GridCell cell = cell_at(n_, u, v);
    SurfacePlace place{.triangle = {slab, cell.corners}, .weights = cell.weights, .position = {}};
    const auto p = positions(place.triangle);
    place.position = p[0] * cell.weights[0] + p[1] * cell.weights[1] + p[2] * cell.weights[2];
    return place;
  }

  /// The triangle across the edge opposite corner k, also in the next slab; its slab is kNoSlab at an open edge. Its
  /// first two corners are this one's (k+2)%3 and (k+1)%3.
  [[nodiscard]] MicroTriangle across(const MicroTriangle& t, std::size_t k) noexcept {
    enter(t.slab);
    const GridPoint p = t.corners[(k + 1) % 3], q = t.corners[(k + 2) % 3];
    if (const GridPoint r = q + turned(p - q); on_grid(n_, r)) return {t.slab, {q, p, r}};
    const auto wp = weights(n_, p), wq = weights(n_, q);
    for (int edge = 0; edge < 3; ++edge) {
      const auto e = static_cast<std::size_t>(edge);
      if (wp[e] != 0 || wq[e] != 0) continue;
      const SlabId other = mesh().slabs()[t.slab].neighbours[e];
      if (other == kNoSlab) break;
      const int twin = mesh().mirror_edge(t.slab, edge);
      const GridPoint p2 = edge_point(n_, twin, n_ - wp[(e + 2) % 3]), q2 = edge_point(n_, twin, n_ - wq[(e + 2) % 3]);
      return {other, {q2, p2, q2 + turned(p2 - q2)}};
    }
    return {};
  }
  /// Calls visit(triangle) for all triangles around a sample, in order of slab; the sample is their first corner.
  template <typename Visit>
  void around(SlabId slab, GridPoint at, Visit&& visit) noexcept {
    enter(slab);
    const int n = n_;
    mesh().for_each_copy(slab, n, at, [&](const SampleCopy& copy) {
      GridPoint step = {1, 0};
      for (int k = 0; k < 6; ++k) {
        const GridPoint next = turned(step);
        if (on_grid(n, copy.at + step) && on_grid(n, copy.at + next))
          visit(MicroTriangle{copy.slab, {copy.at, copy.at + step, copy.at + next}});
        step = next;
      }
    });
  }

 private:
  const Snapshot& model_;
  SlabId slab_ = kNoSlab;
  SlabCorners corners_{};
  int n_ = 0;
  const float* displacement_ = nullptr;
};

/// The place of a triangle that is nearest to p.
SurfacePlace nearest(Surface& surface, const MicroTriangle& triangle, Vec3d p) noexcept {
  const auto q = surface.positions(triangle);
  const Weights w = detail::nearest_in_triangle(p, q[0], q[1], q[2]);
  return {triangle, w, q[0] * w[0] + q[1] * w[1] + q[2] * w[2]};
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
void neighbours(Surface& surface, const SurfacePlace& place, Visit&& visit) noexcept {
  const Feature feature(place.weights);
  if (feature.zeros == 1) {
    const MicroTriangle other = surface.across(place.triangle, feature.zero);
    if (other.slab != kNoSlab) visit(other);
  } else if (feature.zeros == 2) {
    surface.around(place.triangle.slab, place.triangle.corners[feature.corner], visit);
  }
}

/// Moves a place over the surface towards the goal, by `reach` at most, triangle by triangle, as long as each step
/// comes nearer. The way is a polyline on the surface. Handbook figure: 1 to 4 triangles per tick.
void walk(Surface& surface, SurfacePlace& place, Vec3d goal, double reach, int& steps) noexcept {
  double best = distance2(place.position, goal);
  SurfacePlace next = nearest(surface, place.triangle, goal);
  for (bool first = true; steps > 0; --steps, first = false) {
    if (const double d = distance2(next.position, goal); d < best) {
      const double way = length(next.position - place.position);
      if (way > reach) {
        // The old place in the new triangle's weights: they share it, so a blend of positions is enough; the weights
        // follow from the nearest place to the blend.
        place = nearest(surface, next.triangle, place.position + (next.position - place.position) * (reach / way));
        return;
      }
      reach -= way;
      best = d;
      place = next;
    } else if (!first) {
      return;
    }
    SurfacePlace winner;
    double least = best * kGain;
    neighbours(surface, place, [&](const MicroTriangle& t) {
      const SurfacePlace there = nearest(surface, t, goal);
      const double d = distance2(there.position, goal);
      if (!(d < least)) return;
      least = d;
      winner = there;
    });
    if (winner.triangle.slab == kNoSlab) return;
    next = winner;
  }
}

/// Whether the way from a place on the surface to the goal may lead off it, at once: it does not go under every
/// triangle that meets there, or it goes out over an open edge. Errs on the side of yes.
bool may_leave(Surface& surface, const SurfacePlace& place, Vec3d goal) noexcept {
  const Vec3d way = goal - place.position;
  const auto above = [&](const MicroTriangle& t) noexcept {
    const auto p = surface.positions(t);
    return dot(cross(p[1] - p[0], p[2] - p[0]), way) > 0;
  };
  if (above(place.triangle)) return true;
  bool leaves = false;
  int around = 0;
  neighbours(surface, place, [&](const MicroTriangle& t) {
    ++around;
    leaves = leaves || above(t);
  });
  if (leaves) return true;
  const Feature feature(place.weights);
  if (feature.zeros == 1 && around == 0) {
    const auto p = surface.positions(place.triangle);
    const std::size_t k = feature.zero;
    const Vec3d edge = p[(k + 2) % 3] - p[(k + 1) % 3];
    return dot(cross(edge, cross(p[1] - p[0], p[2] - p[0])), way) > 0;
  }
  if (feature.zeros != 2) return false;
  // A sample of an open edge has one slab edge without a neighbour.
  const SlabMesh& mesh = surface.mesh();
  bool open = false;
  surface.enter(place.triangle.slab);
  const int n = surface.intervals();
  mesh.for_each_copy(place.triangle.slab, n, place.triangle.corners[feature.corner], [&](const SampleCopy& copy) {
    const auto w = weights(n, copy.at);
    for (std::size_t k = 0; k < 3; ++k) open = open || (w[k] == 0 && mesh.slabs()[copy.slab].neighbours[k] == kNoSlab);
  });
  return open;
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
  Sweep(Surface& surface, Vec3d from, Vec3d to) noexcept : surface_(surface), from_(from), way_(to - from) {}

  /// Empty where the way does not go in.
  [[nodiscard]] std::optional<SurfacePlace> run() noexcept {
    const SlabMesh& mesh = surface_.mesh();
    const auto tree = mesh.tree();
    std::array<std::uint32_t, 64> stack{};
    std::size_t depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
      const std::uint32_t number = stack[--depth];
      const SlabMesh::Node& node = tree[number];
      double enter = 0, leave = 1;
      if (!clip(node.box, enter, leave) || enter > best_) continue;
      if (node.count == 0) {
        stack[depth++] = node.first;
        stack[depth++] = number + 1;
        continue;
      }
      for (std::uint32_t k = 0; k < node.count; ++k) {
        const SlabId s = mesh.tree_slabs()[node.first + k];
        enter = 0;
        leave = 1;
        if (clip(mesh.box(s), enter, leave) && enter <= best_) search(s, enter, std::min(leave, 1.0));
      }
    }
    if (found_.triangle.slab == kNoSlab) return std::nullopt;
    return found_;
  }
  /// The share of the way, after run().
  [[nodiscard]] double share() const noexcept { return best_; }

 private:
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
    slab_ = slab;
    const LinearForm form(surface_.corners(), from_);
    End a = end(form, enter, {slab, 1.0 / 3, 1.0 / 3, 0.5});
    End b = end(form, leave, a.known ? a.at : SlabCoord{slab, 1.0 / 3, 1.0 / 3, 0.5});
    piece(form, a, b, 0);
  }

  [[nodiscard]] End end(const LinearForm& form, double t, SlabCoord start) const noexcept {
    End e{.t = t, .at = start};
    e.known = solve(form, way_ * t, e.at);
    if (!e.known) {
      if (const auto at = coordinates_in(surface_.mesh(), slab_, from_ + way_ * t, 0.05)) {
        e.at = *at;
        e.known = true;
      }
    }
    return e;
  }

  /// One part of the way; halved until its course over the grid is nearly straight.
  void piece(const LinearForm& form, const End& a, const End& b, int depth) noexcept {
    if (a.t > best_) return;
    const double n = surface_.intervals();
    if (a.known && b.known) {
      const double turn = std::abs(b.at.u - a.at.u) + std::abs(b.at.v - a.at.v) + std::abs(b.at.alpha - a.at.alpha);
      const double bend = turn * turn;  // in slabs
      // Wholly on the far side of a wall, floor or ceiling?
      const double margin = bend + 0.02;
      const Weights wa = weights_of(a.at), wb = weights_of(b.at);
      for (std::size_t k = 0; k < 3; ++k)
        if (wa[k] < -margin && wb[k] < -margin) return;
      if ((a.at.alpha < -margin && b.at.alpha < -margin) || (a.at.alpha > 1 + margin && b.at.alpha > 1 + margin))
        return;
      if (bend * n <= 0.5 || depth >= 6) {
        cells(a.at, b.at, std::min(bend * n, 2.0) + 0.05, bend + 0.02);
        return;
      }
    } else if (depth >= (a.known || b.known ? 5 : 2)) {
      return;
    }
    SlabCoord start = a.known ? a.at : b.known ? b.at : SlabCoord{slab_, 1.0 / 3, 1.0 / 3, 0.5};
    if (a.known && b.known)
      start = {slab_, (a.at.u + b.at.u) / 2, (a.at.v + b.at.v) / 2, (a.at.alpha + b.at.alpha) / 2};
    const End middle = end(form, (a.t + b.t) / 2, start);
    piece(form, a, middle, depth + 1);
    piece(form, middle, b, depth + 1);
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
      for (int i = first_i; i <= last_i; ++i) {
        test({{{i, j}, {i + 1, j}, {i, j + 1}}}, low, high);
        if (i + j + 1 < n) test({{{i + 1, j}, {i + 1, j + 1}, {i, j + 1}}}, low, high);
      }
    }
  }

  void test(const std::array<GridPoint, 3>& corners, double low, double high) noexcept {
    const double d0 = surface_.displacement(corners[0]), d1 = surface_.displacement(corners[1]),
                 d2 = surface_.displacement(corners[2]);
    if ((d0 < low && d1 < low && d2 < low) || (d0 > high && d1 > high && d2 > high)) return;
    const Vec3d a = surface_.position(corners[0]) - from_, b = surface_.position(corners[1]) - from_,
                c = surface_.position(corners[2]) - from_;
    // Volumes against the three edges: neighbours see the same edge with the opposite sign, so no gap opens. All are
    // negative where the way goes in.
    const double wa = det(way_, b, c), wb = det(way_, c, a), wc = det(way_, a, b);
    if (!(wa <= 0 && wb <= 0 && wc <= 0)) return;
    const double sum = wa + wb + wc;
    if (!(sum < 0)) return;
    const Weights w = {wa / sum, wb / sum, wc / sum};
    const Vec3d hit = a * w[0] + b * w[1] + c * w[2];
    const double length2 = dot(way_, way_);
    const double t = dot(hit, way_) / length2;
    const double behind =
        kBehind * std::sqrt(distance2(surface_.corners().inner[0], surface_.corners().inner[1]) / length2);
    if (!(t >= -behind && t <= 1 && t < best_)) return;
    best_ = t;
    found_ = {{slab_, corners}, w, hit + from_};
  }

  Surface& surface_;
  Vec3d from_, way_;
  SlabId slab_ = kNoSlab;
  double best_ = std::nextafter(1.0, 2.0);
  SurfacePlace found_;
};

SurfacePoint point_of(const Snapshot& model, Surface& surface, const SurfacePlace& place) noexcept {
  const SlabCoord at = surface.coordinates(place);
  return {at.slab,  at.u,           at.v,
          at.alpha, place.position, detail::cell_normal(model, at.slab, {place.triangle.corners, place.weights})};
}

/// The unit normal at a place, interpolated.
Vec3d normal_at(const Snapshot& model, const SurfacePlace& place) noexcept {
  return detail::cell_normal(model, place.triangle.slab, {place.triangle.corners, place.weights});
}

/// Whether a move of the point keeps it under control. Where the cursor is deeper than the centre of curvature, coming
/// nearer to it means running away from it, round the rim.
bool steady(const Snapshot& model, Surface& surface, const SurfacePlace& from, const SurfacePlace& to,
            Vec3d goal) noexcept {
  const Vec3d move = to.position - from.position;
  const double way2 = dot(move, move);
  if (!(way2 > 0)) return true;
  const Vec3d was = from.position - goal, is = to.position - goal;
  const auto turns_too_fast = [&](Vec3d before, Vec3d after) noexcept {
    const double depth = dot(was, before);
    return depth > 0 && (depth * dot(after - before, move) > kStable * way2 || !(dot(is, after) > 0));
  };
  const Vec3d before = normal_at(model, from);
  const double faced = dot(was, before) / length(was);
  const Vec3d after = normal_at(model, to);
  const double faces = dot(is, after) / length(is);
  if (faces < kFacing && faces < faced) return false;
  return !turns_too_fast(before, after) &&
         !turns_too_fast(normalized(surface.fibre(from)), normalized(surface.fibre(to)));
}

/// n turned towards `wanted` by at most so many radians.
Vec3d turned_by(Vec3d n, Vec3d wanted, double most) noexcept {
  const double angle = std::atan2(length(cross(n, wanted)), dot(n, wanted));
  if (!(angle > most)) return wanted;
  const Vec3d aside = wanted - n * dot(n, wanted);
  if (!(dot(aside, aside) > 1e-24)) return n;
  return normalized(n * std::cos(most) + normalized(aside) * std::sin(most));
}

}  // namespace

std::optional<RayHit> first_entry(const Snapshot& model, Vec3d from, Vec3d to) noexcept {
  Surface surface(model);
  Sweep sweep(surface, from, to);
  const auto place = sweep.run();
  if (!place) return std::nullopt;
  return RayHit{point_of(model, surface, *place), std::max(0.0, sweep.share())};
}

bool Proxy::step(const Snapshot& model, Vec3d cursor, Ease ease) noexcept {
  rise_ = 0;
  lost_ = fresh_ = false;
  if (!known_) {
    known_ = true;
    last_ = cursor;
    look_below(model, cursor, false);
    return false;
  }
  double travel = length(cursor - last_);
  if (!held_) {
    meet(model, cursor);
  } else if (follow_surface(model)) {
    const double lag = length(lag_), cut = std::min({lag, lag * ease.share, ease.most});
    lag_ = lag - cut > 1e-9 * length(corners_.outer[0] - corners_.inner[0]) ? lag_ * ((lag - cut) / lag) : Vec3d{};
    travel += cut;
  } else {
    let_go();
    lost_ = true;
    look_below(model, cursor, false);
  }
  if (held_ && !pursue(model, cursor, travel)) {
    let_go();
    look_below(model, cursor, false);
  }
  last_ = cursor;
  return held_;
}

void Proxy::let_go() noexcept {
  held_ = false;
  lag_ = {};
  depth_ = 0;
  above_.reset();
}

void Proxy::hold(const Snapshot& model, const SurfacePlace& place) noexcept {
  held_ = fresh_ = true;
  place_ = place;
  corners_ = model.slab_mesh().corners(place.triangle.slab);
  above_.reset();
}

void Proxy::meet(const Snapshot& model, Vec3d cursor) noexcept {
  Surface surface(model);
  const bool was_above = above_.has_value();
  if (was_above) {
    // Has the surface risen past the place where the cursor was?
    const SlabCoord at = above_->at;
    if (at.slab >= model.slab_mesh().slab_count() || !same(model.slab_mesh().corners(at.slab), above_->corners)) {
      above_.reset();
    } else if (displacement_at(model, at.slab, at.u, at.v) > at.alpha) {
      hold(model, surface.place_at(at.slab, at.u, at.v));
      lag_ = last_ - place_.position;
      rise_ = length(lag_);
      return;
    }
  }
  Sweep sweep(surface, last_, cursor);
  if (const auto place = sweep.run())
    hold(model, *place);
  else
    look_below(model, cursor, was_above);
}

// Notes where the free cursor is above the surface. `was_above`: it was so a tick ago, and no entry was found; if it is
// below now, rounding hid the entry.
void Proxy::look_below(const Snapshot& model, Vec3d cursor, bool was_above) noexcept {
  const SlabMesh& mesh = model.slab_mesh();
  const auto at = locate(mesh, cursor, hint_);
  const SlabId before = was_above && above_ ? above_->at.slab : kNoSlab;
  above_.reset();
  if (!at) return;
  if (at->alpha >= displacement_at(model, at->slab, at->u, at->v)) {
    above_ = Above{*at, mesh.corners(at->slab)};
    return;
  }
  if (before == kNoSlab) return;
  const auto& around = mesh.slabs()[at->slab].neighbours;
  if (before != at->slab && std::ranges::find(around, before) == around.end()) return;
  Surface surface(model);
  hold(model, surface.place_at(at->slab, at->u, at->v));
}

bool Proxy::follow_surface(const Snapshot& model) noexcept {
  const SlabMesh& mesh = model.slab_mesh();
  const SlabId slab = place_.triangle.slab;
  if (slab >= mesh.slab_count() || !same(mesh.corners(slab), corners_)) return false;
  Surface surface(model);
  surface.enter(slab);
  SurfacePlace now = place_;
  bool fits = true;
  for (const GridPoint p : now.triangle.corners) fits = fits && on_grid(surface.intervals(), p);
  if (fits) {
    const SlabCoord at = surface.coordinates(now);
    fits = std::abs(at.u - surface_.u) + std::abs(at.v - surface_.v) < 1e-9;
  }
  if (fits) {
    const auto p = surface.positions(now.triangle);
    now.position = p[0] * now.weights[0] + p[1] * now.weights[1] + p[2] * now.weights[2];
  } else {
    now = surface.place_at(slab, surface_.u, surface_.v);
  }
  // Rounding apart, the same surface gives the same place.
  const Vec3d change = now.position - place_.position;
  if (length(change) > 1e-12 * length(surface.fibre(now))) {
    lag_ -= change;
    rise_ = dot(change, surface_.normal);
  }
  place_.triangle = now.triangle;
  place_.weights = now.weights;
  place_.position = now.position;
  return true;
}

bool Proxy::pursue(const Snapshot& model, Vec3d cursor, double travel) noexcept {
  Surface surface(model);
  Vec3d goal = cursor - lag_;
  bool free = false;
  const Vec3d out = place_.position - goal;
  const double turned_away = dot(out, came_), facing = dot(out, surface_.normal), apart = length(out);
  // Where the cursor has gone elsewhere, the point just follows.
  const bool elsewhere = turned_away < kTurned * apart || apart > kFar * diagonal(model.slab_mesh().bounds());
  const bool astray = !fresh_ && (turned_away < kAstray * apart || (elsewhere && facing < kAstray * apart));
  int steps = kSteps;
  double reach = kFollow * travel + kRelax * apart;
  for (int flight = 0;; ++flight) {
    // In short pieces, so that each is judged by how the surface turns along it.
    for (int piece = 0; piece < kPieces && reach > 0; ++piece) {
      const double most = std::min(reach, kPiece * apart);
      SurfacePlace next = place_;
      walk(surface, next, goal, most, steps);
      if (!astray && !steady(model, surface, place_, next, goal)) {
        // Then it only goes along with the cursor.
        if (flight == 0 && piece == 0 && !fresh_) {
          const Vec3d move = cursor - last_;
          walk(surface, place_, place_.position + move - way_out_ * dot(move, way_out_), length(move), steps);
        }
        break;
      }
      const double moved = length(next.position - place_.position);
      place_ = next;
      if (moved < most / 2) break;
      reach -= moved;
    }
    if (flight >= kFlights || !may_leave(surface, place_, goal)) break;
    const Vec3d from = place_.position + surface.fibre(place_) * kLift;
    const auto landing = Sweep(surface, from, goal).run();
    if (!landing) {
      free = true;
      break;
    }
    if (!(distance2(landing->position, goal) < distance2(place_.position, goal) * kGain) ||
        !(astray || steady(model, surface, place_, *landing, goal)))
      break;
    place_ = *landing;
  }
  if (free) {
    // A surface that has risen may still be felt lower than it is.
    if (lag_ == Vec3d{}) return false;
    const Vec3d from = place_.position + surface.fibre(place_) * kLift;
    if (!Sweep(surface, from, cursor).run()) return false;
    goal = place_.position;
  }
  corners_ = model.slab_mesh().corners(place_.triangle.slab);
  describe(model, goal, travel);
  return true;
}

void Proxy::describe(const Snapshot& model, Vec3d goal, double travel) noexcept {
  Surface surface(model);
  surface_ = point_of(model, surface, place_);
  const Vec3d out = place_.position - goal;
  depth_ = length(out);
  normal_ = fresh_ || !(depth_ > 0) ? surface_.normal
                                    : turned_by(normal_, surface_.normal, kFollow * travel / depth_ + kTurn);
  way_out_ = depth_ > 0 ? out / depth_ : normal_;
  if (fresh_ || dot(way_out_, surface_.normal) > kFacing) came_ = way_out_;
}

}  // namespace relief
