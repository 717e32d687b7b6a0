// Slabs and micro-triangles as the sources of core see them; the one place that knows how they lie side by side.
#pragma once

#include <relief/core/proxy.h>

#include <algorithm>
#include <array>

namespace relief::detail {

[[nodiscard]] constexpr bool on_grid(int n, GridPoint p) noexcept { return p.i >= 0 && p.j >= 0 && p.i + p.j <= n; }

/// Weights of the point of triangle abc nearest to p (Ericson, Real-Time Collision Detection, 5.1.5: the seven
/// regions). A weight is exactly zero where the point lies on the edge opposite its corner.
[[nodiscard]] inline std::array<double, 3> nearest_in_triangle(Vec3d p, Vec3d a, Vec3d b, Vec3d c) noexcept {
  const Vec3d ab = b - a, ac = c - a, ap = p - a;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  const Vec3d bp = p - b;
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const double t = d1 / (d1 - d3);
    return {1 - t, t, 0};
  }
  const Vec3d cp = p - c;
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const double t = d2 / (d2 - d6);
    return {1 - t, 0, t};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - t, t};
  }
  const double scale = 1 / (va + vb + vc);
  const double v = vb * scale, w = vc * scale;
  return {1 - v - w, v, w};
}

/// Unit normal in a cell, interpolated from its three samples.
[[nodiscard]] Vec3d cell_normal(const Snapshot& model, SlabId slab, const GridCell& cell) noexcept;
/// The same, to the bit, from what was found before in the same cell of the same cage, as long as the samples around
/// it are the same.
[[nodiscard]] Vec3d cell_normal(const Snapshot& model, SlabId slab, const GridCell& cell, CellNormals& known) noexcept;

/// Where one stored sample lies, for a slab whose corners are known.
[[nodiscard]] inline Vec3d sample_position(const SlabCorners& corners, int n, GridPoint at, double alpha) noexcept {
  const auto w = weights(n, at);
  return corners.point({double(w[0]) / n, double(w[1]) / n, double(w[2]) / n}, alpha);
}

/// The slab as p = A + B u + C v + (D + E u + F v) alpha, relative to the point that is asked for, so that nothing is
/// lost far from the origin.
struct LinearForm {
  Vec3d a, b, c, d, e, f;
  double size2;  ///< squared length scale of the slab

  LinearForm(const SlabCorners& k, Vec3d point) noexcept
      : a(k.inner[0] - point),
        b(k.inner[1] - k.inner[0]),
        c(k.inner[2] - k.inner[0]),
        d(k.outer[0] - k.inner[0]),
        e((k.outer[1] - k.inner[1]) - d),
        f((k.outer[2] - k.inner[2]) - d),
        size2(std::max({dot(b, b), dot(c, c), dot(d, d)})) {}
};

/// The micro-triangles of one snapshot; remembers the slab in hand.
class MicroTriangles {
 public:
  explicit MicroTriangles(const Snapshot& model) noexcept : model_(model) {}

  [[nodiscard]] const Snapshot& model() const noexcept { return model_; }
  [[nodiscard]] const SlabMesh& mesh() const noexcept { return model_.slab_mesh(); }
  void enter(SlabId slab) noexcept {
    if (slab == slab_) return;
    slab_ = slab;
    corners_ = mesh().corners(slab);
    n_ = mesh().intervals(slab);
    displacement_ = model_.displacement(slab);
  }
  /// The rest is for the slab that was entered last; the calls with a triangle or a place enter its slab.
  [[nodiscard]] int intervals() const noexcept { return n_; }
  [[nodiscard]] const SlabCorners& corners() const noexcept { return corners_; }
  [[nodiscard]] double displacement(GridPoint p) const noexcept { return double{displacement_[sample_index(n_, p)]}; }
  [[nodiscard]] Vec3d position(GridPoint p) const noexcept { return sample_position(corners_, n_, p, displacement(p)); }

