#include <relief/base/free_memory.h>
#include <relief/convert/decimate.h>
#include <relief/convert/directions.h>
#include <relief/convert/quadric.h>
#include <relief/convert/sort_unique.h>
#include <relief/convert/triangle_grid.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace relief::detail {
namespace {

constexpr std::uint32_t kNone = 0xffffffffU;

struct Guards {
  double normal;  ///< least cosine between a face before and after
  double shape;
  double visibility;
  bool apart;  ///< no two faces may come to meet
};

}  // namespace

/// The mesh that is being collapsed.
class Collapser {
 public:
  Collapser(std::span<const Vec3d> points, std::span<const Face> faces) : at_(points.begin(), points.end()) {
    faces_.assign(faces.begin(), faces.end());
    alive_ = faces_.size();
    build_fans();
    mark_rims();
    build_quadrics();
    stamp_.assign(at_.size(), 0);
    mark_.assign(at_.size(), 0);
    parent_.resize(at_.size());
    for (std::uint32_t v = 0; v < parent_.size(); ++v) parent_[v] = v;
  }

  /// Collapses edges below a rising cost in the order in which they lie in memory, at most one per vertex and round:
  /// the order by cost matters little while there are many, and neither a queue nor its memory is needed. Stops where
  /// little goes any more. False when cancelled.
  bool sweep(std::size_t target, const Guards& guards, const Progress& progress, double from, double to);
  /// False when cancelled.
  bool run(std::size_t target, const Guards& guards, bool exact, const Progress& progress, double from, double to);
  void to_lattice();
  /// Moves vertices that hardly see their faces, or turns edges around them, where that helps and brings no faces to
  /// meet. Stops where faces lie in such a heap that this would take longer than all the collapses.
  void mend(double visibility);
  /// Drops the numbers of dead faces and points.
  void compact();
  void weigh_errors(std::span<const double> importance);

  [[nodiscard]] std::size_t point_count() const noexcept { return at_.size(); }
  [[nodiscard]] Decimation::Result result() const;

 private:
  struct Fan {
    std::uint32_t begin = 0, count = 0, room = 0;
  };
  struct Candidate {
    double cost;
    std::uint32_t u, v, stamp_u, stamp_v;
    bool weighed;  ///< cost already holds the penalty for bad shape and visibility
    // The heap of the standard library keeps the greatest on top; equal costs go by number.
    friend bool operator<(const Candidate& a, const Candidate& b) noexcept {
      if (a.cost != b.cost) return a.cost > b.cost;
      return a.u != b.u ? a.u > b.u : a.v > b.v;
    }
  };
  /// Faces as they would be if u and v (which may be the same) stood at p.
  struct Change {
    std::uint32_t u, v;
    Vec3d p;
  };

  void build_fans();
  void mark_rims();
  void build_quadrics();
  void build_grid();
  void fill_queue();
  void push(std::uint32_t u, std::uint32_t v);

  [[nodiscard]] std::span<const std::uint32_t> fan(std::uint32_t v) const noexcept {
    return std::span(pool_).subspan(fans_[v].begin, fans_[v].count);
  }
  [[nodiscard]] bool has(std::uint32_t f, std::uint32_t v) const noexcept {
    return faces_[f][0] == v || faces_[f][1] == v || faces_[f][2] == v;
  }
  /// Whether one face only has both; asked of the end with fewer faces.
  [[nodiscard]] bool is_rim_edge(std::uint32_t u, std::uint32_t v) const noexcept {
    if (fans_[v].count < fans_[u].count) std::swap(u, v);
    int met = 0;
    for (const std::uint32_t f : fan(u)) met += has(f, v);
    return met == 1;
  }
  [[nodiscard]] std::array<Vec3d, 3> corners(std::uint32_t f) const noexcept {
    return {at_[faces_[f][0]], at_[faces_[f][1]], at_[faces_[f][2]]};
  }
  [[nodiscard]] std::array<Vec3d, 3> corners(std::uint32_t f, const Change& change) const noexcept {
    std::array<Vec3d, 3> c{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = faces_[f][k];
      c[k] = v == change.u || v == change.v ? change.p : at_[v];
    }
    return c;
  }
  /// A face that the change takes away: it has both u and v.
  [[nodiscard]] bool vanishes(std::uint32_t f, const Change& change) const noexcept {
    return change.u != change.v && has(f, change.u) && has(f, change.v);
  }
  template <typename Visit>
  void for_star(const Change& change, Visit&& visit) const {
    for (const std::uint32_t f : fan(change.u))
      if (!vanishes(f, change)) visit(f);
    if (change.u == change.v) return;
    for (const std::uint32_t f : fan(change.v))
      if (!vanishes(f, change)) visit(f);
  }

