// The micro-triangles of a snapshot; the one place that knows how they lie side by side.
#pragma once

#include <relief/core/surface_point.h>

#include <algorithm>
#include <array>
#include <optional>

namespace relief {

/// One triangle of the tessellated surface: three samples of a slab, counter-clockwise seen from outside, and where
/// they lie.
struct MicroTriangle {
  SlabId slab = kNoSlab;             ///< the slab it belongs to
  std::array<GridPoint, 3> corners;  ///< its samples
  std::array<Vec3d, 3> positions;    ///< its corners, model units

  /// Returns the point with such barycentric weights.
  [[nodiscard]] Vec3d point(const std::array<double, 3>& weights) const noexcept {
    return positions[0] * weights[0] + positions[1] * weights[1] + positions[2] * weights[2];
  }
  /// Outwards; its length is twice the area.
  [[nodiscard]] Vec3d area() const noexcept { return cross(positions[1] - positions[0], positions[2] - positions[0]); }
  /// Returns an order of the triangles of a snapshot: by slab, then by corners.
  [[nodiscard]] bool comes_before(const MicroTriangle& other) const noexcept {
    const auto key = [](const MicroTriangle& t) noexcept {
      const auto& [p, q, r] = t.corners;
      return std::array{p.j, p.i, q.j, q.i, r.j, r.i};
    };
    return slab < other.slab || (slab == other.slab && key(*this) < key(other));
  }
};

/// A place on the tessellated surface.
struct SurfacePlace {
  MicroTriangle triangle;           ///< where it lies
  std::array<double, 3> weights{};  ///< of the triangle's corners
  Vec3d position;                   ///< the point, model units
};

/// The micro-triangles of one snapshot, stitched where n differs across an edge and without those that are holes;
/// remembers the slab in hand.
class MicroTriangles {
 public:
  /// Of a snapshot, which must outlive this.
  explicit MicroTriangles(const Snapshot& model) noexcept : model_(model), holes_(model.has(Layer::Void)) {}

  /// Returns the snapshot.
  [[nodiscard]] const Snapshot& model() const noexcept { return model_; }
  /// Returns its cage.
  [[nodiscard]] const SlabMesh& mesh() const noexcept { return model_.slab_mesh(); }
  /// Goes on to a slab: what follows speaks of it.
  void enter(SlabId slab) noexcept {
    if (slab == slab_) return;
    slab_ = slab;
    corners_ = mesh().corners(slab);
    n_ = mesh().intervals(slab);
    step_ = (n_ & (n_ - 1)) == 0 ? 1.0 / n_ : 0;
    is_child_ = mesh().level(slab) > 0;
    root_known_ = false;
    edges_ = mesh().edge_intervals(slab);
    displacement_ = model_.displacement(slab);
  }
  /// The rest is for the slab that was entered last; the calls with a triangle or a place enter its slab.
  [[nodiscard]] int intervals() const noexcept { return n_; }
  /// Returns whether some of the model's triangles may be holes.
  [[nodiscard]] bool has_holes() const noexcept { return holes_; }
  /// Returns the six corners of the slab.
  [[nodiscard]] const SlabCorners& corners() const noexcept { return corners_; }
  /// Returns a sample's displacement, alpha in [0, 1].
  [[nodiscard]] double displacement(GridPoint p) const noexcept { return double{displacement_[sample_index(n_, p)]}; }
  /// Has the memory fetch the samples of a row, from one to the other of no more than a line of the cache: for those of
  /// several rows it is waited but once.
  void fetch(GridPoint first, GridPoint last) const noexcept {
    __builtin_prefetch(&displacement_[sample_index(n_, first)]);
    __builtin_prefetch(&displacement_[sample_index(n_, last)]);
  }
  /// Returns a sample's position, model units.
  [[nodiscard]] Vec3d position(GridPoint p) const noexcept {
    ++placed_;
    if (is_child_) return in_root().point(p, displacement(p));
    if (step_ == 0) return detail::sample_position(corners_, n_, p, displacement(p));
    // The same bits without divisions.
    return corners_.point({(n_ - p.i - p.j) * step_, p.i * step_, p.j * step_}, displacement(p));
  }
  /// Returns how many samples' positions were worked out, by all calls: a measure of the work.
  [[nodiscard]] int placed() const noexcept { return placed_; }
  /// Counts samples that were placed by other means.
  void add_placed(int samples) const noexcept { placed_ += samples; }
  /// By how many cells stitching may draw a triangle out of its cell.
  [[nodiscard]] int stretch() const noexcept { return n_ / std::min({edges_[0], edges_[1], edges_[2]}) / 2; }
  /// Returns whether it may draw triangles into a square of the grid, or out of it: so it is along the edges that the
  /// slab across has fewer samples of.
  [[nodiscard]] bool stitches_in(GridPoint low, int side) const noexcept {
    return (edges_[1] != n_ && low.i == 0) || (edges_[2] != n_ && low.j == 0) ||
           (edges_[0] != n_ && low.i + low.j + 2 * side >= n_);
  }
  /// Stitches a cell; false where no triangle remains of it or it is a hole.
  [[nodiscard]] bool stitch(std::array<GridPoint, 3>& cell) const noexcept {
    for (GridPoint& p : cell) p = stitched(p);
    return has_triangle(cell);
  }
  /// Returns the sample that stands for this one in triangles.
  [[nodiscard]] GridPoint stitched(GridPoint p) const noexcept {
    return inside(p) ? p : edge_place(n_, edges_, p).nearer();
  }
  /// Returns whether there is a triangle of a stitched cell: something remains of it, and it is no hole.
  [[nodiscard]] bool has_triangle(const std::array<GridPoint, 3>& cell) const noexcept {
    return cell[0] != cell[1] && cell[1] != cell[2] && cell[2] != cell[0] && !(holes_ && model_.is_hole(slab_, cell));
  }

