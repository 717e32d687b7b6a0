#include <relief/convert/geometry/components.h>
#include <relief/convert/geometry/shell.h>
#include <relief/convert/prepare/hole_filling.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <utility>

namespace relief::detail {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;
using Loop = std::vector<std::uint32_t>;

constexpr double kFlattest = 0.01;  // of the squares of its edges: with less area a triangle costs no more
constexpr double kFlips = 1e-6;     // radians beyond a half turn: else two triangles of a rectangle flip for ever
constexpr int kMostSweeps = 400;    // of a patch that is drawn taut
constexpr double kSettled = 1e-3;   // of the mean edge of the rim: a sweep that moves all points less is the last

/// Small for compact triangles, large for long and for flat ones; grows with the area.
double cost_of(Vec3d a, Vec3d b, Vec3d c) noexcept {
  const Vec3d e = b - a, f = c - b, g = a - c;
  const double squares = dot(e, e) + dot(f, f) + dot(g, g);
  const double area = length(cross(e, f));
  return squares * squares / std::max(area, kFlattest * squares);
}

/// Returns how much dearer a triangle is that folds back over another across their common edge; unit normals, or zero
/// where nothing is known.
double fold_factor(Vec3d a, Vec3d b) noexcept {
  const double bend = 1 - dot(a, b);
  return dot(a, a) > 0 && dot(b, b) > 0 ? bend * bend * bend * bend : 0;
}

/// One patch in the making. Faces and points go straight into the surface's arrays; those of the patch come last.
class Patch {
 public:
  /// `taken`: the edges that the surface has between points of the rim, sorted. `across`: per edge of the rim the
  /// surface's normal beyond it.
  Patch(std::vector<Vec3d>& points, std::vector<Face>& faces, const Loop& rim, const std::vector<Edge>& taken,
        std::vector<Vec3d> across)
      : points_(points),
        faces_(faces),
        first_point_(static_cast<std::uint32_t>(points.size())),
        first_shaped_(faces.size()),
        loop_(rim),
        across_(std::move(across)),
        taken_(taken) {
    for (std::size_t k = 0; k < loop_.size(); ++k) rim_.emplace_back(loop_[k], scale_along_loop(k));
    std::sort(rim_.begin(), rim_.end());
  }

  void membrane() {
    while (loop_.size() > kMostAtOnce) halve();
    triangulate();
    for (int pass = 0; pass < 12; ++pass) {
      const bool split = refine();
      relax();
      if (!split) break;
    }
    settle();
    relax();
    settle();
  }

  /// Walls along the direction down to its level, row by row, each step twice as high as the last; leaves the lowest
  /// ring to be closed by a membrane.
  void walls(Vec3d direction, double level) {
    double mean = 0, deepest = 0;
    for (std::size_t k = 0; k < loop_.size(); ++k) {
      mean += scale(loop_[k]) / double(loop_.size());
      deepest = std::max(deepest, level - dot(direction, at(k)));
    }
    int rows = 1;
    while (rows < 24 && mean * (std::ldexp(1.0, rows) - 1) < deepest) ++rows;
    const Loop top = loop_;
    for (int row = 1; row <= rows; ++row) {
      const double share = (std::ldexp(1.0, row) - 1) / (std::ldexp(1.0, rows) - 1);
      Loop below;
      for (const std::uint32_t v : top)
        below.push_back(add(points_[v] + direction * (share * (level - dot(direction, points_[v]))), 0));
      const std::size_t count = loop_.size();
      for (std::size_t k = 0; k < count; ++k) {
        const std::uint32_t a = loop_[k], b = loop_[(k + 1) % count], c = below[k], d = below[(k + 1) % count];
        faces_.push_back({a, b, c});
        faces_.push_back({b, d, c});
      }
      loop_ = std::move(below);
    }
    for (std::size_t k = 0; k < loop_.size(); ++k) scale(loop_[k]) = scale_along_loop(k);
    across_.assign(loop_.size(), {});
    // The walls stand; only the floor is still to be shaped.
    first_free_ = static_cast<std::uint32_t>(points_.size());
    first_shaped_ = faces_.size();
  }

 private:
  static constexpr std::size_t kMostAtOnce = 100;

