// Makes slabs fewer and thicker by steps of which each keeps all conditions.
#pragma once

#include <relief/base/lanes.h>
#include <relief/base/progress.h>
#include <relief/convert/cage_draft.h>
#include <relief/convert/directions.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace relief::detail {

/// What fewer slabs may cost; never less than was allowed before.
struct Tolerance {
  double folds = 0;  ///< share of a slab's area in which the source may fold (C6); 0: nowhere, 1: as it likes
  double loss = 0;  ///< share of what the slabs around an edge hold of the source that its merging may leave outside of
                    ///< them (C5), where nothing else merges it; only with folds = 1
};

/// Works on a whole cage, or on the part of one within a box: all slabs that meet the box, of which those change that
/// lie strictly inside, and nothing that changes leaves it. So parts within disjoint boxes may be worked on at once.
class SlabReducer {
 public:
  /// `longest`: of a fibre, lattice steps. Slabs without a list that may change are given one through `tree`, which
  /// holds boxes around the source's triangles. Cancelled: every later step is, too.
  SlabReducer(const OrderedSource& source, const BoxTree& tree, double longest, CageDraft&& cage, const Box3d& room,
              const Progress& progress);

  [[nodiscard]] std::size_t slab_count() const noexcept { return alive_; }
  /// Slabs that could change at the start.
  [[nodiscard]] std::size_t free_count() const noexcept { return free_; }
  /// Collapses edges in the order in which they lie in memory until `stop` slabs are left or little goes any more. The
  /// edges of low cost go first, in some sweeps. False when cancelled.
  bool sweep(std::size_t stop, const Progress& progress);
  /// Collapses edges by cost, with rounds of moves in between, for a whole cage. False when cancelled. This, and what
  /// follows, after sweep(), which makes the boxes that they look into.
  bool reduce(std::size_t target_count, const Progress& progress);
  /// From now on that much may be given up, and more is tried to make slabs fewer.
  void tolerate(Tolerance tolerance);
  /// The share of the source's area that lies in no slab; of a triangle that is partly in one half counts.
  [[nodiscard]] double lost() const;
  /// Makes room to carve and to add. False when cancelled.
  bool thicken(const Progress& progress);

  [[nodiscard]] const CageDraft& cage() const noexcept { return cage_; }
  /// It is of no more use then.
  [[nodiscard]] CageDraft take_cage() && { return std::move(cage_); }
  /// Whether a fibre may have changed.
  [[nodiscard]] bool is_free(std::uint32_t v) const noexcept { return fixed_[v] == 0; }
  /// Whether such a one has, or a slab around it.
  [[nodiscard]] bool has_changed(std::uint32_t v) const noexcept { return is_free(v) && touched_[v] > kAtFirst; }

