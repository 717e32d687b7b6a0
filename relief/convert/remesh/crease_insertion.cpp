#include <relief/convert/geometry/half_edges.h>
#include <relief/convert/remesh/crease_insertion.h>
#include <relief/convert/remesh/plane_fit.h>
#include <relief/convert/support/parallel.h>
#include <relief/convert/support/sort_unique.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <span>

namespace relief::detail {
namespace {

using Fit = FittedMesh::Fit;

constexpr double kSmooth = 0.94;     // cosine of 20 degrees, of normals at the ends of an edge
constexpr double kCrease = 0.9;      // cosine of 25 degrees, of the faces that meet in a crease
constexpr double kExact = 1e-6;      // voxels: what is cut off between flat faces
constexpr double kLarge = 1;         // square voxels: triangles of flat faces
constexpr double kCurved = 0.05;     // voxels: the same, between curved ones
constexpr double kConverged = 1e-7;  // voxels
constexpr double kOnSkin = 1e-3;     // voxels
constexpr int kSteps = 8;            // towards a crease between curved faces
constexpr double kShare = 0.3;       // of the way to the crease that each step leaves
constexpr double kReach = 1;         // length of an edge: how far from its middle the crease that it cuts off may be
constexpr double kEnd = 0.1;         // share of an edge: an end so near to a crease goes there
constexpr double kTooNear = 0.01;    // voxels: nearer to an end that lies on a crease there is no other vertex
constexpr int kRounds = 6;
// Where the planes that meet in a crease are looked for around the middle of an edge: so far from an end, as a share of
// the edge; so far beside its middle, and from there so far towards the corner opposite to it.
constexpr double kFromEnd = 0.2, kBesideMiddle = 0.1, kTowardsCorner = 0.2;

class CreaseInsertion {
 public:
  CreaseInsertion(FittedMesh& mesh, const HermiteGrid& grid, const Skin& skin) : mesh_(mesh), grid_(grid), skin_(skin) {
    for (std::size_t v = 0; v < mesh_.positions.size(); ++v)
      if (mesh_.fits[v] == Fit::OnCorner) corners_.insert(key_of(mesh_.positions[v]));
  }

  [[nodiscard]] bool run(const Progress& progress) {
    for (int round = 0; round < kRounds; ++round) {
      if (!find_splits(progress)) return false;
      const bool moved = move_ends(), parted = split(progress);
      if (!moved && !parted && !flip()) return true;
      if (progress.cancelled()) return false;
    }
    for (const EdgeEnds& ends : unsolved_)  // they may be flipped next time
      for (const std::uint32_t v : ends) set_pending(v);
    return true;
  }

 private:
  struct Crease {
    Vec3d at;
    Vec3d normal;
    Fit fit = Fit::OnEdge;
  };
  using EdgeEnds = std::array<std::uint32_t, 2>;
  /// An edge that cuts something off.
  struct CutOff {
    std::uint32_t half_edge;       // the lesser one of two
    std::optional<Crease> crease;  // to split it at
    bool is_dropped = false;       // an end lies there
  };
  [[nodiscard]] static int rank_of(Fit fit) noexcept { return static_cast<int>(fit); }
  [[nodiscard]] Vec3d position(std::uint32_t v) const noexcept { return mesh_.positions[v]; }

  [[nodiscard]] bool is_outer(Vec3d at, Vec3d outwards) const noexcept {
    return !grid_.has_buried_skin(at) || skin_.is_outer(at, outwards);
  }

  using Ends = std::array<Vec3d, 2>;
  /// Returns where the shortest path over the crease between the ends passes it: so what is put on a crease between
  /// edges that do not cross lies there in their order.
  [[nodiscard]] static Vec3d across(Vec3d on_crease, Vec3d along, const Ends& ends) noexcept {
    along = normalized(along);
    std::array<double, 2> place{}, distance{};
    for (std::size_t k = 0; k < 2; ++k) {
      const Vec3d d = ends[k] - on_crease;
      place[k] = dot(d, along);
      distance[k] = length(d - along * place[k]);
    }
    const double sum = distance[0] + distance[1];
    return sum > 0 ? on_crease + along * ((place[0] * distance[1] + place[1] * distance[0]) / sum) : on_crease;
  }