  [[nodiscard]] Vec3d at(std::size_t k) const noexcept { return points_[loop_[k % loop_.size()]]; }
  [[nodiscard]] double scale_along_loop(std::size_t k) const noexcept {
    return 0.5 * (length(at(k + 1) - at(k)) + length(at(k) - at(k + loop_.size() - 1)));
  }
  /// Returns how long edges are to be around a point of the patch.
  double& scale(std::uint32_t v) {
    if (v >= first_point_) return new_scales_[v - first_point_];
    return std::lower_bound(rim_.begin(), rim_.end(), std::pair(v, 0.0))->second;
  }
  std::uint32_t add(Vec3d p, double scale) {
    points_.push_back(p);
    new_scales_.push_back(scale);
    return static_cast<std::uint32_t>(points_.size() - 1);
  }
  [[nodiscard]] bool taken(std::uint32_t u, std::uint32_t v) const {
    return std::binary_search(taken_.begin(), taken_.end(), Edge(std::minmax(u, v)));
  }

  /// A belt along the inside of the loop, to a ring with half its points.
  void halve() {
    const std::size_t count = loop_.size(), half = count / 2;
    Loop ring;
    for (std::size_t j = 0; j < half; ++j) {
      const std::size_t last = j + 1 == half ? count : 2 * j + 2;
      Vec3d sum;
      double scales = 0;
      for (std::size_t k = 2 * j; k < last; ++k) {
        sum += at(k);
        scales += scale(loop_[k]);
      }
      ring.push_back(add(sum / double(last - 2 * j), 2 * scales / double(last - 2 * j)));
      for (std::size_t k = 2 * j; k < last; ++k) faces_.push_back({loop_[k], loop_[(k + 1) % count], ring[j]});
    }
    for (std::size_t j = 0; j < half; ++j) {
      const std::size_t last = j + 1 == half ? count : 2 * j + 2;
      faces_.push_back({ring[j], loop_[last % count], ring[(j + 1) % half]});
    }
    loop_ = std::move(ring);
    across_.assign(half, {});
  }

  /// A triangulation of the loop without new points whose costs sum up to little, folds counted [Liepa 2003].
  void triangulate() {
    const std::size_t count = loop_.size();
    std::vector<Vec3d> normal(count * count);  // of the triangle chosen at each chord, or across the rim's edge
    for (std::size_t k = 0; k < count; ++k) normal[k * count + (k + 1) % count] = across_[k];
    std::vector<double> cost(count * count, 0);
    std::vector<std::uint32_t> middle(count * count, kNone);
    for (std::size_t span = 2; span < count; ++span)
      for (std::size_t i = 0; i + span < count; ++i) {
        const std::size_t j = i + span;
        double best = std::numeric_limits<double>::infinity();
        const bool chord = !(i == 0 && j + 1 == count);
        if (!(chord && taken(loop_[i], loop_[j])))
          for (std::size_t m = i + 1; m < j; ++m) {
            const double sum = cost[i * count + m] + cost[m * count + j];
            if (!(sum < best)) continue;
            const Vec3d n = normalized(cross(at(m) - at(i), at(j) - at(i)));
            const double folds = fold_factor(n, normal[i * count + m]) + fold_factor(n, normal[m * count + j]) +
                                 (chord ? 0 : fold_factor(n, across_[count - 1]));
            const double all = sum + (1 + folds) * cost_of(at(i), at(m), at(j));
            if (all < best) {
              best = all;
              middle[i * count + j] = static_cast<std::uint32_t>(m);
              normal[i * count + j] = n;
            }
          }
        cost[i * count + j] = best;
      }
    if (middle[count - 1] == kNone) {
      // Every way is barred by edges of the surface: a fan around a new point needs none.
      Vec3d sum;
      double scales = 0;
      for (std::size_t k = 0; k < count; ++k) {
        sum += at(k);
        scales += scale(loop_[k]);
      }
      const std::uint32_t hub = add(sum / double(count), scales / double(count));
      for (std::size_t k = 0; k < count; ++k) faces_.push_back({loop_[k], loop_[(k + 1) % count], hub});
      return;
    }
    std::vector<std::pair<std::size_t, std::size_t>> open = {{0, count - 1}};
    while (!open.empty()) {
      const auto [i, j] = open.back();
      open.pop_back();
      if (j < i + 2) continue;
      const std::size_t m = middle[i * count + j];
      faces_.push_back({loop_[i], loop_[m], loop_[j]});
      open.emplace_back(i, m);
      open.emplace_back(m, j);
    }
  }

