// Space cut into cells that hold about as much each.
#pragma once

#include <relief/base/vec.h>
#include <relief/convert/geometry/box_tree.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

/// Cut across the longest side, again and again, until no cell holds more than its share of the given points.
class KdPartition {
 public:
  /// At most `most` points to a cell. A cut leaves `share` of the points, 0..1, on its lower side. Reorders the points.
  KdPartition(std::span<Vec3d> points, std::size_t most, double share) {
    cut(points, everywhere(), std::max<std::size_t>(most, 1), share);
  }

  [[nodiscard]] std::size_t count() const noexcept { return boxes_.size(); }
  [[nodiscard]] const Box3d& box(std::size_t cell) const noexcept { return boxes_[cell]; }
  /// Calls visit(cell) for each cell that the box meets, faces included.
  template <typename Visit>
  void for_each(const Box3d& box, Visit&& visit) const {
    descend(0, box, visit);
  }

 private:
  struct Node {
    double at = 0;
    std::uint32_t axis = 3;    // 3: a cell
    std::uint32_t number = 0;  // of the cell, or of the upper child; the lower one is next
  };

  void cut(std::span<Vec3d> points, const Box3d& space, std::size_t most, double share) {
    const std::size_t self = nodes_.size();
    nodes_.emplace_back();
    Box3d box;
    for (const Vec3d p : points) box.add(p);
    const Vec3d e = box.extent();
    const std::uint32_t axis = e.x >= e.y && e.x >= e.z ? 0 : e.y >= e.z ? 1 : 2;
    if (points.size() <= most || !(e[axis] > 0)) {
      nodes_[self].number = static_cast<std::uint32_t>(boxes_.size());
      boxes_.push_back(space);
      return;
    }
    const auto middle = std::max<std::size_t>(1, static_cast<std::size_t>(share * static_cast<double>(points.size())));
    std::nth_element(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(middle), points.end(),
                     [&](Vec3d a, Vec3d b) { return a[axis] < b[axis]; });
    const double at = points[middle][axis];
    Box3d lower = space, upper = space;
    lower.high[axis] = upper.low[axis] = at;
    nodes_[self] = {at, axis, 0};
    cut(points.first(middle), lower, most, share);
    nodes_[self].number = static_cast<std::uint32_t>(nodes_.size());
    cut(points.subspan(middle), upper, most, share);
  }
  template <typename Visit>
  void descend(std::uint32_t at, const Box3d& box, Visit& visit) const {
    const Node& node = nodes_[at];
    if (node.axis == 3) return visit(node.number);
    if (box.low[node.axis] <= node.at) descend(at + 1, box, visit);
    if (box.high[node.axis] >= node.at) descend(node.number, box, visit);
  }

  std::vector<Node> nodes_;
  std::vector<Box3d> boxes_;  // by cell; what lies at the outside is open
};

}  // namespace relief::detail
