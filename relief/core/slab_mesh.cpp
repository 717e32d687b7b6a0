#include <relief/base/assert.h>
#include <relief/base/free_memory.h>
#include <relief/base/hash.h>
#include <relief/base/try.h>
#include <relief/core/slab_mesh.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>

namespace relief {

namespace {

std::string slab_name(std::size_t s) { return "slab " + std::to_string(s); }

/// A side of a slab, sorted so that the two sides of one edge come together.
struct Side {
  FibreId low, high;
  SlabId slab;
  std::uint8_t edge;
  bool forward;  ///< runs from the lower to the higher fibre number
};

Status check_count(std::size_t s, int intervals) {
  if (intervals >= 1 && intervals <= kMaxIntervals) return {};
  return fail(Errc::Corrupt, slab_name(s) + " has " + std::to_string(intervals) + " intervals, not 1 to 128");
}

std::uint64_t next_number() noexcept {
  static std::atomic<std::uint64_t> last{0};
  return last.fetch_add(1, std::memory_order_relaxed) + 1;
}

}  // namespace

/// Finds who lies beside whom.
class SlabMesh::Assembly {
 public:
  Assembly(SlabMesh& mesh, Shape& shape) : mesh_(mesh), shape_(shape) {}

  Status run(const std::map<std::array<FibreId, 2>, FibreId>& middles) {
    for (Slab& slab : mesh_.slabs_) {
      slab.neighbours.fill(kNoSlab);
      slab.shares.fill(EdgeShare::Whole);
      slab.mirrors.fill(0);
    }
    find_sides();
    RELIEF_CHECK(join_wholes());
    RELIEF_CHECK(join_halves(middles));
    find_boxes();
    find_fans();
    shape_.find_part_boxes();
    shape_.build_tree(shape_.parts.empty() ? std::span<const Box3d>(shape_.boxes)
                                           : std::span(shape_.part_boxes).first(mesh_.roots_->size()));
    return {};
  }

 private:
  void find_sides() {
    sides_.reserve(mesh_.slabs_.size() * 3);
    for (SlabId s = 0; s < mesh_.slab_count(); ++s) {
      const auto& fibres = mesh_.slabs_[s].fibres;
      for (std::uint8_t k = 0; k < 3; ++k) {
        const FibreId from = fibres[(k + 1U) % 3], to = fibres[(k + 2U) % 3];
        sides_.push_back({std::min(from, to), std::max(from, to), s, k, from < to});
      }
    }
    std::ranges::sort(sides_, {}, [](const Side& x) { return std::tuple(x.low, x.high, x.slab); });
  }

  Status join_wholes() {
    for (std::size_t k = 0; k < sides_.size();) {
      std::size_t end = k + 1;
      while (end < sides_.size() && sides_[end].low == sides_[k].low && sides_[end].high == sides_[k].high) ++end;
      if (end - k > 2) return fail(Errc::Corrupt, "more than two slabs share an edge of " + slab_name(sides_[k].slab));
      if (end - k == 2) {
        const Side &x = sides_[k], &y = sides_[k + 1];
        if (x.forward == y.forward)
          return fail(Errc::Corrupt, slab_name(x.slab) + " and " + slab_name(y.slab) + " face opposite ways");
        join(x, y, EdgeShare::Whole);
        join(y, x, EdgeShare::Whole);
      }
      k = end;
    }
    return {};
  }

