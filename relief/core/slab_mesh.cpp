#include <relief/base/assert.h>
#include <relief/base/free_memory.h>
#include <relief/base/hash.h>
#include <relief/base/try.h>
#include <relief/core/slab_mesh.h>

#include <algorithm>
#include <atomic>
#include <bit>
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

Result<SlabMesh> SlabMesh::make(std::vector<Fibre> fibres, std::span<const Face> faces) {
  if (faces.empty()) return fail(Errc::Corrupt, "the cage has no slabs");
  if (faces.size() >= kNoSlab / 4) return fail(Errc::Corrupt, "the cage has more than 2^30 slabs");
  for (std::size_t f = 0; f < fibres.size(); ++f)
    if (!is_finite(fibres[f].inner) || !is_finite(fibres[f].outer) || fibres[f].inner == fibres[f].outer)
      return fail(Errc::Corrupt, "fibre " + std::to_string(f) + " has no length or is not finite");

  SlabMesh mesh;
  mesh.number_ = next_number();
  mesh.slabs_.resize(faces.size());
  const auto shape = std::make_shared<Shape>();
  shape->fibres = std::move(fibres);
  shape->boxes.resize(faces.size());
  std::vector<Side> sides;
  sides.reserve(faces.size() * 3);
  for (std::size_t s = 0; s < faces.size(); ++s) {
    const Face& face = faces[s];
    const auto [a, b, c] = face.fibres;
    if (std::max({a, b, c}) >= shape->fibres.size())
      return fail(Errc::Corrupt, slab_name(s) + " names a fibre that does not exist");
    if (a == b || b == c || c == a) return fail(Errc::Corrupt, slab_name(s) + " names a fibre twice");
    RELIEF_CHECK(check_count(s, face.intervals));
    mesh.slabs_[s] = {face.fibres, {kNoSlab, kNoSlab, kNoSlab}, face.intervals};
    for (std::uint8_t k = 0; k < 3; ++k) {
      const FibreId from = face.fibres[(k + 1U) % 3], to = face.fibres[(k + 2U) % 3];
      sides.push_back({std::min(from, to), std::max(from, to), static_cast<SlabId>(s), k, from < to});
      shape->boxes[s].add(shape->fibres[face.fibres[k]].inner);
      shape->boxes[s].add(shape->fibres[face.fibres[k]].outer);
    }
    mesh.bounds_.add(shape->boxes[s]);
  }

  std::ranges::sort(sides, {}, [](const Side& x) { return std::tuple(x.low, x.high, x.slab); });
  for (std::size_t k = 0; k < sides.size();) {
    std::size_t end = k + 1;
    while (end < sides.size() && sides[end].low == sides[k].low && sides[end].high == sides[k].high) ++end;
    if (end - k > 2) return fail(Errc::Corrupt, "more than two slabs share an edge of " + slab_name(sides[k].slab));
    if (end - k == 2) {
      const Side &x = sides[k], &y = sides[k + 1];
      if (x.forward == y.forward)
        return fail(Errc::Corrupt, slab_name(x.slab) + " and " + slab_name(y.slab) + " face opposite ways");
      RELIEF_CHECK(mesh.check_intervals(x.slab, y.slab));
      mesh.slabs_[x.slab].neighbours[x.edge] = y.slab;
      mesh.slabs_[y.slab].neighbours[y.edge] = x.slab;
    }
    k = end;
  }
  free_memory(sides);

  // Fans: which slab corners meet at a fibre, and that they form one fan.
  shape->fan_begin.assign(shape->fibres.size() + 1, 0);
  for (const Slab& slab : mesh.slabs_)
    for (const FibreId f : slab.fibres) ++shape->fan_begin[f + 1];
  std::partial_sum(shape->fan_begin.begin(), shape->fan_begin.end(), shape->fan_begin.begin());
  shape->fans.resize(faces.size() * 3);
  std::vector<std::uint32_t> fill(shape->fan_begin.begin(), shape->fan_begin.end() - 1);
  for (SlabId s = 0; s < mesh.slab_count(); ++s)
    for (std::uint32_t k = 0; k < 3; ++k) shape->fans[fill[mesh.slabs_[s].fibres[k]]++] = {s, k};
  free_memory(fill);
  shape->build_tree();
  mesh.take(shape);
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

Result<SlabMesh> SlabMesh::with_intervals(std::span<const int> intervals) && {
  RELIEF_ASSERT(intervals.size() == slabs_.size());
  number_ = next_number();
  for (SlabId s = 0; s < slab_count(); ++s) {
    RELIEF_CHECK(check_count(s, intervals[s]));
    slabs_[s].intervals = intervals[s];
  }
  for (SlabId s = 0; s < slab_count(); ++s)
    for (const SlabId other : slabs_[s].neighbours)
      if (other != kNoSlab && s < other) RELIEF_CHECK(check_intervals(s, other));
  return std::move(*this);
}

Status SlabMesh::check_intervals(SlabId a, SlabId b) const {
  const auto [fewer, more] = std::minmax({intervals(a), intervals(b)});
  if (more % fewer == 0 && std::has_single_bit(static_cast<unsigned>(more / fewer))) return {};
  return fail(Errc::Corrupt, slab_name(a) + " and " + slab_name(b) + " share an edge with " +
                                 std::to_string(intervals(a)) + " and " + std::to_string(intervals(b)) +
                                 " intervals, which do not differ by a power of two");
}

void SlabMesh::take(std::shared_ptr<const Shape> shape) {
  fibres_ = shape->fibres;
  boxes_ = shape->boxes;
  fan_begin_ = shape->fan_begin;
  fans_ = shape->fans;
  tree_ = shape->tree;
  tree_slabs_ = shape->tree_slabs;
  shape_ = std::move(shape);
}

int SlabMesh::mirror_edge(SlabId s, int edge) const noexcept {
  const auto k = static_cast<std::size_t>(edge);
  const FibreId from = slabs_[s].fibres[(k + 1) % 3];
  const auto& other = slabs_[slabs_[s].neighbours[k]].fibres;
  // In the neighbour the edge ends at `from`, so it is the one opposite the corner after `from`.
  for (int m = 0; m < 3; ++m)
    if (other[static_cast<std::size_t>(m)] == from) return (m + 1) % 3;
  return 0;
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

void SlabMesh::Shape::build_tree() {
  static constexpr std::uint32_t kLeaf = 4;
  tree_slabs.resize(boxes.size());
  std::iota(tree_slabs.begin(), tree_slabs.end(), 0U);
  tree.reserve(boxes.size());  // leaves hold two slabs or more, where there are so many

  // Median splits along the longest side of the centres' box; depth is at most log2 of the count.
  struct Range {
    std::uint32_t begin, end;
    std::uint32_t parent;  ///< whose right child this is; kNoSlab for the root and left children
  };
  std::vector<Range> stack = {{0, static_cast<std::uint32_t>(boxes.size()), kNoSlab}};
  while (!stack.empty()) {
    const Range range = stack.back();
    stack.pop_back();
    const auto number = static_cast<std::uint32_t>(tree.size());
    if (range.parent != kNoSlab) tree[range.parent].first = number;
    Node& node = tree.emplace_back();
    Box3d centres;
    for (std::uint32_t k = range.begin; k < range.end; ++k) {
      node.box.add(boxes[tree_slabs[k]]);
      centres.add(boxes[tree_slabs[k]].centre());
    }
    if (range.end - range.begin <= kLeaf) {
      node.first = range.begin;
      node.count = range.end - range.begin;
      continue;
    }
    const Vec3d size = centres.extent();
    const std::size_t axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const std::uint32_t middle = range.begin + (range.end - range.begin) / 2;
    const auto key = [&](SlabId s) { return std::pair(boxes[s].centre()[axis], s); };
    std::nth_element(tree_slabs.begin() + range.begin, tree_slabs.begin() + middle, tree_slabs.begin() + range.end,
                     [&](SlabId a, SlabId b) { return key(a) < key(b); });
    stack.push_back({middle, range.end, number});
    stack.push_back({range.begin, middle, kNoSlab});
  }
}

}  // namespace relief