  bool link_allows(std::uint32_t u, std::uint32_t v);
  [[nodiscard]] double shape_after(const Change& change, const Guards& guards) const;
  /// Has so many faces that looking at them all in every step around it is not worth while.
  [[nodiscard]] bool is_hub(std::uint32_t v) const noexcept { return fans_[v].count > 200; }
  [[nodiscard]] double visibility_at(std::uint32_t w) const;
  [[nodiscard]] double visibility_at(std::uint32_t w, const Change& change) const;
  [[nodiscard]] double visibility_after(const Change& change, double wanted);
  [[nodiscard]] bool winds_once(const Change& change) const;
  [[nodiscard]] std::size_t meetings(const Change* change, std::uint32_t u, std::uint32_t v, std::size_t stop_at);
  [[nodiscard]] std::size_t meetings_after(const Change& change, std::size_t stop_at) {
    return meetings(&change, change.u, change.v, stop_at);
  }
  /// The penalty (1 for the best shapes) of a permitted change, or nothing.
  [[nodiscard]] std::optional<double> weigh(const Change& change, const Guards& guards);
  void apply(const Change& change);
  void moved(std::uint32_t v);
  void add_to_fan(std::uint32_t v, std::uint32_t f);
  void take_from_fan(std::uint32_t v, std::uint32_t f);
  /// Visibility, or less than -1 where the faces wind more than once.
  [[nodiscard]] double soundness(std::uint32_t v) const;
  bool mend_by_moving(std::uint32_t v, double visibility);
  bool mend_by_turning(std::uint32_t v, double visibility);
  bool mend_by_merging(std::uint32_t v, double visibility);

  std::vector<Vec3d> at_;
  std::vector<Face> faces_;  // a dead face has kNone as its first corner
  std::vector<Quadric> quadrics_;
  std::vector<Fan> fans_;
  std::vector<std::uint32_t> pool_;
  std::vector<std::uint8_t> rim_;
  std::vector<std::uint32_t> stamp_, mark_, parent_;
  std::uint32_t mark_round_ = 0;
  std::vector<Candidate> queue_;
  std::size_t alive_ = 0;
  bool exact_ = false;
  TriangleGrid grid_;
  std::vector<std::uint32_t> seen_;  // per face: the last query that met it
  std::uint32_t query_ = 0;
  std::size_t looks_ = 0;  // at faces that the grid gave, in all queries
  std::size_t grid_alive_ = 0, grid_entries_ = 0;
  mutable std::vector<Vec3d> normals_;
  struct Placed {
    std::uint32_t face;
    LatticeTriangle triangle;
    Box3d box = {};
  };
  std::vector<Placed> placed_;  // the star of a change
  std::vector<std::uint32_t> ring_;
};

void Collapser::build_fans() {
  fans_.assign(at_.size(), {});
  for (const Face& f : faces_)
    for (const std::uint32_t v : f) ++fans_[v].room;
  std::uint32_t begin = 0;
  for (Fan& fan : fans_) {
    fan.begin = begin;
    begin += fan.room;
  }
  pool_.resize(begin);
  for (std::uint32_t f = 0; f < faces_.size(); ++f)
    for (const std::uint32_t v : faces_[f]) pool_[fans_[v].begin + fans_[v].count++] = f;
}

void Collapser::mark_rims() {
  rim_.assign(at_.size(), 0);
  for (const Face& f : faces_)
    for (std::size_t k = 0; k < 3; ++k)
      if (is_rim_edge(f[k], f[(k + 1) % 3])) rim_[f[k]] = rim_[f[(k + 1) % 3]] = 1;
}

void Collapser::build_quadrics() {
  quadrics_.assign(at_.size(), {});
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    const auto [a, b, c] = corners(f);
    const Vec3d n = cross(b - a, c - a);
    const double twice_area = length(n);
    if (!(twice_area > 0)) continue;
    for (const std::uint32_t v : faces_[f]) quadrics_[v].add_plane(n / twice_area, a, twice_area / 6);
    // A rim is held in place by a plane through it, square to its face.
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t u = faces_[f][k], v = faces_[f][(k + 1) % 3];
      if (rim_[u] == 0 || rim_[v] == 0 || !is_rim_edge(u, v)) continue;
      const Vec3d across = normalized(cross(at_[v] - at_[u], n));
      const double weight = dot(at_[v] - at_[u], at_[v] - at_[u]);
      quadrics_[u].add_plane(across, at_[u], weight);
      quadrics_[v].add_plane(across, at_[u], weight);
    }
  }
}

