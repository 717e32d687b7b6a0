#include <relief/core/facets.h>
#include <relief/core/surface_point.h>

#include <algorithm>

namespace relief {

namespace {

using detail::on_grid;
using detail::sample_position;

/// The holes of one slab, for many questions.
class Holes {
 public:
  Holes(const Snapshot& model, SlabId slab) noexcept
      : voids_(model.has(Layer::Void) ? model.tile(Layer::Void, slab).plane() : nullptr),
        n_(model.slab_mesh().intervals(slab)) {}
  [[nodiscard]] bool contain(const std::array<GridPoint, 3>& cell) const noexcept {
    return voids_ != nullptr && is_hole(voids_[sample_index(n_, cell[0])], voids_[sample_index(n_, cell[1])],
                                        voids_[sample_index(n_, cell[2])]);
  }

 private:
  const float* voids_;
  int n_;
};

/// Twice the area vectors of the micro-triangles around `at`, added counter-clockwise: of those whose samples are
/// `inside` and that are no hole(at, sample, next sample).
template <typename Position, typename Inside, typename Hole>
Vec3d ring_sum(GridPoint at, const Position& position, const Inside& inside, const Hole& hole) noexcept {
  const Vec3d centre = position(at);
  Vec3d sum;
  Vec3d before;
  GridPoint last;
  bool have = false;
  for (const GridPoint step : detail::kAround) {
    const GridPoint p = {at.i + step.i, at.j + step.j};
    if (!inside(p)) {
      have = false;
      continue;
    }
    const Vec3d edge = position(p) - centre;
    if (have && !hole({at, last, p})) sum += cross(before, edge);
    before = edge;
    last = p;
    have = true;
  }
  return sum;
}

/// Returns the same of a grid with new samples, as if each of the six lay one spacing off.
template <typename Position>
Vec3d facet_sum(const detail::Facets& facets, GridPoint at, const Position& position) noexcept {
  const Vec3d centre = position(at);
  Vec3d sum, before;
  bool have = false;
  for (const GridPoint way : detail::kAround) {
    const int reach = facets.reach(at, way);
    if (reach == 0) {
      have = false;
      continue;
    }
    const Vec3d edge = (position({at.i + reach * way.i, at.j + reach * way.j}) - centre) / reach;
    if (have) sum += cross(before, edge);
    before = edge;
    have = true;
  }
  return sum;
}

/// Returns whether one of the triangles around a sample is a hole.
bool is_beside(const Holes& holes, int n, GridPoint at) noexcept {
  GridPoint last = {-1, -1};
  for (const GridPoint way : detail::kAround) {
    const GridPoint p = {at.i + way.i, at.j + way.j};
    if (on_grid(n, p) && on_grid(n, last) && holes.contain({at, last, p})) return true;
    last = p;
  }
  return false;
}

/// Returns the part of a sample's normal that comes from one slab, without holes; `over_new`: over new samples. Where n
/// differs across an edge, a factor of 4^k scales all triangles to one size. Powers of two change no bits where n is
/// equal.
Vec3d partial_normal(const Snapshot& model, SlabId slab, GridPoint at, bool over_new) noexcept {
  const SlabMesh& mesh = model.slab_mesh();
  const int n = mesh.intervals(slab);
  const SlabCorners corners = mesh.corners(slab);
  const float* d = model.displacement(slab);
  const Holes holes(model, slab);
  const double halvings = (n & -n) * static_cast<double>(1 << mesh.level(slab));
  // The bits of sample_position(): a power of two divides as its inverse multiplies.
  const double step = (n & (n - 1)) == 0 ? 1.0 / n : 0;
  const auto position = [&](GridPoint p) {
    const std::array<int, 3> k = weights(n, p);
    const auto part = [&](int of_n) { return step != 0 ? of_n * step : double(of_n) / n; };
    return corners.point({part(k[0]), part(k[1]), part(k[2])}, double{d[sample_index(n, p)]});
  };
  const detail::Facets facets(mesh, slab, d);
  const Vec3d sum = over_new && facets.step() > 1 && !is_beside(holes, n, at)
                        ? facet_sum(facets, at, position)
                        : ring_sum(
                              at, position, [&](GridPoint p) { return on_grid(n, p); },
                              [&](const std::array<GridPoint, 3>& t) { return holes.contain(t); });
  return sum * (halvings * halvings);
}

Vec3d shared_normal(const Snapshot& model, SlabId slab, GridPoint at, bool over_new) noexcept {
  Vec3d sum;
  model.slab_mesh().for_each_copy(
      slab, at, [&](const SampleCopy& copy) { sum += partial_normal(model, copy.slab, copy.at, over_new); });
  return normalized(sum);
}

/// Normal at a sample; at a constrained one not unit but linear between its ends, so that along the edge both slabs
/// interpolate alike.
Vec3d shading_normal(const Snapshot& model, SlabId slab, GridPoint at, bool over_new = true) noexcept {
  const EdgePlace place = model.slab_mesh().edge_place(slab, at);
  if (!place.constrained()) return shared_normal(model, slab, at, over_new);
  const double share = double(place.k) / place.r;
  return shared_normal(model, slab, place.before, over_new) * (1 - share) +
         shared_normal(model, slab, place.after, over_new) * share;
}

/// The twelve samples that the normals of a cell depend on, relative to its first corner's row and column, for a cell
/// that stands on its base and one that hangs from it.
constexpr std::array<std::array<GridPoint, 12>, 2> kAroundCell = {
    {{{{0, 0}, {1, 0}, {0, 1}, {1, 1}, {0, 2}, {-1, 2}, {-1, 1}, {2, 0}, {1, -1}, {2, -1}, {-1, 0}, {0, -1}}},
     {{{0, 0}, {1, 0}, {0, 1}, {1, 1}, {0, 2}, {-1, 2}, {-1, 1}, {2, 0}, {1, -1}, {2, -1}, {2, 1}, {1, 2}}}}};

/// Returns the normal at a sample inside the slab, from the six around it: shared_normal() where nothing is a hole.
Vec3d inner_normal(const SlabCorners& corners, const float* d, int n, GridPoint at) noexcept {
  const auto& o = corners.order;
  const std::array inner = {corners.inner[o[0]], corners.inner[o[1]], corners.inner[o[2]]};
  const std::array outer = {corners.outer[o[0]], corners.outer[o[1]], corners.outer[o[2]]};
  const bool exact = (n & (n - 1)) == 0;
  const double step = 1.0 / n;
  const auto position = [&](GridPoint p) {
    // As SlabCorners::point(), to the bit; a power of two divides as its inverse multiplies.
    const std::array<int, 3> k = weights(n, p);
    const auto weight = [&](std::uint8_t corner) { return exact ? k[corner] * step : double(k[corner]) / n; };
    const double a = weight(o[0]), b = weight(o[1]), c = weight(o[2]);
    const Vec3d in = (inner[0] * a + inner[1] * b) + inner[2] * c, out = (outer[0] * a + outer[1] * b) + outer[2] * c;
    return in + (out - in) * double{d[sample_index(n, p)]};
  };
  return normalized(
      ring_sum(at, position, [](GridPoint) { return true; }, [](const std::array<GridPoint, 3>&) { return false; }));
}

/// Returns the normals at the three samples of a cell whose samples all lie inside the slab, from the samples around
/// them.
std::array<Vec3d, 3> inner_normals(const SlabCorners& corners, const float* d, int n,
                                   const std::array<GridPoint, 3>& cell) noexcept {
  const auto& [a, b, c] = cell;
  const GridPoint base = {std::min({a.i, b.i, c.i}), std::min({a.j, b.j, c.j})};
  const bool stands = base == a || base == b || base == c;
  std::array<std::array<Vec3d, 4>, 4> window;  // columns and rows -1 to 2
  const auto at = [&](GridPoint p) -> Vec3d& {
    return window[static_cast<std::size_t>(p.j - base.j + 1)][static_cast<std::size_t>(p.i - base.i + 1)];
  };
  for (const GridPoint step : kAroundCell[stands ? 0 : 1]) {
    const GridPoint p = base + step;
    at(p) = sample_position(corners, n, p, double{d[sample_index(n, p)]});
  }
  std::array<Vec3d, 3> normals;
  for (std::size_t k = 0; k < 3; ++k)
    normals[k] = normalized(
        ring_sum(cell[k], at, [](GridPoint) { return true; }, [](const std::array<GridPoint, 3>&) { return false; }));
  return normals;
}

}  // namespace

const std::array<Vec3d, 3>& detail::corner_normals(const Snapshot& model, SlabId slab,
                                                   const std::array<GridPoint, 3>& cell, CellNormals& known) noexcept {
  const bool same_slab = known.model == model.number() && known.slab == slab;
  if (same_slab && known.corners == cell) return known.normals;
  CellNormals made = {model.number(), slab, cell, {}};
  // From a cell to the next one two of the samples stay.
  std::array<bool, 3> have{};
  for (std::size_t k = 0; same_slab && k < 3; ++k)
    for (std::size_t old = 0; old < 3; ++old)
      if (known.corners[old] == cell[k]) {
        made.normals[k] = known.normals[old];
        have[k] = true;
      }
  const int n = model.slab_mesh().intervals(slab);
  // Those of one slab alone, from the six samples around.
  const bool plain =
      !model.has(Layer::Void) && detail::Facets(model.slab_mesh(), slab, model.displacement(slab)).step() == 1;
  const auto inside = [n, plain](GridPoint p) { return plain && p.i > 0 && p.j > 0 && p.i + p.j < n; };
  if (have == std::array{false, false, false} && std::ranges::all_of(cell, inside))
    made.normals = inner_normals(model.slab_mesh().corners(slab), model.displacement(slab), n, cell);
  else
    for (std::size_t k = 0; k < 3; ++k)
      if (!have[k])
        made.normals[k] = inside(cell[k])
                              ? inner_normal(model.slab_mesh().corners(slab), model.displacement(slab), n, cell[k])
                              : shading_normal(model, slab, cell[k]);
  known = made;
  return known.normals;
}

Vec3d sample_position(const SlabMesh& mesh, SlabId slab, int n, GridPoint at, double alpha) noexcept {
  return mesh.field(slab).point(n, at, alpha);
}

Vec3d sample_position(const Snapshot& model, SlabId slab, GridPoint at) noexcept {
  const int n = model.slab_mesh().intervals(slab);
  return model.slab_mesh().field(slab).point(n, at, double{model.displacement(slab)[sample_index(n, at)]});
}

Vec3d sample_normal(const Snapshot& model, SlabId slab, GridPoint at) noexcept {
  return normalized(shading_normal(model, slab, at));
}

Vec3d detail::triangle_normal(const Snapshot& model, SlabId slab, GridPoint at) noexcept {
  return normalized(shading_normal(model, slab, at, false));
}

}  // namespace relief
