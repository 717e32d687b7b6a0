// C5, C6 and C7: that every fibre meets the source exactly once.
#include <relief/base/free_memory.h>
#include <relief/verify/shell_facts.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <tuple>

namespace relief::verify::detail {

namespace {

constexpr std::int32_t kMargin = 2;  // steps between the source and the triangles of the shell (C5)

std::int64_t sum_norm(const Point& a) { return std::abs(a[0]) + std::abs(a[1]) + std::abs(a[2]); }
double to_double(std::int64_t v) { return static_cast<double>(v); }
double magnitude(const Point& a) { return std::hypot(to_double(a[0]), to_double(a[1]), to_double(a[2])); }

// ---- Distances below `margin` steps, exactly. Squares of cross products stay below 2^124.

bool closer(const Point& p, const Point& a, const Point& b, std::int64_t margin) {  // a point and a segment
  const Point e = b - a, w = p - a;
  const Int128 along = dot(w, e), length = dot(e, e), limit = Int128{margin} * margin;
  if (along <= 0) return dot(w, w) < limit;
  if (along >= length) return dot(p - b, p - b) < limit;
  const Point off = cross(w, e);
  return dot(off, off) < limit * length;
}

bool closer(const Point& p, const Triangle& t, const Point& n, std::int64_t margin) {  // where p lies over the triangle
  if (dot(n, cross(t.b - t.a, p - t.a)) < 0 || dot(n, cross(t.c - t.b, p - t.b)) < 0 ||
      dot(n, cross(t.a - t.c, p - t.c)) < 0)
    return false;
  return square_below_product(dot(n, p - t.a), Int128{margin} * margin, dot(n, n));
}

/// Two segments whose nearest points lie inside both.
bool closer(const Point& p, const Point& q, const Point& a, const Point& b, std::int64_t margin) {
  const Point u = q - p, v = b - a, r = a - p, n = cross(u, v);
  const Int128 area = dot(n, n);
  if (area == 0) return false;  // parallel: an end is as near
  const Int128 s = dot(cross(r, v), n), t = dot(cross(r, u), n);
  if (s < 0 || s > area || t < 0 || t > area) return false;
  return square_below_product(dot(r, n), Int128{margin} * margin, area);
}

/// Returns whether two disjoint triangles of positive area come nearer than `margin` steps.
bool closer(const Triangle& s, const Triangle& t, std::int64_t margin) {
  const std::array<Point, 3> sp = {s.a, s.b, s.c}, tp = {t.a, t.b, t.c};
  const Point sn = cross(s.b - s.a, s.c - s.a), tn = cross(t.b - t.a, t.c - t.a);
  for (std::size_t k = 0; k < 3; ++k) {
    if (closer(sp[k], t, tn, margin) || closer(tp[k], s, sn, margin)) return true;
    for (std::size_t l = 0; l < 3; ++l) {
      const Point &s0 = sp[l], &s1 = sp[(l + 1) % 3], &t0 = tp[l], &t1 = tp[(l + 1) % 3];
      if (closer(sp[k], t0, t1, margin) || closer(tp[k], s0, s1, margin)) return true;
      if (closer(sp[k], sp[(k + 1) % 3], t0, t1, margin)) return true;
    }
  }
  return false;
}

/// Points of which above() holds lie more than a margin above a plane; in doubles, rounded to the safe side.
struct HalfSpace {
  std::array<double, 3> normal{}, at{};
  double beyond = 0;

  HalfSpace() = default;
  /// `size` bounds the coordinates of differences.
  HalfSpace(const std::array<double, 3>& n, const Point& p, double margin, double size) : normal(n) {
    for (std::size_t k = 0; k < 3; ++k) at[k] = to_double(p[k]);
    const double sum = std::abs(n[0]) + std::abs(n[1]) + std::abs(n[2]);
    beyond = margin * std::hypot(n[0], n[1], n[2]) * (1 + 0x1p-40) + 0x1p-48 * sum * size;
  }
  HalfSpace(const Point& n, const Point& p, double margin, double size)
      : HalfSpace(std::array<double, 3>{to_double(n[0]), to_double(n[1]), to_double(n[2])}, p, margin, size) {}
  [[nodiscard]] bool above(const std::array<double, 3>& p) const {
    return normal[0] * (p[0] - at[0]) + normal[1] * (p[1] - at[1]) + normal[2] * (p[2] - at[2]) > beyond;
  }
};

/// A triangle of the source, and what is asked of it again and again.
struct Face {
  Triangle triangle;
  std::array<Point, 3> points;
  std::array<std::array<double, 3>, 3> places;
  Point e, g, normal;
  double reach;  // the longest coordinate of e and g