  /// Puts a point into every triangle that is large for its corners' scales [Liepa 2003]; scales grow inwards.
  bool refine() {
    constexpr double kDense = 1.4, kGrowth = 1.25;
    const std::size_t count = faces_.size();
    bool any = false;
    for (std::size_t f = first_shaped_; f < count; ++f) {
      const Face t = faces_[f];
      const Vec3d centre = (points_[t[0]] + points_[t[1]] + points_[t[2]]) / 3.0;
      const double here = kGrowth * (scale(t[0]) + scale(t[1]) + scale(t[2])) / 3;
      bool large = true;
      for (const std::uint32_t v : t) {
        const double far = kDense * length(centre - points_[v]);
        large = large && far > here && far > scale(v);
      }
      if (!large) continue;
      const std::uint32_t c = add(centre, here);
      faces_[f] = {t[0], t[1], c};
      faces_.push_back({t[1], t[2], c});
      faces_.push_back({t[2], t[0], c});
      any = true;
    }
    return any;
  }

  /// Flips edges whose opposite angles sum to more than half a turn, as long as there are any (within bounds).
  void relax() {
    for (int pass = 0; pass < 20; ++pass) {
      find_edges();
      bool any = false;
      for (std::size_t e = 0; e + 1 < half_edges_.size(); ++e) {
        const HalfEdge &one = half_edges_[e], &two = half_edges_[e + 1];
        if (one.ends != two.ends) continue;
        Face &f = faces_[one.face], &g = faces_[two.face];
        // Earlier flips of this pass may have moved the edge elsewhere.
        const auto corner = [](const Face& face, Edge ends) {
          std::size_t k = 0;
          while (k < 3 && Edge(std::minmax(face[k], face[(k + 1) % 3])) != ends) ++k;
          return k;
        };
        const std::size_t i = corner(f, one.ends), j = corner(g, one.ends);
        if (i == 3 || j == 3) continue;
        const std::uint32_t u = f[i], v = f[(i + 1) % 3], a = f[(i + 2) % 3], b = g[(j + 2) % 3];
        if (g[j] != v || a == b) continue;
        if (!(angle_at(a, u, v) + angle_at(b, u, v) > std::numbers::pi + kFlips)) continue;
        if (taken(a, b) || joined(a, b)) continue;
        f = {u, b, a};
        g = {b, v, a};
        flipped_.insert(std::minmax(a, b));
        any = true;
      }
      if (!any) return;
    }
  }
  [[nodiscard]] double angle_at(std::uint32_t p, std::uint32_t u, std::uint32_t v) const noexcept {
    const Vec3d a = points_[u] - points_[p], b = points_[v] - points_[p];
    return std::atan2(length(cross(a, b)), dot(a, b));
  }
  [[nodiscard]] bool joined(std::uint32_t a, std::uint32_t b) const {
    const Edge edge = std::minmax(a, b);
    const auto found = std::lower_bound(half_edges_.begin(), half_edges_.end(), edge,
                                        [](const HalfEdge& h, const Edge& e) { return h.ends < e; });
    return (found != half_edges_.end() && found->ends == edge) || flipped_.contains(edge);
  }
  void find_edges() {
    half_edges_.clear();
    flipped_.clear();
    for (std::size_t f = first_shaped_; f < faces_.size(); ++f)
      for (std::size_t k = 0; k < 3; ++k) half_edges_.push_back({std::minmax(faces_[f][k], faces_[f][(k + 1) % 3]), f});
    std::sort(half_edges_.begin(), half_edges_.end(), [](const HalfEdge& a, const HalfEdge& b) {
      return a.ends != b.ends ? a.ends < b.ends : a.face < b.face;
    });
  }

