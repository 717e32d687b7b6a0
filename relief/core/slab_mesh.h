// The cage: fibres and the slabs between them. Sculpting leaves it as it is; detail and room make another one of it.
#pragma once

#include <relief/base/error.h>
#include <relief/base/vec.h>
#include <relief/core/grid.h>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace relief {

using FibreId = std::uint32_t;
using SlabId = std::uint32_t;
inline constexpr SlabId kNoSlab = 0xffffffffU;

/// The segment from an inner to an outer corner, shared by the slabs around it; model units.
struct Fibre {
  /// its ends, model units
  Vec3d inner, outer;
  /// From the inner end to the outer one; not a unit vector.
  [[nodiscard]] constexpr Vec3d direction() const noexcept { return outer - inner; }
};

/// How an edge of a slab lies on that of the slab across it. Of two slabs whose levels differ by one, the edge of the
/// finer is half of the coarser's: its middle, which ends there, hangs in the coarser's edge.
enum class EdgeShare : std::uint8_t {
  Whole,          ///< the same edge, or an open one
  MiddleAtStart,  ///< half of the neighbour's; this edge begins at the neighbour's middle
  MiddleAtEnd,    ///< half of the neighbour's; this edge ends there
  Halves,         ///< two slabs lie across, a half each: the neighbour beside the first half, see SlabMesh::hanging()
};

/// Returns whether an edge is half of the neighbour's.
[[nodiscard]] constexpr bool is_half(EdgeShare share) noexcept {
  return share == EdgeShare::MiddleAtStart || share == EdgeShare::MiddleAtEnd;
}

/// Three fibres, counter-clockwise seen from outside. neighbours[k] is the slab across the edge opposite corner k, and
/// kNoSlab at an open edge. mirrors[k] says which of its edges that is. The displacement tile has n intervals per edge.
struct Slab {
  std::array<FibreId, 3> fibres;             ///< the fibres at its corners
  std::array<SlabId, 3> neighbours;          ///< the slab across each edge; kNoSlab at a boundary
  int intervals = 32;                        ///< n, along each edge
  std::array<EdgeShare, 3> shares = {};      ///< how each edge is shared with a slab of another level
  std::array<std::uint8_t, 3> mirrors = {};  ///< which edge of the neighbour each edge is
};

/// Says which part of its root a slab is: the barycentric weights of its corners in the root, times 2^level.
struct RootPlace {
  SlabId root = kNoSlab;  ///< the root slab it was cut from
  int level = 0;          ///< how often it was cut; 0 is a root
  /// its corners in the root, whole weights that sum to 2^level
  std::array<std::array<int, 3>, 3> corners = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  /// Returns the weights in the root of a place with weights w in the slab, times 2^level; exact for whole numbers.
  template <typename Number>
  [[nodiscard]] constexpr std::array<Number, 3> in_root(const std::array<Number, 3>& w) const noexcept {
    std::array<Number, 3> sum{};
    for (std::size_t k = 0; k < 3; ++k)
      sum[k] = w[0] * static_cast<Number>(corners[0][k]) + w[1] * static_cast<Number>(corners[1][k]) +
               w[2] * static_cast<Number>(corners[2][k]);
    return sum;
  }
};
/// Returns the four parts of a slab that is cut at the middles of its edges: at corners 0, 1 and 2, and in the centre.
[[nodiscard]] constexpr std::array<RootPlace, 4> cut_in_four(const RootPlace& slab) noexcept {
  const auto between = [&](std::size_t a, std::size_t b) {
    std::array<int, 3> sum{};
    for (std::size_t k = 0; k < 3; ++k) sum[k] = slab.corners[a][k] + slab.corners[b][k];
    return sum;
  };
  std::array<RootPlace, 4> parts{};
  for (RootPlace& part : parts) part = {.root = slab.root, .level = slab.level + 1};
  for (std::size_t c = 0; c < 3; ++c) parts[c].corners = {between(c, 0), between(c, 1), between(c, 2)};
  parts[3].corners = {between(1, 2), between(2, 0), between(0, 1)};
  return parts;
}
/// Of cuts below a root: then a grid of kMaxIntervals still counts in an int, and so do its weights times 2^level.
inline constexpr int kMaxLevel = 20;

