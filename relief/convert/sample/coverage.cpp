#include <relief/convert/geometry/winding_number.h>
#include <relief/convert/sample/coverage.h>
#include <relief/convert/sample/spread.h>
#include <relief/convert/support/parallel.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace relief::detail {
namespace {

// Of the diagonal. So far to either side of the surface the winding number is asked for: beyond what repair moves, and
// nearer than sheets lie as a rule.
constexpr double kBeside = 1e-5;

constexpr double kInwards = 1e-3;  // from a corner to the middle of its triangle
// Of the diagonal. What lies nearer to the surface lies on it; what is farther off is hidden or missing, or was moved.
constexpr double kOn = 1e-6;

Vec3d normal_of(const TriangleMesh& mesh, const Triangle& t) {
  const Vec3d a = mesh.positions[t[0]], n = cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a);
  return dot(n, n) > 0 ? normalized(n) : Vec3d{};
}

}  // namespace

std::vector<SourcePlace> corners_of(const TriangleMesh& source) {
  std::vector<std::uint8_t> seen(source.positions.size(), 0);
  std::vector<SourcePlace> places;
  for (const Triangle& t : source.triangles) {
    const Vec3d middle = (source.positions[t[0]] + source.positions[t[1]] + source.positions[t[2]]) / 3.0;
    for (const std::uint32_t v : t) {
      if (seen[v] != 0 || !is_finite(source.positions[v]) || !is_finite(middle)) continue;
      seen[v] = 1;
      places.push_back({source.positions[v] + (middle - source.positions[v]) * kInwards, normal_of(source, t)});
    }
  }
  return places;
}

std::vector<SourcePlace> places_of(const TriangleMesh& source) {
  std::vector<SourcePlace> places;
  for (const SpreadPoint& p : spread_over(source.positions, source.triangles, kPlaces))
    places.push_back({p.at, normal_of(source, source.triangles[p.face])});
  return places;
}

ConvertReport::Coverage measure_coverage(const std::vector<SourcePlace>& places, const CoveredBy& by,
                                         const Progress& progress) {
  std::vector<double> away(places.size(), 0);  // shares of the diagonal
  for_all(places.size(), 64, progress, [&](std::size_t k) {
    away[k] = by.rays.nearest(by.lattice.to_lattice(places[k].at)).distance * by.lattice.step / by.diagonal;
  });
  std::vector<std::uint8_t> hidden(places.size(), 0);
  if (std::ranges::any_of(away, [](double d) { return d > kOn; })) {
    const WindingNumber winding(by.solid.positions, by.solid.triangles);
    const double step = kBeside * by.diagonal;
    for_all(places.size(), 16, progress, [&](std::size_t k) {
      const auto& [at, n] = places[k];
      hidden[k] = away[k] > kOn && winding.at(at + n * step) > WindingNumber::kInside &&
                  winding.at(at - n * step) > WindingNumber::kInside;
    });
  }
  std::vector<std::uint8_t> missing(places.size(), 0);
  for_all(places.size(), 64, progress,
          [&](std::size_t k) { missing[k] = hidden[k] == 0 && by.is_missing(places[k], away[k]); });
  ConvertReport::Coverage coverage;
  double farthest_missing = -1;
  for (std::size_t k = 0; k < places.size(); ++k) {
    if (hidden[k] != 0) continue;
    ++coverage.places;
    if (missing[k] == 0) {
      coverage.farthest = std::max(coverage.farthest, away[k]);
      continue;
    }
    ++coverage.missed;
    if (away[k] > farthest_missing) farthest_missing = away[k], coverage.missing_near = places[k].at;
  }
  if (!places.empty()) coverage.hidden = double(places.size() - coverage.places) / double(places.size());
  if (coverage.places > 0) coverage.share = 1 - double(coverage.missed) / double(coverage.places);
  return coverage;
}

}  // namespace relief::detail