  /// Gives edges that lie alone, though they were cut on their other side, the slabs along their halves.
  Status join_halves(const std::map<std::array<FibreId, 2>, FibreId>& middles) {
    if (middles.empty()) return {};
    shape_.hanging_of.assign(shape_.fibres.size() - mesh_.root_fibre_count_, kNoSlab);
    for (const Side& side : sides_) {
      Slab& slab = mesh_.slabs_[side.slab];
      if (slab.neighbours[side.edge] != kNoSlab) continue;
      const auto middle = middles.find({side.low, side.high});
      if (middle == middles.end()) continue;  // open, or half of an edge itself
      const FibreId first = side.forward ? side.low : side.high, last = side.forward ? side.high : side.low;
      HangingEdge hangs{.slab = side.slab, .edge = side.edge, .middle = middle->second};
      for (std::size_t half = 0; half < 2; ++half) {
        const Side* const fine = side_between(middle->second, half == 0 ? first : last);
        if (fine == nullptr)
          return fail(Errc::Corrupt, slab_name(side.slab) + " lies beside slabs that are cut more than once more");
        hangs.across[half] = fine->slab;
        hangs.edges[half] = fine->edge;
        join(*fine, side, half == 0 ? EdgeShare::MiddleAtStart : EdgeShare::MiddleAtEnd);
      }
      slab.neighbours[side.edge] = hangs.across[0];
      slab.mirrors[side.edge] = hangs.edges[0];
      slab.shares[side.edge] = EdgeShare::Halves;
      shape_.hanging.push_back(hangs);
    }
    std::ranges::sort(shape_.hanging, {}, [](const HangingEdge& e) { return std::pair(e.slab, e.edge); });
    for (std::size_t k = 0; k < shape_.hanging.size(); ++k)
      shape_.hanging_of[shape_.hanging[k].middle - mesh_.root_fibre_count_] = static_cast<std::uint32_t>(k);
    return {};
  }

  /// Returns the only side between two fibres, if it has no neighbour.
  [[nodiscard]] const Side* side_between(FibreId a, FibreId b) const {
    const std::pair key(std::min(a, b), std::max(a, b));
    const auto at = std::ranges::lower_bound(sides_, key, {}, [](const Side& x) { return std::pair(x.low, x.high); });
    const bool found = at != sides_.end() && at->low == key.first && at->high == key.second;
    return found && mesh_.slabs_[at->slab].neighbours[at->edge] == kNoSlab ? &*at : nullptr;
  }

  void join(const Side& side, const Side& across, EdgeShare share) {
    Slab& slab = mesh_.slabs_[side.slab];
    slab.neighbours[side.edge] = across.slab;
    slab.mirrors[side.edge] = across.edge;
    slab.shares[side.edge] = share;
  }

  void find_boxes() {
    shape_.boxes.assign(mesh_.slabs_.size(), {});
    mesh_.bounds_ = {};
    for (SlabId s = 0; s < mesh_.slab_count(); ++s) {
      Box3d& box = shape_.boxes[s];
      for (const FibreId f : mesh_.slabs_[s].fibres) {
        box.add(shape_.fibres[f].inner);
        box.add(shape_.fibres[f].outer);
      }
      // The corners of a child were rounded, and its samples are counted from those of its root.
      if (!shape_.places.empty() && shape_.places[s].level > 0) {
        const auto widest = [](double a, double b) { return 1e-15 * std::max(std::abs(a), std::abs(b)); };
        const Vec3d slack = {widest(box.low.x, box.high.x), widest(box.low.y, box.high.y),
                             widest(box.low.z, box.high.z)};
        box.low = box.low - slack;
        box.high = box.high + slack;
      }
      mesh_.bounds_.add(box);
    }
  }

  /// Which slab corners meet at a fibre.
  void find_fans() {
    shape_.fan_begin.assign(shape_.fibres.size() + 1, 0);
    for (const Slab& slab : mesh_.slabs_)
      for (const FibreId f : slab.fibres) ++shape_.fan_begin[f + 1];
    std::partial_sum(shape_.fan_begin.begin(), shape_.fan_begin.end(), shape_.fan_begin.begin());
    shape_.fans.resize(mesh_.slabs_.size() * 3);
    std::vector<std::uint32_t> fill(shape_.fan_begin.begin(), shape_.fan_begin.end() - 1);
    for (SlabId s = 0; s < mesh_.slab_count(); ++s)
      for (std::uint32_t k = 0; k < 3; ++k) shape_.fans[fill[mesh_.slabs_[s].fibres[k]]++] = {s, k};
  }

