// The frozen cage: fibres and the slabs between them. Everything that stays when the surface is sculpted.
#pragma once

#include <relief/base/error.h>
#include <relief/base/vec.h>
#include <relief/core/grid.h>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace relief {

using FibreId = std::uint32_t;
using SlabId = std::uint32_t;
inline constexpr SlabId kNoSlab = 0xffffffffU;

/// The segment from an inner to an outer corner, shared by the slabs around it; model units.
struct Fibre {
  Vec3d inner, outer;
  [[nodiscard]] constexpr Vec3d direction() const noexcept { return outer - inner; }
};

/// Three fibres counter-clockwise seen from outside; neighbours[k] is the slab across the edge opposite corner k,
/// kNoSlab at an open edge; n intervals per edge of the displacement tile.
struct Slab {
  std::array<FibreId, 3> fibres;
  std::array<SlabId, 3> neighbours;
  int intervals = 32;
};

/// One stored copy of a sample: a grid point of a slab.
struct SampleCopy {
  SlabId slab = kNoSlab;
  GridPoint at;
};

/// A corner of a slab, of which there are fewer than 2^30.
struct SlabCorner {
  SlabId slab : 30 = 0;
  std::uint32_t corner : 2 = 0;  ///< 0..2

  SlabCorner() = default;
  constexpr SlabCorner(SlabId s, std::uint32_t k) noexcept : slab(s & 0x3fffffffU), corner(k & 3U) {}
};

/// The six corners of a slab, with what the order-independent evaluation of positions needs (see weighted()).
struct SlabCorners {
  std::array<Vec3d, 3> inner, outer;
  std::array<std::uint8_t, 3> order;  ///< corner numbers by ascending fibre id

  /// Sum of w[k] * ends[k] in order of fibre id: a point on a shared wall gets the same bits from both of its slabs.
  [[nodiscard]] Vec3d weighted(const std::array<Vec3d, 3>& ends, const std::array<double, 3>& w) const noexcept {
    return (ends[order[0]] * w[order[0]] + ends[order[1]] * w[order[1]]) + ends[order[2]] * w[order[2]];
  }
  /// From the inner to the outer end of corner k's.
  [[nodiscard]] Vec3d fibre(std::size_t k) const noexcept { return outer[k] - inner[k]; }
  /// Point on the interpolated fibre: weighted inner + alpha * (weighted outer - weighted inner) (paper, eq. 3).
  [[nodiscard]] Vec3d point(const std::array<double, 3>& w, double alpha) const noexcept {
    const Vec3d in = weighted(inner, w);
    return in + (weighted(outer, w) - in) * alpha;
  }
};

/// Immutable after make(); safe to read from any thread.
class SlabMesh {
 public:
  /// What make() needs of a slab; neighbours are found by it.
  struct Face {
    std::array<FibreId, 3> fibres;
    int intervals = 32;
  };

  /// Checks counting only (C0): fibre numbers in range and finite, no repeated corner, each edge in at most two slabs
  /// that run through it in opposite directions, one fan per fibre, n in 1..128 and across each edge the same but for a
  /// power of two.
  /// Whether slabs overlap is the verifier's matter. Unused fibres are refused. Error: Corrupt, naming the slab or
  /// fibre.
  [[nodiscard]] static Result<SlabMesh> make(std::vector<Fibre> fibres, std::span<const Face> faces);
  /// The same cage with other intervals, by slab; it shares all but these. Of one that is given away, nothing may be
  /// used afterwards, also where this fails. Error: Corrupt, as from make().
  [[nodiscard]] Result<SlabMesh> with_intervals(std::span<const int> intervals) const& {
    return SlabMesh(*this).with_intervals(intervals);
  }
  [[nodiscard]] Result<SlabMesh> with_intervals(std::span<const int> intervals) &&;