  /// Returns the corner where the faces of the skin near the samples meet (rank 3). Else the place on the crease where
  /// the faces near two samples meet, between the ends (rank 2). Both lie within reach of the middle.
  [[nodiscard]] std::optional<Crease> meet(std::span<const Vec3d> samples, const Ends& ends, Vec3d middle, double reach,
                                           int rank) const {
    std::array<Vec3d, 6> from{};
    std::ranges::copy(samples, from.begin());
    Vec3d at = middle, outwards;
    Skin::Place place;
    for (int step = 0; step < kSteps; ++step) {
      PlaneFit planes(middle);
      std::array<Vec3d, 6> normals{};
      outwards = {};
      double sharpest = 1;
      for (std::size_t k = 0; k < samples.size(); ++k) {
        const Skin::Place near = skin_.nearest(from[k]);
        planes.add(near.normal, near.at);
        outwards += near.normal;
        for (std::size_t j = 0; j < k; ++j) sharpest = std::min(sharpest, dot(normals[j], near.normal));
        normals[k] = near.normal;
      }
      if (sharpest > kCrease || planes.solve() != rank) return std::nullopt;
      at = planes.at(rank);
      if (rank == 2) at = across(at, cross(normals[0], normals[1]), ends);
      if (length(at - middle) > reach) return std::nullopt;
      place = skin_.nearest(at);
      if (place.distance < kConverged) break;
      for (std::size_t k = 0; k < samples.size(); ++k) from[k] = at + (from[k] - at) * kShare;
    }
    if (place.distance > kOnSkin) return std::nullopt;
    if (!is_outer(place.at, normalized(outwards))) return std::nullopt;
    return Crease{place.at, place.normal, rank == 2 ? Fit::OnEdge : Fit::OnCorner};
  }

  /// Returns whether the middle of an edge lies off the skin. Not of edges in a smooth face, nor by so little that it
  /// is no matter.
  [[nodiscard]] bool cuts_off(std::uint32_t p, std::uint32_t q) const {
    if (mesh_.fits[p] < Fit::OnFace || mesh_.fits[q] < Fit::OnFace) return false;
    if (mesh_.fits[p] == Fit::OnFace && mesh_.fits[q] == Fit::OnFace &&
        double(dot(mesh_.normals[p], mesh_.normals[q])) > kSmooth)
      return false;
    const Skin::Place near = skin_.nearest((position(p) + position(q)) / 2.0);
    return near.distance > kCurved || (near.distance > kExact && skin_.area(near.triangle) > kLarge);
  }
  [[nodiscard]] static Vec3d near_start(Vec3d a, Vec3d b) noexcept { return a + (b - a) * kFromEnd; }
  /// Returns the crease that edge pq cuts off; r and s are the corners opposite to it.
  [[nodiscard]] std::optional<Crease> crease_at(std::uint32_t p, std::uint32_t q, std::uint32_t r,
                                                std::uint32_t s) const {
    const Vec3d a = position(p), b = position(q), middle = (a + b) / 2.0, along = b - a;
    const double reach = kReach * length(along);
    const Vec3d first = near_start(a, b), second = near_start(b, a);
    const std::array<Vec3d, 6> around = {first,
                                         second,
                                         middle + along * kBesideMiddle + (position(r) - middle) * kTowardsCorner,
                                         middle - along * kBesideMiddle + (position(r) - middle) * kTowardsCorner,
                                         middle + along * kBesideMiddle + (position(s) - middle) * kTowardsCorner,
                                         middle - along * kBesideMiddle + (position(s) - middle) * kTowardsCorner};
    std::optional<Crease> crease = meet(around, {a, b}, middle, reach, 3);
    if (!crease) crease = meet(std::array{first, second}, {a, b}, middle, reach, 2);
    if (!crease) crease = corner_beyond(first, second, {a, b}, reach);
    return crease;
  }
  /// Returns the corner where a crease ends before it comes to between the ends of an edge.
  [[nodiscard]] std::optional<Crease> corner_beyond(Vec3d first, Vec3d second, const Ends& ends, double reach) const {
    const Vec3d middle = (first + second) / 2.0;
    const Skin::Place p = skin_.nearest(first), q = skin_.nearest(second);
    PlaneFit planes(middle);
    planes.add(p.normal, p.at);
    planes.add(q.normal, q.at);
    if (planes.solve() != 2) return std::nullopt;
    const Vec3d beyond = across(planes.at(2), cross(p.normal, q.normal), ends);
    const Vec3d end = skin_.nearest(beyond).at;
    const std::array<Vec3d, 6> around = {
        first, second, middle, beyond, (beyond + middle) / 2.0, end + (middle - end) * kShare};
    return meet(around, ends, middle, reach, 3);
  }
  [[nodiscard]] bool is_pending(std::span<const std::uint32_t> some) const noexcept {
    return std::ranges::any_of(some,
                               [&](std::uint32_t v) { return (mesh_.pending[v] & FittedMesh::kSeekCreases) != 0; });
  }
  void set_pending(std::uint32_t v) noexcept { mesh_.pending[v] = FittedMesh::kSeekAll; }

