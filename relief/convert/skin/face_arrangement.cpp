#include <relief/base/disjoint_sets.h>
#include <relief/convert/geometry/triangle_contact.h>
#include <relief/convert/geometry/triangle_cut.h>
#include <relief/convert/skin/face_arrangement.h>
#include <relief/convert/support/parallel.h>
#include <relief/convert/support/sort_unique.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <tuple>
#include <utility>

namespace relief::detail {
namespace {

/// Points by their places.
class Places {
 public:
  explicit Places(std::span<const LatticePoint> points)
      : points_(points), order_(points.size()), first_(points.size()) {
    std::iota(order_.begin(), order_.end(), 0U);
    std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(key(points[a]), a) < std::pair(key(points[b]), b);
    });
    for (std::size_t k = 0; k < order_.size(); ++k)
      first_[order_[k]] = k > 0 && points[order_[k]] == points[order_[k - 1]] ? first_[order_[k - 1]] : order_[k];
  }
  /// Returns the first point at the place of v.
  [[nodiscard]] std::uint32_t first_at(std::uint32_t v) const noexcept { return first_[v]; }
  /// Returns the first point at p, or kNone.
  [[nodiscard]] std::uint32_t find(LatticePoint p) const noexcept {
    const auto at = std::lower_bound(order_.begin(), order_.end(), p,
                                     [&](std::uint32_t v, LatticePoint q) { return key(points_[v]) < key(q); });
    return at != order_.end() && points_[*at] == p ? *at : kNone;
  }

 private:
  static std::tuple<std::int32_t, std::int32_t, std::int32_t> key(LatticePoint p) noexcept { return {p.x, p.y, p.z}; }
  std::span<const LatticePoint> points_;
  std::vector<std::uint32_t> order_, first_;
};

/// Finds points of one cut in another.
class PointsByPlace {
 public:
  explicit PointsByPlace(const std::vector<ExactPoint>& points) : points_(points), order_(points.size()) {
    std::iota(order_.begin(), order_.end(), 0U);
    std::ranges::sort(order_, {}, [&](std::uint32_t v) { return points_[v].rounded(); });
  }
  [[nodiscard]] std::uint32_t find(const ExactPoint& p) const {
    for (const std::uint32_t v :
         std::ranges::equal_range(order_, p.rounded(), {}, [&](std::uint32_t v) { return points_[v].rounded(); }))
      if (points_[v] == p) return v;
    return kNone;
  }

 private:
  const std::vector<ExactPoint>& points_;
  std::vector<std::uint32_t> order_;
};

struct CutFace {
  std::vector<ExactPoint> points;  // the corners first
  std::vector<Face> faces;
};

class Arranger {
 public:
  Arranger(std::span<const LatticePoint> points, std::span<const Face> faces, const FacePairs& meetings)
      : points_(points), faces_(faces) {
    for (const auto& [f, g] : meetings) {
      touched_.push_back(f);
      touched_.push_back(g);
    }
    sort_unique(touched_);
    cuts_.resize(touched_.size());
    begin_.assign(touched_.size() + 1, 0);
    for (const auto& [f, g] : meetings) {
      ++begin_[number_of(f) + 1];
      ++begin_[number_of(g) + 1];
    }
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    partners_.resize(begin_.back());
    std::vector<std::uint32_t> at(begin_.begin(), begin_.end() - 1);
    for (const auto& [f, g] : meetings) {  // ascending for each
      partners_[at[number_of(f)]++] = g;
      partners_[at[number_of(g)]++] = f;
    }
  }

  bool cut_all(const Progress& progress) {
    const std::vector<std::vector<std::uint32_t>> clusters = find_clusters();
    return for_all(clusters.size(), 4, progress, [&](std::size_t cluster) {
      for (const std::uint32_t k : clusters[cluster]) cut(k);
    });
  }

  FaceArrangement finish() {
    FaceArrangement result;
    result.given = points_;
    const Places places(points_);
    number_points(places, result);
    std::vector<std::uint32_t> touched;  // pieces of faces that intersect others
    for (std::uint32_t f = 0, k = 0; f < faces_.size(); ++f) {
      const bool is_touched = k < touched_.size() && touched_[k] == f;
      const CutFace* const cut = is_touched ? &cuts_[k] : nullptr;
      const std::size_t first = result.pieces.size();
      if (is_touched && !cut->faces.empty()) {
        ++result.cut;
        const std::span<const std::uint32_t> numbers = numbers_[k];
        for (const Face& t : cut->faces) result.pieces.push_back({{numbers[t[0]], numbers[t[1]], numbers[t[2]]}, f});
      } else if (has_area(corners(f))) {
        const Face& t = faces_[f];
        result.pieces.push_back({{places.first_at(t[0]), places.first_at(t[1]), places.first_at(t[2])}, f});
      }
      if (!is_touched) continue;
      for (std::size_t p = first; p < result.pieces.size(); ++p) touched.push_back(static_cast<std::uint32_t>(p));
      ++k;
    }
    merge_coincident(result, touched);
    return result;
  }

