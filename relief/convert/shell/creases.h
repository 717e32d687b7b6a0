// Sharp edges of a source with flat faces.
#pragma once

#include <relief/base/vec.h>
#include <relief/convert/geometry/box_tree.h>
#include <relief/convert/geometry/source_index.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace relief::detail {

/// The creases of a solid that was constructed: edges between faces that meet at 30 degrees or more, of which one at
/// least continues in a plane. A source of which less than half the area lies in such planes has none, as scans have
/// not. Places in lattice steps.
class Creases {
 public:
  /// `source` is only read here. One pass over its edges.
  explicit Creases(const SourceIndex& source);

  [[nodiscard]] bool empty() const noexcept { return edges_.empty(); }
  /// Returns whether a place lies on a crease, to the rounding of fibres.
  [[nodiscard]] bool hold(Vec3d place) const { return find(place, std::nullopt); }
  /// Returns whether a crease ends there: creases meet that do not go on in each other, or it goes on in none.
  [[nodiscard]] bool hold_corner(Vec3d place) const;
  /// Returns whether the whole way between two places lies on creases.
  [[nodiscard]] bool hold_edge(Vec3d from, Vec3d to) const;
  /// Returns whether nothing of them is lost where what stands in one place goes to another: a corner stays, and what
  /// is on a crease stays on it and on those in which it goes on.
  [[nodiscard]] bool allow(Vec3d from, Vec3d to) const;

 private:
  /// Returns whether a place lies on a crease that runs along a unit vector; none: on any.
  [[nodiscard]] bool find(Vec3d place, std::optional<Vec3d> along) const;
  /// Calls visit(number) with the edges at a place, until it returns false.
  template <typename Visit>
  void for_near(Vec3d place, Visit&& visit) const;
  /// Finds the chains and the corners. `ends`: numbers of the points between which each edge runs.
  void join(const std::vector<std::array<std::uint32_t, 2>>& ends);

  std::vector<std::array<Vec3d, 2>> edges_;
  std::vector<std::uint32_t> chains_;  ///< of each edge: the least number of those that go on in each other
  std::vector<Vec3d> corners_;
  std::optional<BoxTree> tree_, corner_tree_;
};

}  // namespace relief::detail
