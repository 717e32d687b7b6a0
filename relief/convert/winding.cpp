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
  build(places);
}

WindingNumber::Built WindingNumber::build(std::span<Place> places) {
  constexpr std::size_t kExact = 256;  // triangles: of so many at most, the radius is the least one
  Built built{.id = static_cast<std::uint32_t>(nodes_.size()), .area = 0, .box = {}};
  nodes_.emplace_back();
  Node node;
  node.first = static_cast<std::uint32_t>(triangles_.size());
  node.last = node.first + static_cast<std::uint32_t>(places.size());
  if (places.size() > kLeaf) {
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
    const Built left = build(places.first(half)), right = build(places.subspan(half));
    node.right = right.id;
    const Node &x = nodes_[left.id], &y = nodes_[right.id];
    node.moment = x.moment + y.moment;
    built.area = left.area + right.area;
    node.centre =
        built.area > 0 ? (x.centre * left.area + y.centre * right.area) / built.area : (x.centre + y.centre) / 2.0;
    built.box = left.box;
    built.box.add(right.box);
    const auto reach = [&](const Node& child) { return length(child.centre - node.centre) + child.radius; };
    node.radius = std::min(std::max(reach(x), reach(y)), farthest_of(built.box, node.centre));
  } else {
    Vec3d sum, plain;
    for (const Place& place : places) {
      const Triangle& t = triangles_.emplace_back(place.triangle);
      const Vec3d a = points_[t[0]], b = points_[t[1]], c = points_[t[2]];
      const Vec3d moment = cross(b - a, c - a) * 0.5, centre = (a + b + c) / 3.0;
      const double area = length(moment);
      node.moment += moment;
      built.area += area;
      sum += centre * area;
      plain += centre;
      for (const Vec3d p : {a, b, c}) built.box.add(p);
    }
    node.centre = built.area > 0 ? sum / built.area : plain / double(places.size());
  }
  if (places.size() <= kExact) {
    double most2 = 0;
    for (std::uint32_t k = node.first; k < node.last; ++k)
      for (const std::uint32_t corner : triangles_[k]) {
        const Vec3d d = points_[corner] - node.centre;
        most2 = std::max(most2, dot(d, d));
      }
    node.radius = std::sqrt(most2);
  }
  nodes_[built.id] = node;
  return built;
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
