#include <relief/convert/geometry/triangle_cut.h>

#include <algorithm>
#include <deque>

namespace relief::detail {
namespace {

constexpr std::size_t next(std::size_t k) noexcept { return k == 2 ? 0 : k + 1; }
constexpr std::size_t last(std::size_t k) noexcept { return k == 0 ? 2 : k - 1; }

}  // namespace

TriangleCut::TriangleCut(const LatticeTriangle& t)
    : plane_(LatticePlane::through(t[0], t[1], t[2])),
      axis_(dominant_axis(plane_.normal)),
      sense_(plane_.normal[axis_] > 0 ? 1 : -1),
      origin_(to_double(t[0])) {
  const Vec3d n = {double(plane_.normal.x), double(plane_.normal.y), double(plane_.normal.z)};
  across_ = normalized(to_double(t[1] - t[0]));
  up_ = cross(normalized(n), across_);
  for (const LatticePoint p : t) new_point(ExactPoint::at(p));
  parts_.push_back({{0, 1, 2}});
  for (std::uint32_t v = 0; v < 3; ++v) part_at_[v] = 0;
}

std::uint32_t TriangleCut::new_point(const ExactPoint& p) {
  const Vec3d d = p.approximate() - origin_;
  points_.push_back(p);
  flat_.push_back({dot(d, across_), dot(d, up_)});
  part_at_.push_back(kNone);
  return static_cast<std::uint32_t>(points_.size() - 1);
}

int TriangleCut::turn_of(std::uint32_t a, std::uint32_t b, const ExactPoint& p) const noexcept {
  return sense_ * turn(points_[a], points_[b], p, axis_);
}

bool TriangleCut::is_ahead(std::uint32_t a, std::uint32_t b, std::uint32_t c) const noexcept {
  const PlaneAxes axes(axis_);
  for (const std::size_t k : {axes.first, axes.second})
    if (const int way = compare(points_[b], points_[a], k); way != 0)
      return way * compare(points_[c], points_[a], k) > 0;
  return false;
}

std::array<int, 3> TriangleCut::turns_in(std::uint32_t part, const ExactPoint& p) const noexcept {
  const Face& v = parts_[part].corners;
  return {turn_of(v[0], v[1], p), turn_of(v[1], v[2], p), turn_of(v[2], v[0], p)};
}

/// Returns the part that holds a point: by walking towards it, which may go round in circles, so for so many steps at
/// most.
std::uint32_t TriangleCut::find(const ExactPoint& p) const {
  std::uint32_t at = latest_;
  for (std::size_t step = 0; step <= parts_.size(); ++step) {
    const Part& part = parts_[at];
    std::size_t out = 3;
    for (std::size_t i = 0; i < 3 && out == 3; ++i) {
      const std::size_t k = (i + step) % 3;
      if (part.beyond[k] != kNone && turn_of(part.corners[k], part.corners[next(k)], p) < 0) out = k;
    }
    if (out == 3) return at;
    at = part.beyond[out];
  }
  for (std::uint32_t part = 0; part < parts_.size(); ++part)
    if (std::ranges::min(turns_in(part, p)) >= 0) return part;
  return at;
}

template <typename Visit>
void TriangleCut::around(std::uint32_t v, Visit&& visit) const {
  const auto corner = [&](std::uint32_t part) {
    const Face& c = parts_[part].corners;
    return c[0] == v ? std::size_t{0} : c[1] == v ? std::size_t{1} : std::size_t{2};
  };
  const std::uint32_t first = part_at_[v];
  std::uint32_t part = first;
  do {  // counter-clockwise
    const std::size_t k = corner(part);
    if (!visit(part, k)) return;
    part = parts_[part].beyond[last(k)];
  } while (part != kNone && part != first);
  if (part == first) return;
  for (part = parts_[first].beyond[corner(first)]; part != kNone;) {
    const std::size_t k = corner(part);
    if (!visit(part, k)) return;
    part = parts_[part].beyond[k];
  }
}

/// Of the part to its left, or to its right where that is all there is.
TriangleCut::Edge TriangleCut::find_edge(std::uint32_t a, std::uint32_t b) const {
  Edge found{kNone, 0};
  around(a, [&](std::uint32_t part, std::size_t k) {
    const Face& c = parts_[part].corners;
    if (c[last(k)] == b) found = {part, last(k)};
    if (c[next(k)] != b) return true;
    found = {part, k};
    return false;
  });
  return found;
}

void TriangleCut::set(std::uint32_t part, const Part& to) {
  parts_[part] = to;
  for (const std::uint32_t v : to.corners) part_at_[v] = part;
}

/// Returns the part beyond an edge learns that this one lies there now.
void TriangleCut::point_back(std::uint32_t from, std::uint32_t part, std::size_t edge) {
  if (from == kNone) return;
  const std::uint32_t a = parts_[part].corners[edge];
  for (std::size_t k = 0; k < 3; ++k)
    if (parts_[from].corners[next(k)] == a) parts_[from].beyond[k] = part;
}

std::uint32_t TriangleCut::split_part(std::uint32_t part, const ExactPoint& p) {
  const std::uint32_t v = new_point(p);
  const Part old = parts_[part];
  const auto first = static_cast<std::uint32_t>(parts_.size());
  const std::array<std::uint32_t, 3> made = {part, first, first + 1};
  parts_.resize(parts_.size() + 2);
  for (std::size_t k = 0; k < 3; ++k) {
    set(made[k], {{old.corners[k], old.corners[next(k)], v},
                  {old.beyond[k], made[next(k)], made[last(k)]},
                  {old.wall[k], kFree, kFree}});
    point_back(old.beyond[k], made[k], 0);
  }
  EndPairs edges;
  for (std::size_t k = 0; k < 3; ++k) edges.emplace_back(old.corners[k], old.corners[next(k)]);
  improve(edges);
  latest_ = part_at_[v];
  return v;
}

std::uint32_t TriangleCut::split_edge(Edge edge, const ExactPoint& p) {
  const std::uint32_t v = new_point(p);
  const Part old = parts_[edge.part];
  const std::size_t k = edge.k;
  const std::uint32_t a = old.corners[k], b = old.corners[next(k)], c = old.corners[last(k)];
  const std::uint32_t other = old.beyond[k], wall = old.wall[k];
  const auto near = static_cast<std::uint32_t>(parts_.size()), far = near + 1;
  parts_.resize(parts_.size() + (other == kNone ? 1 : 2));
  EndPairs edges = {{b, c}, {c, a}};
  if (other != kNone) {
    const Part beyond = parts_[other];
    std::size_t j = 0;
    while (beyond.corners[j] != b) ++j;
    const std::uint32_t d = beyond.corners[last(j)];
    set(other, {{b, v, d}, {near, far, beyond.beyond[last(j)]}, {wall, kFree, beyond.wall[last(j)]}});
    set(far, {{v, a, d}, {edge.part, beyond.beyond[next(j)], other}, {wall, beyond.wall[next(j)], kFree}});
    point_back(beyond.beyond[next(j)], far, 1);
    edges.emplace_back(a, d);
    edges.emplace_back(d, b);
  }
  const std::uint32_t beyond_a = other == kNone ? kNone : far;
  set(edge.part, {{a, v, c}, {beyond_a, near, old.beyond[last(k)]}, {wall, kFree, old.wall[last(k)]}});
  set(near, {{v, b, c}, {other, old.beyond[next(k)], edge.part}, {wall, old.wall[next(k)], kFree}});
  point_back(old.beyond[next(k)], near, 1);
  improve(edges);
  latest_ = part_at_[v];
  return v;
}

std::uint32_t TriangleCut::add(const ExactPoint& p) {
  const std::uint32_t part = find(p);
  const std::array<int, 3> turns = turns_in(part, p);
  for (std::size_t k = 0; k < 3; ++k)
    if (turns[k] == 0 && turns[next(k)] == 0) return parts_[part].corners[next(k)];
  for (std::size_t k = 0; k < 3; ++k)
    if (turns[k] == 0) return split_edge({part, k}, p);
  return split_part(part, p);
}

void TriangleCut::set_wall(Edge edge, std::uint32_t wall) {
  Part& part = parts_[edge.part];
  if (part.wall[edge.k] != kFree) return;
  part.wall[edge.k] = wall;
  const std::uint32_t other = part.beyond[edge.k];
  if (other == kNone) return;
  for (std::size_t k = 0; k < 3; ++k)
    if (parts_[other].beyond[k] == edge.part && parts_[other].corners[k] == part.corners[next(edge.k)])
      parts_[other].wall[k] = wall;
}

/// Returns the edge's two parts get the other diagonal; edge 0 of both is it then.
void TriangleCut::flip(Edge edge) {
  const Part p = parts_[edge.part];
  const std::size_t k = edge.k;
  const std::uint32_t a = p.corners[k], b = p.corners[next(k)], c = p.corners[last(k)], other = p.beyond[k];
  const Part q = parts_[other];
  std::size_t j = 0;
  while (q.corners[j] != b) ++j;
  const std::uint32_t d = q.corners[last(j)];
  set(edge.part, {{c, d, b}, {other, q.beyond[last(j)], p.beyond[next(k)]}, {kFree, q.wall[last(j)], p.wall[next(k)]}});
  set(other, {{d, c, a}, {edge.part, p.beyond[last(k)], q.beyond[next(j)]}, {kFree, p.wall[last(k)], q.wall[next(j)]}});
  point_back(q.beyond[last(j)], edge.part, 1);
  point_back(p.beyond[last(k)], other, 1);
}

/// Returns whether the two parts of an edge are a strictly convex quadrilateral.
bool TriangleCut::can_flip(Edge edge) const noexcept {
  const Part& p = parts_[edge.part];
  const std::uint32_t other = p.beyond[edge.k];
  if (other == kNone) return false;
  const std::uint32_t a = p.corners[edge.k], b = p.corners[next(edge.k)], c = p.corners[last(edge.k)];
  const Face& q = parts_[other].corners;
  std::size_t j = 0;
  while (q[j] != b) ++j;
  const std::uint32_t d = q[last(j)];
  return turn_of(c, d, b) > 0 && turn_of(d, c, a) > 0;
}

/// Returns whether the far corner lies in the circle around an edge's part.
bool TriangleCut::should_flip(Edge edge) const noexcept {
  constexpr double kClearly = 1e-9;  // of the terms
  const Part& p = parts_[edge.part];
  const std::uint32_t other = p.beyond[edge.k];
  if (other == kNone || p.wall[edge.k] != kFree) return false;
  const std::uint32_t b = p.corners[next(edge.k)];
  const Face& q = parts_[other].corners;
  std::size_t j = 0;
  while (q[j] != b) ++j;
  const std::array<double, 2> d = flat_[q[last(j)]];
  std::array<std::array<double, 3>, 3> row{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double x = flat_[p.corners[k]][0] - d[0], y = flat_[p.corners[k]][1] - d[1];
    row[k] = {x, y, x * x + y * y};
  }
  double sum = 0, size = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto &r = row[next(k)], &s = row[last(k)];
    const double minor = r[0] * s[1] - r[1] * s[0];
    sum += row[k][2] * minor;
    size += row[k][2] * (std::abs(r[0] * s[1]) + std::abs(r[1] * s[0]));
  }
  return sum > kClearly * size && can_flip(edge);
}

