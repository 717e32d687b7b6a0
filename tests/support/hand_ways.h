// Ways of a hand over a surface: places of the cursor, one per tick.
#pragma once

#include "support/bare_triangles.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <random>
#include <vector>

namespace relief::testing {

/// Straight from corner to corner, at most `step` apart.
inline std::vector<Vec3d> straight_ways(const std::vector<Vec3d>& corners, double step) {
  std::vector<Vec3d> all = {corners.front()};
  for (std::size_t k = 1; k < corners.size(); ++k) {
    const Vec3d from = corners[k - 1], way = corners[k] - from;
    const double count = std::max(1.0, std::ceil(length(way) / step));
    for (double i = 1; i <= count; ++i) all.push_back(from + way * (i / count));
  }
  return all;
}

/// Along a line, at places `step` apart.
inline std::vector<Vec3d> even_ways(const std::vector<Vec3d>& line, double step) {
  std::vector<Vec3d> all = {line.front()};
  double ahead = step;  // from the last corner to the next place
  for (std::size_t k = 1; k < line.size(); ++k) {
    const Vec3d from = line[k - 1], way = line[k] - from;
    const double far = length(way);
    for (; ahead <= far; ahead += step) all.push_back(from + way * (ahead / far));
    ahead -= far;
  }
  return all;
}

/// What a slide over a surface is like; lengths in model units.
struct Slide {
  double depth = 0;   ///< of a point; of a ball, as much below its radius above the surface
  double radius = 0;  ///< of the ball
  double step = 0;
  double longest = 0;
};

/// A hand that comes in from above somewhere on the surface, slides along a plane section of it, and goes out again. It
/// follows the surface as a hand does, not the edges: its way is a mean over twice the depth to each side. The slide
/// ends before parts that are thinner than six times the depth, where a god-object may go over to the far side; before
/// edges that turn by more than 75 degrees, which it does not round from inside; and that of a ball before open edges,
/// round which its oracle goes behind the surface. The same seed gives the same way; none where that is shorter than a
/// tenth of the longest.
inline std::vector<Vec3d> slide(const BareTriangles& surface, const Slide& like, std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto unit = [&] { return 2 * (double(random()) / 4294967296.0) - 1; };
  const auto anywhere = [&] { return normalized(Vec3d{unit(), unit(), unit()}); };
  const double size = surface.diagonal(), stride = 1e-3 * size;
  const Vec3d middle = surface.bounds().centre();
  const Vec3d outside = middle + anywhere() * size, aim = middle + anywhere() * (0.2 * size * unit());
  const auto in = surface.entry(outside, aim + (aim - outside));
  if (!in) return {};
  std::optional<BareTriangles::Place> at = surface.nearest(in->triangle, outside + (aim - outside) * (2 * in->share));
  const Vec3d start = at->position;
  Vec3d out = surface.pseudo_normal(*at);
  const Vec3d across = normalized(cross(out, anywhere()));  // of the section's plane

  struct Step {
    Vec3d place, out;
  };
  std::vector<Step> steps;
  const auto turn_span = static_cast<std::size_t>(std::ceil(3 * like.depth / stride));
  while (double(steps.size()) * stride < like.longest) {
    const Vec3d normal = surface.pseudo_normal(*at);
    if (surface.thickness(*at, 6 * like.depth) < 6 * like.depth) break;
    const double clear = 10 * stride + 3 * (like.depth + like.radius);
    const auto is_near = [&](Vec3d p) { return length(p - at->position) < clear; };
    if (like.radius > 0 && std::ranges::any_of(surface.rims(), is_near)) break;
    // Where a surface turns by 90 degrees it is never rounded from inside, and shortly before that the way round it is
    // so long that a bounded contact point comes late: slides end beyond the edges of a pentagon, 72 degrees.
    bool turns = false;
    for (std::size_t k = 1; k <= std::min(turn_span, steps.size()); ++k)
      turns = turns || dot(steps[steps.size() - k].out, normal) < 0.26;  // cos 75 degrees
    if (turns) break;
    steps.push_back({at->position, normal});
    out = normalized(out * 0.7 + normal * 0.3);
    Vec3d next = at->position + normalized(cross(out, across)) * stride;
    next -= across * dot(next - start, across);
    const auto there = surface.nearest_within(next, 20 * stride);
    if (!there || length(there->position - at->position) > 5 * stride) break;
    at = there;
  }
  if (turn_span < steps.size()) steps.resize(steps.size() - turn_span);  // off the edge or the thin part
  if (double(steps.size()) * stride < 0.1 * like.longest) return {};

  const auto wide = static_cast<std::ptrdiff_t>(std::ceil(2 * like.depth / stride));
  std::vector<Vec3d> line;
  for (std::ptrdiff_t k = 0; k < std::ssize(steps); ++k) {
    const std::ptrdiff_t reach = std::min({wide, k, std::ssize(steps) - 1 - k});
    Vec3d sum;
    for (std::ptrdiff_t i = k - reach; i <= k + reach; ++i) {
      const Step& step = steps[static_cast<std::size_t>(i)];
      sum += step.place + step.out * (like.radius - like.depth);
    }
    line.push_back(sum / double(2 * reach + 1));
  }
  const double above = 0.01 * size + like.depth;
  line.insert(line.begin(), line.front() + steps.front().out * above);
  line.push_back(line.back() + steps.back().out * above);
  return even_ways(line, like.step);
}

}  // namespace relief::testing
