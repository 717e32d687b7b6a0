#include <relief/core/near_surface.h>

#include <span>

namespace relief {

namespace {
// In the time of a sample that is placed: what it takes to enter a slab, and how many boxes are asked about.
constexpr int kSlabWork = 8, kBoxes = 4;
// Likewise, beyond what samples may take, after which the boxes of the tree bound the distance: many are equally near.
constexpr int kMostSearched = 600;

// What rounding may do to a distance: of the distance, and of the model's largest coordinate.
constexpr double kOfDistance = 1e-10, kOfCoordinates = 1e-13;

/// The nearest place to a point. What is found does not depend on the order of the search: of places that are equally
/// near to the bit it is that of the lowest slab and, in it, of the first triangle.
class Nearest {
 public:
  Nearest(MicroTriangles& surface, Vec3d point, double within) noexcept
      : surface_(surface), point_(point), best2_(within * within) {
    const Box3d& all = surface.mesh().bounds();
    double most = 0;
    for (std::size_t k = 0; k < 3; ++k) most = std::max({most, std::abs(all.low[k]), std::abs(all.high[k])});
    hair_ = kOfCoordinates * most;
    lower_reach(best2_);
  }

  /// `hint`: a place that may be near, of whatever model.
  void run(const PickHint& hint) noexcept {
    const SlabId first = hint.slab;
    const bool known = first < surface_.mesh().slab_count();
    if (known) {
      lower_reach_to(first, hint.u, hint.v);
      // On the point's own fibre, where that is found: as near as can be where the point is on the surface.
      SlabCoord at = {first, hint.u, hint.v, 0.5};
      if (detail::solve({surface_.corners(), point_}, {}, at)) lower_reach_to(first, at.u, at.v);
      search(first);
    }
    const auto look_in = [&](SlabId slab) noexcept {
      if (known && slab == first) return false;
      const Box3d box = detail::surface_box(surface_.model(), slab);
      if (box.distance2(point_) <= reach2_) search(slab);
      return false;
    };
    const SlabMesh& mesh = surface_.mesh();
    const auto far2 = [&](const Box3d& box) noexcept { return box.distance2(point_); };
    // Where no more than the slabs around may be near, it costs more to put them in order than to look at them.
    if (known && reach2_ <= width2(first))
      mesh.visit_tree([&](const Box3d& box) noexcept { return far2(box) <= reach2_; }, look_in);
    else
      mesh.visit_nearest(far2, reach2_, look_in);
  }
  /// Its slab is kNoSlab where there is none.
  [[nodiscard]] const SurfacePlace& found() const noexcept { return found_; }

 private:
  [[nodiscard]] double distance2(Vec3d place) const noexcept { return dot(point_ - place, point_ - place); }
  void lower_reach(double distance2) noexcept {
    const double reach = std::sqrt(distance2) * (1 + kOfDistance) + hair_;
    reach2_ = std::min(reach2_, reach * reach);
  }
  /// To what is as far as the surface at a place of a slab, or at the nearest to it.
  void lower_reach_to(SlabId slab, double u, double v) noexcept {
    const auto place = surface_.place_at(slab, u, v);
    if (!place) return;
    const auto& [a, b, c] = place->triangle.positions;
    lower_reach(distance2(place->triangle.point(nearest_in_triangle(point_, a, b, c))));
  }
  /// The square of about a slab's width.
  [[nodiscard]] double width2(SlabId slab) const noexcept {
    const SlabCorners corners = surface_.mesh().corners(slab);
    const Vec3d edge = corners.inner[1] - corners.inner[0];
    return dot(edge, edge);
  }
  void search(SlabId slab) noexcept {
    surface_.enter(slab);
    detail::NearSlab(surface_, slab, point_, 0).nearest_first(reach2_, [&](const auto& corners, const auto& places) {
      if (may_be_near(places)) look_at({slab, corners, {}});
    });
  }
  /// `places`: relative to the point.
  [[nodiscard]] bool may_be_near(const std::array<Vec3d, 3>& places) const noexcept {
    const auto& [a, b, c] = places;
    const Vec3d middle = (a + b + c) * (1.0 / 3);
    const double round2 =
        std::max({dot(a - middle, a - middle), dot(b - middle, b - middle), dot(c - middle, c - middle)});
    const double over = dot(middle, middle) - round2 - reach2_;
    if (over > 0 && over * over > 4 * round2 * reach2_) return false;
    const auto w = nearest_in_triangle({}, a, b, c);
    const Vec3d nearest = a * w[0] + b * w[1] + c * w[2];
    return dot(nearest, nearest) <= reach2_;
  }
  void look_at(MicroTriangle triangle) noexcept {
    surface_.measure(triangle);
    const auto& [a, b, c] = triangle.positions;
    const std::array<double, 3> weights = nearest_in_triangle(point_, a, b, c);
    const Vec3d position = triangle.point(weights);
    const double there2 = distance2(position);
    const bool tie = there2 == best2_ && found_.triangle.slab != kNoSlab;
    if (!(there2 < best2_ || (tie && triangle.comes_before(found_.triangle)))) return;
    best2_ = there2;
    found_ = {triangle, weights, position};
    lower_reach(best2_);
  }

  MicroTriangles& surface_;
  Vec3d point_;
  double best2_;
  double hair_ = 0;                                          ///< what rounding may do to any distance
  double reach2_ = std::numeric_limits<double>::infinity();  ///< no less than the squared distance of the nearest place
  SurfacePlace found_;
};

}  // namespace

SurfacePoint closest_point(const Snapshot& model, Vec3d p, PickHint& hint, double within) noexcept {
  if (!is_finite(p)) return {};
  if (hint.slab >= model.slab_mesh().slab_count()) {
    LocateHint nothing;
    if (const auto at = locate(model.slab_mesh(), p, nothing)) hint = {at->slab, at->u, at->v, hint.normals};
  }
  MicroTriangles surface(model);
  Nearest nearest(surface, p, within);
  nearest.run(hint);
  if (nearest.found().triangle.slab == kNoSlab) return {};
  const SurfacePoint point = point_of(surface, nearest.found(), hint.normals);
  hint.slab = point.slab;
  hint.u = point.u;
  hint.v = point.v;
  return point;
}

SurfacePoint closest_point(const Snapshot& model, Vec3d p, double within) noexcept {
  PickHint nothing;
  return closest_point(model, p, nothing, within);
}

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
  if (!(known && search(first))) {
    SlabMesh::Visited at;
    const bool stopped = surface.mesh().visit_nearest(
        distance2, reach2,
        [&](SlabId s) {
          if (surface.placed() + boxes / kBoxes > most + kMostSearched) return true;
          return !(known && s == first) && surface_box(surface.model(), s).distance2(point) < reach2 && search(s);
        },
        at);
    if (stopped && reach > enough)
      for (const auto& ahead : std::span(at.ahead).first(at.count)) reach = std::min(reach, std::sqrt(ahead.distance));
  }
  surface.add_placed(boxes / kBoxes);
  return reach * (1 - 1e-9);
}

Box3d bounds_of_surface(const Snapshot& model) noexcept {
  Box3d box;
  for (SlabId s = 0; s < model.slab_mesh().slab_count(); ++s) {
    const bool all_void = model.has(Layer::Void) && model.tile(Layer::Void, s).bounds().range()[0] > 0.5;
    if (!all_void) box.add(detail::surface_box(model, s));
  }
  return box.empty() ? model.slab_mesh().bounds() : box;
}

}  // namespace relief