  /// Returns whether the triangle is still one of this snapshot.
  [[nodiscard]] bool has(const MicroTriangle& t) noexcept {
    if (t.slab >= mesh().slab_count()) return false;
    enter(t.slab);
    for (const GridPoint p : t.corners)
      if (!detail::on_grid(n_, p)) return false;
    std::array<GridPoint, 3> cell = t.corners;
    return stitch(cell) && cell == t.corners;
  }
  /// Puts the positions of the corners into the triangle.
  void measure(MicroTriangle& t) noexcept {
    enter(t.slab);
    for (std::size_t k = 0; k < 3; ++k) t.positions[k] = position(t.corners[k]);
  }
  /// Returns where a place of the surface lies in its slab.
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
  /// Returns the whole fibre through a place, from inner to outer end.
  [[nodiscard]] Vec3d fibre(const SurfacePlace& place) noexcept {
    const SlabCoord at = coordinates(place);
    const std::array<double, 3> w = {1 - at.u - at.v, at.u, at.v};
    return corners_.weighted(corners_.outer, w) - corners_.weighted(corners_.inner, w);
  }
  /// Returns the place at (u, v), in the triangle that reaches there where edges are stitched; empty where there is a
  /// hole.
  [[nodiscard]] std::optional<SurfacePlace> place_at(SlabId slab, double u, double v) noexcept {
    enter(slab);
    const GridCell cell = stitched_cell(cell_at(n_, u, v));
    if (!has_triangle(cell.corners)) return std::nullopt;
    SurfacePlace place{.triangle = {slab, cell.corners, {}}, .weights = cell.weights, .position = {}};
    measure(place.triangle);
    place.position = place.triangle.point(cell.weights);
    return place;
  }