/// An edge with two slabs across it, each along half of it, and the fibre in its middle.
struct HangingEdge {
  SlabId slab = kNoSlab;                              ///< the coarser
  std::uint8_t edge = 0;                              ///< the edge, 0 to 2
  FibreId middle = 0;                                 ///< the fibre in its middle
  std::array<SlabId, 2> across = {kNoSlab, kNoSlab};  ///< beside the first and the second half, counted along the edge
  std::array<std::uint8_t, 2> edges = {};             ///< which of their edges these are
};

/// One stored copy of a sample: a grid point of a slab.
struct SampleCopy {
  SlabId slab = kNoSlab;  ///< which slab
  GridPoint at;           ///< which sample
};

/// A corner of a slab, of which there are fewer than 2^30.
struct SlabCorner {
  SlabId slab : 30 = 0;          ///< which slab
  std::uint32_t corner : 2 = 0;  ///< 0..2

  SlabCorner() = default;
  /// Corner k, 0 to 2, of slab s.
  constexpr SlabCorner(SlabId s, std::uint32_t k) noexcept : slab(s & 0x3fffffffU), corner(k & 3U) {}
};

/// The six corners of a slab, with what the order-independent evaluation of positions needs (see weighted()).
struct SlabCorners {
  /// ends of its three fibres, model units
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

/// Says where the samples of a slab lie, from the corners of its root: so all copies of a sample have the same bits.
struct SampleField {
  SlabCorners root;  ///< corners of the root
  RootPlace place;   ///< where the slab lies in it
  /// Returns the position of sample p of a grid of n intervals, at `alpha` along its fibre.
  [[nodiscard]] Vec3d point(int n, GridPoint p, double alpha) const noexcept {
    const std::array<int, 3> w = weights(n, p);
    const std::array<int, 3> whole = place.level == 0 ? w : place.in_root(w);
    const double steps = place.level == 0 ? n : static_cast<double>(n) * (1 << place.level);
    return root.point({whole[0] / steps, whole[1] / steps, whole[2] / steps}, alpha);
  }
};

/// Slabs, and those they were cut from. Roots are what make() was given. A slab may be cut in four at the middles of
/// its edges: the centre keeps its number, the children at corners 0, 1 and 2 get the next three. A cut moves nothing,
/// so certificates of the roots hold. Slabs across an edge differ by one level at most. Immutable; any thread may read
/// it.
class SlabMesh {
 public:
  /// Holds what make() needs of a slab; neighbours are found by it.
  struct Face {
    std::array<FibreId, 3> fibres;  ///< the fibres at its corners
    int intervals = 32;             ///< n, along each edge
  };

  /// Makes a cage after counting (C0): finite fibres, numbers in range, no repeated corner, opposite directions at each
  /// edge, one fan per fibre, n from 1 to 128 and equal across edges up to a power of two. Overlaps are the verifier's
  /// matter. Errors: Corrupt, naming the slab or fibre; unused fibres are refused.
  [[nodiscard]] static Result<SlabMesh> make(std::vector<Fibre> fibres, std::span<const Face> faces);
  /// Returns the same cage with other intervals, by slab; it shares all but these. Of one that is given away, nothing
  /// may be used afterwards, also where this fails. Error: Corrupt, as from make().
  [[nodiscard]] Result<SlabMesh> with_intervals(std::span<const int> intervals) const& {
    return SlabMesh(*this).with_intervals(intervals);
  }
  /// Returns the same cage with other intervals, one per slab. Errors: InvalidArgument.
  [[nodiscard]] Result<SlabMesh> with_intervals(std::span<const int> intervals) &&;

