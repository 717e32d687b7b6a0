#include <relief/core/sweep.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relief {

namespace {

using Weights = std::array<double, 3>;
using detail::LinearForm;
using detail::solve;

constexpr double kAnywhere = std::numeric_limits<double>::infinity();
// Of a cell, and of the fibre: what rounding may do to coordinates. Newton's steps end a billionth of the slab from a
// place, which is 3e-4 of a cell of n = 128 where volumes are 2,000 times smaller than elsewhere in the slab.
constexpr double kPad = 1e-3;
// Of the slab: how far before its start a way may already cross, for rounding.
// FirstEntry.BeginsAtMostABillionthOfASlabBelowTheSurface fails at 1e-10 and at 1e-8.
constexpr double kBehind = 1e-9;
// Cells by which a part of a way may bend and is straight enough: with more, more triangles are placed, with less, more
// coordinates worked out. FirstEntry.PlacesFewTriangles fails at 2.
constexpr double kStraight = 0.5;
// Of a way through a slab: 64 parts. Where not even these are known to be straight, all the slab's triangles may be
// met. FirstEntry.PlacesFewTriangles fails at 1.
constexpr int kHalvings = 6;
// Of the slab: how far outside it, of several places with one position, the one that lies deepest is asked for.
// FirstEntry.MissesNothingWhereOutsideASlabItsPositionsComeAgain fails at 0.05.
constexpr double kOwn = 0.5;
// By how much the derivative of the position may change around the middle of a part, of itself: then its inverse at
// most doubles. Any share below 1 is right; with less, more coordinates are worked out, with more, more triangles
// placed.
constexpr double kChange = 0.5;
// Of the sum of two products: where their difference is less, rounding may leave it fewer than ten digits, and where a
// triangle is seen edge-on, its place and even its sign come from those. Were it always worked out exactly, a sweep
// would take a twentieth longer. FirstEntry.IsOnTheWayAlsoAlongAFace fails at 1e-12.
constexpr double kSure = 1e-6;

double det(Vec3d a, Vec3d b, Vec3d c) noexcept { return dot(a, cross(b, c)); }

Weights weights_of(const SlabCoord& at) noexcept { return {1 - at.u - at.v, at.u, at.v}; }

/// a b - c d, of the exact value's sign.
double difference(double a, double b, double c, double d) noexcept {
  const double ab = a * b, cd = c * d, plain = ab - cd;
  if (std::abs(plain) > kSure * (std::abs(ab) + std::abs(cd))) return plain;
  return plain + (std::fma(a, b, -ab) - std::fma(c, d, -cd));
}

/// Returns whether no other place of the slab is known to have the same position, whatever its samples: it lies in the
/// slab itself, or the derivative half-way from it to all of the slab is not singular. The positions of two places
/// differ by the derivative half-way between them times their difference; its determinant is linear in (u, v) and
/// quadratic in alpha, so it is no less than its Bernstein coefficients at the corners.
bool is_one_of_a_kind(const LinearForm& form, const SlabCoord& x) noexcept {
  if (std::min({x.u, x.v, 1 - x.u - x.v, x.alpha, 1 - x.alpha}) >= 0) return true;
  const Vec3d area0 = cross(form.b, form.c), area1 = cross(form.b, form.f) + cross(form.e, form.c),
              area2 = cross(form.e, form.f);
  const double low = x.alpha / 2, high = (x.alpha + 1) / 2;
  for (const auto& [u, v] : {std::array{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}}) {
    const Vec3d along = form.d + form.e * ((x.u + u) / 2) + form.f * ((x.v + v) / 2);
    const double c0 = dot(area0, along), c1 = dot(area1, along), c2 = dot(area2, along);
    const double least = std::min(
        {c0 + (c1 + c2 * low) * low, c0 + (c1 + c2 * high) * high, c0 + c1 * (low + high) / 2 + c2 * low * high});
    if (!(least > 0)) return false;
  }
  return true;
}

/// Least and greatest alpha over a square of so many cells.
std::array<double, 2> range_over(const SampleBounds::Between& heights, double side) noexcept {
  const double slope = (std::abs(heights.slope_i) + std::abs(heights.slope_j)) * side / 2;
  return {heights.low - slope, heights.high + slope};
}

}  // namespace

