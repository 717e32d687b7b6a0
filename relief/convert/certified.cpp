#include <relief/convert/certified.h>
#include <relief/convert/directions.h>
#include <relief/convert/fill.h>
#include <relief/convert/quadric.h>
#include <relief/convert/section.h>
#include <relief/convert/triangle_grid.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

namespace relief::detail {
namespace {

constexpr std::uint32_t kNone = 0xffffffffU;
constexpr std::uint32_t kBlock = 16;  // triangles
/// The least fibre half that the thin shell may have, lattice steps.
constexpr double kLeastHeight = 12;
/// Fibres lean towards every face they cross by this sine at least, so that rounding cannot turn it.
constexpr float kLeastSlack = 1e-3F;

using Ends = std::array<LatticePoint, 2>;  // by Side

constexpr std::uint32_t next_of(std::uint32_t h) noexcept { return h % 3 == 2 ? h - 2 : h + 1; }
constexpr std::uint32_t last_of(std::uint32_t h) noexcept { return h % 3 == 0 ? h + 2 : h - 1; }

/// Half-edge 3 f + k runs from corner k of face f to the next; per half-edge the opposite one. Closed meshes only.
std::vector<std::uint32_t> find_twins(std::span<const Face> faces, std::size_t point_count) {
  std::vector<std::uint32_t> begin(point_count + 1, 0), from(faces.size() * 3), twins(faces.size() * 3, kNone);
  for (const Face& f : faces)
    for (const std::uint32_t v : f) ++begin[v + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
  for (std::uint32_t h = 0; h < from.size(); ++h) from[next[faces[h / 3][h % 3]]++] = h;
  for (std::uint32_t h = 0; h < twins.size(); ++h) {
    const std::uint32_t u = faces[h / 3][h % 3], v = faces[h / 3][(h + 1) % 3];
    for (std::uint32_t e = begin[v]; e < begin[v + 1]; ++e)
      if (faces[from[e] / 3][(from[e] + 1) % 3] == u) twins[h] = from[e];
  }
  return twins;
}

/// Bits of x, y, z interleaved; 10 of each.
std::uint32_t morton(LatticePoint p) noexcept {
  const auto spread = [](std::uint32_t v) {
    v = (v | (v << 16U)) & 0x030000ffU;
    v = (v | (v << 8U)) & 0x0300f00fU;
    v = (v | (v << 4U)) & 0x030c30c3U;
    return (v | (v << 2U)) & 0x09249249U;
  };
  const auto top = [](std::int32_t v) { return std::min(static_cast<std::uint32_t>(v) >> 15U, 1023U); };
  return spread(top(p.x)) | (spread(top(p.y)) << 1U) | (spread(top(p.z)) << 2U);
}

/// The source: triangles in Morton order, points in the order in which these first name them.
struct Source {
  std::vector<LatticePoint> points;
  std::vector<Face> faces;
  std::vector<std::uint32_t> point_of, face_of;  // numbers in the caller's source
  struct Normal {
    float x, y, z, slack;
  };
  std::vector<Normal> normals;
  std::vector<SourceBlock> blocks;

  Source(std::span<const LatticePoint> given, std::span<const Face> given_faces);
  /// After points have moved.
  void update();
  [[nodiscard]] Vec3d normal(std::uint32_t t) const noexcept {
    return {double(normals[t].x), double(normals[t].y), double(normals[t].z)};
  }
  [[nodiscard]] SourceTriangle triangle(std::uint32_t t) const noexcept {
    const Face& f = faces[t];
    return {to_double(points[f[0]]), to_double(points[f[1]]), to_double(points[f[2]]), normal(t),
            double(normals[t].slack)};
  }
  [[nodiscard]] Vec3d cross_of(std::uint32_t t) const noexcept {
    const Vec3d a = to_double(points[faces[t][0]]);
    return cross(to_double(points[faces[t][1]]) - a, to_double(points[faces[t][2]]) - a);
  }
};

Source::Source(std::span<const LatticePoint> given, std::span<const Face> given_faces) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order(given_faces.size());
  for (std::uint32_t t = 0; t < order.size(); ++t) order[t] = {morton(given[given_faces[t][0]]), t};
  std::sort(order.begin(), order.end());
  std::vector<std::uint32_t> number(given.size(), kNone);
  faces.reserve(order.size());
  for (const auto& [code, t] : order) {
    Face f{};
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& n = number[given_faces[t][k]];
      if (n == kNone) {
        n = static_cast<std::uint32_t>(points.size());
        points.push_back(given[given_faces[t][k]]);
        point_of.push_back(given_faces[t][k]);
      }
      f[k] = n;
    }
    faces.push_back(f);
    face_of.push_back(t);
  }
  update();
}

void Source::update() {
  normals.resize(faces.size());
  for (std::uint32_t t = 0; t < faces.size(); ++t) {
    const Vec3d n = cross_of(t);
    const double size = length(n);
    if (!(size > 0)) {
      normals[t] = {0, 0, 0, 1};
      continue;
    }
    // A move of the corners by the clearance turns the normal by about the clearance over the triangle's height; for
    // needles this is let go.
    const Vec3d a = to_double(points[faces[t][0]]);
    const Vec3d e = to_double(points[faces[t][1]]) - a, g = to_double(points[faces[t][2]]) - a;
    const double turn = 2 * kClearance * (length(e) + length(g)) / size;
    const Vec3f unit = to_float(n / size);
    normals[t] = {unit.x, unit.y, unit.z, std::max(kLeastSlack, static_cast<float>(std::min(turn, 0.01)))};
  }
  blocks.assign((faces.size() + kBlock - 1) / kBlock, {});
  for (std::uint32_t b = 0; b < blocks.size(); ++b) {
    Box3d box;
    Vec3d sum;
    double slack = 0;
    const auto end = std::min(static_cast<std::uint32_t>(faces.size()), (b + 1) * kBlock);
    for (std::uint32_t t = b * kBlock; t < end; ++t) {
      for (const std::uint32_t v : faces[t]) box.add(to_double(points[v]));
      sum += normal(t);
      slack = std::max(slack, double(normals[t].slack));
    }
    const Vec3d axis = normalized(sum);
    double cosine = 1;
    for (std::uint32_t t = b * kBlock; t < end; ++t) cosine = std::min(cosine, dot(axis, normal(t)));
    blocks[b] = {box.centre(), box.extent() * 0.5, axis, cosine - 1e-6, slack};
  }
}

/// An entry of a slab's list: a triangle or a whole block of the source, in the source's order.
struct Entry {
  std::uint32_t code;
  [[nodiscard]] static Entry triangle(std::uint32_t t) noexcept { return {t << 1U}; }
  [[nodiscard]] static Entry block(std::uint32_t b) noexcept { return {((b * kBlock) << 1U) | 1U}; }
  [[nodiscard]] bool is_block() const noexcept { return (code & 1U) != 0; }
  [[nodiscard]] std::uint32_t first() const noexcept { return code >> 1U; }
  friend bool operator<(Entry a, Entry b) noexcept { return a.code < b.code; }
};

/// Why a change is not possible.
enum class Fault : std::uint8_t { None, Winding, Jacobian, Outer, Inner, Folded, OuterOverlap, InnerOverlap, Empty };

class Reducer {
 public:
  Reducer(Source& source, const CertifiedSettings& settings);

  /// False when cancelled; faces that cannot be made valid are in faults().
  bool thin_shell(const Progress& progress);
  [[nodiscard]] const std::vector<std::uint32_t>& faults() const noexcept { return faults_; }
  /// False when cancelled.
  bool reduce(const Progress& progress);
  bool sweep(std::size_t stop, const Progress& progress);
  bool thicken(const Progress& progress);
  [[nodiscard]] Shell shell() const;

 private:
  struct Candidate {
    double cost;
    std::uint32_t u, v, stamp_u, stamp_v;
    friend bool operator<(const Candidate& a, const Candidate& b) noexcept {
      if (a.cost != b.cost) return a.cost > b.cost;
      return a.u != b.u ? a.u > b.u : a.v > b.v;
    }
  };
  struct List {
    std::uint32_t begin = 0, count = 0;
  };
  /// The faces that a change puts in place of others. Corner 0 of each is the moved vertex, if there is one; then they
  /// run once around it.
  struct Trial {
    std::vector<Face> faces;
    std::vector<std::uint32_t> slots;     // the faces they replace
    std::vector<std::uint32_t> vanished;  // further ones that go
    std::uint32_t moved = kNone;
    Ends ends;
    std::vector<SlabShape> shapes;
    std::vector<Entry> lists;
    std::vector<List> ranges;
  };

