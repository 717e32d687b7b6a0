#include <relief/verify/verify.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

namespace relief::verify {

namespace {

__extension__ using Int128 = __int128;
__extension__ using Uint128 = unsigned __int128;

constexpr std::uint32_t kNone = 0xffffffffU;
constexpr std::size_t kListed = 100;           // failures that are described
constexpr std::size_t kCountedPairs = 100000;  // C3 stops here: the verdict is settled
constexpr double kMaxSpan = 0x1p30;            // steps; up to it every predicate below fits its type

/// A lattice point or a difference of two: at most 2^30 in magnitude.
using Point = std::array<std::int64_t, 3>;

Point operator-(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Point operator+(const Point& a, const Point& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }

/// Of differences: at most 2^61 per component.
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
/// At most 2^94 for a sum of two cross products and a difference.
Int128 dot(const Point& a, const Point& b) { return Int128{a[0]} * b[0] + Int128{a[1]} * b[1] + Int128{a[2]} * b[2]; }
int sign(Int128 value) { return value > 0 ? 1 : value < 0 ? -1 : 0; }

/// Whether a * a < b * c, in 256 bits.
bool square_below_product(Int128 a, Int128 b, Int128 c) {
  struct Wide {
    Uint128 high, low;
  };
  const auto multiply = [](Uint128 x, Uint128 y) {
    const Uint128 half = (Uint128{1} << 64U) - 1;
    const Uint128 x0 = x & half, x1 = x >> 64U, y0 = y & half, y1 = y >> 64U;
    const Uint128 low = x0 * y0, middle = x1 * y0 + (low >> 64U), other = x0 * y1 + (middle & half);
    return Wide{x1 * y1 + (middle >> 64U) + (other >> 64U), (other << 64U) | (low & half)};
  };
  const auto magnitude = [](Int128 x) { return static_cast<Uint128>(x < 0 ? -x : x); };
  const Wide left = multiply(magnitude(a), magnitude(a)), right = multiply(magnitude(b), magnitude(c));
  return left.high != right.high ? left.high < right.high : left.low < right.low;
}

struct Triangle {
  Point a, b, c;
};

/// Signs of determinants on one lattice: doubles first, integers where the doubles cannot tell.
class Predicates {
 public:
  /// Each of the six products of three differences is off by less than 5 roundings, so the sum by less than
  /// 30 * 2^-53 * span^3.
  explicit Predicates(double span) : doubt_(0x1p-48 * span * span * span) {}

  /// Of det(a, b, c), three differences.
  [[nodiscard]] int determinant(const Point& a, const Point& b, const Point& c) const {
    const auto d = [](std::int64_t v) { return static_cast<double>(v); };
    const double value = (d(a[1]) * d(b[2]) - d(a[2]) * d(b[1])) * d(c[0]) +
                         (d(a[2]) * d(b[0]) - d(a[0]) * d(b[2])) * d(c[1]) +
                         (d(a[0]) * d(b[1]) - d(a[1]) * d(b[0])) * d(c[2]);
    if (value > doubt_) return 1;
    if (value < -doubt_) return -1;
    return sign(dot(cross(a, b), c));
  }
  /// +1 where p lies above the plane of the triangle, seen with its corners counter-clockwise.
  [[nodiscard]] int side(const Triangle& t, const Point& p) const { return determinant(t.b - t.a, t.c - t.a, p - t.a); }
  /// Whether two closed triangles of positive area have a point in common.
  [[nodiscard]] bool meet(const Triangle& s, const Triangle& t) const {
    const std::array<const Point*, 3> sp = {&s.a, &s.b, &s.c}, tp = {&t.a, &t.b, &t.c};
    std::array<int, 3> s_side{}, t_side{};
    for (std::size_t k = 0; k < 3; ++k) s_side[k] = side(t, *sp[k]);
    if (s_side[0] != 0 && s_side[0] == s_side[1] && s_side[0] == s_side[2]) return false;
    for (std::size_t k = 0; k < 3; ++k) t_side[k] = side(s, *tp[k]);
    if (t_side[0] != 0 && t_side[0] == t_side[1] && t_side[0] == t_side[2]) return false;
    if (s_side == std::array{0, 0, 0}) return meet_in_plane(s, t);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t l = (k + 1) % 3;
      if (segment_meets(*sp[k], *sp[l], s_side[k], s_side[l], t)) return true;
      if (segment_meets(*tp[k], *tp[l], t_side[k], t_side[l], s)) return true;
    }
    return false;
  }

 private:
  using Flat = std::array<std::int64_t, 2>;
  /// Twice the area of a triangle, counter-clockwise positive: at most 2^61.
  static std::int64_t area(const Flat& a, const Flat& b, const Flat& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  }
  static int turn(const Flat& a, const Flat& b, const Flat& c) { return sign(area(a, b, c)); }

  /// An edge pq against a triangle; the ends lie on the given sides of its plane.
  [[nodiscard]] bool segment_meets(const Point& p, const Point& q, int p_side, int q_side, const Triangle& t) const {
    if (p_side == q_side && p_side != 0) return false;
    if (p_side == 0 && q_side == 0) return segment_meets_in_plane(p, q, t);
    const Point along = q - p, a = t.a - p, b = t.b - p, c = t.c - p;
    const int ab = determinant(along, a, b), bc = determinant(along, b, c), ca = determinant(along, c, a);
    return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
  }

  /// The two axes on which the triangle's plane is projected one to one.
  static std::array<std::size_t, 2> projection(const Triangle& t) {
    const Point n = cross(t.b - t.a, t.c - t.a);
    const std::size_t drop = n[0] != 0 ? 0 : n[1] != 0 ? 1 : 2;
    return {(drop + 1) % 3, (drop + 2) % 3};
  }
  static bool inside(const Flat& p, const std::array<Flat, 3>& t) {
    const int a = turn(t[0], t[1], p), b = turn(t[1], t[2], p), c = turn(t[2], t[0], p);
    return (a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0);
  }
  static bool segments_meet(const Flat& p, const Flat& q, const Flat& a, const Flat& b) {
    const int pa = turn(a, b, p), qa = turn(a, b, q), ap = turn(p, q, a), bp = turn(p, q, b);
    if (pa * qa > 0 || ap * bp > 0) return false;
    if (pa != 0 || qa != 0 || ap != 0 || bp != 0) return true;
    for (std::size_t k = 0; k < 2; ++k)  // on one line
      if (std::max(p[k], q[k]) < std::min(a[k], b[k]) || std::max(a[k], b[k]) < std::min(p[k], q[k])) return false;
    return true;
  }
  static std::array<Flat, 3> flatten(const Triangle& t, const std::array<std::size_t, 2>& axes) {
    const auto flat = [&](const Point& p) { return Flat{p[axes[0]], p[axes[1]]}; };
    return {flat(t.a), flat(t.b), flat(t.c)};
  }
  static bool segment_meets_in_plane(const Point& p, const Point& q, const Triangle& t) {
    const auto axes = projection(t);
    const auto flat = flatten(t, axes);
    const Flat fp = {p[axes[0]], p[axes[1]]}, fq = {q[axes[0]], q[axes[1]]};
    if (inside(fp, flat)) return true;
    for (std::size_t k = 0; k < 3; ++k)
      if (segments_meet(fp, fq, flat[k], flat[(k + 1) % 3])) return true;
    return false;
  }
  static bool meet_in_plane(const Triangle& s, const Triangle& t) {
    const auto axes = projection(s);
    const auto fs = flatten(s, axes), ft = flatten(t, axes);
    if (inside(fs[0], ft) || inside(ft[0], fs)) return true;
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t l = 0; l < 3; ++l)
        if (segments_meet(fs[k], fs[(k + 1) % 3], ft[l], ft[(l + 1) % 3])) return true;
    return false;
  }