  /// Returns the triangle across the edge opposite corner k, also in the next slab; its slab is kNoSlab at an open
  /// edge. Its corners include this one's (k+2)%3 and (k+1)%3, in this order.
  [[nodiscard]] MicroTriangle across(const MicroTriangle& t, std::size_t k) noexcept {
    enter(t.slab);
    const std::size_t kp = (k + 1) % 3, kq = (k + 2) % 3;
    const GridPoint p = t.corners[kp], q = t.corners[kq];
    std::array<GridPoint, 3> cell = {q, p, q + turned(p - q)};
    if ((inside(p) && inside(q)) || (plain() && detail::on_grid(n_, cell[2]))) {
      if (!stitch(cell)) return {};
      return {t.slab, cell, {t.positions[kq], t.positions[kp], position(cell[2])}};
    }
    // Copies of a sample have the same position to the bit.
    MicroTriangle found;
    around(t.slab, p, [&](const MicroTriangle& other) {
      if (other.positions[2] == t.positions[kq]) found = other;
    });
    return found;
  }
  /// Calls visit(triangle) for all triangles around a sample, in order of slab; the sample is their first corner. visit
  /// must not enter another slab.
  template <typename Visit>
  void around(SlabId slab, GridPoint at, Visit&& visit) noexcept {
    mesh().for_each_copy(slab, at, [&](const SampleCopy& copy) {
      enter(copy.slab);
      ring(copy.at, copy.at, visit);
      if (plain() || inside(copy.at)) return;
      // And around the samples beside it on the slab's edges that give way to it.
      for (int edge = 0; edge < 3; ++edge) {
        const auto e = static_cast<std::size_t>(edge);
        const std::array<int, 3> w = weights(n_, copy.at);
        if (w[e] != 0 || edges_[e] == n_) continue;
        const int t = w[(e + 2) % 3], reach = n_ / edges_[e] / 2;
        for (int k = std::max(0, t - reach); k <= std::min(n_, t + reach); ++k) {
          const GridPoint beside = edge_point(n_, edge, k);
          if (beside != copy.at && edge_place(n_, edges_, beside).nearer() == copy.at) ring(copy.at, beside, visit);
        }
      }
    });
  }

 private:
  /// Says where the samples of a child's grid lie: the bits of SampleField::point(), with fewer products and no
  /// division.
  struct InRoot {
    SlabCorners corners{};
    std::array<int, 3> first{}, by_i{}, by_j{};  ///< weights in the root: of the grid's first point, and per step
    double steps = 1, step = 0;  ///< what they are counted in, and 1 over it where that is exact, else 0

    InRoot() = default;
    InRoot(const SampleField& field, int n) noexcept : corners(field.root) {
      const auto& [a, b, c] = field.place.corners;
      for (std::size_t k = 0; k < 3; ++k) {
        first[k] = n * a[k];
        by_i[k] = b[k] - a[k];
        by_j[k] = c[k] - a[k];
      }
      const int parts = n << field.place.level;
      steps = parts;
      step = (parts & (parts - 1)) == 0 ? 1.0 / parts : 0;
    }
    [[nodiscard]] Vec3d point(GridPoint p, double alpha) const noexcept {
      std::array<double, 3> w{};
      for (std::size_t k = 0; k < 3; ++k) {
        const double whole = first[k] + p.i * by_i[k] + p.j * by_j[k];
        w[k] = step != 0 ? whole * step : whole / steps;
      }
      return corners.point(w, alpha);
    }
  };
  [[nodiscard]] const InRoot& in_root() const noexcept {
    if (!root_known_) root_ = InRoot(mesh().field(slab_), n_);
    root_known_ = true;
    return root_;
  }
  /// Returns which of the stitched cells beside the edges holds the place that a cell holds before they are stitched.
  [[nodiscard]] GridCell stitched_cell(const GridCell& at) const noexcept {
    if (std::ranges::all_of(at.corners, [&](GridPoint p) { return stitched(p) == p; })) return at;
    double i = 0, j = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      i += at.weights[k] * at.corners[k].i;
      j += at.weights[k] * at.corners[k].j;
    }
    GridCell found = at;
    double most = -1;  // the least weight in it
    const auto look_in = [&](const std::array<GridPoint, 3>& cell) noexcept {
      const std::array<GridPoint, 3> c = {stitched(cell[0]), stitched(cell[1]), stitched(cell[2])};
      const GridPoint a = c[1] - c[0], b = c[2] - c[0];
      const double area = a.i * b.j - a.j * b.i, x = i - c[0].i, y = j - c[0].j;
      if (area == 0) return;
      const double wa = (x * b.j - y * b.i) / area, wb = (y * a.i - x * a.j) / area;
      const double least = std::min({wa, wb, 1 - wa - wb});
      if (least <= most) return;
      most = least;
      const double w1 = std::clamp(wa, 0.0, 1.0), w2 = std::clamp(wb, 0.0, 1 - w1);
      found = {c, {1 - w1 - w2, w1, w2}};
    };
    const std::array<double, 3> w = {n_ - i - j, i, j};
    for (int edge = 0; edge < 3; ++edge) {
      const auto e = static_cast<std::size_t>(edge);
      if (edges_[e] == n_ || w[e] > 1) continue;
      const int t = static_cast<int>(w[(e + 2) % 3]), reach = n_ / edges_[e] / 2 + 2;
      const GridPoint in = edge_point(n_, (edge + 2) % 3, 0) - edge_point(n_, (edge + 2) % 3, 1);
      for (int k = std::max(0, t - reach); k < std::min(n_, t + reach); ++k) {
        const GridPoint p = edge_point(n_, edge, k), q = edge_point(n_, edge, k + 1);
        look_in({p, q, p + in});
        if (detail::on_grid(n_, q + in)) look_in({p + in, q, q + in});
      }
    }
    return found;
  }
  /// Returns a step on the grid, turned by 60 degrees counter-clockwise seen from outside.
  [[nodiscard]] static constexpr GridPoint turned(GridPoint step) noexcept { return {-step.j, step.i + step.j}; }
  [[nodiscard]] bool inside(GridPoint p) const noexcept { return p.i > 0 && p.j > 0 && p.i + p.j < n_; }
  /// Steps on the grid, counter-clockwise seen from outside, and the first one again.
  static constexpr std::array<GridPoint, 7> kAround = {{{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}, {1, 0}}};
  /// Returns whether no edge of the slab in hand is stitched.
  [[nodiscard]] bool plain() const noexcept { return edges_[0] == n_ && edges_[1] == n_ && edges_[2] == n_; }