  [[nodiscard]] std::uint32_t origin(std::uint32_t h) const noexcept { return faces_[h / 3][h % 3]; }
  [[nodiscard]] std::uint32_t target(std::uint32_t h) const noexcept { return origin(next_of(h)); }
  [[nodiscard]] bool alive(std::uint32_t f) const noexcept { return faces_[f][0] != kNone; }
  template <typename Visit>
  void for_ring(std::uint32_t v, Visit&& visit) const {
    const std::uint32_t start = out_[v];
    std::uint32_t h = start;
    do {
      visit(h);
      h = twins_[last_of(h)];
    } while (h != start);
  }
  [[nodiscard]] std::size_t valence(std::uint32_t v) const noexcept {
    std::size_t count = 0;
    for_ring(v, [&](std::uint32_t) { ++count; });
    return count;
  }
  [[nodiscard]] LatticeTriangle triangle(std::uint32_t f, Side side) const noexcept {
    return {ends_[faces_[f][0]][side], ends_[faces_[f][1]][side], ends_[faces_[f][2]][side]};
  }
  [[nodiscard]] SlabShape shape(std::uint32_t f) const noexcept { return {triangle(f, kInner), triangle(f, kOuter)}; }
  [[nodiscard]] std::span<const Entry> list(std::uint32_t f) const noexcept {
    return std::span(pool_).subspan(lists_[f].begin, lists_[f].count);
  }

  void place(std::uint32_t v, const std::array<double, 2>& heights, Vec3d d);
  [[nodiscard]] std::pair<double, Vec3d> weigh(std::uint32_t u, std::uint32_t v) const noexcept;
  void push(std::uint32_t h);
  void fill_queue();
  void build_grid();
  void touch(std::uint32_t v);

  bool link_allows(std::uint32_t h);
  void star_of(std::uint32_t v);
  bool star_of_edge(std::uint32_t h);
  void gather();
  Direction aim();
  [[nodiscard]] double least_lean(Vec3d d) const noexcept;
  Fault evaluate();
  Fault evaluate_source();
  Fault evaluate_overlap();
  struct Quality {
    double least = 1, mean = 0;
  };
  [[nodiscard]] Quality quality(Vec3d at) const noexcept;
  [[nodiscard]] Quality quality_now() const noexcept;
  void commit_lists();

  bool collapse(std::uint32_t h);
  bool collapse_to(std::uint32_t h, Vec3d at, double shape_before);
  void merge(std::uint32_t h, Vec3d at);
  bool try_ends(Vec3d at, const Ends& ends);
  void improve(std::uint32_t v);
  void flip(std::uint32_t h);
  void lengthen(std::uint32_t v, double share);

  Source& source_;
  CertifiedSettings settings_;
  std::vector<Face> faces_;
  std::vector<std::uint32_t> twins_, out_;
  std::vector<Vec3d> at_;
  std::vector<Ends> ends_;
  std::vector<Quadric> quadrics_;
  std::vector<std::uint32_t> swept_, stamps_, touched_, improved_, tried_;
  std::uint32_t clock_ = 1;
  std::vector<List> lists_;
  std::vector<Entry> pool_;
  std::size_t listed_ = 0, alive_ = 0;
  std::vector<Candidate> queue_;
  bool queued_ = false;  // merged vertices put their edges into the queue
  TriangleGrid grid_;
  std::size_t grid_alive_ = 0, grid_entries_ = 0;
  std::vector<std::uint32_t> faults_;
  Parts parts_;  // of the source's faces, which K's keep

  // Scratch.
  Trial trial_;
  std::vector<Entry> union_;
  std::vector<SourceTriangle> loaded_;
  bool gathered_ = false;
  std::vector<std::uint32_t> seen_, seen_blocks_, mark_, in_star_;
  std::uint32_t seen_round_ = 0, mark_round_ = 0;
  std::size_t hint_ = 0;  // the entry of the union that failed last
  std::vector<Vec3d> normals_;
  std::vector<std::uint32_t> found_;
};

Reducer::Reducer(Source& source, const CertifiedSettings& settings) : source_(source), settings_(settings) {
  const std::size_t points = source.points.size(), faces = source.faces.size();
  faces_ = source.faces;
  twins_ = find_twins(faces_, points);
  out_.assign(points, kNone);
  for (std::uint32_t h = 0; h < 3 * faces; ++h) out_[origin(h)] = h;
  at_.reserve(points);
  for (const LatticePoint p : source.points) at_.push_back(to_double(p));
  ends_.resize(points);
  quadrics_.resize(points);
  for (std::uint32_t t = 0; t < faces; ++t) {
    const Vec3d n = source.cross_of(t);
    const double size = length(n);
    if (!(size > 0)) continue;
    for (const std::uint32_t v : faces_[t]) quadrics_[v].add_plane(n / size, at_[faces_[t][0]], size / 6);
  }
  stamps_.assign(points, 0);
  touched_.assign(points, 1);
  improved_.assign(points, 0);
  tried_.assign(3 * faces, 0);
  lists_.resize(faces);
  seen_.assign(faces, 0);
  seen_blocks_.assign(source.blocks.size(), 0);
  mark_.assign(points, 0);
  in_star_.assign(faces, 0);
  alive_ = faces;
  parts_ = find_parts(points, faces_);
}

void Reducer::place(std::uint32_t v, const std::array<double, 2>& heights, Vec3d d) {
  ends_[v] = {snap(at_[v] - d * heights[kInner]), snap(at_[v] + d * heights[kOuter])};
}

void Reducer::build_grid() {
  Box3d all;
  double size = 0;
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    if (!alive(f)) continue;
    Box3d box;
    for (const std::uint32_t v : faces_[f])
      for (const LatticePoint p : ends_[v]) box.add(to_double(p));
    const Vec3d e = box.extent();
    size += std::max({e.x, e.y, e.z});
    all.add(box);
  }
  grid_.reset(all, 1.5 * size / double(std::max<std::size_t>(alive_, 1)), faces_.size(), 2048);
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    if (!alive(f)) continue;
    Box3d box;
    for (const std::uint32_t v : faces_[f])
      for (const LatticePoint p : ends_[v]) box.add(to_double(p));
    grid_.insert(f, box);
  }
  grid_alive_ = alive_;
  grid_entries_ = grid_.entry_count();
}

