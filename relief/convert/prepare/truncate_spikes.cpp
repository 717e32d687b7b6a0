#include <relief/convert/geometry/visibility.h>
#include <relief/convert/prepare/split_high_valence.h>
#include <relief/convert/prepare/truncate_spikes.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace relief::detail {
namespace {

constexpr double kShare = 0.25;           // of the shortest edge, at most
constexpr double kNarrowest = 64;         // lattice steps: less would turn the faces around by more than half a degree
constexpr std::uint32_t kMostEdges = 32;  // around a tip that is cut off

/// Returns how far to cut along the edges of each vertex; zero where it stays.
std::vector<double> widths_of(const ClosedSource& source, std::span<const std::uint32_t> vertices, double width) {
  std::vector<double> widths(source.points.size(), 0);
  const std::vector<std::uint32_t> edges = valences_of(source);
  for (const std::uint32_t v : vertices) widths[v] = width;
  for (const Face& f : source.faces)
    for (std::size_t k = 0; k < 3; ++k) {
      double& w = widths[f[k]];
      if (!(w > 0)) continue;
      w = std::min(w, kShare * length(to_double(source.points[f[(k + 1) % 3]] - source.points[f[k]])));
    }
  for (std::size_t v = 0; v < widths.size(); ++v)
    if (widths[v] < kNarrowest || edges[v] < 3 || edges[v] > kMostEdges) widths[v] = 0;
  // Where an edge has faces twice on one side the rim is not one ring.
  std::vector<std::array<std::uint32_t, 2>> out;
  for (const Face& f : source.faces)
    for (std::size_t k = 0; k < 3; ++k)
      if (widths[f[k]] > 0) out.push_back({f[k], f[(k + 1) % 3]});
  std::sort(out.begin(), out.end());
  for (std::size_t k = 1; k < out.size(); ++k)
    if (out[k] == out[k - 1]) widths[out[k][0]] = 0;
  return widths;
}

/// Holds an edge of the hole that a tip leaves, in the direction of the patch, and the face beyond the edge.
struct RimEdge {
  std::uint32_t tip, from, to;
  Vec3d beyond;  ///< the face's unit normal
  bool phantom;
};

using CapTriangle = std::array<std::size_t, 3>;  // numbers in the rim

/// Triangulates a polygon without new points so that its triangles bend as little as can be against each other and
/// against those beyond its edges. O(k^4).
class Cap {
 public:
  /// `power`: how much more a sharp bend counts than several slight ones.
  Cap(std::span<const Vec3d> places, std::span<const RimEdge> rim, double power)
      : k_(rim.size()), power_(power), places_(places), rim_(rim), ways_(k_ * k_ * k_) {}

  [[nodiscard]] std::vector<CapTriangle> triangles() {
    for (std::size_t span = 2; span < k_; ++span)
      for (std::size_t i = 0; i + span < k_; ++i)
        for (std::size_t m = i + 1; m < i + span; ++m) find(i, m, i + span);
    std::vector<CapTriangle> found, open = {{0, best_apex(0, k_ - 1, rim_[k_ - 1].beyond), k_ - 1}};
    while (!open.empty()) {
      const auto [i, m, j] = open.back();
      open.pop_back();
      found.push_back({i, m, j});
      if (m > i + 1) open.push_back({i, way(i, m, j).left, m});
      if (j > m + 1) open.push_back({m, way(i, m, j).right, j});
    }
    return found;
  }

 private:
  /// The triangle (i, m, j), i < m < j, and the best ones beyond its other edges.
  struct Way {
    double cost = 0;
    Vec3d normal;
    std::size_t left = 0, right = 0;  ///< their apexes
  };
  [[nodiscard]] Way& way(std::size_t i, std::size_t m, std::size_t j) { return ways_[(i * k_ + m) * k_ + j]; }

  /// Small where two triangles lie flat, large where one folds back over the other.
  [[nodiscard]] double bend(Vec3d a, Vec3d b) const noexcept { return std::pow(std::max(0.0, 1 - dot(a, b)), power_); }
  /// Of what lies on the inner side of the chord from i to j, seen from a triangle with this normal.
  [[nodiscard]] std::size_t best_apex(std::size_t i, std::size_t j, Vec3d normal) {
    std::size_t best = i + 1;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t m = i + 1; m < j; ++m) {
      const double cost = way(i, m, j).cost + bend(normal, way(i, m, j).normal);
      if (cost < least) least = cost, best = m;
    }
    return best;
  }
  [[nodiscard]] double cost_of(std::size_t i, std::size_t apex, std::size_t j, Vec3d normal) {
    if (j == i + 1) return bend(normal, rim_[i].beyond);
    return way(i, apex, j).cost + bend(normal, way(i, apex, j).normal);
  }
  void find(std::size_t i, std::size_t m, std::size_t j) {
    constexpr double kThin = 1e-3, kFlat = 1e4;
    const Vec3d a = places_[i], b = places_[m], c = places_[j];
    const Vec3d n = cross(b - a, c - a);
    const double area = length(n), squares = dot(b - a, b - a) + dot(c - b, c - b) + dot(a - c, a - c);
    Way& here = way(i, m, j);
    here.normal = area > 0 ? n / area : Vec3d{};
    here.cost = area > kThin * squares ? kThin * squares / area : kFlat;
    if (m > i + 1) here.left = best_apex(i, m, here.normal);
    if (j > m + 1) here.right = best_apex(m, j, here.normal);
    here.cost += cost_of(i, here.left, m, here.normal) + cost_of(m, here.right, j, here.normal);
  }