  /// `h`: a half-edge of what is near.
  [[nodiscard]] std::uint32_t corner(std::uint32_t h) const noexcept { return mesh_.triangles[near_[h / 3]][h % 3]; }
  [[nodiscard]] EdgeEnds ends_at(std::uint32_t h) const noexcept { return {corner(h), corner(next_of(h))}; }

  /// Finds the triangles whose edges may have to be split, and those around them: few after the first round.
  void find_near() {
    std::vector<std::uint8_t> is_corner(mesh_.positions.size(), 0);  // of a triangle with a corner to look at
    for (const Triangle& t : mesh_.triangles)
      if (is_pending(t))
        for (const std::uint32_t v : t) is_corner[v] = 1;
    near_.clear();
    std::vector<Triangle> near;
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (std::ranges::none_of(mesh_.triangles[t], [&](std::uint32_t v) { return is_corner[v] != 0; })) continue;
      near_.push_back(t);
      near.push_back(mesh_.triangles[t]);
    }
    twins_ = find_twins(near, mesh_.positions.size());
  }

  bool find_splits(const Progress& progress) {
    constexpr std::size_t kChunk = 4096;  // half-edges
    find_near();
    std::vector<std::vector<CutOff>> found((twins_.size() + kChunk - 1) / kChunk);
    if (!for_all(found.size(), 1, progress, [&](std::size_t chunk) {
          const auto end = static_cast<std::uint32_t>(std::min(twins_.size(), (chunk + 1) * kChunk));
          for (auto h = static_cast<std::uint32_t>(chunk * kChunk); h < end; ++h) {
            if (h > twins_[h] || twins_[h] == kNone) continue;
            const std::uint32_t p = corner(h), q = corner(next_of(h)), r = corner(last_of(h)),
                                s = corner(last_of(twins_[h]));
            if (is_pending(std::array{p, q, r, s}) && cuts_off(p, q))
              found[chunk].push_back({h, crease_at(p, q, r, s)});
          }
        }))
      return false;
    cut_off_.clear();
    for (const std::vector<CutOff>& some : found) cut_off_.insert(cut_off_.end(), some.begin(), some.end());
    seen_ = mesh_.pending;
    for (std::uint8_t& bits : mesh_.pending) bits = static_cast<std::uint8_t>(bits & ~FittedMesh::kSeekCreases);
    return true;
  }

