// Plain triangles with an index for segments and balls. The oracles of contact stand on them, and on nothing of the
// product.
#pragma once

#include <relief/base/vec.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace relief::testing {

/// Closed or open, counter-clockwise seen from outside. Vertices at the same position are one vertex.
class BareTriangles {
 public:
  using Corners = std::array<std::uint32_t, 3>;

  /// A place on a triangle: inside it (no corners), on an edge (two), or at a vertex (one).
  struct Place {
    Vec3d position;
    std::uint32_t triangle = 0;
    std::array<std::uint32_t, 2> corners{};
    int corner_count = 0;
  };

  BareTriangles(std::span<const Vec3d> positions, std::span<const Corners> triangles) {
    weld(positions, triangles);
    link();
    order_.resize(triangles_.size());
    std::iota(order_.begin(), order_.end(), 0U);
    for (const Vec3d p : positions_) bounds_.add(p);
    hair_ = 1e-12 * diagonal();
    centres_.reserve(triangles_.size());
    for (const Corners& t : triangles_)
      centres_.push_back((positions_[t[0]] + positions_[t[1]] + positions_[t[2]]) / 3);
    if (!order_.empty()) build(0, order_.size());
  }

  [[nodiscard]] const Box3d& bounds() const noexcept { return bounds_; }
  [[nodiscard]] double diagonal() const noexcept { return length(bounds_.extent()); }
  [[nodiscard]] std::size_t size() const noexcept { return triangles_.size(); }
  /// The vertices of open edges.
  [[nodiscard]] const std::vector<Vec3d>& rims() const noexcept { return rims_; }
  [[nodiscard]] std::array<Vec3d, 3> corners(std::uint32_t t) const {
    const Corners& v = triangles_[t];
    return {positions_[v[0]], positions_[v[1]], positions_[v[2]]};
  }
  /// Unit; zero for a triangle without an area.
  [[nodiscard]] Vec3d normal(std::uint32_t t) const {
    const auto [a, b, c] = corners(t);
    return normalized(cross(b - a, c - a));
  }

  /// Calls visit(t) for each triangle that the place lies on.
  template <typename Visit>
  void each_touching(const Place& place, Visit&& visit) const {
    if (place.corner_count == 0) return visit(place.triangle);
    for (const std::uint32_t t : around(place.corners[0]))
      if (place.corner_count == 1 || std::ranges::count(triangles_[t], place.corners[1]) > 0) visit(t);
  }

