#include <relief/base/steps.h>
#include <relief/base/triangle.h>
#include <relief/core/query.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace relief {

namespace {

using detail::CellNormals;
using detail::corner_normals;
using detail::KnownCell;
using detail::LinearForm;
using detail::normal_in;
using detail::sample_position;
using detail::SlabInHand;

using Weights = std::array<double, 3>;

/// Within this distance of a wall, in barycentric terms, wall_side() decides instead of the sign of the weight:
/// rounding in the solve stays four orders of magnitude below it.
constexpr double kWallBand = 1e-5;

Weights weights_of(double u, double v) noexcept { return {1 - u - v, u, v}; }
double least(const Weights& w) noexcept { return std::min({w[0], w[1], w[2]}); }

double det(Vec3d a, Vec3d b, Vec3d c) noexcept { return dot(a, cross(b, c)); }

/// Joint Newton in (u, v, alpha) for a point, relative to that of the form, from a start near the answer. False when it
/// does not settle in a few steps; then the cold solve decides.
inline bool refine(const LinearForm& s, Vec3d point, double& u, double& v, double& alpha) noexcept {
  const Vec3d a = s.a - point;
  const double goal2 = s.size2 * 1e-26;
  for (int step = 0; step < 6; ++step) {
    const Vec3d along = s.d + s.e * u + s.f * v;
    const Vec3d miss = a + s.b * u + s.c * v + along * alpha;
    if (dot(miss, miss) <= goal2) return true;
    const Vec3d ju = s.b + s.e * alpha, jv = s.c + s.f * alpha;
    const Vec3d uv = cross(ju, jv);
    const double jacobian = dot(uv, along);
    if (!(jacobian > 0)) return false;
    const double scale = 1 / jacobian;
    const double du = det(miss, jv, along) * scale, dv = det(ju, miss, along) * scale, da = dot(uv, miss) * scale;
    u -= du;
    v -= dv;
    alpha -= da;
    if (!(std::abs(du) + std::abs(dv) + std::abs(da) < 1)) return false;
    // The next step would be this one squared, times the slab's twist.
    if (std::abs(du) + std::abs(dv) + std::abs(da) < 1e-9) return true;
  }
  const Vec3d miss = a + s.b * u + s.c * v + (s.d + s.e * u + s.f * v) * alpha;
  return dot(miss, miss) <= s.size2 * 1e-20;
}

/// The paper's cubic f(alpha) = 0, the plane of the alpha-triangle going through the point (Sec. 3.1, eq. 2), and the
/// weights there.
struct AlphaCubic {
  Vec3d i[3], d[3];  // relative to the point
  double c0, c1, c2, c3;

  AlphaCubic(const SlabCorners& k, Vec3d point) noexcept {
    for (std::size_t n = 0; n < 3; ++n) {
      i[n] = k.inner[n] - point;
      d[n] = k.outer[n] - k.inner[n];
    }
    c0 = det(i[0], i[1], i[2]);
    c1 = det(d[0], i[1], i[2]) + det(i[0], d[1], i[2]) + det(i[0], i[1], d[2]);
    c2 = det(i[0], d[1], d[2]) + det(d[0], i[1], d[2]) + det(d[0], d[1], i[2]);
    c3 = det(d[0], d[1], d[2]);
  }
  [[nodiscard]] double value(double t) const noexcept { return ((c3 * t + c2) * t + c1) * t + c0; }

  [[nodiscard]] Weights weights(double t) const noexcept {
    const Vec3d p0 = i[0] + d[0] * t, p1 = i[1] + d[1] * t, p2 = i[2] + d[2] * t;
    const Vec3d normal = cross(p1 - p0, p2 - p0);
    const double scale = 1 / dot(normal, normal);
    const double w1 = dot(normal, cross(p2, p0)) * scale, w2 = dot(normal, cross(p0, p1)) * scale;
    return {1 - w1 - w2, w1, w2};
  }

