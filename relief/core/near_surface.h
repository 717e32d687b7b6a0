// The micro-triangles near a point, by the bounds of the tiles.
#pragma once

#include <relief/core/micro_triangles.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace relief::detail {

/// A triangle near a point: a micro-triangle, or half of a square of them that is nearly flat.
struct NearTriangle {
  SlabId slab = kNoSlab;
  std::array<GridPoint, 3> corners;
  std::array<Vec3d, 3> relative;  ///< the corners' positions relative to the point that was asked about
  std::array<double, 3> weights;  ///< of the corners, at the triangle's own point nearest to that
  Vec3d nearest;                  ///< this point, relative to the one that was asked about
  double distance2 = 0;

  NearTriangle() = default;
  NearTriangle(SlabId s, const std::array<GridPoint, 3>& c, const std::array<Vec3d, 3>& p) noexcept
      : slab(s),
        corners(c),
        relative(p),
        weights(nearest_in_triangle({}, p[0], p[1], p[2])),
        nearest(p[0] * weights[0] + p[1] * weights[1] + p[2] * weights[2]),
        distance2(dot(nearest, nearest)) {}
};

/// A slab's grid relative to a point: P(i, j, alpha) = (a + b i + c j) + (d + e i + f j) alpha.
class NearSlab {
 public:
  using Corners = std::array<GridPoint, 3>;
  using Places = std::array<Vec3d, 3>;

  /// `surface` has entered the slab. Squares between whose bounds there is no more than `flat` may count as flat, at
  /// the upper bound: the same ones for every point.
  NearSlab(MicroTriangles& surface, SlabId slab, Vec3d point, double flat) noexcept
      : surface_(surface),
        slab_(slab),
        n_(surface.intervals()),
        bounds_(surface.model().tile(Layer::Displacement, slab).bounds()),
        flat_(flat),
        step_(1.0 / n_),
        a_(surface.corners().inner[0] - point),
        b_((surface.corners().inner[1] - surface.corners().inner[0]) * step_),
        c_((surface.corners().inner[2] - surface.corners().inner[0]) * step_),
        d_(surface.corners().fibre(0)),
        e_((surface.corners().fibre(1) - d_) * step_),
        f_((surface.corners().fibre(2) - d_) * step_) {
    const Vec3d second = surface.corners().fibre(1), third = surface.corners().fibre(2);
    thickest_ = std::sqrt(std::max({dot(d_, d_), dot(second, second), dot(third, third)}));
    widening_ = length(e_) + length(f_);
    stretch_ = surface.stretch();
    if (surface.has_holes()) {
      const SampleBounds& holes = surface.model().tile(Layer::Void, slab).bounds();
      pierced_ = holes.between(holes.levels() - 1, 0, 0).high > 0;
    }
  }

  /// Lowers `reach` until no micro-triangle is nearer, but looks no further once it is `enough` or less; by no more
  /// than to half of the distance where the bounds tell it, to the distance itself where they do not.
  void keep_clear(double& reach, double enough) const noexcept {
    struct Candidate {
      Number at;
      double least;
    };
    std::array<Candidate, 32> stack;
    std::size_t depth = 0;
    const auto look = [&](const Number& at) noexcept {
      surface_.add_placed(1);
      const Square square(*this, at.level, at.i, at.j, reaches_edge(at));
      const double least = square.least();
      if (least >= reach) return;
      // How near it is at most: the surface is over all of a whole square, and over the middle of any.
      const bool whole = (at.i + at.j + 2) * SampleBounds::side(at.level) <= n_;
      const double most = whole ? least + 2 * square.off : length(square.centre) + square.off;
      if (least > enough && 2 * least >= most) {
        reach = least;
        return;
      }
      std::size_t k = depth++;
      for (; k > 0 && stack[k - 1].at.level == at.level && stack[k - 1].least < least; --k) stack[k] = stack[k - 1];
      stack[k] = {at, least};
    };
    look({bounds_.levels() - 1, 0, 0});
    while (depth > 0 && reach > enough) {
      const Candidate nearest = stack[--depth];
      if (nearest.least >= reach) continue;
      if (nearest.at.level > 0) {
        for_each_child(nearest.at, look);
      } else {
        const bool stitched = reaches_edge(nearest.at);
        const Square square(*this, 0, nearest.at.i, nearest.at.j, stitched);
        double reach2 = reach * reach;
        triangles(square, nearest.at.i * SampleBounds::kSide, nearest.at.j * SampleBounds::kSide, stitched || pierced_,
                  reach2, [&](const Corners& corners, const Places& places) noexcept {
                    const double distance2 = NearTriangle(slab_, corners, places).distance2;
                    if (!(distance2 < reach2)) return;
                    reach2 = distance2;
                    reach = std::sqrt(reach2);
                  });
      }
    }
  }

