#include <relief/core/micro_triangles.h>
#include <relief/haptics/contact/principle.h>
#include <relief/haptics/contact/walk.h>
#include <relief/haptics/foothold.h>

#include <algorithm>
#include <cmath>

namespace relief::detail {

namespace {

constexpr double kSpacings = 2;  // of the samples: what is farther away is another part of the surface
// What it takes, in the time of a sample that is placed, about 25 ns.
constexpr int kDescent = 4, kLocate = 40, kNearest = 120;

/// Returns the place at coordinates that come from another grid: what was on an edge or a sample is there to the bit
/// again.
std::optional<SurfacePlace> place_at(MicroTriangles& surface, const SlabCoord& at) noexcept {
  auto place = surface.place_at(at.slab, at.u, at.v);
  if (!place) return place;
  place->weights = on_edges(place->weights);
  place->position = place->triangle.point(place->weights);
  return place;
}

}  // namespace

void Foothold::stand_in(const SlabMesh& mesh, SlabId slab) noexcept {
  if (origin_.slab == slab && is_in(mesh)) return;
  origin_ = SlabOrigin(mesh, slab);
  intervals_ = mesh.intervals(slab);
  const SlabCorners corners = mesh.corners(slab);
  double longest2 = 0;
  for (std::size_t k = 0; k < 3; ++k)
    longest2 = std::max({longest2, distance2(corners.inner[k], corners.inner[(k + 1) % 3]),
                         distance2(corners.outer[k], corners.outer[(k + 1) % 3])});
  spacing_ = std::sqrt(longest2) / intervals_;
}

std::optional<SurfacePlace> Foothold::find(MicroTriangles& surface, const SlabCoord& at,
                                           Vec3d position) const noexcept {
  surface.add_placed(kDescent);
  if (const auto there = heir(origin_, surface.mesh(), at))
    if (const auto place = place_at(surface, *there)) return place;
  return find_near(surface, at, position);
}

std::optional<SurfacePlace> Foothold::find_near(MicroTriangles& surface, const SlabCoord& at,
                                                Vec3d position) const noexcept {
  surface.add_placed(kLocate);
  LocateHint by_number{.last = at};  // where fibres have moved slabs keep their numbers
  const auto there = locate(surface.mesh(), position, by_number);
  auto along = there ? place_at(surface, *there) : std::nullopt;
  const double near = kSpacings * spacing_;
  if (along && distance2(along->position, position) <= near * near) {
    // A place of a micro-triangle is not quite on the fibre that its weights tell.
    int tries = kTries;
    walk(surface, *along, position, near, tries);
    return along;
  }
  surface.add_placed(kNearest);
  PickHint hint;
  if (there) hint = {there->slab, there->u, there->v};
  const SurfacePoint nearest = closest_point(surface.model(), position, hint, near);
  if (nearest.slab != kNoSlab)
    if (const auto place = place_at(surface, {nearest.slab, nearest.u, nearest.v, nearest.alpha})) return place;
  return along;
}

}  // namespace relief::detail