  Face(const Point& a, const Point& b, const Point& c)
      : triangle{a, b, c}, points{a, b, c}, e(b - a), g(c - a), normal(cross(e, g)) {
    for (std::size_t k = 0; k < 3; ++k)
      places[k] = {to_double(points[k][0]), to_double(points[k][1]), to_double(points[k][2])};
    reach = 0;
    for (std::size_t k = 0; k < 3; ++k) reach = std::max({reach, std::abs(to_double(e[k])), std::abs(to_double(g[k]))});
  }
  [[nodiscard]] bool above(const HalfSpace& h) const {
    return h.above(places[0]) && h.above(places[1]) && h.above(places[2]);
  }
};

/// Vectors beyond 2^63.
struct Wide {
  std::array<Int128, 3> v;
};
Int128 height(const Wide& a, const Point& b) { return a.v[0] * b[0] + a.v[1] * b[1] + a.v[2] * b[2]; }
Wide wide_cross(const Point& a, const Point& b) {
  return {{Int128{a[1]} * b[2] - Int128{a[2]} * b[1], Int128{a[2]} * b[0] - Int128{a[0]} * b[2],
           Int128{a[0]} * b[1] - Int128{a[1]} * b[0]}};
}
Int128 sum_norm(const Wide& a) {
  Int128 sum = 0;
  for (const Int128 x : a.v) sum += x < 0 ? -x : x;
  return sum;
}

/// The volume between three fibres, which contains every point of a part of a slab.
struct Block {
  std::array<Point, 3> inner, outer;
};

/// Returns whether a plane lies between the block's hull and the face with so much room for each coordinate, in the
/// block's steps, `scale` of which make one of the face's. With coordinates up to 2^30, scaled up to 2^41, all sums
/// stay below 2^126.
bool hull_misses(const Block& block, const Face& face, std::int64_t scale, std::int64_t room) {
  std::array<Point, 6> hull{};
  std::array<Point, 3> corners{};
  for (std::size_t k = 0; k < 3; ++k) {
    hull[k] = block.inner[k];
    hull[k + 3] = block.outer[k];
    for (std::size_t c = 0; c < 3; ++c) corners[k][c] = face.points[k][c] * scale;
  }
  const auto separates = [&](const Wide& axis) {
    const auto range = [&](const auto& points) {
      Int128 low = height(axis, points[0] - corners[0]), high = low;
      for (const Point& p : points) {
        const Int128 at = height(axis, p - corners[0]);
        low = std::min(low, at);
        high = std::max(high, at);
      }
      return std::pair(low, high);
    };
    const auto [low, high] = range(hull);
    const auto [face_low, face_high] = range(corners);
    const Int128 slack = sum_norm(axis) * room;
    return low > face_high + slack || high < face_low - slack;
  };
  const Point& n = face.normal;
  if (separates({{n[0], n[1], n[2]}})) return true;
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = i + 1; j < 6; ++j)
      for (std::size_t k = j + 1; k < 6; ++k)
        if (separates(wide_cross(hull[j] - hull[i], hull[k] - hull[i]))) return true;
  for (const Point& edge : {face.e, face.g, face.g - face.e})
    for (std::size_t i = 0; i < 6; ++i)
      for (std::size_t j = i + 1; j < 6; ++j)
        if (separates(wide_cross(edge, hull[j] - hull[i]))) return true;
  return false;
}

std::string face_name(std::size_t t) { return "source triangle " + std::to_string(t); }
std::string vertex_name(std::size_t v) { return "source vertex " + std::to_string(v); }
std::string slab_name(std::size_t s) { return "slab " + std::to_string(s); }

class SourceChecker {
 public:
  SourceChecker(const Shell& shell, ShellFacts& facts, const Source& source, const CommonLattice& lattice,
                Certificate& certificate, const Progress& progress)
      : shell_(shell),
        facts_(facts),
        source_(source),
        certificate_(certificate),
        progress_(progress),
        span_(lattice.span),
        blur_(lattice.moved ? 1 : 0),
        bits_(std::min(14, 41 - static_cast<int>(std::bit_width(static_cast<std::uint64_t>(lattice.span))))),
        predicates_(lattice.span) {
    place(lattice);
    for (const auto& f : shell_.triangles) {
      Box box = box_of(inner_[f[0]], inner_[f[1]], inner_[f[2]]);
      box.add(box_of(outer_[f[0]], outer_[f[1]], outer_[f[2]]));
      box.widen(kMargin);
      boxes_.push_back(box);
    }
    tree_ = std::make_unique<Tree>(boxes_);
  }

  void run() {
    if (!check_surface() || !check_sections()) return;
    certificate_.holds[5] = separate_ && count(Condition::C5) == 0;
    certificate_.holds[6] = count(Condition::C6) == 0;
    certificate_.holds[7] = hits_hold();
  }

 private:
  /// One triangle of the shell.
  struct Side {
    Triangle triangle;
    Box box;                          // widened by the margin
    std::array<HalfSpace, 5> beyond;  // what lies above one of them is far enough away
    bool flat = false;

    explicit Side(const std::array<Place, 3>& p)
        : triangle{widen(p[0]), widen(p[1]), widen(p[2])}, box(box_of(p[0], p[1], p[2])) {
      box.widen(kMargin);
    }
  };
  /// Holds what is asked of a slab again and again; 1.5 KB.
  struct Slab {
    std::uint32_t number;
    std::array<Side, 2> sides;  // inner, outer
    std::array<Point, 3> inner, along;
    std::array<std::array<double, 3>, 3> along_places;
    std::array<double, 3> along_sum{};
    std::array<HalfSpace, 8> hull;  // planes with the whole slab below
    std::size_t hull_count = 0;
  };
  /// Holds what a source triangle fails. Ordered as they are told: by triangle, then by the order in which queries of
  /// the tree visit slabs.
  struct Finding {
    enum class Kind : std::uint8_t { NoArea, NearInner, MeetsInner, NearOuter, MeetsOuter, Folded };
    std::uint32_t triangle, place, slab;
    Kind kind;