  [[nodiscard]] std::span<const Fibre> fibres() const noexcept { return fibres_; }
  [[nodiscard]] std::span<const Slab> slabs() const noexcept { return slabs_; }
  [[nodiscard]] SlabId slab_count() const noexcept { return static_cast<SlabId>(slabs_.size()); }
  [[nodiscard]] int intervals(SlabId s) const noexcept { return slabs_[s].intervals; }
  [[nodiscard]] SlabCorners corners(SlabId s) const noexcept {
    const auto& [a, b, c] = slabs_[s].fibres;
    // How many of the others come before each.
    const auto at_a = static_cast<std::size_t>((b < a) + (c < a)), at_b = static_cast<std::size_t>((a < b) + (c < b));
    SlabCorners corners = {.inner = {fibres_[a].inner, fibres_[b].inner, fibres_[c].inner},
                           .outer = {fibres_[a].outer, fibres_[b].outer, fibres_[c].outer},
                           .order = {2, 2, 2}};
    corners.order[at_a] = 0;
    corners.order[at_b] = 1;
    return corners;
  }
  /// The box of the six corners, which bounds the slab and every displaced surface in it.
  [[nodiscard]] const Box3d& box(SlabId s) const noexcept { return boxes_[s]; }
  /// The box of all slabs.
  [[nodiscard]] const Box3d& bounds() const noexcept { return bounds_; }
  /// The slab corners that meet at a fibre, by ascending slab number.
  [[nodiscard]] std::span<const SlabCorner> fan(FibreId f) const noexcept {
    return fans_.subspan(fan_begin_[f], fan_begin_[f + 1] - fan_begin_[f]);
  }
  /// Which edge of neighbours[edge] is shared with edge `edge` of s; its grid runs the other way (t' = n - t).
  [[nodiscard]] int mirror_edge(SlabId s, int edge) const noexcept;
  /// Intervals that both sides of an edge have: the smaller of the two n. A slab with more of them has constrained
  /// samples between the shared ones (see EdgePlace).
  [[nodiscard]] int edge_intervals(SlabId s, int edge) const noexcept {
    const SlabId other = slabs_[s].neighbours[static_cast<std::size_t>(edge)];
    return other == kNoSlab ? intervals(s) : std::min(intervals(s), intervals(other));
  }
  [[nodiscard]] std::array<int, 3> edge_intervals(SlabId s) const noexcept {
    return {edge_intervals(s, 0), edge_intervals(s, 1), edge_intervals(s, 2)};
  }
  /// On the slab's own grid.
  [[nodiscard]] EdgePlace edge_place(SlabId s, GridPoint p) const noexcept {
    const int n = intervals(s);
    if (p.i > 0 && p.j > 0 && p.i + p.j < n) return {p, p, 0, 1};
    return relief::edge_place(n, edge_intervals(s), p);
  }
  /// Calls visit(GridPoint, EdgePlace) for the constrained samples of the slab's own grid.
  template <typename Visit>
  void for_each_constrained(SlabId s, Visit&& visit) const {
    const int n = intervals(s);
    const std::array<int, 3> edges = edge_intervals(s);
    for (int edge = 0; edge < 3; ++edge)
      for (int t = 1; edges[static_cast<std::size_t>(edge)] != n && t < n; ++t) {
        const GridPoint p = edge_point(n, edge, t);
        if (const EdgePlace place = relief::edge_place(n, edges, p); place.constrained()) visit(p, place);
      }
  }

  /// All copies of one sample, this one included, by ascending slab number: one inside a slab, up to two on an edge,
  /// one per slab of the fan at a corner. Calls visit(SampleCopy). Here each slab has its own n; a constrained sample
  /// has no copy.
  template <typename Visit>
  void for_each_copy(SlabId s, GridPoint p, Visit&& visit) const {
    for_each_copy(s, [this](SlabId slab) { return intervals(slab); }, p, visit);
  }
  /// The same on a grid of m intervals in every slab.
  template <typename Visit>
  void for_each_copy(SlabId s, int m, GridPoint p, Visit&& visit) const {
    for_each_copy(s, [m](SlabId) { return m; }, p, visit);
  }
  /// The same where slab k has intervals_of(k), neighbours the same but for a power of two.
  template <std::invocable<SlabId> IntervalsOf, typename Visit>
  void for_each_copy(SlabId s, IntervalsOf&& intervals_of, GridPoint p, Visit&& visit) const {
    const int n = intervals_of(s);
    const std::array<int, 3> w = weights(n, p);
    const int zeros = (w[0] == 0) + (w[1] == 0) + (w[2] == 0);
    if (zeros == 0) {
      visit(SampleCopy{s, p});
    } else if (zeros == 2) {
      const int corner = w[0] != 0 ? 0 : w[1] != 0 ? 1 : 2;
      for (const SlabCorner c : fan(slabs_[s].fibres[static_cast<std::size_t>(corner)]))
        visit(SampleCopy{c.slab, corner_point(intervals_of(c.slab), c.corner)});
    } else {
      const int edge = w[0] == 0 ? 0 : w[1] == 0 ? 1 : 2;
      const SlabId other = slabs_[s].neighbours[static_cast<std::size_t>(edge)];
      const int t = w[static_cast<std::size_t>((edge + 2) % 3)];
      const int twins = other == kNoSlab ? n : intervals_of(other);
      if (other == kNoSlab || t * twins % n != 0) {
        visit(SampleCopy{s, p});
        return;
      }
      const SampleCopy twin{other, edge_point(twins, mirror_edge(s, edge), twins - t * twins / n)};
      if (s < other) {
        visit(SampleCopy{s, p});
        visit(twin);
      } else {
        visit(twin);
        visit(SampleCopy{s, p});
      }
    }
  }

