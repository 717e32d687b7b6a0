#include <relief/convert/geometry/triangle_contact.h>

#include <algorithm>
#include <utility>

namespace relief::detail {
namespace {

using Long = Vec3<std::int64_t>;
using Signs = std::array<int, 3>;

constexpr int sign(std::int64_t v) noexcept { return v > 0 ? 1 : v < 0 ? -1 : 0; }

Long widen(LatticePoint p) noexcept { return {p.x, p.y, p.z}; }

/// Twice the area of (a, b, c) seen against an axis; below 2^52.
std::int64_t area(LatticePoint a, LatticePoint b, LatticePoint c, std::size_t axis) noexcept {
  const PlaneAxes axes(axis);
  const Long e = widen(b - a), g = widen(c - a);
  return e[axes.first] * g[axes.second] - e[axes.second] * g[axes.first];
}

std::size_t axis_of(const LatticeTriangle& t) noexcept {
  return dominant_axis(cross(widen(t[1] - t[0]), widen(t[2] - t[0])));
}

/// Per corner of t the side of the plane of `of` on which it lies; nevertheless and not 0 where they cannot meet.
Signs sides(const LatticeTriangle& of, const LatticeTriangle& t) noexcept {
  Signs s{};
  for (std::size_t k = 0; k < 3; ++k) s[k] = orientation(of[0], of[1], of[2], t[k]);
  return s;
}

bool all_on_one_side(const Signs& s) noexcept { return s[0] != 0 && s[0] == s[1] && s[0] == s[2]; }

/// Returns whether p, in the plane of t, lies in it.
bool holds(const LatticeTriangle& t, std::size_t axis, LatticePoint p) noexcept {
  const int s0 = sign(area(t[0], t[1], p, axis)), s1 = sign(area(t[1], t[2], p, axis)),
            s2 = sign(area(t[2], t[0], p, axis));
  return (s0 >= 0 && s1 >= 0 && s2 >= 0) || (s0 <= 0 && s1 <= 0 && s2 <= 0);
}

/// Returns whether a segment that crosses the plane of t does so in t.
bool crosses(LatticePoint p, LatticePoint q, const LatticeTriangle& t) noexcept {
  const int s0 = orientation(p, q, t[0], t[1]), s1 = orientation(p, q, t[1], t[2]);
  if (s0 * s1 < 0) return false;
  const int s2 = orientation(p, q, t[2], t[0]);
  return s0 * s2 >= 0 && s1 * s2 >= 0;
}

bool is_corner(const LatticeTriangle& t, LatticePoint p) noexcept { return p == t[0] || p == t[1] || p == t[2]; }

void add_coplanar(const LatticeTriangle& a, const LatticeTriangle& b, TriangleContact& contact) noexcept {
  const std::size_t axis = axis_of(a);
  const auto add = [&](ContactPoint::Kind kind, std::size_t i, std::size_t j) {
    contact.list[contact.count++] = {kind, static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(j)};
  };
  for (std::size_t k = 0; k < 3; ++k) {
    if (holds(b, axis, a[k])) add(ContactPoint::CornerOfA, k, 0);
    if (holds(a, axis, b[k])) add(ContactPoint::CornerOfB, 0, k);
  }
  std::array<Signs, 3> a_of{}, b_of{};  // per edge the sides on which the other's corners lie
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t c = 0; c < 3; ++c) {
      a_of[k][c] = sign(area(b[k], b[(k + 1) % 3], a[c], axis));
      b_of[k][c] = sign(area(a[k], a[(k + 1) % 3], b[c], axis));
    }
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      if (b_of[i][j] * b_of[i][(j + 1) % 3] < 0 && a_of[j][i] * a_of[j][(i + 1) % 3] < 0)
        add(ContactPoint::Edges, i, j);
}

TriangleContact find_contact(const LatticeTriangle& a, const LatticeTriangle& b, const Signs& sb,
                             const Signs& sa) noexcept {
  TriangleContact contact;
  if (sb == Signs{0, 0, 0}) {
    contact.coplanar = true;
    add_coplanar(a, b, contact);
    return contact;
  }
  const std::size_t axis_a = axis_of(a), axis_b = axis_of(b);
  for (std::size_t k = 0; k < 3; ++k) {
    const auto corner = static_cast<std::uint8_t>(k);
    const std::size_t next = (k + 1) % 3;
    if (sa[k] == 0 && holds(b, axis_b, a[k])) contact.list[contact.count++] = {ContactPoint::CornerOfA, corner, 0};
    if (sb[k] == 0 && holds(a, axis_a, b[k])) contact.list[contact.count++] = {ContactPoint::CornerOfB, 0, corner};
    if (sa[k] * sa[next] < 0 && crosses(a[k], a[next], b))
      contact.list[contact.count++] = {ContactPoint::EdgeOfA, corner, 0};
    if (sb[k] * sb[next] < 0 && crosses(b[k], b[next], a))
      contact.list[contact.count++] = {ContactPoint::EdgeOfB, 0, corner};
  }
  return contact;
}

}  // namespace

