#include <relief/base/triangle.h>
#include <relief/haptics/contact/walk.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace relief::detail {

namespace {

using Weights = std::array<double, 3>;

constexpr double kGain = 1 - 1e-12;  // squared distance that another triangle must win: above rounding
constexpr double kHair = 1e-7;       // of the fibre

double det(Vec3d a, Vec3d b, Vec3d c) noexcept { return dot(a, cross(b, c)); }

/// Returns the place of a triangle that is nearest to p.
SurfacePlace nearest(const MicroTriangle& t, Vec3d p) noexcept {
  const Weights w = nearest_in_triangle(p, t.positions[0], t.positions[1], t.positions[2]);
  return {t, w, t.point(w)};
}

/// Says which corners' weights are zero: none in the interior, one on an edge, two at a sample.
struct Feature {
  int zeros = 0;
  std::size_t zero = 0;    ///< on an edge: the corner opposite
  std::size_t corner = 0;  ///< at a sample: which

  explicit Feature(const Weights& w) noexcept {
    for (std::size_t k = 0; k < 3; ++k) {
      if (w[k] == 0) {
        ++zeros;
        zero = k;
      } else {
        corner = k;
      }
    }
  }
};

/// Calls visit(triangle) for the triangles that share the place's edge or sample, without its own at an edge.
template <typename Visit>
void neighbours(MicroTriangles& surface, const SurfacePlace& place, Visit&& visit) noexcept {
  const Feature feature(place.weights);
  if (feature.zeros == 1) {
    const MicroTriangle other = surface.across(place.triangle, feature.zero);
    if (other.slab != kNoSlab) visit(other);
  } else if (feature.zeros == 2) {
    surface.around(place.triangle.slab, place.triangle.corners[feature.corner], visit);
  }
}

}  // namespace

double walk(MicroTriangles& surface, SurfacePlace& place, Vec3d goal, double reach, int& tries) noexcept {
  double best = distance2(place.position, goal), gone = 0;
  SurfacePlace next = nearest(place.triangle, goal);
  double least = distance2(next.position, goal);
  if (!(least < best)) next = place;
  for (bool first = true; first || next.triangle.slab != kNoSlab; first = false) {
    if (least < best) {
      const double way = length(next.position - place.position);
      if (gone + way > reach) {
        // Both places lie in the new triangle.
        place = nearest(next.triangle, place.position + (next.position - place.position) * ((reach - gone) / way));
        return reach;
      }
      gone += way;
      best = least;
      place = next;
    }
    if (tries <= 0) break;
    next.triangle.slab = kNoSlab;
    least = best * kGain;
    neighbours(surface, place, [&](const MicroTriangle& t) noexcept {
      --tries;
      const Weights w = nearest_in_triangle(goal, t.positions[0], t.positions[1], t.positions[2]);
      if (w[0] == 1 && t.positions[0] == place.position) return;
      const Vec3d there = t.point(w);
      const double d = distance2(there, goal);
      if (!(d < least)) return;
      least = d;
      next = {t, w, there};
    });
  }
  return gone;
}

Descent descend(MicroTriangles& surface, const SurfacePlace& from, Vec3d goal) noexcept {
  int tries = kTries;
  Descent found = {from, 0, false};
  found.way = walk(surface, found.rest, goal, kAnywhere, tries);
  found.ended = tries > 0;
  return found;
}

void follow(MicroTriangles& surface, SurfacePlace& place, const Descent& descent, Vec3d goal, double reach) noexcept {
  if (descent.way <= reach) {
    place = descent.rest;
    return;
  }
  int tries = kTries;
  walk(surface, place, goal, reach, tries);
}

Vec3d above(MicroTriangles& surface, const SurfacePlace& place) noexcept {
  return place.position + surface.fibre(place) * kHair;
}
Vec3d below(MicroTriangles& surface, const SurfacePlace& place) noexcept {
  return place.position - surface.fibre(place) * kHair;
}

bool leads_into_air(MicroTriangles& surface, const SurfacePlace& place, Vec3d goal) noexcept {
  const bool outwards = dot(place.triangle.area(), goal - place.position) > 0;
  if (Feature(place.weights).zeros == 0) return outwards;
  const Vec3d from = above(surface, place), way = goal - from;
  // Neighbours see the same edge with the opposite sign, so no gap opens.
  const auto goes_in = [&](const MicroTriangle& t) noexcept {
    const Vec3d a = t.positions[0] - from, b = t.positions[1] - from, c = t.positions[2] - from;
    const double wa = det(way, b, c), wb = det(way, c, a), wc = det(way, a, b);
    return wa <= 0 && wb <= 0 && wc <= 0 && wa + wb + wc < 0;
  };
  if (!outwards && goes_in(place.triangle)) return false;
  bool blocked = false;
  neighbours(surface, place, [&](const MicroTriangle& t) noexcept { blocked = blocked || goes_in(t); });
  return !blocked;
}

}  // namespace relief::detail