  /// Returns the root between two places of opposite sign: by Newton's steps, halved between the last two places of
  /// opposite sign where such a step leads out of them or gains less than halving does.
  [[nodiscard]] double root(double low, double high) const noexcept {
    const bool rising = value(low) < value(high);
    double t = 0.5 * (low + high), last = high - low;
    for (int step = 0; step < 64; ++step) {
      const double f = value(t);
      if (f == 0) return t;
      ((f < 0) == rising ? low : high) = t;
      double next = t - f / ((3 * c3 * t + 2 * c2) * t + c1);
      if (!(next > low && next < high && std::abs(next - t) < 0.5 * last)) next = 0.5 * (low + high);
      last = std::abs(next - t);
      t = next;
      if (last <= 1e-16 || next <= low || next >= high) break;
    }
    return t;
  }
};

/// From nothing: all roots of the cubic in the allowed range, and of those the one whose weights are furthest inside.
std::optional<SlabCoord> solve_cold(const SlabCorners& corners, SlabId slab, Vec3d point, double margin) noexcept {
  const AlphaCubic cubic(corners, point);
  std::array<double, 4> stops{};
  std::size_t count = 0;
  stops[count++] = -margin;
  // Between the stationary points the cubic is monotone.
  const double qa = 3 * cubic.c3, qb = 2 * cubic.c2, qc = cubic.c1;
  const double discriminant = qb * qb - 4 * qa * qc;
  if (discriminant > 0) {
    const double q = -0.5 * (qb + std::copysign(std::sqrt(discriminant), qb));
    double r0 = qa != 0 ? q / qa : 0, r1 = q != 0 ? qc / q : 0;
    if (r0 > r1) std::swap(r0, r1);
    for (const double r : {r0, r1})
      if (r > stops[count - 1] && r < 1 + margin) stops[count++] = r;
  }
  stops[count++] = 1 + margin;

  SlabCoord best;
  double best_least = -margin;
  bool found = false;
  for (std::size_t k = 0; k + 1 < count; ++k) {
    const double low = cubic.value(stops[k]), high = cubic.value(stops[k + 1]);
    if (!((low <= 0 && high >= 0) || (low >= 0 && high <= 0))) continue;
    const double alpha = low == 0 ? stops[k] : high == 0 ? stops[k + 1] : cubic.root(stops[k], stops[k + 1]);
    const Weights w = cubic.weights(alpha);
    if (!(least(w) >= best_least)) continue;
    best_least = least(w);
    best = {slab, w[1], w[2], alpha};
    found = true;
  }
  if (!found) return std::nullopt;
  // One polish in all three unknowns: bisection alone leaves the weights with the error of alpha times the fibre's
  // slant.
  double u = best.u, v = best.v, alpha = best.alpha;
  if (refine(LinearForm(corners, point), {}, u, v, alpha) &&
      std::abs(u - best.u) + std::abs(v - best.v) + std::abs(alpha - best.alpha) < 1e-6)
    best = {slab, u, v, alpha};
  return best;
}

/// Returns the shape of a slab; that known where it is of the same slab of the same cage.
inline const SlabInHand& shape_of(const SlabMesh& mesh, SlabId slab, SlabInHand& known) noexcept {
  if (known.cage != mesh.number() || known.slab != slab) {
    const SlabCorners corners = mesh.corners(slab);
    known = {mesh.number(), slab, corners, LinearForm(corners, {})};
  }
  return known;
}

/// On or between the inner and the outer triangle; a point on one of them is inside whichever way it was found.
bool inside_alpha(double alpha) noexcept { return alpha >= -1e-12 && alpha <= 1 + 1e-12; }

/// Returns the wall rule for one slab and a point whose coordinates in it are known.
bool owns_at(const SlabMesh& mesh, const SlabCoord& at, Vec3d point) noexcept {
  if (!inside_alpha(at.alpha)) return false;
  const Weights w = weights_of(at.u, at.v);
  for (std::size_t k = 0; k < 3; ++k) {
    if (w[k] > kWallBand) continue;
    const auto [from, to] = mesh.wall(at.slab, static_cast<int>(k));
    if (w[k] < -kWallBand || !wall_side(mesh, from, to, point)) return false;
  }
  // A corner in the middle of a coarser slab's edge touches its wall.
  for (std::size_t k = 0; mesh.is_cut() && k < 3; ++k) {
    if (w[(k + 1) % 3] > kWallBand || w[(k + 2) % 3] > kWallBand) continue;
    const HangingEdge* const hangs = mesh.hanging_at(mesh.slabs()[at.slab].fibres[k]);
    if (hangs == nullptr) continue;
    const auto [from, to] = mesh.wall(hangs->slab, hangs->edge);
    if (!wall_side(mesh, to, from, point)) return false;
  }
  return true;
}

/// `near` lies within the band of some wall of its slab: decides which slab owns the point. The candidates are all
/// slabs around the fibres of those walls, in order of number, whichever of them was met first.
std::optional<SlabCoord> settle(const SlabMesh& mesh, const SlabCoord& near, Vec3d point) noexcept {
  const Weights w = weights_of(near.u, near.v);
  const auto& fibres = mesh.slabs()[near.slab].fibres;
  std::array<bool, 3> corner{};
  for (std::size_t k = 0; k < 3; ++k)
    if (w[k] <= kWallBand) corner[(k + 1) % 3] = corner[(k + 2) % 3] = true;

  SlabCoord owner, fallback;
  const auto look_at = [&](SlabId slab) {
    const auto at = coordinates_in(mesh, slab, point, kWallBand);
    if (!at || !inside_alpha(at->alpha)) return;
    if (slab < fallback.slab) fallback = *at;
    if (slab < owner.slab && owns_at(mesh, *at, point)) owner = *at;
  };
  for (std::size_t k = 0; k < 3; ++k) {
    if (corner[k]) mesh.for_each_at(fibres[k], look_at);
    if (w[k] <= kWallBand && mesh.slabs()[near.slab].shares[k] == EdgeShare::Halves)
      mesh.for_each_at(mesh.hanging(near.slab, static_cast<int>(k)).middle, look_at);
  }
  if (owner.slab != kNoSlab) return owner;
  // Beyond an open rim nobody owns the point. Where walls meet in a fibre, rounding can leave a point to no wall's
  // side: it goes to the slab of the lowest number.
  if (fallback.slab == kNoSlab) return std::nullopt;
  const Weights fw = weights_of(fallback.u, fallback.v);
  const Slab& slab = mesh.slabs()[fallback.slab];
  for (std::size_t k = 0; k < 3; ++k)
    if (slab.neighbours[k] == kNoSlab && fw[k] < 0) return std::nullopt;
  return fallback;
}

/// Returns what is left of locate() when the slab found last does not plainly hold the point: `near` is the place in it
/// where it may still be the owner, else kNoSlab.
bool search(const SlabMesh& mesh, Vec3d point, const SlabCoord& near, LocateHint& hint) noexcept {
  const auto accept = [&](const SlabCoord& at) {
    std::optional<SlabCoord> owner = at;
    if (least(weights_of(at.u, at.v)) <= kWallBand) owner = settle(mesh, at, point);
    if (!owner) return false;
    owner->alpha = std::clamp(owner->alpha, 0.0, 1.0);
    hint.last = *owner;
    return true;
  };
  if (near.slab != kNoSlab && accept(near)) return true;
  const auto look_in = [&](SlabId s) {
    const auto found = coordinates_in(mesh, s, point, kWallBand);
    return found && inside_alpha(found->alpha) && accept(*found);
  };
  const auto holds = [&](const Box3d& box) { return box.contains(point); };
  if (const SlabId last = hint.last.slab; last < mesh.slab_count()) {
    bool found = false;
    for (int edge = 0; edge < 3 && !found; ++edge)
      mesh.for_each_across(last, edge, [&](SlabId next) { found = found || (holds(mesh.box(next)) && look_in(next)); });
    if (found) return true;
  }
  // A root and its parts have the same fibres, so its coordinates lead to the part.
  return mesh.visit_roots(holds, [&](SlabId root) {
    const auto found = solve_cold(mesh.root_corners(root), root, point, kWallBand);
    if (!found || !inside_alpha(found->alpha)) return false;
    Weights w = weights_of(found->u, found->v);
    const SlabId s = mesh.descend(root, w);
    return least(w) >= -kWallBand && accept({s, w[1], w[2], found->alpha});
  });
}

/// Returns the place in another part of a slab's root, given by its coordinates in the slab: the fibres are the same.
/// In kNoSlab where it lies outside the root.
SlabCoord in_same_root(const SlabMesh& mesh, SlabId slab, double u, double v, double alpha) noexcept {
  const RootPlace place = mesh.root_place(slab);
  Weights w = place.in_root(weights_of(u, v));
  if (!(least(w) > 0)) return {};
  for (double& x : w) x /= 1 << place.level;
  const SlabId part = mesh.descend(place.root, w);
  return {part, w[1], w[2], alpha};
}

/// locate(); the answer is hint.last and, number by number, `at`. Here and in probe() nothing is copied as a whole that
/// was written in parts: the processor waits for each such copy; together that was over a quarter of a tracked
/// query.
inline bool find(const SlabMesh& mesh, Vec3d point, LocateHint& hint, SlabCoord& at) noexcept {
  if (!mesh.bounds().contains(point)) return false;
  SlabCoord& last = hint.last;
  SlabCoord near;
  if (last.slab < mesh.slab_count()) {
    double u = last.u, v = last.v, alpha = last.alpha;
    if (refine(shape_of(mesh, last.slab, hint.shape).form, point, u, v, alpha) && inside_alpha(alpha)) {
      const double inside = least(weights_of(u, v));
      if (inside > kWallBand) {
        at.slab = last.slab;
        at.u = last.u = u;
        at.v = last.v = v;
        at.alpha = last.alpha = std::clamp(alpha, 0.0, 1.0);
        return true;
      }
      if (inside >= -kWallBand)
        near = {last.slab, u, v, alpha};
      else if (mesh.is_cut())
        near = in_same_root(mesh, last.slab, u, v, alpha);
    }
  }
  if (!search(mesh, point, near, hint)) return false;
  at = last;
  return true;
}

/// Value of a one-channel plane in a cell.
template <typename Sample>
double blend(const Sample* plane, int n, const GridCell& cell) noexcept {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k)
    sum += cell.weights[k] * static_cast<double>(plane[sample_index(n, cell.corners[k])]);
  return sum;
}