  /// Calls take(corners, positions) for triangles that may be nearer than the root of reach2, which take may lower.
  template <typename Take>
  void search(double& reach2, Take&& take) const noexcept {
    std::array<Number, 32> stack;
    std::size_t depth = 0;
    stack[depth++] = {bounds_.levels() - 1, 0, 0};
    double reach = std::sqrt(reach2), known = reach2;
    while (depth > 0) {
      const Number at = stack[--depth];
      const int side = SampleBounds::side(at.level);
      const int i0 = at.i * side, j0 = at.j * side;
      const bool whole = i0 + j0 + 2 * side <= n_;
      const bool stitched = reaches_edge(at);
      const Square square(*this, at.level, at.i, at.j, stitched);
      if (reach2 != known) {
        known = reach2;
        reach = std::sqrt(reach2);
      }
      if (!square.near(reach)) continue;
      if (whole && !stitched && !pierced_ && 2 * square.off <= flat_) {
        flat(square, {i0, j0}, side, take);
      } else if (at.level == 0) {
        triangles(square, i0, j0, stitched || pierced_, reach2, take);
      } else {
        for_each_child(at, [&](const Number& child) { stack[depth++] = child; });
      }
    }
  }

 private:
  /// Of a square.
  struct Number {
    int level, i, j;
  };
  /// Whether stitching may draw triangles into the square or out of it.
  [[nodiscard]] bool reaches_edge(const Number& at) const noexcept {
    return stretch_ > 0 && (at.i == 0 || at.j == 0 || (at.i + at.j + 2) * SampleBounds::side(at.level) >= n_);
  }
  template <typename Visit>
  void for_each_child(const Number& at, Visit&& visit) const noexcept {
    const int m = bounds_.squares(at.level - 1);
    for (int k = 0; k < 4; ++k) {
      const Number child = {at.level - 1, 2 * at.i + (k & 1), 2 * at.j + (k >> 1)};
      if (child.i + child.j < m) visit(child);
    }
  }

  [[nodiscard]] Vec3d fibre(double i, double j) const noexcept { return d_ + e_ * i + f_ * j; }
  [[nodiscard]] Vec3d at(double i, double j, double alpha) const noexcept {
    return (a_ + b_ * i + c_ * j) + fibre(i, j) * alpha;
  }

  /// The parallelogram half-way between a square's bounds, and how far its micro-triangles may be off it: half of what
  /// is between them, and what a sloping square of a widening slab is bent.
  struct Square {
    Vec3d centre, u, v;  ///< u, v: per grid step
    double half, off, above;

    Square(const NearSlab& slab, int level, int i, int j, bool stitched) noexcept {
      half = 0.5 * SampleBounds::side(level);
      const double ci = (2 * i + 1) * half, cj = (2 * j + 1) * half;
      SampleBounds::Between heights = slab.bounds_.between(level, i, j);
      if (stitched) {  // draws corners along the edge, to samples outside the square
        half += slab.stretch_;
        heights = {0, 1, 0, 0};
      }
      const double middle = (heights.low + heights.high) / 2;
      const Vec3d along = slab.fibre(ci, cj);
      centre = (slab.a_ + slab.b_ * ci + slab.c_ * cj) + along * middle;
      u = slab.b_ + slab.e_ * middle + along * heights.slope_i;
      v = slab.c_ + slab.f_ * middle + along * heights.slope_j;
      const double bend = slab.widening_ * (std::abs(heights.slope_i) + std::abs(heights.slope_j)) * half * half;
      above = (heights.high - heights.low) / 2;
      off = above * slab.thickest_ + bend + 1e-9 * slab.thickest_;
    }