void Collapser::push(std::uint32_t u, std::uint32_t v) {
  if (u > v) std::swap(u, v);
  Quadric q = quadrics_[u];
  q += quadrics_[v];
  const double cost = merge_ends(q, at_[u], at_[v]).cost;
  queue_.push_back({cost, u, v, stamp_[u], stamp_[v], false});
  std::push_heap(queue_.begin(), queue_.end());
}

void Collapser::fill_queue() {
  queue_.clear();
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    if (faces_[f][0] == kNone) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t u = faces_[f][k], v = faces_[f][(k + 1) % 3];
      if (u < v || (rim_[u] != 0 && rim_[v] != 0 && is_rim_edge(u, v))) push(u, v);
    }
  }
}

bool Collapser::link_allows(std::uint32_t u, std::uint32_t v) {
  if (fans_[u].count + fans_[v].count > 26) return false;
  ++mark_round_;
  std::size_t shared_faces = 0;
  for (const std::uint32_t f : fan(u)) {
    if (has(f, v)) {
      ++shared_faces;
      for (const std::uint32_t w : faces_[f])
        if (w != u && w != v && fans_[w].count <= (rim_[w] != 0 ? 1U : 3U)) return false;
    }
    for (const std::uint32_t w : faces_[f]) mark_[w] = mark_round_;
  }
  if (shared_faces == 0 || (shared_faces == 2 && rim_[u] != 0 && rim_[v] != 0)) return false;
  // Neighbours of both: exactly the far corners of the shared faces.
  mark_[u] = mark_[v] = 0;
  std::size_t shared = 0;
  for (const std::uint32_t f : fan(v))
    for (const std::uint32_t w : faces_[f])
      if (mark_[w] == mark_round_) {
        mark_[w] = 0;
        ++shared;
      }
  return shared == shared_faces;
}

// The least shape among the new faces; 0 when one breaks a guard.
double Collapser::shape_after(const Change& change, const Guards& guards) const {
  double least = 1, before = 1;
  bool good = true;
  for_star(change, [&](std::uint32_t f) {
    if (!good) return;
    const auto [a, b, c] = corners(f);
    const auto [p, q, r] = corners(f, change);
    const Vec3d old_normal = cross(b - a, c - a), normal = cross(q - p, r - p);
    const double old_size = length(old_normal), size = length(normal);
    if (!(size > 0) || (old_size > 0 && dot(normal, old_normal) < guards.normal * size * old_size)) {
      good = false;
      return;
    }
    least = std::min(least, shape_of(p, q, r, size));
    before = std::min(before, shape_of(a, b, c, old_size));
  });
  return good && (least >= guards.shape || least > 0.9 * before) ? least : 0;
}

double Collapser::visibility_at(std::uint32_t w) const { return visibility_at(w, {kNone, kNone, {}}); }

double Collapser::visibility_at(std::uint32_t w, const Change& change) const {
  normals_.clear();
  const auto add = [&](std::uint32_t f) {
    const auto [a, b, c] = corners(f, change);
    const Vec3d n = cross(b - a, c - a);
    const double size = length(n);
    if (size > 0) {
      normals_.push_back(n / size);
      return true;
    }
    return false;
  };
  if (w == change.u || w == change.v) {
    bool good = true;
    for_star(change, [&](std::uint32_t f) { good = add(f) && good; });
    if (!good) return -1;
  } else {
    for (const std::uint32_t f : fan(w))
      if (!vanishes(f, change) && !add(f)) return -1;
  }
  return best_direction(normals_).visibility;
}

// The least visibility of the vertex and its ring after the change, or -1 as soon as one is worse than both `wanted`
// and what it is now.
double Collapser::visibility_after(const Change& change, double wanted) {
  double least = visibility_at(change.u, change);
  if (least < wanted) {
    const double before = std::min(visibility_at(change.u), visibility_at(change.v));
    if (least <= before) return -1;
  }
  ring_.clear();
  for_star(change, [&](std::uint32_t f) {
    for (const std::uint32_t w : faces_[f])
      if (w != change.u && w != change.v) ring_.push_back(w);
  });
  sort_unique(ring_);
  for (const std::uint32_t w : ring_) {
    if (is_hub(w)) continue;
    const double visibility = visibility_at(w, change);
    if (visibility < wanted && visibility < visibility_at(w)) return -1;
    least = std::min(least, visibility);
  }
  return std::max(least, 0.01);
}

