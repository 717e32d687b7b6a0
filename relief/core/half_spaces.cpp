#include <relief/core/half_spaces.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace relief::detail {
namespace {

constexpr double kParallel2 = 1e-20;  // squared sine between normals that are taken for the same

/// On the line where the planes of a and b meet.
std::optional<Vec3d> nearest_on_line(std::span<const HalfSpace> spaces, const HalfSpace& a, const HalfSpace& b,
                                     Vec3d goal, double slack) noexcept {
  const Vec3d along = cross(a.normal, b.normal);
  const double sine2 = dot(along, along);
  // From the goal, square to the line.
  const double ra = -a.room(goal), rb = -b.room(goal), cosine = dot(a.normal, b.normal);
  const Vec3d start = goal + a.normal * ((ra - rb * cosine) / sine2) + b.normal * ((rb - ra * cosine) / sine2);
  const Vec3d way = along / std::sqrt(sine2);
  double low = -std::numeric_limits<double>::infinity(), high = -low;
  for (const HalfSpace& s : spaces) {
    const double room = s.room(start), speed = dot(s.normal, way);
    if (std::abs(speed) <= 1e-12) {
      if (room < -slack) return std::nullopt;
    } else if (speed > 0) {
      low = std::max(low, -room / speed);
    } else {
      high = std::min(high, -room / speed);
    }
  }
  if (low > high + slack) return std::nullopt;
  return start + way * std::clamp(0.0, std::min(low, high), high);
}

/// On the plane of a.
std::optional<Vec3d> nearest_on_plane(std::span<const HalfSpace> spaces, const HalfSpace& a, Vec3d goal,
                                      double slack) noexcept {
  Vec3d x = goal - a.normal * a.room(goal);
  for (std::size_t k = 0; k < spaces.size(); ++k) {
    if (spaces[k].room(x) >= -slack) continue;
    const Vec3d along = cross(a.normal, spaces[k].normal);
    if (!(dot(along, along) > kParallel2)) return std::nullopt;
    const auto found = nearest_on_line(spaces.first(k), a, spaces[k], goal, slack);
    if (!found) return std::nullopt;
    x = *found;
  }
  return x;
}

}  // namespace

std::optional<Vec3d> nearest_in(std::span<const HalfSpace> spaces, Vec3d goal, double slack) noexcept {
  Vec3d x = goal;
  for (std::size_t k = 0; k < spaces.size(); ++k) {
    if (spaces[k].room(x) >= -slack) continue;
    const auto found = nearest_on_plane(spaces.first(k), spaces[k], goal, slack);
    if (!found) return std::nullopt;
    x = *found;
  }
  return x;
}

}  // namespace relief::detail
