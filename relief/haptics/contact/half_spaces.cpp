#include <relief/haptics/contact/half_spaces.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace relief::detail {
namespace {

/// Sine between unit normals below which their planes meet nowhere: the line would have fewer than six digits.
constexpr double kParallel = 1e-10;
/// Cosine from a plane's normal to a unit way below which the way is along the plane, up to that line's own error.
constexpr double kAlongPlane = 1e-12;

/// On the line where the planes of a and b meet.
std::optional<Vec3d> nearest_on_line(std::span<const HalfSpace> spaces, const HalfSpace& a, const HalfSpace& b,
                                     Vec3d goal, double slack) noexcept {
  const Vec3d along = cross(a.normal, b.normal);
  const double sine = length(along);
  const Vec3d way = along / sine, aside = cross(way, a.normal);  // aside: in the plane of a, perpendicular to the line
  // First onto a, then in it onto b: where the planes are nearly parallel only that keeps to both.
  const Vec3d on_a = goal - a.normal * a.room(goal);
  const Vec3d start = on_a - aside * (b.room(on_a) / dot(b.normal, aside));
  constexpr double kAnywhere = std::numeric_limits<double>::infinity();
  double low = -kAnywhere, high = kAnywhere, lowest = low, highest = high;  // lowest, highest: with the slack
  for (const HalfSpace& s : spaces) {
    const double room = s.room(start), speed = dot(s.normal, way);
    if (std::abs(speed) <= kAlongPlane) {
      if (room < -slack) return std::nullopt;
    } else if (speed > 0) {
      low = std::max(low, -room / speed);
      lowest = std::max(lowest, -(room + slack) / speed);
    } else {
      high = std::min(high, -room / speed);
      highest = std::min(highest, -(room + slack) / speed);
    }
  }
  if (low <= high) return start + way * std::clamp(0.0, low, high);
  if (lowest <= highest) return start + way * std::clamp(0.0, lowest, highest);
  return std::nullopt;
}

/// On the plane of a.
std::optional<Vec3d> nearest_on_plane(std::span<const HalfSpace> spaces, const HalfSpace& a, Vec3d goal,
                                      double slack) noexcept {
  Vec3d x = goal - a.normal * a.room(goal);
  for (std::size_t k = 0; k < spaces.size(); ++k) {
    if (spaces[k].room(x) >= -slack) continue;
    const Vec3d along = cross(a.normal, spaces[k].normal);
    if (!(dot(along, along) > kParallel * kParallel)) return std::nullopt;
    const auto found = nearest_on_line(spaces.first(k), a, spaces[k], goal, slack);
    if (!found) return std::nullopt;
    x = *found;
  }
  return x;
}

std::optional<Vec3d> by_increments(std::span<const HalfSpace> spaces, Vec3d goal, double slack) noexcept {
  Vec3d x = goal;
  for (std::size_t k = 0; k < spaces.size(); ++k) {
    if (spaces[k].room(x) >= -slack) continue;
    const auto found = nearest_on_plane(spaces.first(k), spaces[k], goal, slack);
    if (!found) return std::nullopt;
    x = *found;
  }
  return x;
}

}  // namespace

std::optional<Vec3d> nearest_in(std::span<HalfSpace> spaces, Vec3d goal, double slack) noexcept {
  // What is nearest in a few of them and is in all is the answer.
  Vec3d x = goal;
  for (std::size_t few = 0; few < spaces.size(); ++few) {
    double least = -slack;
    HalfSpace* worst = nullptr;
    for (HalfSpace& s : spaces.subspan(few))
      if (const double room = s.room(x); room < least) {
        least = room;
        worst = &s;
      }
    if (worst == nullptr) break;
    std::swap(*worst, spaces[few]);
    const auto found = by_increments(spaces.first(few + 1), goal, slack);
    if (!found) return std::nullopt;
    x = *found;
  }
  return x;
}

}  // namespace relief::detail
