#include <relief/convert/geometry/half_edges.h>
#include <relief/convert/remesh/sheets.h>
#include <relief/convert/support/parallel.h>

#include <algorithm>
#include <cmath>

namespace relief::detail {
namespace {

constexpr double kClosedOff = 0.7;   // mean winding number just behind the skin of a solid
constexpr double kJustBehind = 0.1;  // voxels
constexpr double kHalfSheet = 1;     // voxels: half the thickness that a sheet gets
constexpr double kMostAside = 2;     // at a fold the corners move so many times that far, to keep the sides there

/// Per point the step to the upper side: as long as brings it so far off the planes of the triangles around.
std::vector<Vec3d> offsets(const std::vector<Vec3d>& points, const std::vector<Triangle>& triangles) {
  std::vector<Vec3d> normals, sum(points.size());
  for (const Triangle& t : triangles) {
    normals.push_back(normalized(cross(points[t[1]] - points[t[0]], points[t[2]] - points[t[0]])));
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d a = points[t[(k + 1) % 3]] - points[t[k]], b = points[t[(k + 2) % 3]] - points[t[k]];
      sum[t[k]] += normals.back() * std::atan2(length(cross(a, b)), dot(a, b));
    }
  }
  std::vector<double> least(points.size(), 1);
  for (Vec3d& s : sum) s = normalized(s);
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (const std::uint32_t v : triangles[t]) least[v] = std::min(least[v], dot(sum[v], normals[t]));
  for (std::size_t v = 0; v < sum.size(); ++v) sum[v] *= kHalfSheet / std::max(least[v], 1 / kMostAside);
  return sum;
}

}  // namespace

std::vector<std::uint8_t> find_sheets(const Skin& skin, const Components& parts) {
  constexpr std::uint32_t kMost = 64;  // places looked at, of one part
  std::vector<std::uint32_t> size(parts.count, 0), seen(parts.count, 0);
  for (const std::uint32_t part : parts.of_face) ++size[part];
  std::vector<std::uint32_t> chosen;
  for (std::uint32_t t = 0; t < skin.triangles().size(); ++t) {
    const std::uint32_t part = parts.of_face[t];
    if (seen[part]++ % ((size[part] + kMost - 1) / kMost) == 0) chosen.push_back(t);
  }
  std::vector<double> behind(chosen.size());
  for_all(chosen.size(), 64, {}, [&](std::size_t k) {
    const auto& [a, b, c] = skin.triangles()[chosen[k]];
    const Vec3d middle = (skin.points()[a] + skin.points()[b] + skin.points()[c]) / 3.0;
    behind[k] = skin.winding(middle - skin.normal(chosen[k]) * kJustBehind);
  });
  std::vector<double> sum(parts.count, 0), count(parts.count, 0);
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const std::uint32_t part = parts.of_face[chosen[k]];
    sum[part] += behind[k];
    ++count[part];
  }
  std::vector<std::uint8_t> is_sheet(parts.count, 0);
  for (std::size_t p = 0; p < is_sheet.size(); ++p) is_sheet[p] = sum[p] < kClosedOff * count[p] ? 1 : 0;
  return is_sheet;
}

void thicken_sheets(std::vector<Vec3d>& points, std::vector<Triangle>& triangles, const Components& parts,
                    const std::vector<std::uint8_t>& is_sheet) {
  std::vector<Triangle> solid, sheet;
  for (std::size_t t = 0; t < triangles.size(); ++t)
    (is_sheet[parts.of_face[t]] != 0 ? sheet : solid).push_back(triangles[t]);
  const std::vector<std::uint32_t> twins = find_twins(sheet, points.size());
  const std::vector<Vec3d> offset = offsets(points, sheet);
  std::vector<std::uint8_t> is_of_sheet(points.size(), 0);
  for (const Triangle& t : sheet)
    for (const std::uint32_t v : t) is_of_sheet[v] = 1;
  std::vector<std::uint32_t> lower(points.size(), kNone);
  for (std::uint32_t v = 0, count = static_cast<std::uint32_t>(points.size()); v < count; ++v) {
    if (is_of_sheet[v] == 0) continue;
    lower[v] = static_cast<std::uint32_t>(points.size());
    points.push_back(points[v] - offset[v]);
    points[v] += offset[v];
  }
  for (const Triangle& t : sheet) {
    solid.push_back(t);
    solid.push_back({lower[t[0]], lower[t[2]], lower[t[1]]});
  }
  for (std::uint32_t h = 0; h < twins.size(); ++h) {
    if (twins[h] != kNone) continue;
    const std::uint32_t from = sheet[h / 3][h % 3], to = sheet[h / 3][next_of(h) % 3];
    solid.push_back({to, from, lower[from]});
    solid.push_back({to, lower[from], lower[to]});
  }
  triangles = std::move(solid);
}

}  // namespace relief::detail