// K = S. Each fibre runs through its vertex in the direction that sees all the faces there, so C2, C6 and C7 hold by
// construction; heights are halved where C1, C3 or C5 fail.
bool Reducer::thin_shell(const Progress& progress) {
  const std::size_t points = at_.size(), faces = faces_.size();
  std::vector<std::array<double, 2>> heights(points);
  std::vector<Vec3d> directions(points);
  for (std::uint32_t v = 0; v < points; ++v) {
    normals_.clear();
    double shortest = Box3d::kFar;
    for_ring(v, [&](std::uint32_t h) {
      normals_.push_back(source_.normal(h / 3));
      shortest = std::min(shortest, length(at_[target(h)] - at_[v]));
    });
    directions[v] = best_direction(normals_).d;
    heights[v].fill(std::clamp(0.3 * shortest, kLeastHeight, 0.49 * settings_.longest));
    place(v, heights[v], directions[v]);
  }
  build_grid();
  pool_.clear();
  std::vector<std::uint32_t> work(faces), later;
  std::iota(work.begin(), work.end(), 0U);
  std::vector<std::uint8_t> waits(faces, 0);
  std::array<std::vector<std::uint8_t>, 2> blamed;
  blamed.fill(std::vector<std::uint8_t>(points, 0));
  for (int round = 0; round < 60 && !work.empty(); ++round) {
    if (progress.cancelled()) return false;
    faults_.clear();
    found_.clear();
    const auto blame = [&](std::uint32_t f, Side side) {
      for (const std::uint32_t v : faces_[f]) {
        if (blamed[kInner][v] == 0 && blamed[kOuter][v] == 0) found_.push_back(v);
        blamed[side][v] = 1;
      }
      faults_.push_back(f);
    };
    std::size_t counter = 0;
    for (const std::uint32_t f : work) {
      if ((++counter & 4095U) == 0 && progress.cancelled()) return false;
      const SlabShape mine = shape(f);
      const JacobianFault jacobian = jacobian_fault(mine.triangle(kInner), mine.triangle(kOuter));
      if (jacobian != JacobianFault::None) {
        if (jacobian != JacobianFault::Outer) blame(f, kInner);
        if (jacobian != JacobianFault::Inner) blame(f, kOuter);
      }
      List& list = lists_[f];
      list = {static_cast<std::uint32_t>(pool_.size()), 0};
      grid_.query(mine.box(), [&](std::uint32_t g) {
        const Meeting meeting = mine.meet(source_.triangle(g));
        if (meeting != Meeting::Apart) {
          pool_.push_back(Entry::triangle(g));
          ++list.count;
        }
        if (meeting == Meeting::Outer) blame(f, kOuter);
        if (meeting == Meeting::Inner) blame(f, kInner);
        if (meeting == Meeting::Folded && g == f) {
          blame(f, kInner);
          blame(f, kOuter);
        }
        Box3d box;
        std::array<Box3d, 2> boxes;
        for (const Side side : {kInner, kOuter})
          for (const std::uint32_t v : faces_[g]) boxes[side].add(to_double(ends_[v][side]));
        box = boxes[kInner];
        box.add(boxes[kOuter]);
        if (!box.meets(mine.box())) return true;
        bool adjacent = false;
        for (const std::uint32_t v : faces_[f])
          for (const std::uint32_t w : faces_[g]) adjacent = adjacent || v == w;
        for (const Side mine_side : {kInner, kOuter})
          for (const Side side : {kInner, kOuter}) {
            if (side == mine_side && adjacent) continue;
            if (!boxes[side].meets(mine.box(mine_side))) continue;
            if (triangles_meet(mine.triangle(mine_side), triangle(g, side))) {
              blame(f, mine_side);
              blame(g, side);
            }
          }
        return true;
      });
    }
    listed_ = pool_.size();
    for (const std::uint32_t f : work) waits[f] = 0;
    later.clear();
    std::sort(found_.begin(), found_.end());
    bool stuck = true;
    for (const std::uint32_t v : found_) {
      for (const Side side : {kInner, kOuter}) {
        if (blamed[side][v] != 0 && heights[v][side] > kLeastHeight) {
          heights[v][side] = std::max(kLeastHeight, heights[v][side] * 0.5);
          stuck = false;
        }
        blamed[side][v] = 0;
      }
      place(v, heights[v], directions[v]);
      for_ring(v, [&](std::uint32_t h) {
        if (waits[h / 3] != 0) return;
        waits[h / 3] = 1;
        later.push_back(h / 3);
      });
    }
    if (stuck && !found_.empty()) break;
    std::sort(later.begin(), later.end());
    std::swap(work, later);
    if (work.empty()) faults_.clear();
  }
  std::sort(faults_.begin(), faults_.end());
  faults_.erase(std::unique(faults_.begin(), faults_.end()), faults_.end());
  return true;
}

/// What merging the ends of an edge costs, and where they would go.
std::pair<double, Vec3d> Reducer::weigh(std::uint32_t u, std::uint32_t v) const noexcept {
  Quadric q = quadrics_[u];
  q += quadrics_[v];
  const Merge merge = merge_ends(q, at_[u], at_[v]);
  return {merge.cost, merge.place};
}

void Reducer::push(std::uint32_t h) {
  const auto [u, v] = std::minmax({origin(h), target(h)});
  queue_.push_back({weigh(u, v).first, u, v, stamps_[u], stamps_[v]});
}

void Reducer::fill_queue() {
  queue_.clear();
  for (std::uint32_t h = 0; h < twins_.size(); ++h) {
    if (!alive(h / 3) || h > twins_[h]) continue;
    if (std::max(touched_[origin(h)], touched_[target(h)]) <= tried_[h]) continue;
    push(h);
  }
  std::make_heap(queue_.begin(), queue_.end());
}

void Reducer::touch(std::uint32_t v) {
  ++clock_;
  touched_[v] = clock_;
  for_ring(v, [&](std::uint32_t h) { touched_[target(h)] = clock_; });
}

// The two ends have two neighbours in common, the far corners of the edge's faces, and neither these nor the merged
// vertex come to have fewer than three faces.
bool Reducer::link_allows(std::uint32_t h) {
  const std::uint32_t u = origin(h), v = target(h);
  ++mark_round_;
  std::size_t around_u = 0, around_v = 0, shared = 0;
  for_ring(u, [&](std::uint32_t e) {
    mark_[target(e)] = mark_round_;
    ++around_u;
  });
  for_ring(v, [&](std::uint32_t e) {
    shared += mark_[target(e)] == mark_round_;
    ++around_v;
  });
  if (shared != 2 || around_u + around_v < 7 || around_u + around_v > 18) return false;
  return valence(target(next_of(h))) > 3 && valence(target(next_of(twins_[h]))) > 3;
}

void Reducer::star_of(std::uint32_t v) {
  trial_.faces.clear();
  trial_.slots.clear();
  trial_.vanished.clear();
  trial_.moved = v;
  for_ring(v, [&](std::uint32_t h) {
    trial_.faces.push_back({v, target(h), target(next_of(h))});
    trial_.slots.push_back(h / 3);
  });
  gathered_ = false;
}

// The star of the vertex that an edge becomes: from its left far corner around the first end to the right one, and
// back around the second.
bool Reducer::star_of_edge(std::uint32_t h) {
  const std::uint32_t u = origin(h);
  trial_.faces.clear();
  trial_.slots.clear();
  trial_.vanished.clear();
  trial_.moved = u;
  for (const std::uint32_t start : {h, twins_[h]}) {
    trial_.vanished.push_back(start / 3);
    const std::uint32_t stop = next_of(twins_[start]);  // the first edge after the twin's face is reached
    for (std::uint32_t e = twins_[last_of(start)]; e != stop; e = twins_[last_of(e)]) {
      trial_.faces.push_back({u, target(e), target(next_of(e))});
      trial_.slots.push_back(e / 3);
      if (trial_.faces.size() > 20) return false;
    }
  }
  gathered_ = false;
  return trial_.faces.size() >= 3;
}

/// The union of the lists of the faces that a trial replaces, in the source's order.
void Reducer::gather() {
  if (gathered_) return;
  gathered_ = true;
  union_.clear();
  hint_ = 0;
  ++seen_round_;
  const auto for_faces = [&](auto&& visit) {
    for (const std::uint32_t f : trial_.slots) visit(f);
    for (const std::uint32_t f : trial_.vanished) visit(f);
  };
  for_faces([&](std::uint32_t f) {
    in_star_[f] = seen_round_;
    for (const Entry e : list(f)) {
      if (!e.is_block() || seen_blocks_[e.first() / kBlock] == seen_round_) continue;
      seen_blocks_[e.first() / kBlock] = seen_round_;
      union_.push_back(e);
    }
  });
  for_faces([&](std::uint32_t f) {
    for (const Entry e : list(f)) {
      if (e.is_block() || seen_[e.first()] == seen_round_ || seen_blocks_[e.first() / kBlock] == seen_round_) continue;
      seen_[e.first()] = seen_round_;
      union_.push_back(e);
    }
  });
  std::sort(union_.begin(), union_.end());
  loaded_.resize(union_.size());
  for (std::size_t k = 0; k < union_.size(); ++k)
    if (!union_[k].is_block()) loaded_[k] = source_.triangle(union_[k].first());
}

double Reducer::least_lean(Vec3d d) const noexcept {
  double least = 1;
  for (const Vec3d n : normals_) least = std::min(least, dot(n, d));
  return least;
}