  /// Cuts slabs in four, one after the other, numbered as they are at that moment. A child has half the intervals, or
  /// the same odd number; hanging edges may not fit yet (refined()). Cost: about 0.7 microseconds per slab of the cage.
  /// Errors: Corrupt (no such slab, levels apart by more than one, over kMaxLevel, too many slabs).
  [[nodiscard]] Result<SlabMesh> cut(std::span<const SlabId> slabs) const;
  /// Returns the same slabs with other intervals, of a cage with detail: roots() keep theirs. Beside what make()
  /// checks, the coarser slab of a hanging edge has an even number, at most twice the finer's. Error: Corrupt.
  [[nodiscard]] Result<SlabMesh> refined(std::span<const int> intervals) const;

  /// Returns the same roots, cuts and intervals between other fibres. Errors: those of make().
  [[nodiscard]] Result<SlabMesh> with_root_fibres(std::vector<Fibre> fibres) const;

  /// Returns the slabs that make() was given, with their intervals from then; and their fibres, which come first of
  /// all.
  [[nodiscard]] std::span<const Slab> roots() const noexcept {
    return roots_ ? std::span<const Slab>(*roots_) : slabs_;
  }
  /// Fibres of the roots; those of cuts follow them in fibres().
  [[nodiscard]] std::span<const Fibre> root_fibres() const noexcept { return fibres_.first(root_fibre_count_); }
  /// Equal for cages that were cut from the same one.
  [[nodiscard]] std::uint64_t roots_number() const noexcept { return roots_number_; }
  /// Returns all cuts since make(), in order.
  [[nodiscard]] std::span<const SlabId> cuts() const noexcept { return cuts_; }
  /// Returns whether a slab is cut.
  [[nodiscard]] bool is_cut() const noexcept { return !cuts_.empty(); }
  /// Returns whether slabs were cut or got other intervals than their roots.
  [[nodiscard]] bool has_detail() const noexcept { return roots_ != nullptr; }
  /// Returns where slab s lies in its root.
  [[nodiscard]] RootPlace root_place(SlabId s) const noexcept { return is_cut() ? places_[s] : RootPlace{.root = s}; }
  /// Returns how often slab s was cut.
  [[nodiscard]] int level(SlabId s) const noexcept { return is_cut() ? places_[s].level : 0; }
  /// Returns the six corners of a root slab.
  [[nodiscard]] SlabCorners root_corners(SlabId root) const noexcept { return corners_of(roots()[root].fibres); }
  /// Returns the field of fibres of slab s.
  [[nodiscard]] SampleField field(SlabId s) const noexcept {
    const RootPlace place = root_place(s);
    return {place.level == 0 ? corners(s) : root_corners(place.root), place};
  }
  /// Returns the slab that has a place in a root, given by its weights there, and its weights in the slab. Exact; some
  /// nanoseconds per level.
  [[nodiscard]] SlabId descend(SlabId root, std::array<double, 3>& weights) const noexcept;
  /// Returns the edge of a slab that has two slabs across; only where its share is Halves.
  [[nodiscard]] const HangingEdge& hanging(SlabId s, int edge) const noexcept;
  /// Returns the edge in whose middle a fibre hangs; null where it hangs in none.
  [[nodiscard]] const HangingEdge* hanging_at(FibreId f) const noexcept {
    if (f < root_fibre_count_) return nullptr;
    const std::uint32_t number = hanging_of_[f - root_fibre_count_];
    return number == kNoSlab ? nullptr : &hanging_[number];
  }
  /// The two fibres at the ends of a wall, in the order of the edge. Where a coarser slab lies across, they are
  /// that slab's, so both sides speak of the same wall.
  [[nodiscard]] std::array<FibreId, 2> wall(SlabId s, int edge) const noexcept {
    const Slab& slab = slabs_[s];
    const auto k = static_cast<std::size_t>(edge);
    if (is_half(slab.shares[k])) {
      const Slab& coarse = slabs_[slab.neighbours[k]];
      return {coarse.fibres[(slab.mirrors[k] + 2U) % 3], coarse.fibres[(slab.mirrors[k] + 1U) % 3]};
    }
    return {slab.fibres[(k + 1) % 3], slab.fibres[(k + 2) % 3]};
  }
  /// Calls visit(SlabId) for the slabs across an edge: none, one or two.
  template <typename Visit>
  void for_each_across(SlabId s, int edge, Visit&& visit) const {
    const auto k = static_cast<std::size_t>(edge);
    if (slabs_[s].shares[k] == EdgeShare::Halves) {
      for (const SlabId other : hanging(s, edge).across) visit(other);
    } else if (slabs_[s].neighbours[k] != kNoSlab) {
      visit(slabs_[s].neighbours[k]);
    }
  }
  /// Calls visit(SlabId) for the slabs that meet a fibre, in order: those of its fan, and the one in whose edge it
  /// hangs.
  template <typename Visit>
  void for_each_at(FibreId f, Visit&& visit) const {
    const HangingEdge* const hangs = hanging_at(f);
    SlabId beside = hangs != nullptr ? hangs->slab : kNoSlab;
    for (const SlabCorner c : fan(f)) {
      if (beside < c.slab) visit(std::exchange(beside, kNoSlab));
      visit(SlabId{c.slab});
    }
    if (beside != kNoSlab) visit(beside);
  }