 private:
  struct Segment {
    std::uint32_t from, to;
    LatticePlane plane;
  };

  [[nodiscard]] LatticeTriangle corners(std::uint32_t f) const noexcept {
    return {points_[faces_[f][0]], points_[faces_[f][1]], points_[faces_[f][2]]};
  }
  /// Of a face that intersects others, among these.
  [[nodiscard]] std::uint32_t number_of(std::uint32_t f) const noexcept {
    return static_cast<std::uint32_t>(std::ranges::lower_bound(touched_, f) - touched_.begin());
  }
  [[nodiscard]] std::span<const std::uint32_t> partners(std::uint32_t k) const noexcept {
    return std::span(partners_).subspan(begin_[k], begin_[k + 1] - begin_[k]);
  }

  /// Faces that overlap in their plane must be cut in the same way there, one after the other.
  std::vector<std::vector<std::uint32_t>> find_clusters() {
    DisjointSets sets(touched_.size());
    for (std::uint32_t k = 0; k < touched_.size(); ++k)
      for (const std::uint32_t g : partners(k))
        if (g > touched_[k] && find_contact(corners(touched_[k]), corners(g)).coplanar) sets.join(k, number_of(g));
    std::vector<std::uint32_t> cluster_of(touched_.size(), kNone);
    std::vector<std::vector<std::uint32_t>> clusters;
    for (std::uint32_t k = 0; k < touched_.size(); ++k) {
      const std::uint32_t root = sets.least(k);
      if (root == k) {
        cluster_of[k] = static_cast<std::uint32_t>(clusters.size());
        clusters.emplace_back();
      }
      clusters[cluster_of[root]].push_back(k);
    }
    return clusters;
  }

  void cut(std::uint32_t k) {
    const std::uint32_t f = touched_[k];
    const LatticeTriangle t = corners(f);
    TriangleCut cut(t);
    std::vector<Segment> segments;
    std::vector<std::uint32_t> earlier;  // that overlap it in its plane and are cut already
    for (const std::uint32_t g : partners(k)) {
      const LatticeTriangle other = corners(g);
      const TriangleContact contact = find_contact(t, other);
      std::array<std::uint32_t, 12> ids{};
      for (std::size_t i = 0; i < contact.count; ++i) {
        const ContactPoint& p = contact.list[i];
        ids[i] = p.kind == ContactPoint::CornerOfA ? p.a : cut.add(point_of(p, t, other));
      }
      const auto points = std::span(ids).first(contact.count);
      if (contact.coplanar) {
        add_edges_of(other, t, contact, points, cut, segments);
        if (g < f) earlier.push_back(number_of(g));
      } else if (const auto end = std::ranges::find_if(points, [&](std::uint32_t v) { return v != points[0]; });
                 end != points.end()) {
        segments.push_back({points[0], *end, LatticePlane::through(other[0], other[1], other[2])});
      }
    }
    for (const Segment& s : segments) cut.add_segment(s.from, s.to, s.plane);
    if (!earlier.empty()) copy_edges(cut, earlier);
    if (!cut.is_whole()) cuts_[k] = {cut.points(), cut.faces()};
  }

  /// What of the edges of a triangle lies in another one of the same plane. `points`: those of the contact there.
  static void add_edges_of(const LatticeTriangle& other, const LatticeTriangle& t, const TriangleContact& contact,
                           std::span<const std::uint32_t> points, const TriangleCut& cut,
                           std::vector<Segment>& segments) {
    for (std::size_t j = 0; j < 3; ++j) {
      const LatticePoint from = other[j], to = other[(j + 1) % 3];
      std::vector<std::uint32_t> on_edge;
      for (std::size_t k = 0; k < contact.count; ++k) {
        const ContactPoint& p = contact.list[k];
        const bool is_on = p.kind == ContactPoint::CornerOfA   ? is_on_edge(other, j, t[p.a])
                           : p.kind == ContactPoint::CornerOfB ? p.b == j || p.b == (j + 1) % 3
                                                               : p.b == j;
        if (is_on) on_edge.push_back(points[k]);
      }
      std::size_t along = 0;
      for (std::size_t k = 1; k < 3; ++k)
        if (std::abs(to[k] - from[k]) > std::abs(to[along] - from[along])) along = k;
      std::ranges::sort(on_edge, [&](std::uint32_t a, std::uint32_t b) {
        return compare(cut.points()[a], cut.points()[b], along) < 0;
      });
      on_edge.erase(std::unique(on_edge.begin(), on_edge.end()), on_edge.end());
      for (std::size_t k = 1; k < on_edge.size(); ++k)
        segments.push_back({on_edge[k - 1], on_edge[k], LatticePlane::along(from, to, cut.axis())});
    }
  }