  /// The point of triangle t nearest to p. One within rounding of an edge or a vertex is on it.
  [[nodiscard]] Place nearest(std::uint32_t t, Vec3d p) const {
    const auto corner = corners(t);
    const Vec3d across = cross(corner[1] - corner[0], corner[2] - corner[0]);
    const double square = dot(across, across);
    bool over = true;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d edge = corner[(k + 1) % 3] - corner[k];
      const double side = dot(cross(edge, p - corner[k]), across);  // distance from the edge * |edge| * |across|
      over = over && side > 0 && side * side > hair_ * hair_ * dot(edge, edge) * square;
    }
    if (over) return {p - across * (dot(p - corner[0], across) / square), t, {}, 0};
    Place best;
    double least = Box3d::kFar;
    for (std::size_t k = 0; k < 3; ++k) {
      const Place on = nearest_on_edge(t, k, p);
      const double far = dot(on.position - p, on.position - p);
      if (far < least) best = on;
      least = std::min(least, far);
    }
    return best;
  }

  /// The outward direction that tells the two sides of the surface apart for all points whose nearest place this is
  /// (Baerentzen and Aanaes 2005): the normal, the sum of two, or the sum weighted by the angles at the vertex.
  [[nodiscard]] Vec3d pseudo_normal(const Place& place) const {
    Vec3d sum;
    each_touching(place, [&](std::uint32_t t) {
      sum += normal(t) * (place.corner_count == 1 ? angle_at(t, place.corners[0]) : 1);
    });
    return normalized(sum);
  }

  /// Whether d points from the place out over an open edge of the surface.
  [[nodiscard]] bool over_open_edge(const Place& place, Vec3d d) const {
    bool over = false;
    each_touching(place, [&](std::uint32_t t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t from = triangles_[t][k], to = triangles_[t][(k + 1) % 3];
        if (!is_on_edge(place, from, to) || sides(from, to) > 1) continue;
        const Vec3d out = normalized(cross(positions_[to] - positions_[from], normal(t)));
        over = over || dot(out, d) > 1e-9 * length(d);
      }
    });
    return over;
  }

  struct Entry {
    double share = 0;  ///< of the segment
    std::uint32_t triangle = 0;
  };
  /// Where the segment from a to b first goes in through the surface; triangles for which skip(t) holds do not count.
  template <typename Skip>
  [[nodiscard]] std::optional<Entry> entry(Vec3d a, Vec3d b, Skip&& skip) const {
    std::optional<Entry> first;
    const Vec3d way = b - a;
    each_node([&](const Box3d& box) { return meets(box, a, way, first ? first->share : 1); },
              [&](std::uint32_t t) {
                const auto share = goes_in(t, a, way);
                if (share && (!first || *share < first->share) && !skip(t)) first = Entry{*share, t};
              });
    return first;
  }
  [[nodiscard]] std::optional<Entry> entry(Vec3d a, Vec3d b) const {
    return entry(a, b, [](std::uint32_t) { return false; });
  }

  /// Calls visit(place, distance) with the nearest place of each triangle that is at most so far from p.
  template <typename Visit>
  void each_within(Vec3d p, double distance, Visit&& visit) const {
    each_node([&](const Box3d& box) { return box.distance2(p) <= distance * distance; },
              [&](std::uint32_t t) {
                const Place place = nearest(t, p);
                const double here = length(place.position - p);
                if (here <= distance) visit(place, here);
              });
  }
  /// The place nearest to p, if it is at most so far away.
  [[nodiscard]] std::optional<Place> nearest_within(Vec3d p, double distance) const {
    std::optional<Place> best;
    each_node([&](const Box3d& box) { return box.distance2(p) <= distance * distance; },
              [&](std::uint32_t t) {
                const Place place = nearest(t, p);
                const double here = length(place.position - p);
                if (here > distance) return;
                best = place;
                distance = here;
              });
    return best;
  }
  /// Whether the line from a place of the surface through a point in the solid comes out of it within twice their
  /// distance: the point is past the middle of the part.
  [[nodiscard]] bool past_the_middle(Vec3d place, Vec3d point) const {
    return entry(place + (point - place) * 2, place).has_value();
  }
  /// How thick the material is below a place of the surface, straight against its normal; `most` where it is thicker.
  [[nodiscard]] double thickness(const Place& place, double most) const {
    const Vec3d in = -pseudo_normal(place);
    // Seen from the far end, the way back goes in where this one comes out; the last entry is the first way out.
    double least = most;
    each_node([&](const Box3d& box) { return meets(box, place.position, in * most, 1); },
              [&](std::uint32_t t) {
                const Vec3d far = place.position + in * most;
                const auto back = goes_in(t, far, -(in * most));
                if (back && (1 - *back) * most > 1e-9 * diagonal()) least = std::min(least, (1 - *back) * most);
              });
    return least;
  }

 private:
  struct Node {
    Box3d box;
    std::uint32_t first = 0, last = 0;  ///< of order_, for a leaf
    std::uint32_t right = 0;            ///< the second child; the first one follows the node
  };
  static constexpr std::size_t kLeaf = 4;  // triangles: about the fastest between 2 and 16

  void weld(std::span<const Vec3d> positions, std::span<const Corners> triangles) {
    std::map<std::array<double, 3>, std::uint32_t> known;
    std::vector<std::uint32_t> vertex;
    vertex.reserve(positions.size());
    for (const Vec3d p : positions) {
      const auto [at, fresh] = known.try_emplace({p.x, p.y, p.z}, static_cast<std::uint32_t>(positions_.size()));
      if (fresh) positions_.push_back(p);
      vertex.push_back(at->second);
    }
    for (const Corners& t : triangles) {
      const Corners welded = {vertex[t[0]], vertex[t[1]], vertex[t[2]]};
      if (welded[0] != welded[1] && welded[1] != welded[2] && welded[2] != welded[0]) triangles_.push_back(welded);
    }
  }
  void link() {
    first_around_.assign(positions_.size() + 1, 0);
    for (const Corners& t : triangles_)
      for (const std::uint32_t v : t) ++first_around_[v + 1];
    std::partial_sum(first_around_.begin(), first_around_.end(), first_around_.begin());
    around_.resize(3 * triangles_.size());
    auto next = first_around_;
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
      for (const std::uint32_t v : triangles_[t]) around_[next[v]++] = t;
    for (const Corners& t : triangles_)
      for (std::size_t k = 0; k < 3; ++k)
        if (sides(t[k], t[(k + 1) % 3]) == 1) rims_.insert(rims_.end(), {positions_[t[k]], positions_[t[(k + 1) % 3]]});
  }
  void build(std::size_t first, std::size_t last) {
    const std::size_t at = nodes_.size();
    nodes_.emplace_back();
    Box3d box, middles;
    for (std::size_t k = first; k < last; ++k) {
      for (const Vec3d p : corners(order_[k])) box.add(p);
      middles.add(centres_[order_[k]]);
    }
    nodes_[at].box = box;
    nodes_[at].first = static_cast<std::uint32_t>(first);
    nodes_[at].last = static_cast<std::uint32_t>(last);
    if (last - first <= kLeaf) return;
    const Vec3d extent = middles.extent();
    const std::size_t axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
    const std::size_t middle = first + (last - first) / 2;
    const auto begin = order_.begin();
    std::nth_element(begin + std::ptrdiff_t(first), begin + std::ptrdiff_t(middle), begin + std::ptrdiff_t(last),
                     [&](std::uint32_t s, std::uint32_t t) { return centres_[s][axis] < centres_[t][axis]; });
    build(first, middle);
    nodes_[at].right = static_cast<std::uint32_t>(nodes_.size());
    build(middle, last);
  }
  template <typename Wanted, typename Visit>
  void each_node(Wanted&& wanted, Visit&& visit) const {
    if (nodes_.empty()) return;
    std::array<std::uint32_t, 64> open{};
    std::size_t count = 0;
    open[count++] = 0;
    while (count > 0) {
      const std::uint32_t at = open[--count];
      const Node& node = nodes_[at];
      if (!wanted(node.box)) continue;
      if (node.right == 0) {
        for (std::uint32_t k = node.first; k < node.last; ++k) visit(order_[k]);
      } else {
        open[count++] = node.right;
        open[count++] = at + 1;
      }
    }
  }
  /// Whether the segment from a, so much of the way long, meets the box.
  static bool meets(const Box3d& box, Vec3d a, Vec3d way, double share) {
    double begin = 0, end = share;
    for (std::size_t k = 0; k < 3; ++k) {
      if (way[k] == 0) {
        if (a[k] < box.low[k] || a[k] > box.high[k]) return false;
        continue;
      }
      const double low = (box.low[k] - a[k]) / way[k], high = (box.high[k] - a[k]) / way[k];
      begin = std::max(begin, std::min(low, high) * (1 - 1e-12) - 1e-12);
      end = std::min(end, std::max(low, high) * (1 + 1e-12) + 1e-12);
    }
    return begin <= end;
  }
  /// At which share of the way from a it goes in through triangle t. A way through an edge goes through one of its
  /// triangles at least: both see the same volumes.
  [[nodiscard]] std::optional<double> goes_in(std::uint32_t t, Vec3d a, Vec3d way) const {
    const auto [p, q, r] = corners(t);
    const double wp = volume(way, q - a, r - a), wq = volume(way, r - a, p - a), wr = volume(way, p - a, q - a);
    const double sum = wp + wq + wr;
    if (wp > 0 || wq > 0 || wr > 0 || sum == 0) return std::nullopt;
    const Vec3d x = ((p - a) * wp + (q - a) * wq + (r - a) * wr) / sum;
    const double share = dot(x, way) / dot(way, way);
    if (share < 0 || share > 1) return std::nullopt;
    return share;
  }
  static double volume(Vec3d a, Vec3d b, Vec3d c) { return dot(a, cross(b, c)); }

  [[nodiscard]] Place nearest_on_edge(std::uint32_t t, std::size_t k, Vec3d p) const {
    const std::uint32_t from = triangles_[t][k], to = triangles_[t][(k + 1) % 3];
    const Vec3d a = positions_[from], edge = positions_[to] - a;
    const double along = dot(p - a, edge) / dot(edge, edge), rounding = hair_ / length(edge);
    if (along <= rounding) return {a, t, {from, from}, 1};
    if (along >= 1 - rounding) return {positions_[to], t, {to, to}, 1};
    return {a + edge * along, t, {from, to}, 2};
  }
  [[nodiscard]] std::span<const std::uint32_t> around(std::uint32_t vertex) const {
    return std::span(around_).subspan(first_around_[vertex], first_around_[vertex + 1] - first_around_[vertex]);
  }
  [[nodiscard]] double angle_at(std::uint32_t t, std::uint32_t vertex) const {
    const Corners& v = triangles_[t];
    const std::size_t k = v[0] == vertex ? 0 : v[1] == vertex ? 1 : 2;
    const Vec3d a = positions_[v[(k + 1) % 3]] - positions_[vertex],
                b = positions_[v[(k + 2) % 3]] - positions_[vertex];
    return std::atan2(length(cross(a, b)), dot(a, b));
  }
  static bool is_on_edge(const Place& place, std::uint32_t from, std::uint32_t to) {
    const auto is_end = [&](std::uint32_t v) { return v == from || v == to; };
    if (place.corner_count == 0) return false;
    return is_end(place.corners[0]) && (place.corner_count == 1 || is_end(place.corners[1]));
  }
  /// How many triangles an edge has.
  [[nodiscard]] int sides(std::uint32_t from, std::uint32_t to) const {
    int count = 0;
    for (const std::uint32_t t : around(from)) count += std::ranges::count(triangles_[t], to) > 0 ? 1 : 0;
    return count;
  }

  std::vector<Vec3d> positions_, rims_;
  std::vector<Corners> triangles_;
  std::vector<std::uint32_t> first_around_, around_;  ///< triangles by vertex
  std::vector<Vec3d> centres_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
  Box3d bounds_;
  double hair_ = 0;  ///< what counts as rounding, model units
};

}  // namespace relief::testing
