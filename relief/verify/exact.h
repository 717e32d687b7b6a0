// Exact arithmetic on lattice points, and a tree of boxes: what all parts of the verifier stand on.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace relief::verify::detail {

__extension__ using Int128 = __int128;
__extension__ using Uint128 = unsigned __int128;

inline constexpr std::size_t kListed = 100;     // failures that are described
inline constexpr std::size_t kCounted = 10000;  // failures of pairs that are counted; then only slabs are named
inline constexpr double kMaxSpan = 0x1p30;      // steps; up to it every predicate below fits its type

/// A lattice point or a difference of two: at most 2^30 in magnitude.
using Point = std::array<std::int64_t, 3>;

/// A lattice point as it is stored: its coordinates lie within 2^30 of the lattice's origin, which is one of them.
using Place = std::array<std::int32_t, 3>;

inline Point widen(const Place& p) { return {p[0], p[1], p[2]}; }
inline Place narrow(const Point& p) {
  return {static_cast<std::int32_t>(p[0]), static_cast<std::int32_t>(p[1]), static_cast<std::int32_t>(p[2])};
}

inline Point operator-(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Point operator+(const Point& a, const Point& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }

/// Of differences: at most 2^61 per component.
inline Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
/// At most 2^94 for a sum of two cross products and a difference.
inline Int128 dot(const Point& a, const Point& b) {
  return Int128{a[0]} * b[0] + Int128{a[1]} * b[1] + Int128{a[2]} * b[2];
}
inline int sign(Int128 value) { return value > 0 ? 1 : value < 0 ? -1 : 0; }

/// Returns whether a * a < b * c, in 256 bits.
inline bool square_below_product(Int128 a, Int128 b, Int128 c) {
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
  /// Returns whether two closed triangles of positive area have a point in common.
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

  /// Returns an edge pq against a triangle; the ends lie on the given sides of its plane.
  [[nodiscard]] bool segment_meets(const Point& p, const Point& q, int p_side, int q_side, const Triangle& t) const {
    if (p_side == q_side && p_side != 0) return false;
    if (p_side == 0 && q_side == 0) return segment_meets_in_plane(p, q, t);
    const Point along = q - p, a = t.a - p, b = t.b - p, c = t.c - p;
    const int ab = determinant(along, a, b), bc = determinant(along, b, c), ca = determinant(along, c, a);
    return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
  }

  /// Returns the two axes on which the triangle's plane is projected one to one.
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
  Place low, high;

  explicit Box(const Place& p) : low(p), high(p) {}
  Box(const Place& from, const Place& to) : low(from), high(to) {}
  void add(const Place& p) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  void add(const Box& b) {
    add(b.low);
    add(b.high);
  }
  /// By so many steps to every side.
  void widen(std::int32_t steps) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] -= steps;
      high[k] += steps;
    }
  }
  [[nodiscard]] bool meets(const Box& b) const {
    return low[0] <= b.high[0] && high[0] >= b.low[0] && low[1] <= b.high[1] && high[1] >= b.low[1] &&
           low[2] <= b.high[2] && high[2] >= b.low[2];
  }
};

inline Box box_of(const Place& a, const Place& b, const Place& c) {
  Box box(a);
  box.add(b);
  box.add(c);
  return box;
}

/// A binary tree over boxes, halved at the median of the longest axis, so its depth is log2 of their number.
class Tree {
 public:
  explicit Tree(const std::vector<Box>& boxes) : boxes_(boxes), items_(boxes.size()) {
    for (std::size_t k = 0; k < items_.size(); ++k) items_[k] = static_cast<std::uint32_t>(k);
    if (items_.empty()) return;
    nodes_.reserve(node_count(items_.size()));
    build(0, items_.size());
  }
  /// Calls visit(item) for each item whose box may meet `box`, until it returns false.
  template <typename Visit>
  void query(const Box& box, Visit&& visit) const {
    descend_if([&](const Box& other) { return other.meets(box); }, visit);
  }
  /// The same for each item in boxes of which reaches(box) holds.
  template <typename Reaches, typename Visit>
  void descend_if(Reaches&& reaches, Visit&& visit) const {
    if (!nodes_.empty()) descend(0, reaches, visit);
  }

