// The micro-triangles near a point, by the bounds of the tiles.
#pragma once

#include <relief/base/lanes.h>
#include <relief/base/triangle.h>
#include <relief/core/micro_triangles.h>
#include <relief/core/query.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace relief::detail {

/// A triangle near a point: a micro-triangle, or half of a square of them that is nearly flat.
struct NearTriangle {
  SlabId slab = kNoSlab;
  std::array<GridPoint, 3> corners;
  std::array<Vec3d, 3> relative;  ///< the corners' positions relative to the point that was queried
  std::array<double, 3> weights;  ///< of the corners, at the triangle's own point nearest to that
  Vec3d nearest;                  ///< this point, relative to the one that was queried
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

/// A square of a slab's grid, see SampleBounds.
struct GridSquare {
  SlabId slab;
  int level, i, j;
  bool flat;  ///< its micro-triangles count as two

  bool operator==(const GridSquare&) const = default;
};

/// A vector in each of four lanes.
using FourVectors = Vec3<Four>;

/// Four squares, each by the parallelogram half-way between its bounds, swept along the fibres up to them. In floats,
/// relative to a point, in units of about the distance that is asked about.
struct Sheets {
  /// Four pairs of planes, alike on both sides of the centre.
  struct Strips {
    FourVectors across;  ///< unit, or zero where the planes are not known
    Four half{};         ///< how far from the centre they are

    /// `corner`: a point of the planes is so far along `way`.
    Strips(FourVectors way, Four corner, FourMask known) noexcept {
      const Four none = {}, by = known ? 1 / root(dot(way, way)) : none;
      across = way * by;
      half = corner * by;
    }
    Strips() = default;
    /// Returns how far outside a place is, squared.
    [[nodiscard]] Four past2(FourVectors place) const noexcept {
      const Four along = dot(across, place), past = greatest(along, -along) - half, none = {};
      return past > 0 ? past * past : none;
    }
  };

  static constexpr float kRounding = 1e-4F;  ///< of a distance: above what floats round

  FourVectors centre;
  Four off{};                    ///< how far the squares' triangles may be off what is swept
  Four round{};                  ///< no corner is farther from the centre
  std::array<Strips, 3> strips;  ///< along the plane, and between two opposite sides each

  Sheets() = default;
  /// `u`, `v`: from the centre half-way to the corners; `sweep`: as far as the parallelogram goes to either side.
  Sheets(FourVectors middle, FourVectors u, FourVectors v, FourVectors sweep, Four deviation) noexcept
      : centre(middle), off(deviation + kRounding) {
    const FourVectors n = cross(u, v);
    const Four n2 = dot(n, n), u2 = dot(u, u), v2 = dot(v, v), uv = dot(u, v), none = {};
    round = root(u2 + v2 + 2 * greatest(uv, -uv)) + root(dot(sweep, sweep));
    const FourMask known = (n2 > kNeedle * u2 * v2) & (u2 < kLarge2) & (v2 < kLarge2);
    const auto strip = [&](FourVectors across, Four corner) noexcept {
      const Four swept = dot(across, sweep);
      return Strips(across, corner + greatest(swept, -swept), known);
    };
    strips = {strip(n, none), strip(cross(v, n), n2), strip(cross(n, u), n2)};
  }
  /// Returns a bit for each square that is not known to be farther than `reach` from a place; `least`: the triangles of
  /// those are no nearer.
  [[nodiscard]] unsigned may_be_near(Vec3f place, float reach, Four& least) const noexcept {
    const FourVectors from = {centre.x - place.x, centre.y - place.y, centre.z - place.z};
    const Four centre2 = dot(from, from), most = off + reach, rim = most + round;
    const unsigned around = bits_of(centre2 < rim * rim);
    if (around == 0) return 0;  // so for most, and their strips need not come to the cache
    const Four sheet2 = strips[0].past2(from) + greatest(strips[1].past2(from), strips[2].past2(from));
    const unsigned near = around & bits_of(sheet2 < most * most);
    if (near != 0) least = greatest(root(sheet2), root(centre2) - round) - off;
    return near;
  }
  /// Returns how far the centres are from a place, and how far the squares' triangles reach from there.
  [[nodiscard]] Four far_from(Vec3f place) const noexcept {
    const FourVectors from = {centre.x - place.x, centre.y - place.y, centre.z - place.z};
    return root(dot(from, from));
  }
  [[nodiscard]] Four wide() const noexcept { return round + off; }
  /// Takes over one of others.
  void take(std::size_t lane, const Sheets& from, std::size_t other) noexcept {
    const auto move = [&](Four& to, const Four& of) noexcept { to[lane] = of[other]; };
    const auto move_all = [&](FourVectors& to, const FourVectors& of) noexcept {
      for (std::size_t k = 0; k < 3; ++k) move(to[k], of[k]);
    };
    move_all(centre, from.centre);
    move(off, from.off);
    move(round, from.round);
    for (std::size_t k = 0; k < strips.size(); ++k) {
      move_all(strips[k].across, from.strips[k].across);
      move(strips[k].half, from.strips[k].half);
    }
  }
  void set_never_near(std::size_t lane) noexcept {
    centre.x[lane] = kFar;
    off[lane] = round[lane] = 0;
  }