  /// Ends of edges that are near to the crease these are to be split at go there instead: of several the one that lies
  /// on most planes, then the nearest.
  bool move_ends() {
    struct Goal {
      const Crease* to = nullptr;
      double distance = 0;
    };
    std::vector<Goal> goals(mesh_.positions.size());
    std::vector<std::uint32_t> moved;
    for (CutOff& cut : cut_off_) {
      if (!cut.crease) continue;
      const EdgeEnds ends = ends_at(cut.half_edge);
      const double along = length(position(ends[1]) - position(ends[0]));
      for (const std::uint32_t v : ends) {
        const double distance = length(cut.crease->at - position(v));
        const bool is_better = rank_of(cut.crease->fit) > rank_of(mesh_.fits[v]);
        if (distance > (is_better ? kEnd * along : kTooNear)) continue;
        if (is_better) {
          Goal& goal = goals[v];
          if (goal.to == nullptr) moved.push_back(v);
          if (goal.to == nullptr || rank_of(cut.crease->fit) > rank_of(goal.to->fit) ||
              (cut.crease->fit == goal.to->fit && distance < goal.distance))
            goal = {&*cut.crease, distance};
        } else {
          cut.is_dropped = true;
        }
      }
    }
    for (const std::uint32_t v : moved) {
      const Crease& to = *goals[v].to;
      mesh_.positions[v] = to.at;
      mesh_.normals[v] = to_float(to.normal);
      mesh_.fits[v] = to.fit;
      if (to.fit == Fit::OnCorner) corners_.insert(key_of(to.at));
      set_pending(v);
    }
    for (CutOff& cut : cut_off_) {
      const auto [p, q] = ends_at(cut.half_edge);
      if (cut.is_dropped || goals[p].to != nullptr || goals[q].to != nullptr) cut.crease.reset();
    }
    return !moved.empty();
  }

  std::uint32_t add(const Crease& crease) {
    mesh_.positions.push_back(crease.at);
    mesh_.normals.push_back(to_float(crease.normal));
    mesh_.fits.push_back(crease.fit);
    mesh_.pending.push_back(FittedMesh::kSeekAll);
    return static_cast<std::uint32_t>(mesh_.positions.size() - 1);
  }

  /// Returns the corner of the skin that a triangle, whose edges are split or not, cuts off.
  [[nodiscard]] std::optional<Crease> corner_in(const Triangle& t, const std::array<std::uint32_t, 3>& splits) const {
    const Vec3d a = position(t[0]), b = position(t[1]), c = position(t[2]), middle = (a + b + c) / 3.0;
    for (std::size_t k = 0; k < 3; ++k)
      if (mesh_.fits[t[k]] < Fit::OnFace) return std::nullopt;
    if (skin_.nearest(middle).distance < kExact) return std::nullopt;
    // Near places that lie in one face each: the middles of whole edges, or the corners beside split ones.
    constexpr double kNearEdge = 0.95, kNearCorner = 0.8;
    std::array<Vec3d, 3> around;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d p = position(t[k]), q = position(t[(k + 1) % 3]);
      around[k] = middle + (splits[k] == kNone ? ((p + q) / 2.0 - middle) * kNearEdge : (p - middle) * kNearCorner);
    }
    return meet(around, {a, b}, middle, std::max({length(a - middle), length(b - middle), length(c - middle)}), 3);
  }
  [[nodiscard]] bool may_cut_off_a_corner(const Triangle& t) const noexcept {
    int edges = 0;
    for (std::size_t k = 0; k < 3; ++k)
      edges +=
          mesh_.fits[t[k]] != Fit::OnFace || double(dot(mesh_.normals[t[k]], mesh_.normals[t[(k + 1) % 3]])) < kSmooth
              ? 1
              : 0;
    return edges == 3;
  }