  /// A branch of the tree: items that lie together.
  struct Branch {
    std::uint32_t node;
    std::size_t first;                     // how many items the branches before it hold
    std::span<const std::uint32_t> items;  // in the order in which queries visit them
  };
  /// Returns the branches of at most `most` items, or of four, whose trunks hold more; in the order of queries.
  [[nodiscard]] std::vector<Branch> branches(std::size_t most) const {
    std::vector<Branch> found;
    if (!nodes_.empty()) find_branches({0, 0, items_}, std::max<std::size_t>(most, 4), found);
    return found;
  }
  [[nodiscard]] const Box& box(const Branch& branch) const { return nodes_[branch.node].box; }
  /// Calls visit(place) for the items of a branch whose boxes may meet `box`; place: in branch.items.
  template <typename Visit>
  void query(const Branch& branch, const Box& box, Visit&& visit) const {
    const auto visit_place = [&](std::uint32_t place) {
      visit(place - branch.first);
      return true;
    };
    descend_places(branch.node, [&](const Box& other) { return other.meets(box); }, visit_place);
  }

 private:
  struct Node {
    Box box;
    std::uint32_t first = 0, count = 0;  // leaf: items; inner node: right child and 0 (the left child is next)
  };
  static constexpr std::size_t kLeaf = 4;  // items

  static std::size_t node_count(std::size_t items) {
    return items <= kLeaf ? 1 : 1 + node_count(items / 2) + node_count(items - items / 2);
  }
  std::uint32_t build(std::size_t first, std::size_t last) {
    const auto at = static_cast<std::uint32_t>(nodes_.size());
    Box box = boxes_[items_[first]];
    for (std::size_t k = first; k < last; ++k) box.add(boxes_[items_[k]]);
    nodes_.push_back({box, static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last - first)});
    if (last - first <= kLeaf) return at;
    const Point extent = widen(box.high) - widen(box.low);
    const auto axis = static_cast<std::size_t>(std::max_element(extent.begin(), extent.end()) - extent.begin());
    const std::size_t middle = first + (last - first) / 2;
    const auto begin = items_.begin();
    std::nth_element(begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(middle),
                     begin + static_cast<std::ptrdiff_t>(last), [&](std::uint32_t a, std::uint32_t b) {
                       const std::int64_t ca = std::int64_t{boxes_[a].low[axis]} + boxes_[a].high[axis];
                       const std::int64_t cb = std::int64_t{boxes_[b].low[axis]} + boxes_[b].high[axis];
                       return std::pair(ca, a) < std::pair(cb, b);
                     });
    build(first, middle);
    const std::uint32_t right = build(middle, last);
    nodes_[at].first = right;
    nodes_[at].count = 0;
    return at;
  }
  void find_branches(const Branch& at, std::size_t most, std::vector<Branch>& found) const {
    if (at.items.size() <= most) return found.push_back(at);
    const std::size_t middle = at.items.size() / 2;
    find_branches({at.node + 1, at.first, at.items.first(middle)}, most, found);
    find_branches({nodes_[at.node].first, at.first + middle, at.items.subspan(middle)}, most, found);
  }
  template <typename Reaches, typename Visit>
  bool descend(std::uint32_t at, const Reaches& reaches, Visit& visit) const {
    const auto visit_place = [&](std::uint32_t place) { return visit(items_[place]); };
    return descend_places(at, reaches, visit_place);
  }
  template <typename Reaches, typename Visit>
  bool descend_places(std::uint32_t at, const Reaches& reaches, Visit& visit) const {
    const Node& node = nodes_[at];
    if (!reaches(node.box)) return true;
    if (node.count == 0) return descend_places(at + 1, reaches, visit) && descend_places(node.first, reaches, visit);
    for (std::uint32_t k = 0; k < node.count; ++k)
      if (!visit(node.first + k)) return false;
    return true;
  }

  const std::vector<Box>& boxes_;
  std::vector<std::uint32_t> items_;
  std::vector<Node> nodes_;
};

}  // namespace relief::verify::detail