/// Flips edges until they are Delaunay, starting with some.
void TriangleCut::improve(EndPairs& edges) {
  // Doubles may want a flip back; each is asked for a bounded number of times.
  for (std::size_t left = 200 + 20 * edges.size(); !edges.empty() && left > 0; --left) {
    const auto [a, b] = edges.back();
    edges.pop_back();
    const Edge edge = find_edge(a, b);
    if (edge.part == kNone || !should_flip(edge)) continue;
    const Face p = parts_[edge.part].corners;
    flip(edge);
    const std::uint32_t d = parts_[edge.part].corners[1], c = p[last(edge.k)];
    for (const std::uint32_t v : {p[edge.k], p[next(edge.k)]}) {
      edges.emplace_back(v, c);
      edges.emplace_back(v, d);
    }
  }
}

void TriangleCut::add_segment(std::uint32_t a, std::uint32_t b, const LatticePlane& plane) {
  walls_.push_back(plane);
  make_edge(a, b, static_cast<std::uint32_t>(walls_.size() - 1));
}

void TriangleCut::add_edge(std::uint32_t a, std::uint32_t b) { make_edge(a, b, kFixed); }

void TriangleCut::make_edge(std::uint32_t a, std::uint32_t b, std::uint32_t wall) {
  while (a != b) a = first_on_way(a, b, wall);
}

