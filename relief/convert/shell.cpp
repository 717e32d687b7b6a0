#include <relief/base/disjoint_sets.h>
#include <relief/convert/box_pairs.h>
#include <relief/convert/directions.h>
#include <relief/convert/shell.h>
#include <relief/convert/sort_unique.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace relief::detail {
namespace {

/// The least depth on one side, in lattice steps: about two millionths of the extent.
constexpr double kLeastDepth = 64;
/// Pairs of boxes that meet, per face, above which faces lie in a heap.
constexpr std::size_t kHeap = 200;

class Builder {
 public:
  /// `start`, where not empty, holds depths from which to start instead of the wanted ones.
  Builder(const BaseMesh& base, const Fibres& fibres, const std::array<std::vector<double>, 2>& start)
      : base_(base), fibres_(fibres) {
    const std::size_t points = base.points.size(), faces = base.faces.size();
    for (const Side side : {kInner, kOuter}) {
      depth_[side].resize(points);
      ends_[side].resize(points);
      boxes_[side].resize(faces);
      for (std::uint32_t v = 0; v < points; ++v) depth_[side][v] = std::max(kLeastDepth, fibres.wanted[side][v]);
    }
    both_.resize(faces);
    build_fans();
    parts_ = find_parts(points, base.faces);
    for (std::uint32_t v = 0; v < points; ++v)
      for (const Side side : {kInner, kOuter}) place(v, side);
    for (std::uint32_t s = 0; s < faces; ++s) measure(s);
    find_pairs();
    if (start[kInner].empty()) return;
    for (std::uint32_t v = 0; v < points; ++v)
      for (const Side side : {kInner, kOuter}) {
        depth_[side][v] = std::min(depth_[side][v], start[side][v]);
        place(v, side);
      }
    for (std::uint32_t s = 0; s < faces; ++s) measure(s);
  }

  /// True when all conditions hold or only faces at their least depth are to blame (faults()); false when cancelled.
  bool shrink(const Progress& progress);
  /// Tries to give back depth that was taken in larger steps or larger groups than needed.
  bool grow(const Progress& progress);

  [[nodiscard]] const std::vector<std::pair<std::uint32_t, std::uint32_t>>& faults() const noexcept { return faults_; }
  [[nodiscard]] const std::vector<std::uint32_t>& part_of_face() const noexcept { return parts_.of_face; }
  [[nodiscard]] double depth(std::uint32_t v, Side side) const noexcept { return depth_[side][v]; }
  [[nodiscard]] std::array<std::vector<LatticePoint>, 2> take_ends() { return std::move(ends_); }

 private:
  struct Corner {
    std::uint32_t slab, corner;
  };

  void build_fans();
  void find_pairs();
  void place(std::uint32_t v, Side side) {
    const double sign = side == kOuter ? 1 : -1;
    ends_[side][v] = snap(to_double(base_.points[v]) + fibres_.directions[v] * (sign * depth_[side][v]));
  }
  void measure(std::uint32_t s) {
    for (const Side side : {kInner, kOuter}) boxes_[side][s] = LatticeBox(triangle(s, side));
    both_[s] = boxes_[kInner][s];
    both_[s].add(boxes_[kOuter][s]);
  }
  [[nodiscard]] LatticeTriangle triangle(std::uint32_t s, Side side) const noexcept {
    const Face& f = base_.faces[s];
    return {ends_[side][f[0]], ends_[side][f[1]], ends_[side][f[2]]};
  }
  [[nodiscard]] std::span<const Corner> fan(std::uint32_t v) const noexcept {
    return std::span(corners_).subspan(fan_begin_[v], fan_begin_[v + 1] - fan_begin_[v]);
  }
  [[nodiscard]] std::span<const std::uint32_t> partners(std::uint32_t s) const noexcept {
    return std::span(partners_).subspan(partner_begin_[s], partner_begin_[s + 1] - partner_begin_[s]);
  }
  [[nodiscard]] bool share_fibre(std::uint32_t a, std::uint32_t b) const noexcept {
    for (const std::uint32_t v : base_.faces[a])
      for (const std::uint32_t w : base_.faces[b])
        if (v == w) return true;
    return false;
  }
  [[nodiscard]] bool meet(std::uint32_t a, Side side_a, std::uint32_t b, Side side_b) const noexcept {
    return boxes_[side_a][a].meets(boxes_[side_b][b]) && triangles_meet(triangle(a, side_a), triangle(b, side_b));
  }
  [[nodiscard]] bool winds_once(std::uint32_t v) const noexcept;
  [[nodiscard]] bool holds_corner_of(std::uint32_t a, std::uint32_t b) const noexcept;
  [[nodiscard]] bool sound_at(std::uint32_t v) const noexcept;
  bool volumes_agree();

