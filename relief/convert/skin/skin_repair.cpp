#include <relief/base/compact.h>
#include <relief/convert/geometry/box_tree.h>
#include <relief/convert/geometry/components.h>
#include <relief/convert/geometry/triangle_contact.h>
#include <relief/convert/skin/face_meetings.h>
#include <relief/convert/skin/skin_repair.h>
#include <relief/convert/support/sort_unique.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

namespace relief::detail {
namespace {

constexpr double kFolded = 0.5;  // cosine: a piece whose normal is farther off its plane's is as bad as a crossing

constexpr double kLess = 0.9;  // of what is folded or lacking: a step that leaves more of it is not worth making

constexpr double kRounded = 2;  // lattice steps: the normal of a face less high is that of its rounding

constexpr double kGivenShare = 0.1;  // of how far made points may move: given ones

/// Faces before and after a step.
struct Step {
  std::vector<std::uint32_t> faces;  // that change
  std::vector<Face> corners;         // what they become; kNone: they go
  std::vector<Vec3d> normals;        // of the planes that they then lie in
  std::vector<std::uint32_t> from;
  std::uint32_t point = kNone;  // that moves
  LatticePoint to;
  std::uint32_t joined = kNone;  // the point that it goes into
  double by = 0;                 // lattice steps
};

struct Badness {
  std::size_t crossings = 0, thin = 0;
  double folded = 0;   // twice the area of what is folded
  double lacking = 0;  // of height, all thin ones together
  [[nodiscard]] bool is_better_than(const Badness& b) const noexcept {
    if (crossings != b.crossings) return crossings < b.crossings;
    if (folded < kLess * b.folded || kLess * folded > b.folded) return folded < b.folded;
    if (thin != b.thin) return thin < b.thin;
    return lacking < kLess * b.lacking;
  }
  [[nodiscard]] bool is_none() const noexcept { return crossings + thin == 0; }
};

class Repairer {
 public:
  Repairer(SkinDraft& draft, double thin, double farthest)
      : d_(draft),
        thin_(thin),
        farthest_(farthest),
        spread_(draft.points.size()),
        star_(draft.points.size()),
        order_(order_in_space(draft.points, draft.faces)),
        place_(draft.faces.size()),
        tree_(draft.faces.size(), [&](std::size_t k) { return box_of(corners(d_.faces[order_[k]])); }) {
    for (std::uint32_t k = 0; k < order_.size(); ++k) place_[order_[k]] = k;
    // Whole ones that are as thin are as bad as pieces.
    for (std::uint32_t f = 0; f < d_.faces.size(); ++f)
      if (const LatticeTriangle t = corners(d_.faces[f]); length(area_vector(t)) < thin_ * longest(t)) d_.piece[f] = 1;
    std::vector<std::uint8_t> near(d_.points.size(), 0);
    for (std::uint32_t f = 0; f < d_.faces.size(); ++f)
      if (d_.piece[f] != 0)
        for (const std::uint32_t v : d_.faces[f]) near[v] = 2;
    // Faces beside pieces may take part in flips.
    for (const Face& t : d_.faces)
      if (near[t[0]] == 2 || near[t[1]] == 2 || near[t[2]] == 2)
        for (const std::uint32_t v : t) near[v] = std::max<std::uint8_t>(near[v], 1);
    for (std::uint32_t f = 0; f < d_.faces.size(); ++f)
      for (const std::uint32_t v : d_.faces[f])
        if (near[v] != 0) star_[v].push_back(f);
    for (std::size_t v = 0; v < spread_.size(); ++v) {
      spread_[v] = length(to_double(d_.points[v]) - d_.exact[v]);
      result_.moved_most = std::max(result_.moved_most, spread_[v]);
    }
  }

  SkinRepairs run(const Progress& progress) {
    constexpr int kRounds = 4;
    zip_fins();
    for (int round = 0; round < kRounds && !progress.cancelled(); ++round)
      if (!improve_all(progress)) break;
    drop_slivers();
    for (std::uint32_t f = 0; f < d_.faces.size(); ++f) result_.crossing += is_piece(f) && badness({f}).crossings > 0;
    compact();
    return result_;
  }