/// Makes the first stretch of a segment an edge, and gives its end.
std::uint32_t TriangleCut::first_on_way(std::uint32_t a, std::uint32_t b, std::uint32_t wall) {
  std::uint32_t to = kNone;      // the end of an edge on the way
  Edge crossed_first{kNone, 0};  // else the first edge that is crossed
  around(a, [&](std::uint32_t part, std::size_t k) {
    const std::uint32_t right = parts_[part].corners[next(k)], left = parts_[part].corners[last(k)];
    const int at_right = right == b ? 0 : turn_of(a, b, right), at_left = left == b ? 0 : turn_of(a, b, left);
    if (at_right == 0 && (right == b || is_ahead(a, b, right))) to = right;
    if (at_left == 0 && (left == b || is_ahead(a, b, left))) to = left;
    if (at_right < 0 && at_left > 0) crossed_first = {part, next(k)};
    return to == kNone && crossed_first.part == kNone;
  });
  if (to != kNone) {
    set_wall(find_edge(a, to), wall);
    return to;
  }
  if (crossed_first.part == kNone) return b;  // there is no such segment in the triangle
  EndPairs crossed;                           // right, left
  for (Edge at = crossed_first;;) {
    const std::uint32_t right = parts_[at.part].corners[at.k], left = parts_[at.part].corners[next(at.k)];
    if (const std::uint32_t there = parts_[at.part].wall[at.k]; there != kFree) {
      if (there == kFixed || wall == kFixed) return b;
      // What is crossed before it is in the way of the shorter segment only.
      const std::uint32_t cut = split_edge(at, ExactPoint::where_meet(plane_, walls_[there], walls_[wall]));
      make_edge(a, cut, wall);
      return cut;
    }
    crossed.emplace_back(right, left);
    const std::uint32_t beyond = parts_[at.part].beyond[at.k];
    if (beyond == kNone) return b;
    std::size_t j = 0;
    while (parts_[beyond].corners[j] != left) ++j;
    const std::uint32_t far = parts_[beyond].corners[last(j)];
    const int side = far == b ? 0 : turn_of(a, b, far);
    if (side == 0) {
      to = far;
      break;
    }
    // The edge from the left to the right end is entered; the way leaves by one of the other two.
    at = side > 0 ? Edge{beyond, next(j)} : Edge{beyond, last(j)};
  }
  clear_way(a, to, wall, crossed);
  return to;
}