  void copy_edges(TriangleCut& cut, std::span<const std::uint32_t> earlier) const {
    const PointsByPlace places(cut.points());
    for (const std::uint32_t k : earlier) {
      CutFace whole;
      if (cuts_[k].faces.empty()) {
        for (const LatticePoint p : corners(touched_[k])) whole.points.push_back(ExactPoint::at(p));
        whole.faces = {{0, 1, 2}};
      }
      const CutFace& other = cuts_[k].faces.empty() ? whole : cuts_[k];
      std::vector<std::uint32_t> here(other.points.size());
      std::ranges::transform(other.points, here.begin(), [&](const ExactPoint& p) { return places.find(p); });
      for (const Face& t : other.faces)
        for (std::size_t i = 0; i < 3; ++i) {
          const std::uint32_t from = here[t[i]], to = here[t[(i + 1) % 3]];
          if (from != kNone && to != kNone) cut.add_edge(from, to);
        }
    }
  }

  /// Gives the points of all cuts numbers, the same to those at identical coordinates.
  void number_points(const Places& places, FaceArrangement& result) {
    numbers_.resize(cuts_.size());
    struct Made {
      std::uint32_t cut, local;
    };
    std::vector<Made> made;
    for (std::uint32_t k = 0; k < cuts_.size(); ++k) {
      numbers_[k].assign(cuts_[k].points.size(), kNone);
      for (std::uint32_t i = 0; i < cuts_[k].points.size(); ++i) {
        const ExactPoint& p = cuts_[k].points[i];
        if (i < 3)
          numbers_[k][i] = places.first_at(faces_[touched_[k]][i]);
        else if (p.is_lattice())
          numbers_[k][i] = places.find(p.nearest());
        if (numbers_[k][i] == kNone) made.push_back({k, i});
      }
    }
    const auto point = [&](const Made& m) -> const ExactPoint& { return cuts_[m.cut].points[m.local]; };
    std::ranges::stable_sort(made, {}, [&](const Made& m) { return point(m).rounded(); });
    for (std::size_t k = 0; k < made.size(); ++k) {
      std::uint32_t& number = numbers_[made[k].cut][made[k].local];
      for (std::size_t j = k; j-- > 0 && number == kNone && point(made[j]).rounded() == point(made[k]).rounded();)
        if (point(made[j]) == point(made[k])) number = numbers_[made[j].cut][made[j].local];
      if (number != kNone) continue;
      number = static_cast<std::uint32_t>(points_.size() + result.made.size());
      result.made.push_back(point(made[k]));
    }
  }

  /// Leaves one piece of those at identical coordinates.
  static void merge_coincident(FaceArrangement& result, std::span<const std::uint32_t> touched) {
    struct Key {
      Face sorted;
      std::uint32_t piece;
      auto operator<=>(const Key&) const = default;
    };
    std::vector<Key> keys;
    keys.reserve(touched.size());
    for (const std::uint32_t p : touched) {
      Face corners = result.pieces[p].corners;
      std::ranges::sort(corners);
      keys.push_back({corners, p});
    }
    std::sort(keys.begin(), keys.end());
    const auto is_even = [](const Face& t) { return (t[0] < t[1]) + (t[1] < t[2]) + (t[2] < t[0]) == 2; };
    std::vector<std::uint8_t> gone(result.pieces.size(), 0);
    for (std::size_t k = 1, first = 0; k < keys.size(); ++k) {
      if (keys[k].sorted != keys[first].sorted) {
        first = k;
        continue;
      }
      Piece& stays = result.pieces[keys[first].piece];
      const Piece& other = result.pieces[keys[k].piece];
      stays.sheets += is_even(stays.corners) == is_even(other.corners) ? 1 : -1;
      gone[keys[k].piece] = 1;
      ++result.coincident;
    }
    std::size_t kept = 0;
    for (std::size_t p = 0; p < result.pieces.size(); ++p)
      if (gone[p] == 0) result.pieces[kept++] = result.pieces[p];
    result.pieces.resize(kept);
  }

  std::span<const LatticePoint> points_;
  std::span<const Face> faces_;
  std::vector<std::uint32_t> touched_;               // faces that intersect others, ascending; by their numbers there:
  std::vector<CutFace> cuts_;                        // empty where a face is whole
  std::vector<std::uint32_t> begin_, partners_;      // faces that each meets, ascending
  std::vector<std::vector<std::uint32_t>> numbers_;  // of the points of each cut
};

}  // namespace

std::optional<FaceArrangement> arrange(std::span<const LatticePoint> points, std::span<const Face> faces,
                                       const FacePairs& meetings, const Progress& progress) {
  Arranger arranger(points, faces, meetings);
  if (!arranger.cut_all(progress)) return std::nullopt;
  return arranger.finish();
}

}  // namespace relief::detail