  /// Marks the three corners of a slab on one side for shrinking; the deepest ones first.
  void blame(std::uint32_t s, Side side);
  [[nodiscard]] bool least(std::uint32_t s, Side side) const noexcept {
    for (const std::uint32_t v : base_.faces[s])
      if (depth_[side][v] > kLeastDepth) return false;
    return true;
  }

  const BaseMesh& base_;
  const Fibres& fibres_;
  std::array<std::vector<double>, 2> depth_;
  std::array<std::vector<LatticePoint>, 2> ends_;
  std::array<std::vector<LatticeBox>, 2> boxes_;  // by Side, per slab
  std::vector<LatticeBox> both_;
  std::vector<std::uint32_t> fan_begin_;
  std::vector<Corner> corners_;
  std::vector<std::uint32_t> partner_begin_, partners_;
  Parts parts_;
  std::array<std::vector<std::uint8_t>, 2> blamed_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> faults_;
};

void Builder::build_fans() {
  fan_begin_.assign(base_.points.size() + 1, 0);
  for (const Face& f : base_.faces)
    for (const std::uint32_t v : f) ++fan_begin_[v + 1];
  std::partial_sum(fan_begin_.begin(), fan_begin_.end(), fan_begin_.begin());
  corners_.resize(fan_begin_.back());
  std::vector<std::uint32_t> next(fan_begin_.begin(), fan_begin_.end() - 1);
  for (std::uint32_t s = 0; s < base_.faces.size(); ++s)
    for (std::uint32_t k = 0; k < 3; ++k) corners_[next[base_.faces[s][k]]++] = {s, k};
}

// Depths never exceed the wanted ones, so the pairs of boxes that meet at the wanted depths are all that can ever
// matter.
void Builder::find_pairs() {
  std::vector<Box3d> boxes(base_.faces.size());
  for (std::uint32_t s = 0; s < boxes.size(); ++s) {
    for (const Side side : {kInner, kOuter})
      for (const LatticePoint p : triangle(s, side)) boxes[s].add(to_double(p));
    // The base itself, for ends that were kept within the lattice.
    for (const std::uint32_t v : base_.faces[s]) boxes[s].add(to_double(base_.points[v]));
  }
  const auto pairs = meeting_boxes(boxes);
  partner_begin_.assign(boxes.size() + 1, 0);
  for (const auto& [a, b] : pairs) {
    ++partner_begin_[a + 1];
    ++partner_begin_[b + 1];
  }
  std::partial_sum(partner_begin_.begin(), partner_begin_.end(), partner_begin_.begin());
  partners_.resize(partner_begin_.back());
  std::vector<std::uint32_t> next(partner_begin_.begin(), partner_begin_.end() - 1);
  for (const auto& [a, b] : pairs) {
    partners_[next[a]++] = b;
    partners_[next[b]++] = a;
  }
}

// C2: the link of v seen along its fibre, from the inner end; also right for links that are not in order.
bool Builder::winds_once(std::uint32_t v) const noexcept {
  const auto around = fan(v);
  const LatticePoint centre = ends_[kInner][v];
  const LatticePoint d = ends_[kOuter][v] - centre;
  const auto next = [&](Corner c) { return base_.faces[c.slab][(c.corner + 1) % 3]; };
  const auto last = [&](Corner c) { return base_.faces[c.slab][(c.corner + 2) % 3]; };
  std::uint32_t first = next(around[0]);
  bool open = false;
  for (const Corner c : around) {
    bool follows = false;
    for (const Corner other : around) follows = follows || last(other) == next(c);
    if (!follows) {
      first = next(c);
      open = true;
    }
  }
  const LatticePoint start = ends_[kInner][first] - centre;
  const auto side = [&](std::uint32_t w) {
    return w == first ? 0 : determinant_sign(d, start, ends_[kInner][w] - centre);
  };
  int turns = 0;
  for (const Corner c : around) turns += side(next(c)) < 0 && side(last(c)) >= 0;
  return turns == (open ? 0 : 1);
}

bool Builder::holds_corner_of(std::uint32_t a, std::uint32_t b) const noexcept {
  for (const std::uint32_t v : base_.faces[b])
    for (const Side side : {kInner, kOuter})
      if (both_[a].holds(ends_[side][v]) && in_hull(triangle(a, kInner), triangle(a, kOuter), ends_[side][v]))
        return true;
  return false;
}

void Builder::blame(std::uint32_t s, Side side) {
  double deepest = 0;
  for (const std::uint32_t v : base_.faces[s]) deepest = std::max(deepest, depth_[side][v]);
  for (const std::uint32_t v : base_.faces[s])
    if (depth_[side][v] >= 0.4 * deepest) blamed_[side][v] = 1;
}

bool Builder::shrink(const Progress& progress) {
  const std::size_t points = base_.points.size(), faces = base_.faces.size();
  std::vector<std::uint8_t> stale(faces, 1);
  for (int round = 0; round < 400; ++round) {
    if (progress.cancelled()) return false;
    for (const Side side : {kInner, kOuter}) blamed_[side].assign(points, 0);
    faults_.clear();
    std::vector<std::uint8_t> faulty(faces, 0);  // tested again in the next round even if nothing moves
    const auto accuse = [&](std::uint32_t a, Side side_a, std::uint32_t b, Side side_b) {
      if (least(a, side_a) && least(b, side_b)) {
        faults_.emplace_back(a, b);
        faulty[a] = 1;
      }
      blame(a, side_a);
      blame(b, side_b);
    };
    for (std::uint32_t s = 0; s < faces; ++s) {
      if (stale[s] == 0) continue;
      const JacobianFault fault = jacobian_fault(triangle(s, kInner), triangle(s, kOuter));
      if (fault == JacobianFault::Inner) accuse(s, kInner, s, kInner);
      if (fault == JacobianFault::Outer) accuse(s, kOuter, s, kOuter);
      if (fault == JacobianFault::Between || (fault == JacobianFault::None && meet(s, kInner, s, kOuter)))
        accuse(s, kInner, s, kOuter);
    }
    for (std::uint32_t v = 0; v < points; ++v) {
      bool any = false;
      for (const Corner c : fan(v)) any = any || stale[c.slab] != 0;
      if (!any || winds_once(v)) continue;
      for (const Corner c : fan(v)) accuse(c.slab, kInner, c.slab, kInner);
    }
    for (std::uint32_t a = 0; a < faces; ++a) {
      if (stale[a] == 0) continue;
      if ((a & 63U) == 0 && progress.cancelled()) return false;
      for (const std::uint32_t b : partners(a)) {
        if ((stale[b] != 0 && b < a) || !both_[a].meets(both_[b])) continue;
        const bool adjacent = share_fibre(a, b);
        for (const Side sa : {kInner, kOuter})
          for (const Side sb : {kInner, kOuter})
            if ((sa != sb || !adjacent) && meet(a, sa, b, sb)) accuse(a, sa, b, sb);
        if (!adjacent && parts_.of_face[a] != parts_.of_face[b]) {
          for (const auto& [holder, held] : {std::pair{a, b}, std::pair{b, a}}) {
            if (!holds_corner_of(holder, held)) continue;
            if (least(holder, kInner) && least(holder, kOuter)) {
              faults_.emplace_back(a, b);
              faulty[a] = 1;
            }
            blame(holder, kInner);
            blame(holder, kOuter);
          }
        }
      }
    }
    bool moved = false;
    // In a heap of faces that all meet each other there is no room to look for.
    const double factor = partners_.size() > kHeap * faces ? 0 : round < 24 ? 0.8 : 0.5;
    std::vector<std::uint8_t> next(faulty);
    for (std::uint32_t v = 0; v < points; ++v)
      for (const Side side : {kInner, kOuter}) {
        if (blamed_[side][v] == 0 || depth_[side][v] <= kLeastDepth) continue;
        depth_[side][v] = std::max(kLeastDepth, depth_[side][v] * factor);
        place(v, side);
        moved = true;
        for (const Corner c : fan(v)) next[c.slab] = 1;
      }
    stale = std::move(next);
    for (std::uint32_t s = 0; s < faces; ++s)
      if (stale[s] != 0) measure(s);
    if (moved) continue;
    if (!faults_.empty() || volumes_agree()) return true;
    for (std::uint32_t s = 0; s < faces; ++s) {
      stale[s] = 1;
      measure(s);
    }
  }
  return true;
}

// The last condition of C3: inner and outer surface of a closed part enclose volumes of the same sign. Where not, the
// part is made thinner.
bool Builder::volumes_agree() {
  __extension__ using Wide = __int128;
  std::vector<std::array<Wide, 2>> volumes(parts_.count);
  std::vector<std::uint8_t> open(parts_.count, 0);
  std::vector<std::uint32_t> anchor(parts_.count, 0xffffffffU);
  const auto has_edge = [&](std::uint32_t v, std::uint32_t from, std::uint32_t to) {
    for (const Corner c : fan(v))
      for (std::size_t k = 0; k < 3; ++k)
        if (base_.faces[c.slab][k] == from && base_.faces[c.slab][(k + 1) % 3] == to) return true;
    return false;
  };
  for (std::uint32_t s = 0; s < base_.faces.size(); ++s) {
    const std::uint32_t part = parts_.of_face[s];
    const Face& f = base_.faces[s];
    if (anchor[part] == 0xffffffffU) anchor[part] = f[0];
    for (std::size_t k = 0; k < 3; ++k)
      if (open[part] == 0 && !has_edge(f[k], f[(k + 1) % 3], f[k])) open[part] = 1;
    for (const Side side : {kInner, kOuter}) {
      const LatticeTriangle t = triangle(s, side);
      const LatticePoint o = ends_[side][anchor[part]];
      const Vec3<std::int64_t> a = {t[0].x - o.x, t[0].y - o.y, t[0].z - o.z};
      const Vec3<std::int64_t> b = {t[1].x - o.x, t[1].y - o.y, t[1].z - o.z};
      const Vec3<std::int64_t> c = {t[2].x - o.x, t[2].y - o.y, t[2].z - o.z};
      const Vec3<std::int64_t> n = cross(a, b);
      volumes[part][side] += Wide{n.x} * c.x + Wide{n.y} * c.y + Wide{n.z} * c.z;
    }
  }
  bool agree = true;
  std::vector<std::uint8_t> thin(base_.points.size(), 0);
  for (std::uint32_t s = 0; s < base_.faces.size(); ++s) {
    const auto& [in, out] = volumes[parts_.of_face[s]];
    if (open[parts_.of_face[s]] != 0 || (in > 0 && out > 0) || (in < 0 && out < 0)) continue;
    if (least(s, kInner) && least(s, kOuter)) {
      faults_.emplace_back(s, s);
      continue;
    }
    agree = false;
    for (const std::uint32_t v : base_.faces[s]) thin[v] = 1;
  }
  for (std::uint32_t v = 0; v < thin.size(); ++v)
    for (const Side side : {kInner, kOuter})
      if (thin[v] != 0) {
        depth_[side][v] = std::max(kLeastDepth, depth_[side][v] * 0.5);
        place(v, side);
      }
  return agree;
}

// Whether all conditions hold around a vertex whose ends have moved.
bool Builder::sound_at(std::uint32_t v) const noexcept {
  for (const Corner c : fan(v)) {
    const std::uint32_t s = c.slab;
    if (jacobian_fault(triangle(s, kInner), triangle(s, kOuter)) != JacobianFault::None || meet(s, kInner, s, kOuter))
      return false;
    for (const std::uint32_t w : base_.faces[s])
      if (!winds_once(w)) return false;
  }
  for (const Corner c : fan(v))
    for (const std::uint32_t b : partners(c.slab)) {
      if (!both_[c.slab].meets(both_[b])) continue;
      const bool adjacent = share_fibre(c.slab, b);
      for (const Side sa : {kInner, kOuter})
        for (const Side sb : {kInner, kOuter})
          if ((sa != sb || !adjacent) && meet(c.slab, sa, b, sb)) return false;
      if (!adjacent && parts_.of_face[c.slab] != parts_.of_face[b] &&
          (holds_corner_of(c.slab, b) || holds_corner_of(b, c.slab)))
        return false;
    }
  return true;
}

bool Builder::grow(const Progress& progress) {
  for (const double factor : {3.0, 2.0, 1.4, 1.4, 1.15, 1.15}) {
    for (std::uint32_t v = 0; v < base_.points.size(); ++v) {
      if ((v & 255U) == 0 && progress.cancelled()) return false;
      for (const Side side : {kInner, kOuter}) {
        const double old = depth_[side][v], wanted = fibres_.wanted[side][v];
        if (old >= wanted) continue;
        depth_[side][v] = std::min(wanted, old * factor);
        place(v, side);
        for (const Corner c : fan(v)) measure(c.slab);
        if (sound_at(v)) continue;
        depth_[side][v] = old;
        place(v, side);
        for (const Corner c : fan(v)) measure(c.slab);
      }
    }
  }
  return true;
}

/// Which faces stay: those that are to blame are taken out one by one, the worst first, and then what hangs on by a
/// point.
std::vector<std::uint8_t> faces_to_keep(const BaseMesh& base, const std::vector<std::uint32_t>& part_of_face,
                                        std::vector<std::pair<std::uint32_t, std::uint32_t>> faults) {
  const std::size_t faces = base.faces.size();
  std::vector<std::uint8_t> keep(faces, 1);
  sort_unique(faults);
  std::vector<std::vector<std::uint32_t>> against(faces);
  for (const auto& [a, b] : faults) {
    if (a == b) {
      keep[a] = 0;
    } else {
      against[a].push_back(b);
      against[b].push_back(a);
    }
  }
  std::vector<std::size_t> part_size(faces, 0), conflicts(faces, 0);
  for (const std::uint32_t part : part_of_face) ++part_size[part];
  std::vector<std::uint32_t> accused;
  for (std::uint32_t s = 0; s < faces; ++s) {
    if (keep[s] == 0) continue;
    for (const std::uint32_t b : against[s]) conflicts[s] += keep[b];
    if (conflicts[s] > 0) accused.push_back(s);
  }
  const auto worse = [&](std::uint32_t a, std::uint32_t b) {
    if (conflicts[a] != conflicts[b]) return conflicts[a] > conflicts[b];
    const std::size_t sa = part_size[part_of_face[a]], sb = part_size[part_of_face[b]];
    if (sa != sb) return sa < sb;
    return part_of_face[a] != part_of_face[b] ? part_of_face[a] > part_of_face[b] : a > b;
  };
  while (!accused.empty()) {
    const auto worst = std::min_element(accused.begin(), accused.end(), worse);
    const std::uint32_t s = *worst;
    if (conflicts[s] == 0) break;
    keep[s] = 0;
    for (const std::uint32_t b : against[s])
      if (keep[b] != 0) --conflicts[b];
    conflicts[s] = 0;
    accused.erase(worst);
  }
  // One fan per point: the largest stays.
  std::vector<std::vector<std::uint32_t>> fans(base.points.size());
  for (std::uint32_t s = 0; s < faces; ++s)
    for (const std::uint32_t v : base.faces[s]) fans[v].push_back(s);
  for (bool again = true; again;) {
    again = false;
    for (std::uint32_t v = 0; v < fans.size(); ++v) {
      std::vector<std::uint32_t> rest;
      for (const std::uint32_t s : fans[v])
        if (keep[s] != 0) rest.push_back(s);
      std::vector<std::uint32_t> largest;
      while (!rest.empty()) {
        std::vector<std::uint32_t> run = {rest.front()};
        rest.erase(rest.begin());
        for (std::size_t k = 0; k < run.size(); ++k)
          for (std::size_t j = 0; j < rest.size();) {
            int common = 0;
            for (const std::uint32_t w : base.faces[run[k]])
              for (const std::uint32_t x : base.faces[rest[j]]) common += w == x;
            if (common >= 2) {
              run.push_back(rest[j]);
              rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(j));
            } else {
              ++j;
            }
          }
        if (run.size() > largest.size()) std::swap(run, largest);
        for (const std::uint32_t s : run) {
          keep[s] = 0;
          again = true;
        }
      }
    }
  }
  return keep;
}

}  // namespace