  double doubt_;
};

struct Box {
  Point low, high;

  void add(const Point& p) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  void add(const Box& b) {
    add(b.low);
    add(b.high);
  }
  [[nodiscard]] bool meets(const Box& b) const {
    return low[0] <= b.high[0] && high[0] >= b.low[0] && low[1] <= b.high[1] && high[1] >= b.low[1] &&
           low[2] <= b.high[2] && high[2] >= b.low[2];
  }
};

Box box_of(const Triangle& t) {
  Box box{t.a, t.a};
  box.add(t.b);
  box.add(t.c);
  return box;
}

/// A binary tree over boxes, halved at the median of the longest axis, so its depth is log2 of their number.
class Tree {
 public:
  explicit Tree(const std::vector<Box>& boxes) : boxes_(boxes), items_(boxes.size()) {
    for (std::size_t k = 0; k < items_.size(); ++k) items_[k] = static_cast<std::uint32_t>(k);
    nodes_.reserve(boxes.size());
    if (!items_.empty()) build(0, items_.size());
  }
  /// Calls visit(item) for each item whose box may meet `box`, until it returns false.
  template <typename Visit>
  void query(const Box& box, Visit&& visit) const {
    if (!nodes_.empty()) descend(0, box, visit);
  }

 private:
  struct Node {
    Box box;
    std::uint32_t first = 0, count = 0;  // leaf: items; inner node: right child and 0 (the left child is next)
  };

