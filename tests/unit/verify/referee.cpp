#include "referee.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Exact_rational.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relief::verify {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Number = CGAL::Exact_rational;
using Corner = Kernel::Point_3;
using Flat = Kernel::Triangle_3;
using Point = std::array<double, 3>;
using Face = std::array<std::uint32_t, 3>;

Corner corner(const Point& p) { return {p[0], p[1], p[2]}; }

Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

struct Exact {
  Number x, y, z;
};
Exact minus(const Exact& a, const Exact& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Exact cross(const Exact& a, const Exact& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Number dot(const Exact& a, const Exact& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

class Referee {
 public:
  explicit Referee(const Shell& shell)
      : inner_(shell.inner.begin(), shell.inner.end()),
        outer_(shell.outer.begin(), shell.outer.end()),
        faces_(shell.triangles.begin(), shell.triangles.end()) {}

  Verdict judge() {
    verdict_.holds[0] = complex_holds();
    if (!verdict_.holds[0]) return verdict_;
    find_parts();
    judge_jacobians();
    judge_windings();
    judge_pairs();
    judge_nesting();
    return verdict_;
  }

 private:
  [[nodiscard]] std::set<std::uint32_t>& failing(std::size_t condition) { return verdict_.slabs[condition]; }
  /// The corner of a slab that a fibre is, or 3.
  [[nodiscard]] std::size_t corner_of(std::size_t slab, std::uint32_t fibre) const {
    const Face& f = faces_[slab];
    return static_cast<std::size_t>(std::find(f.begin(), f.end(), fibre) - f.begin());
  }
  [[nodiscard]] bool runs(std::size_t slab, std::uint32_t from, std::uint32_t to) const {
    const std::size_t k = corner_of(slab, from);
    return k < 3 && faces_[slab][(k + 1) % 3] == to;
  }
  [[nodiscard]] std::size_t shared_fibres(std::size_t s, std::size_t t) const {
    return static_cast<std::size_t>(
        std::count_if(faces_[s].begin(), faces_[s].end(), [&](std::uint32_t f) { return corner_of(t, f) < 3; }));
  }
  [[nodiscard]] std::vector<std::size_t> slabs_at(std::uint32_t fibre) const {
    std::vector<std::size_t> slabs;
    for (std::size_t s = 0; s < faces_.size(); ++s)
      if (corner_of(s, fibre) < 3) slabs.push_back(s);
    return slabs;
  }
  /// Whether an edge has a slab on either side.
  [[nodiscard]] bool is_inside(std::uint32_t from, std::uint32_t to) const {
    bool forth = false, back = false;
    for (std::size_t s = 0; s < faces_.size(); ++s) {
      forth = forth || runs(s, from, to);
      back = back || runs(s, to, from);
    }
    return forth && back;
  }

  /// C0: at most one slab runs through an edge in each way, and from any slab at a fibre one comes to all others
  /// through walls at this fibre.
  [[nodiscard]] bool complex_holds() const {
    if (faces_.empty()) return false;
    for (std::size_t s = 0; s < faces_.size(); ++s) {
      const Face& f = faces_[s];
      if (f[0] == f[1] || f[1] == f[2] || f[2] == f[0]) return false;
      for (std::size_t t = 0; t < s; ++t) {
        if (shared_fibres(s, t) == 3) return false;
        for (std::size_t k = 0; k < 3; ++k)
          if (runs(t, f[k], f[(k + 1) % 3])) return false;
      }
    }
    for (std::uint32_t fibre = 0; fibre < inner_.size(); ++fibre) {
      const std::vector<std::size_t> slabs = slabs_at(fibre);
      if (slabs.empty() || inner_[fibre] == outer_[fibre]) return false;
      if (grown(slabs, slabs.front()).size() != slabs.size()) return false;
    }
    return true;
  }
  /// Those of the slabs to which one comes from `start` through walls.
  [[nodiscard]] std::set<std::size_t> grown(const std::vector<std::size_t>& slabs, std::size_t start) const {
    std::set<std::size_t> reached = {start};
    for (std::size_t before = 0; before != reached.size();) {
      before = reached.size();
      for (const std::size_t s : slabs)
        if (std::any_of(reached.begin(), reached.end(), [&](std::size_t t) { return shared_fibres(s, t) == 2; }))
          reached.insert(s);
    }
    return reached;
  }

  void find_parts() {
    constexpr std::size_t kNone = ~std::size_t{0};
    part_.assign(faces_.size(), kNone);
    for (std::size_t seed = 0; seed < faces_.size(); ++seed) {
      if (part_[seed] != kNone) continue;
      std::vector<std::size_t> waiting = {seed};
      part_[seed] = closed_.size();
      bool closed = true;
      while (!waiting.empty()) {
        const Face f = faces_[waiting.back()];
        waiting.pop_back();
        for (std::size_t k = 0; k < 3; ++k) {
          bool found = false;
          for (std::size_t t = 0; t < faces_.size(); ++t) {
            if (!runs(t, f[(k + 1) % 3], f[k])) continue;
            found = true;
            if (part_[t] != kNone) continue;
            part_[t] = closed_.size();
            waiting.push_back(t);
          }
          closed = closed && found;
        }
      }
      closed_.push_back(closed);
    }
    verdict_.parts = closed_.size();
  }
  void fail_part(std::size_t condition, std::size_t part) {
    for (std::uint32_t s = 0; s < faces_.size(); ++s)
      if (part_[s] == part) failing(condition).insert(s);
  }

  /// C1: a slab's Jacobian is linear in the weights, so it is least over a fibre of a corner, where it is a quadratic
  /// in alpha. Three values give the quadratic, and with it the place and value of its minimum.
  void judge_jacobians() {
    for (std::uint32_t s = 0; s < faces_.size(); ++s) {
      std::array<Exact, 3> normals;  // at alpha 0, 1/2 and 1
      for (int step = 0; step < 3; ++step) {
        const auto at = [&](std::size_t k) {
          const std::uint32_t f = faces_[s][k];
          const auto between = [&](std::size_t c) {
            const Number from(inner_[f][c]), to(outer_[f][c]);
            return Number(from + (to - from) * Number(step) / Number(2));
          };
          return Exact{between(0), between(1), between(2)};
        };
        const Exact first = at(0);
        normals[static_cast<std::size_t>(step)] = cross(minus(at(1), first), minus(at(2), first));
      }
      bool dips = false, folded = false;
      for (const std::uint32_t f : faces_[s]) {
        const Exact along = {Number(outer_[f][0]) - Number(inner_[f][0]), Number(outer_[f][1]) - Number(inner_[f][1]),
                             Number(outer_[f][2]) - Number(inner_[f][2])};
        const Number start = dot(normals[0], along), middle = dot(normals[1], along), end = dot(normals[2], along);
        if (start <= 0 || end <= 0) {
          folded = true;
          continue;
        }
        const Number square = 2 * (start + end - 2 * middle), linear = end - start - square;
        if (square <= 0) continue;  // no minimum
        const Number place = -linear / (2 * square);
        if (place > 0 && place < 1 && start + linear * place + square * place * place <= 0) dips = true;
      }
      if (folded || dips) failing(1).insert(s);
      if (dips && !folded) verdict_.dips = true;
    }
    verdict_.holds[1] = failing(1).empty();
  }

  /// C2: the angles by which the slabs turn about a fibre, seen along it, add up to a full turn, or to less than one
  /// where the fibre lies at the rim.
  void judge_windings() {
    bool all_asked = true;
    for (std::uint32_t fibre = 0; fibre < inner_.size(); ++fibre) {
      const std::vector<std::size_t> slabs = slabs_at(fibre);
      if (std::any_of(slabs.begin(), slabs.end(),
                      [&](std::size_t s) { return failing(1).contains(static_cast<std::uint32_t>(s)); })) {
        all_asked = false;
        continue;
      }
      Point along = minus(outer_[fibre], inner_[fibre]);
      const double length = std::sqrt(dot(along, along));
      for (double& c : along) c /= length;
      double turn = 0;
      bool at_rim = false;
      for (const std::size_t s : slabs) {
        const std::size_t k = corner_of(s, fibre);
        const std::uint32_t next = faces_[s][(k + 1) % 3], last = faces_[s][(k + 2) % 3];
        const Point a = minus(inner_[next], inner_[fibre]), b = minus(inner_[last], inner_[fibre]);
        turn += std::atan2(dot(along, cross(a, b)), dot(a, b) - dot(a, along) * dot(b, along));
        at_rim = at_rim || !is_inside(fibre, next) || !is_inside(fibre, last);
      }
      const double turns = turn / (2 * std::numbers::pi);
      if (at_rim ? turns < 1 : std::round(turns) == 1) {
        verdict_.undecided = verdict_.undecided || (at_rim && 1 - turns < 1e-9);
        continue;
      }
      verdict_.undecided = verdict_.undecided || (at_rim && turns - 1 < 1e-9);
      for (const std::size_t s : slabs) failing(2).insert(static_cast<std::uint32_t>(s));
    }
    verdict_.holds[2] = all_asked && failing(2).empty();
  }

  /// C3: of inner and outer triangles no two have a point in common, but those of one side that share a fibre; the
  /// inner and the outer triangles of a closed part enclose volumes of one sign.
  void judge_pairs() {
    const std::size_t count = faces_.size();
    bool all_asked = true;
    std::vector<Flat> triangles;
    for (const auto* ends : {&inner_, &outer_})
      for (const Face& f : faces_)
        triangles.emplace_back(corner((*ends)[f[0]]), corner((*ends)[f[1]]), corner((*ends)[f[2]]));
    std::vector<CGAL::Bbox_3> boxes;
    std::vector<bool> flat;
    for (const Flat& t : triangles) {
      boxes.push_back(t.bbox());
      flat.push_back(t.is_degenerate());
      if (flat.back()) all_asked = false;
    }
    for (std::size_t k = 0; k < triangles.size(); ++k)
      for (std::size_t l = k + 1; l < triangles.size(); ++l) {
        if (flat[k] || flat[l] || !CGAL::do_overlap(boxes[k], boxes[l])) continue;
        const std::size_t s = k % count, t = l % count;
        const bool one_side = (k < count) == (l < count);
        if (one_side && shared_fibres(s, t) > 0) {
          if (meet_beyond(triangles[k], triangles[l], s, t)) verdict_.covers_twice = true;
          continue;
        }
        if (!CGAL::do_intersect(triangles[k], triangles[l])) continue;
        failing(3).insert({static_cast<std::uint32_t>(s), static_cast<std::uint32_t>(t)});
      }
    if (all_asked && failing(3).empty()) judge_volumes();
    verdict_.holds[3] = all_asked && failing(3).empty();
  }
  /// Whether two triangles that share one or two corners meet beyond these.
  [[nodiscard]] bool meet_beyond(const Flat& a, const Flat& b, std::size_t s, std::size_t t) const {
    const auto alone = [&](std::size_t one, std::size_t other) {  // corners of the one that the other lacks
      std::vector<int> corners;
      for (std::size_t k = 0; k < 3; ++k)
        if (corner_of(other, faces_[one][k]) == 3) corners.push_back(static_cast<int>(k));
      return corners;
    };
    const std::vector<int> of_a = alone(s, t), of_b = alone(t, s);
    if (of_a.size() == 2)
      return CGAL::do_intersect(Kernel::Segment_3(a[of_a[0]], a[of_a[1]]), b) ||
             CGAL::do_intersect(Kernel::Segment_3(b[of_b[0]], b[of_b[1]]), a);
    const Corner &from = a[of_a[0] + 1], &to = a[of_a[0] + 2], &p = a[of_a[0]], &q = b[of_b[0]];
    return CGAL::coplanar(from, to, p, q) && CGAL::coplanar_orientation(from, to, p, q) == CGAL::POSITIVE;
  }

  void judge_volumes() {
    for (std::size_t part = 0; part < closed_.size(); ++part) {
      if (!closed_[part]) continue;
      const auto sign_of = [&](const std::vector<Point>& ends) {
        Number volume(0);  // six times
        for (std::size_t s = 0; s < faces_.size(); ++s) {
          if (part_[s] != part) continue;
          const auto exact = [&](std::size_t k) {
            const Point& p = ends[faces_[s][k]];
            return Exact{Number(p[0]), Number(p[1]), Number(p[2])};
          };
          volume += dot(cross(exact(0), exact(1)), exact(2));
        }
        return volume > 0 ? 1 : volume < 0 ? -1 : 0;
      };
      const int in = sign_of(inner_), out = sign_of(outer_);
      if (in == out && in != 0) continue;
      verdict_.differs = true;
      fail_part(3, part);
    }
  }

  /// C4: no end of a fibre lies where the inner and outer triangles of another, closed part wind differently.
  void judge_nesting() {
    if (!verdict_.holds[3]) return;
    for (std::size_t part = 0; part < closed_.size(); ++part)
      for (std::size_t other = 0; other < closed_.size(); ++other) {
        if (part == other || !closed_[other]) continue;
        std::set<std::uint32_t> fibres;
        for (std::size_t s = 0; s < faces_.size(); ++s)
          if (part_[s] == part) fibres.insert(faces_[s].begin(), faces_[s].end());
        const bool reaches = std::any_of(fibres.begin(), fibres.end(), [&](std::uint32_t f) {
          return between(inner_[f], other) || between(outer_[f], other);
        });
        if (!reaches) continue;
        fail_part(4, part);
        fail_part(4, other);
      }
    verdict_.holds[4] = failing(4).empty();
  }
  [[nodiscard]] bool between(const Point& p, std::size_t part) {
    return winding(p, inner_, part) != winding(p, outer_, part);
  }
  /// The sum of the solid angles in which the triangles are seen, in whole spheres.
  [[nodiscard]] int winding(const Point& p, const std::vector<Point>& ends, std::size_t part) {
    double sum = 0;
    for (std::size_t s = 0; s < faces_.size(); ++s) {
      if (part_[s] != part) continue;
      const Point a = minus(ends[faces_[s][0]], p), b = minus(ends[faces_[s][1]], p), c = minus(ends[faces_[s][2]], p);
      const double al = std::sqrt(dot(a, a)), bl = std::sqrt(dot(b, b)), cl = std::sqrt(dot(c, c));
      sum += 2 * std::atan2(dot(cross(a, b), c), al * bl * cl + dot(a, b) * cl + dot(b, c) * al + dot(c, a) * bl);
    }
    const double turns = sum / (4 * std::numbers::pi);
    if (std::abs(turns - std::round(turns)) > 1e-3) verdict_.undecided = true;
    return static_cast<int>(std::lround(turns));
  }

  std::vector<Point> inner_, outer_;
  std::vector<Face> faces_;
  std::vector<std::size_t> part_;  // by slab
  std::vector<bool> closed_;       // by part
  Verdict verdict_;
};

}  // namespace

Verdict judge(const Shell& shell) { return Referee(shell).judge(); }

std::optional<std::set<std::uint32_t>> slabs_met(const Shell& shell, const Source& source) {
  const auto flat = [](const Triples<double>& at, const Face& f) {
    return Flat(corner(at[f[0]]), corner(at[f[1]]), corner(at[f[2]]));
  };
  std::vector<Flat> surface;
  std::vector<CGAL::Bbox_3> boxes;
  for (const Face& f : source.triangles) {
    surface.push_back(flat(source.positions, f));
    boxes.push_back(surface.back().bbox());
    if (surface.back().is_degenerate()) return std::nullopt;
  }
  std::set<std::uint32_t> met;
  for (std::uint32_t s = 0; s < shell.triangles.size(); ++s)
    for (const Triples<double>& ends : {shell.inner, shell.outer}) {
      const Flat triangle = flat(ends, shell.triangles[s]);
      const CGAL::Bbox_3 box = triangle.bbox();
      if (triangle.is_degenerate()) return std::nullopt;
      for (std::size_t t = 0; t < surface.size(); ++t)
        if (CGAL::do_overlap(box, boxes[t]) && CGAL::do_intersect(triangle, surface[t])) met.insert(s);
    }
  return met;
}

Meetings::Meetings(const Source& source) {
  for (const Face& f : source.triangles)
    triangles_.push_back({source.positions[f[0]], source.positions[f[1]], source.positions[f[2]]});
}

std::optional<Meetings::Count> Meetings::count(const Point& from, const Point& to) const {
  constexpr double kNear = 1e-10;  // of volumes, where lengths are about one
  const Point along = minus(to, from);
  Count met;
  for (const auto& [p, q, r] : triangles_) {
    const Point a = minus(p, from), b = minus(q, from), c = minus(r, from);
    const Point ab = cross(a, b);
    const double start = dot(ab, c), end = start - dot(along, cross(minus(q, p), minus(r, p)));
    if ((start > kNear && end > kNear) || (start < -kNear && end < -kNear)) continue;
    const double over_ab = dot(along, ab), over_bc = dot(along, cross(b, c)), over_ca = dot(along, cross(c, a));
    const double low = std::min({over_ab, over_bc, over_ca}), high = std::max({over_ab, over_bc, over_ca});
    if (low < -kNear && high > kNear) continue;
    const bool clear = std::abs(start) > kNear && std::abs(end) > kNear && (low > kNear || high < -kNear);
    if (!clear) return std::nullopt;
    ++(start > 0 ? met.outwards : met.inwards);
  }
  return met;
}

}  // namespace relief::verify