inline double blend(const std::array<double, 3>& values, const Weights& w) noexcept {
  return 0.0 + w[0] * values[0] + w[1] * values[1] + w[2] * values[2];
}

/// Makes another cell the known one; its weights.
Weights change_cell(const Snapshot& model, SlabId slab, const GridCell& cell, KnownCell& known) noexcept {
  const int n = model.slab_mesh().intervals(slab);
  const float* displacement = model.displacement(slab);
  static_cast<void>(corner_normals(model, slab, cell.corners, known.normals));
  for (std::size_t k = 0; k < 3; ++k) known.alphas[k] = double{displacement[sample_index(n, cell.corners[k])]};
  known.hole = model.is_hole(slab, cell.corners);
  return cell.weights;
}

/// Makes the cell that holds (u, v) the known one; w are the weights in it.
inline void enter_cell(const Snapshot& model, SlabId slab, double u, double v, KnownCell& known, Weights& w) noexcept {
  const int n = model.slab_mesh().intervals(slab);
  if (known.normals.model == model.number() && known.normals.slab == slab &&
      weights_in(n, known.normals.corners, u, v, w))
    return;
  w = change_cell(model, slab, cell_at(n, u, v), known);
}

std::string where(Layer layer, SlabId slab, GridPoint at) {
  return std::string(name(layer)) + " of slab " + std::to_string(slab) + " at sample (" + std::to_string(at.i) + ", " +
         std::to_string(at.j) + ")";
}

}  // namespace