// The direction that best sees the source in the star; leaves the outermost of its normals in normals_.
Direction Reducer::aim() {
  normals_.clear();
  Vec3d mean;
  const auto add = [&](std::uint32_t t) {
    mean += source_.cross_of(t);
    normals_.push_back(source_.normal(t));
  };
  for (const Entry e : union_) {
    if (e.is_block())
      for (std::uint32_t t = e.first(); t < std::min<std::size_t>(e.first() + kBlock, source_.faces.size()); ++t)
        add(t);
    else
      add(e.first());
  }
  mean = normalized(mean);
  if (normals_.size() > 14) {
    const Vec3d aside = std::abs(mean.x) < 0.6 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
    const Vec3d e = normalized(cross(mean, aside)), g = cross(mean, e);
    constexpr std::size_t kAxes = 6;
    std::array<Vec3d, kAxes> axes;
    for (std::size_t k = 0; k < kAxes; ++k) {
      const double angle = std::numbers::pi * double(k) / kAxes;
      axes[k] = e * std::cos(angle) + g * std::sin(angle);
    }
    std::array<std::pair<double, std::size_t>, 2 * kAxes + 1> outermost;
    outermost.fill({-2, 0});
    for (std::size_t i = 0; i < normals_.size(); ++i) {
      for (std::size_t k = 0; k < kAxes; ++k) {
        const double h = dot(axes[k], normals_[i]);
        if (h > outermost[k].first) outermost[k] = {h, i};
        if (-h > outermost[k + kAxes].first) outermost[k + kAxes] = {-h, i};
      }
      const double h = -dot(mean, normals_[i]);
      if (h > outermost.back().first) outermost.back() = {h, i};
    }
    std::array<Vec3d, 2 * kAxes + 1> kept;
    for (std::size_t k = 0; k < kept.size(); ++k) kept[k] = normals_[outermost[k].second];
    normals_.assign(kept.begin(), kept.end());
  }
  Direction best = best_direction(normals_);
  if (best.visibility > 0.05) return best;
  // The normals fit in no cap below a half sphere: blend the worst one in, again and again.
  Vec3d d = mean;
  for (int k = 0; k < 50; ++k) {
    Vec3d worst = d;
    double least = 2;
    for (const Vec3d n : normals_)
      if (const double h = dot(n, d); h < least) {
        least = h;
        worst = n;
      }
    if (least > best.visibility) best = {d, least};
    d = normalized(d * (1 - 1.0 / (k + 2)) + worst * (1.0 / (k + 2)));
  }
  return best;
}

Reducer::Quality Reducer::quality(Vec3d at) const noexcept {
  Quality q;
  for (const Face& f : trial_.faces) {
    const Vec3d b = at_[f[1]], c = at_[f[2]];
    const double shape = shape_of(at, b, c, length(cross(b - at, c - at)));
    q.least = std::min(q.least, shape);
    q.mean += shape / double(trial_.faces.size());
  }
  return q;
}

Reducer::Quality Reducer::quality_now() const noexcept {
  Quality q;
  for (const std::uint32_t s : trial_.slots) {
    const Face& f = faces_[s];
    const double shape =
        shape_of(at_[f[0]], at_[f[1]], at_[f[2]], length(cross(at_[f[1]] - at_[f[0]], at_[f[2]] - at_[f[0]])));
    q.least = std::min(q.least, shape);
    q.mean += shape / double(trial_.slots.size());
  }
  return q;
}

/// All tests of a trial, cheap ones first. Leaves the shapes and lists of the new slabs behind.
Fault Reducer::evaluate() {
  const auto end = [&](std::uint32_t v, Side side) { return v == trial_.moved ? trial_.ends[side] : ends_[v][side]; };
  if (trial_.moved != kNone) {
    // C2: the link, seen along the fibre, comes round once.
    const LatticePoint centre = trial_.ends[kInner], d = trial_.ends[kOuter] - centre;
    const LatticePoint start = ends_[trial_.faces[0][1]][kInner] - centre;
    int turns = 0, last = 0;
    for (std::size_t k = 1; k <= trial_.faces.size(); ++k) {
      const int sign =
          k == trial_.faces.size() ? 0 : determinant_sign(d, start, ends_[trial_.faces[k][1]][kInner] - centre);
      turns += last < 0 && sign >= 0;
      last = sign;
    }
    if (turns != 1) return Fault::Winding;
  }
  trial_.shapes.clear();
  for (const Face& f : trial_.faces) {
    const LatticeTriangle in = {end(f[0], kInner), end(f[1], kInner), end(f[2], kInner)};
    const LatticeTriangle out = {end(f[0], kOuter), end(f[1], kOuter), end(f[2], kOuter)};
    if (jacobian_fault(in, out) != JacobianFault::None) return Fault::Jacobian;
    trial_.shapes.emplace_back(in, out);
  }
  if (const Fault fault = evaluate_source(); fault != Fault::None) return fault;
  return evaluate_overlap();
}

// C5 and C6.
Fault Reducer::evaluate_source() {
  const auto fault_of = [](Meeting m) {
    return m == Meeting::Outer    ? Fault::Outer
           : m == Meeting::Inner  ? Fault::Inner
           : m == Meeting::Folded ? Fault::Folded
                                  : Fault::None;
  };
  if (hint_ < union_.size() && !union_[hint_].is_block())
    for (const SlabShape& s : trial_.shapes)
      if (const Fault fault = fault_of(s.meet(loaded_[hint_])); fault != Fault::None) return fault;
  trial_.lists.clear();
  trial_.ranges.clear();
  for (const SlabShape& s : trial_.shapes) {
    const auto begin = static_cast<std::uint32_t>(trial_.lists.size());
    for (std::size_t k = 0; k < union_.size(); ++k) {
      const Entry e = union_[k];
      if (!e.is_block()) {
        const Meeting m = s.meet(loaded_[k]);
        if (m == Meeting::Apart) continue;
        if (m != Meeting::Section) {
          hint_ = k;
          return fault_of(m);
        }
        trial_.lists.push_back(e);
        continue;
      }
      const Meeting whole = s.meet(source_.blocks[e.first() / kBlock]);
      if (whole == Meeting::Section) trial_.lists.push_back(e);
      if (whole != Meeting::Mixed) continue;
      const auto stop = static_cast<std::uint32_t>(std::min<std::size_t>(e.first() + kBlock, source_.faces.size()));
      for (std::uint32_t t = e.first(); t < stop; ++t) {
        const Meeting m = s.meet(source_.triangle(t));
        if (m == Meeting::Apart) continue;
        if (m != Meeting::Section) return fault_of(m);
        trial_.lists.push_back(Entry::triangle(t));
      }
    }
    // Triangles that make up half a block or more are listed as the block.
    std::size_t kept = begin;
    for (std::size_t k = begin; k < trial_.lists.size();) {
      std::size_t stop = k + 1;
      const Entry e = trial_.lists[k];
      if (!e.is_block()) {
        while (stop < trial_.lists.size() && !trial_.lists[stop].is_block() &&
               trial_.lists[stop].first() / kBlock == e.first() / kBlock)
          ++stop;
      }
      if (stop - k >= kBlock / 2)
        trial_.lists[kept++] = Entry::block(e.first() / kBlock);
      else
        for (std::size_t j = k; j < stop; ++j) trial_.lists[kept++] = trial_.lists[j];
      k = stop;
    }
    trial_.lists.resize(kept);
    if (kept == begin) return Fault::Empty;
    trial_.ranges.push_back({begin, static_cast<std::uint32_t>(kept - begin)});
  }
  return Fault::None;
}

// C3, inner against outer included.
Fault Reducer::evaluate_overlap() {
  const std::size_t count = trial_.shapes.size();
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t b = 0; b < count; ++b) {
      const SlabShape &s = trial_.shapes[a], &t = trial_.shapes[b];
      if (!s.box(kInner).meets(t.box(kOuter)) || s.surely_apart(kInner, t, kOuter)) continue;
      if (triangles_meet(s.triangle(kInner), t.triangle(kOuter))) return Fault::InnerOverlap;
    }
  Box3d all;
  for (const SlabShape& s : trial_.shapes) all.add(s.box());
  Fault fault = Fault::None;
  grid_.query(all, [&](std::uint32_t g) {
    if (!alive(g) || in_star_[g] == seen_round_) return true;
    const Face& other = faces_[g];
    std::array<Box3d, 2> boxes;
    for (const Side side : {kInner, kOuter})
      for (const std::uint32_t v : other) boxes[side].add(to_double(ends_[v][side]));
    if (!boxes[kInner].meets(all) && !boxes[kOuter].meets(all)) return true;
    const bool same_part = parts_.of_face[g] == parts_.of_face[trial_.slots[0]];
    for (std::size_t k = 0; k < count; ++k) {
      const SlabShape& s = trial_.shapes[k];
      // C4: a part that is small beside a slab must not be swallowed whole.
      if (!same_part && in_hull(s.triangle(kInner), s.triangle(kOuter), ends_[other[0]][kOuter])) {
        fault = Fault::OuterOverlap;
        return false;
      }
      bool adjacent = false;
      for (const std::uint32_t v : trial_.faces[k])
        adjacent = adjacent || v == other[0] || v == other[1] || v == other[2];
      for (const Side mine : {kOuter, kInner})
        for (const Side side : {kOuter, kInner}) {
          if ((mine == side && adjacent) || !boxes[side].meets(s.box(mine))) continue;
          if (!triangles_meet(s.triangle(mine), triangle(g, side))) continue;
          fault = mine == kOuter ? Fault::OuterOverlap : Fault::InnerOverlap;
          return false;
        }
    }
    return true;
  });
  return fault;
}