  SlabMesh& mesh_;
  Shape& shape_;
  std::vector<Side> sides_;
};

Result<SlabMesh> SlabMesh::make(std::vector<Fibre> fibres, std::span<const Face> faces) {
  if (faces.empty()) return fail(Errc::Corrupt, "the cage has no slabs");
  if (faces.size() >= kNoSlab / 4) return fail(Errc::Corrupt, "the cage has more than 2^30 slabs");
  for (std::size_t f = 0; f < fibres.size(); ++f)
    if (!is_finite(fibres[f].inner) || !is_finite(fibres[f].outer) || fibres[f].inner == fibres[f].outer)
      return fail(Errc::Corrupt, "fibre " + std::to_string(f) + " has no length or is not finite");

  SlabMesh mesh;
  mesh.number_ = mesh.roots_number_ = next_number();
  mesh.root_fibre_count_ = fibres.size();
  mesh.slabs_.resize(faces.size());
  const auto shape = std::make_shared<Shape>();
  shape->fibres = std::move(fibres);
  for (std::size_t s = 0; s < faces.size(); ++s) {
    const Face& face = faces[s];
    const auto [a, b, c] = face.fibres;
    if (std::max({a, b, c}) >= shape->fibres.size())
      return fail(Errc::Corrupt, slab_name(s) + " names a fibre that does not exist");
    if (a == b || b == c || c == a) return fail(Errc::Corrupt, slab_name(s) + " names a fibre twice");
    RELIEF_CHECK(check_count(s, face.intervals));
    mesh.slabs_[s] = {.fibres = face.fibres, .neighbours = {}, .intervals = face.intervals};
  }
  RELIEF_CHECK(Assembly(mesh, *shape).run({}));
  mesh.take(shape);
  RELIEF_CHECK(mesh.check_intervals());
  for (FibreId f = 0; f < mesh.fibres_.size(); ++f) {
    const auto fan = mesh.fan(f);
    if (fan.empty()) return fail(Errc::Corrupt, "no slab uses fibre " + std::to_string(f));
    // Walk across the edges at f, first one way to the end, then the other way from the start.
    std::size_t met = 1;
    bool closed = false;
    for (const std::uint32_t turn : {1U, 2U}) {
      SlabCorner at = fan.front();
      while (!closed && met <= fan.size()) {
        const SlabId next = mesh.slabs_[at.slab].neighbours[(at.corner + turn) % 3];
        if (next == kNoSlab) break;
        const auto& corners = mesh.slabs_[next].fibres;
        at = {next, corners[0] == f ? 0U : corners[1] == f ? 1U : 2U};
        closed = next == fan.front().slab;
        if (!closed) ++met;
      }
    }
    if (met != fan.size())
      return fail(Errc::Corrupt, "the slabs around fibre " + std::to_string(f) + " do not form one fan");
  }
  return mesh;
}

Result<SlabMesh> SlabMesh::cut(std::span<const SlabId> slabs) const {
  if (slabs.empty()) return SlabMesh(*this);
  SlabMesh mesh;
  mesh.number_ = next_number();
  mesh.roots_number_ = roots_number_;
  mesh.root_fibre_count_ = root_fibre_count_;
  mesh.roots_ = roots_ ? roots_ : std::make_shared<const std::vector<Slab>>(slabs_);
  mesh.slabs_ = slabs_;
  const auto shape = std::make_shared<Shape>();
  shape->fibres = shape_->fibres;
  shape->cuts = shape_->cuts;
  shape->places = shape_->places;
  shape->parts = shape_->parts;
  if (!is_cut()) {
    for (SlabId s = 0; s < slab_count(); ++s) {
      shape->places.push_back({.root = s});
      shape->parts.push_back({.slab = s});
    }
  }
  std::vector<std::uint32_t> node_of(slabs_.size());
  for (std::uint32_t k = 0; k < shape->parts.size(); ++k)
    if (shape->parts[k].children == 0) node_of[shape->parts[k].slab] = k;

  std::map<std::array<FibreId, 2>, FibreId> middles = shape_->middles;
  const auto middle_of = [&](FibreId a, FibreId b) {
    const auto [at, is_new] = middles.try_emplace({std::min(a, b), std::max(a, b)}, 0U);
    if (is_new) {
      at->second = static_cast<FibreId>(shape->fibres.size());
      const Fibre p = shape->fibres[a], q = shape->fibres[b];
      shape->fibres.push_back({(p.inner + q.inner) * 0.5, (p.outer + q.outer) * 0.5});
    }
    return at->second;
  };
  for (const SlabId s : slabs) {
    if (s >= mesh.slabs_.size()) return fail(Errc::Corrupt, slab_name(s) + ", which is to be cut, does not exist");
    if (mesh.slabs_.size() + 3 >= kNoSlab / 4) return fail(Errc::Corrupt, "the cage has more than 2^30 slabs");
    const RootPlace from = shape->places[s];
    if (from.level >= kMaxLevel) return fail(Errc::Corrupt, slab_name(s) + " cannot be cut any further");
    Slab slab = mesh.slabs_[s];
    if (slab.intervals % 2 == 0) slab.intervals /= 2;
    const auto [a, b, c] = slab.fibres;
    const FibreId bc = middle_of(b, c), ca = middle_of(c, a), ab = middle_of(a, b);
    const auto [at_a, at_b, at_c, centre] = cut_in_four(from);
    const auto first = static_cast<std::uint32_t>(shape->parts.size());
    shape->parts[node_of[s]].children = first;
    const auto add = [&](SlabId number, const std::array<FibreId, 3>& fibres, const RootPlace& place) {
      if (number == mesh.slabs_.size()) {
        mesh.slabs_.emplace_back();
        shape->places.emplace_back();
        node_of.emplace_back();
      }
      mesh.slabs_[number] = {.fibres = fibres, .neighbours = {}, .intervals = slab.intervals};
      shape->places[number] = place;
      node_of[number] = static_cast<std::uint32_t>(shape->parts.size());
      shape->parts.push_back({.slab = number});
    };
    const auto next = static_cast<SlabId>(mesh.slabs_.size());
    add(next, {a, ab, ca}, at_a);
    add(next + 1, {ab, b, bc}, at_b);
    add(next + 2, {ca, bc, c}, at_c);
    add(s, {bc, ca, ab}, centre);
    shape->cuts.push_back(s);
  }
  RELIEF_CHECK(Assembly(mesh, *shape).run(middles));
  shape->middles = std::move(middles);
  mesh.take(shape);
  return mesh;
}

Result<SlabMesh> SlabMesh::with_root_fibres(std::vector<Fibre> fibres) const {
  RELIEF_ASSERT(fibres.size() == root_fibre_count_);
  std::vector<Face> faces;
  for (const Slab& root : roots()) faces.push_back({root.fibres, root.intervals});
  RELIEF_TRY(const SlabMesh made, make(std::move(fibres), faces));
  RELIEF_TRY(const SlabMesh same_cuts, made.cut(cuts()));
  std::vector<int> intervals;
  for (const Slab& slab : slabs_) intervals.push_back(slab.intervals);
  return same_cuts.refined(intervals);
}

Result<SlabMesh> SlabMesh::refined(std::span<const int> intervals) const {
  RELIEF_ASSERT(intervals.size() == slabs_.size());
  SlabMesh mesh = *this;
  mesh.number_ = next_number();
  if (!roots_) mesh.roots_ = std::make_shared<const std::vector<Slab>>(slabs_);
  for (SlabId s = 0; s < slab_count(); ++s) {
    RELIEF_CHECK(check_count(s, intervals[s]));
    mesh.slabs_[s].intervals = intervals[s];
  }
  RELIEF_CHECK(mesh.check_intervals());
  return mesh;
}

Result<SlabMesh> SlabMesh::with_intervals(std::span<const int> intervals) && {
  RELIEF_ASSERT(intervals.size() == slabs_.size() && !is_cut());
  number_ = next_number();
  roots_ = nullptr;
  for (SlabId s = 0; s < slab_count(); ++s) {
    RELIEF_CHECK(check_count(s, intervals[s]));
    slabs_[s].intervals = intervals[s];
  }
  RELIEF_CHECK(check_intervals());
  return std::move(*this);
}

Status SlabMesh::check_intervals() const {
  for (SlabId s = 0; s < slab_count(); ++s) RELIEF_CHECK(check_fit(s, [this](SlabId slab) { return intervals(slab); }));
  return {};
}

Status SlabMesh::check_fit(SlabId s, std::size_t edge, int own, int across) const {
  const auto [fewer, more] = std::minmax(own, across);
  const bool by_halves = more % fewer == 0 && std::has_single_bit(static_cast<unsigned>(more / fewer));
  if (slabs_[s].shares[edge] == EdgeShare::Whole ? by_halves : by_halves && across % 2 == 0 && across <= 2 * own)
    return {};
  const SlabId other = slabs_[s].neighbours[edge];
  const std::string both = slab_name(std::min(s, other)) + " and " + slab_name(std::max(s, other)) +
                           " share an edge with " + std::to_string(s < other ? own : across) + " and " +
                           std::to_string(s < other ? across : own) + " intervals, which ";
  return fail(Errc::Corrupt,
              both + (slabs_[s].shares[edge] == EdgeShare::Whole ? "do not differ by a power of two"
                                                                 : "do not fit where one is cut and the other is not"));
}

void SlabMesh::take(std::shared_ptr<const Shape> shape) {
  fibres_ = shape->fibres;
  boxes_ = shape->boxes;
  fan_begin_ = shape->fan_begin;
  fans_ = shape->fans;
  tree_ = shape->tree;
  tree_roots_ = shape->tree_roots;
  cuts_ = shape->cuts;
  places_ = shape->places;
  parts_ = shape->parts;
  part_boxes_ = shape->parts.empty() ? shape->boxes : shape->part_boxes;
  hanging_ = shape->hanging;
  hanging_of_ = shape->hanging_of;
  shape_ = std::move(shape);
}

SlabId SlabMesh::descend(SlabId root, std::array<double, 3>& w) const noexcept {
  if (!is_cut()) return root;
  const Part* at = &parts_[root];
  while (at->children != 0) {
    std::size_t child = 3;
    for (std::size_t k = 0; k < 3 && child == 3; ++k)
      if (w[k] >= 0.5) child = k;
    if (child == 3) {
      // Its corners lie in the middles opposite.
      for (double& x : w) x = 1 - 2 * x;
    } else {
      for (std::size_t k = 0; k < 3; ++k) w[k] = k == child ? 2 * w[k] - 1 : 2 * w[k];
    }
    at = &parts_[at->children + child];
  }
  return at->slab;
}

const HangingEdge& SlabMesh::hanging(SlabId s, int edge) const noexcept {
  const std::pair key(s, static_cast<std::uint8_t>(edge));
  const auto at =
      std::ranges::lower_bound(hanging_, key, {}, [](const HangingEdge& e) { return std::pair(e.slab, e.edge); });
  RELIEF_ASSERT(at != hanging_.end() && at->slab == s && at->edge == edge);
  return *at;
}

std::size_t SlabMesh::bytes_beside(const SlabMesh* other) const noexcept {
  const auto of = [](const auto& array) { return array.size() * sizeof(*array.data()); };
  if (other == this || (other != nullptr && other->number_ == number_)) return 0;
  std::size_t sum = of(slabs_);
  if (roots_ && (other == nullptr || other->roots_ != roots_)) sum += of(*roots_);
  if (other != nullptr && other->shape_ == shape_) return sum;
  static constexpr std::size_t kNode = 64;  // of a map, with what it holds
  const Shape& shape = *shape_;
  return sum + of(shape.fibres) + of(shape.boxes) + of(shape.fan_begin) + of(shape.fans) + of(shape.tree) +
         of(shape.tree_roots) + of(shape.cuts) + of(shape.places) + of(shape.parts) + of(shape.part_boxes) +
         of(shape.hanging) + of(shape.hanging_of) + kNode * shape.middles.size();
}

std::uint64_t SlabMesh::content_hash() const noexcept {
  Hash64 hash;
  hash.add(fibres_.size());
  hash.add_values(fibres_);
  hash.add(slabs_.size());
  for (const Slab& slab : slabs_) {
    for (const FibreId f : slab.fibres) hash.add(f);
    hash.add(static_cast<std::uint64_t>(slab.intervals));
  }
  return hash.value();
}

void SlabMesh::Shape::find_part_boxes() {
  part_boxes.resize(parts.size());
  for (std::size_t k = parts.size(); k-- > 0;) {
    part_boxes[k] = parts[k].children == 0 ? boxes[parts[k].slab] : Box3d{};
    for (std::uint32_t c = 0; parts[k].children != 0 && c < 4; ++c)
      part_boxes[k].add(part_boxes[parts[k].children + c]);
  }
}

void SlabMesh::Shape::build_tree(std::span<const Box3d> roots) {
  static constexpr std::uint32_t kLeaf = 4;
  tree_roots.resize(roots.size());
  std::iota(tree_roots.begin(), tree_roots.end(), 0U);
  tree.reserve(roots.size());  // leaves hold two roots or more, where there are so many

  // Median splits along the longest side of the centres' box; depth is at most log2 of the count.
  struct Range {
    std::uint32_t begin, end;
    std::uint32_t parent;  ///< whose right child this is; kNoSlab for the root and left children
  };
  std::vector<Range> stack = {{0, static_cast<std::uint32_t>(roots.size()), kNoSlab}};
  while (!stack.empty()) {
    const Range range = stack.back();
    stack.pop_back();
    const auto number = static_cast<std::uint32_t>(tree.size());
    if (range.parent != kNoSlab) tree[range.parent].first = number;
    Node& node = tree.emplace_back();
    Box3d centres;
    for (std::uint32_t k = range.begin; k < range.end; ++k) {
      node.box.add(roots[tree_roots[k]]);
      centres.add(roots[tree_roots[k]].centre());
    }
    if (range.end - range.begin <= kLeaf) {
      node.first = range.begin;
      node.count = range.end - range.begin;
      continue;
    }
    const Vec3d size = centres.extent();
    const std::size_t axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::uint32_t middle = range.begin + (range.end - range.begin) / 2;
    const auto key = [&](SlabId s) { return std::pair(roots[s].centre()[axis], s); };
    std::nth_element(tree_roots.begin() + range.begin, tree_roots.begin() + middle, tree_roots.begin() + range.end,
                     [&](SlabId a, SlabId b) { return key(a) < key(b); });
    stack.push_back({middle, range.end, number});
    stack.push_back({range.begin, middle, kNoSlab});
  }
}

namespace {

/// Returns the square of the distance between two segments.
double distance2(const Fibre& a, const Fibre& b) noexcept {
  const Vec3d d = a.direction(), e = b.direction(), w = a.inner - b.inner;
  const double dd = dot(d, d), ee = dot(e, e), de = dot(d, e), dw = dot(d, w), ew = dot(e, w);
  const auto within = [](double share) { return std::clamp(share, 0.0, 1.0); };
  const double det = dd * ee - de * de;
  const double along = within(det > 0 ? (de * ew - ee * dw) / det : 0);
  // Once more from the place on b: ends are nearer to ends than lines to lines.
  const double on_b = within(ee > 0 ? (along * de + ew) / ee : 0);
  const double on_a = within(dd > 0 ? (on_b * de - dw) / dd : 0);
  const Vec3d off = w + d * on_a - e * on_b;
  return dot(off, off);
}

}  // namespace

bool has_slabs_of(const RootCage& now, const RootCage& earlier) noexcept {
  constexpr double kRounding = 1e-6;  // of a fibre: its ends are moved to a lattice
  if (now.roots.size() < earlier.roots.size() || now.fibres.size() < earlier.fibres.size() ||
      now.cuts.size() < earlier.cuts.size())
    return false;
  const std::size_t added = now.roots.size() - earlier.roots.size();
  for (std::size_t root = 0; root < now.roots.size(); ++root) {
    const bool stands = root < earlier.roots.size() && now.roots[root].fibres == earlier.roots[root].fibres;
    if (!stands && std::ranges::max(now.roots[root].fibres) < earlier.fibres.size()) return false;
  }
  for (std::size_t k = 0; k < earlier.cuts.size(); ++k)
    if (now.cuts[k] != earlier.cuts[k] + (earlier.cuts[k] < earlier.roots.size() ? 0 : added)) return false;
  const std::size_t count = earlier.fibres.size();
  for (std::size_t f = 0; f < count; ++f) {
    const Vec3d long_one = earlier.fibres[f].direction();
    if (distance2(now.fibres[f], earlier.fibres[f]) <= kRounding * kRounding * dot(long_one, long_one)) return true;
  }
  return count == 0;
}

bool has_slabs_of(const SlabMesh& now, const SlabMesh& earlier) {
  const auto faces_of = [](const SlabMesh& mesh) {
    std::vector<SlabMesh::Face> faces;
    for (const Slab& root : mesh.roots()) faces.push_back({root.fibres, root.intervals});
    return faces;
  };
  const std::vector<SlabMesh::Face> a = faces_of(now), b = faces_of(earlier);
  return has_slabs_of({now.root_fibres(), a, now.cuts()}, {earlier.root_fibres(), b, earlier.cuts()});
}

}  // namespace relief
