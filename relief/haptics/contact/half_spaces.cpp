#include <relief/haptics/contact/half_spaces.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace relief::detail {
namespace {

constexpr std::size_t kFew = 12;  // half-spaces that are tried before all

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
    if (speed == 0) {
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
    if (!(dot(along, along) > 0)) return std::nullopt;
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

std::optional<Vec3d> nearest_in(std::span<const HalfSpace> spaces, Vec3d goal, double slack) noexcept {
  // What is nearest in a few of them and is in all is the answer.
  std::array<HalfSpace, kFew> few;
  Vec3d x = goal;
  for (std::size_t count = 0;; ++count) {
    double least = -slack;
    const HalfSpace* worst = nullptr;
    for (const HalfSpace& s : spaces)
      if (const double room = s.room(x); room < least) {
        least = room;
        worst = &s;
      }
    if (worst == nullptr) return x;
    if (count == few.size()) return by_increments(spaces, goal, slack);
    few[count] = *worst;
    const auto found = by_increments(std::span(few).first(count + 1), goal, slack);
    if (!found) return std::nullopt;
    x = *found;
  }
}

}  // namespace relief::detail