bool detail::solve(const LinearForm& s, Vec3d p, SlabCoord& at) noexcept {
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

std::optional<SlabCoord> coordinates_in(const SlabMesh& mesh, SlabId slab, Vec3d point, double margin) noexcept {
  return solve_cold(mesh.corners(slab), slab, point, margin);
}

bool wall_side(const SlabMesh& mesh, FibreId a, FibreId b, Vec3d point) noexcept {
  const Fibre &low = mesh.fibres()[std::min(a, b)], &high = mesh.fibres()[std::max(a, b)];
  const Vec3d p = point - low.inner;
  const Vec3d across = high.inner - low.inner, dl = low.direction(), twist = high.direction() - dl;
  // Gauss-Newton onto the patch across*s + dl*t + twist*s*t; a fixed number of steps, so that both slabs do the same.
  double s = 0.5, t = 0.5;
  Vec3d ps, pt, miss;
  for (int step = 0; step < 7; ++step) {
    ps = across + twist * t;
    pt = dl + twist * s;
    miss = p - (across * s + dl * t + twist * (s * t));
    if (step == 6) break;
    const double ss = dot(ps, ps), st = dot(ps, pt), tt = dot(pt, pt), rs = dot(ps, miss), rt = dot(pt, miss);
    const double d = ss * tt - st * st;
    if (!(d > 0)) break;
    s += (rs * tt - rt * st) / d;
    t += (rt * ss - rs * st) / d;
  }
  // cross(ps, pt) points to the right of the way from the lower to the higher fibre, seen from outside.
  const bool left_of_low_to_high = dot(cross(ps, pt), miss) < 0;
  return left_of_low_to_high == (a < b);
}

bool owns(const SlabMesh& mesh, SlabId slab, Vec3d point) noexcept {
  const auto at = coordinates_in(mesh, slab, point, kWallBand);
  return at && owns_at(mesh, *at, point);
}

std::optional<SlabCoord> locate(const SlabMesh& mesh, Vec3d point, LocateHint& hint) noexcept {
  SlabCoord at;
  if (!find(mesh, point, hint, at)) return std::nullopt;
  return at;
}

double displacement_at(const Snapshot& model, SlabId slab, double u, double v) noexcept {
  const int n = model.slab_mesh().intervals(slab);
  return blend(model.displacement(slab), n, cell_at(n, u, v));
}

double layer_at(const Snapshot& model, Layer layer, SlabId slab, double u, double v, double fallback) noexcept {
  if (!model.has(layer)) return fallback;
  const Tile& tile = model.tile(layer, slab);
  return blend(tile.plane(), tile.intervals(), cell_at(tile.intervals(), u, v));
}

Vec3f colour_at(const Snapshot& model, SlabId slab, double u, double v) noexcept {
  if (!model.has(Layer::Colour)) return {1, 1, 1};
  const Tile& tile = model.tile(Layer::Colour, slab);
  const GridCell cell = cell_at(tile.intervals(), u, v);
  const auto channel = [&](int c) { return blend(tile.plane16(c), tile.intervals(), cell) / 65535; };
  return to_float({channel(0), channel(1), channel(2)});
}

bool hole_at(const Snapshot& model, SlabId slab, double u, double v) noexcept {
  return model.has(Layer::Void) && model.is_hole(slab, cell_at(model.slab_mesh().intervals(slab), u, v).corners);
}

SurfacePoint surface_point(const Snapshot& model, SlabId slab, double u, double v) noexcept {
  const SlabMesh& mesh = model.slab_mesh();
  const GridCell cell = cell_at(mesh.intervals(slab), u, v);
  const double alpha = blend(model.displacement(slab), mesh.intervals(slab), cell);
  CellNormals none;
  return {slab,
          u,
          v,
          alpha,
          mesh.corners(slab).point(weights_of(u, v), alpha),
          normal_in(corner_normals(model, slab, cell.corners, none), cell.weights)};
}

std::optional<Contact> probe(const Snapshot& model, Vec3d cursor, LocateHint& hint) noexcept {
  const SlabMesh& mesh = model.slab_mesh();
  SlabCoord at;
  if (!find(mesh, cursor, hint, at)) return std::nullopt;
  Weights w;
  enter_cell(model, at.slab, at.u, at.v, hint.cell, w);
  const double alpha = blend(hint.cell.alphas, w);
  const Vec3d position = shape_of(mesh, at.slab, hint.shape).corners.point(weights_of(at.u, at.v), alpha);
  const bool touching = !hint.cell.hole && at.alpha < alpha;
  return std::optional<Contact>(
      std::in_place, SlabCoord{at.slab, at.u, at.v, at.alpha},
      SurfacePoint{at.slab, at.u, at.v, alpha, position, normal_in(hint.cell.normals.normals, w)},
      touching ? length(position - cursor) : 0.0, hint.cell.hole);
}

bool inside(const Snapshot& model, Vec3d point, LocateHint& hint) noexcept {
  if (const std::optional<Contact> contact = probe(model, point, hint)) return contact->touching();
  const Box3d& bounds = model.slab_mesh().bounds();
  if (!bounds.contains(point)) return false;
  // In the box but in no slab: the first surface on the way out shows its back to what is below the slabs.
  const Vec3d from_centre = point - bounds.centre();
  const Vec3d way = length(from_centre) > 0 ? normalized(from_centre) : Vec3d{0, 1, 0};
  const std::optional<RayHit> hit = raycast(model, {point, way});
  return hit && dot(hit->point.normal, way) > 0;
}

Status validate(const Snapshot& model, Layer layer, SlabId s) {
  const SlabMesh& mesh = model.slab_mesh();
  const Tile& tile = model.tile(layer, s);
  const LayerRange allowed = range(layer);
  const int n = tile.intervals();
  if (has_own_intervals(layer) && n != mesh.intervals(s))
    return fail(Errc::Corrupt,
                "the " + std::string(name(layer)) + " tile of slab " + std::to_string(s) + " has the wrong size");
  for (int c = 0; c < tile.channel_count(); ++c)
    for (std::size_t i = 0; i < tile.size(); ++i)
      if (const float value = tile.value(c, i); !(value >= allowed.low && value <= allowed.high))
        return fail(Errc::Corrupt, std::string(name(layer)) + " of slab " + std::to_string(s) + " holds " +
                                       std::to_string(value) + ", outside its range");
  const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value); };
  const auto intervals_of = [&](SlabId slab) { return model.intervals(layer, slab); };
  if (const Status fit = mesh.check_fit(s, intervals_of); !fit)
    return fail(Errc::Corrupt, fit.error().message + " in layer " + std::string(name(layer)));
  for (int edge = 0; edge < 3; ++edge)
    for (int t = 0; t < n; ++t) {
      const GridPoint at = edge_point(n, edge, t);
      bool same = true;
      const auto compare = [&](const SampleCopy& copy) {
        if (copy.slab == s) return;
        const Tile& other = model.tile(layer, copy.slab);
        for (int c = 0; same && c < tile.channel_count(); ++c)
          same = bits(tile.value(c, sample_index(n, at))) ==
                 bits(other.value(c, sample_index(other.intervals(), copy.at)));
      };
      mesh.for_each_copy(s, intervals_of, at, compare);
      if (!same) return fail(Errc::Corrupt, "the copies of a shared sample differ: " + where(layer, s, at));
    }
  Status bound;
  mesh.for_each_constrained(s, intervals_of, [&](GridPoint at, const EdgePlace& place) {
    for (int c = 0; bound && c < tile.channel_count(); ++c)
      if (bits(tile.value(c, sample_index(n, at))) != bits(constrained_value(tile, layer, place, c)))
        bound = fail(Errc::Corrupt,
                     "a sample does not follow from those that a coarser slab shares: " + where(layer, s, at));
  });
  return bound;
}

Status validate(const Snapshot& model, const Progress& progress) {
  const SlabId count = model.slab_mesh().slab_count();
  std::vector<Layer> layers;
  for (int k = 0; k < kLayerCount; ++k)
    if (model.has(static_cast<Layer>(k))) layers.push_back(static_cast<Layer>(k));
  Steps steps(progress, "check", layers.size() * std::uint64_t{count});
  for (const Layer layer : layers)
    for (SlabId s = 0; s < count; ++s) {
      if (!steps.next()) return fail(Errc::Cancelled, "cancelled");
      if (Status tile = validate(model, layer, s); !tile) return tile;
      model.tile(layer, s).rest(4);  // with its neighbours
    }
  return {};
}

}  // namespace relief