bool Collapser::winds_once(const Change& change) const {
  normals_.clear();
  std::array<std::pair<std::uint32_t, std::uint32_t>, 64> link;
  std::size_t count = 0;
  for_star(change, [&](std::uint32_t f) {
    const auto [a, b, c] = corners(f, change);
    normals_.push_back(normalized(cross(b - a, c - a)));
    const std::size_t k = faces_[f][0] == change.u || faces_[f][0] == change.v   ? 0
                          : faces_[f][1] == change.u || faces_[f][1] == change.v ? 1
                                                                                 : 2;
    if (count < link.size()) link[count++] = {faces_[f][(k + 1) % 3], faces_[f][(k + 2) % 3]};
  });
  if (count == 0 || count == link.size()) return false;
  const Vec3d d = best_direction(normals_).d;
  std::uint32_t first = link[0].first;
  bool open = false;
  for (std::size_t i = 0; i < count; ++i) {
    bool ends = false;
    for (std::size_t j = 0; j < count; ++j) ends = ends || link[j].second == link[i].first;
    if (!ends) {
      first = link[i].first;
      open = true;
    }
  }
  const auto side = [&](std::uint32_t w) {
    return w == first ? 0.0 : dot(d, cross(at_[first] - change.p, at_[w] - change.p));
  };
  int turns = 0;
  for (std::size_t i = 0; i < count; ++i) turns += side(link[i].first) < 0 && side(link[i].second) >= 0;
  return turns == (open ? 0 : 1);
}

// How many pairs of a face around u and v (as they would be after the change, if one is given) and another face that
// shares no vertex with it meet.
std::size_t Collapser::meetings(const Change* change, std::uint32_t u, std::uint32_t v, std::size_t stop_at) {
  Box3d box;
  placed_.clear();
  for_star(change != nullptr ? *change : Change{u, v, {}}, [&](std::uint32_t f) {
    const auto [a, b, c] = change != nullptr ? corners(f, *change) : corners(f);
    Placed& placed = placed_.emplace_back(Placed{f, {snap(a), snap(b), snap(c)}});
    for (const Vec3d p : {a, b, c}) placed.box.add(p);
    box.add(placed.box);
  });
  std::size_t count = 0;
  ++query_;
  grid_.query(box, [&](std::uint32_t g) {
    ++looks_;
    if (seen_[g] == query_) return true;
    seen_[g] = query_;
    if (faces_[g][0] == kNone || has(g, u) || has(g, v)) return true;
    const auto [a, b, c] = corners(g);
    Box3d other;
    for (const Vec3d p : {a, b, c}) other.add(p);
    if (!other.meets(box)) return true;
    std::optional<LatticeTriangle> t;
    for (const Placed& mine : placed_) {
      if (count >= stop_at) break;
      if (!mine.box.meets(other)) continue;
      bool adjacent = false;
      for (const std::uint32_t w : faces_[mine.face]) adjacent = adjacent || (w != u && w != v && has(g, w));
      if (adjacent) continue;
      if (!t) t = {snap(a), snap(b), snap(c)};
      if (triangles_meet(mine.triangle, *t)) ++count;
    }
    return count < stop_at;
  });
  return count;
}

std::optional<double> Collapser::weigh(const Change& change, const Guards& guards) {
  const double shape = shape_after(change, guards);
  if (!(shape > 0)) return std::nullopt;
  if (!exact_) return 1.0;
  const double visibility = visibility_after(change, guards.visibility);
  if (visibility < 0 || !winds_once(change)) return std::nullopt;
  if (guards.apart) {
    const std::size_t after = meetings_after(change, 1);
    if (after > 0) {
      const std::size_t before = meetings(nullptr, change.u, change.v, std::numeric_limits<std::size_t>::max());
      if (before == 0 || meetings_after(change, before) >= before) return std::nullopt;
    }
  }
  return 1 / std::sqrt(std::max(0.01, std::min(1.0, shape * 1.5)) * std::max(0.01, visibility));
}

