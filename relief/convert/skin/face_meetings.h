// Which faces of a source intersect others where they should not.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/geometry/box_tree.h>
#include <relief/convert/geometry/half_edges.h>
#include <relief/convert/geometry/lattice.h>

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace relief::detail {

/// Returns the numbers of the faces in an order that keeps neighbours together (Morton's).
[[nodiscard]] std::vector<std::uint32_t> order_in_space(std::span<const LatticePoint> points,
                                                        std::span<const Face> faces);

/// A box tree over triangles that brings them into an order which keeps neighbours together. The points and faces must
/// outlive it and stay as they are. Queries may run on many threads at once. 36 bytes a face.
class FaceTree {
 public:
  FaceTree(std::span<const LatticePoint> points, std::span<const Face> faces);

  [[nodiscard]] LatticeTriangle corners(std::uint32_t f) const noexcept {
    return {points_[faces_[f][0]], points_[faces_[f][1]], points_[faces_[f][2]]};
  }
  [[nodiscard]] Box3d box_of(std::uint32_t f) const noexcept;
  /// Calls visit(f) for each face whose box may meet the given one until it returns false, in an order that depends on
  /// the faces alone.
  template <typename Visit>
  void query(const Box3d& box, Visit&& visit) const {
    tree_.query(box, [&](std::uint32_t k) { return visit(order_[k]); });
  }
  /// Returns all faces in the order of the tree.
  [[nodiscard]] std::span<const std::uint32_t> order() const noexcept { return order_; }

 private:
  std::span<const LatticePoint> points_;
  std::span<const Face> faces_;
  std::vector<std::uint32_t> order_;
  BoxTree tree_;
};

/// Pairs of faces, the lower number first, ascending.
using FacePairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// Returns those with area that meet beyond common corners and edges, by place and not by number, or lie on each other.
/// Some of them when cancelled. O(n log n + pairs), on all threads.
[[nodiscard]] FacePairs find_meetings(const FaceTree& tree, const Progress& progress);

}  // namespace relief::detail