  std::size_t k_;
  double power_;
  std::span<const Vec3d> places_;
  std::span<const RimEdge> rim_;
  std::vector<Way> ways_;
};

/// Returns how well the faces around the point of a rim that is seen worst are seen once a cap closes it.
double least_visibility(std::span<const Vec3d> places, std::span<const RimEdge> rim, std::span<const CapTriangle> cap) {
  double least = 1;
  std::vector<Vec3d> normals;
  for (std::size_t v = 0; v < rim.size(); ++v) {
    normals = {rim[v].beyond, rim[(v + rim.size() - 1) % rim.size()].beyond};
    for (const auto& [i, m, j] : cap)
      if (v == i || v == m || v == j)
        normals.push_back(normalized(cross(places[m] - places[i], places[j] - places[i])));
    least = std::min(least, best_direction(normals).visibility);
  }
  return least;
}

/// Returns the first cap that is seen well enough, or the one that is seen best.
std::vector<CapTriangle> find_cap(std::span<const Vec3d> places, std::span<const RimEdge> rim) {
  constexpr std::array<double, 5> kPowers = {4, 2, 1, 8, 0.5};
  constexpr double kEnough = 0.15;
  std::vector<CapTriangle> best;
  double most = -2;
  for (const double power : kPowers) {
    std::vector<CapTriangle> cap = Cap(places, rim, power).triangles();
    const double seen = least_visibility(places, rim, cap);
    if (seen <= most) continue;
    most = seen;
    best = std::move(cap);
    if (most >= kEnough) break;
  }
  return best;
}

}  // namespace

std::size_t truncate_spikes(ClosedSource& source, std::span<const std::uint32_t> vertices, double width) {
  const std::vector<double> widths = widths_of(source, vertices, width);
  const auto is_tip = [&](std::uint32_t v) { return widths[v] > 0; };
  struct EdgePoint {
    std::uint32_t tip, towards, point;
    auto operator<=>(const EdgePoint&) const = default;
  };
  std::vector<EdgePoint> edge_points;
  std::vector<std::uint32_t> around;  // faces
  for (std::uint32_t f = 0; f < source.faces.size(); ++f) {
    const Face& t = source.faces[f];
    if (!std::ranges::any_of(t, is_tip)) continue;
    around.push_back(f);
    for (std::size_t k = 0; k < 3; ++k)
      if (is_tip(t[k])) edge_points.push_back({t[k], t[(k + 1) % 3], 0});
  }
  std::sort(edge_points.begin(), edge_points.end());
  for (EdgePoint& e : edge_points) {
    e.point = static_cast<std::uint32_t>(source.points.size());
    const Vec3d from = to_double(source.points[e.tip]), to = to_double(source.points[e.towards]);
    source.points.push_back(snap(from + normalized(to - from) * widths[e.tip]));
  }
  const auto point_on = [&](std::uint32_t tip, std::uint32_t towards) {
    return std::lower_bound(edge_points.begin(), edge_points.end(), EdgePoint{tip, towards, 0})->point;
  };

  const auto add = [&](Face face, bool patch, bool phantom) {
    source.faces.push_back(face);
    source.patch.push_back(patch);
    source.phantom.push_back(phantom);
  };
  std::vector<RimEdge> edges;
  std::vector<std::uint32_t> corners;
  for (const std::uint32_t f : around) {
    const Face t = source.faces[f];
    const bool patch = source.patch[f] != 0, phantom = source.phantom[f] != 0;
    const Vec3d a = to_double(source.points[t[0]]);
    const Vec3d n = normalized(cross(to_double(source.points[t[1]]) - a, to_double(source.points[t[2]]) - a));
    corners.clear();
    for (std::size_t k = 0; k < 3; ++k) {
      corners.push_back(is_tip(t[k]) ? point_on(t[k], t[(k + 2) % 3]) : t[k]);
      if (!is_tip(t[k])) continue;
      corners.push_back(point_on(t[k], t[(k + 1) % 3]));
      edges.push_back({t[k], corners.back(), corners[corners.size() - 2], n, phantom});
    }
    source.faces[f] = {corners[0], corners[1], corners[2]};
    for (std::size_t k = 3; k < corners.size(); ++k) add({corners[0], corners[k - 1], corners[k]}, patch, phantom);
  }

  // One edge begins at each point of a rim.
  std::sort(edges.begin(), edges.end(),
            [](const RimEdge& a, const RimEdge& b) { return a.tip != b.tip ? a.tip < b.tip : a.from < b.from; });
  std::size_t count = 0;
  std::vector<RimEdge> rim;
  std::vector<Vec3d> places;
  for (std::size_t k = 0; k < edges.size(); k += rim.size(), ++count) {
    rim.assign(1, edges[k]);
    places.assign(1, to_double(source.points[rim[0].from]));
    while (rim.back().to != rim[0].from && rim.size() < kMostEdges) {
      const auto next = std::lower_bound(
          edges.begin(), edges.end(), rim.back(),
          [](const RimEdge& a, const RimEdge& b) { return a.tip != b.tip ? a.tip < b.tip : a.from < b.to; });
      rim.push_back(*next);
      places.push_back(to_double(source.points[next->from]));
    }
    const auto phantoms = std::ranges::count_if(rim, &RimEdge::phantom);
    for (const auto& [i, m, j] : find_cap(places, rim))
      add({rim[i].from, rim[m].from, rim[j].from}, true, 2 * static_cast<std::size_t>(phantoms) > rim.size());
  }
  return count;
}

}  // namespace relief::detail