 private:
  using List = CageDraft::List;
  /// Why a change is not possible.
  enum class Fault : std::uint8_t {
    None,
    Winding,
    Jacobian,
    Outer,
    Inner,
    Folded,
    OuterOverlap,
    InnerOverlap,
    Empty,
    Lost,
    Outside
  };
  struct Candidate {
    double cost;
    std::uint32_t u, v, stamp_u, stamp_v;
    friend bool operator<(const Candidate& a, const Candidate& b) noexcept {
      if (a.cost != b.cost) return a.cost > b.cost;
      return a.u != b.u ? a.u > b.u : a.v > b.v;
    }
  };
  using SideBoxes = std::array<FloatBox, 2>;
  using SideTriangles = std::array<LatticeTriangle, 2>;
  /// Four boxes side by side; those not set meet nothing.
  struct FourBoxes {
    std::array<Lanes, 3> low, high;
    FourBoxes() {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low[axis].of.fill(1e30F);
        high[axis].of.fill(-1e30F);
      }
    }
    void set(std::size_t k, const FloatBox& box) noexcept;
    [[nodiscard]] unsigned meeting(const FloatBox& box) const noexcept;
  };
  /// Four faces side by side, with the boxes around the sides of their slabs. Those not set meet nothing.
  struct FourFaces {
    std::array<FourBoxes, 2> boxes;  // by Side
    std::array<std::array<std::uint32_t, 4>, 3> corners{};
    void set(std::size_t k, const Face& face, const SlabShape& shape) noexcept;
    /// Which of those set have a corner in common with a face.
    [[nodiscard]] unsigned joined_to(const Face& face) const noexcept;
  };
  /// The faces that a change puts in place of others. Corner 0 of each is the moved vertex, if there is one; then they
  /// run once around it.
  struct Trial {
    std::vector<Face> faces;
    std::vector<std::uint32_t> slots;     // the faces they replace
    std::vector<std::uint32_t> vanished;  // further ones that go
    std::size_t fresh = 0;                // faces before this one are there already, and only count for the winding
    std::size_t second = 0;               // of an edge's star: where the faces of its second end begin
    std::uint32_t moved = kNone;
    Ends ends;
    std::vector<SideTriangles> triangles;  // of the fresh faces, as all that follows
    std::vector<SlabShape> shapes;
    std::vector<FourFaces> fours;
    std::vector<Entry> lists;
    std::vector<List> ranges;
  };
  /// Codes of entries that were met.
  class Seen {
   public:
    /// For at most so many.
    void reset(std::size_t most);
    /// False when it was there.
    bool add(std::uint32_t code);
    [[nodiscard]] bool has(std::uint32_t code) const;

   private:
    struct Slot {
      std::uint32_t code = 0, round = 0;
    };
    std::vector<Slot> slots_;
    std::size_t mask_ = 0;
    std::uint32_t round_ = 0;
  };
  /// Heights of a fibre's end.
  struct Range {
    double least = 0, most = 1e30;
    /// Not quite at its ends.
    [[nodiscard]] double nearest(double height) const noexcept {
      const double margin = 0.02 * std::min(most - least, height);
      return std::clamp(height, least + margin, std::max(least + margin, most - margin));
    }
  };
  struct Quality {
    double least = 1, mean = 0;
  };

  [[nodiscard]] std::uint32_t origin(std::uint32_t h) const noexcept { return cage_.faces[h / 3][h % 3]; }
  [[nodiscard]] std::uint32_t target(std::uint32_t h) const noexcept { return origin(next_of(h)); }
  [[nodiscard]] bool alive(std::uint32_t f) const noexcept { return cage_.alive(f); }
  /// The half-edges that leave a free vertex.
  template <typename Visit>
  void for_ring(std::uint32_t v, Visit&& visit) const {
    const std::uint32_t start = out_[v];
    std::uint32_t h = start;
    do {
      visit(h);
      h = twins_[last_of(h)];
    } while (h != start);
  }
  /// Whether h is the one of its edge's two half-edges that stands for it, between two free vertices.
  [[nodiscard]] bool is_free_edge(std::uint32_t h) const noexcept {
    return alive(h / 3) && h < twins_[h] && is_free(origin(h)) && is_free(target(h));
  }

  /// Calls visit(t) for the triangles of some entries.
  template <typename Visit>
  void for_triangles(std::span<const Entry> entries, Visit&& visit) const {
    for (const Entry e : entries) {
      const auto stop = std::min<std::size_t>(e.first() + (e.is_block() ? kBlock : 1), source_.faces.size());
      for (std::uint32_t t = e.first(); t < stop; ++t) visit(t);
    }
  }
  [[nodiscard]] bool is_within(const Box3d& box) const noexcept;  // the room
  void find_lists(const BoxTree& tree, const Progress& progress);
  void build_boxes();
  /// So many entries the pool holds, a third of them stale, until it is packed.
  [[nodiscard]] std::size_t most_listed() const noexcept { return listed_ + listed_ / 2 + 65536; }
  void pack_lists();
  [[nodiscard]] SideBoxes boxes_of(std::uint32_t f) const noexcept;
  [[nodiscard]] Merge weigh(std::uint32_t u, std::uint32_t v) const noexcept;
  void push(std::uint32_t h);
  void fill_queue();
  void touch(std::uint32_t v);

  bool link_allows(std::uint32_t h);
  void star_of(std::uint32_t v);
  bool star_of_edge(std::uint32_t h);
  void gather();
  void lay_out();
  /// The direction that best sees the source in the star; leaves the outermost of its normals in normals_.
  Direction aim();
  Direction find_aim();
  [[nodiscard]] std::vector<std::uint32_t> outermost(Vec3d mean) const;
  [[nodiscard]] double least_lean(Vec3d d) const noexcept;
  Fault evaluate();
  Fault evaluate_hint();
  Fault evaluate_source();
  Fault evaluate_block(const SlabShape& s, const QuickShape& quick, std::size_t piece, bool is_within, double& spare);
  Fault judge(Meeting m, std::uint32_t triangle, double& spare);
  [[nodiscard]] static Fault fault_of(Meeting m) noexcept;
  Fault evaluate_overlap();
  [[nodiscard]] Quality quality(Vec3d at) const noexcept;
  [[nodiscard]] Quality quality_now() const noexcept;
  void commit_lists();

  bool drop_end(std::uint32_t h, double most);
  bool collapse(std::uint32_t h);
  bool collapse_somewhere(std::uint32_t h);
  bool collapse_to(std::uint32_t h, Vec3d at, double shape_before);
  [[nodiscard]] std::optional<std::array<Range, 2>> heights_along(Vec3d at, Vec3d d) const noexcept;
  void adapt_growth(Fault fault);
  void merge(std::uint32_t h, Vec3d at);
  bool try_ends(Vec3d at, const Ends& ends);
  double lost_now();
  /// Calls visit(side, b, c) for the edges opposite the moved vertex in the trial's fresh faces, from end to end.
  template <typename Visit>
  void for_rim(Visit&& visit) const {
    for (std::size_t k = trial_.fresh; k < trial_.faces.size(); ++k)
      for (const Side side : {kInner, kOuter})
        visit(side, to_double(cage_.ends[trial_.faces[k][1]][side]), to_double(cage_.ends[trial_.faces[k][2]][side]));
  }
  [[nodiscard]] Direction star_direction(Vec3d at) const;
  [[nodiscard]] Vec3d seeing_place(Vec3d start) const;
  [[nodiscard]] Vec3d innermost(Vec3d start, Vec3d d) const;
  void improve(std::uint32_t v);
  void settle(std::uint32_t v);
  void even_out(std::uint32_t v);
  [[nodiscard]] bool folds_at_will() const noexcept { return tolerance_.folds >= 1; }
  void flip(std::uint32_t h);
  void lengthen(std::uint32_t v, double share);

  const OrderedSource& source_;
  double longest_;
  Tolerance tolerance_;                 // where some may be lost, lists hold no blocks
  bool may_lose_ = false;               // an edge is being merged for which nothing else is left
  bool thorough_ = false;               // each slab less is worth more work
  std::array<double, 2> growth_{1, 1};  // by Side: how much higher merged fibres start, as the last ones had to
  Box3d room_;
  CageDraft cage_;
  std::vector<std::uint8_t> fixed_;             // per vertex
  std::vector<std::uint16_t> valences_;         // per vertex
  std::vector<std::uint32_t> twins_, out_;      // per half-edge; per vertex one that leaves it
  std::vector<std::uint32_t> touched_, tried_;  // per vertex, per half-edge: when
  std::vector<std::uint32_t> stamps_, improved_, swept_;
  static constexpr std::uint32_t kAtFirst = 1;
  std::uint32_t clock_ = kAtFirst;
  std::size_t listed_ = 0, alive_ = 0, free_ = 0;
  std::size_t few_ = 0;       // at so many slabs or less more is tried
  std::size_t swept_to_ = 0;  // where the last sweep was to end
  std::vector<Candidate> queue_;
  bool queued_ = false;                          // merged vertices put their edges into the queue
  std::optional<BoxTree> boxes_;                 // around both sides of the slabs that stood when it was built
  std::vector<std::uint32_t> boxed_, place_of_;  // per box the face; per face its box
  std::vector<std::uint32_t> in_star_;           // per face: when it was last to be replaced

  // Scratch.
  Trial trial_;
  std::vector<Entry> union_;  // of the lists that a trial replaces
  std::vector<FourTriangles> pieces_;
  std::vector<std::uint32_t> spread_;  // per piece that is a block, where its triangles are; kNone: not yet asked for
  std::vector<std::array<FourTriangles, kBlock / 4>> spread_blocks_;  // the first of them in use
  std::uint32_t spread_count_ = 0;
  LatticePoint origin_;  // of the pieces
  Seen seen_;
  bool gathered_ = false, laid_out_ = false;
  std::optional<Direction> aim_;       // of the star that is gathered
  std::vector<double> areas_;          // of what is gathered, where some may be lost
  double area_ = 0;                    // of all that
  std::vector<std::uint8_t> met_;      // of what is gathered: whether it meets a slab of the trial
  std::optional<double> spare_;        // area that the trial may lose; none: nothing
  double lost_ = 0;                    // area that it does
  std::optional<double> lost_before_;  // area that is outside the slabs that it replaces
  std::vector<std::uint32_t> mark_;
  std::uint32_t mark_round_ = 0, star_round_ = 0;
  std::uint32_t hint_ = kNone;  // the triangle that failed last
  std::size_t failed_ = 0;      // the trial's slab that failed last
  std::vector<std::uint32_t> aimed_at_;
  std::vector<Vec3d> normals_;  // of the triangles aimed at
};

}  // namespace relief::detail