Parts find_parts(std::size_t point_count, const std::vector<Face>& faces) {
  DisjointSets sets(point_count);
  for (const Face& f : faces)
    for (std::size_t k = 1; k < 3 && f[0] < point_count; ++k) sets.join(f[0], f[k]);
  Parts parts;
  parts.of_face.resize(faces.size());
  std::vector<std::uint32_t> number(point_count, 0xffffffffU);
  for (std::size_t s = 0; s < faces.size(); ++s) {
    if (faces[s][0] >= point_count) continue;
    std::uint32_t& n = number[sets.least(faces[s][0])];
    if (n == 0xffffffffU) n = parts.count++;
    parts.of_face[s] = n;
  }
  return parts;
}

std::vector<Vec3d> vertex_directions(const BaseMesh& base) {
  std::vector<std::vector<Vec3d>> normals(base.points.size());
  for (const Face& f : base.faces) {
    const Vec3d a = to_double(base.points[f[0]]), b = to_double(base.points[f[1]]), c = to_double(base.points[f[2]]);
    const Vec3d n = cross(b - a, c - a);
    if (dot(n, n) > 0)
      for (const std::uint32_t v : f) normals[v].push_back(normalized(n));
  }
  std::vector<Vec3d> directions(base.points.size(), Vec3d{0, 0, 1});
  for (std::size_t v = 0; v < normals.size(); ++v)
    if (const Vec3d d = best_direction(normals[v]).d; dot(d, d) > 0.5) directions[v] = d;
  return directions;
}

