// The one ray query: where a straight segment first crosses the tessellated surface. It neither allocates nor locks.
#pragma once

#include <relief/core/micro_triangles.h>
#include <relief/core/query.h>
#include <relief/core/sample_bounds.h>

#include <array>
#include <cstdint>
#include <limits>
#include <optional>

namespace relief {

/// Which crossings of the surface count.
enum class Crossing {
  In,   ///< through a triangle's face, from outside
  Out,  ///< through a triangle's back
  Any
};

/// The first crossing of one straight segment. Watertight at samples, edges and borders between slabs of different n:
/// neighbouring triangles see each edge with opposite, exact signs (after Woop, Benthin and Wald 2013). Cost: a box
/// test for each node and slab on the way, and a few cells per slab whose samples may lie on it.
class Sweep {
 public:
  /// From `from` to `to`, both finite. Of the crossings that count it finds the first at a share of the way from 0 (or
  /// a billionth of the slab's size before it, for a place on the surface) to 1.
  Sweep(MicroTriangles& surface, Vec3d from, Vec3d to, Crossing kind) noexcept;

  /// Returns the first crossing; empty where there is none. Of crossings at the same share it is that of the lowest
  /// slab and its first triangle. So `first`, the slab to search first, changes only the time.
  [[nodiscard]] std::optional<SurfacePlace> run(SlabId first = kNoSlab) noexcept;
  /// After run(): the share of the way at which it crosses, 1 where it does not;
  [[nodiscard]] double share() const noexcept { return std::clamp(best_, 0.0, 1.0); }
  /// the slab that was searched last, which may hold the end of the way; kNoSlab where none was.
  [[nodiscard]] SlabId last_slab() const noexcept { return searched_; }

 private:
  /// A place on the way, and its coordinates in the slab in hand; they are mostly known.
  struct End {
    double t = 0;
    SlabCoord at;
    bool known = false;
  };
  /// Holds what the way comes to: a node of the tree, what a root or a part of one was cut into, a slab, or the part
  /// of the way that is in a slab.
  struct Ahead {
    enum What : std::uint8_t { Node, Cut, Slab, Part };
    double enter, leave;
    std::uint32_t number;
    What what;
  };
  /// How far the way may be from the straight line between two places on it, and the flat micro-triangles of a cell
  /// from alpha 0 to 1 from the slab's own: cells along the grid, and alpha.
  struct Bends {
    double way, way_alpha, cell, cell_alpha;
  };
  struct Course;
  struct Stretch;

  /// Returns the part of the way in the box, widened a little for rounding.
  [[nodiscard]] bool clip(const Box3d& box, double& enter, double& leave) const noexcept;
  void put(std::uint32_t number, Ahead::What what, const Box3d& box) noexcept;
  /// The nearest is the last. Where there is no more room it is gone over at once.
  void put(const Ahead& one) noexcept;
  void take(const Ahead& next) noexcept;
  void look_into(const SlabMesh::Node& node) noexcept;
  void look_into(const SlabMesh::Part& cut) noexcept;
  void put_root_part(std::uint32_t number) noexcept;
  void search(Ahead part) noexcept;
  [[nodiscard]] End end(const detail::LinearForm& form, double t, const SlabCoord& start) const noexcept;
  /// Returns bounds for the part of the way between two places with known coordinates; empty where the slab's shape
  /// changes too much around the middle of these for any to hold.
  [[nodiscard]] std::optional<Bends> bends(const detail::LinearForm& form, const End& a, const End& b,
                                           const SlabCoord& middle) const noexcept;
  /// One part of the way; halved until its course over the grid is nearly straight.
  void piece(const detail::LinearForm& form, const End& a, const End& b, int depth) noexcept;
  /// Finds the part of the segment where the slab's surface may be: between planes along the floor and ceiling of its
  /// samples, and along its walls. False where there is none.
  [[nodiscard]] bool clip_to_sides(double& enter, double& leave) const noexcept;
  [[nodiscard]] std::optional<Stretch> over(const Course& line, GridPoint at, int side,
                                            const SampleBounds::Between& heights, double overhang) const noexcept;
  /// Tests the triangles that the way may meet, block by block along it.
  void cells(const Course& line) noexcept;
  /// The cells of the slab in hand near the way, wherever that runs in its coordinates: what lies between two heights
  /// over a square is in the hull of eight corners. (Not so between sloping planes, where fibres lean.)
  void all_cells(double from, double to) noexcept;
  /// Calls look(level, first sample, side, bounds, overhang) for the squares of the slab in hand, from the whole to the
  /// smallest. Where it returns false, the square's parts are left out. Low columns come first unless bit 0 of
  /// `mirrored` is set, and low rows unless bit 1 is.
  template <typename Look>
  void squares(int mirrored, Look&& look) noexcept;
  /// The cell that stands on a grid point and the one to the right of it.
  void both(int i, int j, double low, double high) noexcept;
  void test(const std::array<GridPoint, 3>& corners, double low, double high) noexcept;
  /// Returns the weights of the place at which the line crosses a triangle, its corners relative to the start.
  [[nodiscard]] std::optional<std::array<double, 3>> crossed(Vec3d a, Vec3d b, Vec3d c) const noexcept;

  MicroTriangles& surface_;
  Crossing kind_;
  Vec3d from_, way_, per_way_;
  Vec3d low_from_, high_from_;  ///< as a box widened a little for rounding is asked about
  /// The frame in which the way is an axis: the axis along which it is longest, the next two in cyclic order, and how
  /// far along those it goes for each step along the first.
  std::size_t along_ = 0, first_ = 1, second_ = 2;
  double slope_first_ = 0, slope_second_ = 0;
  std::array<Ahead, 96> ahead_;
  std::size_t ahead_count_ = 0;
  SlabId slab_ = kNoSlab, searched_ = kNoSlab;
  SlabId done_ = kNoSlab;                   ///< was searched first
  bool whole_ = false;                      ///< the coordinates on the way are not known everywhere in the slab in hand
  std::array<double, 2> heights_ = {0, 1};  ///< least and greatest alpha of the slab in hand
  Bends bend_ = {};                         ///< of the part of the way in hand
  SlabCoord middle_ = {kNoSlab, 1.0 / 3, 1.0 / 3, 0.5};
  double best_ = 0;
  SurfacePlace found_;
};

/// Returns where the straight segment from `from` to `to` first goes in through the tessellated surface, and at which
/// share of the way; empty where it only leaves or misses. Exact on the micro-triangles near the way, also where it
/// leaves the slabs and enters them again.
[[nodiscard]] std::optional<RayHit> first_entry(const Snapshot& model, Vec3d from, Vec3d to) noexcept;

}  // namespace relief
