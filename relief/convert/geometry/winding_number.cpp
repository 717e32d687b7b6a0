#include <relief/convert/geometry/winding_number.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace relief::detail {
namespace {

constexpr std::uint32_t kLeaf = 8;
/// A node counts as a dipole from this many of its radii on.
constexpr double kFar = 2;

/// Solid angle of a triangle seen from the origin [Van Oosterom and Strackee 1983].
double solid_angle(Vec3d a, Vec3d b, Vec3d c) noexcept {
  const double la = length(a), lb = length(b), lc = length(c);
  return 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
}

double farthest_of(const Box3d& box, Vec3d p) noexcept {
  const Vec3d a = box.high - p, b = p - box.low;
  return length(Vec3d{std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)});
}

}  // namespace

WindingNumber::WindingNumber(std::span<const Vec3d> points, std::vector<Triangle> triangles)
    : points_(points), triangles_(std::move(triangles)) {
  if (triangles_.empty()) return;
  std::vector<Place> places;
  places.reserve(triangles_.size());
  for (const Triangle& t : triangles_) {
    const Vec3d at = points[t[0]] + points[t[1]] + points[t[2]];
    places.push_back({{float(at.x), float(at.y), float(at.z)}, t});
  }
  triangles_.clear();
  nodes_.reserve(places.size() / 2 + 1);
  split(places);
  for (auto id = static_cast<std::uint32_t>(nodes_.size()); id-- > 0;) sum(id);
}

void WindingNumber::split(std::span<Place> places) {
  const std::size_t id = nodes_.size();
  Node& node = nodes_.emplace_back();
  node.first = static_cast<std::uint32_t>(triangles_.size());
  node.last = node.first + static_cast<std::uint32_t>(places.size());
  if (node.is_large()) {
    node.box = static_cast<std::uint32_t>(boxes_.size());
    boxes_.emplace_back();
  }
  if (places.size() <= kLeaf) {
    for (const Place& place : places) triangles_.push_back(place.triangle);
    return;
  }
  std::array<float, 3> low = places[0].at, high = low;
  for (const Place& p : places)
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p.at[k]);
      high[k] = std::max(high[k], p.at[k]);
    }
  const std::array<float, 3> e = {high[0] - low[0], high[1] - low[1], high[2] - low[2]};
  const std::size_t axis = e[0] >= e[1] && e[0] >= e[2] ? 0 : e[1] >= e[2] ? 1 : 2;
  const std::size_t half = places.size() / 2;
  std::nth_element(places.begin(), places.begin() + std::ptrdiff_t(half), places.end(),
                   [axis](const Place& x, const Place& y) {
                     return x.at[axis] != y.at[axis] ? x.at[axis] < y.at[axis] : x.triangle < y.triangle;
                   });
  split(places.first(half));
  nodes_[id].right = static_cast<std::uint32_t>(nodes_.size());
  split(places.subspan(half));
}

Box3d WindingNumber::box_of(const Node& node) const noexcept {
  if (node.is_large()) return boxes_[node.box];
  Box3d box;
  for (std::uint32_t k = node.first; k < node.last; ++k)
    for (const std::uint32_t corner : triangles_[k]) box.add(points_[corner]);
  return box;
}

/// Returns what a node is, from its children or its triangles.
void WindingNumber::sum(std::uint32_t id) {
  Node& node = nodes_[id];
  if (node.right != 0) {
    const Node &x = nodes_[id + 1], &y = nodes_[node.right];
    node.moment = x.moment + y.moment;
    node.area = x.area + y.area;
    node.centre = node.area > 0 ? (x.centre * x.area + y.centre * y.area) / node.area : (x.centre + y.centre) / 2.0;
    if (node.is_large()) {
      Box3d& box = boxes_[node.box] = box_of(x);
      box.add(box_of(y));
      const auto reach = [&](const Node& child) { return length(child.centre - node.centre) + child.radius; };
      node.radius = std::min(std::max(reach(x), reach(y)), farthest_of(box, node.centre));
      return;
    }
  } else {
    Vec3d moments, centres, plain;
    double area = 0;
    for (std::uint32_t k = node.first; k < node.last; ++k) {
      const Triangle& t = triangles_[k];
      const Vec3d a = points_[t[0]], b = points_[t[1]], c = points_[t[2]];
      const Vec3d moment = cross(b - a, c - a) * 0.5, centre = (a + b + c) / 3.0;
      moments += moment;
      area += length(moment);
      centres += centre * length(moment);
      plain += centre;
    }
    node.moment = moments;
    node.area = area;
    node.centre = area > 0 ? centres / area : plain / double(node.last - node.first);
  }
  double most2 = 0;
  for (std::uint32_t k = node.first; k < node.last; ++k)
    for (const std::uint32_t corner : triangles_[k]) {
      const Vec3d d = points_[corner] - node.centre;
      most2 = std::max(most2, dot(d, d));
    }
  node.radius = std::sqrt(most2);
}

void WindingNumber::update(std::span<const std::uint8_t> moved) {
  const auto has_moved = [&](const Triangle& t) { return (moved[t[0]] | moved[t[1]] | moved[t[2]]) != 0; };
  std::vector<std::uint8_t> anew(nodes_.size(), 0);
  for (auto id = static_cast<std::uint32_t>(nodes_.size()); id-- > 0;) {
    const Node& node = nodes_[id];
    const auto first = triangles_.begin() + node.first, last = triangles_.begin() + node.last;
    anew[id] = node.right == 0 ? std::any_of(first, last, has_moved) : (anew[id + 1] | anew[node.right]) != 0;
    if (anew[id] != 0) sum(id);
  }
}

double WindingNumber::at(Vec3d p) const noexcept {
  if (nodes_.empty()) return 0;
  double sum = 0;
  std::array<std::uint32_t, 64> stack{};
  std::size_t depth = 1;
  while (depth > 0) {
    const std::uint32_t id = stack[--depth];
    const Node& node = nodes_[id];
    const Vec3d d = node.centre - p;
    const double distance = length(d);
    if (distance > kFar * node.radius) {
      sum += dot(node.moment, d) / (distance * distance * distance);
    } else if (node.right == 0) {
      for (std::uint32_t k = node.first; k < node.last; ++k) {
        const Triangle& t = triangles_[k];
        sum += solid_angle(points_[t[0]] - p, points_[t[1]] - p, points_[t[2]] - p);
      }
    } else {
      stack[depth++] = node.right;
      stack[depth++] = id + 1;
    }
  }
  return sum / (4 * std::numbers::pi);
}

}  // namespace relief::detail
