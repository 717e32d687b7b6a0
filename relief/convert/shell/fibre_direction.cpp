#include <relief/base/lanes.h>
#include <relief/convert/shell/fibre_direction.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

namespace relief::detail {
namespace {

/// Of more triangles a choice will do.
constexpr std::size_t kEnough = 1500;

/// Axes across the mean normal, each for two directions. With the most deviating normal they leave 13 normals, whose
/// cap is the cap of all except for about a degree.
constexpr std::size_t kAxes = 6;

/// The least visibility of the smallest cap's centre with which it is taken: below it the cap is about a half sphere,
/// and rounding decides where its centre is.
constexpr double kOpen = 0.05;
/// Steps of the search in its place.
constexpr int kBlends = 50;
/// Of a unit vector along an axis from which on another axis is taken to span a plane across: any below 1 serves.
constexpr double kAlong = 0.6;

/// Of the triangles `some` those whose normals reach farthest along the axes, to both sides, and the one that leans
/// farthest from the mean.
std::vector<std::uint32_t> outermost(const SourceIndex& source, std::span<const std::uint32_t> some, Vec3d mean) {
  const Vec3d aside = std::abs(mean.x) < kAlong ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};  // not along the mean
  const Vec3d e = normalized(cross(mean, aside)), g = cross(mean, e);
  // Four axes at a time; the last two of the eight both point away from the mean.
  std::array<std::array<Lanes, 3>, 2> axes;
  for (std::size_t k = 0; k < 8; ++k) {
    const double angle = std::numbers::pi * double(k) / kAxes;
    const Vec3d axis = k < kAxes ? e * std::cos(angle) + g * std::sin(angle) : -mean;
    for (std::size_t c = 0; c < 3; ++c) axes[k / 4][c].of[k % 4] = static_cast<float>(axis[c]);
  }
  std::array<Four, 2> highest{}, lowest{};
  std::array<FourInts, 2> at_highest{}, at_lowest{};
  highest.fill(Four{} - 2.0F);  // beyond any product of unit vectors
  lowest.fill(Four{} + 2.0F);
  for (std::size_t i = 0; i < some.size(); ++i) {
    const std::array<float, 4>& n = source.normals[some[i]];
    const FourInts number = FourInts{} + static_cast<std::int32_t>(i);
    for (std::size_t half = 0; half < 2; ++half) {
      const Four h = axes[half][0].all() * n[0] + axes[half][1].all() * n[1] + axes[half][2].all() * n[2];
      at_highest[half] = h > highest[half] ? number : at_highest[half];
      highest[half] = greatest(highest[half], h);
      at_lowest[half] = h < lowest[half] ? number : at_lowest[half];
      lowest[half] = least(lowest[half], h);
    }
  }
  std::vector<std::uint32_t> kept;
  kept.reserve(2 * kAxes + 1);
  for (std::size_t k = 0; k < kAxes; ++k) kept.push_back(some[static_cast<std::size_t>(at_highest[k / 4][k % 4])]);
  for (std::size_t k = 0; k < kAxes; ++k) kept.push_back(some[static_cast<std::size_t>(at_lowest[k / 4][k % 4])]);
  kept.push_back(some[static_cast<std::size_t>(at_highest[1][2])]);
  return kept;
}

/// Returns the normals fit in no cap below a half sphere: starts with d, and blends the worst one in, again and again.
Direction blend_in_worst(std::span<const Vec3d> normals, Vec3d d, Direction best) {
  for (int k = 0; k < kBlends; ++k) {
    Vec3d worst = d;
    double least = 2;
    for (const Vec3d n : normals)
      if (const double h = dot(n, d); h < least) {
        least = h;
        worst = n;
      }
    if (least > best.visibility) best = {d, least};
    d = normalized(d * (1 - 1.0 / (k + 2)) + worst * (1.0 / (k + 2)));
  }
  return best;
}

}  // namespace

double SourceView::visibility(Vec3d d) const noexcept {
  double least = 1;
  for (const Vec3d n : normals) least = std::min(least, dot(n, d));
  return least;
}

SourceView view_of_source(const SourceIndex& source, std::span<const TriangleReference> references) {
  std::size_t all = 0, at = 0;
  for (const TriangleReference r : references) all += r.is_cluster() ? kClusterSize : 1;
  const std::size_t stride = 1 + all / kEnough;
  std::vector<std::uint32_t> some;
  some.reserve(all / stride + 1);
  Vec3d mean;
  for_triangles(source, references, [&](std::uint32_t t) {
    if (at++ % stride != 0) return;
    some.push_back(t);
    mean += source.normal(t);
  });
  mean = normalized(mean);
  if (some.size() > 2 * kAxes + 2) some = outermost(source, some, mean);
  SourceView view;
  view.normals.reserve(some.size());
  for (const std::uint32_t t : some) view.normals.push_back(source.normal(t));
  view.best = best_direction(view.normals);
  if (!(view.best.visibility > kOpen)) view.best = blend_in_worst(view.normals, mean, view.best);
  return view;
}

Direction star_direction(std::span<const LinkEdge> link, Vec3d at) {
  std::vector<Vec3d> normals;
  normals.reserve(link.size());
  for (const LinkEdge& edge : link) {
    const Vec3d n = cross(edge.from - at, edge.to - at);
    if (const double size = length(n); size > 0) normals.push_back(n / size);
  }
  return best_direction(normals);
}

// Steps away from the edge that is nearest, each shorter than the last.
Vec3d innermost(std::span<const LinkEdge> link, Vec3d start, Vec3d d) {
  constexpr int kSteps = 60;
  constexpr double kFirstStep = 0.25;  // of the link's radius
  struct Line {
    Vec3d from, left;
  };
  std::vector<Line> lines;
  lines.reserve(link.size());
  double radius = 0;
  for (const LinkEdge& edge : link) {
    const Vec3d left = cross(d, edge.to - edge.from);
    if (const double across = length(left); across > 0) lines.push_back({edge.from, left / across});
    radius = std::max(radius, length(edge.from - start));
  }
  Vec3d at = start, best = start;
  double most = -Box3d::kFar;
  for (int step = 0; step < kSteps && !lines.empty(); ++step) {
    double least = Box3d::kFar;
    Vec3d away;
    for (const Line& line : lines)
      if (const double distance = dot(at - line.from, line.left); distance < least) {
        least = distance;
        away = line.left;
      }
    if (least > most) {
      most = least;
      best = at;
    }
    at += away * (2 * kFirstStep * radius / (step + 2));
  }
  return best;
}

Vec3d seeing_place(std::span<const LinkEdge> link, Vec3d start) {
  constexpr int kTurns = 4;  // what more of them find is little
  Vec3d sum;                 // across the link
  for (const LinkEdge& edge : link) sum += cross(edge.from - start, edge.to - start);
  if (!(length(sum) > 0)) return start;
  Vec3d at = start, best = start, d = normalized(sum);
  double most = star_direction(link, start).visibility;
  for (int turn = 0; turn < kTurns; ++turn) {
    at = innermost(link, at, d);
    const Direction there = star_direction(link, at);
    if (there.visibility > most) {
      most = there.visibility;
      best = at;
    }
    d = there.d;
  }
  return best;
}

}  // namespace relief::detail