/// Gives the trial's lists to its faces, enters these in the grid.
void Reducer::commit_lists() {
  for (const std::uint32_t f : trial_.vanished) {
    listed_ -= lists_[f].count;
    lists_[f] = {};
  }
  for (std::size_t k = 0; k < trial_.slots.size(); ++k) {
    List& list = lists_[trial_.slots[k]];
    listed_ -= list.count;
    list = {static_cast<std::uint32_t>(pool_.size()), trial_.ranges[k].count};
    listed_ += list.count;
    pool_.insert(pool_.end(), trial_.lists.begin() + trial_.ranges[k].begin,
                 trial_.lists.begin() + trial_.ranges[k].begin + trial_.ranges[k].count);
    grid_.insert(trial_.slots[k], trial_.shapes[k].box());
  }
  gathered_ = false;
  if (pool_.size() > 2 * listed_ + 65536) {
    std::vector<Entry> packed;
    packed.reserve(listed_ + listed_ / 2);
    for (List& list : lists_) {
      const auto begin = static_cast<std::uint32_t>(packed.size());
      packed.insert(packed.end(), pool_.begin() + list.begin, pool_.begin() + list.begin + list.count);
      list.begin = begin;
    }
    pool_ = std::move(packed);
  }
  if (grid_entries_ + 4096 < grid_.entry_count() / 3 || 9 * alive_ < 5 * grid_alive_) build_grid();
}

bool Reducer::try_ends(Vec3d at, const Ends& ends) {
  if (length(to_double(ends[kOuter] - ends[kInner])) > settings_.longest) return false;
  gather();
  trial_.ends = ends;
  if (evaluate() != Fault::None) return false;
  at_[trial_.moved] = at;
  ends_[trial_.moved] = ends;
  commit_lists();
  touch(trial_.moved);
  return true;
}

bool Reducer::collapse(std::uint32_t h) {
  if (!link_allows(h) || !star_of_edge(h)) return false;
  const std::uint32_t u = origin(h), v = target(h);
  const Vec3d best = weigh(u, v).second;
  double before = quality_now().least;
  for (const std::uint32_t f : trial_.vanished) {
    const Face& g = faces_[f];
    before = std::min(
        before, shape_of(at_[g[0]], at_[g[1]], at_[g[2]], length(cross(at_[g[1]] - at_[g[0]], at_[g[2]] - at_[g[0]]))));
  }
  for (const Vec3d at : {best, at_[u], at_[v], (at_[u] + at_[v]) * 0.5})
    if (collapse_to(h, at, before)) return true;
  return false;
}

bool Reducer::collapse_to(std::uint32_t h, Vec3d at, double shape_before) {
  const double shape = quality(at).least;
  if (shape < 0.08 && shape < 0.9 * shape_before) return false;
  gather();
  const std::uint32_t u = origin(h), v = target(h);
  const std::array<Vec3d, 2> old = {to_double(ends_[u][kOuter] - ends_[u][kInner]),
                                    to_double(ends_[v][kOuter] - ends_[v][kInner])};
  const double thickness = (length(old[0]) + length(old[1])) * 0.5;
  const std::array<Vec3d, 4> directions = {aim().d, normalized(normalized(old[0]) + normalized(old[1])),
                                           normalized(old[0]), normalized(old[1])};
  std::size_t choice = 0;
  std::array<double, 2> heights{};
  const auto start = [&](Vec3d d) {
    for (const Side side : {kInner, kOuter}) {
      const double sign = side == kOuter ? 1 : -1;
      const double mean =
          0.5 * sign * (dot(to_double(ends_[u][side]) - at, d) + dot(to_double(ends_[v][side]) - at, d));
      heights[side] = std::max(mean, 0.25 * thickness);
    }
  };
  start(directions[0]);
  int shrunk = 0;
  const bool patient = alive_ < 16 * settings_.target;  // few slabs are left: each is worth more tries
  for (int attempt = 0; attempt < (patient ? 24 : 10); ++attempt) {
    const double sum = heights[0] + heights[1];
    if (sum > 0.999 * settings_.longest) {
      if (attempt > 0) return false;
      for (double& height : heights) height *= 0.999 * settings_.longest / sum;
    }
    const Vec3d d = directions[choice];
    trial_.ends = {snap(at - d * heights[kInner]), snap(at + d * heights[kOuter])};
    switch (evaluate()) {
      case Fault::None:
        merge(h, at);
        return true;
      case Fault::Winding:
      case Fault::Jacobian:
        if (++shrunk <= 3) {
          for (double& height : heights) height *= 0.6;
          break;
        }
        if (!patient || ++choice == directions.size()) return false;
        start(directions[choice]);
        shrunk = 0;
        break;
      case Fault::Outer:
      case Fault::Empty:
        heights[kOuter] = 1.35 * heights[kOuter] + 0.1 * thickness;
        break;
      case Fault::Inner:
        heights[kInner] = 1.35 * heights[kInner] + 0.1 * thickness;
        break;
      case Fault::OuterOverlap:
        heights[kOuter] *= 0.8;
        break;
      case Fault::InnerOverlap:
        heights[kInner] *= 0.8;
        break;
      case Fault::Folded:
        if (++choice == directions.size()) return false;
        break;
    }
  }
  return false;
}

void Reducer::merge(std::uint32_t h, Vec3d at) {
  const std::uint32_t u = origin(h), v = target(h), back = twins_[h];
  const std::uint32_t a = target(next_of(h)), b = target(next_of(back));
  const std::uint32_t a_to_v = twins_[next_of(h)], u_to_a = twins_[last_of(h)];
  const std::uint32_t b_to_u = twins_[next_of(back)], v_to_b = twins_[last_of(back)];
  for (const std::uint32_t f : trial_.slots)
    for (std::uint32_t& w : faces_[f])
      if (w == v) w = u;
  for (const std::uint32_t f : trial_.vanished) faces_[f] = {kNone, kNone, kNone};
  twins_[a_to_v] = u_to_a;
  twins_[u_to_a] = a_to_v;
  twins_[b_to_u] = v_to_b;
  twins_[v_to_b] = b_to_u;
  out_[u] = u_to_a;
  out_[a] = a_to_v;
  out_[b] = b_to_u;
  out_[v] = kNone;
  quadrics_[u] += quadrics_[v];
  at_[u] = at;
  ends_[u] = trial_.ends;
  ++stamps_[u];
  ++stamps_[v];
  alive_ -= 2;
  commit_lists();
  touch(u);
  if (!queued_) return;
  for_ring(u, [&](std::uint32_t e) {
    push(e);
    std::push_heap(queue_.begin(), queue_.end());
  });
}

// Turns, slides and shortens a fibre where that makes further collapses likelier.
void Reducer::improve(std::uint32_t v) {
  star_of(v);
  gather();
  const auto fibre = [&] { return to_double(ends_[v][kOuter] - ends_[v][kInner]); };
  const auto shifted = [](LatticePoint p, Vec3d by) { return snap(to_double(p) + by); };
  {
    const Direction best = aim();
    const Vec3d d = normalized(fibre());
    if (best.visibility > least_lean(d) + 0.01) {
      const double in = dot(at_[v] - to_double(ends_[v][kInner]), d),
                   out = dot(to_double(ends_[v][kOuter]) - at_[v], d);
      for (const double share : {1.0, 0.5, 0.25}) {
        const Vec3d turned = normalized(d * (1 - share) + best.d * share);
        if (try_ends(at_[v], {snap(at_[v] - turned * in), snap(at_[v] + turned * out)})) break;
      }
    }
  }
  {
    Vec3d mean;
    for (const Face& f : trial_.faces) mean += at_[f[1]] / double(trial_.faces.size());
    const Vec3d d = normalized(fibre());
    Vec3d step = mean - at_[v];
    step = step - d * dot(step, d);
    const Quality before = quality_now();
    for (const double share : {0.6, 0.3}) {
      const Quality after = quality(at_[v] + step * share);
      if (after.least + 0.3 * after.mean < before.least + 0.3 * before.mean + 0.01) continue;
      const Vec3d by = step * share;
      if (try_ends(at_[v] + by, {shifted(ends_[v][kInner], by), shifted(ends_[v][kOuter], by)})) break;
    }
  }
  if (length(fibre()) > 1e-3 * settings_.longest) {
    const auto shortened = [&](Side side) {
      return shifted(ends_[v][side], (at_[v] - to_double(ends_[v][side])) * 0.4);
    };
    const LatticePoint in = shortened(kInner), out = shortened(kOuter);
    if (!try_ends(at_[v], {in, out}) && !try_ends(at_[v], {ends_[v][kInner], out}))
      try_ends(at_[v], {in, ends_[v][kOuter]});
  }
}

