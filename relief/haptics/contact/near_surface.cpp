#include <relief/haptics/contact/near_surface.h>

namespace relief {

namespace {
// In the time of a sample that is placed: what it takes to enter a slab, and how many boxes are asked about.
constexpr int kSlabWork = 8, kBoxes = 4;
}  // namespace

double detail::clear_around(MicroTriangles& surface, Vec3d point, double enough, double reach, SlabId& nearest,
                            int work) noexcept {
  const int most = surface.placed() + work;
  const SlabId first = nearest;
  int boxes = 0;
  double reach2 = reach * reach;
  const auto distance2 = [&](const Box3d& box) noexcept {
    ++boxes;
    return box.distance2(point);
  };
  const auto search = [&](SlabId s) noexcept {
    const double before = reach;
    surface.enter(s);
    surface.add_placed(kSlabWork);
    NearSlab(surface, s, point, 0).keep_clear(reach, enough, most);
    if (reach < before) {
      nearest = s;
      reach2 = reach * reach;
    }
    return reach <= enough;
  };
  const bool known = first < surface.mesh().slab_count() && distance2(surface.mesh().box(first)) < reach2;
  if (!(known && search(first)))
    surface.mesh().visit_nearest(distance2, reach2, [&](SlabId s) { return !(known && s == first) && search(s); });
  surface.add_placed(boxes / kBoxes);
  return reach * (1 - 1e-9);
}

}  // namespace relief
