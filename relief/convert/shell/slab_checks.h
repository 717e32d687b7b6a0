// Whether a change of a few slabs keeps a shell valid: local tests of C1, C2, C3, C5 and C6.
#pragma once

#include <relief/base/lanes.h>
#include <relief/convert/geometry/box_tree.h>
#include <relief/convert/shell/star.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace relief::detail {

/// Holds what fewer slabs may cost; never less than was allowed before.
struct Tolerance {
  double folds = 0;  ///< share of a slab's area in which the source may fold (C6); 0: nowhere, 1: as it likes
  double loss = 0;   ///< share of what the slabs around an edge hold of the source that its collapse may leave outside
                     ///< of them (C5), where nothing else collapses it; only with folds = 1
  [[nodiscard]] bool folds_at_will() const noexcept { return folds >= 1; }
};

/// Why a change is not possible.
enum class Fault : std::uint8_t {
  None,
  Winding,       ///< C2: the slabs do not run once around their fibre
  Jacobian,      ///< C1
  Outside,       ///< a slab leaves the room that the draft has
  Outer,         ///< C5: the source meets an outer triangle
  Inner,         ///< C5: the source meets an inner triangle
  Folded,        ///< C6: a fibre runs along the source or back through it
  Empty,         ///< a slab holds nothing of the source
  Lost,          ///< more of the source would be outside than may be
  OuterOverlap,  ///< C3, C4: an outer triangle meets another slab's
  InnerOverlap   ///< C3: an inner triangle does, or meets an outer one of the same change
};

/// Tests one change of a draft at a time: begin(), check() with other ends for the moving fibre as often as wanted,
/// then commit() after a check() without findings. Only new slabs are tested: the edge of a star stays, and with it C0,
/// C4 and C7 (docs/explanation/conversion.md). The draft must be the same from begin() to commit(); one thread.
class SlabChecks {
 public:
  /// `source` must outlive it; of one without triangles nothing is asked: C1, C2 and C3 alone are tested. Nothing new
  /// may leave the `room`.
  SlabChecks(const SourceIndex& source, const Box3d& room) : source_(source), room_(room) {}

  /// Builds the boxes that C3 looks into again, around all slabs.
  void build_boxes(const LinkedDraft& draft);
  [[nodiscard]] bool has_boxes() const noexcept { return boxes_.has_value(); }
  /// Returns whether a box lies strictly within the room.
  [[nodiscard]] bool is_within(const Box3d& box) const noexcept;

  /// From now on that much may be given up. Where some of the source may be lost, the draft's lists hold no clusters.
  void tolerate(const Tolerance& tolerance) noexcept { tolerance_ = tolerance; }
  [[nodiscard]] const Tolerance& tolerance() const noexcept { return tolerance_; }

  /// Begins another change, which the caller fills in. The second function returns the one in hand.
  [[nodiscard]] Star& begin() noexcept {
    gathered_ = false;
    return star_;
  }
  [[nodiscard]] const Star& star() const noexcept { return star_; }
  /// Returns what the slabs that the star replaces hold of the source, in the source's order.
  [[nodiscard]] std::span<const TriangleReference> held(const LinkedDraft& draft) {
    gather(draft);
    return held_;
  }

  /// Returns all tests of the change, cheap ones first, with these ends of the fibre that moves. `spare`: area of the
  /// source, square lattice steps, that may be lost; none: nothing.
  [[nodiscard]] Fault check(const LinkedDraft& draft, const Ends& ends, std::optional<double> spare = std::nullopt);
  /// Returns whether check() finds nothing. Quicker where it does: the slab that was met last is asked first.
  [[nodiscard]] bool passes(const LinkedDraft& draft, const Ends& ends, std::optional<double> spare = std::nullopt);
  /// Returns the ends last tested.
  [[nodiscard]] const Ends& ends() const noexcept { return ends_; }
  /// After Fault::Outer or Inner: whether the source's triangle that was met would not be, by the same slab and side,
  /// with another end of the fibre there.
  [[nodiscard]] bool would_clear(Side side, LatticePoint end) const noexcept;
  /// Area of what those slabs hold of the source, and of what of it is outside of them as they are; for tolerances with
  /// losses.
  [[nodiscard]] double held_area() const noexcept { return held_area_; }
  [[nodiscard]] double lost_now(const LinkedDraft& draft);

  /// Gives the change's lists and boxes to its faces; after a check() that found nothing. Faces, links and ends are the
  /// caller's, who changes them first.
  void commit(LinkedDraft& draft);