void Collapser::moved(std::uint32_t v) {
  if (!exact_) return;
  for (const std::uint32_t f : fan(v)) {
    Box3d box;
    for (const Vec3d p : corners(f)) box.add(p);
    grid_.insert(f, box);
  }
}

void Collapser::apply(const Change& change) {
  const std::uint32_t u = change.u, v = change.v;
  if (u == v) {
    at_[u] = change.p;
    moved(u);
    return;
  }
  quadrics_[u] += quadrics_[v];
  at_[u] = change.p;
  if (rim_[v] != 0) rim_[u] = 1;
  // The new fan: what both had, less the faces between them.
  std::array<std::uint32_t, 64> list;
  std::size_t count = 0;
  for (const std::uint32_t f : fan(u)) {
    if (!has(f, v)) {
      list[count++] = f;
      continue;
    }
    const Face gone = faces_[f];
    for (const std::uint32_t w : gone) {
      if (w == u || w == v) continue;
      take_from_fan(w, f);
    }
    faces_[f][0] = kNone;
    --alive_;
  }
  for (const std::uint32_t f : fan(v)) {
    if (faces_[f][0] == kNone) continue;
    for (std::uint32_t& w : faces_[f])
      if (w == v) w = u;
    list[count++] = f;
  }
  Fan& mine = fans_[u];
  if (count > mine.room && count <= fans_[v].room) std::swap(mine, fans_[v]);
  if (count > mine.room) {
    mine.begin = static_cast<std::uint32_t>(pool_.size());
    mine.room = static_cast<std::uint32_t>(count);
    pool_.resize(pool_.size() + count);
  }
  std::copy_n(list.begin(), count, pool_.begin() + mine.begin);
  mine.count = static_cast<std::uint32_t>(count);
  fans_[v].count = 0;
  parent_[v] = u;
  ++stamp_[u];
  ++stamp_[v];
  moved(u);
}

void Collapser::take_from_fan(std::uint32_t v, std::uint32_t f) {
  Fan& fan = fans_[v];
  std::uint32_t* const first = pool_.data() + fan.begin;
  std::uint32_t* const hit = std::find(first, first + fan.count, f);
  std::copy(hit + 1, first + fan.count, hit);
  --fan.count;
}

void Collapser::add_to_fan(std::uint32_t v, std::uint32_t f) {
  Fan& fan = fans_[v];
  if (fan.count == fan.room) {
    const std::size_t begin = pool_.size();
    pool_.resize(begin + fan.count + 4);
    std::copy_n(pool_.begin() + fan.begin, fan.count, pool_.begin() + static_cast<std::ptrdiff_t>(begin));
    fan = {static_cast<std::uint32_t>(begin), fan.count, fan.count + 4};
  }
  pool_[fan.begin + fan.count++] = f;
}

void Collapser::build_grid() {
  double edges = 0;
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    if (faces_[f][0] == kNone) continue;
    const auto [a, b, c] = corners(f);
    edges += length(b - a);
  }
  grid_.build(faces_.size(), 1.5 * edges / double(std::max<std::size_t>(alive_, 1)), [&](std::uint32_t f) {
    Box3d box;
    if (faces_[f][0] == kNone) return box;
    for (const Vec3d p : corners(f)) box.add(p);
    return box;
  });
  seen_.assign(faces_.size(), 0);
  query_ = 0;
  grid_alive_ = alive_;
  grid_entries_ = grid_.entry_count();
}