 private:
  [[nodiscard]] bool is_gone(std::uint32_t f) const noexcept { return d_.faces[f][0] == kNone; }
  [[nodiscard]] bool is_piece(std::uint32_t f) const noexcept { return !is_gone(f) && d_.piece[f] != 0; }
  [[nodiscard]] LatticeTriangle corners(const Face& t) const noexcept {
    return {d_.points[t[0]], d_.points[t[1]], d_.points[t[2]]};
  }
  [[nodiscard]] static Box3d box_of(const LatticeTriangle& t) noexcept {
    Box3d box;
    for (const LatticePoint p : t) box.add(to_double(p));
    return box;
  }
  [[nodiscard]] static Vec3d area_vector(const LatticeTriangle& t) noexcept {
    return cross(to_double(t[1] - t[0]), to_double(t[2] - t[0]));
  }
  [[nodiscard]] static double longest(const LatticeTriangle& t) noexcept {
    return std::max({length(to_double(t[1] - t[0])), length(to_double(t[2] - t[1])), length(to_double(t[0] - t[2]))});
  }

  /// Returns how bad some faces are, which may be others than those of the draft; `instead_of` are not there. Where
  /// that is no better than `to_beat`, it may be worse than what is returned.
  [[nodiscard]] Badness badness(std::span<const LatticeTriangle> triangles, std::span<const Vec3d> normals,
                                std::span<const std::uint32_t> instead_of,
                                const std::optional<Badness>& to_beat = {}) const {
    Badness bad;
    for (std::size_t k = 0; k < triangles.size(); ++k) {
      const Vec3d n = area_vector(triangles[k]);
      const double size = length(n), height = size > 0 ? size / longest(triangles[k]) : 0;
      if (height > kRounded && dot(n, normals[k]) < kFolded * size) {
        ++bad.crossings;
        bad.folded += size;
      }
      bad.crossings += size == 0;
      if (height < thin_) {
        ++bad.thin;
        bad.lacking += 1 - height / thin_;
      }
    }
    // What meets what takes longest, and only adds to it.
    const auto is_beaten = [&] { return to_beat && !bad.is_better_than(*to_beat); };
    for (std::size_t k = 0; k < triangles.size() && !is_beaten(); ++k) {
      const LatticeTriangle& t = triangles[k];
      if (area_vector(t) == Vec3d{}) continue;
      for (std::size_t j = 0; j < k; ++j)
        bad.crossings += area_vector(triangles[j]) != Vec3d{} && meet_beyond_corners(t, triangles[j]);
      const LatticeBox box(t);
      tree_.query(box_of(t), [&](std::uint32_t at) {
        const std::uint32_t g = order_[at];
        if (is_gone(g) || std::ranges::find(instead_of, g) != instead_of.end()) return true;
        const LatticeTriangle other = corners(d_.faces[g]);
        if (!box.meets(LatticeBox(other)) || area_vector(other) == Vec3d{} || !meet_beyond_corners(t, other))
          return true;
        ++bad.crossings;
        return !is_beaten();
      });
    }
    return bad;
  }
  [[nodiscard]] Badness badness(const std::vector<std::uint32_t>& faces) const {
    std::vector<LatticeTriangle> triangles;
    std::vector<Vec3d> normals;
    for (const std::uint32_t f : faces) {
      triangles.push_back(corners(d_.faces[f]));
      normals.push_back(d_.normals[f]);
    }
    return badness(triangles, normals, faces);
  }
  [[nodiscard]] Badness badness_after(const Step& step, const std::optional<Badness>& to_beat = {}) const {
    std::vector<LatticeTriangle> triangles;
    std::vector<Vec3d> normals;
    for (std::size_t k = 0; k < step.faces.size(); ++k) {
      if (step.corners[k][0] == kNone) continue;
      LatticeTriangle t{};
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t v = step.corners[k][i];
        t[i] = v == step.point ? step.to : d_.points[v];
      }
      triangles.push_back(t);
      normals.push_back(step.normals[k]);
    }
    return badness(triangles, normals, step.faces, to_beat);
  }