/// A part of the way over the grid: a straight line from a to b in cells and alpha, give or take.
struct Sweep::Course {
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
/// Says which stretch of a line may be in the triangles of a square, and within how many cells of it; empty where the
/// samples are all above or below it.
struct Sweep::Stretch {
  double from = 0, to = 1, pad = 0;
};

Sweep::Sweep(MicroTriangles& surface, Vec3d from, Vec3d to, Crossing kind) noexcept
    : surface_(surface), kind_(kind), from_(from), way_(to - from) {
  const Box3d& all = surface.mesh().bounds();
  for (std::size_t k = 0; k < 3; ++k) {
    per_way_[k] = way_[k] == 0 ? 1e300 : 1 / way_[k];
    const double slack = 1e-9 * (all.high[k] - all.low[k]) + 1e-15 * std::abs(from[k]);
    low_from_[k] = from[k] + slack;
    high_from_[k] = from[k] - slack;
    if (std::abs(way_[k]) > std::abs(way_[along_])) along_ = k;
  }
  first_ = (along_ + 1) % 3;
  second_ = (along_ + 2) % 3;
  slope_first_ = way_[first_] * per_way_[along_];
  slope_second_ = way_[second_] * per_way_[along_];
  best_ = std::nextafter(1.0, 2.0);
}

std::optional<SurfacePlace> Sweep::run(SlabId first) noexcept {
  if (first < surface_.mesh().slab_count()) {
    put(first, Ahead::Slab, surface_.mesh().box(first));
    if (ahead_count_ > 0) take(ahead_[--ahead_count_]);
    done_ = first;
  }
  put(0, Ahead::Node, surface_.mesh().tree()[0].box);
  while (ahead_count_ > 0 && !(ahead_[ahead_count_ - 1].enter > best_)) take(ahead_[--ahead_count_]);
  if (found_.triangle.slab == kNoSlab) return std::nullopt;
  return found_;
}

void Sweep::take(const Ahead& next) noexcept {
  if (next.what == Ahead::Node)
    look_into(surface_.mesh().tree()[next.number]);
  else if (next.what == Ahead::Cut)
    look_into(surface_.mesh().part(next.number));
  else
    search(next);
}

bool Sweep::clip(const Box3d& box, double& enter, double& leave) const noexcept {
  for (std::size_t k = 0; k < 3; ++k) {
    const double t0 = (box.low[k] - low_from_[k]) * per_way_[k], t1 = (box.high[k] - high_from_[k]) * per_way_[k];
    enter = std::max(enter, std::min(t0, t1));
    leave = std::min(leave, std::max(t0, t1));
  }
  return enter <= leave;
}

void Sweep::put(std::uint32_t number, Ahead::What what, const Box3d& box) noexcept {
  double enter = 0, leave = 1;
  if (clip(box, enter, leave) && enter <= best_) put({enter, leave, number, what});
}

void Sweep::put(const Ahead& one) noexcept {
  if (ahead_count_ == ahead_.size()) return take(one);
  std::size_t k = ahead_count_++;
  for (; k > 0 && ahead_[k - 1].enter < one.enter; --k) ahead_[k] = ahead_[k - 1];
  ahead_[k] = one;
}

void Sweep::look_into(const SlabMesh::Node& node) noexcept {
  const SlabMesh& mesh = surface_.mesh();
  if (node.count == 0) {
    const auto left = static_cast<std::uint32_t>(&node - mesh.tree().data()) + 1;
    put(node.first, Ahead::Node, mesh.tree()[node.first].box);
    put(left, Ahead::Node, mesh.tree()[left].box);
  }
  for (std::uint32_t k = node.count; k-- > 0;) put_root_part(mesh.tree_roots()[node.first + k]);
}

void Sweep::look_into(const SlabMesh::Part& cut) noexcept {
  for (std::uint32_t k = 4; k-- > 0;) put_root_part(cut.children + k);
}

void Sweep::put_root_part(std::uint32_t number) noexcept {
  const SlabMesh& mesh = surface_.mesh();
  const SlabMesh::Part part = mesh.part(number);
  if (part.children != 0)
    put(number, Ahead::Cut, mesh.part_box(number));
  else if (part.slab != done_)
    put(part.slab, Ahead::Slab, mesh.box(part.slab));
}

void Sweep::search(Ahead part) noexcept {
  surface_.enter(part.number);
  slab_ = part.number;
  heights_ = surface_.model().tile(Layer::Displacement, slab_).bounds().range();
  if (part.what == Ahead::Slab) {
    part.what = Ahead::Part;
    if (!clip_to_sides(part.enter, part.leave) || part.enter > best_) return;
    // Its box begins before it does: something else may come first.
    if (ahead_count_ > 0 && ahead_count_ < ahead_.size() && part.enter > ahead_[ahead_count_ - 1].enter)
      return put(part);
  }
  searched_ = slab_;
  const double enter = part.enter, leave = std::min(part.leave, best_);
  whole_ = false;
  const LinearForm form(surface_.corners(), from_);
  const End a = end(form, enter, middle_);
  piece(form, a, end(form, leave, a.known ? a.at : middle_), 0);
  if (whole_) all_cells(enter, leave);
}

Sweep::End Sweep::end(const LinearForm& form, double t, const SlabCoord& start) const noexcept {
  End e{.t = t, .at = start};
  e.known = solve(form, way_ * t, e.at);
  if (e.known && !is_one_of_a_kind(form, e.at))
    if (const auto own = coordinates_in(surface_.mesh(), slab_, from_ + way_ * t, kOwn)) e.at = *own;
  return e;
}

// Positions are a quadratic function of coordinates, so the difference of two is exactly the derivative in the middle
// between them times that of their coordinates. It gives the coordinates that miss where positions do: on the straight
// line between two ends a position misses the way by a quarter of the twist between them at most, and the place of a
// flat triangle misses that with the same weights of its samples' coordinates by a quarter of what twist and height do
// in a cell. The derivative is the one at `middle` and what it changes by from there.
std::optional<Sweep::Bends> Sweep::bends(const LinearForm& form, const End& a, const End& b,
                                         const SlabCoord& middle) const noexcept {
  const Vec3d along = form.d + form.e * middle.u + form.f * middle.v;
  const Vec3d ju = form.b + form.e * middle.alpha, jv = form.c + form.f * middle.alpha;
  const double jacobian = det(ju, jv, along);
  if (!(jacobian > 0)) return std::nullopt;
  // In coordinates: |u| + |v|, and alpha.
  struct Miss {
    double aside, up;
  };
  const auto miss = [&](Vec3d x) noexcept {
    return Miss{(std::abs(det(x, jv, along)) + std::abs(det(ju, x, along))) / jacobian,
                std::abs(det(ju, jv, x)) / jacobian};
  };
  const Miss e = miss(form.e), f = miss(form.f), most = {std::max(e.aside, f.aside), std::max(e.up, f.up)};
  const double du = b.at.u - a.at.u, dv = b.at.v - a.at.v, rise = b.at.alpha - a.at.alpha;
  const double aside = std::abs(du) + std::abs(dv), up = std::abs(rise);
  const double n = surface_.intervals();
  // A stitched triangle is as long as the edge's intervals are apart.
  const double longest = (1 + 2 * surface_.stretch()) / n;
  // What is missed at most, in units of `most`: by the way, and in a cell from alpha 0 to 1.
  const double of_way = aside * up / 4, of_cell = longest / 2;
  // From the middle to half the way, and to all that lies beside it.
  const double beside = (of_way + of_cell * (heights_[1] - heights_[0])) / (1 - kChange);
  const double change = most.aside * (up / 2 + most.up * beside) + most.up * (aside / 2 + most.aside * beside);
  if (!(change <= kChange)) return std::nullopt;
  const double more = change / (1 - change);
  const Miss twist = miss((form.e * du + form.f * dv) * rise);
  return Bends{.way = (twist.aside / 4 + more * most.aside * of_way) * n + kPad,
               .way_alpha = twist.up / 4 + more * most.up * of_way + kPad,
               .cell = ((e.aside + f.aside) / 2 + more * most.aside) * of_cell * n,
               .cell_alpha = ((e.up + f.up) / 2 + more * most.up) * of_cell};
}

void Sweep::piece(const LinearForm& form, const End& a, const End& b, int depth) noexcept {
  if (whole_ || a.t > best_) return;
  SlabCoord start = a.known ? a.at : b.known ? b.at : middle_;
  if (a.known && b.known) {
    start = {slab_, (a.at.u + b.at.u) / 2, (a.at.v + b.at.v) / 2, (a.at.alpha + b.at.alpha) / 2};
    if (const auto bend = bends(form, a, b, start)) {
      // Wholly on the far side of a wall, floor or ceiling?
      const double n = surface_.intervals(), beyond = bend->way + bend->cell,
                   above = bend->way_alpha + bend->cell_alpha;
      const Weights wa = weights_of(a.at), wb = weights_of(b.at);
      for (std::size_t k = 0; k < 3; ++k)
        if (wa[k] * n < -beyond && wb[k] * n < -beyond) return;
      if ((a.at.alpha < -above && b.at.alpha < -above) || (a.at.alpha > 1 + above && b.at.alpha > 1 + above)) return;
      // Stitching makes it uncertain by so many cells anyway.
      if (bend->way <= kStraight + surface_.stretch() || depth >= kHalvings) {
        bend_ = *bend;
        return cells(Course(a, b, surface_.intervals(), bend->way + surface_.stretch(), bend->way_alpha));
      }
    }
  }
  if (depth >= kHalvings) {
    whole_ = true;
    return;
  }
  const End middle = end(form, (a.t + b.t) / 2, start);
  piece(form, a, middle, depth + 1);
  piece(form, middle, b, depth + 1);
}

bool Sweep::clip_to_sides(double& enter, double& leave) const noexcept {
  const SlabCorners& c = surface_.corners();
  const auto [low, high] = heights_;
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

std::optional<Sweep::Stretch> Sweep::over(const Course& line, GridPoint at, int side,
                                          const SampleBounds::Between& heights, double overhang) const noexcept {
  // How far alpha may go in a cell tells how far its flat triangles may be from where it lies in coordinates.
  const double lean = std::abs(heights.slope_i) + std::abs(heights.slope_j);
  const double goes = std::min(1.0, heights.high - heights.low + lean * (1 + 2 * overhang));
  Stretch part = {.pad = line.bend + bend_.cell * goes};
  if (!line.narrow_x(at.i - part.pad, at.i + side + part.pad, part.from, part.to) ||
      !line.narrow_y(at.j - part.pad, at.j + side + part.pad, part.from, part.to))
    return std::nullopt;
  // Its height over a sloping plane is linear, too.
  const double half = side * 0.5, slack = line.bend_alpha + bend_.cell_alpha * goes + part.pad * lean;
  const double rise = line.rise - heights.slope_i * line.dx - heights.slope_j * line.dy;
  const double start = line.alpha - heights.slope_i * (line.x - at.i - half) - heights.slope_j * (line.y - at.j - half);
  const double first = start + rise * part.from, last = start + rise * part.to;
  if (std::max(first, last) + slack < heights.low || std::min(first, last) - slack > heights.high) return std::nullopt;
  return part;
}

void Sweep::cells(const Course& line) noexcept {
  const int n = surface_.intervals();
  const int mirrored = (line.dx < 0 ? 1 : 0) + (line.dy < 0 ? 2 : 0);
  squares(mirrored, [&](int level, GridPoint at, int side, const SampleBounds::Between& heights, double overhang) {
    const auto part = over(line, at, side, heights, overhang);
    if (!part) return false;
    const double t = line.begin + line.takes * part->from;
    if (t > best_) return false;
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

void Sweep::all_cells(double from, double to) noexcept {
  squares(0, [&](int level, GridPoint low, int side, const SampleBounds::Between& heights, double pad) {
    const double n = surface_.intervals();
    const auto [least, most] = range_over(heights, side + 2 * pad);
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

template <typename Look>
void Sweep::squares(int mirrored, Look&& look) noexcept {
  const int stretch = surface_.stretch();
  const SampleBounds& bounds = surface_.model().tile(Layer::Displacement, slab_).bounds();
  struct Square {
    int level, i, j;
  };
  std::array<Square, 32> stack;
  std::size_t depth = 0;
  stack[depth++] = {bounds.levels() - 1, 0, 0};
  while (depth > 0) {
    const auto [level, i, j] = stack[--depth];
    const int side = SampleBounds::side(level);
    const GridPoint low = {i * side, j * side};
    // Stitching draws corners along the slab's edges, to samples outside the square.
    const bool stitched = surface_.stitches_in(low, side);
    const SampleBounds::Between heights = stitched ? bounds.around(level, i, j, stretch) : bounds.between(level, i, j);
    if (!look(level, low, side, heights, stitched ? double(stretch) : 0.0) || level == 0) continue;
    const int along = bounds.squares(level - 1);
    for (int k = 3; k >= 0; --k) {
      const int child = k ^ mirrored;
      if (const Square part = {level - 1, 2 * i + (child & 1), 2 * j + (child >> 1)}; part.i + part.j < along)
        stack[depth++] = part;
    }
  }
}

void Sweep::both(int i, int j, double low, double high) noexcept {
  test({{{i, j}, {i + 1, j}, {i, j + 1}}}, low, high);
  if (i + j + 1 < surface_.intervals()) test({{{i + 1, j}, {i + 1, j + 1}, {i, j + 1}}}, low, high);
}

void Sweep::test(const std::array<GridPoint, 3>& corners, double low, double high) noexcept {
  MicroTriangle triangle = {slab_, corners, {}};
  if (!surface_.stitch(triangle.corners)) return;
  const double d0 = surface_.displacement(triangle.corners[0]), d1 = surface_.displacement(triangle.corners[1]),
               d2 = surface_.displacement(triangle.corners[2]);
  const double least = std::min({d0, d1, d2}), most = std::max({d0, d1, d2}), pad = bend_.cell_alpha * (most - least);
  if (most + pad < low || least - pad > high) return;
  surface_.measure(triangle);
  const Vec3d a = triangle.positions[0] - from_, b = triangle.positions[1] - from_, c = triangle.positions[2] - from_;
  const auto weights = crossed(a, b, c);
  if (!weights) return;
  const Weights& w = *weights;
  const double length2 = dot(way_, way_);
  const double t = dot(a * w[0] + b * w[1] + c * w[2], way_) / length2;
  const Vec3d side = surface_.corners().inner[1] - surface_.corners().inner[0];
  const double behind = kBehind * std::sqrt(dot(side, side) / length2);
  if (!(t >= -behind && t <= 1 && t <= best_)) return;
  if (t == best_ && !triangle.comes_before(found_.triangle)) return;
  best_ = t;
  found_ = {triangle, w, triangle.point(w)};
}

std::optional<Weights> Sweep::crossed(Vec3d a, Vec3d b, Vec3d c) const noexcept {
  // The corners on a plane across the way, seen along it: twice the areas that the way's place there makes with the
  // edges. Neighbours see the same edge with the opposite sign, so no gap opens.
  struct Seen {
    double x, y;
  };
  const auto seen = [&](Vec3d p) noexcept {
    return Seen{p[first_] - slope_first_ * p[along_], p[second_] - slope_second_ * p[along_]};
  };
  const Seen p = seen(a), q = seen(b), r = seen(c);
  const double wa = difference(q.x, r.y, r.x, q.y), wb = difference(r.x, p.y, p.x, r.y),
               wc = difference(p.x, q.y, q.x, p.y);
  const bool forwards = way_[along_] > 0, left = wa >= 0 && wb >= 0 && wc >= 0, right = wa <= 0 && wb <= 0 && wc <= 0;
  // Seen along the way, a triangle that it goes in through is clockwise.
  const bool in = forwards ? right : left, out = forwards ? left : right;
  if (!(kind_ == Crossing::In ? in : kind_ == Crossing::Out ? out : in || out)) return std::nullopt;
  const double sum = wa + wb + wc;
  if (sum == 0) return std::nullopt;
  return Weights{wa / sum, wb / sum, wc / sum};
}

std::optional<RayHit> raycast(const Snapshot& model, const Ray3d& ray) noexcept {
  PickHint nothing;
  return raycast(model, ray, nothing);
}

std::optional<RayHit> raycast(const Snapshot& model, const Ray3d& ray, PickHint& hint) noexcept {
  // From where the ray is nearest to the model's middle, or its origin, to where it is out of the model's box.
  const Box3d& all = model.slab_mesh().bounds();
  const double speed2 = dot(ray.direction, ray.direction);
  if (!(speed2 > 0) || !std::isfinite(speed2) || !is_finite(ray.origin)) return std::nullopt;
  const double size = diagonal(all), speed = std::sqrt(speed2);
  const double middle = dot(all.centre() - ray.origin, ray.direction) / speed2;
  const double begin = std::max(0.0, middle - size / speed), end = middle + size / speed;
  if (!(end > begin)) return std::nullopt;
  MicroTriangles surface(model);
  Sweep sweep(surface, ray.origin + ray.direction * begin, ray.origin + ray.direction * end, Crossing::Any);
  const auto place = sweep.run(hint.slab);
  if (!place) return std::nullopt;
  const SurfacePoint point = point_of(surface, *place, hint.normals);
  hint.slab = point.slab;
  hint.u = point.u;
  hint.v = point.v;
  return RayHit{point, begin + (end - begin) * sweep.share()};
}

std::optional<RayHit> first_entry(const Snapshot& model, Vec3d from, Vec3d to) noexcept {
  MicroTriangles surface(model);
  Sweep sweep(surface, from, to, Crossing::In);
  const auto place = sweep.run();
  if (!place) return std::nullopt;
  detail::CellNormals none;
  return RayHit{point_of(surface, *place, none), sweep.share()};
}

}  // namespace relief