TriangleContact find_contact(const LatticeTriangle& a, const LatticeTriangle& b) noexcept {
  const Signs sb = sides(a, b);
  if (all_on_one_side(sb)) return {};
  const Signs sa = sides(b, a);
  if (all_on_one_side(sa)) return {};
  return find_contact(a, b, sb, sa);
}

bool meet_beyond_corners(const LatticeTriangle& a, const LatticeTriangle& b) noexcept {
  const Signs sb = sides(a, b);
  // Corners of both lie in both planes; where the others are on one side, no more than they can be in common.
  const auto only_corners_touch = [](const Signs& s, const LatticeTriangle& t, const LatticeTriangle& other) {
    int side = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      if (s[k] == 0) {
        if (!is_corner(other, t[k])) return false;
      } else {
        if (side * s[k] < 0) return false;
        side = s[k];
      }
    }
    return side != 0;
  };
  if (only_corners_touch(sb, b, a)) return false;
  const Signs sa = sides(b, a);
  if (only_corners_touch(sa, a, b)) return false;
  const TriangleContact contact = find_contact(a, b, sb, sa);
  std::size_t shared = 0;
  for (const ContactPoint& p : contact.points()) {
    if (p.kind == ContactPoint::CornerOfA ? !is_corner(b, a[p.a])
                                          : p.kind != ContactPoint::CornerOfB || !is_corner(a, b[p.b]))
      return true;
    shared += p.kind == ContactPoint::CornerOfA;
  }
  return shared == 3;
}

ExactPoint point_of(const ContactPoint& contact, const LatticeTriangle& a, const LatticeTriangle& b) {
  const auto on_edge = [](const LatticeTriangle& t, std::size_t k, const LatticeTriangle& other) {
    const LatticePlane plane = LatticePlane::through(other[0], other[1], other[2]);
    const LatticePoint p = t[k], q = t[(k + 1) % 3];
    return ExactPoint::between(p, q, plane.distance(p), plane.distance(q));
  };
  switch (contact.kind) {
    case ContactPoint::CornerOfA:
      return ExactPoint::at(a[contact.a]);
    case ContactPoint::CornerOfB:
      return ExactPoint::at(b[contact.b]);
    case ContactPoint::EdgeOfA:
      return on_edge(a, contact.a, b);
    case ContactPoint::EdgeOfB:
      return on_edge(b, contact.b, a);
    case ContactPoint::Edges:
      break;
  }
  const std::size_t axis = axis_of(a);
  const LatticePoint p = a[contact.a], q = a[(contact.a + 1) % 3], from = b[contact.b], to = b[(contact.b + 1) % 3];
  return ExactPoint::between(p, q, area(from, to, p, axis), area(from, to, q, axis));
}

bool is_on_edge(const LatticeTriangle& t, std::size_t k, LatticePoint p) noexcept {
  const LatticePoint from = t[k], to = t[(k + 1) % 3];
  if (area(from, to, p, axis_of(t)) != 0) return false;
  for (std::size_t i = 0; i < 3; ++i)
    if (p[i] < std::min(from[i], to[i]) || p[i] > std::max(from[i], to[i])) return false;
  return true;
}

bool has_area(const LatticeTriangle& t) noexcept { return cross(widen(t[1] - t[0]), widen(t[2] - t[0])) != Long{}; }

}  // namespace relief::detail