  /// Joins the far corners of two faces with a common edge where they are close: the faces lie on each other and hold
  /// no room for a slab.
  void zip_fins() {
    for (std::uint32_t f = 0; f < d_.faces.size(); ++f)
      for (std::size_t k = 0; k < 3 && is_piece(f); ++k)
        if (const std::optional<Step> step = zip(f, k);
            step && !badness(step->faces).is_better_than(badness_after(*step)))
          apply(*step);
  }

  /// Returns whether anything was done.
  bool improve_all(const Progress& progress) {
    std::deque<std::uint32_t> queue;
    for (std::uint32_t f = 0; f < d_.faces.size(); ++f)
      if (is_piece(f) && !badness({f}).is_none()) queue.push_back(f);
    bool any = false;
    for (std::size_t left = 20 * queue.size() + 100; !queue.empty() && left > 0 && !progress.cancelled(); --left) {
      const std::uint32_t f = queue.front();
      queue.pop_front();
      if (!is_piece(f)) continue;
      const Badness bad = badness({f});
      if (bad.is_none()) continue;
      const std::optional<Step> step = find_step(f, bad.crossings > 0);
      if (!step) continue;
      any = true;
      for (const std::uint32_t g : apply(*step)) queue.push_back(g);
    }
    return any;
  }

  /// Returns the step around a face that helps most, the least of such.
  [[nodiscard]] std::optional<Step> find_step(std::uint32_t f, bool crosses) const {
    std::optional<Step> best;
    std::vector<std::pair<std::vector<std::uint32_t>, Badness>> known;  // steps of one point change the same faces
    const auto consider = [&](std::optional<Step>&& step) {
      if (!step || (best && best->by <= step->by)) return;
      auto before = std::ranges::find(known, step->faces, &std::pair<std::vector<std::uint32_t>, Badness>::first);
      if (before == known.end()) before = known.insert(known.end(), {step->faces, badness(step->faces)});
      if (before->second.is_none() || !badness_after(*step, before->second).is_better_than(before->second)) return;
      best = std::move(step);
    };
    const Face t = d_.faces[f];
    for (std::size_t k = 0; k < 3; ++k) {
      consider(join(t[k], t[(k + 1) % 3]));
      consider(join(t[(k + 1) % 3], t[k]));
      consider(flip(f, k));
      consider(zip(f, k));
    }
    if (best || !crosses) return best;
    for (const std::uint32_t v : t) {
      if (d_.made[v] == 0) continue;
      for (double by = 1; by <= farthest_ && !best; by *= 2)
        for (const int sense : {-1, 1}) {
          consider(move(v, d_.normals[f] * (sense * by)));
          for (std::size_t axis = 0; axis < 3; ++axis) {
            Vec3d along;
            along[axis] = sense * by;
            consider(move(v, along));
          }
        }
    }
    return best;
  }

  /// Returns the ends of an edge.
  [[nodiscard]] std::optional<Step> join(std::uint32_t u, std::uint32_t v) const {
    Step step;
    step.by = slide(u, to_double(d_.points[v] - d_.points[u])) + spread_[u];
    if (!may_move(u, step.by)) return std::nullopt;
    std::size_t shared = 0, common = 0;
    for (const std::uint32_t f : star_[u]) shared += has(d_.faces[f], v);
    const std::vector<std::uint32_t> around_u = neighbours(u), around_v = neighbours(v);
    for (const std::uint32_t w : around_u) common += std::ranges::binary_search(around_v, w);
    if (shared != 2 || common != 2) return std::nullopt;
    step.point = u;
    step.to = d_.points[v];
    step.joined = v;
    for (const std::uint32_t f : star_[u]) {
      Face t = d_.faces[f];
      if (has(t, v)) {
        t = {kNone, kNone, kNone};
      } else {
        std::ranges::replace(t, u, v);
      }
      add(step, f, t, f);
    }
    return step;
  }