  /// The triangles in the slab in hand that are made from the cells around one of its grid points, `from`, which `at`
  /// stands for.
  template <typename Visit>
  void ring(GridPoint at, GridPoint from, Visit&& visit) noexcept {
    const Vec3d centre = position(at);
    if (!holes_ && from.i > 1 && from.j > 1 && from.i + from.j < n_ - 1) {
      GridPoint corner = from + GridPoint{1, 0};
      const Vec3d first = position(corner);
      Vec3d place = first;
      for (std::size_t k = 1; k < kAround.size(); ++k) {
        const GridPoint next = from + kAround[k];
        const Vec3d there = k + 1 < kAround.size() ? position(next) : first;
        visit(MicroTriangle{slab_, {at, corner, next}, {centre, place, there}});
        corner = next;
        place = there;
      }
      return;
    }
    GridPoint step = {1, 0}, before;
    bool have = false;
    Vec3d before_position;
    for (int k = 0; k < 7; ++k, step = turned(step)) {
      const GridPoint next = from + step;
      if (!detail::on_grid(n_, next)) {
        have = false;
        continue;
      }
      std::array<GridPoint, 3> cell = {at, have ? before : next, next};
      const bool exists = stitch(cell);
      const Vec3d here = position(cell[2]);
      if (have && exists) visit(MicroTriangle{slab_, cell, {centre, before_position, here}});
      before = next;
      before_position = here;
      have = true;
    }
  }

  const Snapshot& model_;
  bool holes_;
  SlabId slab_ = kNoSlab;
  SlabCorners corners_{};
  int n_ = 0;
  double step_ = 0;  ///< 1 over n where that is exact, else 0
  std::array<int, 3> edges_{};
  const float* displacement_ = nullptr;
  bool is_child_ = false;
  mutable bool root_known_ = false;  ///< root_ is of the slab in hand, of which many are passed over without a place
  mutable InRoot root_{};
  mutable int placed_ = 0;
};

/// Returns the surface at a place, its normal interpolated from the triangle's samples.
[[nodiscard]] SurfacePoint point_of(MicroTriangles& surface, const SurfacePlace& place,
                                    detail::CellNormals& known) noexcept;
/// Returns the same for place_at(); empty where there is a hole or no such slab.
[[nodiscard]] inline std::optional<SurfacePoint> point_at(MicroTriangles& surface, SlabId slab, double u, double v,
                                                          detail::CellNormals& known) noexcept {
  if (slab >= surface.mesh().slab_count()) return std::nullopt;
  const auto place = surface.place_at(slab, u, v);
  if (!place) return std::nullopt;
  return point_of(surface, *place, known);
}

}  // namespace relief