  /// Moves every new point to the mean of its neighbours, over and over: the patch becomes taut.
  void settle() {
    const std::uint32_t first = std::max(first_free_, first_point_);
    if (first == points_.size()) return;
    find_edges();
    std::vector<std::vector<std::uint32_t>> around(points_.size() - first);
    for (std::size_t e = 0; e < half_edges_.size(); ++e) {
      const auto [u, v] = half_edges_[e].ends;
      if (e > 0 && half_edges_[e - 1].ends == half_edges_[e].ends) continue;
      if (u >= first) around[u - first].push_back(v);
      if (v >= first) around[v - first].push_back(u);
    }
    double size = 0;
    for (const auto& [v, s] : rim_) size += s / double(rim_.size());
    for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
      double most = 0;
      for (std::size_t step = 0; step < around.size(); ++step) {
        const std::size_t k = sweep % 2 == 0 ? step : around.size() - 1 - step;
        Vec3d sum;
        for (const std::uint32_t w : around[k]) sum += points_[w];
        const Vec3d to = sum / double(around[k].size());
        most = std::max(most, length(to - points_[first + k]));
        points_[first + k] = to;
      }
      if (most < kSettled * size) break;
    }
  }

  struct HalfEdge {
    Edge ends;
    std::size_t face;
  };
  std::vector<Vec3d>& points_;
  std::vector<Face>& faces_;
  std::uint32_t first_point_, first_free_ = 0;
  std::size_t first_shaped_;
  Loop loop_;                                          // what is still open
  std::vector<Vec3d> across_;                          // per edge of the loop, the normal beyond it where it is known
  std::vector<std::pair<std::uint32_t, double>> rim_;  // its points and their scales, sorted
  std::vector<double> new_scales_;
  const std::vector<Edge>& taken_;
  std::vector<HalfEdge> half_edges_;
  std::set<Edge> flipped_;
};

/// The faces once more, shifted and turned round, and walls between their rims.
void add_offset_copy(std::vector<Vec3d>& points, std::vector<Face>& faces, std::span<const Face> front, const Loop& rim,
                     Vec3d shift) {
  std::vector<std::uint32_t> behind(points.size(), kNone);
  for (const Face& f : front) {
    for (const std::uint32_t v : f) {
      if (behind[v] != kNone) continue;
      behind[v] = static_cast<std::uint32_t>(points.size());
      points.push_back(points[v] + shift);
    }
    faces.push_back({behind[f[0]], behind[f[2]], behind[f[1]]});
  }
  for (std::size_t k = 0; k < rim.size(); ++k) {
    const std::uint32_t a = rim[k], b = rim[(k + 1) % rim.size()];
    faces.push_back({a, b, behind[a]});
    faces.push_back({b, behind[b], behind[a]});
  }
}

/// Returns the unit normal of the plane that best holds a rim, out of the opening.
Vec3d rim_normal(std::span<const Vec3d> points, const Loop& rim) noexcept {
  Vec3d sum;
  const Vec3d origin = points[rim.front()];
  for (std::size_t k = 0; k < rim.size(); ++k)
    sum += cross(points[rim[k]] - origin, points[rim[(k + 1) % rim.size()]] - origin);
  return normalized(sum);
}

}  // namespace

std::vector<std::vector<std::uint32_t>> find_boundary_loops(std::size_t point_count, std::span<const Face> faces) {
  // An edge with one triangle only: sorted by its ends, it stands alone.
  struct HalfEdge {
    std::uint32_t low, high, from;
  };
  std::vector<HalfEdge> edges;
  edges.reserve(3 * faces.size());
  for (const Face& f : faces)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(f[k], f[(k + 1) % 3]);
      edges.push_back({low, high, f[k]});
    }
  std::sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return a.low != b.low ? a.low < b.low : a.high != b.high ? a.high < b.high : a.from < b.from;
  });
  std::vector<std::uint32_t> next(point_count, kNone);  // against the surface's half-edge
  const auto same = [](const HalfEdge& a, const HalfEdge& b) { return a.low == b.low && a.high == b.high; };
  for (std::size_t e = 0; e < edges.size(); ++e) {
    if ((e > 0 && same(edges[e - 1], edges[e])) || (e + 1 < edges.size() && same(edges[e], edges[e + 1]))) continue;
    const std::uint32_t to = edges[e].from == edges[e].low ? edges[e].high : edges[e].low;
    next[to] = edges[e].from;
  }
  std::vector<Loop> rims;
  std::vector<std::uint8_t> seen(point_count, 0);
  for (std::uint32_t v = 0; v < point_count; ++v) {
    if (next[v] == kNone || seen[v] != 0) continue;
    Loop rim;
    for (std::uint32_t w = v; w != kNone && seen[w] == 0; w = next[w]) {
      seen[w] = 1;
      rim.push_back(w);
    }
    rims.push_back(std::move(rim));
  }
  return rims;
}