  /// Returns the two corners of an edge's faces that are not on it: a fin or a slit between the faces goes.
  [[nodiscard]] std::optional<Step> zip(std::uint32_t f, std::size_t k) const {
    const auto [g, v] = beyond(f, k);
    if (g == kNone || star_[v].empty()) return std::nullopt;
    std::uint32_t u = d_.faces[f][(k + 2) % 3], other = v;
    if (d_.made[u] == 0) std::swap(u, other);
    Step step;
    step.by = length(to_double(d_.points[other] - d_.points[u])) + spread_[u];
    if (u == other || !may_move(u, step.by)) return std::nullopt;
    const std::vector<std::uint32_t> around_u = neighbours(u), around_v = neighbours(other);
    std::size_t common = 0;
    for (const std::uint32_t w : around_u) common += std::ranges::binary_search(around_v, w);
    if (common != 2 || std::ranges::binary_search(around_v, u)) return std::nullopt;
    step.point = u;
    step.to = d_.points[other];
    step.joined = other;
    add(step, f, {kNone, kNone, kNone}, f);
    add(step, g, {kNone, kNone, kNone}, g);
    for (const std::uint32_t face : star_[u]) {
      if (face == f || face == g) continue;
      Face t = d_.faces[face];
      std::ranges::replace(t, u, other);
      add(step, face, t, face);
    }
    return step;
  }

  /// Returns the face beyond edge k of one, and its corner that is not on it.
  [[nodiscard]] std::pair<std::uint32_t, std::uint32_t> beyond(std::uint32_t f, std::size_t k) const noexcept {
    const std::uint32_t a = d_.faces[f][k], b = d_.faces[f][(k + 1) % 3];
    for (const std::uint32_t g : star_[a])
      for (std::size_t i = 0; i < 3; ++i)
        if (d_.faces[g][i] == b && d_.faces[g][(i + 1) % 3] == a) return {g, d_.faces[g][(i + 2) % 3]};
    return {kNone, kNone};
  }
  /// Returns how far the surface moves where a point does: nothing along all the planes around it. Given points move as
  /// such.
  [[nodiscard]] double slide(std::uint32_t v, Vec3d by) const {
    if (d_.made[v] == 0) return length(by);
    double most = 0;
    for (const std::uint32_t f : star_[v]) most = std::max(most, std::abs(dot(d_.normals[f], by)));
    return most;
  }
  [[nodiscard]] bool may_move(std::uint32_t v, double by) const noexcept {
    return by <= (d_.made[v] != 0 ? farthest_ : kGivenShare * farthest_);
  }

  /// Returns the edge k of a face, which becomes the other diagonal of its two faces.
  [[nodiscard]] std::optional<Step> flip(std::uint32_t f, std::size_t k) const {
    const Face t = d_.faces[f];
    const std::uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
    const auto [g, d] = beyond(f, k);
    if (g == kNone || c == d || star_[d].empty() || std::ranges::binary_search(neighbours(c), d)) return std::nullopt;
    Step step;
    const LatticeTriangle near = corners(t), far = corners(d_.faces[g]);
    // As far as the two diagonals lie apart.
    const Vec3d across = cross(to_double(d_.points[b] - d_.points[a]), to_double(d_.points[d] - d_.points[c]));
    const double size = length(across);
    step.by = size > 0 ? std::abs(dot(across, to_double(d_.points[c] - d_.points[a]))) / size : 0;
    if (step.by > farthest_) return std::nullopt;
    const std::uint32_t source = length(area_vector(near)) > length(area_vector(far)) ? f : g;
    add(step, f, {c, d, b}, source);
    add(step, g, {d, c, a}, source);
    return step;
  }

  [[nodiscard]] std::optional<Step> move(std::uint32_t v, Vec3d by) const {
    Step step;
    step.point = v;
    step.to = snap(to_double(d_.points[v]) + by);
    step.by = length(to_double(step.to - d_.points[v])) + spread_[v];
    if (step.to == d_.points[v] || step.by > farthest_) return std::nullopt;
    for (const std::uint32_t f : star_[v]) add(step, f, d_.faces[f], f);
    return step;
  }

  void add(Step& step, std::uint32_t f, const Face& corners, std::uint32_t like) const {
    step.faces.push_back(f);
    step.corners.push_back(corners);
    step.normals.push_back(d_.normals[like]);
    step.from.push_back(d_.from[like]);
  }