bool Collapser::sweep(std::size_t target, const Guards& guards, const Progress& progress, double from, double to) {
  constexpr double kShare = 0.35;  // of the edges may go in a round
  constexpr std::size_t kStride = 7;
  const std::size_t start = alive_;
  const auto merge_of = [&](std::uint32_t u, std::uint32_t v) {
    Quadric q = quadrics_[u];
    q += quadrics_[v];
    return merge_ends(q, at_[u], at_[v]);
  };
  std::vector<double> costs;
  for (std::uint32_t round = 1; alive_ > target; ++round) {
    // An edge inside the surface has one face that runs through it upwards.
    costs.clear();
    std::size_t counter = 0;
    for (const Face& f : faces_)
      for (std::size_t k = 0; k < 3 && f[0] != kNone; ++k)
        if (f[k] < f[(k + 1) % 3] && ++counter % kStride == 0) costs.push_back(merge_of(f[k], f[(k + 1) % 3]).cost);
    if (costs.empty()) break;
    const auto middle = costs.begin() + static_cast<std::ptrdiff_t>(kShare * double(costs.size()));
    std::nth_element(costs.begin(), middle, costs.end());
    const double most = *middle;
    const std::size_t before = alive_;
    for (std::uint32_t f = 0; f < faces_.size() && alive_ > target; ++f) {
      if ((f & 4095U) == 0 && progress.cancelled()) return false;
      if ((f & 0x1ffffU) == 0)
        progress("decimate", from + (to - from) * double(start - alive_) / double(start - target));
      for (std::size_t k = 0; k < 3 && faces_[f][0] != kNone; ++k) {
        const std::uint32_t u = faces_[f][k], v = faces_[f][(k + 1) % 3];
        if (u > v || stamp_[u] == round || stamp_[v] == round) continue;
        const Merge merge = merge_of(u, v);
        if (merge.cost > most || !link_allows(u, v)) continue;
        for (const Vec3d place : {merge.place, at_[u], at_[v]})
          if (weigh({u, v, place}, guards)) {
            apply({u, v, place});
            stamp_[u] = round;
            break;
          }
      }
    }
    if (50 * (before - alive_) < before) break;
  }
  return true;
}

bool Collapser::run(std::size_t target, const Guards& guards, bool exact, const Progress& progress, double from,
                    double to) {
  exact_ = exact;
  if (alive_ <= target) return true;
  if (exact_) build_grid();
  fill_queue();
  const std::size_t start = alive_;
  std::size_t steps = 0;
  while (alive_ > target && !queue_.empty()) {
    if ((++steps & 255U) == 0) {
      if (progress.cancelled()) return false;
      if ((steps & 16383U) == 0)
        progress("decimate", from + (to - from) * double(start - alive_) / double(start - target));
    }
    std::pop_heap(queue_.begin(), queue_.end());
    const Candidate next = queue_.back();
    queue_.pop_back();
    const std::uint32_t u = next.u, v = next.v;
    if (next.stamp_u != stamp_[u] || next.stamp_v != stamp_[v] || fans_[u].count == 0 || fans_[v].count == 0) continue;
    if (!link_allows(u, v)) continue;

    Quadric q = quadrics_[u];
    q += quadrics_[v];
    const Vec3d middle = (at_[u] + at_[v]) * 0.5;
    const Vec3d edge = at_[v] - at_[u];
    Vec3d best = q.optimum(middle);
    if (dot(best - middle, best - middle) > 2.25 * dot(edge, edge)) best = middle;
    const std::array<Vec3d, 3> places = {best, at_[u], at_[v]};
    for (const Vec3d place : places) {
      const Change change = {u, v, exact_ ? to_double(snap(place)) : place};
      const auto penalty = weigh(change, guards);
      if (!penalty) continue;
      if (exact_ && !next.weighed) {
        const double cost = (q.error(change.p) + 5e-5 * q.trace() * dot(edge, edge) + 1e-12 * length(edge)) * *penalty;
        if (!queue_.empty() && cost > queue_.front().cost) {
          queue_.push_back({cost, u, v, next.stamp_u, next.stamp_v, true});
          std::push_heap(queue_.begin(), queue_.end());
          break;
        }
      }
      apply(change);
      // Every neighbour once.
      ++mark_round_;
      mark_[u] = mark_round_;
      for (const std::uint32_t f : fan(u))
        for (const std::uint32_t w : faces_[f])
          if (mark_[w] != mark_round_) {
            mark_[w] = mark_round_;
            push(u, w);
          }
      if (exact_ && (2 * alive_ < grid_alive_ || grid_.entry_count() > 3 * grid_entries_)) build_grid();
      break;
    }
  }
  return true;
}

void Collapser::to_lattice() {
  for (Vec3d& p : at_) p = to_double(snap(p));
}

void Collapser::compact() {
  std::vector<std::uint32_t> number(at_.size(), kNone);
  std::uint32_t count = 0;
  for (std::uint32_t v = 0; v < at_.size(); ++v) {
    if (fans_[v].count == 0) continue;
    number[v] = count;
    at_[count] = at_[v];
    quadrics_[count] = quadrics_[v];
    rim_[count] = rim_[v];
    ++count;
  }
  at_.resize(count);
  at_.shrink_to_fit();
  quadrics_.resize(count);
  quadrics_.shrink_to_fit();
  rim_.resize(count);
  std::erase_if(faces_, [](const Face& f) { return f[0] == kNone; });
  faces_.shrink_to_fit();
  for (Face& f : faces_)
    for (std::uint32_t& v : f) v = number[v];
  build_fans();
  stamp_.assign(count, 0);
  mark_.assign(count, 0);
  mark_round_ = 0;
  parent_.resize(count);
  for (std::uint32_t v = 0; v < count; ++v) parent_[v] = v;
  free_memory(queue_);
}