    /// No edge of a micro-triangle in it is longer than the root of this, unless it is stitched.
    [[nodiscard]] double longest2() const noexcept {
      const double along = std::sqrt(std::max({dot(u, u), dot(v, v), dot(u - v, u - v)})) + 2 * off;
      return along * along;
    }
    /// How far the point is outside along u and along v, in parts of n2, the square of cross(u, v).
    [[nodiscard]] std::array<double, 2> past(double u2, double v2, double uv, double n2) const noexcept {
      const double to_u = dot(centre, u), to_v = dot(centre, v);
      return {std::max(0.0, std::abs(to_u * v2 - to_v * uv) - half * n2),
              std::max(0.0, std::abs(to_v * u2 - to_u * uv) - half * n2)};
    }
    /// No micro-triangle is nearer than this.
    [[nodiscard]] double least() const noexcept {
      const Vec3d n = cross(u, v);
      const double n2 = dot(n, n), high = dot(centre, n);
      if (!(n2 > 0)) return 0;
      const double u2 = dot(u, u), v2 = dot(v, v);
      const auto [past_u, past_v] = past(u2, v2, dot(u, v), n2);
      return std::sqrt((high * high + std::max(past_u * past_u / v2, past_v * past_v / u2)) / n2) - off;
    }
    /// Whether a micro-triangle may be nearer than `reach`.
    [[nodiscard]] bool near(double reach) const noexcept {
      const double slack2 = (reach + off) * (reach + off);
      const double u2 = dot(u, u), v2 = dot(v, v), uv = dot(u, v), far2 = dot(centre, centre);
      // The corners are no farther from the centre than this.
      const double round2 = half * half * (u2 + v2 + 2 * std::abs(uv)), over = far2 - slack2 - round2;
      if (over > 0 && over * over > 4 * slack2 * round2) return false;
      const Vec3d n = cross(u, v);
      const double n2 = dot(n, n), high = dot(centre, n), aside2 = slack2 * n2 - high * high;
      if (!(n2 > 0)) return true;
      if (aside2 < 0) return false;
      const auto [past_u, past_v] = past(u2, v2, uv, n2);
      return past_u * past_u <= aside2 * v2 && past_v * past_v <= aside2 * u2;
    }
  };

  template <typename Take>
  void flat(const Square& square, GridPoint low, int side, Take&& take) const noexcept {
    const Vec3d centre = square.centre + fibre(low.i + square.half, low.j + square.half) * square.above;
    const Vec3d u = square.u * square.half, v = square.v * square.half;
    const GridPoint right = {low.i + side, low.j}, left = {low.i, low.j + side}, high = {low.i + side, low.j + side};
    const Vec3d at_right = centre + u - v, at_left = centre - u + v;
    take(Corners{low, right, left}, Places{centre - u - v, at_right, at_left});
    take(Corners{right, high, left}, Places{at_right, centre + u + v, at_left});
  }

  template <typename Take>
  void triangles(const Square& square, int i0, int j0, bool changed, const double& reach2, Take&& take) const noexcept {
    constexpr int kSide = SampleBounds::kSide, kRow = kSide + 1;
    // Number by number: as vectors they are stored and loaded in pieces of different size, which stalls.
    constexpr std::size_t kPlaces = kRow * kRow;
    std::array<double, kPlaces> x, y, z, distance2;
    const int rows = std::min(kSide, n_ - j0);
    const auto columns = [&](int j) noexcept { return std::min(kSide, n_ - i0 - j0 - j); };
    for (int j = 0; j <= rows; ++j)
      for (int i = 0; i <= columns(j); ++i) {
        const GridPoint p = {i0 + i, j0 + j};
        const auto k = static_cast<std::size_t>(j * kRow + i);
        const Vec3d there = at(p.i, p.j, surface_.displacement(p));
        x[k] = there.x, y[k] = there.y, z[k] = there.z;
        distance2[k] = dot(there, there);
      }
    surface_.add_placed(kRow * (rows + 1));
    // A place in a triangle is no nearer than the nearest corner's square less a third of the longest edge's.
    const double third = square.longest2() / 3;
    // The triangle at corner (i, j) of a cell, or with turn = 1 the one across from it.
    const auto one = [&](int i, int j, int turn) noexcept {
      const auto a = static_cast<std::size_t>(j * kRow + i + turn), c = static_cast<std::size_t>(j * kRow + i + kRow);
      const auto b = static_cast<std::size_t>(j * kRow + i + 1 + turn * kRow);
      if (!changed && std::min({distance2[a], distance2[b], distance2[c]}) - third >= reach2) return;
      const GridPoint g = {i0 + i, j0 + j};
      Corners corners = {{{g.i + turn, g.j}, {g.i + 1, g.j + turn}, {g.i, g.j + 1}}};
      if (!changed) {
        take(corners, Places{{{x[a], y[a], z[a]}, {x[b], y[b], z[b]}, {x[c], y[c], z[c]}}});
        return;
      }
      if (!surface_.stitch(corners)) return;
      Places p;
      for (std::size_t k = 0; k < 3; ++k) p[k] = at(corners[k].i, corners[k].j, surface_.displacement(corners[k]));
      take(corners, p);
    };
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < columns(j); ++i) {
        one(i, j, 0);
        if (i0 + i + j0 + j + 1 < n_) one(i, j, 1);
      }
  }

  MicroTriangles& surface_;
  SlabId slab_;
  int n_;
  const SampleBounds& bounds_;
  double flat_, step_;
  Vec3d a_, b_, c_, d_, e_, f_;
  double thickest_, widening_;
  int stretch_;
  bool pierced_ = false;
};

