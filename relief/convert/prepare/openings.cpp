#include <relief/convert/geometry/components.h>
#include <relief/convert/prepare/defects.h>
#include <relief/convert/prepare/openings.h>
#include <relief/convert/support/sort_unique.h>

#include <algorithm>
#include <array>
#include <utility>

namespace relief::detail {
namespace {

using Loops = std::vector<std::vector<std::uint32_t>>;

ClosedOpenings close_openings(const TriangleMesh& mesh, const Loops& loops, const std::vector<Closing>& closings,
                              double room) {
  ClosedOpenings closed;
  ClosedSource& source = closed.source;
  std::vector<Vec3d> points = mesh.positions;
  source.faces = mesh.triangles;
  closed.patches = fill_holes(points, source.faces, loops, closings);
  Box3d box;
  for (const Vec3d p : points) box.add(p);
  closed.lattice = Lattice::around(box, room);
  source.points.reserve(points.size());
  for (const Vec3d p : points) source.points.push_back(snap(closed.lattice.to_lattice(p)));
  source.phantom.assign(mesh.triangles.size(), 0);
  source.phantom.resize(source.faces.size(), 1);
  source.patch = source.phantom;
  return closed;
}

/// Returns how many faces of what closes openings so intersect others.
std::size_t intersections_of(const TriangleMesh& mesh, const Loops& loops, const std::vector<Closing>& closings,
                             double room, const Progress& progress) {
  return count_patch_intersections(close_openings(mesh, loops, closings, room).source, progress);
}

std::vector<Closing> choose_closings(const TriangleMesh& mesh, const Loops& loops) {
  // A flat patch so large, share of the component's area, lies close behind nearly all of it.
  constexpr double kLarge = 0.55;
  // Of a flat loop at least so much of the area around its centre looks one way.
  constexpr double kFlat = 0.5;
  constexpr std::size_t kMostBoxes = 64;  // each takes as long as all points of the source
  if (loops.empty()) return {};
  const Components components = find_components(mesh.positions.size(), mesh.triangles);
  std::vector<std::uint32_t> component_of(mesh.positions.size(), 0);
  std::vector<double> areas(components.count, 0);  // twice
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const Face& t = mesh.triangles[f];
    const Vec3d a = mesh.positions[t[0]];
    areas[components.of_face[f]] += length(cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a));
    for (const std::uint32_t v : t) component_of[v] = components.of_face[f];
  }
  std::vector<Closing> closings;
  std::size_t boxes = 0;
  for (const auto& loop : loops) {
    Vec3d centre, sum;
    for (const std::uint32_t v : loop) centre += mesh.positions[v] / double(loop.size());
    double area = 0;  // twice
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const Vec3d n = cross(mesh.positions[loop[k]] - centre, mesh.positions[loop[(k + 1) % loop.size()]] - centre);
      sum += n;
      area += length(n);
    }
    const bool large = length(sum) > kFlat * area && area > kLarge * areas[component_of[loop.front()]];
    boxes += large;
    closings.push_back(large && boxes <= kMostBoxes ? Closing::Box : Closing::Patch);
  }
  return closings;
}

/// Returns the loops whose closings have some of these faces, ascending.
std::vector<std::size_t> loops_with(const std::vector<std::size_t>& patches, std::span<const std::uint32_t> faces) {
  std::vector<std::size_t> loops;
  for (const std::uint32_t f : faces) {
    if (f < patches.front() || f >= patches.back()) continue;
    const auto next = std::upper_bound(patches.begin(), patches.end(), std::size_t{f});
    loops.push_back(static_cast<std::size_t>(next - patches.begin()) - 1);
  }
  sort_unique(loops);
  return loops;
}

}  // namespace

std::size_t count_openings(const std::vector<std::size_t>& patches, std::span<const std::uint32_t> faces) {
  return loops_with(patches, faces).size();
}

Openings::Openings(const TriangleMesh& mesh)
    : loops_(find_boundary_loops(mesh.positions.size(), mesh.triangles)), closings_(choose_closings(mesh, loops_)) {}

ClosedOpenings Openings::close(const TriangleMesh& mesh, double room) const {
  return close_openings(mesh, loops_, closings_, room);
}

bool Openings::change(const TriangleMesh& mesh, const std::vector<std::size_t>& patches,
                      std::span<const std::uint32_t> bad_faces, double room, const Progress& progress) {
  const std::vector<std::size_t> bad = loops_with(patches, bad_faces);
  if (!std::exchange(boxes_tried_, true) && try_boxes(mesh, bad, room, progress)) return true;
  return try_offset_copies(mesh, bad, room, progress);
}

/// Boxes for the longest four loops one by one, for the others together, each time where no more faces meet then: a box
/// that would run through the surface does not help.
bool Openings::try_boxes(const TriangleMesh& mesh, std::span<const std::size_t> bad, double room,
                         const Progress& progress) {
  constexpr std::size_t kOneByOne = 4;  // each try costs about as much as closing all
  std::vector<std::size_t> tried(bad.begin(), bad.end());
  std::erase_if(tried, [&](std::size_t loop) { return closings_[loop].kind != Closing::Patch; });
  std::stable_sort(tried.begin(), tried.end(), [&](auto a, auto b) { return loops_[a].size() > loops_[b].size(); });
  if (tried.empty()) return false;
  bool any = false;
  std::size_t fewest = intersections_of(mesh, loops_, closings_, room, progress);
  for (std::span<const std::size_t> left = tried; !left.empty() && !progress.cancelled();) {
    const bool one = tried.size() - left.size() < kOneByOne;
    const auto now = left.first(one ? 1 : left.size());
    left = left.subspan(now.size());
    for (const std::size_t loop : now) closings_[loop] = Closing::Box;
    const std::size_t count = intersections_of(mesh, loops_, closings_, room, progress);
    if (count <= fewest) {
      fewest = count;
      any = true;
    } else {
      for (const std::size_t loop : now) closings_[loop] = Closing::Patch;
    }
  }
  return any && !progress.cancelled();
}

/// Offset copies in the place of boxes, if so much as one depth makes no faces meet; these loops come last then, for a
/// copy has what closes the other loops of its component, too.
bool Openings::try_offset_copies(const TriangleMesh& mesh, std::span<const std::size_t> bad, double room,
                                 const Progress& progress) {
  // Of the diagonal of the loop's box: from a plate that is easy to hold to one as thin as the usual error.
  constexpr std::array<double, 4> kDepths = {0.02, 0.005, 0.00125, 0.0003};
  Loops ordered, last;
  std::vector<Closing> ordered_closings;
  for (std::size_t l = 0; l < loops_.size(); ++l) {
    if (closings_[l].kind == Closing::Box && std::ranges::binary_search(bad, l)) {
      last.push_back(loops_[l]);
    } else {
      ordered.push_back(loops_[l]);
      ordered_closings.push_back(closings_[l]);
    }
  }
  if (last.empty()) return false;
  ordered.insert(ordered.end(), last.begin(), last.end());
  for (const double share : kDepths) {
    std::vector<Closing> now = ordered_closings;
    for (const auto& loop : last) {
      Box3d box;
      for (const std::uint32_t v : loop) box.add(mesh.positions[v]);
      const Vec3d e = box.extent();
      now.emplace_back(Closing::OffsetCopy, share * std::hypot(e.x, e.y, e.z));
    }
    const std::size_t count = intersections_of(mesh, ordered, now, room, progress);
    if (progress.cancelled()) return false;
    if (count > 0) continue;
    loops_ = std::move(ordered);
    closings_ = std::move(now);
    return true;
  }
  return false;
}

}  // namespace relief::detail
