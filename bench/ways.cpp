#include "ways.h"

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

std::vector<Vec3d> slide_path(const Surface& surface, double depth, double step, int count) {
  const Vec3d centre = surface.box.centre();
  std::vector<Vec3d> anchors;
  for (int k = 0; k < kAnchors; ++k) {
    const double turn = 2 * std::numbers::pi * k / kAnchors;
    const Vec3d from = centre + Vec3d{std::sin(turn), 0.25 * std::sin(3 * turn), std::cos(turn)} * surface.size;
    if (const auto hit = raycast(surface.model, {from, centre - from}))
      anchors.push_back(hit->point.position - hit->point.normal * (depth * surface.size));
  }
  std::vector<Vec3d> path;
  double over = 0;  // of the step that leads from one stretch into the next
  for (std::size_t k = 0; anchors.size() > 1 && path.size() < static_cast<std::size_t>(count); ++k) {
    const Vec3d start = anchors[k % anchors.size()], way = anchors[(k + 1) % anchors.size()] - start;
    const double long_ = length(way);
    for (; over < long_; over += step * surface.size) path.push_back(start + way * (over / long_));
    over -= long_;
  }
  path.resize(std::min(path.size(), static_cast<std::size_t>(count)));
  return path;
}

std::vector<Way> make_ways(const Surface& surface, int frames) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  // Places for the other ways come from a whole turn.
  const std::vector<Vec3d> turn = slide_path(surface, 0.005, 1e-3, 2000);
  const auto near = [&](std::size_t k) { return closest_point(surface.model, turn[k * 7919 % turn.size()]); };
  Way slide = {"slide", true, slide_path(surface, 0.005, 1e-4, frames)};
  Way tap = {"tap", true, {}, kSpot}, press = {"press", true, {}, kSpot}, jump = {"jump", false, {}};
  for (std::size_t k = 0; tap.cursors.size() < static_cast<std::size_t>(frames); ++k) {
    const SurfacePoint at = near(k);
    const Vec3d aside = normalized(cross(at.normal, std::abs(at.normal.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0}));
    for (std::size_t i = 0; i < kSpot; ++i) {
      const double along = static_cast<double>(i);
      tap.cursors.push_back(
          at.position +
          at.normal * (0.01 * surface.size * std::cos(2 * std::numbers::pi * along / static_cast<double>(kSpot))));
      press.cursors.push_back(at.position - at.normal * (0.01 * surface.size) +
                              aside * (0.003 * surface.size * std::sin(0.1 * along)));
      const SurfacePoint there = near(k * kSpot + i);
      jump.cursors.push_back(there.position + there.normal * (0.005 * surface.size * unit(random)));
    }
  }
  return {std::move(slide), std::move(tap), std::move(press), std::move(jump)};
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
