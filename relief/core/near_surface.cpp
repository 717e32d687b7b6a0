#include <relief/core/near_surface.h>

namespace relief {

namespace {
constexpr int kSlabWork = 4;  // what it takes to enter a slab, in the time of a sample
}  // namespace

double detail::clear_around(MicroTriangles& surface, Vec3d point, double enough, double reach, SlabId& nearest,
                            int work) noexcept {
  const int most = surface.placed() + work;
  const SlabId first = nearest;
  const auto is_near = [&](const Box3d& box) { return box.distance2(point) < reach * reach; };
  const auto search = [&](SlabId s) {
    const double before = reach;
    surface.enter(s);
    surface.add_placed(kSlabWork);
    NearSlab(surface, s, point, 0).keep_clear(reach, enough, most);
    if (reach < before) nearest = s;
    return reach <= enough;
  };
  const bool known = first < surface.mesh().slab_count() && is_near(surface.mesh().box(first));
  if (!(known && search(first)))
    surface.mesh().visit_tree(is_near, [&](SlabId s) { return !(known && s == first) && search(s); });
  return reach * (1 - 1e-9);
}

}  // namespace relief