    [[nodiscard]] Condition condition() const {
      return kind == Kind::NoArea || kind == Kind::Folded ? Condition::C6 : Condition::C5;
    }
    friend bool operator<(const Finding& a, const Finding& b) {
      return std::tie(a.triangle, a.place, a.kind) < std::tie(b.triangle, b.place, b.kind);
    }
  };

  /// Holds what was found of one condition.
  struct OfOne {
    std::vector<Finding> first;  // in order, so many as are listed
    std::size_t count = 0;
    std::size_t unnamed = 0;  // slabs of the branch in which it is not known to fail

    /// Returns whether what a triangle fails would still be listed or counted.
    [[nodiscard]] bool counts(std::size_t triangle) const {
      return count < kCounted || triangle <= first.back().triangle;
    }
    [[nodiscard]] bool wants(std::size_t triangle) const { return unnamed > 0 || counts(triangle); }
    void add(const Finding& finding) {
      ++count;
      if (first.size() == kListed && !(finding < first.back())) return;
      first.insert(std::upper_bound(first.begin(), first.end(), finding), finding);
      if (first.size() > kListed) first.pop_back();
    }
  };
  using Findings = std::array<OfOne, 2>;  // of C5 and C6

  [[nodiscard]] std::size_t count(Condition condition) const {
    return certificate_.failure_count[static_cast<std::size_t>(condition)];
  }
  [[nodiscard]] bool& at_least(Condition condition) {
    return certificate_.at_least[static_cast<std::size_t>(condition)];
  }
  template <typename Sentence>
  void report(Condition condition, std::size_t a, std::size_t b, Sentence&& sentence) {
    if (certificate_.failure_count[static_cast<std::size_t>(condition)]++ < kListed)
      certificate_.failures.push_back(
          {condition, static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b), sentence()});
  }

  [[nodiscard]] Point point(std::uint32_t vertex) const { return widen(points_[vertex]); }
  [[nodiscard]] Face face(std::size_t t) const {
    const auto& f = source_.triangles[t];
    return {point(f[0]), point(f[1]), point(f[2])};
  }
  [[nodiscard]] Box box_of_face(std::size_t t) const {
    const auto& f = source_.triangles[t];
    return box_of(points_[f[0]], points_[f[1]], points_[f[2]]);
  }