std::vector<std::size_t> fill_holes(std::vector<Vec3d>& points, std::vector<Face>& faces,
                                    std::span<const std::vector<std::uint32_t>> rims,
                                    std::span<const Closing> closings) {
  const std::size_t surface_points = points.size();
  std::vector<std::uint32_t> rim_of(surface_points, kNone);
  for (std::uint32_t r = 0; r < rims.size(); ++r)
    for (const std::uint32_t v : rims[r]) rim_of[v] = r;
  std::vector<std::vector<Edge>> taken(rims.size());
  std::vector<std::uint32_t> place_in_rim(surface_points, 0);
  std::vector<std::vector<Vec3d>> across(rims.size());
  for (std::size_t r = 0; r < rims.size(); ++r) {
    across[r].resize(rims[r].size());
    for (std::uint32_t k = 0; k < rims[r].size(); ++k) place_in_rim[rims[r][k]] = k;
  }
  for (const Face& f : faces)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t u = f[k], v = f[(k + 1) % 3], r = rim_of[u];
      if (r == kNone || r != rim_of[v]) continue;
      taken[r].push_back(std::minmax(u, v));
      if (rims[r][(place_in_rim[v] + 1) % rims[r].size()] == u)
        across[r][place_in_rim[v]] = normalized(cross(points[f[1]] - points[f[0]], points[f[2]] - points[f[0]]));
    }
  Components parts;
  std::vector<std::uint32_t> part_of(surface_points, kNone);
  if (std::ranges::any_of(closings, [](Closing c) { return c.kind != Closing::Patch; })) {
    parts = find_components(surface_points, faces);
    for (std::size_t f = 0; f < faces.size(); ++f)
      for (const std::uint32_t v : faces[f]) part_of[v] = parts.of_face[f];
  }
  std::vector<std::size_t> begins;
  for (std::size_t r = 0; r < rims.size(); ++r) {
    begins.push_back(faces.size());
    if (rims[r].size() < 3) continue;
    if (closings[r].kind == Closing::OffsetCopy) {
      std::vector<Face> part;
      for (std::size_t f = 0; f < begins[0]; ++f)
        if (parts.of_face[f] == part_of[rims[r].front()]) part.push_back(faces[f]);
      for (std::size_t other = 0; other < r; ++other)
        if (part_of[rims[other].front()] == part_of[rims[r].front()])
          part.insert(part.end(), faces.begin() + static_cast<std::ptrdiff_t>(begins[other]),
                      faces.begin() + static_cast<std::ptrdiff_t>(begins[other + 1]));
      add_offset_copy(points, faces, part, rims[r], rim_normal(points, rims[r]) * closings[r].depth);
      continue;
    }
    std::sort(taken[r].begin(), taken[r].end());
    Patch patch(points, faces, rims[r], taken[r], std::move(across[r]));
    if (closings[r].kind == Closing::Box) {
      constexpr double kBeyond = 0.1;  // of the part's extent
      const Vec3d normal = rim_normal(points, rims[r]);
      double low = Box3d::kFar, high = -Box3d::kFar;
      for (std::size_t v = 0; v < surface_points; ++v) {
        if (part_of[v] != part_of[rims[r].front()]) continue;
        low = std::min(low, dot(normal, points[v]));
        high = std::max(high, dot(normal, points[v]));
      }
      double width = 0;
      for (const std::uint32_t v : rims[r]) width = std::max(width, length(points[v] - points[rims[r].front()]));
      patch.walls(normal, high + kBeyond * std::max(high - low, 0.5 * width));
    }
    patch.membrane();
  }
  begins.push_back(faces.size());
  return begins;
}

}  // namespace relief::detail
