#include <relief/base/triangle.h>
#include <relief/convert/geometry/half_edges.h>
#include <relief/convert/remesh/source_skin.h>

#include <algorithm>
#include <cmath>

namespace relief::detail {
namespace {

constexpr double kBeside = 0.01;  // voxels: less than parts two skins that count as two, more than rounding

Box3d box_of(const std::vector<Vec3d>& points) {
  Box3d box;
  for (const Vec3d p : points) box.add(p);
  return box;
}

bool has_no_boundary(const std::vector<Vec3d>& points, const std::vector<Triangle>& triangles) {
  const std::vector<std::uint32_t> twins = find_twins(triangles, points.size());
  return std::ranges::find(twins, kNone) == twins.end();
}

}  // namespace

Skin::Skin(std::vector<Vec3d> points, std::vector<Triangle> triangles)
    : points_(std::move(points)),
      triangles_(std::move(triangles)),
      lattice_(Lattice::around(box_of(points_), 0)),
      winding_(points_, triangles_),
      surface_(points_, triangles_, lattice_),
      is_closed_(has_no_boundary(points_, triangles_)) {}

bool Skin::is_outer(Vec3d at, Vec3d outwards) const noexcept {
  return is_inside(at - outwards * kBeside) && !is_inside(at + outwards * kBeside);
}

bool Skin::is_decided(Vec3d at, Vec3d outwards) const noexcept {
  const auto is_clear = [&](Vec3d p) { return std::abs(winding(p) - WindingNumber::kInside) > WindingNumber::kError; };
  return is_clear(at - outwards * kBeside) && is_clear(at + outwards * kBeside);
}

Vec3d Skin::normal(std::uint32_t triangle) const noexcept {
  const auto& [a, b, c] = triangles_[triangle];
  return normalized(cross(points_[b] - points_[a], points_[c] - points_[a]));
}

double Skin::area(std::uint32_t triangle) const noexcept {
  const auto& [a, b, c] = triangles_[triangle];
  return length(cross(points_[b] - points_[a], points_[c] - points_[a])) / 2;
}

Skin::Place Skin::nearest(Vec3d p) const { return nearest_of(surface_.nearest(lattice_.to_lattice(p)).triangle, p); }

Skin::Place Skin::nearest_of(std::uint32_t triangle, Vec3d p) const noexcept {
  const auto& [a, b, c] = triangles_[triangle];
  const auto [wa, wb, wc] = nearest_in_triangle(p, points_[a], points_[b], points_[c]);
  const Vec3d at = points_[a] * wa + points_[b] * wb + points_[c] * wc;
  return {at, normal(triangle), length(p - at), triangle};
}

double Skin::way_out(Vec3d p, Vec3d direction, double reach) const {
  Crossings found;
  surface_.cross(lattice_.to_lattice(p), direction, 0, reach / lattice_.step, found);
  for (const Crossing& crossing : found.all())
    if (crossing.front) return crossing.t * lattice_.step;
  return reach;
}

}  // namespace relief::detail