  /// Another one for each cage that this process has made, its copies have the same; never 0.
  [[nodiscard]] std::uint64_t number() const noexcept { return number_; }
  /// Hash of fibres and slabs.
  [[nodiscard]] std::uint64_t content_hash() const noexcept;

  /// One node of the hierarchy over the slabs' boxes; used by the queries.
  struct Node {
    Box3d box;
    std::uint32_t first =
        0;  ///< leaf: first entry of `tree_slabs`; inner node: number of the right child (left is next)
    std::uint32_t count = 0;  ///< leaf: number of slabs; 0 for an inner node
  };
  [[nodiscard]] std::span<const Node> tree() const noexcept { return tree_; }
  /// Calls visit(SlabId) for the slabs whose boxes, and those of all nodes above, accept(box) lets through, depth first
  /// and left before right, until visit returns true; whether it did. For a slab, accept is asked last just before it.
  template <typename Accept, typename Visit>
  bool visit_tree(Accept&& accept, Visit&& visit) const {
    std::array<std::uint32_t, 64> stack{};
    std::size_t depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
      const std::uint32_t number = stack[--depth];
      const Node& node = tree_[number];
      if (!accept(node.box)) continue;
      if (node.count == 0) {
        stack[depth++] = node.first;
        stack[depth++] = number + 1;
        continue;
      }
      for (std::uint32_t k = 0; k < node.count; ++k) {
        const SlabId s = tree_slabs_[node.first + k];
        if (accept(boxes_[s]) && visit(s)) return true;
      }
    }
    return false;
  }
  /// The same for those whose boxes have a distance(box) of at most `reach`, which visit may lower: of two nodes the
  /// nearer first. For a slab, distance is asked last just before it.
  template <typename Distance, typename Visit>
  bool visit_nearest(Distance&& distance, const double& reach, Visit&& visit) const {
    struct Entry {
      std::uint32_t node;
      double distance;
    };
    std::array<Entry, 64> stack;
    std::size_t depth = 0;
    stack[depth++] = {0, distance(tree_[0].box)};
    while (depth > 0) {
      const Entry at = stack[--depth];
      if (!(at.distance <= reach)) continue;
      const Node& node = tree_[at.node];
      if (node.count == 0) {
        Entry near = {at.node + 1, distance(tree_[at.node + 1].box)};
        Entry far = {node.first, distance(tree_[node.first].box)};
        if (far.distance < near.distance) std::swap(near, far);
        if (far.distance <= reach) stack[depth++] = far;
        if (near.distance <= reach) stack[depth++] = near;
        continue;
      }
      for (std::uint32_t k = 0; k < node.count; ++k) {
        const SlabId s = tree_slabs_[node.first + k];
        if (distance(boxes_[s]) <= reach && visit(s)) return true;
      }
    }
    return false;
  }
  [[nodiscard]] std::span<const SlabId> tree_slabs() const noexcept { return tree_slabs_; }

 private:
  /// What does not depend on the intervals.
  struct Shape {
    std::vector<Fibre> fibres;
    std::vector<Box3d> boxes;
    std::vector<std::uint32_t> fan_begin;
    std::vector<SlabCorner> fans;
    std::vector<Node> tree;
    std::vector<SlabId> tree_slabs;

    void build_tree();
  };
  SlabMesh() = default;
  [[nodiscard]] Status check_intervals(SlabId a, SlabId b) const;
  void take(std::shared_ptr<const Shape> shape);

  std::uint64_t number_ = 0;
  std::vector<Slab> slabs_;
  Box3d bounds_;
  std::shared_ptr<const Shape> shape_;
  // Into the shape.
  std::span<const Fibre> fibres_;
  std::span<const Box3d> boxes_;
  std::span<const std::uint32_t> fan_begin_;
  std::span<const SlabCorner> fans_;
  std::span<const Node> tree_;
  std::span<const SlabId> tree_slabs_;
};

}  // namespace relief