  std::uint32_t build(std::size_t first, std::size_t last) {
    const auto at = static_cast<std::uint32_t>(nodes_.size());
    Box box = boxes_[items_[first]];
    for (std::size_t k = first; k < last; ++k) box.add(boxes_[items_[k]]);
    nodes_.push_back({box, static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last - first)});
    if (last - first <= 4) return at;
    const Point extent = box.high - box.low;
    const auto axis = static_cast<std::size_t>(std::max_element(extent.begin(), extent.end()) - extent.begin());
    const std::size_t middle = first + (last - first) / 2;
    const auto begin = items_.begin();
    std::nth_element(begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(middle),
                     begin + static_cast<std::ptrdiff_t>(last), [&](std::uint32_t a, std::uint32_t b) {
                       const std::int64_t ca = boxes_[a].low[axis] + boxes_[a].high[axis];
                       const std::int64_t cb = boxes_[b].low[axis] + boxes_[b].high[axis];
                       return std::pair(ca, a) < std::pair(cb, b);
                     });
    build(first, middle);
    const std::uint32_t right = build(middle, last);
    nodes_[at].first = right;
    nodes_[at].count = 0;
    return at;
  }
  template <typename Visit>
  bool descend(std::uint32_t at, const Box& box, Visit& visit) const {
    const Node& node = nodes_[at];
    if (!node.box.meets(box)) return true;
    if (node.count == 0) return descend(at + 1, box, visit) && descend(node.first, box, visit);
    for (std::uint32_t k = 0; k < node.count; ++k)
      if (!visit(items_[node.first + k])) return false;
    return true;
  }

  const std::vector<Box>& boxes_;
  std::vector<std::uint32_t> items_;
  std::vector<Node> nodes_;
};

std::string slab_name(std::size_t t) { return "slab " + std::to_string(t); }
std::string fibre_name(std::size_t f) { return "fibre " + std::to_string(f); }

class Checker {
 public:
  explicit Checker(const Shell& shell) : shell_(shell) {}

  Certificate run() {
    Certificate& c = certificate_;
    c.holds[0] = numbers_hold() && snap() && complex_holds();
    if (!c.holds[0]) return std::move(c);
    make_components();
    const bool sound = jacobians_hold();
    c.holds[1] = sound;
    c.holds[2] = windings_hold();
    collect_triangles();
    const Tree tree(boxes_);
    c.holds[3] = pairs_hold(tree) && volumes_hold();
    c.holds[4] = c.holds[3] && nesting_holds(tree);
    return std::move(c);
  }