Shell build_shell(const BaseMesh& base, const Fibres& fibres, const Progress& progress) {
  BaseMesh mesh = base;
  Fibres wanted = fibres;
  Shell shell;
  shell.from.resize(base.faces.size());
  std::iota(shell.from.begin(), shell.from.end(), 0U);
  std::array<std::vector<double>, 2> start;
  while (!mesh.faces.empty()) {
    Builder builder(mesh, wanted, start);
    if (!builder.shrink(progress)) return {};
    if (builder.faults().empty()) {
      if (!builder.grow(progress)) return {};
      shell.ends = builder.take_ends();
      shell.faces = std::move(mesh.faces);
      break;
    }
    const std::vector<std::uint8_t> keep = faces_to_keep(mesh, builder.part_of_face(), builder.faults());
    BaseMesh rest;
    Fibres rest_wanted;
    std::array<std::vector<double>, 2> rest_start;
    std::vector<std::uint32_t> number(mesh.points.size(), 0xffffffffU), from;
    for (std::size_t s = 0; s < mesh.faces.size(); ++s) {
      if (keep[s] == 0) {
        shell.dropped.push_back(shell.from[s]);
        continue;
      }
      Face face{};
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t v = mesh.faces[s][k];
        if (number[v] == 0xffffffffU) {
          number[v] = static_cast<std::uint32_t>(rest.points.size());
          rest.points.push_back(mesh.points[v]);
          rest_wanted.directions.push_back(wanted.directions[v]);
          for (const Side side : {kInner, kOuter}) {
            rest_wanted.wanted[side].push_back(wanted.wanted[side][v]);
            rest_start[side].push_back(4 * builder.depth(v, side));
          }
        }
        face[k] = number[v];
      }
      rest.faces.push_back(face);
      from.push_back(shell.from[s]);
    }
    mesh = std::move(rest);
    wanted = std::move(rest_wanted);
    start = std::move(rest_start);
    shell.from = std::move(from);
  }
  return shell;
}

}  // namespace relief::detail