  /// Returns all fibres, the roots' first.
  [[nodiscard]] std::span<const Fibre> fibres() const noexcept { return fibres_; }
  /// Returns all slabs.
  [[nodiscard]] std::span<const Slab> slabs() const noexcept { return slabs_; }
  /// Returns how many slabs.
  [[nodiscard]] SlabId slab_count() const noexcept { return static_cast<SlabId>(slabs_.size()); }
  /// n of slab s.
  [[nodiscard]] int intervals(SlabId s) const noexcept { return slabs_[s].intervals; }
  /// Returns the six corners of slab s.
  [[nodiscard]] SlabCorners corners(SlabId s) const noexcept { return corners_of(slabs_[s].fibres); }
  /// Returns the box of the six corners, which bounds the slab and every displaced surface in it.
  [[nodiscard]] const Box3d& box(SlabId s) const noexcept { return boxes_[s]; }
  /// Returns the box of all slabs.
  [[nodiscard]] const Box3d& bounds() const noexcept { return bounds_; }
  /// Returns the slab corners that meet at a fibre, by ascending slab number.
  [[nodiscard]] std::span<const SlabCorner> fan(FibreId f) const noexcept {
    return fans_.subspan(fan_begin_[f], fan_begin_[f + 1] - fan_begin_[f]);
  }
  /// Returns which edge of neighbours[edge] is shared with edge `edge` of s; its grid runs the other way (t' = n - t
  /// where both are whole).
  [[nodiscard]] int mirror_edge(SlabId s, int edge) const noexcept {
    return slabs_[s].mirrors[static_cast<std::size_t>(edge)];
  }
  /// Intervals that both sides of an edge have, along the slab's own edge: where both are whole, the smaller of the two
  /// n. A slab with more of them has constrained samples between the shared ones (see EdgePlace).
  [[nodiscard]] int edge_intervals(SlabId s, int edge) const noexcept {
    return edge_intervals(s, edge, [this](SlabId slab) { return intervals(slab); });
  }
  /// Returns the same where slab k has intervals_of(k).
  template <std::invocable<SlabId> IntervalsOf>
  [[nodiscard]] int edge_intervals(SlabId s, int edge, IntervalsOf&& intervals_of) const noexcept {
    const auto k = static_cast<std::size_t>(edge);
    const SlabId other = slabs_[s].neighbours[k];
    const int n = intervals_of(s);
    if (other == kNoSlab || slabs_[s].shares[k] == EdgeShare::Halves) return n;
    return std::min(n, slabs_[s].shares[k] == EdgeShare::Whole ? intervals_of(other) : intervals_of(other) / 2);
  }
  /// Intervals along each edge of slab s that both sides have.
  [[nodiscard]] std::array<int, 3> edge_intervals(SlabId s) const noexcept {
    return {edge_intervals(s, 0), edge_intervals(s, 1), edge_intervals(s, 2)};
  }
  template <std::invocable<SlabId> IntervalsOf>
  /// Returns the same for a layer with intervals of its own.
  [[nodiscard]] std::array<int, 3> edge_intervals(SlabId s, IntervalsOf&& intervals_of) const noexcept {
    return {edge_intervals(s, 0, intervals_of), edge_intervals(s, 1, intervals_of), edge_intervals(s, 2, intervals_of)};
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
    for_each_constrained(s, [this](SlabId slab) { return intervals(slab); }, visit);
  }
  /// Returns the same where slab k has intervals_of(k).
  template <std::invocable<SlabId> IntervalsOf, typename Visit>
  void for_each_constrained(SlabId s, IntervalsOf&& intervals_of, Visit&& visit) const {
    const int n = intervals_of(s);
    const std::array<int, 3> edges = edge_intervals(s, intervals_of);
    for (int edge = 0; edge < 3; ++edge)
      for (int t = 1; edges[static_cast<std::size_t>(edge)] != n && t < n; ++t) {
        const GridPoint p = edge_point(n, edge, t);
        if (const EdgePlace place = relief::edge_place(n, edges, p); place.constrained()) visit(p, place);
      }
  }