 private:
  void report(Condition condition, std::size_t a, std::size_t b, std::string what) {
    ++certificate_.failure_count[static_cast<std::size_t>(condition)];
    if (certificate_.failures.size() < kListed)
      certificate_.failures.push_back(
          {condition, static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b), std::move(what)});
  }
  [[nodiscard]] std::size_t count(Condition condition) const {
    return certificate_.failure_count[static_cast<std::size_t>(condition)];
  }

  // ---- C0

  /// A C0 failure of a fibre is filed under the first slab that names it.
  void report_fibre(std::size_t f, std::string_view what) {
    if (slab_with_.empty()) {
      slab_with_.assign(shell_.inner.size(), 0);
      for (std::size_t t = shell_.triangles.size(); t-- > 0;)
        for (const std::uint32_t g : shell_.triangles[t])
          if (g < slab_with_.size()) slab_with_[g] = static_cast<std::uint32_t>(t);
    }
    report(Condition::C0, slab_with_[f], slab_with_[f], fibre_name(f) + std::string(what));
  }

  bool numbers_hold() {
    if (shell_.inner.size() != shell_.outer.size()) {
      report(Condition::C0, 0, 0,
             "there are " + std::to_string(shell_.inner.size()) + " inner but " + std::to_string(shell_.outer.size()) +
                 " outer ends of fibres");
      return false;
    }
    if (shell_.triangles.empty()) {
      report(Condition::C0, 0, 0, "there are no slabs");
      return false;
    }
    for (std::size_t t = 0; t < shell_.triangles.size(); ++t)
      for (const std::uint32_t f : shell_.triangles[t])
        if (f >= shell_.inner.size())
          report(Condition::C0, t, t,
                 slab_name(t) + " names fibre " + std::to_string(f) + " of " + std::to_string(shell_.inner.size()));
    for (std::size_t f = 0; f < shell_.inner.size(); ++f)
      for (std::size_t k = 0; k < 3; ++k)
        if (!std::isfinite(shell_.inner[f][k]) || !std::isfinite(shell_.outer[f][k])) {
          report_fibre(f, " has a coordinate that is not a finite number");
          break;
        }
    return count(Condition::C0) == 0;
  }

  /// Finds the coarsest power of two of which all coordinates are multiples, and counts in its steps from the lowest
  /// corner.
  bool snap() {
    int lowest = std::numeric_limits<int>::max();  // exponent of the lowest bit that is set in any coordinate
    std::array<double, 3> low{}, high{};
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
    for (const auto ends : {shell_.inner, shell_.outer})
      for (const auto& p : ends)
        for (std::size_t k = 0; k < 3; ++k) {
          low[k] = std::min(low[k], p[k]);
          high[k] = std::max(high[k], p[k]);
          if (p[k] == 0) continue;
          int exponent = 0;
          const double fraction = std::frexp(p[k], &exponent);
          const auto digits = static_cast<std::int64_t>(std::ldexp(fraction, 53));
          const int zeros = std::countr_zero(static_cast<std::uint64_t>(digits < 0 ? -digits : digits));
          lowest = std::min(lowest, exponent - 53 + zeros);
        }
    const int step = lowest == std::numeric_limits<int>::max() ? 0 : lowest;
    // A difference of at most 2^30 steps has no rounding; a longer one stays longer when rounded.
    double span = 0;
    for (std::size_t k = 0; k < 3; ++k) span = std::max(span, std::ldexp(high[k] - low[k], -step));
    if (!(span <= kMaxSpan)) {
      report(Condition::C0, 0, 0,
             "the coordinates lie on no lattice of at most 2^30 steps (they are multiples of 2^" +
                 std::to_string(step) + " and span more): snap them to a coarser one");
      return false;
    }
    certificate_.on_lattice = true;
    predicates_ = Predicates(span);
    const auto convert = [&](std::span<const std::array<double, 3>> ends) {
      std::vector<Point> points(ends.size());
      for (std::size_t f = 0; f < ends.size(); ++f)
        for (std::size_t k = 0; k < 3; ++k)
          points[f][k] = static_cast<std::int64_t>(std::ldexp(ends[f][k] - low[k], -step));
      return points;
    };
    inner_ = convert(shell_.inner);
    outer_ = convert(shell_.outer);
    return true;
  }

  bool complex_holds() {
    for (std::size_t f = 0; f < inner_.size(); ++f)
      if (inner_[f] == outer_[f]) report_fibre(f, " has no length");
    triangles_hold();
    if (count(Condition::C0) == 0) edges_hold();
    if (count(Condition::C0) == 0) fans_hold();
    return count(Condition::C0) == 0;
  }

  void triangles_hold() {
    std::vector<std::pair<std::array<std::uint32_t, 3>, std::uint32_t>> sorted;
    sorted.reserve(shell_.triangles.size());
    for (std::size_t t = 0; t < shell_.triangles.size(); ++t) {
      std::array<std::uint32_t, 3> f = shell_.triangles[t];
      std::sort(f.begin(), f.end());
      if (f[0] == f[1] || f[1] == f[2]) report(Condition::C0, t, t, slab_name(t) + " names a fibre twice");
      sorted.emplace_back(f, static_cast<std::uint32_t>(t));
    }
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t k = 1; k < sorted.size(); ++k)
      if (sorted[k].first == sorted[k - 1].first)
        report(Condition::C0, sorted[k - 1].second, sorted[k].second,
               slab_name(sorted[k - 1].second) + " and " + slab_name(sorted[k].second) + " have the same three fibres");
  }

  /// Fills neighbours_: entry k of a slab is the slab across the edge opposite its corner k.
  void edges_hold() {
    struct Edge {
      std::uint32_t low, high, slab;
      std::uint8_t corner;
      bool upwards;
    };
    std::vector<Edge> edges;
    edges.reserve(3 * shell_.triangles.size());
    for (std::uint32_t t = 0; t < shell_.triangles.size(); ++t)
      for (std::uint8_t k = 0; k < 3; ++k) {
        const std::uint32_t a = shell_.triangles[t][(k + 1U) % 3], b = shell_.triangles[t][(k + 2U) % 3];
        edges.push_back({std::min(a, b), std::max(a, b), t, k, a < b});
      }
    std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
      return std::tuple(a.low, a.high, a.slab, a.corner) < std::tuple(b.low, b.high, b.slab, b.corner);
    });
    neighbours_.assign(shell_.triangles.size(), {kNone, kNone, kNone});
    for (std::size_t first = 0, last = 0; first < edges.size(); first = last) {
      while (last < edges.size() && edges[last].low == edges[first].low && edges[last].high == edges[first].high)
        ++last;
      if (last - first == 1) continue;
      const Edge &a = edges[first], &b = edges[first + 1];
      const std::string where = "the edge between fibres " + std::to_string(a.low) + " and " + std::to_string(a.high);
      if (last - first > 2) {
        report(Condition::C0, a.slab, b.slab, where + " lies in " + std::to_string(last - first) + " slabs");
      } else if (a.upwards == b.upwards) {
        report(Condition::C0, a.slab, b.slab,
               slab_name(a.slab) + " and " + slab_name(b.slab) + " run the same way through " + where);
      } else {
        neighbours_[a.slab][a.corner] = b.slab;
        neighbours_[b.slab][b.corner] = a.slab;
      }
    }
  }

  /// Fills link_: for each fibre the fibres around it, counter-clockwise; a closed fan names its first one again at the
  /// end.
  void fans_hold() {
    struct Corner {
      std::uint32_t slab, corner;
    };
    std::vector<std::vector<Corner>> corners(inner_.size());
    for (std::uint32_t t = 0; t < shell_.triangles.size(); ++t)
      for (std::uint32_t k = 0; k < 3; ++k) corners[shell_.triangles[t][k]].push_back({t, k});
    links_.assign(inner_.size(), {});
    fans_.assign(inner_.size(), {});
    open_.assign(inner_.size(), false);
    for (std::size_t f = 0; f < inner_.size(); ++f) {
      if (corners[f].empty()) {
        report_fibre(f, " belongs to no slab");
        continue;
      }
      Corner start = corners[f].front();
      for (const Corner c : corners[f])
        if (neighbours_[c.slab][(c.corner + 2) % 3] == kNone) {
          start = c;
          open_[f] = true;
          break;
        }
      links_[f].push_back(shell_.triangles[start.slab][(start.corner + 1) % 3]);
      Corner at = start;
      for (;;) {
        fans_[f].push_back(at.slab);
        links_[f].push_back(shell_.triangles[at.slab][(at.corner + 2) % 3]);
        const std::uint32_t next = neighbours_[at.slab][(at.corner + 1) % 3];
        if (next == kNone || next == start.slab) break;
        const auto& fibres = shell_.triangles[next];
        at = {next, fibres[0] == f ? 0U : fibres[1] == f ? 1U : 2U};
      }
      if (fans_[f].size() != corners[f].size())
        report(Condition::C0, corners[f].front().slab, corners[f].back().slab,
               "the slabs around " + fibre_name(f) + " are not one fan");
    }
  }

  /// Numbers the slabs that hang together by shared walls.
  void make_components() {
    component_.assign(shell_.triangles.size(), kNone);
    std::vector<std::uint32_t> waiting;
    for (std::uint32_t seed = 0; seed < component_.size(); ++seed) {
      if (component_[seed] != kNone) continue;
      const auto number = static_cast<std::uint32_t>(closed_.size());
      closed_.push_back(true);
      seeds_.push_back(seed);
      component_[seed] = number;
      waiting.push_back(seed);
      while (!waiting.empty()) {
        const std::uint32_t t = waiting.back();
        waiting.pop_back();
        for (const std::uint32_t next : neighbours_[t]) {
          if (next == kNone) {
            closed_[number] = false;
          } else if (component_[next] == kNone) {
            component_[next] = number;
            waiting.push_back(next);
          }
        }
      }
    }
  }

  // ---- C1: at corner i the Jacobian is a quadratic in alpha with the Bernstein coefficients c0, c1, c2.

  bool jacobians_hold() {
    unsound_.assign(shell_.triangles.size(), false);
    for (std::size_t t = 0; t < shell_.triangles.size(); ++t) {
      const auto& f = shell_.triangles[t];
      const Point e_in = inner_[f[1]] - inner_[f[0]], g_in = inner_[f[2]] - inner_[f[0]];
      const Point e_out = outer_[f[1]] - outer_[f[0]], g_out = outer_[f[2]] - outer_[f[0]];
      const Point n_in = cross(e_in, g_in), n_out = cross(e_out, g_out);
      const Point n_mid = cross(e_in, g_out) + cross(e_out, g_in);
      for (std::size_t i = 0; i < 3; ++i) {
        const Point d = outer_[f[i]] - inner_[f[i]];
        const Int128 c0 = dot(n_in, d), c2 = dot(n_out, d), twice_c1 = dot(n_mid, d);
        if (c0 > 0 && c2 > 0 && (twice_c1 >= 0 || square_below_product(twice_c1, 4 * c0, c2))) continue;
        const char* where = c0 <= 0   ? "at its inner triangle"
                            : c2 <= 0 ? "at its outer triangle"
                                      : "between its inner and outer triangle";
        report(Condition::C1, t, t, slab_name(t) + " is folded at " + fibre_name(f[i]) + " " + where);
        unsound_[t] = true;
        break;
      }
    }
    return count(Condition::C1) == 0;
  }

  // ---- C2: seen along the fibre each sound slab turns by less than half a turn, so a full turn shows as one step from
  // the right of the first link fibre to its left.

  bool windings_hold() {
    bool complete = true;
    for (std::size_t f = 0; f < inner_.size(); ++f) {
      if (std::any_of(fans_[f].begin(), fans_[f].end(), [&](std::uint32_t t) { return unsound_[t]; })) {
        complete = false;
        continue;
      }
      const Point along = outer_[f] - inner_[f], first = inner_[links_[f][0]] - inner_[f];
      int turns = 0, before = 0;
      for (const std::uint32_t other : links_[f]) {
        const int now = predicates_.determinant(along, first, inner_[other] - inner_[f]);
        if (before < 0 && now >= 0) ++turns;
        before = now;
      }
      if (open_[f] && turns > 0)
        report(Condition::C2, f, f, "the slabs around open " + fibre_name(f) + " turn a full circle or more");
      if (!open_[f] && turns != 1)
        report(Condition::C2, f, f,
               "the slabs around " + fibre_name(f) + " wind " + std::to_string(turns) + " times instead of once");
    }
    return complete && count(Condition::C2) == 0;
  }

  // ---- C3

  /// Inner triangles first, then the outer ones.
  void collect_triangles() {
    for (const auto* ends : {&inner_, &outer_})
      for (const auto& f : shell_.triangles) triangles_.push_back({(*ends)[f[0]], (*ends)[f[1]], (*ends)[f[2]]});
    boxes_.reserve(triangles_.size());
    for (const Triangle& t : triangles_) boxes_.push_back(box_of(t));
  }
  [[nodiscard]] bool is_outer(std::size_t triangle) const { return triangle >= shell_.triangles.size(); }
  [[nodiscard]] std::size_t slab_of(std::size_t triangle) const {
    return is_outer(triangle) ? triangle - shell_.triangles.size() : triangle;
  }

  bool pairs_hold(const Tree& tree) {
    bool complete = true;
    std::vector<bool> flat(triangles_.size());
    for (std::size_t k = 0; k < triangles_.size(); ++k) {
      const Triangle& t = triangles_[k];
      flat[k] = cross(t.b - t.a, t.c - t.a) == Point{};
      if (flat[k]) complete = false;  // its slab failed C1
    }
    for (std::size_t k = 0; k < triangles_.size() && count(Condition::C3) < kCountedPairs; ++k) {
      if (flat[k]) continue;
      tree.query(boxes_[k], [&](std::uint32_t l) {
        if (l <= k || flat[l] || !boxes_[l].meets(boxes_[k])) return true;
        const std::size_t a = slab_of(k), b = slab_of(l);
        if (is_outer(k) == is_outer(l) && share_a_fibre(a, b)) return true;
        if (!predicates_.meet(triangles_[k], triangles_[l])) return true;
        report_pair(k, l);
        return count(Condition::C3) < kCountedPairs;
      });
    }
    return complete && count(Condition::C3) == 0;
  }
  void report_pair(std::size_t k, std::size_t l) {
    if (slab_of(l) < slab_of(k)) std::swap(k, l);
    const auto side = [&](std::size_t m) { return is_outer(m) ? "outer" : "inner"; };
    report(Condition::C3, slab_of(k), slab_of(l),
           std::string("the ") + side(k) + " triangle of " + slab_name(slab_of(k)) + " meets the " + side(l) +
               " triangle of " + slab_name(slab_of(l)));
  }
  [[nodiscard]] bool share_a_fibre(std::size_t a, std::size_t b) const {
    for (const std::uint32_t f : shell_.triangles[a])
      for (const std::uint32_t g : shell_.triangles[b])
        if (f == g) return true;
    return false;
  }

  bool volumes_hold() {
    std::vector<std::array<Int128, 2>> volumes(closed_.size());  // six times the volume: inner, outer
    for (std::size_t k = 0; k < triangles_.size(); ++k) {
      const Triangle& t = triangles_[k];
      volumes[component_[slab_of(k)]][is_outer(k)] += dot(cross(t.a, t.b), t.c);
    }
    for (std::size_t c = 0; c < closed_.size(); ++c) {
      const int in = sign(volumes[c][0]), out = sign(volumes[c][1]);
      if (closed_[c] && (in != out || in == 0))
        report(Condition::C3, seeds_[c], seeds_[c],
               "the part with " + slab_name(seeds_[c]) + " has inner and outer volumes of different signs");
    }
    return count(Condition::C3) == 0;
  }

  // ---- C4: by C3 the surfaces do not meet. A part reaches into another's shell when one of its two surfaces lies
  // between the other's two, that is where the other's inner and outer winding numbers differ.

  bool nesting_holds(const Tree& tree) {
    struct Windings {
      int inner = 0, outer = 0;
    };
    std::vector<Windings> windings(closed_.size());
    std::vector<std::uint32_t> touched;
    for (std::size_t part = 0; part < closed_.size(); ++part) {
      std::uint32_t found = kNone;
      for (const auto* ends : {&inner_, &outer_}) {
        const Point p = (*ends)[shell_.triangles[seeds_[part]][0]];
        touched.clear();
        const Box ray = {p, {std::numeric_limits<std::int64_t>::max(), p[1], p[2]}};
        tree.query(ray, [&](std::uint32_t k) {
          const std::uint32_t other = component_[slab_of(k)];
          if (other == part || !closed_[other]) return true;
          const int crossing = ray_crossing(triangles_[k], p);
          if (crossing == 0) return true;
          (is_outer(k) ? windings[other].outer : windings[other].inner) += crossing;
          touched.push_back(other);
          return true;
        });
        for (const std::uint32_t other : touched) {
          if (windings[other].inner != windings[other].outer) found = std::min(found, other);
        }
        for (const std::uint32_t other : touched) windings[other] = {};
      }
      if (found != kNone)
        report(Condition::C4, seeds_[part], seeds_[found],
               "the part with " + slab_name(seeds_[part]) + " reaches into the shell of the part with " +
                   slab_name(seeds_[found]));
    }
    return count(Condition::C4) == 0;
  }

  /// How the ray from p along +x passes through the triangle: +1 out of it, -1 into it, 0 not at all. The ray is
  /// thought shifted by (0, e, e^2) for a vanishing e > 0, so it meets no edge.
  [[nodiscard]] int ray_crossing(const Triangle& t, const Point& p) const {
    const auto turn = [&](const Point& a, const Point& b) {
      const std::int64_t area = (b[1] - a[1]) * (p[2] - a[2]) - (b[2] - a[2]) * (p[1] - a[1]);
      if (area != 0) return area > 0 ? 1 : -1;
      const std::int64_t slope = b[2] != a[2] ? a[2] - b[2] : b[1] - a[1];
      return slope > 0 ? 1 : slope < 0 ? -1 : 0;
    };
    const std::int64_t facing = cross(t.b - t.a, t.c - t.a)[0];
    if (facing == 0) return 0;
    const int sense = facing > 0 ? 1 : -1;
    if (turn(t.a, t.b) != sense || turn(t.b, t.c) != sense || turn(t.c, t.a) != sense) return 0;
    return predicates_.side(t, p) == -sense ? sense : 0;
  }

  const Shell& shell_;
  Certificate certificate_;
  Predicates predicates_{kMaxSpan};
  std::vector<std::uint32_t> slab_with_;                  // by fibre, once needed
  std::vector<Point> inner_, outer_;                      // by fibre
  std::vector<std::array<std::uint32_t, 3>> neighbours_;  // by slab
  std::vector<std::vector<std::uint32_t>> links_, fans_;  // by fibre
  std::vector<bool> open_;                                // by fibre
  std::vector<std::uint32_t> component_;                  // by slab
  std::vector<bool> unsound_;                             // by slab
  std::vector<bool> closed_;                              // by component
  std::vector<std::uint32_t> seeds_;                      // by component: its lowest slab
  std::vector<Triangle> triangles_;
  std::vector<Box> boxes_;
};

}  // namespace

std::string_view name(Condition condition) noexcept {
  constexpr std::array<std::string_view, 5> kNames = {"C0", "C1", "C2", "C3", "C4"};
  return kNames[static_cast<std::size_t>(condition)];
}

Certificate check(const Shell& shell) { return Checker(shell).run(); }

}  // namespace relief::verify