void Collapser::weigh_errors(std::span<const double> importance) {
  for (std::size_t v = 0; v < quadrics_.size(); ++v) quadrics_[v] *= importance[v];
}

Decimation::Result Collapser::result() const {
  Decimation::Result out;
  std::vector<std::uint32_t> number(at_.size(), kNone);
  for (const Face& f : faces_) {
    if (f[0] == kNone) continue;
    Face g{};
    for (std::size_t k = 0; k < 3; ++k) {
      if (number[f[k]] == kNone) {
        number[f[k]] = static_cast<std::uint32_t>(out.base.points.size());
        out.base.points.push_back(snap(at_[f[k]]));
      }
      g[k] = number[f[k]];
    }
    out.base.faces.push_back(g);
  }
  out.went_to.resize(at_.size());
  for (std::uint32_t v = 0; v < at_.size(); ++v) {
    std::uint32_t end = v;
    while (parent_[end] != end) end = parent_[end];
    out.went_to[v] = number[end];
  }
  return out;
}

double Collapser::soundness(std::uint32_t v) const {
  const double visibility = visibility_at(v);
  return winds_once({v, v, at_[v]}) ? visibility : visibility - 2;
}

bool Collapser::mend_by_moving(std::uint32_t v, double visibility) {
  const double before = soundness(v);
  Vec3d sum{};
  double neighbours = 0;
  for (const std::uint32_t f : fan(v))
    for (const std::uint32_t w : faces_[f])
      if (w != v) {
        sum += at_[w];
        ++neighbours;
      }
  const Vec3d to_middle = sum / neighbours - at_[v];
  const double reach = length(to_middle);
  Change best = {v, v, at_[v]};
  double best_soundness = before + 0.01;
  for (const double share : {0.25, 0.5, 0.9, 1.3})
    for (int turn = 0; turn < 7; ++turn) {
      // Towards the middle of the neighbours, and to six places around there.
      Vec3d to = at_[v] + to_middle * share;
      if (turn > 0) to[static_cast<std::size_t>((turn - 1) / 2)] += reach * (turn % 2 == 0 ? 0.5 : -0.5);
      const Change change = {v, v, to_double(snap(to))};
      const double after = visibility_at(v, change) - (winds_once(change) ? 0 : 2);
      if (after <= best_soundness || visibility_after(change, visibility) < 0 || meetings_after(change, 1) > 0)
        continue;
      best = change;
      best_soundness = after;
    }
  if (best_soundness <= before + 0.01) return false;
  apply(best);
  return true;
}

bool Collapser::mend_by_turning(std::uint32_t v, double visibility) {
  // Every edge of every face around v: those at v and those opposite.
  const std::vector<std::uint32_t> around(fan(v).begin(), fan(v).end());
  for (const std::uint32_t f : around)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t p = faces_[f][k], q = faces_[f][(k + 1) % 3], a = faces_[f][(k + 2) % 3];
      std::uint32_t g = kNone;
      for (const std::uint32_t other : fan(p))
        if (other != f && has(other, q)) g = other;
      if (g == kNone) continue;
      std::uint32_t b = kNone;
      for (const std::uint32_t w : faces_[g])
        if (w != p && w != q) b = w;
      bool joined = false;
      for (const std::uint32_t other : fan(a)) joined = joined || has(other, b);
      if (joined || fans_[p].count <= (rim_[p] != 0 ? 1U : 3U) || fans_[q].count <= (rim_[q] != 0 ? 1U : 3U)) continue;
      const std::array<std::uint32_t, 4> touched = {p, q, a, b};
      std::array<double, 4> before{}, after{};
      for (std::size_t c = 0; c < 4; ++c) before[c] = soundness(touched[c]);
      const double old = soundness(v);
      const std::size_t met = meetings(nullptr, p, q, 1000);
      const Face old_f = faces_[f], old_g = faces_[g];
      faces_[f] = {a, p, b};
      faces_[g] = {b, q, a};
      take_from_fan(p, g);
      take_from_fan(q, f);
      add_to_fan(a, g);
      add_to_fan(b, f);
      bool good = soundness(v) > old + 0.01;
      for (std::size_t c = 0; c < 4 && good; ++c) {
        after[c] = soundness(touched[c]);
        good = after[c] >= std::min(visibility, before[c]);
      }
      if (good) {
        moved(a);
        good = meetings(nullptr, a, b, 1000) <= met;
      }
      if (good) return true;
      take_from_fan(a, g);
      take_from_fan(b, f);
      add_to_fan(p, g);
      add_to_fan(q, f);
      faces_[f] = old_f;
      faces_[g] = old_g;
    }
  return false;
}