/// Flips edges until none of those that cross the segment is left [Sloan 1993], then it is one.
void TriangleCut::clear_way(std::uint32_t a, std::uint32_t b, std::uint32_t wall, const EndPairs& crossed) {
  std::deque<EndPairs::value_type> left(crossed.begin(), crossed.end());
  EndPairs made;
  const std::size_t most = 100 + 10 * crossed.size() * crossed.size();
  for (std::size_t turns = 0; !left.empty() && turns < most; ++turns) {
    const auto [u, v] = left.front();
    left.pop_front();
    const Edge edge = find_edge(u, v);
    if (!can_flip(edge)) {
      left.emplace_back(u, v);
      continue;
    }
    flip(edge);
    const std::uint32_t c = parts_[edge.part].corners[0], d = parts_[edge.part].corners[1];
    const bool ends = c == a || c == b || d == a || d == b;
    if (!ends && turn_of(a, b, c) * turn_of(a, b, d) < 0)
      left.emplace_back(c, d);
    else if (!(ends && (c == a || c == b) && (d == a || d == b)))
      made.emplace_back(c, d);
  }
  set_wall(find_edge(a, b), wall);
  improve(made);
}

std::vector<Face> TriangleCut::faces() const {
  std::vector<Face> faces;
  faces.reserve(parts_.size());
  for (const Part& part : parts_) faces.push_back(part.corners);
  return faces;
}

}  // namespace relief::detail