  /// Whether the triangle exists in this snapshot.
  [[nodiscard]] bool has(const MicroTriangle& t) noexcept {
    if (t.slab >= mesh().slab_count()) return false;
    enter(t.slab);
    return std::ranges::all_of(t.corners, [&](GridPoint p) { return on_grid(n_, p); });
  }
  /// Puts the positions of the corners into the triangle.
  void measure(MicroTriangle& t) noexcept {
    enter(t.slab);
    for (std::size_t k = 0; k < 3; ++k) t.positions[k] = position(t.corners[k]);
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
    const SlabCoord at = coordinates(place);
    const std::array<double, 3> w = {1 - at.u - at.v, at.u, at.v};
    return corners_.weighted(corners_.outer, w) - corners_.weighted(corners_.inner, w);
  }
  [[nodiscard]] SurfacePlace place_at(SlabId slab, double u, double v) noexcept {
    enter(slab);
    const GridCell cell = cell_at(n_, u, v);
    SurfacePlace place{.triangle = {slab, cell.corners, {}}, .weights = cell.weights, .position = {}};
    measure(place.triangle);
    place.position = place.triangle.point(cell.weights);
    return place;
  }

  /// The triangle across the edge opposite corner k, also in the next slab; its slab is kNoSlab at an open edge. Its
  /// first two corners are this one's (k+2)%3 and (k+1)%3.
  [[nodiscard]] MicroTriangle across(const MicroTriangle& t, std::size_t k) noexcept {
    enter(t.slab);
    const std::size_t kp = (k + 1) % 3, kq = (k + 2) % 3;
    const GridPoint p = t.corners[kp], q = t.corners[kq];
    if (const GridPoint r = q + turned(p - q); on_grid(n_, r))
      return {t.slab, {q, p, r}, {t.positions[kq], t.positions[kp], position(r)}};
    const auto wp = weights(n_, p), wq = weights(n_, q);
    for (int edge = 0; edge < 3; ++edge) {
      const auto e = static_cast<std::size_t>(edge);
      if (wp[e] != 0 || wq[e] != 0) continue;
      const SlabId other = mesh().slabs()[t.slab].neighbours[e];
      if (other == kNoSlab) break;
      const int twin = mesh().mirror_edge(t.slab, edge);
      const GridPoint p2 = edge_point(n_, twin, n_ - wp[(e + 2) % 3]), q2 = edge_point(n_, twin, n_ - wq[(e + 2) % 3]);
      const GridPoint r2 = q2 + turned(p2 - q2);
      enter(other);
      return {other, {q2, p2, r2}, {t.positions[kq], t.positions[kp], position(r2)}};
    }
    return {};
  }
  /// Calls visit(triangle) for all triangles around a sample, in order of slab; the sample is their first corner.
  template <typename Visit>
  void around(SlabId slab, GridPoint at, Visit&& visit) noexcept {
    enter(slab);
    const int n = n_;
    mesh().for_each_copy(slab, n, at, [&](const SampleCopy& copy) {
      enter(copy.slab);
      const Vec3d centre = position(copy.at);
      GridPoint step = {1, 0}, last = {};
      Vec3d before;
      for (int k = 0; k < 7; ++k, step = turned(step)) {
        const GridPoint next = copy.at + step;
        if (!on_grid(n, next)) {
          last = {};
          continue;
        }
        const Vec3d here = position(next);
        if (last != GridPoint{})
          visit(MicroTriangle{copy.slab, {copy.at, copy.at + last, next}, {centre, before, here}});
        before = here;
        last = step;
      }
    });
  }
  /// Whether an open edge of the surface ends at or runs through a sample.
  [[nodiscard]] bool at_open_edge(SlabId slab, GridPoint at) noexcept {
    enter(slab);
    const int n = n_;
    bool open = false;
    mesh().for_each_copy(slab, n, at, [&](const SampleCopy& copy) {
      const auto w = weights(n, copy.at);
      for (std::size_t k = 0; k < 3; ++k)
        open = open || (w[k] == 0 && mesh().slabs()[copy.slab].neighbours[k] == kNoSlab);
    });
    return open;
  }

 private:
  /// A step on the grid, turned by 60 degrees counter-clockwise seen from outside.
  [[nodiscard]] static constexpr GridPoint turned(GridPoint step) noexcept { return {-step.j, step.i + step.j}; }

  const Snapshot& model_;
  SlabId slab_ = kNoSlab;
  SlabCorners corners_{};
  int n_ = 0;
  const float* displacement_ = nullptr;
};

}  // namespace relief::detail