bool Collapser::mend_by_merging(std::uint32_t v, double visibility) {
  std::vector<std::uint32_t> neighbours;
  for (const std::uint32_t f : fan(v))
    for (const std::uint32_t w : faces_[f])
      if (w != v) neighbours.push_back(w);
  sort_unique(neighbours);
  Change best = {v, v, at_[v]};
  double best_visibility = std::max(0.0, soundness(v)) + 0.01;
  for (const std::uint32_t w : neighbours) {
    if (!link_allows(w, v)) continue;
    for (const double share : {0.0, 0.5, 1.0}) {
      const Change change = {w, v, to_double(snap(at_[w] + (at_[v] - at_[w]) * share))};
      const double after = visibility_at(w, change);
      if (after <= best_visibility || visibility_after(change, visibility) < 0 || !winds_once(change)) continue;
      if (meetings_after(change, 1) > 0) continue;
      best = change;
      best_visibility = after;
    }
  }
  if (best.u == best.v) return false;
  apply(best);
  return true;
}

void Collapser::mend(double visibility) {
  // Of real scans dragon takes the most, 1,100; of spikes that all meet each other it would be 57,000.
  constexpr std::size_t kLooks = 3000;  // per face; some 60 ns each
  exact_ = true;
  build_grid();
  const std::size_t enough = looks_ + kLooks * faces_.size();
  for (int round = 0; round < 10; ++round) {
    std::size_t count = 0;
    for (std::uint32_t v = 0; v < at_.size(); ++v) {
      if (looks_ > enough) return;
      if (fans_[v].count == 0 || is_hub(v) || soundness(v) >= visibility) continue;
      count +=
          mend_by_moving(v, visibility) || mend_by_turning(v, visibility) || mend_by_merging(v, visibility) ? 1 : 0;
    }
    if (count == 0) break;
  }
}

Decimation::Decimation(std::span<const Vec3d> points, std::span<const Face> faces, std::size_t target,
                       const Progress& progress)
    : fine_(std::make_unique<Collapser>(points, faces)) {
  const std::size_t near = std::max<std::size_t>(24 * target, std::min<std::size_t>(10000, faces.size() / 2));
  const Guards fine = {.normal = 0.2, .shape = 0.05, .visibility = 0, .apart = false};
  constexpr std::size_t kFew = 50000;
  if (!fine_->sweep(std::max(kFew, 3 * near), fine, progress, 0, 0.5)) return;
  if (!fine_->run(near, fine, false, progress, 0.5, 0.7)) return;
  fine_->compact();
  fine_->to_lattice();
}

Decimation::~Decimation() = default;

std::size_t Decimation::point_count() const noexcept { return fine_->point_count(); }

Decimation::Result Decimation::finish(std::size_t target, std::size_t most, std::span<const double> importance,
                                      const Progress& progress) const {
  Collapser collapser(*fine_);
  collapser.weigh_errors(importance);
  const Guards strict = {.normal = 0.2, .shape = 0.1, .visibility = 0.2, .apart = true};
  const Guards loose = {.normal = 0, .shape = 0.03, .visibility = 0.08, .apart = true};
  const Guards last = {.normal = -1, .shape = 0.005, .visibility = 0.02, .apart = true};
  for (const Guards& guards : {strict, loose})
    if (!collapser.run(target, guards, true, progress, 0.7, 1)) return {};
  // Vertices that hardly see their faces carry no slabs worth having: better too many faces, up to a limit.
  if (!collapser.run(most, last, true, progress, 0.9, 1)) return {};
  // Where the source meets itself no collapse may pass; beyond the greatest count it must.
  const Guards any = {.normal = -1, .shape = 0.005, .visibility = 0.02, .apart = false};
  if (!collapser.run(most, any, true, progress, 0.9, 1)) return {};
  collapser.mend(0.1);
  return collapser.result();
}

}  // namespace relief::detail
