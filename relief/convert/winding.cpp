#include <relief/convert/winding.h>

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

}  // namespace

WindingNumber::WindingNumber(std::span<const Vec3d> points, std::vector<Triangle> triangles)
    : points_(points), triangles_(std::move(triangles)) {
  nodes_.reserve(triangles_.size() / 2 + 1);
  if (!triangles_.empty()) build(0, static_cast<std::uint32_t>(triangles_.size()));
}

std::uint32_t WindingNumber::build(std::uint32_t first, std::uint32_t last) {
  const auto centre_of = [&](const Triangle& t) { return (points_[t[0]] + points_[t[1]] + points_[t[2]]) / 3.0; };
  const auto id = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  Node node;
  node.first = first;
  node.last = last;
  Vec3d sum, plain;
  double area = 0;
  Box3d box;
  for (std::uint32_t k = first; k < last; ++k) {
    const Triangle& t = triangles_[k];
    const Vec3d a = points_[t[0]], twice = cross(points_[t[1]] - a, points_[t[2]] - a);
    const double size = length(twice) / 2;
    const Vec3d c = centre_of(t);
    node.moment += twice * 0.5;
    sum += c * size;
    plain += c;
    area += size;
    box.add(c);
  }
  node.centre = area > 0 ? sum / area : plain / double(last - first);
  for (std::uint32_t k = first; k < last; ++k)
    for (const std::uint32_t corner : triangles_[k])
      node.radius = std::max(node.radius, length(points_[corner] - node.centre));
  if (last - first > kLeaf) {
    const Vec3d e = box.extent();
    const std::size_t axis = e.x >= e.y && e.x >= e.z ? 0 : e.y >= e.z ? 1 : 2;
    const std::uint32_t middle = first + (last - first) / 2;
    std::nth_element(triangles_.begin() + first, triangles_.begin() + middle, triangles_.begin() + last,
                     [&](const Triangle& x, const Triangle& y) {
                       const double cx = centre_of(x)[axis], cy = centre_of(y)[axis];
                       return cx != cy ? cx < cy : x < y;
                     });
    build(first, middle);
    node.right = build(middle, last);
  }
  nodes_[id] = node;
  return id;
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
