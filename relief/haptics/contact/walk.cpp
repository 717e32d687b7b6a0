#include <relief/base/triangle.h>
#include <relief/haptics/contact/walk.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace relief::detail {

namespace {

using Weights = std::array<double, 3>;

constexpr double kGain = 1 - 1e-12;  // squared distance that another triangle must win: above rounding
constexpr double kOnEdge = 1e-9;     // weight of a corner: a place that is so near the other two is on their edge
constexpr double kHair = 1e-7;       // of the fibre

double det(Vec3d a, Vec3d b, Vec3d c) noexcept { return dot(a, cross(b, c)); }

/// Returns the place of a triangle that is nearest to p.
SurfacePlace nearest(const MicroTriangle& t, Vec3d p) noexcept {
  const Weights w = nearest_in_triangle(p, t.positions[0], t.positions[1], t.positions[2]);
  return {t, w, t.point(w)};
}

/// Returns a place of a triangle.
SurfacePlace place_at(const MicroTriangle& t, const Weights& w) noexcept {
  const Weights at = on_edges(w);
  return {t, at, t.point(at)};
}

/// Returns the weights of the place in a triangle's plane that is nearest to p, which may lie outside; not numbers
/// where the triangle has no area.
Weights foot(const MicroTriangle& t, Vec3d p) noexcept {
  const Vec3d ab = t.positions[1] - t.positions[0], ac = t.positions[2] - t.positions[0], ap = p - t.positions[0];
  const Vec3d area = cross(ab, ac);
  const double v = dot(cross(ap, ac), area) / dot(area, area), w = dot(cross(ab, ap), area) / dot(area, area);
  return {1 - v - w, v, w};
}

/// Returns where the straight way from a place of a triangle towards the foot of the goal ends: there, or at the
/// triangle's edge.
SurfacePlace straight_on(const MicroTriangle& t, Vec3d from, Vec3d goal) noexcept {
  const Weights to = foot(t, goal);
  Weights w = to;
  if (!(std::ranges::min(to) >= -kOnEdge)) {
    const Weights at = on_edges(nearest_in_triangle(from, t.positions[0], t.positions[1], t.positions[2]));
    double share = 1;
    for (std::size_t k = 0; k < 3; ++k)
      if (to[k] < -kOnEdge) share = std::min(share, at[k] / (at[k] - to[k]));
    for (std::size_t k = 0; k < 3; ++k) w[k] = at[k] + share * (to[k] - at[k]);
  }
  return place_at(t, w);
}

/// Says which corners' weights are all but zero: none in the interior, one on an edge, two at a sample.
struct Feature {
  int zeros = 0;
  std::size_t zero = 0;    ///< on an edge: the corner opposite
  std::size_t corner = 0;  ///< at a sample: which

  explicit Feature(const Weights& w) noexcept {
    for (std::size_t k = 0; k < 3; ++k) {
      if (w[k] < kOnEdge) {
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

/// Of the triangles that share a place's edge or sample, the place is taken to lie in the one that the goal is farthest
/// behind. So what is felt there depends neither on their order nor on the way that led there.
void face(MicroTriangles& surface, SurfacePlace& place, Vec3d goal) noexcept {
  const auto height = [&](const MicroTriangle& t) noexcept { return dot(normalized(t.area()), place.position - goal); };
  SurfacePlace found = place;
  double most = height(place.triangle);
  neighbours(surface, place, [&](const MicroTriangle& t) noexcept {
    const double h = height(t);
    if (!(h > most)) return;
    most = h;
    found = {t, on_edges(nearest(t, place.position).weights), place.position};
  });
  place = found;
}

}  // namespace

Weights on_edges(Weights w) noexcept {
  const auto is_near = [](double x) noexcept { return x < kOnEdge && x != 0; };
  if (std::ranges::none_of(w, is_near)) return w;
  std::ranges::replace_if(w, is_near, 0.0);
  const auto most = static_cast<std::size_t>(std::ranges::max_element(w) - w.begin());
  w[most] = 1 - w[(most + 1) % 3] - w[(most + 2) % 3];
  return w;
}

double walk(MicroTriangles& surface, SurfacePlace& place, Vec3d goal, double reach, int& tries) noexcept {
  double best = distance2(place.position, goal), gone = 0;
  for (bool first = true; tries > 0; first = false) {
    SurfacePlace next;
    double least = best, steepest = 0;
    next.triangle.slab = kNoSlab;
    const auto take = [&](const SurfacePlace& there) noexcept {
      const double d = distance2(there.position, goal);
      if (!(d < best * kGain)) return false;
      const Vec3d way = there.position - place.position;
      const double falls = dot(goal - place.position, way) / length(way);
      if (falls > steepest) {
        steepest = falls;
        least = d;
        next = there;
      }
      return true;
    };
    const auto look = [&](const MicroTriangle& t) noexcept {
      --tries;
      const SurfacePlace ahead = straight_on(t, place.position, goal);
      const bool gains = take(ahead);
      // A way that leads out of it at once may still lead along its edge.
      if (!gains && !(std::ranges::min(ahead.weights) > 0)) take(place_at(t, nearest(t, goal).weights));
    };
    const int zeros = Feature(place.weights).zeros;
    if (zeros == 1 || (zeros == 0 && first)) look(place.triangle);
    neighbours(surface, place, look);
    if (next.triangle.slab == kNoSlab) break;
    const double way = length(next.position - place.position);
    if (gone + way > reach) {
      // Both places lie in the new triangle.
      const Vec3d end = place.position + (next.position - place.position) * ((reach - gone) / way);
      place = place_at(next.triangle, nearest(next.triangle, end).weights);
      gone = reach;
      break;
    }
    gone += way;
    best = least;
    place = next;
  }
  face(surface, place, goal);
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