  void place(const CommonLattice& lattice) {
    points_.resize(source_.positions.size());
    std::vector<bool> used(points_.size());
    for (const auto& f : source_.triangles)
      for (const std::uint32_t v : f) used[v] = true;
    double furthest = 0;  // squared
    for (std::size_t v = 0; v < points_.size(); ++v) {
      if (!used[v]) continue;
      const Point p = lattice.at(source_.positions[v]);
      double moved = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        points_[v][k] = static_cast<std::int32_t>(p[k]);
        const double exact = std::ldexp(source_.positions[v][k] - lattice.origin[k], -lattice.step);
        moved += (exact - to_double(p[k])) * (exact - to_double(p[k]));
      }
      furthest = std::max(furthest, moved);
    }
    certificate_.source_moved = std::ldexp(std::sqrt(furthest), lattice.step);
    certificate_.lattice_step = std::ldexp(1.0, lattice.step);
    for (const auto& p : shell_.inner) inner_.push_back(narrow(lattice.at(p)));
    for (const auto& p : shell_.outer) outer_.push_back(narrow(lattice.at(p)));
  }

  [[nodiscard]] Side make_side(const std::vector<Place>& ends, const std::array<std::uint32_t, 3>& f) const {
    Side side({ends[f[0]], ends[f[1]], ends[f[2]]});
    const auto& [a, b, c] = side.triangle;
    const Point n = cross(b - a, c - a);
    side.flat = n == Point{};
    const double margin = kMargin;
    side.beyond[0] = HalfSpace(n, a, margin, span_);
    side.beyond[1] = HalfSpace(Point{-n[0], -n[1], -n[2]}, a, margin, span_);
    // Outwards in the plane, with the normal's length taken off so that nothing overflows.
    const double length = std::max(1.0, magnitude(n));
    const std::array<double, 3> unit = {to_double(n[0]) / length, to_double(n[1]) / length, to_double(n[2]) / length};
    const std::array<const Point*, 4> corners = {&a, &b, &c, &a};
    for (std::size_t k = 0; k < 3; ++k) {
      const Point edge = *corners[k + 1] - *corners[k];
      const std::array<double, 3> d = {to_double(edge[0]), to_double(edge[1]), to_double(edge[2])};
      // The rounding of the normal tilts the plane by 2^-49 at most, which half a step outweighs on 2^30 steps.
      const std::array<double, 3> out = {d[1] * unit[2] - d[2] * unit[1], d[2] * unit[0] - d[0] * unit[2],
                                         d[0] * unit[1] - d[1] * unit[0]};
      side.beyond[k + 2] = HalfSpace(out, *corners[k], margin + 0.5, span_);
    }
    return side;
  }

  [[nodiscard]] Slab make_slab(std::uint32_t number) const {
    const auto& f = shell_.triangles[number];
    Slab slab{.number = number,
              .sides = {make_side(inner_, f), make_side(outer_, f)},
              .inner = {},
              .along = {},
              .along_places = {},
              .along_sum = {},
              .hull = {},
              .hull_count = 0};
    std::array<Point, 6> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = slab.inner[k] = widen(inner_[f[k]]);
      corners[k + 3] = widen(outer_[f[k]]);
      slab.along[k] = along(f[k]);
      slab.along_places[k] = {to_double(slab.along[k][0]), to_double(slab.along[k][1]), to_double(slab.along[k][2])};
      slab.along_sum[k] = to_double(sum_norm(slab.along[k]));
    }
    find_hull(slab, corners);
    return slab;
  }
  [[nodiscard]] Point along(std::uint32_t fibre) const { return widen(outer_[fibre]) - widen(inner_[fibre]); }

  /// The planes through three of the corners that have all six on or below them.
  void find_hull(Slab& slab, const std::array<Point, 6>& corners) const {
    for (std::size_t i = 0; i < 6; ++i)
      for (std::size_t j = i + 1; j < 6; ++j)
        for (std::size_t k = j + 1; k < 6; ++k) {
          bool above = false, below = false;
          for (std::size_t l = 0; l < 6; ++l) {
            const int side = predicates_.side({corners[i], corners[j], corners[k]}, corners[l]);
            above = above || side > 0;
            below = below || side < 0;
          }
          if (above == below || slab.hull_count == slab.hull.size()) continue;
          const Point n = cross(corners[j] - corners[i], corners[k] - corners[i]);
          const Point out = above ? Point{-n[0], -n[1], -n[2]} : n;
          slab.hull[slab.hull_count++] = HalfSpace(out, corners[i], blur_ == 0 ? 0.0 : 2.0, span_);
        }
  }

  // ---- C5 and C6a, triangle by triangle.

  /// False when cancelled. What is asked of slabs again and again is held for one branch of their tree at a time, so
  /// that it takes no more than a part of what the source takes.
  bool check_sections() {
    const auto branches = tree_->branches(std::max(kFewSlabs, source_.triangles.size() / 64));
    Findings findings;
    bool go_on = true;
    for (std::size_t k = 0; k < branches.size() && go_on; ++k)
      go_on = check_branch(branches[k], k, branches.size(), findings);
    free_memory(slabs_);
    std::vector<Finding> all = findings[0].first;
    all.insert(all.end(), findings[1].first.begin(), findings[1].first.end());
    std::sort(all.begin(), all.end());
    for (const Finding& finding : all) tell(finding);
    for (const Condition condition : {Condition::C5, Condition::C6}) {
      const OfOne& of_one = findings[condition == Condition::C6];
      certificate_.failure_count[static_cast<std::size_t>(condition)] += of_one.count - of_one.first.size();
      at_least(condition) = at_least(condition) || of_one.count >= kCounted;
    }
    return go_on;
  }

  /// Returns the k-th of so many branches. False when cancelled.
  bool check_branch(const Tree::Branch& branch, std::size_t k, std::size_t branches, Findings& findings) {
    slabs_.clear();
    slabs_.reserve(branch.items.size());
    for (const std::uint32_t s : branch.items) slabs_.push_back(make_slab(s));
    const std::size_t count = source_.triangles.size();
    const double steps = to_double(static_cast<std::int64_t>(count * branches));
    for (OfOne& of_one : findings) of_one.unnamed = branch.items.size();
    const auto of = [&](Condition condition) -> OfOne& { return findings[condition == Condition::C6]; };
    const auto wanted = [&](Condition condition, std::size_t t, std::uint32_t slab) {
      return !certificate_.fails(condition, slab) || of(condition).counts(t);
    };
    const auto find = [&](std::size_t t, std::size_t place, std::uint32_t slab, Finding::Kind kind) {
      const Finding finding = {static_cast<std::uint32_t>(t), static_cast<std::uint32_t>(place), slab, kind};
      const Condition condition = finding.condition();
      of(condition).add(finding);
      if (slab == kNothing || certificate_.fails(condition, slab)) return;
      fail_in(certificate_.failed, condition, slab);
      --of(condition).unnamed;
    };
    for (std::size_t t = 0; t < count; ++t) {
      if (!findings[0].wants(t) && !findings[1].wants(t)) break;
      if (!goes_on(t, 0.4 + 0.6 * to_double(static_cast<std::int64_t>(count * k)) / steps, 0.6 / steps)) return false;
      const Box box = box_of_face(t);
      if (k > 0 && !tree_->box(branch).meets(box)) continue;
      const Face f = face(t);
      if (f.normal == Point{}) {
        separate_ = false;
        if (k == 0) find(t, 0, kNothing, Finding::Kind::NoArea);
        continue;
      }
      tree_->query(branch, box, [&](std::size_t at) {
        const Slab& slab = slabs_[at];
        if (!boxes_[slab.number].meets(box)) return;
        if (wanted(Condition::C5, t, slab.number))
          for (std::size_t side = 0; side < 2; ++side)
            if (const auto kind = fault_of(slab.sides[side], side, f, box))
              find(t, branch.first + at, slab.number, *kind);
        if (wanted(Condition::C6, t, slab.number) && !section_holds(slab, f))
          find(t, branch.first + at, slab.number, Finding::Kind::Folded);
      });
    }
    return true;
  }

  void tell(const Finding& finding) {
    report(finding.condition(), finding.slab, finding.triangle, [&] {
      using enum Finding::Kind;
      const std::string name = face_name(finding.triangle), of_slab = slab_name(finding.slab);
      switch (finding.kind) {
        case NoArea:
          return name + " has no area";
        case NearInner:
          return name + " comes within two lattice steps of the inner triangle of " + of_slab;
        case MeetsInner:
          return name + " meets the inner triangle of " + of_slab;
        case NearOuter:
          return name + " comes within two lattice steps of the outer triangle of " + of_slab;
        case MeetsOuter:
          return name + " meets the outer triangle of " + of_slab;
        case Folded:
          break;
      }
      return name + " does not face outwards along every fibre of " + of_slab + " that meets it";
    });
  }

  /// Reports now and then that step k has come; false when cancelled.
  [[nodiscard]] bool goes_on(std::size_t k, double from, double per_step) const {
    if ((k & 0xfffU) == 0 && progress_.cancelled()) return false;
    if ((k & 0x3ffffU) == 0) progress_("verify", from + per_step * to_double(static_cast<std::int64_t>(k)));
    return true;
  }

  /// C5 of one triangle of a slab.
  [[nodiscard]] std::optional<Finding::Kind> fault_of(const Side& side, std::size_t number, const Face& f,
                                                      const Box& box) {
    if (side.flat) {
      separate_ = false;  // the slab failed C1
      return std::nullopt;
    }
    if (!side.box.meets(box)) return std::nullopt;
    for (const HalfSpace& h : side.beyond)
      if (f.above(h)) return std::nullopt;
    using enum Finding::Kind;
    if (predicates_.meet(side.triangle, f.triangle)) return number == 0 ? MeetsInner : MeetsOuter;
    if (closer(side.triangle, f.triangle, kMargin)) return number == 0 ? NearInner : NearOuter;
    return std::nullopt;
  }

  /// Returns whether every fibre of the slab that meets the face leaves through its front: normal . direction > 0,
  /// which is linear in the barycentric weights of the fibre, so where it fails is cut off by a straight line.
  [[nodiscard]] bool section_holds(const Slab& slab, const Face& f) const {
    std::array<double, 3> value{};
    bool sure = true;
    const double n_sum = to_double(sum_norm(f.normal));
    for (std::size_t k = 0; k < 3 && sure; ++k) {
      const auto& d = slab.along_places[k];
      value[k] = to_double(f.normal[0]) * d[0] + to_double(f.normal[1]) * d[1] + to_double(f.normal[2]) * d[2];
      const double blur = blur_ == 0 ? 0.0 : slab.along_sum[k] * (8 * f.reach + 8);
      sure = value[k] > 0x1p-49 * n_sum * slab.along_sum[k] + blur;
    }
    if (sure) return true;
    for (std::size_t k = 0; k < slab.hull_count; ++k)
      if (f.above(slab.hull[k])) return true;
    std::array<Int128, 3> facing{};
    std::size_t bad = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      facing[k] = facing_of(slab.along[k], f);
      if (facing[k] <= 0) ++bad;
    }
    return bad == 0 || misses_bad_part(slab, f, facing, bad);
  }

  /// Returns the least of normal . d over all triangles whose corners are within the blur of the face's.
  [[nodiscard]] Int128 facing_of(const Point& d, const Face& f) const {
    const Int128 value = dot(f.normal, d);
    if (blur_ == 0) return value;
    const Int128 turn = Int128{sum_norm(cross(d, f.e))} + sum_norm(cross(d, f.g));
    return value - 2 * turn - 8 * Int128{sum_norm(d)};
  }

  /// Returns whether the face misses the fibres from which it is seen from behind; these end at a whole 2^-kCutBits of
  /// the edges, towards the larger side.
  [[nodiscard]] bool misses_bad_part(const Slab& slab, const Face& f, const std::array<Int128, 3>& facing,
                                     std::size_t bad) const {
    const int scale_bits = bits_ - kHalvings;
    constexpr std::int64_t kWhole = std::int64_t{1} << kCutBits;
    // The fibre at w / kWhole of the way from corner i to corner j: its inner end and direction in 2^-scale_bits of a
    // step, rounded down.
    struct Fibre {
      Point inner, along;
    };
    const auto between = [&](std::size_t i, std::size_t j, std::int64_t w) {
      const auto at = [&](std::int64_t from, std::int64_t to) {
        return static_cast<std::int64_t>((Int128{from} * kWhole + Int128{to - from} * w) >> (kCutBits - scale_bits));
      };
      Fibre fibre{};
      for (std::size_t c = 0; c < 3; ++c) {
        fibre.inner[c] = at(slab.inner[i][c], slab.inner[j][c]);
        fibre.along[c] = at(slab.along[i][c], slab.along[j][c]);
      }
      return fibre;
    };
    const auto corner = [&](std::size_t i) { return between(i, i, 0); };
    const auto misses = [&](const std::array<Fibre, 3>& fibres) {
      return column_misses(fibres, f, std::int64_t{1} << static_cast<unsigned>(scale_bits));
    };
    if (bad == 3) return misses({corner(0), corner(1), corner(2)});
    std::size_t i = 0;
    while ((facing[i] <= 0) != (bad == 1)) ++i;  // the only one of its kind
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    const auto cut = [&](std::size_t other) {
      const Int128 part = facing[i] * kWhole, all = facing[i] - facing[other];
      const Int128 floor = part / all;  // both of one sign
      if (bad == 2) return std::min(static_cast<std::int64_t>(floor), kWhole - 1);
      return std::max(static_cast<std::int64_t>(floor * all == part ? floor : floor + 1), std::int64_t{1});
    };
    const Fibre to_j = between(i, j, cut(j)), to_k = between(i, k, cut(k));
    if (bad == 1) return misses({corner(i), to_j, to_k});
    return misses({to_j, corner(j), corner(k)}) && misses({to_j, corner(k), to_k});
  }

  /// Returns whether the face misses the volume between three fibres, whose places and directions are scaled and may be
  /// less than one off; halved along the fibres while its hull does not show it.
  template <typename Fibres>
  [[nodiscard]] bool column_misses(const Fibres& fibres, const Face& f, std::int64_t scale) const {
    const std::int64_t parts = std::int64_t{1} << static_cast<unsigned>(kHalvings);
    const auto part_misses = [&](auto&& again, std::int64_t from, std::int64_t to, int halvings) -> bool {
      Block block{};
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t c = 0; c < 3; ++c) {
          block.inner[k][c] = fibres[k].inner[c] * parts + fibres[k].along[c] * from;
          block.outer[k][c] = fibres[k].inner[c] * parts + fibres[k].along[c] * to;
        }
      if (hull_misses(block, f, scale * parts, (scale * blur_ + 2) * parts)) return true;
      if (halvings == 0) return false;
      const std::int64_t middle = (from + to) / 2;
      return again(again, from, middle, halvings - 1) && again(again, middle, to, halvings - 1);
    };
    return part_misses(part_misses, 0, parts, kHalvings);
  }

  // ---- The source as a surface: closed and manifold, winding once around each vertex (C6b).

  /// False when cancelled.
  bool check_surface() {
    const std::size_t vertex_count = points_.size();
    std::vector<std::uint32_t> begin(vertex_count + 1, 0), corners(3 * source_.triangles.size());
    for (const auto& f : source_.triangles)
      for (const std::uint32_t v : f) ++begin[v + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::uint32_t> filled(begin.begin(), begin.end() - 1);
    for (std::size_t t = 0; t < source_.triangles.size(); ++t)
      for (std::size_t k = 0; k < 3; ++k)
        corners[filled[source_.triangles[t][k]]++] = static_cast<std::uint32_t>(3 * t + k);
    std::vector<Spoke> spokes;
    for (std::uint32_t v = 0; v < vertex_count; ++v) {
      if (!goes_on(v, 0, 0.4 / to_double(static_cast<std::int64_t>(vertex_count)))) return false;
      spokes.clear();
      for (std::uint32_t c = begin[v]; c < begin[v + 1]; ++c) {
        const auto& f = source_.triangles[corners[c] / 3];
        spokes.push_back({f[(corners[c] + 1) % 3], f[(corners[c] + 2) % 3], corners[c] / 3});
      }
      if (spokes.empty()) continue;
      if (!is_one_fan(v, spokes)) continue;
      at_least(Condition::C6) = count(Condition::C6) >= kCounted;
      if (at_least(Condition::C6)) continue;
      const std::uint32_t t = spokes.front().triangle;
      const int turns = turns_around(v, spokes);
      if (turns == 0)
        report(Condition::C6, kNothing, t,
               [&] { return "no common front-facing direction for the triangles at " + vertex_name(v); });
      else if (turns != 1)
        report(Condition::C6, kNothing, t, [&] {
          return "the triangles at " + vertex_name(v) + " wind " + std::to_string(turns) + " times instead of once";
        });
    }
    return true;
  }

  /// A triangle at a vertex: the two others, counter-clockwise.
  struct Spoke {
    std::uint32_t from, to, triangle;
  };

  /// Puts the spokes in order around the vertex. False where they are not one closed fan, which is then reported.
  bool is_one_fan(std::uint32_t v, std::vector<Spoke>& spokes) {
    std::sort(spokes.begin(), spokes.end(), [](const Spoke& a, const Spoke& b) {
      return std::pair(a.from, a.triangle) < std::pair(b.from, b.triangle);
    });
    const auto find = [&](std::uint32_t from) {
      return std::lower_bound(spokes.begin(), spokes.end(), from,
                              [](const Spoke& s, std::uint32_t other) { return s.from < other; });
    };
    bool closed = true;
    for (std::size_t k = 0; k < spokes.size(); ++k) {
      const Spoke& s = spokes[k];
      const auto edge = [&](std::uint32_t other) {
        return "the source's edge from vertex " + std::to_string(v) + " to " + std::to_string(other);
      };
      if (s.from == v || s.to == v || s.from == s.to) {
        report(Condition::C6, kNothing, s.triangle, [&] { return face_name(s.triangle) + " names a vertex twice"; });
        return false;
      }
      if (k > 0 && spokes[k - 1].from == s.from) {
        report(Condition::C6, kNothing, s.triangle,
               [&] { return edge(s.from) + " has several triangles on the same side"; });
        return false;
      }
      const auto next = find(s.to);
      if (next == spokes.end() || next->from != s.to) {
        report(Condition::C7, kNothing, s.triangle, [&] { return edge(s.to) + " is open"; });
        closed = false;
      }
    }
    if (!closed) return false;
    ordered_.clear();
    for (std::uint32_t from = spokes.front().from; ordered_.size() < spokes.size();) {
      ordered_.push_back(*find(from));
      from = ordered_.back().to;
      if (from == spokes.front().from) break;
    }
    if (ordered_.size() != spokes.size() || ordered_.back().to != ordered_.front().from) {
      report(Condition::C6, kNothing, spokes.front().triangle,
             [&] { return "the triangles at " + vertex_name(v) + " are not one fan"; });
      return false;
    }
    spokes.swap(ordered_);
    return true;
  }

  /// Returns how often the triangles wind around a direction that sees the fronts of them all; 0 where none is found.
  int turns_around(std::uint32_t v, const std::vector<Spoke>& spokes) {
    const Point centre = point(v);
    rim_.clear();
    for (const Spoke& s : spokes) rim_.push_back(point(s.from) - centre);
    normals_.clear();
    units_.clear();
    for (std::size_t k = 0; k < rim_.size(); ++k) {
      const Point n = cross(rim_[k], rim_[(k + 1) % rim_.size()]);
      const double length = std::max(1.0, magnitude(n));
      normals_.push_back(n);
      units_.push_back({to_double(n[0]) / length, to_double(n[1]) / length, to_double(n[2]) / length});
    }
    const std::optional<Point> axis = seeing_direction(v);
    if (!axis) return 0;
    int turns = 0, before = 0;
    for (std::size_t k = 0; k <= rim_.size(); ++k) {
      const int now = predicates_axis_.determinant(*axis, rim_[0], rim_[k % rim_.size()]);
      if (before < 0 && now >= 0) ++turns;
      before = now;
    }
    return turns;
  }

  [[nodiscard]] bool sees_all(const Point& d) const {
    return std::all_of(normals_.begin(), normals_.end(), [&](const Point& n) { return dot(n, d) > 0; });
  }
  /// Returns the mean of the normals and, again and again, whichever of them it sees worst added to it; then the fibres
  /// nearby. Where some direction sees all fronts at a sine of g or more, that takes at most 1/g^2 steps (the
  /// perceptron).
  [[nodiscard]] std::optional<Point> seeing_direction(std::uint32_t v) const {
    constexpr int kTries = 2500;  // g = 0.02
    std::array<double, 3> d{};
    for (const auto& n : units_)
      for (std::size_t k = 0; k < 3; ++k) d[k] += n[k] / to_double(static_cast<std::int64_t>(units_.size()));
    for (int attempt = 0; attempt < kTries; ++attempt) {
      std::size_t worst = 0;
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t k = 0; k < units_.size(); ++k) {
        const double visible = units_[k][0] * d[0] + units_[k][1] * d[1] + units_[k][2] * d[2];
        if (visible < least) {
          least = visible;
          worst = k;
        }
      }
      if (least > 0) {
        const double length = std::hypot(d[0], d[1], d[2]);
        Point axis{};
        for (std::size_t k = 0; k < 3; ++k) axis[k] = std::llround(d[k] / length * kAxis);
        if (sees_all(axis)) return axis;
      }
      for (std::size_t k = 0; k < 3; ++k) d[k] += units_[worst][k];
    }
    const Place& p = points_[v];
    std::optional<Point> found;
    tree_->query(Box(p), [&](std::uint32_t s) {
      for (const std::uint32_t f : shell_.triangles[s])
        if (!found && sees_all(along(f))) found = along(f);
      return !found;
    });
    return found;
  }

  // ---- C7

  /// Returns which vertices hang together by triangles: the lowest of each component.
  std::vector<std::uint32_t> find_parts() const {
    std::vector<std::uint32_t> parent(points_.size());
    std::iota(parent.begin(), parent.end(), 0U);
    const auto root = [&](std::uint32_t v) {
      while (parent[v] != v) v = parent[v] = parent[parent[v]];
      return v;
    };
    for (const auto& f : source_.triangles)
      for (const std::uint32_t other : {f[1], f[2]}) {
        const std::uint32_t a = root(f[0]), b = root(other);
        parent[std::max(a, b)] = std::min(a, b);
      }
    for (std::uint32_t v = 0; v < parent.size(); ++v) parent[v] = parent[parent[v]];
    return parent;
  }

  bool hits_hold() {
    const std::vector<std::uint32_t> parts = find_parts();
    // The first fibre of each part of the shell stands for all of its fibres.
    std::vector<Box> reaches;
    std::vector<std::uint32_t> fibres;
    for (const std::uint32_t seed : facts_.seeds) {
      const std::uint32_t f = shell_.triangles[seed][0];
      fibres.push_back(f);
      Box box(inner_[f]);
      box.add(outer_[f]);
      reaches.push_back(box);
    }
    const Tree tree(reaches);
    std::vector<std::size_t> hits(fibres.size()), met(points_.size());
    for (std::size_t t = 0; t < source_.triangles.size(); ++t) {
      const Box box = box_of_face(t);
      tree.query(box, [&](std::uint32_t c) {
        if (reaches[c].meets(box) && crosses(widen(inner_[fibres[c]]), widen(outer_[fibres[c]]), face(t).triangle)) {
          ++hits[c];
          ++met[parts[source_.triangles[t][0]]];
        }
        return true;
      });
    }
    for (std::size_t c = 0; c < hits.size(); ++c) {
      const std::uint32_t seed = facts_.seeds[c];
      if (hits[c] != 1 || !facts_.closed[c]) fail_in(facts_.failed, Condition::C7, c);
      if (hits[c] != 1)
        report(Condition::C7, seed, kNothing, [&] {
          return "fibre " + std::to_string(fibres[c]) + " of " + slab_name(seed) + " meets the source " +
                 std::to_string(hits[c]) + " times instead of once";
        });
      if (!facts_.closed[c])
        report(Condition::C7, seed, kNothing, [&] {
          return "the part with " + slab_name(seed) + " is open, so one fibre does not speak for the others";
        });
    }
    for (std::size_t t = 0; t < source_.triangles.size(); ++t) {
      const std::uint32_t part = parts[source_.triangles[t][0]];
      constexpr std::size_t kDone = ~std::size_t{0};
      if (met[part] == kDone) continue;
      ++certificate_.source_parts;
      if (met[part] != 1)
        report(Condition::C7, kNothing, t, [&] {
          return "the part of the source with triangle " + std::to_string(t) + " is met by " +
                 std::to_string(met[part]) + " test fibres instead of one";
        });
      met[part] = kDone;
    }
    return count(Condition::C7) == 0;
  }

  /// Returns whether a fibre passes through the triangle. The fibre is thought shifted sideways by (e, e^2, e^3) for a
  /// vanishing e > 0, so it meets no edge and no vertex; by C6 this changes nothing in how often it meets the source.
  [[nodiscard]] bool crosses(const Point& p, const Point& q, const Triangle& t) const {
    const Point along = q - p;
    const auto turn = [&](const Point& a, const Point& b) {
      const int side = predicates_.determinant(along, a - p, b - p);
      if (side != 0) return side;
      for (const std::int64_t shift : cross(along, b - a))
        if (shift != 0) return shift > 0 ? -1 : 1;
      return 0;
    };
    const int sense = turn(t.a, t.b);
    if (sense == 0 || turn(t.b, t.c) != sense || turn(t.c, t.a) != sense) return false;
    return predicates_.side(t, p) == -sense && predicates_.side(t, q) == sense;
  }

  static constexpr std::size_t kFewSlabs = 2048;  // 3 MB
  static constexpr int kHalvings = 2;
  static constexpr int kCutBits = 28;
  static constexpr double kAxis = 0x1p28;  // length of the directions of C6b

  const Shell& shell_;
  ShellFacts& facts_;
  const Source& source_;
  Certificate& certificate_;
  const Progress& progress_;
  double span_;
  std::int64_t blur_;  // steps by which the source's coordinates may be off
  int bits_;           // by which points may be scaled
  Predicates predicates_, predicates_axis_{kMaxSpan};
  std::vector<Place> points_;         // by source vertex
  std::vector<Place> inner_, outer_;  // by fibre
  std::vector<Slab> slabs_;           // of one branch of the tree
  std::vector<Box> boxes_;            // by slab, widened by the margin
  std::unique_ptr<Tree> tree_;        // over boxes_
  bool separate_ = true;              // every pair of C5 could be tested
  std::vector<Spoke> ordered_;        // scratch of C6b, as all that follow
  std::vector<Point> rim_, normals_;
  std::vector<std::array<double, 3>> units_;
};

}  // namespace

void check_source(const Shell& shell, ShellFacts& facts, const Source& source, Certificate& certificate,
                  const Progress& progress) {
  const auto refuse = [&](std::string what) {
    certificate.failure_count[5] = 1;
    certificate.failures.push_back({Condition::C5, kNothing, kNothing, std::move(what)});
  };
  Extent extent;
  std::string fault = source_fault(source, extent);
  if (!fault.empty()) return refuse(std::move(fault));
  const CommonLattice lattice(facts.extent, extent);
  if (!lattice.fits)
    return refuse("the source reaches so far beyond the slabs that no lattice of 2^30 steps holds both");
  SourceChecker(shell, facts, source, lattice, certificate, progress).run();
}

}  // namespace relief::verify::detail