  /// Calls visit(SampleCopy) for all copies of a sample, itself included, by ascending slab number. There is one inside
  /// a slab, up to two on an edge, and one per slab around a corner. Each slab has its own n here; a constrained sample
  /// has no copy.
  template <typename Visit>
  void for_each_copy(SlabId s, GridPoint p, Visit&& visit) const {
    for_each_copy(s, [this](SlabId slab) { return intervals(slab); }, p, visit);
  }
  /// Returns the same where slab k has intervals_of(k), under the rules of the displacement's.
  template <std::invocable<SlabId> IntervalsOf, typename Visit>
  void for_each_copy(SlabId s, IntervalsOf&& intervals_of, GridPoint p, Visit&& visit) const {
    const int n = intervals_of(s);
    const std::array<int, 3> w = weights(n, p);
    const int zeros = (w[0] == 0) + (w[1] == 0) + (w[2] == 0);
    if (zeros == 0) {
      visit(SampleCopy{s, p});
    } else if (zeros == 2) {
      const std::size_t corner = w[0] != 0 ? 0 : w[1] != 0 ? 1 : 2;
      visit_corner(slabs_[s].fibres[corner], intervals_of, visit);
    } else {
      const int edge = w[0] == 0 ? 0 : w[1] == 0 ? 1 : 2;
      const auto k = static_cast<std::size_t>(edge);
      const int t = w[(k + 2) % 3];
      if (slabs_[s].shares[k] == EdgeShare::Halves && 2 * t == n)
        return visit_corner(hanging(s, edge).middle, intervals_of, visit);
      const SampleCopy twin = twin_of(s, edge, t, intervals_of);
      if (twin.slab < s) visit(twin);
      visit(SampleCopy{s, p});
      if (twin.slab != kNoSlab && twin.slab > s) visit(twin);
    }
  }
  /// Returns the copy across an edge of the sample at t, 0 < t < n, that is no corner of a slab; kNoSlab where there is
  /// none.
  template <std::invocable<SlabId> IntervalsOf>
  [[nodiscard]] SampleCopy twin_of(SlabId s, int edge, int t, IntervalsOf&& intervals_of) const noexcept {
    const Slab& slab = slabs_[s];
    const auto k = static_cast<std::size_t>(edge);
    SlabId other = slab.neighbours[k];
    if (other == kNoSlab) return {};
    int n = intervals_of(s), mirror = slab.mirrors[k], after = 0;  // samples of the other before the half
    if (slab.shares[k] == EdgeShare::Halves) {
      const HangingEdge& hangs = hanging(s, edge);
      const std::size_t half = 2 * t < n ? 0 : 1;
      other = hangs.across[half];
      mirror = hangs.edges[half];
      n /= 2;
      if (half == 1) t -= n;
    }
    int m = intervals_of(other);
    if (is_half(slab.shares[k])) {
      m /= 2;
      if (slab.shares[k] == EdgeShare::MiddleAtEnd) after = m;
    }
    if (t * m % n != 0) return {};
    return {other, edge_point(intervals_of(other), mirror, after + m - t * m / n)};
  }

