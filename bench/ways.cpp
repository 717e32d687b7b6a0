#include "ways.h"

#include <relief/base/assert.h>
#include <relief/base/triangle.h>
#include <relief/core/sweep.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace relief::bench {

namespace {

constexpr int kAnchors = 2000;      // places below the great turn
constexpr std::size_t kSpot = 100;  // frames that a tap or a press takes

/// Where rays from a great turn around the model to its middle first meet the surface.
std::vector<SurfacePoint> below_a_turn(const Surface& surface) {
  const Vec3d centre = surface.box.centre();
  std::vector<SurfacePoint> below;
  for (int k = 0; k < kAnchors; ++k) {
    const double turn = 2 * std::numbers::pi * k / kAnchors;
    const Vec3d from = centre + Vec3d{std::sin(turn), 0.25 * std::sin(3 * turn), std::cos(turn)} * surface.size;
    if (const auto hit = raycast(surface.model, {from, centre - from})) below.push_back(hit->point);
  }
  RELIEF_ASSERT(below.size() > 1);
  return below;
}

}  // namespace

Nearest nearest_on(const Tessellation& surface, const std::array<std::uint32_t, 3>& triangle, Vec3d p) {
  const auto& [a, b, c] = triangle;
  const auto& at = surface.positions;
  const std::array<double, 3> w = nearest_in_triangle(p, at[a], at[b], at[c]);
  Nearest found = {.point = at[a] * w[0] + at[b] * w[1] + at[c] * w[2], .normal = {}};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3f n = surface.normals[triangle[k]];
    found.normal += Vec3d{n.x, n.y, n.z} * w[k];
  }
  found.normal = normalized(found.normal);
  found.inside = dot(p - found.point, found.normal) < 0;
  return found;
}

Way slide(const Surface& surface, double depth, double step, int count) {
  const std::vector<SurfacePoint> below = below_a_turn(surface);
  const auto anchor = [&](std::size_t k) {
    const SurfacePoint& at = below[k % below.size()];
    return at.position - at.normal * (depth * surface.size);
  };
  const auto frames = static_cast<std::size_t>(count);
  Way way = {.name = "slide", .cursors = {}, .section = frames, .ups = {below.front().normal}};
  double over = 0;  // of the step that leads from one stretch into the next
  for (std::size_t k = 0; way.cursors.size() < frames; ++k) {
    const Vec3d start = anchor(k), stretch = anchor(k + 1) - start;
    const double far = length(stretch);
    for (; over < far && way.cursors.size() < frames; over += step * surface.size)
      way.cursors.push_back(start + stretch * (over / far));
    over -= far;
  }
  return way;
}

std::vector<Way> make_ways(const Surface& surface, int frames) {
  const auto count = static_cast<std::size_t>(frames);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  const std::vector<SurfacePoint> below = below_a_turn(surface);
  const auto somewhere = [&](std::size_t k) -> const SurfacePoint& { return below[k * 7919 % below.size()]; };
  const double depth = 0.01 * surface.size, aside = 0.003 * surface.size, near = 0.005 * surface.size;
  Way tap = {.name = "tap", .cursors = {}, .section = kSpot, .ups = {}}, press = tap;
  press.name = "press";
  Way jump = {.name = "jump", .coherent = false, .cursors = {}, .section = count, .ups = {somewhere(0).normal}};
  for (std::size_t k = 0; k < count; ++k) {
    const SurfacePoint& at = somewhere(k / kSpot);
    if (k % kSpot == 0) {
      tap.ups.push_back(at.normal);
      press.ups.push_back(at.normal);
    }
    const auto frame = static_cast<double>(k % kSpot);
    const Vec3d axis = std::abs(at.normal.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
    const Vec3d along = normalized(cross(at.normal, axis));
    tap.cursors.push_back(at.position +
                          at.normal * (depth * std::cos(2 * std::numbers::pi * frame / static_cast<double>(kSpot))));
    press.cursors.push_back(at.position - at.normal * depth + along * (aside * std::sin(0.1 * frame)));
    jump.cursors.push_back(somewhere(k).position + somewhere(k).normal * (near * unit(random)));
  }
  return {slide(surface, 0.005, 1e-4, frames), std::move(tap), std::move(press), std::move(jump)};
}

void find_truths(const Tessellation& surface, std::size_t each, std::vector<Way>& ways) {
  struct Search {
    Vec3d p;
    double distance = std::numeric_limits<double>::infinity();
    std::size_t triangle = 0;
  };
  std::vector<Search> searches;
  for (Way& way : ways) {
    const std::size_t apart = std::max<std::size_t>(1, way.cursors.size() / each);
    for (std::size_t k = 0; k < way.cursors.size(); k += apart) {
      way.truths.push_back({k, {}});
      searches.push_back({way.cursors[k]});
    }
  }
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto& [a, b, c] = surface.triangles[t];
    const Vec3d p = surface.positions[a], q = surface.positions[b], r = surface.positions[c];
    const double reach = std::max(length(q - p), length(r - p));
    for (Search& search : searches) {
      const double least = search.distance + reach;  // no nearer a corner, no nearer the triangle
      if (dot(search.p - p, search.p - p) > least * least) continue;
      const std::array<double, 3> w = nearest_in_triangle(search.p, p, q, r);
      const double distance = length(search.p - (p * w[0] + q * w[1] + r * w[2]));
      if (!(distance < search.distance)) continue;
      search.distance = distance;
      search.triangle = t;
    }
  }
  auto search = searches.begin();
  for (Way& way : ways)
    for (Way::Truth& truth : way.truths) {
      truth.nearest = nearest_on(surface, surface.triangles[search->triangle], search->p);
      ++search;
    }
}

}  // namespace relief::bench