 private:
  // Floats are too coarse for what is large (half a side, squared) and for needles (an angle's squared sine).
  static constexpr float kLarge2 = 16, kNeedle = 1e-2F;
  static constexpr float kFar = 1e9F;
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

  /// Lowers `reach` until no micro-triangle is nearer; stops once it is `enough` or less. Bounds lower it to half of
  /// the distance at most, samples to the distance itself. After `limit` samples the bounds of the smallest squares
  /// decide.
  void keep_clear(double& reach, double enough, int limit) const noexcept {
    struct Candidate {
      Number at;
      double least;
    };
    std::array<Candidate, 32> stack;
    std::size_t depth = 0;
    const auto look = [&](const Number& at) noexcept {
      surface_.add_placed(1);
      const Square square(*this, at.level, at.i, at.j, overhangs(at));
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
      } else if (surface_.placed() >= limit) {
        reach = nearest.least;
      } else {
        const bool stitched = reaches_edge(nearest.at);
        const Square square(*this, 0, nearest.at.i, nearest.at.j, overhangs(nearest.at));
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

  /// Calls take(corners, positions) for the triangles that may be no farther than the root of reach2, which take may
  /// lower. Of the parts of a square the nearer come first.
  template <typename Take>
  void nearest_first(const double& reach2, Take&& take) const noexcept {
    // In floats a slab is eight units wide, and so are its squares known; far from it they are too coarse.
    const double scale = 8 / (std::sqrt(std::max(dot(b_, b_), dot(c_, c_))) * n_);
    const bool far = !(length(a_) * scale < kFarInFloats);
    const FloatSlab slab(*this, far ? 0 : scale);
    struct Candidate {
      Number at;
      double least;
    };
    std::array<Candidate, 32> stack;
    std::size_t depth = 0;
    double known2 = reach2, reach = std::sqrt(known2);
    const auto put = [&](const Number& at, double least) noexcept {
      std::size_t k = depth++;
      for (; k > 0 && stack[k - 1].at.level == at.level && stack[k - 1].least < least; --k) stack[k] = stack[k - 1];
      stack[k] = {at, least};
    };
    const auto put_parts = [&](const Number& square) noexcept {
      const auto [four, count] = children(square);
      if (far) {
        for (std::size_t k = 0; k < count; ++k)
          if (const double least = this->square(four[k]).least(); least <= reach) put(four[k], least);
        return;
      }
      Four least;
      const unsigned near = slab.sheets(*this, four, count).may_be_near({}, static_cast<float>(reach * scale), least);
      for (unsigned bits = near & ((1U << count) - 1); bits != 0; bits &= bits - 1) {
        const auto lane = static_cast<std::size_t>(std::countr_zero(bits));
        put(four[lane], double{least[lane]} / scale);
      }
    };
    put({bounds_.levels() - 1, 0, 0}, 0);
    while (depth > 0) {
      const auto [at, least] = stack[--depth];
      if (reach2 != known2) {
        known2 = reach2;
        reach = std::sqrt(known2);
      }
      if (least > reach) continue;
      if (at.level > 0) {
        put_parts(at);
        continue;
      }
      const Square smallest = square(at);
      if (smallest.least() <= reach)
        triangles(smallest, at.i * SampleBounds::kSide, at.j * SampleBounds::kSide, reaches_edge(at) || pierced_,
                  reach2, take);
    }
  }

  /// Calls take(square, sheets, lane) for the squares that may be nearer than `reach`. Flat squares may have any size;
  /// others are the largest up to `size` and kCoarsest, or the smallest. `scale`: 1 over the sheets' unit.
  template <typename Take>
  void squares(double reach, double size, double scale, Take&& take) const noexcept {
    const double step = std::sqrt(std::max(dot(b_, b_), dot(c_, c_)));
    int level = 0;
    while (level < kCoarsest && SampleBounds::side(level + 1) * step <= size) ++level;
    const Number all = {bounds_.levels() - 1, 0, 0};
    if (all.level <= level) return descend({all}, 1, level, reach, scale, take);
    const auto [four, count] = children(all);  // four take no longer than one, which is as large as the slab's box
    descend(four, count, level, reach, scale, take);
  }
  static constexpr int kParted = 2, kMostParts = 1 << (2 * kParted), kCoarsest = 2 * kParted;
  /// The same for all squares so many levels below a larger one, or the smallest in it.
  template <typename Take>
  void parts(const GridSquare& square, double scale, Take&& take) const noexcept {
    const auto [four, count] = children({square.level, square.i, square.j});
    for (int down = 1; down <= std::min(kParted, square.level); ++down) {
      const int level = square.level - down, i = square.i << down, m = bounds_.squares(level);
      for (int j = square.j << down; j < (square.j + 1) << down && i + j < m; ++j) bounds_.fetch(level, i, j);
    }
    descend(four, count, std::max(0, square.level - kParted), std::numeric_limits<double>::infinity(), scale, take);
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
      const bool stitched = reaches_edge(at);
      const Square square = this->square(at);
      if (reach2 != known) {
        known = reach2;
        reach = std::sqrt(reach2);
      }
      if (!square.near(reach)) continue;
      if (is_flat(at, square)) {
        flat(square, {i0, j0}, side, take);
      } else if (at.level == 0) {
        triangles(square, i0, j0, stitched || pierced_, reach2, take);
      } else {
        for_each_child(at, [&](const Number& child) { stack[depth++] = child; });
      }
    }
  }

  static constexpr int kSamplesWork = 8;  ///< so many samples' time it takes to find a square's
  /// A square's samples by rows, of kRow each, relative to the point; those that there are not lie where one is that
  /// there is. Of a flat one the corners, as if it were a cell.
  struct Samples {
    static constexpr std::size_t kRow = SampleBounds::kSide + 1, kPlaces = kRow * kRow;
    static constexpr std::uint32_t kWhole = 0b01111'01111'01111'01111;  // all triangles of a whole square
    std::array<double, kPlaces> x{}, y{}, z{};
    std::array<GridPoint, kPlaces> corners;  ///< which they are
    /// Bit k: whether there is a triangle of samples k, k + 1 and k + kRow, and whether one across from it.
    std::array<std::uint32_t, 2> triangles{};

    /// Returns the samples of triangle k, or of the one across from it.
    [[nodiscard]] static constexpr std::array<std::size_t, 3> of(std::size_t k, std::size_t across) noexcept {
      return {k + across, k + 1 + across * kRow, k + kRow};
    }
    void put(std::size_t k, GridPoint corner, Vec3d place) noexcept {
      x[k] = place.x, y[k] = place.y, z[k] = place.z;
      corners[k] = corner;
    }
    [[nodiscard]] Vec3d place(std::size_t k) const noexcept { return {x[k], y[k], z[k]}; }
  };
  [[nodiscard]] Samples samples(const GridSquare& square) const noexcept {
    Samples made;
    const Number at = {square.level, square.i, square.j};
    const int side = SampleBounds::side(at.level), i0 = at.i * side, j0 = at.j * side;
    if (square.flat) {
      std::size_t across = 0;
      flat(this->square(at), {i0, j0}, side, [&](const Corners& corners, const Places& places) noexcept {
        for (std::size_t k = 0; k < 3; ++k) made.put(Samples::of(0, across)[k], corners[k], places[k]);
        made.triangles[across++] = 1;
      });
      return made;
    }
    const bool stitched = reaches_edge(at), whole = i0 + j0 + 2 * side <= n_ && !stitched && !pierced_;
    const auto columns = [&](int j) noexcept { return std::min(side, n_ - i0 - j0 - j); };
    const int rows = std::min(side, n_ - j0);
    for (int j = 0; j <= rows; ++j) surface_.fetch({i0, j0 + j}, {i0 + std::max(0, columns(j)), j0 + j});
    for (int j = 0; j <= rows; ++j)
      for (int i = 0; i <= columns(j); ++i) {
        const GridPoint p = {i0 + i, j0 + j}, corner = stitched ? surface_.stitched(p) : p;
        made.put(static_cast<std::size_t>(j) * Samples::kRow + static_cast<std::size_t>(i), corner,
                 this->at(corner.i, corner.j, surface_.displacement(corner)));
      }
    for (std::size_t k = 0; k < Samples::kPlaces && !whole; ++k) {
      const int j = std::min({static_cast<int>(k / Samples::kRow), rows, n_ - i0 - j0});
      const int i = std::min(static_cast<int>(k % Samples::kRow), columns(j));
      const auto there = static_cast<std::size_t>(j) * Samples::kRow + static_cast<std::size_t>(i);
      if (there != k) made.put(k, made.corners[there], made.place(there));
    }
    surface_.add_placed(kSamplesWork);
    if (whole) made.triangles.fill(Samples::kWhole);
    for (int j = 0; j < rows && !whole; ++j)
      for (int i = 0; i < columns(j); ++i)
        for (std::size_t across = 0; across < (i0 + i + j0 + j + 1 < n_ ? 2U : 1U); ++across) {
          const auto k = static_cast<std::size_t>(j) * Samples::kRow + static_cast<std::size_t>(i);
          const auto [a, b, c] = Samples::of(k, across);
          if (surface_.has_triangle({made.corners[a], made.corners[b], made.corners[c]}))
            made.triangles[across] |= 1U << k;
        }
    return made;
  }

 private:
  /// Of a square.
  struct Number {
    int level, i, j;
  };
  /// Returns whether stitching may draw triangles into the square or out of it.
  [[nodiscard]] bool reaches_edge(const Number& at) const noexcept {
    const int side = SampleBounds::side(at.level);
    return stretch_ > 0 && surface_.stitches_in({at.i * side, at.j * side}, side);
  }
  /// Returns whether its triangles may have corners outside it: not where the coarser grid's samples lie no farther
  /// apart than it is wide, for then each lies in the same square as those that it stands for.
  [[nodiscard]] bool overhangs(const Number& at) const noexcept {
    return 2 * stretch_ > SampleBounds::side(at.level) && reaches_edge(at);
  }
  /// Between which planes the samples of a square's triangles lie.
  [[nodiscard]] SampleBounds::Between heights(const Number& at, bool stitched) const noexcept {
    return stitched ? bounds_.around(at.level, at.i, at.j, stretch_) : bounds_.between(at.level, at.i, at.j);
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
      const SampleBounds::Between heights = slab.heights({level, i, j}, stitched);
      if (stitched) half += slab.stretch_;
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
    /// Returns how far the point is outside along u and along v, in parts of n2, the square of cross(u, v).
    [[nodiscard]] std::array<double, 2> past(double u2, double v2, double uv, double n2) const noexcept {
      const double to_u = dot(centre, u), to_v = dot(centre, v);
      return {std::max(0.0, std::abs(to_u * v2 - to_v * uv) - half * n2),
              std::max(0.0, std::abs(to_v * u2 - to_u * uv) - half * n2)};
    }
    /// No micro-triangle is nearer than this.
    [[nodiscard]] double least() const noexcept {
      const Vec3d n = cross(u, v);
      const double n2 = dot(n, n), u2 = dot(u, u), v2 = dot(v, v), uv = dot(u, v);
      if (!(n2 > 0)) return 0;
      const double to_u = dot(centre, u), to_v = dot(centre, v), rim = half * n2;
      const double along_u = to_v * uv - to_u * v2, along_v = to_u * uv - to_v * u2;
      // To one of the sides that are seen from the point.
      const auto to_side = [&](Vec3d across, double place, Vec3d along, double along2) noexcept {
        const Vec3d from = centre + across * std::copysign(half, place);
        const Vec3d away = from - along * std::clamp(dot(from, along) / along2, -half, half);
        return std::abs(place) > rim ? dot(away, away) : std::numeric_limits<double>::infinity();
      };
      double distance2 = std::min(to_side(u, along_u, v, v2), to_side(v, along_v, u, u2));
      if (std::abs(along_u) <= rim && std::abs(along_v) <= rim) {
        const double high = dot(centre, n);
        distance2 = high * high / n2;
      }
      return std::sqrt(distance2) - off;
    }
    /// Returns whether a micro-triangle may be nearer than `reach`.
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

  [[nodiscard]] Square square(const Number& at) const noexcept {
    return Square(*this, at.level, at.i, at.j, overhangs(at));
  }
  struct Children {
    std::array<Number, 4> squares;
    std::size_t count = 0;
  };
  [[nodiscard]] Children children(const Number& at) const noexcept {
    Children found;
    for_each_child(at, [&](const Number& child) { found.squares[found.count++] = child; });
    return found;
  }
  static constexpr double kFarInFloats = 256;  // units, up to which floats tell squares apart
  static constexpr int kFourSquares = 4;       // so many samples' time it takes to look at four squares
  /// Calls take() for what there is in so many squares, down to a level.
  template <typename Take>
  void descend(const std::array<Number, 4>& squares, std::size_t count, int level, double reach, double scale,
               Take&& take) const noexcept {
    surface_.add_placed(kFourSquares);
    const FloatSlab slab(*this, scale);
    const auto near = static_cast<float>(reach * scale);
    std::array<Number, 32> stack;
    std::size_t depth = 0;
    const auto look = [&](const std::array<Number, 4>& four, std::size_t present) noexcept {
      surface_.add_placed(kFourSquares);
      const Sheets sheets = slab.sheets(*this, four, present);
      Four least;
      for (unsigned bits = sheets.may_be_near({}, near, least) & ((1U << present) - 1); bits != 0; bits &= bits - 1) {
        const auto lane = static_cast<std::size_t>(std::countr_zero(bits));
        const Number& at = four[lane];
        const float high = std::max(sheets.off[lane], sheets.strips[0].half[lane]);
        const bool flat = slab.may_be_flat(high) && is_flat(at, square(at));
        if (flat || at.level <= level)
          take(GridSquare{slab_, at.level, at.i, at.j, flat}, sheets, lane);
        else
          stack[depth++] = at;
      }
    };
    look(squares, count);
    while (depth > 0) {
      const auto [four, present] = children(stack[--depth]);
      look(four, present);
    }
  }
  /// Returns whether its micro-triangles may count as two.
  [[nodiscard]] bool is_flat(const Number& at, const Square& square) const noexcept {
    const bool whole = (at.i + at.j + 2) * SampleBounds::side(at.level) <= n_;
    return whole && !reaches_edge(at) && !pierced_ && 2 * square.off <= flat_;
  }

  /// The slab in floats.
  struct FloatSlab {
    FourVectors a, b, c, d, e, f;
    float widening, stretch, rounding, flat;  ///< rounding: more than floats may be off

    FloatSlab(const NearSlab& slab, double scale) noexcept
        : widening(static_cast<float>(slab.widening_ * scale)),
          stretch(static_cast<float>(slab.stretch_)),
          rounding(static_cast<float>(
              1e-6 * scale * (length(slab.a_) + (length(slab.b_) + length(slab.c_)) * slab.n_ + 3 * slab.thickest_))),
          flat(static_cast<float>(slab.flat_ * scale)) {
      const auto in_all = [scale](Vec3d v) noexcept {
        const Vec3f single = to_float(v * scale);
        return FourVectors{Four{} + single.x, Four{} + single.y, Four{} + single.z};
      };
      a = in_all(slab.a_), b = in_all(slab.b_), c = in_all(slab.c_);
      d = in_all(slab.d_), e = in_all(slab.e_), f = in_all(slab.f_);
    }

    [[nodiscard]] bool may_be_flat(float off) const noexcept { return off <= flat + Sheets::kRounding + 3 * rounding; }
    /// As Square, four at a time.
    [[nodiscard]] Sheets sheets(const NearSlab& slab, const std::array<Number, 4>& four,
                                std::size_t count) const noexcept {
      Lanes ci, cj, halves, lows, highs, slopes_i, slopes_j;
      for (std::size_t k = 0; k < count; ++k) {
        const Number& at = four[k];
        const float half = 0.5F * static_cast<float>(SampleBounds::side(at.level));
        const bool stitched = slab.overhangs(at);
        ci.of[k] = static_cast<float>(2 * at.i + 1) * half;
        cj.of[k] = static_cast<float>(2 * at.j + 1) * half;
        halves.of[k] = stitched ? half + stretch : half;
        const SampleBounds::Between heights = slab.heights(at, stitched);
        lows.of[k] = static_cast<float>(heights.low);
        highs.of[k] = static_cast<float>(heights.high);
        slopes_i.of[k] = static_cast<float>(heights.slope_i);
        slopes_j.of[k] = static_cast<float>(heights.slope_j);
      }
      const Four i = ci.all(), j = cj.all(), half = halves.all(), low = lows.all(), high = highs.all();
      const Four slope_i = slopes_i.all(), slope_j = slopes_j.all(), middle = (low + high) * 0.5F;
      const FourVectors along = d + e * i + f * j;
      const Four above = (high - low) * 0.5F, steep = greatest(slope_i, -slope_i) + greatest(slope_j, -slope_j);
      return {a + b * i + c * j + along * middle, (b + e * middle + along * slope_i) * half,
              (c + f * middle + along * slope_j) * half, along * above,
              widening * half * (steep * half + above) + rounding};
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

  /// The triangles of a smallest square; `changed`: some may be stitched or left out.
  template <typename Take>
  void triangles(const Square& square, int i0, int j0, bool changed, const double& reach2, Take&& take) const noexcept {
    if (changed)
      triangles<true>(square, i0, j0, reach2, take);
    else
      triangles<false>(square, i0, j0, reach2, take);
  }
  template <bool kChanged, typename Take>
  void triangles(const Square& square, int i0, int j0, const double& reach2, Take&& take) const noexcept {
    constexpr int kSide = SampleBounds::kSide, kRow = kSide + 1;
    // Number by number: as vectors they are stored and loaded in pieces of different size, which stalls.
    constexpr std::size_t kPlaces = std::size_t{kRow} * kRow;
    std::array<double, kPlaces> x, y, z, distance2;
    std::array<GridPoint, kChanged ? kPlaces : 0> stitched;  // the samples that stand for those
    const int rows = std::min(kSide, n_ - j0);
    const auto columns = [&](int j) noexcept { return std::min(kSide, n_ - i0 - j0 - j); };
    for (int j = 0; j <= rows; ++j)
      for (int i = 0; i <= columns(j); ++i) {
        GridPoint p = {i0 + i, j0 + j};
        const auto k = static_cast<std::size_t>(j * kRow + i);
        if constexpr (kChanged) stitched[k] = p = surface_.stitched(p);
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
      const bool far = std::min({distance2[a], distance2[b], distance2[c]}) - third >= reach2;
      if (!kChanged && far) return;
      const GridPoint g = {i0 + i, j0 + j};
      Corners corners = {{{g.i + turn, g.j}, {g.i + 1, g.j + turn}, {g.i, g.j + 1}}};
      if constexpr (kChanged) {
        const Corners drawn = {stitched[a], stitched[b], stitched[c]};
        if ((far && drawn == corners) || !surface_.has_triangle(drawn)) return;
        corners = drawn;
      }
      take(corners, Places{{{x[a], y[a], z[a]}, {x[b], y[b], z[b]}, {x[c], y[c], z[c]}}});
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

/// Returns what of a slab's box its micro-triangles are in: far less than all of it where the fibres are longer than
/// the slab is wide. Some thirty nanoseconds, a third of what it takes to enter the slab and look at its first square.
[[nodiscard]] inline Box3d surface_box(const Snapshot& model, SlabId slab) noexcept {
  const SlabMesh& mesh = model.slab_mesh();
  const auto [low, high] = model.tile(Layer::Displacement, slab).bounds().range();
  Box3d box;
  for (const FibreId f : mesh.slabs()[slab].fibres) {
    const Fibre& fibre = mesh.fibres()[f];
    box.add(fibre.inner + fibre.direction() * low);
    box.add(fibre.inner + fibre.direction() * high);
  }
  return box;
}

/// Calls take(slab, corners, their positions relative to the point) for each triangle that may be nearer to the point
/// than the root of reach2, which take may lower; see visit_near().
template <typename Take>
void gather_near(MicroTriangles& surface, Vec3d point, double flat, double& reach2, Take&& take) noexcept {
  surface.mesh().visit_tree([&](const Box3d& box) { return box.distance2(point) < reach2; },
                            [&](SlabId s) {
                              if (!(surface_box(surface.model(), s).distance2(point) < reach2)) return false;
                              surface.enter(s);
                              NearSlab(surface, s, point, flat).search(reach2, [&](const auto& corners, const auto& p) {
                                take(s, corners, p);
                              });
                              return false;
                            });
}

/// Calls visit(NearTriangle) for each triangle nearer to the point than the root of reach2, which visit may lower. A
/// square between whose bounds there is at most `flat` (model units) counts as two triangles. Cost: the slabs whose
/// boxes are as near, a few squares each, and about 32 micro-triangles per near square.
template <typename Visit>
void visit_near(MicroTriangles& surface, Vec3d point, double flat, double& reach2, Visit&& visit) noexcept {
  gather_near(surface, point, flat, reach2, [&](SlabId slab, const auto& corners, const auto& p) {
    const Vec3d area = cross(p[1] - p[0], p[2] - p[0]);
    const double height = dot(p[0], area);
    if (height * height >= reach2 * dot(area, area)) return;
    if (const NearTriangle t(slab, corners, p); t.distance2 < reach2) visit(t);
  });
}

inline constexpr int kAnyWork = 1 << 30;
/// Returns a lower bound of the distance to the surface, at most `reach`, tight within a factor of two. It stops
/// refining at `enough`, or after `work` samples, and is not tight where thousands of boxes are equally near then.
/// `nearest`: the slab to begin with, and on return a good one for a place near by. Cost: the slabs whose boxes are as
/// near, a few squares each; more where many squares are as near as `enough`.
[[nodiscard]] double clear_around(MicroTriangles& surface, Vec3d point, double enough, double reach, SlabId& nearest,
                                  int work = kAnyWork) noexcept;

/// Returns whether no micro-triangle is nearer to the point than `reach`. Cost: as visit_near(), up to the first that
/// is.
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
