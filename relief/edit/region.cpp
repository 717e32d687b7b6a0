#include <relief/edit/region.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace relief::detail {

namespace {

double distance2(Vec3d p, Vec3d a, Vec3d b) noexcept {
  const Vec3d ab = b - a;
  const double square = dot(ab, ab);
  const double t = square > 0 ? std::clamp(dot(p - a, ab) / square, 0.0, 1.0) : 0.0;
  const Vec3d gap = a + ab * t - p;
  return dot(gap, gap);
}

/// False only when no point of the slab up to `highest` along its fibres lies in the sphere: that part of it is within
/// the convex hull of its six corners.
bool may_meet(const SlabCorners& corners, double highest, const Sphere& sphere) noexcept {
  std::array<Vec3d, 6> from;  // the sphere's centre: the inner corners, then the outer ones
  for (std::size_t k = 0; k < 3; ++k) {
    from[k] = corners.inner[k] - sphere.centre;
    from[k + 3] = corners.outer[k] - sphere.centre;
  }
  const auto middle = [&] { return from[0] + from[1] + from[2] + from[3] + from[4] + from[5]; };
  const auto is_beyond = [&](double along, Vec3d way) {
    return along > 0 && along * along > sphere.radius * sphere.radius * dot(way, way);
  };
  /// On either side of the sphere.
  const auto apart_along = [&](Vec3d way) {
    double least = Box3d::kFar, most = -Box3d::kFar;
    for (const Vec3d corner : from) {
      least = std::min(least, dot(corner, way));
      most = std::max(most, dot(corner, way));
    }
    return is_beyond(least, way) || is_beyond(-most, way);
  };
  const Vec3d whole = middle();
  for (std::size_t k = 0; k < 3; ++k) from[k + 3] = from[k] + corners.fibre(k) * highest;
  if (apart_along(whole) || apart_along(middle())) return false;
  // A slab that was cut is far longer than wide: across its fibres, and its walls, it may still lie apart.
  const Vec3d along = from[3] + from[4] + from[5] - (from[0] + from[1] + from[2]);
  const double length2 = dot(along, along);
  if (!(length2 > 0)) return true;
  if (apart_along(middle() - along * (dot(middle(), along) / length2))) return false;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t a = (k + 1) % 3, b = (k + 2) % 3;
    if (apart_along(cross(along, (from[b] - from[a]) + (from[b + 3] - from[a + 3])))) return false;
  }
  return true;
}

bool wall_may_meet(const Fibre& a, const Fibre& b, const Sphere& sphere) noexcept {
  Box3d box;
  for (const Vec3d p : {a.inner, a.outer, b.inner, b.outer}) box.add(p);
  return box.distance2(sphere.centre) <= sphere.radius * sphere.radius;
}

bool faces(const SlabCorners& corners, Vec3d normal) noexcept {
  int sides = 0;
  for (std::size_t k = 0; k < 3; ++k) sides += dot(corners.fibre(k), normal) > 0 ? 1 : -1;
  if (std::abs(sides) == 3) return sides > 0;
  Vec3d mean;
  for (std::size_t k = 0; k < 3; ++k) mean += normalized(corners.outer[k] - corners.inner[k]);
  return dot(mean, normal) > 0;
}

}  // namespace

bool may_reach(const SlabCorners& corners, double highest, const Sphere& sphere, Vec3d normal) noexcept {
  return faces(corners, normal) && may_meet(corners, highest, sphere);
}

void Region::take(const SlabMesh& mesh) {
  seen_slabs_.resize(mesh.slab_count());
  seen_fibres_.resize(mesh.fibres().size());
}

std::span<const SlabId> Region::grow(const SlabMesh& mesh, SlabId seed, const Sphere& sphere, Vec3d normal,
                                     const std::function<Extent(SlabId)>& extent) {
  if (++round_ == 0) {
    // After 2^32 rounds the old numbers would look new.
    std::ranges::fill(seen_slabs_, 0U);
    std::ranges::fill(seen_fibres_, 0U);
    round_ = 1;
  }
  reached_.clear();
  // Of the slab that growth goes on from.
  Sphere around = sphere;
  const auto visit = [&](SlabId s) {
    if (seen_slabs_[s] == round_) return;
    seen_slabs_[s] = round_;
    if (s != seed) {
      const Extent own = extent(s);
      const Sphere reach = {sphere.centre, sphere.radius + own.beside};
      if (mesh.box(s).distance2(reach.centre) > reach.radius * reach.radius) return;
      if (!may_reach(mesh.corners(s), own.highest, reach, normal)) return;
    }
    reached_.push_back(s);
  };
  // The sphere may lie beyond the seed altogether, when the normal leans against the fibres: its neighbours always
  // count.
  const auto visit_at = [&](FibreId f, bool first) {
    if (seen_fibres_[f] == round_) return;
    seen_fibres_[f] = round_;
    if (first ||
        distance2(around.centre, mesh.fibres()[f].inner, mesh.fibres()[f].outer) <= around.radius * around.radius)
      mesh.for_each_at(f, visit);
  };
  visit(seed);
  for (std::size_t next = 0; next < reached_.size(); ++next) {
    const SlabId s = reached_[next];
    const Slab& slab = mesh.slabs()[s];
    const bool first = next == 0;
    around.radius = sphere.radius + extent(s).beside;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto edge = static_cast<int>(k);
      const Fibre &from = mesh.fibres()[slab.fibres[(k + 1) % 3]], &to = mesh.fibres()[slab.fibres[(k + 2) % 3]];
      const auto seen = [&](SlabId across) { return across == kNoSlab || seen_slabs_[across] == round_; };
      const bool halves = slab.shares[k] == EdgeShare::Halves;
      if ((halves || !seen(slab.neighbours[k])) && (first || wall_may_meet(from, to, around)))
        mesh.for_each_across(s, edge, visit);
      if (halves) visit_at(mesh.hanging(s, edge).middle, first);
      visit_at(slab.fibres[k], first);
    }
  }
  std::ranges::sort(reached_);
  return reached_;
}

}  // namespace relief::detail
