#include "exact_lines.h"

#include <relief/base/triangle.h>
#include <relief/core/query.h>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <cmath>

namespace relief::testing {

namespace {

using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;

Point exact(Vec3d p) { return {p.x, p.y, p.z}; }

struct Wide {
  long double x, y, z;
  explicit Wide(Vec3d p) : x(p.x), y(p.y), z(p.z) {}
  Wide(long double a, long double b, long double c) : x(a), y(b), z(c) {}
};
Wide operator-(Wide a, Wide b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
long double dot(Wide a, Wide b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Wide cross(Wide a, Wide b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

}  // namespace

ExactTriangles::ExactTriangles(const Snapshot& model) {
  const SlabMesh& mesh = model.slab_mesh();
  for (SlabId slab = 0; slab < mesh.slab_count(); ++slab)
    for_each_cell(mesh.intervals(slab), mesh.edge_intervals(slab), [&](const std::array<GridPoint, 3>& cell) {
      if (model.is_hole(slab, cell)) return;
      triangles_.push_back({sample_position(model, slab, cell[0]), sample_position(model, slab, cell[1]),
                            sample_position(model, slab, cell[2])});
    });
  constexpr std::size_t kTogether = 32;
  for (std::size_t first = 0; first < triangles_.size(); first += kTogether) {
    Group group{.centre = {}, .radius = 0, .first = first, .last = std::min(triangles_.size(), first + kTogether)};
    Box3d box;
    for (std::size_t k = group.first; k < group.last; ++k)
      for (const Vec3d p : triangles_[k]) box.add(p);
    group.centre = box.centre();
    group.radius = 0.51 * length(box.extent());
    groups_.push_back(group);
  }
}

template <typename Visit>
void ExactTriangles::each_near(Vec3d from, Vec3d way, double hair, Visit&& visit) const {
  const Vec3d along = normalized(way);
  const auto off2 = [&](Vec3d p) {
    const Vec3d to = p - from, aside = to - along * relief::dot(to, along);
    return relief::dot(aside, aside);
  };
  for (const Group& group : groups_) {
    const double reach = group.radius + hair;
    if (off2(group.centre) > reach * reach) continue;
    for (std::size_t k = group.first; k < group.last; ++k) {
      const Corners& t = triangles_[k];
      const double side = std::max({length(t[1] - t[0]), length(t[2] - t[1]), length(t[0] - t[2])}) + hair;
      if (off2(t[0]) <= side * side) visit(t);
    }
  }
}

std::vector<ExactTriangles::Meeting> ExactTriangles::meetings(Vec3d from, Vec3d to, double hair) const {
  std::vector<Meeting> all;
  const Point begin = exact(from), end = exact(to);
  each_near(from, to - from, hair, [&](const Corners& t) {
    const Point a = exact(t[0]), b = exact(t[1]), c = exact(t[2]);
    const int ab = CGAL::orientation(begin, end, a, b), bc = CGAL::orientation(begin, end, b, c),
              ca = CGAL::orientation(begin, end, c, a);
    const bool left = ab >= 0 && bc >= 0 && ca >= 0, right = ab <= 0 && bc <= 0 && ca <= 0;
    if (left == right) return;  // beside it, or all in one plane
    const Wide p(t[0]), normal = cross(Wide(t[1]) - p, Wide(t[2]) - p), start(from), way = Wide(to) - start;
    const auto share = static_cast<double>(dot(normal, p - start) / dot(normal, way));
    if (!(share >= 0 && share <= 1)) return;
    const bool in = dot(normal, way) < 0;
    all.push_back({share, in ? 1 : 0, in ? 0 : 1});
  });
  std::ranges::sort(all, {}, &Meeting::share);
  std::vector<Meeting> joined;
  for (const Meeting& one : all) {
    if (joined.empty() || (one.share - joined.back().share) * length(to - from) > hair) {
      joined.push_back(one);
    } else {
      joined.back().in += one.in;
      joined.back().out += one.out;
    }
  }
  return joined;
}

bool ExactTriangles::is_outline(Vec3d place, Vec3d way, double hair) const {
  bool in = false, out = false, on_edge = false;
  each_near(place, way, hair, [&](const Corners& t) {
    const auto w = nearest_in_triangle(place, t[0], t[1], t[2]);
    if (length(t[0] * w[0] + t[1] * w[1] + t[2] * w[2] - place) > hair) return;
    const Vec3d normal = normalized(relief::cross(t[1] - t[0], t[2] - t[0]));
    const double faces = relief::dot(normal, normalized(way));
    (faces < 0 ? in : out) = true;
    on_edge = on_edge || std::abs(faces) < 1e-6;
  });
  return (in && out) || on_edge;
}

}  // namespace relief::testing
