#include <relief/base/disjoint_sets.h>
#include <relief/convert/shell/creases.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relief::detail {
namespace {

/// Cosine of the least angle between the normals of a crease: 30 degrees, more than curved surfaces of few triangles
/// have between neighbours, and less than any edge that is meant to be seen.
constexpr double kSharp = 0.866;
/// Lattice steps off the plane of a face up to which its neighbour continues it: rounding moves a corner by less than
/// one, and turns the plane.
constexpr double kFlat = 2;
/// Share of the area that has to go on in planes: solids that were constructed have creases, and in scans flat places
/// are chance.
constexpr double kFlatSolid = 0.5;
/// Lattice steps: so far off a crease a fibre on it may cross the source. Rounding its ends moves it by one at most,
/// and each of the moves that it makes once more.
constexpr double kOn = 32;
/// Sine of the angle up to which a crease runs along an edge of a slab.
constexpr double kAlong = 0.02;
/// Cosine of the angle up to which a crease goes on in the next: the rim of a cylinder of 16 sides does, a corner does
/// not.
constexpr double kGoesOn = 0.9;
/// Places at which an edge is held against the creases, evenly between its ends.
constexpr int kPlaces = 7;

Box3d box_of(const std::array<Vec3d, 2>& edge) noexcept {
  Box3d box;
  for (const Vec3d p : edge) box.add(p);
  return box;
}

Box3d box_around(Vec3d place, double far) noexcept {
  Box3d box;
  box.add(place - Vec3d{far, far, far});
  box.add(place + Vec3d{far, far, far});
  return box;
}

double distance_to(const std::array<Vec3d, 2>& edge, Vec3d place) noexcept {
  const Vec3d along = edge[1] - edge[0], from = place - edge[0];
  const double share = std::clamp(dot(from, along) / std::max(dot(along, along), 1.0), 0.0, 1.0);
  return length(from - along * share);
}

}  // namespace

Creases::Creases(const SourceIndex& source) {
  const std::vector<std::uint32_t> twins = find_twins(source.faces, source.points.size());
  const auto corner = [&](std::uint32_t h) { return to_double(source.points[source.faces[h / 3][h % 3]]); };
  // Whether the face across a half-edge continues the plane of its own.
  const auto is_flat = [&](std::uint32_t h) {
    return twins[h] != kNone && dot(source.normal(h / 3), source.normal(twins[h] / 3)) > kSharp &&
           std::abs(dot(source.normal(h / 3), corner(last_of(twins[h])) - corner(h))) <= kFlat;
  };
  const auto continues = [&](std::uint32_t f) { return is_flat(3 * f) || is_flat(3 * f + 1) || is_flat(3 * f + 2); };
  double all = 0, flat = 0;
  for (std::uint32_t f = 0; f < source.faces.size(); ++f) {
    if (!source.alive(f)) continue;
    const double area = length(source.cross_of(f));
    all += area;
    if (continues(f)) flat += area;
  }
  if (flat < kFlatSolid * all) return;
  std::vector<std::array<std::uint32_t, 2>> ends;
  for (std::uint32_t h = 0; h < twins.size(); ++h) {
    if (twins[h] == kNone || h > twins[h] || !source.alive(h / 3)) continue;
    if (dot(source.normal(h / 3), source.normal(twins[h] / 3)) > kSharp) continue;
    if (!continues(h / 3) && !continues(twins[h] / 3)) continue;
    edges_.push_back({corner(h), corner(next_of(h))});
    ends.push_back({source.faces[h / 3][h % 3], source.faces[h / 3][next_of(h) % 3]});
  }
  if (edges_.empty()) return;
  tree_.emplace(edges_.size(), [&](std::size_t k) { return box_of(edges_[k]); });
  join(ends);
}

void Creases::join(const std::vector<std::array<std::uint32_t, 2>>& ends) {
  struct End {
    std::uint32_t point, edge, side;
  };
  std::vector<End> all;
  for (std::uint32_t edge = 0; edge < ends.size(); ++edge)
    for (std::uint32_t side = 0; side < 2; ++side) all.push_back({ends[edge][side], edge, side});
  std::ranges::stable_sort(all, {}, &End::point);
  DisjointSets sets(edges_.size());
  const auto from = [&](const End& end) {
    return normalized(edges_[end.edge][1 - end.side] - edges_[end.edge][end.side]);
  };
  for (std::size_t k = 0; k < all.size();) {
    std::size_t next = k;
    while (next < all.size() && all[next].point == all[k].point) ++next;
    if (next - k == 2 && dot(from(all[k]), from(all[k + 1])) <= -kGoesOn)
      sets.join(all[k].edge, all[k + 1].edge);
    else
      corners_.push_back(edges_[all[k].edge][all[k].side]);
    k = next;
  }
  for (std::uint32_t edge = 0; edge < edges_.size(); ++edge) chains_.push_back(sets.least(edge));
  if (corners_.empty()) return;
  corner_tree_.emplace(corners_.size(), [&](std::size_t k) { return box_around(corners_[k], 0); });
}

template <typename Visit>
void Creases::for_near(Vec3d place, Visit&& visit) const {
  if (!tree_) return;
  tree_->query(box_around(place, kOn),
               [&](std::uint32_t k) { return distance_to(edges_[k], place) > kOn || visit(k); });
}

bool Creases::find(Vec3d place, std::optional<Vec3d> along) const {
  bool found = false;
  for_near(place, [&](std::uint32_t k) {
    found = !along || length(cross(normalized(edges_[k][1] - edges_[k][0]), *along)) <= kAlong;
    return !found;
  });
  return found;
}

bool Creases::hold_corner(Vec3d place) const {
  if (!corner_tree_) return false;
  bool found = false;
  corner_tree_->query(box_around(place, kOn), [&](std::uint32_t k) {
    found = length(corners_[k] - place) <= kOn;
    return !found;
  });
  return found;
}

bool Creases::allow(Vec3d from, Vec3d to) const {
  if (from == to || !hold(from)) return true;
  if (hold_corner(from)) return false;
  std::vector<std::uint32_t> left;
  for_near(from, [&](std::uint32_t k) {
    left.push_back(chains_[k]);
    return true;
  });
  bool stays = false;
  for_near(to, [&](std::uint32_t k) {
    stays = std::ranges::find(left, chains_[k]) != left.end();
    return !stays;
  });
  return stays;
}

bool Creases::hold_edge(Vec3d from, Vec3d to) const {
  const Vec3d way = to - from, along = normalized(way);
  for (int k = 0; k <= kPlaces + 1; ++k)
    if (!find(from + way * (double(k) / (kPlaces + 1)), along)) return false;
  return true;
}

}  // namespace relief::detail