  /// Returns whether grids of intervals_of(k) in slab k fit together along the edges of a slab: the same except for a
  /// power of two, and along hanging edges as refined() wants it. Error: Corrupt, naming the slabs.
  template <std::invocable<SlabId> IntervalsOf>
  [[nodiscard]] Status check_fit(SlabId s, IntervalsOf&& intervals_of) const {
    for (std::size_t k = 0; k < 3; ++k) {
      if (slabs_[s].shares[k] == EdgeShare::Halves) {
        const HangingEdge& hangs = hanging(s, static_cast<int>(k));
        for (std::size_t half = 0; half < 2; ++half) {
          const SlabId finer = hangs.across[half];
          if (Status fit = check_fit(finer, hangs.edges[half], intervals_of(finer), intervals_of(s)); !fit) return fit;
        }
      } else if (const SlabId other = slabs_[s].neighbours[k]; other != kNoSlab) {
        if (Status fit = check_fit(s, k, intervals_of(s), intervals_of(other)); !fit) return fit;
      }
    }
    return {};
  }

  /// Returns what it takes in memory, beside what it shares with another cage (null: all of it). Counts arrays, not
  /// what small parts of them take.
  [[nodiscard]] std::size_t bytes_beside(const SlabMesh* other) const noexcept;

  /// Another one for each cage that this process has made, its copies have the same; never 0.
  [[nodiscard]] std::uint64_t number() const noexcept { return number_; }
  /// Hash of fibres and slabs.
  [[nodiscard]] std::uint64_t content_hash() const noexcept;