  [[nodiscard]] static bool has(const Face& t, std::uint32_t v) noexcept { return t[0] == v || t[1] == v || t[2] == v; }
  /// Ascending.
  [[nodiscard]] std::vector<std::uint32_t> neighbours(std::uint32_t v) const {
    std::vector<std::uint32_t> found;
    for (const std::uint32_t f : star_[v])
      for (const std::uint32_t w : d_.faces[f])
        if (w != v) found.push_back(w);
    sort_unique(found);
    return found;
  }

  /// Gives the faces that changed.
  std::vector<std::uint32_t> apply(const Step& step) {
    ++result_.repaired;
    for (const std::uint32_t f : step.faces)
      for (const std::uint32_t v : d_.faces[f]) std::erase(star_[v], f);
    if (step.point != kNone && step.joined == kNone) d_.points[step.point] = step.to;
    const std::uint32_t at = step.joined != kNone ? step.joined : step.point;
    if (at != kNone) spread_[at] = std::max(spread_[at], step.by);
    result_.moved_most = std::max(result_.moved_most, step.by);
    std::vector<std::uint32_t> changed;
    for (std::size_t k = 0; k < step.faces.size(); ++k) {
      const std::uint32_t f = step.faces[k];
      d_.faces[f] = step.corners[k];
      if (is_gone(f)) {
        tree_.set(place_[f], Box3d{});
        continue;
      }
      d_.normals[f] = step.normals[k];
      d_.from[f] = step.from[k];
      d_.piece[f] = 1;
      for (const std::uint32_t v : d_.faces[f]) star_[v].push_back(f);
      tree_.set(place_[f], box_of(corners(d_.faces[f])));
      changed.push_back(f);
    }
    return changed;
  }

  /// Leaves out connected parts with pieces that are thinner than that on average, solid or hollow, while others are
  /// left.
  void drop_slivers() {
    const Components parts = find_components(d_.points.size(), d_.faces);
    struct Size {
      double volume = 0, area = 0;  // six and two times
      bool has_pieces = false;
    };
    std::vector<Size> sizes(parts.count);
    for (std::uint32_t f = 0; f < d_.faces.size(); ++f) {
      if (is_gone(f)) continue;
      const LatticeTriangle t = corners(d_.faces[f]);
      Size& size = sizes[parts.of_face[f]];
      size.volume += dot(to_double(t[0]), cross(to_double(t[1]), to_double(t[2])));
      size.area += length(area_vector(t));
      size.has_pieces = size.has_pieces || d_.piece[f] != 0;
    }
    // Of a plate the volume is half the area times the thickness.
    const auto thickness = [](const Size& size) { return 2.0 / 3 * std::abs(size.volume) / size.area; };
    const auto is_sliver = [&](const Size& size) { return size.has_pieces && thickness(size) < thin_; };
    if (std::ranges::all_of(sizes, is_sliver)) return;
    for (const Size& size : sizes) {
      if (!is_sliver(size)) continue;
      ++result_.slivers;
      result_.moved_most = std::max(result_.moved_most, thickness(size));
    }
    for (std::uint32_t f = 0; f < d_.faces.size(); ++f) {
      if (is_gone(f) || !is_sliver(sizes[parts.of_face[f]])) continue;
      d_.faces[f] = {kNone, kNone, kNone};
      tree_.set(place_[f], Box3d{});
    }
  }

  void compact() {
    std::vector<std::uint8_t> stays;
    for (const Face& t : d_.faces) stays.push_back(t[0] != kNone);
    keep_entries([&](std::size_t f) { return stays[f] != 0; }, d_.faces, d_.from, d_.piece, d_.normals);
    drop_unused_points(d_.faces, d_.points, d_.exact, d_.made);
  }

  SkinDraft& d_;
  double thin_, farthest_;
  std::vector<double> spread_;                    // per point: how far what it stands for was from it, at most
  std::vector<std::vector<std::uint32_t>> star_;  // per point of pieces: faces
  std::vector<std::uint32_t> order_, place_;      // of faces in the tree
  BoxTree tree_;
  SkinRepairs result_;
};

}  // namespace

SkinRepairs repair_skin(SkinDraft& draft, double thin, double farthest, const Progress& progress) {
  return Repairer(draft, thin, farthest).run(progress);
}

}  // namespace relief::detail
