#include <relief/convert/room/reach_wanted.h>
#include <relief/convert/room/solids.h>
#include <relief/core/query.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace relief::detail {
namespace {

/// Intervals per edge at which places of a slab are looked at: between two of them a ball as wide as a slab hides less
/// than the margin.
constexpr int kMostIntervals = 24;

/// False only when a capsule surely has no point in common with the hull of six points.
bool may_meet(const std::array<Vec3d, 6>& hull, const Capsule& c) noexcept {
  Vec3d middle;
  for (const Vec3d p : hull) middle += p / 6.0;
  const Vec3d axis = normalized(middle - (c.a + c.b) * 0.5);
  double nearest = Box3d::kFar;
  for (const Vec3d p : hull) nearest = std::min(nearest, dot(p, axis));
  return nearest - std::max(dot(c.a, axis), dot(c.b, axis)) <= c.radius;
}

}  // namespace

std::vector<SurfacePlace> places_on(const Snapshot& surface, const Lattice& lattice, SlabId slab) {
  const SlabCorners corners = surface.slab_mesh().corners(slab);
  const int n = surface.slab_mesh().intervals(slab);
  const float* alpha = surface.displacement(slab);
  std::vector<SurfacePlace> places;
  int step = 1;
  while (n / step > kMostIntervals && n % (2 * step) == 0) step *= 2;
  for (int j = 0; j <= n; j += step)
    for (int i = 0; i + j <= n; i += step) {
      const std::array<int, 3> w = weights(n, {i, j});
      const std::array<double, 3> share = {double(w[0]) / n, double(w[1]) / n, double(w[2]) / n};
      const Line line = fibre_at(corners, lattice, share);
      places.push_back({share, line.origin + line.direction * double(alpha[sample_index(n, {i, j})])});
    }
  return places;
}

ReachWanted::ReachWanted(const Snapshot& surface, const Lattice& lattice, std::span<const SlabId> slabs,
                         std::span<const Capsule> cut, std::span<const Capsule> fill, const RoomGoals& goals)
    : solids_{std::vector(cut.begin(), cut.end()), std::vector(fill.begin(), fill.end())},
      margin_(goals.margin * goals.diagonal / lattice.step),
      fade_share_(goals.fade_share),
      fade_spacings_(goals.fade_spacings) {
  const SlabMesh& mesh = surface.slab_mesh();
  const double longest = goals.longest * goals.diagonal / lattice.step;
  std::array<std::vector<Box3d>, 2> boxes;
  for (const Side side : {kInner, kOuter})
    for (const Capsule& c : solids_[side]) boxes[side].push_back(box_of(c));
  faces_.resize(slabs.size());
  for (std::size_t f = 0; f < slabs.size(); ++f) {
    const SlabId s = slabs[f];
    FaceWish& face = faces_[f];
    face.corners = mesh.corners(s);
    const int n = mesh.intervals(s);
    const float* alpha = surface.displacement(s);
    const double highest = *std::max_element(alpha, alpha + sample_count(n));
    Vec3d mean;
    std::array<Box3d, 2> beyond;  // where fibres made longer on a side would come
    std::array<Vec3d, 6> whole, below;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d in = lattice.to_lattice(face.corners.inner[k]), out = lattice.to_lattice(face.corners.outer[k]);
      const Vec3d d = normalized(out - in);
      mean += d;
      whole[k] = below[k] = in;
      whole[k + 3] = out;
      below[k + 3] = in + (out - in) * highest;
      for (const Side side : {kInner, kOuter}) {
        beyond[side].add(in);
        beyond[side].add(out);
      }
      beyond[kInner].add(in - d * longest);
      beyond[kOuter].add(out + d * longest);
    }
    for (const Side side : {kInner, kOuter})
      for (std::uint32_t k = 0; k < boxes[side].size(); ++k) {
        if (!boxes[side][k].meets(beyond[side])) continue;
        const Capsule& solid = solids_[side][k];
        if (solid.axis != Vec3d{} && !(dot(solid.axis, mean) > 0)) continue;
        face.solids[side].push_back({k, may_meet(whole, solid) && (side == kOuter || may_meet(below, solid))});
      }
    // A slab whose surface none of them reaches is in nobody's way.
    if (std::ranges::none_of(face.solids[kInner], &Solid::is_near) &&
        std::ranges::none_of(face.solids[kOuter], &Solid::is_near)) {
      face.solids = {};
      continue;
    }
    face.places = places_on(surface, lattice, s);
    const auto corner = [&](GridPoint p) {
      return lattice.to_lattice(sample_position(mesh, s, n, p, double(alpha[sample_index(n, p)])));
    };
    const Vec3d a = corner(corner_point(n, 0)), b = corner(corner_point(n, 1)), c = corner(corner_point(n, 2));
    face.spacing = std::max({length(b - a), length(c - b), length(a - c)}) / n;
  }
}

ReachWanted::Need ReachWanted::need_at(const FaceWish& face, const std::array<Ends, 3>& ends, const SurfacePlace& place,
                                       Side side) const noexcept {
  if (face.solids[side].empty()) return {};
  const auto at = [&](Side end) {
    return face.corners.weighted({to_double(ends[0][end]), to_double(ends[1][end]), to_double(ends[2][end])},
                                 place.weights);
  };
  // From the surface, seen towards the side that is to be longer.
  const Vec3d end = at(side), other = at(side == kInner ? kOuter : kInner);
  const Vec3d d = normalized(end - other);
  const double now = dot(end - place.at, d);
  const Line line = {end - d * now, d};
  struct MetSolid {
    Passage passage;
    const Solid* solid;
  };
  std::vector<MetSolid> met;
  for (const Solid& solid : face.solids[side])
    if (const auto p = passage(solids_[side][solid.number], line); p && p->to > 0) met.push_back({*p, &solid});
  // The nearest first, so that what bridges a gap comes before what lies beyond it.
  std::ranges::sort(met, {}, [](const MetSolid& m) { return m.passage.from; });
  double depth = 0, overhang = 0, beside = 0;
  Vec3d axis;
  for (const auto& [p, solid] : met) {
    if (p.to <= depth) continue;
    const Vec3d towards = solids_[side][solid->number].axis;
    if (p.from > depth) {
      if (!solid->is_near || towards == Vec3d{}) continue;
      const double far = p.from - depth;
      if (p.from < now) overhang += far;
      if (far > kBeside * solids_[side][solid->number].radius) beside += far;
    }
    depth = p.to;
    axis = towards;
  }
  if (!(depth > 0)) return {};
  const double least = std::max(depth + fade_spacings_ * face.spacing, depth / (1 - fade_share_));
  return {now, least, std::max(least, depth + margin_), overhang, beside, axis, d};
}

}  // namespace relief::detail