void Reducer::flip(std::uint32_t h) {
  const std::uint32_t back = twins_[h];
  const std::uint32_t u = origin(h), v = target(h), a = target(next_of(h)), b = target(next_of(back));
  const auto shape = [&](std::uint32_t i, std::uint32_t j, std::uint32_t k) {
    return shape_of(at_[i], at_[j], at_[k], length(cross(at_[j] - at_[i], at_[k] - at_[i])));
  };
  const double before = std::min(shape(u, v, a), shape(v, u, b)), after = std::min(shape(u, b, a), shape(b, v, a));
  const std::array<std::size_t, 4> degree = {valence(u), valence(v), valence(a), valence(b)};
  if (degree[0] < 4 || degree[1] < 4 || degree[2] > 11 || degree[3] > 11) return;
  const auto off = [](std::size_t d) { return std::abs(static_cast<int>(d) - 6); };
  const int gain = off(degree[0]) + off(degree[1]) + off(degree[2]) + off(degree[3]) - off(degree[0] - 1) -
                   off(degree[1] - 1) - off(degree[2] + 1) - off(degree[3] + 1);
  if (!(after > 1.05 * before + 0.02 || (gain >= 2 && after > 0.5 * before && after > 0.2))) return;
  bool joined = false;
  for_ring(a, [&](std::uint32_t e) { joined = joined || target(e) == b; });
  if (joined) return;
  const std::uint32_t f = h / 3, g = back / 3;
  trial_.faces = {{u, b, a}, {b, v, a}};
  trial_.slots = {f, g};
  trial_.vanished.clear();
  trial_.moved = kNone;
  gathered_ = false;
  gather();
  if (evaluate() != Fault::None) return;
  const std::uint32_t a_to_v = twins_[next_of(h)], u_to_a = twins_[last_of(h)];
  const std::uint32_t b_to_u = twins_[next_of(back)], v_to_b = twins_[last_of(back)];
  faces_[f] = trial_.faces[0];
  faces_[g] = trial_.faces[1];
  const auto join = [&](std::uint32_t x, std::uint32_t y) {
    twins_[x] = y;
    twins_[y] = x;
    tried_[x] = tried_[y] = 0;
  };
  join(3 * f, b_to_u);
  join(3 * f + 1, 3 * g + 2);
  join(3 * f + 2, u_to_a);
  join(3 * g, v_to_b);
  join(3 * g + 1, a_to_v);
  out_[u] = 3 * f;
  out_[b] = 3 * g;
  out_[v] = 3 * g + 1;
  out_[a] = 3 * f + 2;
  commit_lists();
  for (const std::uint32_t w : {u, v, a, b}) touch(w);
}

// While there are many slabs, edges below a rising cost are collapsed in the order in which they lie in memory, at most
// one per vertex and sweep: the order by cost matters little there, and what is touched stays in the cache.
bool Reducer::sweep(std::size_t stop, const Progress& progress) {
  constexpr double kShare = 0.35;  // of the edges may be tried in a sweep
  constexpr std::size_t kStride = 7;
  std::vector<double> costs;
  swept_.assign(out_.size(), 0);
  const double start = double(alive_);
  for (std::uint32_t round = 1; alive_ > stop; ++round) {
    costs.clear();
    std::size_t counter = 0;
    const auto is_edge = [&](std::uint32_t h) { return alive(h / 3) && h < twins_[h]; };
    for (std::uint32_t h = 0; h < twins_.size(); ++h)
      if (is_edge(h) && ++counter % kStride == 0) costs.push_back(weigh(origin(h), target(h)).first);
    const auto middle = costs.begin() + static_cast<std::ptrdiff_t>(kShare * double(costs.size()));
    std::nth_element(costs.begin(), middle, costs.end());
    const double most = *middle;
    const std::size_t before = alive_;
    for (std::uint32_t h = 0; h < twins_.size() && alive_ > stop; ++h) {
      if (!is_edge(h)) continue;
      const std::uint32_t u = origin(h), v = target(h);
      if (swept_[u] == round || swept_[v] == round || std::max(touched_[u], touched_[v]) <= tried_[h]) continue;
      if (weigh(u, v).first > most) continue;
      if (collapse(h)) {
        swept_[u] = round;
        if ((alive_ & 1023U) == 0) {
          if (progress.cancelled()) return false;
          progress("reduce", 0.5 * (start - double(alive_)) / (start - double(stop)));
        }
      } else {
        tried_[h] = tried_[twins_[h]] = clock_;
      }
    }
    if (progress.cancelled()) return false;
    if (before - alive_ < before / 50) break;
  }
  return true;
}

bool Reducer::reduce(const Progress& progress) {
  if (!sweep(std::max<std::size_t>(12000, 8 * settings_.target), progress)) return false;
  queued_ = true;
  const double start = double(alive_);
  for (int round = 0; alive_ > settings_.target && round < 40; ++round) {
    const std::size_t before = alive_;
    fill_queue();
    std::size_t counter = 0;
    while (!queue_.empty() && alive_ > settings_.target) {
      if ((++counter & 255U) == 0) {
        if (progress.cancelled()) return false;
        if ((counter & 8191U) == 0)
          progress("reduce", 0.5 + 0.5 * std::log(start / double(alive_)) / std::log(start / double(settings_.target)));
      }
      std::pop_heap(queue_.begin(), queue_.end());
      const Candidate c = queue_.back();
      queue_.pop_back();
      if (stamps_[c.u] != c.stamp_u || stamps_[c.v] != c.stamp_v) continue;
      std::uint32_t h = kNone;
      for_ring(c.u, [&](std::uint32_t e) {
        if (target(e) == c.v) h = e;
      });
      if (h == kNone || std::max(touched_[c.u], touched_[c.v]) <= tried_[h]) continue;
      if (!collapse(h)) tried_[h] = tried_[twins_[h]] = clock_;
    }
    const std::size_t removed = before - alive_;
    if (alive_ <= settings_.target) break;
    if (alive_ >= 20000 && 10 * removed >= before) continue;
    const auto improve_all = [&] {
      for (std::uint32_t v = 0; v < out_.size(); ++v) {
        if (out_[v] == kNone || touched_[v] <= improved_[v]) continue;
        improve(v);
        improved_[v] = clock_;
        if ((v & 63U) == 0 && progress.cancelled()) return false;
      }
      return true;
    };
    if (!improve_all()) return false;
    for (std::uint32_t h = 0; h < twins_.size(); ++h)
      if (alive(h / 3) && h < twins_[h]) flip(h);
    if (!improve_all()) return false;
    if (round >= 3 && removed < std::max<std::size_t>(2, before / 200)) break;
  }
  return true;
}

void Reducer::lengthen(std::uint32_t v, double share) {
  star_of(v);
  const Vec3d in = to_double(ends_[v][kInner]), out = to_double(ends_[v][kOuter]), d = out - in;
  const double size = length(d), most = 0.999 * settings_.longest / size - 1;
  if (most < 0.05) return;
  const double both = std::min(share, most / 2), one = std::min(share, most);
  if (try_ends(at_[v], {snap(in - d * both), snap(out + d * both)})) return;
  if (try_ends(at_[v], {ends_[v][kInner], snap(out + d * one)})) return;
  try_ends(at_[v], {snap(in - d * one), ends_[v][kOuter]});
}

// Room to carve and to add.
bool Reducer::thicken(const Progress& progress) {
  for (const double share : {0.5, 0.5, 0.5, 0.5, 0.15, 0.15, 0.15, 0.15}) {
    if (progress.cancelled()) return false;
    for (std::uint32_t v = 0; v < out_.size(); ++v)
      if (out_[v] != kNone) lengthen(v, share);
  }
  return true;
}