  /// One node of the hierarchy over the boxes of the root slabs; used by the queries. Below each root hang its parts.
  struct Node {
    Box3d box;  ///< what the node's slabs lie in, model units
    std::uint32_t first =
        0;  ///< leaf: first entry of `tree_roots`; inner node: number of the right child (left is next)
    std::uint32_t count = 0;  ///< leaf: number of roots; 0 for an inner node
  };
  /// Returns the tree over the roots, its own root first.
  [[nodiscard]] std::span<const Node> tree() const noexcept { return tree_; }
  /// A root slab or a part of one. If it is cut, `children` is the first of its four parts, at corners 0, 1 and 2 and
  /// in the centre; else 0.
  struct Part {
    SlabId slab = kNoSlab;       ///< which slab; of what is cut, the one in the centre
    std::uint32_t children = 0;  ///< number of its first part
  };
  /// Returns a part by its number; a root slab has its own number in roots().
  [[nodiscard]] Part part(std::uint32_t number) const noexcept {
    return is_cut() ? parts_[number] : Part{.slab = number};
  }
  /// Returns the box of a part, which holds those of all slabs in it; model units.
  [[nodiscard]] const Box3d& part_box(std::uint32_t number) const noexcept { return part_boxes_[number]; }
  /// Calls visit(SlabId) for the root slabs whose boxes, and those of all nodes above, accept(box) lets through, depth
  /// first and left before right, until visit returns true; whether it did.
  template <typename Accept, typename Visit>
  bool visit_roots(Accept&& accept, Visit&& visit) const {
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
        const SlabId root = tree_roots_[node.first + k];
        if (accept(part_boxes_[root]) && visit(root)) return true;
      }
    }
    return false;
  }
  /// Calls visit(SlabId) for the slabs whose boxes, and those of all nodes and parts above, accept(box) lets through,
  /// likewise. For a slab, accept is asked last right before it.
  template <typename Accept, typename Visit>
  bool visit_tree(Accept&& accept, Visit&& visit) const {
    return visit_roots(accept, [&](SlabId root) { return visit_parts(root, accept, visit); });
  }
  /// Where a visit_nearest() has got to, from the root on.
  struct Visited {
    struct Entry {
      std::uint32_t node = 0;
      double distance = 0;
    };
    std::array<Entry, 64> ahead;  ///< holds what was not yet visited; the last comes next
    std::size_t count = 1;
    std::uint32_t root = 0;  ///< of the next node, if that is a leaf: its roots before this one are done
    SlabId slab = kNoSlab;   ///< where it stopped in that root; kNoSlab: not in it
  };
  /// Returns the same for those whose boxes have a distance(box) of at most `reach`, which visit may lower: of two
  /// nodes, or of four parts, the nearer first.
  template <typename Distance, typename Visit>
  bool visit_nearest(Distance&& distance, const double& reach, Visit&& visit) const {
    Visited at;
    at.ahead[0].distance = distance(tree_[0].box);
    return visit_nearest(distance, reach, visit, at);
  }
  /// Goes on from there, with the same distances and a reach that is no longer, and says where it stopped; the slab for
  /// which visit returned true comes again.
  template <typename Distance, typename Visit>
  bool visit_nearest(Distance&& distance, const double& reach, Visit&& visit, Visited& at) const {
    double limit = 0;  // what comes before the slab at which it stopped is only passed over
    const auto go_on = [&](SlabId s) {
      if (at.slab != kNoSlab && at.slab != s) return false;
      at.slab = visit(s) ? s : kNoSlab;
      limit = reach;
      return at.slab != kNoSlab;
    };
    while (at.count > 0) {
      const Visited::Entry next = at.ahead[at.count - 1];
      const Node& node = tree_[next.node];
      if (next.distance <= reach && node.count > 0) {
        for (; at.root < node.count; ++at.root, at.slab = kNoSlab) {
          const SlabId root = tree_roots_[node.first + at.root];
          limit = at.slab == kNoSlab ? reach : std::numeric_limits<double>::infinity();
          if (distance(part_boxes_[root]) <= reach && visit_nearest_parts(root, distance, limit, go_on)) return true;
        }
      }
      --at.count;
      at.root = 0;
      at.slab = kNoSlab;
      if (!(next.distance <= reach) || node.count > 0) continue;
      Visited::Entry near = {next.node + 1, distance(tree_[next.node + 1].box)};
      Visited::Entry far = {node.first, distance(tree_[node.first].box)};
      if (far.distance < near.distance) std::swap(near, far);
      if (far.distance <= reach) at.ahead[at.count++] = far;
      if (near.distance <= reach) at.ahead[at.count++] = near;
    }
    return false;
  }
  /// Returns the root slabs in the order of the tree's leaves.
  [[nodiscard]] std::span<const SlabId> tree_roots() const noexcept { return tree_roots_; }

 private:
  /// Holds what does not depend on the intervals.
  struct Shape {
    std::vector<Fibre> fibres;
    std::vector<Box3d> boxes;
    std::vector<std::uint32_t> fan_begin;
    std::vector<SlabCorner> fans;
    std::vector<Node> tree;
    std::vector<SlabId> tree_roots;
    // All empty where nothing is cut.
    std::vector<SlabId> cuts;
    std::vector<RootPlace> places;  ///< by slab
    std::vector<Part> parts;        ///< the roots first, and each before those that it was cut into
    std::vector<Box3d> part_boxes;  ///< by part
    std::vector<HangingEdge> hanging;
    std::map<std::array<FibreId, 2>, FibreId> middles;  ///< by the two fibres, the lower number first
    std::vector<std::uint32_t> hanging_of;              ///< by fibre beyond the roots': number in hanging, or kNoSlab

    void find_part_boxes();
    void build_tree(std::span<const Box3d> roots);
  };
  class Assembly;
  SlabMesh() = default;
  [[nodiscard]] Status check_fit(SlabId s, std::size_t edge, int own, int across) const;
  [[nodiscard]] Status check_intervals() const;
  void take(std::shared_ptr<const Shape> shape);
  [[nodiscard]] SlabCorners corners_of(const std::array<FibreId, 3>& fibres) const noexcept {
    const auto& [a, b, c] = fibres;
    // How many of the others come before each.
    const auto at_a = static_cast<std::size_t>((b < a) + (c < a)), at_b = static_cast<std::size_t>((a < b) + (c < b));
    SlabCorners corners = {.inner = {fibres_[a].inner, fibres_[b].inner, fibres_[c].inner},
                           .outer = {fibres_[a].outer, fibres_[b].outer, fibres_[c].outer},
                           .order = {2, 2, 2}};
    corners.order[at_a] = 0;
    corners.order[at_b] = 1;
    return corners;
  }
  /// visit_tree() of what a part holds.
  template <typename Accept, typename Visit>
  bool visit_parts(std::uint32_t number, Accept& accept, Visit& visit) const {
    const Part at = part(number);
    if (at.children == 0) return visit(at.slab);
    for (std::uint32_t k = at.children; k < at.children + 4; ++k)
      if (accept(part_boxes_[k]) && visit_parts(k, accept, visit)) return true;
    return false;
  }
  /// visit_nearest() of what a part holds.
  template <typename Distance, typename Visit>
  bool visit_nearest_parts(std::uint32_t number, Distance& distance, const double& reach, Visit& visit) const {
    const Part at = part(number);
    if (at.children == 0) return visit(at.slab);
    std::array<std::pair<double, std::uint32_t>, 4> near;
    for (std::uint32_t k = 0; k < 4; ++k) near[k] = {distance(part_boxes_[at.children + k]), at.children + k};
    std::ranges::sort(near);
    for (const auto& [far, child] : near)
      if (far <= reach && visit_nearest_parts(child, distance, reach, visit)) return true;
    return false;
  }
  /// The copies of the sample at a fibre, in order.
  template <typename IntervalsOf, typename Visit>
  void visit_corner(FibreId f, IntervalsOf&& intervals_of, Visit&& visit) const {
    const HangingEdge* const hangs = hanging_at(f);
    SampleCopy beside;
    if (hangs != nullptr) {
      const int n = intervals_of(hangs->slab);
      beside = {hangs->slab, edge_point(n, hangs->edge, n / 2)};
    }
    for (const SlabCorner c : fan(f)) {
      if (beside.slab < c.slab) {
        visit(beside);
        beside.slab = kNoSlab;
      }
      visit(SampleCopy{c.slab, corner_point(intervals_of(c.slab), c.corner)});
    }
    if (beside.slab != kNoSlab) visit(beside);
  }

  std::uint64_t number_ = 0, roots_number_ = 0;
  std::vector<Slab> slabs_;
  std::shared_ptr<const std::vector<Slab>> roots_;  ///< null: they are the slabs
  std::size_t root_fibre_count_ = 0;
  Box3d bounds_;
  std::shared_ptr<const Shape> shape_;
  // Into the shape.
  std::span<const Fibre> fibres_;
  std::span<const Box3d> boxes_;
  std::span<const std::uint32_t> fan_begin_;
  std::span<const SlabCorner> fans_;
  std::span<const Node> tree_;
  std::span<const SlabId> tree_roots_;
  std::span<const SlabId> cuts_;
  std::span<const RootPlace> places_;
  std::span<const Part> parts_;
  std::span<const Box3d> part_boxes_;
  std::span<const HangingEdge> hanging_;
  std::span<const std::uint32_t> hanging_of_;
};

/// A cage as who made its slabs left it, and how they were cut since.
struct RootCage {
  std::span<const Fibre> fibres;          ///< of the roots
  std::span<const SlabMesh::Face> roots;  ///< their intervals say nothing here
  std::span<const SlabId> cuts;           ///< as SlabMesh::cuts()
};
/// Returns whether a cage has the slabs of an earlier one, whose roots may have been halved and cut since, and whose
/// fibres may have been moved for room. Halving adds roots and fibres after those that there were, and each half has a
/// new fibre. Room makes fibres longer and turns them about a place on them. So at least one of them still meets where
/// it was; those of new slabs do not, even where these have the same corners.
[[nodiscard]] bool has_slabs_of(const RootCage& now, const RootCage& earlier) noexcept;
[[nodiscard]] bool has_slabs_of(const SlabMesh& now, const SlabMesh& earlier);

}  // namespace relief