 private:
  using SideBoxes = std::array<FloatBox, 2>;
  using SideTriangles = std::array<LatticeTriangle, 2>;
  /// Four boxes side by side; those not set meet nothing.
  struct FourBoxes {
    std::array<Lanes, 3> low, high;
    FourBoxes() {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low[axis].of.fill(FloatBox{}.low[axis]);
        high[axis].of.fill(FloatBox{}.high[axis]);
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
    /// Returns which of those set have a corner in common with a face.
    [[nodiscard]] unsigned joined_to(const Face& face) const noexcept;
  };
  /// A set of references, by their codes.
  class CodeSet {
   public:
    /// Empty, for at most so many.
    void reset(std::size_t most);
    /// False when it was there.
    bool add(std::uint32_t code);
    [[nodiscard]] bool has(std::uint32_t code) const;

   private:
    struct Slot {
      std::uint32_t code = 0, round = 0;
    };
    [[nodiscard]] std::size_t first_slot(std::uint32_t code) const noexcept {
      return (code * 0x9e3779b1U >> 7U) & mask_;
    }
    std::vector<Slot> slots_;
    std::size_t mask_ = 0;
    std::uint32_t round_ = 0;
  };
  /// A triangle of another slab that one of the change has met.
  struct Rival {
    std::uint32_t slab = kNone;
    std::size_t shape = 0;
    Side mine = kInner, side = kInner;
  };
  /// The references of one new slab.
  struct Range {
    std::uint32_t begin = 0, count = 0;
  };

  void gather(const LinkedDraft& draft);
  void lay_out(const LinkedDraft& draft);
  [[nodiscard]] Fault check_itself(const LinkedDraft& draft, const Ends& ends, std::optional<double> spare);
  [[nodiscard]] Fault check_others(const LinkedDraft& draft);
  [[nodiscard]] bool meets_last_rival(const LinkedDraft& draft) const;
  [[nodiscard]] bool winds_once(const LinkedDraft& draft) const;
  [[nodiscard]] Fault make_shapes(const LinkedDraft& draft);
  [[nodiscard]] Fault check_last_culprit();
  [[nodiscard]] Fault check_overlap(const LinkedDraft& draft);
  [[nodiscard]] bool overlap_among_themselves() const;
  [[nodiscard]] Fault check_source();
  [[nodiscard]] Fault check_slab(std::size_t slab);
  [[nodiscard]] Fault check_cluster(const SlabShape& shape, const QuickShape& quick, std::size_t piece, bool is_within,
                                    double& spare_folds);
  [[nodiscard]] Fault judge(Meeting meeting, std::uint32_t triangle, double& spare_folds);
  void join_clusters(std::size_t begin);
  [[nodiscard]] static SideBoxes boxes_around(const SideTriangles& slab) noexcept;

  const SourceIndex& source_;
  Box3d room_;
  Tolerance tolerance_;

  // The boxes of all slabs.
  std::optional<BoxTree> boxes_;                 // around both sides of the slabs that stood when it was built
  std::vector<std::uint32_t> boxed_, place_of_;  // per box the face; per face its box
  std::vector<SideBoxes> side_boxes_;            // per box
  std::vector<std::uint32_t> replaced_in_;       // per face: the gathering in which it was last to be replaced
  std::uint32_t gathering_ = 0;

  // The change, and what check() leaves of it for commit().
  Star star_;
  Ends ends_;
  std::vector<SideTriangles> triangles_;  // of the fresh faces, as all that follows
  std::vector<SlabShape> shapes_;
  std::vector<FourFaces> fours_;
  std::vector<TriangleReference> lists_;
  std::vector<Range> ranges_;

  // What the slabs that it replaces hold.
  bool gathered_ = false, laid_out_ = false;
  std::vector<TriangleReference> held_;
  CodeSet codes_;
  std::vector<double> areas_;  // per held piece, where some may be lost
  double held_area_ = 0;
  LatticePoint origin_;                // of the pieces
  std::vector<FourTriangles> pieces_;  // the held ones, four by four
  std::vector<std::uint32_t> spread_;  // per piece that is a cluster, where its triangles are; kNone: not asked for yet
  std::vector<std::array<FourTriangles, kClusterSize / 4>> spread_clusters_;  // the first of them in use
  std::uint32_t spread_count_ = 0;

  // Result of the last check().
  std::uint32_t culprit_ = kNone;      // the triangle that failed
  std::size_t failed_ = 0;             // the new slab that did
  Rival rival_;                        // the triangle of another slab that was met
  std::optional<double> spare_;        // area that may be lost; none: nothing
  double lost_ = 0;                    // area that is
  std::vector<std::uint8_t> met_;      // per held piece: whether it meets a new slab, where some may be lost
  std::optional<double> lost_before_;  // area outside the slabs that are replaced
};

}  // namespace relief::detail