Shell Reducer::shell() const {
  Shell shell;
  std::vector<std::uint32_t> number(out_.size(), kNone);
  for (std::uint32_t f = 0; f < faces_.size(); ++f) {
    if (!alive(f)) continue;
    Face face{};
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& n = number[faces_[f][k]];
      if (n == kNone) {
        n = static_cast<std::uint32_t>(shell.ends[kInner].size());
        for (const Side side : {kInner, kOuter}) shell.ends[side].push_back(ends_[faces_[f][k]][side]);
      }
      face[k] = n;
    }
    shell.from.push_back(static_cast<std::uint32_t>(shell.faces.size()));
    shell.faces.push_back(face);
  }
  return shell;
}

/// Moves source vertices that no direction sees well, and those given, towards their neighbours; at most so far in all.
class Smoother {
 public:
  /// `start`: where the caller's points lay before they were moved; those that only patches have are free to move.
  Smoother(Source& source, const ClosedSource& given, std::span<const LatticePoint> start, double farthest)
      : source_(source), farthest_(farthest), free_(source.points.size(), 1) {
    for (std::size_t t = 0; t < source.faces.size(); ++t)
      if (given.patch[source.face_of[t]] == 0)
        for (const std::uint32_t v : source.faces[t]) free_[v] = 0;
    for (const std::uint32_t v : source.point_of) start_.push_back(start[v]);
    twins_ = find_twins(source.faces, source.points.size());
    out_.assign(source.points.size(), kNone);
    for (std::uint32_t h = 0; h < twins_.size(); ++h) out_[source.faces[h / 3][h % 3]] = h;
  }

  /// The vertices whose visibility stays below `least`, after smoothing those below `wanted`.
  std::vector<std::uint32_t> smooth(std::span<const std::uint32_t> given, double wanted, double least);

 private:
  template <typename Visit>
  void for_neighbours(std::uint32_t v, Visit&& visit) const {
    std::uint32_t h = out_[v];
    do {
      visit(source_.faces[h / 3][(h + 1) % 3]);
      h = twins_[last_of(h)];
    } while (h != out_[v]);
  }
  double visibility(std::uint32_t v) {
    normals_.clear();
    std::uint32_t h = out_[v];
    do {
      const Vec3d n = source_.cross_of(h / 3);
      if (!(dot(n, n) > 0)) return -1;
      normals_.push_back(normalized(n));
      h = twins_[last_of(h)];
    } while (h != out_[v]);
    return best_direction(normals_).visibility;
  }

  Source& source_;
  double farthest_;
  std::vector<std::uint8_t> free_;
  std::vector<LatticePoint> start_;
  std::vector<std::uint32_t> twins_, out_;
  std::vector<Vec3d> normals_;
};

std::vector<std::uint32_t> Smoother::smooth(std::span<const std::uint32_t> given, double wanted, double least) {
  const auto count = static_cast<std::uint32_t>(source_.points.size());
  std::vector<std::uint32_t> look(count), marked(given.begin(), given.end());
  std::iota(look.begin(), look.end(), 0U);
  std::vector<std::uint8_t> is_marked(count, 0);
  std::vector<Vec3d> goals;
  std::vector<std::uint32_t> movers;
  for (int round = 0; round < 60; ++round) {
    for (const std::uint32_t v : look)
      if (visibility(v) < wanted) marked.push_back(v);
    std::sort(marked.begin(), marked.end());
    marked.erase(std::unique(marked.begin(), marked.end()), marked.end());
    if (marked.empty()) break;
    for (const std::uint32_t v : marked) is_marked[v] = 1;
    movers = marked;
    for (const std::uint32_t v : marked) for_neighbours(v, [&](std::uint32_t w) { movers.push_back(w); });
    std::sort(movers.begin(), movers.end());
    movers.erase(std::unique(movers.begin(), movers.end()), movers.end());
    goals.clear();
    for (const std::uint32_t v : movers) {
      Vec3d mean;
      double around = 0;
      for_neighbours(v, [&](std::uint32_t w) {
        mean += to_double(source_.points[w]);
        ++around;
      });
      const Vec3d p = to_double(source_.points[v]), start = to_double(start_[v]);
      Vec3d goal = p + (mean / around - p) * (is_marked[v] != 0 ? 0.5 : 0.1);
      if (const double far = length(goal - start); far > farthest_ && free_[v] == 0)
        goal = start + (goal - start) * (farthest_ / far);
      goals.push_back(goal);
    }
    bool any = false;
    look.clear();
    for (std::size_t k = 0; k < movers.size(); ++k) {
      const LatticePoint to = snap(goals[k]);
      any = any || !(to == source_.points[movers[k]]);
      source_.points[movers[k]] = to;
      look.push_back(movers[k]);
      for_neighbours(movers[k], [&](std::uint32_t w) { look.push_back(w); });
    }
    std::sort(look.begin(), look.end());
    look.erase(std::unique(look.begin(), look.end()), look.end());
    for (const std::uint32_t v : marked) is_marked[v] = 0;
    marked.clear();
    if (!any) break;
  }
  std::vector<std::uint32_t> bad;
  for (std::uint32_t v = 0; v < count; ++v)
    if (visibility(v) < least) bad.push_back(v);
  source_.update();
  return bad;
}