  /// Corners of the skin that are vertices; each is needed once.
  [[nodiscard]] static std::array<std::int64_t, 3> key_of(Vec3d p) noexcept {
    return {std::llround(p.x / kTooNear), std::llround(p.y / kTooNear), std::llround(p.z / kTooNear)};
  }
  [[nodiscard]] bool is_taken(Vec3d corner) const {
    const auto [x, y, z] = key_of(corner);
    for (std::int64_t i = x - 1; i <= x + 1; ++i)
      for (std::int64_t j = y - 1; j <= y + 1; ++j)
        for (std::int64_t k = z - 1; k <= z + 1; ++k)
          if (corners_.contains({i, j, k})) return true;
    return false;
  }
  [[nodiscard]] bool is_new(const std::optional<Crease>& crease) {
    if (!crease || (crease->fit == Fit::OnCorner && is_taken(crease->at))) return false;
    if (crease->fit == Fit::OnCorner) corners_.insert(key_of(crease->at));
    return true;
  }

  /// Splits edges and triangles; false where there is nothing to split.
  bool split(const Progress& progress) {
    std::vector<std::uint32_t> splits(twins_.size(), kNone);
    const std::size_t before = mesh_.positions.size();
    for (const CutOff& cut : cut_off_)
      if (is_new(cut.crease)) splits[cut.half_edge] = splits[twins_[cut.half_edge]] = add(*cut.crease);
    const auto splits_of = [&](std::size_t k) {
      return std::array<std::uint32_t, 3>{splits[3 * k], splits[3 * k + 1], splits[3 * k + 2]};
    };
    std::vector<std::optional<Crease>> corners(near_.size());
    if (!for_all(near_.size(), 512, progress, [&](std::size_t k) {
          const Triangle& t = mesh_.triangles[near_[k]];
          const auto s = splits_of(k);
          const auto count = 3 - std::ranges::count(s, kNone);
          if (std::ranges::none_of(t, [&](std::uint32_t v) { return (seen_[v] & FittedMesh::kSeekCreases) != 0; }))
            return;
          if (count == 3 || (count == 0 && may_cut_off_a_corner(t))) corners[k] = corner_in(t, s);
        }))
      return false;
    for (const CutOff& cut : cut_off_)
      if (const auto [p, q] = ends_at(cut.half_edge); splits[cut.half_edge] == kNone)
        unsolved_.push_back(ends_of(p, q));
    std::vector<std::uint32_t> centres(corners.size(), kNone);
    for (std::size_t k = 0; k < corners.size(); ++k)
      if (is_new(corners[k])) centres[k] = add(*corners[k]);
    if (mesh_.positions.size() == before) return false;
    std::vector<Triangle> made;
    made.reserve(mesh_.triangles.size() + 2 * (mesh_.positions.size() - before));
    for (std::size_t t = 0, k = 0; t < mesh_.triangles.size(); ++t) {
      if (k < near_.size() && near_[k] == t) {
        split_triangle(mesh_.triangles[t], splits_of(k), centres[k], made);
        ++k;
      } else {
        made.push_back(mesh_.triangles[t]);
      }
    }
    mesh_.triangles = std::move(made);
    return true;
  }

  [[nodiscard]] double off_skin(std::uint32_t p, std::uint32_t q) const {
    return skin_.nearest((position(p) + position(q)) / 2.0).distance;
  }
  /// Returns whether a triangle looks the way the skin below its middle does.
  [[nodiscard]] bool looks_outwards(const Triangle& t) const {
    const Vec3d a = position(t[0]), b = position(t[1]), c = position(t[2]);
    return dot(cross(b - a, c - a), skin_.nearest((a + b + c) / 3.0).normal) > 0;
  }