/// Calls take(slab, corners, their positions relative to the point) for each triangle that may be nearer to the point
/// than the root of reach2, which take may lower; see visit_near().
template <typename Take>
void gather_near(MicroTriangles& surface, Vec3d point, double flat, double& reach2, Take&& take) noexcept {
  surface.mesh().visit_tree([&](const Box3d& box) { return box.distance2(point) < reach2; },
                            [&](SlabId s) {
                              surface.enter(s);
                              NearSlab(surface, s, point, flat).search(reach2, [&](const auto& corners, const auto& p) {
                                take(s, corners, p);
                              });
                              return false;
                            });
}

/// Calls visit(NearTriangle) for each triangle nearer to the point than the root of reach2, which visit may lower. The
/// micro-triangles of a square between whose bounds there is no more than `flat` (model units) count as two. Cost: the
/// slabs whose boxes are that near, a few squares each, and some 32 micro-triangles for a square that is near and not
/// flat.
template <typename Visit>
void visit_near(MicroTriangles& surface, Vec3d point, double flat, double& reach2, Visit&& visit) noexcept {
  gather_near(surface, point, flat, reach2, [&](SlabId slab, const auto& corners, const auto& p) {
    const Vec3d area = cross(p[1] - p[0], p[2] - p[0]);
    const double height = dot(p[0], area);
    if (height * height >= reach2 * dot(area, area)) return;
    if (const NearTriangle t(slab, corners, p); t.distance2 < reach2) visit(t);
  });
}

/// Up to `reach` no micro-triangle is nearer to the point than this, and, where it is less than `reach`, one is nearer
/// than about twice this; where it is `enough` or less, no more than that is said. `nearest`: the slab to look at
/// first, and then the one to look at first for a place near by. Cost: the slabs whose boxes are that near, a square or
/// a few of each, and the micro-triangles of one square where the point is nearer to them than they are long.
[[nodiscard]] inline double clear_around(MicroTriangles& surface, Vec3d point, double enough, double reach,
                                         SlabId& nearest) noexcept {
  const SlabId first = nearest;
  const auto is_near = [&](const Box3d& box) { return box.distance2(point) < reach * reach; };
  const auto search = [&](SlabId s) {
    const double before = reach;
    surface.enter(s);
    NearSlab(surface, s, point, 0).keep_clear(reach, enough);
    if (reach < before) nearest = s;
    return reach <= enough;
  };
  const bool known = first < surface.mesh().slab_count() && is_near(surface.mesh().box(first));
  if (!(known && search(first)))
    surface.mesh().visit_tree(is_near, [&](SlabId s) { return !(known && s == first) && search(s); });
  return reach * (1 - 1e-9);
}

/// Whether no micro-triangle is nearer to the point than `reach`. Cost: as visit_near(), up to the first that is.
[[nodiscard]] inline bool nothing_near(MicroTriangles& surface, Vec3d point, double reach) noexcept {
  double reach2 = reach * reach;
  bool nothing = true;
  visit_near(surface, point, 0, reach2, [&](const NearTriangle&) noexcept {
    nothing = false;
    reach2 = 0;
  });
  return nothing;
}

}  // namespace relief::detail