/// Moves points that lie on others towards the inside of their own faces, by a tenth of their shortest edge.
std::size_t part_touching(ClosedSource& s, double farthest) {
  std::vector<std::uint32_t> order(s.points.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto key = [&](std::uint32_t v) { return std::tuple(s.points[v].x, s.points[v].y, s.points[v].z, v); };
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  std::vector<std::uint8_t> touches(s.points.size(), 0);
  for (std::size_t k = 1; k < order.size(); ++k)
    if (s.points[order[k]] == s.points[order[k - 1]]) touches[order[k]] = touches[order[k - 1]] = 1;
  std::vector<std::vector<Vec3d>> normals(s.points.size());
  std::vector<double> shortest(s.points.size(), Box3d::kFar);
  std::size_t count = 0;
  for (const Face& f : s.faces) {
    if (touches[f[0]] + touches[f[1]] + touches[f[2]] == 0) continue;
    const std::array<Vec3d, 3> p = {to_double(s.points[f[0]]), to_double(s.points[f[1]]), to_double(s.points[f[2]])};
    const Vec3d n = normalized(cross(p[1] - p[0], p[2] - p[0]));
    for (std::size_t k = 0; k < 3; ++k) {
      if (touches[f[k]] == 0) continue;
      normals[f[k]].push_back(n);
      shortest[f[k]] = std::min({shortest[f[k]], length(p[(k + 1) % 3] - p[k]), length(p[(k + 2) % 3] - p[k])});
    }
  }
  for (std::uint32_t v = 0; v < s.points.size(); ++v) {
    if (normals[v].empty()) continue;
    const Vec3d d = best_direction(normals[v]).d;
    s.points[v] = snap(to_double(s.points[v]) - d * std::min(farthest, std::max(4 * kLeastHeight, 0.1 * shortest[v])));
    ++count;
  }
  return count;
}

double area_of(const ClosedSource& s, std::size_t f) noexcept {
  const Vec3d a = to_double(s.points[s.faces[f][0]]);
  return 0.5 * length(cross(to_double(s.points[s.faces[f][1]]) - a, to_double(s.points[s.faces[f][2]]) - a));
}

/// Takes the bad faces out with the ring around them, and with one ring more each time that a place is cut again
/// (`heat`, per point), then closes the rims that this leaves. Pieces that come loose and are mere crumbs go, too. A
/// patch is phantom where what lay at its rim was. Gives the area and the number of the scanned faces that went;
/// nothing when a rim cannot be closed.
struct Loss {
  double area = 0;
  std::size_t faces = 0;
};
std::optional<Loss> cut_and_close(ClosedSource& s, std::vector<std::uint8_t> gone, std::vector<std::uint8_t>& heat) {
  constexpr std::size_t kCrumb = 50;  // faces
  const std::size_t faces = s.faces.size();
  std::vector<std::uint8_t> rings(faces, 0), near(s.points.size());
  for (std::size_t f = 0; f < faces; ++f)
    if (gone[f] != 0)
      for (const std::uint32_t v : s.faces[f]) rings[f] = std::max<std::uint8_t>(rings[f], std::uint8_t(heat[v] + 1));
  for (bool any = true; any;) {
    any = false;
    std::fill(near.begin(), near.end(), std::uint8_t{0});
    for (std::size_t f = 0; f < faces; ++f)
      for (const std::uint32_t v : s.faces[f]) near[v] = std::max(near[v], rings[f]);
    for (std::size_t f = 0; f < faces; ++f) {
      const std::uint8_t most = std::max({near[s.faces[f][0]], near[s.faces[f][1]], near[s.faces[f][2]]});
      if (most == 0 || (gone[f] != 0 && rings[f] + 1 >= most)) continue;
      any = any || most > 1;
      gone[f] = 1;
      rings[f] = most - 1;
    }
  }
  const std::vector<std::uint32_t> twins = find_twins(s.faces, s.points.size());
  const auto on_rim = [&](std::uint32_t h) { return gone[h / 3] == 0 && gone[twins[h] / 3] != 0; };
  for (bool pinched = true; pinched;) {
    pinched = false;
    // A point where more than one stretch of rim passes holds several fans.
    std::vector<std::uint8_t> stretches(s.points.size(), 0);
    for (std::uint32_t h = 0; h < twins.size(); ++h)
      if (on_rim(h)) stretches[s.faces[h / 3][h % 3]] = std::uint8_t(std::min(2, stretches[s.faces[h / 3][h % 3]] + 1));
    for (std::size_t f = 0; f < faces; ++f)
      for (const std::uint32_t v : s.faces[f])
        if (stretches[v] > 1 && gone[f] == 0) {
          gone[f] = 1;
          pinched = true;
        }
    // Crumbs that have come loose.
    std::vector<std::uint8_t> seen(faces, 0);
    std::vector<std::uint32_t> piece;
    for (std::uint32_t seed = 0; seed < faces; ++seed) {
      if (gone[seed] != 0 || seen[seed] != 0) continue;
      piece.assign(1, seed);
      seen[seed] = 1;
      bool open = false;
      for (std::size_t k = 0; k < piece.size(); ++k)
        for (std::uint32_t h = 3 * piece[k]; h < 3 * piece[k] + 3; ++h) {
          const std::uint32_t other = twins[h] / 3;
          open = open || gone[other] != 0;
          if (gone[other] != 0 || seen[other] != 0) continue;
          seen[other] = 1;
          piece.push_back(other);
        }
      if (!open || piece.size() > kCrumb) continue;
      for (const std::uint32_t f : piece) gone[f] = 1;
      pinched = true;
    }
  }
  // What lay across each rim, by the point at which the patch's edge begins.
  std::vector<std::uint8_t> phantom_across(s.points.size(), 0);
  ClosedSource rest;
  for (std::uint32_t f = 0; f < faces; ++f) {
    if (gone[f] != 0) continue;
    rest.faces.push_back(s.faces[f]);
    rest.phantom.push_back(s.phantom[f]);
    rest.patch.push_back(s.patch[f]);
    for (std::uint32_t h = 3 * f; h < 3 * f + 3; ++h)
      if (on_rim(h)) phantom_across[s.faces[f][(h + 1) % 3]] = s.phantom[twins[h] / 3];
  }
  if (rest.faces.empty()) return std::nullopt;
  const auto rims = find_rims(s.points.size(), rest.faces);
  std::vector<Vec3d> places;
  for (const LatticePoint p : s.points) places.push_back(to_double(p));
  const std::vector<Closing> closings(rims.size(), Closing::Membrane);
  const std::vector<std::size_t> begins = close_rims(places, rest.faces, rims, closings);
  for (std::size_t r = 0; r < rims.size(); ++r) {
    if (rims[r].size() < 3) return std::nullopt;
    std::size_t votes = 0;
    for (const std::uint32_t v : rims[r]) votes += phantom_across[v];
    rest.phantom.resize(begins[r + 1], 2 * votes > rims[r].size());
    std::uint8_t most = 0;
    for (const std::uint32_t v : rims[r]) most = std::max(most, heat[v]);
    most = std::min<std::uint8_t>(most + 1, 20);
    for (const std::uint32_t v : rims[r]) heat[v] = most;
    heat.resize(places.size(), 0);
    for (std::size_t f = begins[r]; f < begins[r + 1]; ++f)
      for (const std::uint32_t v : rest.faces[f]) heat[v] = most;
  }
  rest.patch.resize(rest.faces.size(), 1);
  Loss loss;
  for (std::size_t f = 0; f < faces; ++f) {
    if (gone[f] == 0 || s.patch[f] != 0) continue;
    loss.area += area_of(s, f);
    ++loss.faces;
  }
  rest.points = std::move(s.points);
  for (std::size_t v = rest.points.size(); v < places.size(); ++v) rest.points.push_back(snap(places[v]));
  s = std::move(rest);
  return loss;
}

}  // namespace

CertifiedShell build_certified(ClosedSource given, const CertifiedSettings& settings, const Progress& progress) {
  constexpr double kWanted = 0.3;  // visibility; more of it lets the shell become coarser
  constexpr double kLeast = 0.02;
  constexpr int kSmoothings = 3, kCuts = 12;
  constexpr double kMostReplaced = 0.03;  // of the area
  CertifiedShell result;
  result.source = std::move(given);
  ClosedSource& s = result.source;
  std::vector<LatticePoint> start = s.points;
  std::vector<std::uint8_t> heat(s.points.size(), 0);
  result.parted_points = part_touching(s, settings.farthest);
  double area = 0, replaced = 0;
  for (std::size_t f = 0; f < s.faces.size(); ++f) area += area_of(s, f);

  for (int cut = 0; cut <= kCuts; ++cut) {
    progress("shell", double(cut) / kCuts);
    Source source(s.points, s.faces);
    Smoother smoother(source, s, start, settings.farthest);
    std::vector<std::uint32_t> trouble;
    std::vector<std::uint8_t> bad(s.faces.size(), 0);
    // Smoothing settles a few crossings; many do not yield to it.
    for (int round = 0; round < (cut == 0 ? kSmoothings : 1); ++round) {
      const std::vector<std::uint32_t> singular = smoother.smooth(trouble, kWanted, kLeast);
      if (progress.cancelled()) return result;
      for (std::size_t v = 0; v < source.points.size(); ++v) s.points[source.point_of[v]] = source.points[v];
      Reducer reducer(source, settings);
      if (singular.empty() && !reducer.thin_shell(progress)) return result;
      if (singular.empty() && reducer.faults().empty()) {
        if (!reducer.reduce(progress) || !reducer.thicken(progress)) return result;
        result.obstacle.clear();
        result.shell = reducer.shell();
        std::vector<std::uint8_t> scanned(s.points.size(), 0);
        for (std::size_t f = 0; f < s.faces.size(); ++f)
          if (s.patch[f] == 0)
            for (const std::uint32_t v : s.faces[f]) scanned[v] = 1;
        for (std::size_t v = 0; v < s.points.size(); ++v) {
          if (scanned[v] == 0) continue;
          const double far = length(to_double(s.points[v] - start[v]));
          result.moved_points += far > 0;
          result.moved_most = std::max(result.moved_most, far);
        }
        return result;
      }
      std::fill(bad.begin(), bad.end(), std::uint8_t{0});
      if (!singular.empty()) {
        std::vector<std::uint8_t> marked(source.points.size(), 0);
        for (const std::uint32_t v : singular) marked[v] = 1;
        for (std::size_t f = 0; f < source.faces.size(); ++f)
          for (const std::uint32_t v : source.faces[f]) bad[source.face_of[f]] = bad[source.face_of[f]] | marked[v];
        result.place = source.points[singular.front()];
        result.obstacle = std::to_string(singular.size()) +
                          (singular.size() == 1 ? " vertex has faces" : " vertices have faces") +
                          " that no direction sees, as at a folded or doubled sheet";
        break;
      }
      trouble.clear();
      for (const std::uint32_t f : reducer.faults()) {
        trouble.insert(trouble.end(), source.faces[f].begin(), source.faces[f].end());
        bad[source.face_of[f]] = 1;
        if (cut == 0) result.bad_faces.push_back(source.face_of[f]);
      }
      result.place = source.points[trouble.front()];
      result.obstacle = std::to_string(reducer.faults().size()) + " triangles of the source meet others";
      if (reducer.faults().size() > 200 + s.faces.size() / 200) break;
    }
    if (replaced > kMostReplaced * area || cut == kCuts) break;
    const auto loss = cut_and_close(s, std::move(bad), heat);
    if (!loss) break;
    replaced += loss->area;
    result.replaced_faces += loss->faces;
    start.insert(start.end(), s.points.begin() + static_cast<std::ptrdiff_t>(start.size()), s.points.end());
  }
  return result;
}

}  // namespace relief::detail