  /// Flips edges that cut off a crease on which their opposite corners lie; false where there are none.
  bool flip() {
    constexpr double kBetter = 0.1;  // share of what the edge cuts off
    std::vector<std::uint8_t> touched(mesh_.positions.size(), 0);
    bool flipped = false;
    sort_unique(unsolved_);
    if (unsolved_.empty()) return false;
    const Stars stars(mesh_.triangles, mesh_.positions.size());
    const std::vector<std::uint32_t> twins = find_twins(mesh_.triangles, mesh_.positions.size());
    for (std::uint32_t h = 0; h < twins.size(); ++h) {
      if (h > twins[h] || !std::ranges::binary_search(unsolved_, ends_of(mesh_.triangles[h / 3][h % 3],
                                                                         mesh_.triangles[h / 3][next_of(h) % 3])))
        continue;
      const std::uint32_t g = twins[h];
      Triangle& first = mesh_.triangles[h / 3];
      Triangle& second = mesh_.triangles[g / 3];
      const std::uint32_t p = first[h % 3], q = second[g % 3], r = first[last_of(h) % 3], s = second[last_of(g) % 3];
      if (touched[p] + touched[q] + touched[r] + touched[s] > 0 || off_skin(r, s) > kBetter * off_skin(p, q) ||
          are_joined(stars, r, s))
        continue;
      const Triangle one = {r, p, s}, other = {s, q, r};
      if (!looks_outwards(one) || !looks_outwards(other)) continue;
      first = one;
      second = other;
      flipped = true;
      for (const std::uint32_t v : {p, q, r, s}) {
        touched[v] = 1;
        set_pending(v);
      }
    }
    return flipped;
  }
  [[nodiscard]] static EdgeEnds ends_of(std::uint32_t p, std::uint32_t q) noexcept {
    return {std::min(p, q), std::max(p, q)};
  }
  [[nodiscard]] bool are_joined(const Stars& stars, std::uint32_t v, std::uint32_t w) const noexcept {
    return std::ranges::any_of(stars.of(v), [&](std::uint32_t h) {
      return mesh_.triangles[h / 3][next_of(h) % 3] == w || mesh_.triangles[h / 3][last_of(h) % 3] == w;
    });
  }

  /// splits[k] lies between corners k and k + 1.
  void split_triangle(const Triangle& t, const std::array<std::uint32_t, 3>& splits, std::uint32_t centre,
                      std::vector<Triangle>& made) const {
    if (centre != kNone) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t p = t[k], q = t[(k + 1) % 3];
        if (splits[k] == kNone) {
          made.push_back({p, q, centre});
        } else {
          made.push_back({p, splits[k], centre});
          made.push_back({splits[k], q, centre});
        }
      }
      return;
    }
    const auto count = 3 - std::ranges::count(splits, kNone);
    if (count == 0) made.push_back(t);
    if (count == 3) {
      for (std::size_t k = 0; k < 3; ++k) made.push_back({t[k], splits[k], splits[(k + 2) % 3]});
      made.push_back({splits[0], splits[1], splits[2]});
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
      const std::uint32_t p = splits[k], q = splits[(k + 1) % 3];
      if (count == 1 && p != kNone) {
        made.push_back({a, p, c});
        made.push_back({p, b, c});
      }
      if (count == 2 && p != kNone && q != kNone) {
        made.push_back({p, b, q});
        const bool is_shorter = length(position(a) - position(q)) < length(position(p) - position(c));
        made.push_back(is_shorter ? Triangle{a, p, q} : Triangle{a, p, c});
        made.push_back(is_shorter ? Triangle{a, q, c} : Triangle{p, q, c});
      }
    }
  }

  FittedMesh& mesh_;
  const HermiteGrid& grid_;
  const Skin& skin_;
  std::vector<std::uint32_t> near_;                // triangles, ascending; half-edge 3 k + i is of the k-th
  std::vector<std::uint32_t> twins_;               // by half-edge of these
  std::vector<CutOff> cut_off_;                    // ascending by half-edge
  std::vector<EdgeEnds> unsolved_;                 // edges that cut off something and were not split
  std::vector<std::uint8_t> seen_;                 // what was pending in this round
  std::set<std::array<std::int64_t, 3>> corners_;  // where there are some, in steps of kTooNear
};

}  // namespace

bool insert_creases(FittedMesh& mesh, const HermiteGrid& grid, const Skin& skin, const Progress& progress) {
  return CreaseInsertion(mesh, grid, skin).run(progress);
}

}  // namespace relief::detail
