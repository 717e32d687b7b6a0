#include <relief/convert/geometry/visibility.h>
#include <relief/convert/prepare/coincident_points.h>
#include <relief/convert/shell/initial_shell.h>

#include <algorithm>
#include <bit>
#include <span>
#include <utility>
#include <vector>

namespace relief::detail {
namespace {

/// Per point the first one that lies where it does, kNone where no other one does. Only points that faces name count.
std::vector<std::uint32_t> find_coincident_points(const ClosedSource& source) {
  const std::span<const LatticePoint> points = source.points;
  std::vector<std::uint8_t> named(points.size(), 0);
  for (const Face& f : source.faces)
    for (const std::uint32_t v : f) named[v] = 1;
  std::vector<std::uint32_t> table(std::bit_ceil(2 * points.size() + 16), kNone);
  const std::size_t mask = table.size() - 1;
  std::vector<std::uint32_t> touched(points.size(), kNone);
  for (std::uint32_t v = 0; v < points.size(); ++v) {
    if (named[v] == 0) continue;
    const LatticePoint p = points[v];
    std::uint64_t code = static_cast<std::uint32_t>(p.x);
    for (const std::int32_t next : {p.y, p.z}) code = (code ^ code >> 29U) * 0xbf58476d1ce4e5b9U + std::uint32_t(next);
    code = (code ^ code >> 29U) * 0x94d049bb133111ebU;
    std::size_t at = (code >> 20U) & mask;
    while (table[at] != kNone && !(points[table[at]] == p)) at = (at + 1) & mask;
    if (table[at] == kNone) {
      table[at] = v;
    } else {
      touched[v] = touched[table[at]] = table[at];
    }
  }
  return touched;
}

/// The triangles around a point, each as the unit vectors along its edges there and its unit normal.
struct Fan {
  struct Wing {
    Vec3d from, to, normal;
  };
  std::uint32_t point = 0;
  double shortest = Box3d::kFar;  // edge
  std::vector<Wing> wings;
  Vec3d direction;  // that sees them all, if any does

  /// Returns how many of the wings of another fan at identical coordinates lie in the solid behind these, less those in
  /// front of them.
  [[nodiscard]] int holds(const Fan& other) const noexcept {
    constexpr double kOn = 1e-6;  // sine: nearer to a face than this counts as on it
    int held = 0;
    for (const Wing& wing : other.wings) {
      const Vec3d at = wing.from + wing.to;
      for (const Wing& mine : wings) {
        // Along the direction, each place lies over or under one of them.
        if (dot(cross(mine.from, at), direction) < 0 || dot(cross(at, mine.to), direction) < 0) continue;
        const double over = dot(mine.normal, at);
        held += int(over < -kOn) - int(over > kOn);
        break;
      }
    }
    return held;
  }
};

}  // namespace

std::size_t separate_coincident_points(ClosedSource& source, double farthest) {
  constexpr double kGap = 0.1;                    // of the shortest edge: moves no face over another
  constexpr double kLeastGap = 4 * kLeastHeight;  // lattice steps: two slabs of the least height, each on its own side
  constexpr double kRounding = 1;                 // lattice steps that snapping may add
  const std::vector<std::uint32_t> touched = find_coincident_points(source);
  struct Corner {
    std::uint32_t place, point, face;
    auto operator<=>(const Corner&) const = default;
  };
  std::vector<Corner> corners;
  for (std::uint32_t f = 0; f < source.faces.size(); ++f)
    for (const std::uint32_t v : source.faces[f])
      if (touched[v] != kNone) corners.push_back({touched[v], v, f});
  std::sort(corners.begin(), corners.end());
  // All are moved away from where they lay, not one after the other.
  std::vector<std::pair<std::uint32_t, LatticePoint>> moved;
  std::vector<Fan> fans;  // at one place
  std::vector<Vec3d> normals;
  for (std::size_t k = 0; k < corners.size();) {
    const std::uint32_t place = corners[k].place;
    const Vec3d at = to_double(source.points[place]);
    fans.clear();
    while (k < corners.size() && corners[k].place == place) {
      Fan& fan = fans.emplace_back();
      fan.point = corners[k].point;
      normals.clear();
      for (; k < corners.size() && corners[k].point == fan.point; ++k) {
        const Face& f = source.faces[corners[k].face];
        const std::size_t i = f[0] == fan.point ? 0 : f[1] == fan.point ? 1 : 2;
        const Vec3d from = to_double(source.points[f[(i + 1) % 3]]) - at,
                    to = to_double(source.points[f[(i + 2) % 3]]) - at;
        fan.shortest = std::min({fan.shortest, length(from), length(to)});
        normals.push_back(normalized(cross(from, to)));
        fan.wings.push_back({normalized(from), normalized(to), normals.back()});
      }
      fan.direction = best_direction(normals).d;
    }
    for (const Fan& fan : fans) {
      int held = 0;
      for (const Fan& other : fans)
        if (&other != &fan) held += fan.holds(other);
      const double by = std::max(kLeastGap, std::min(farthest - kRounding, kGap * fan.shortest));
      moved.emplace_back(fan.point, snap(at - fan.direction * (held > 0 ? -by : by)));
    }
  }
  for (const auto& [v, to] : moved) source.points[v] = to;
  return moved.size();
}

}  // namespace relief::detail
