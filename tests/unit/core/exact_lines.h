// Where straight lines meet the micro-triangles of a model, one after another: decided in exact numbers of CGAL, with
// no tree of slabs and no bounds of samples.
#pragma once

#include <relief/core/snapshot.h>

#include <array>
#include <cstddef>
#include <vector>

namespace relief::testing {

/// All micro-triangles of a model: stitched, and without holes.
class ExactTriangles {
 public:
  explicit ExactTriangles(const Snapshot& model);

  /// Triangles that the line meets at one place.
  struct Meeting {
    double share = 0;     ///< of the way from `from` to `to`
    int in = 0, out = 0;  ///< through their faces, and through their backs
  };
  /// Along the segment, in order. A triangle counts with its edges and corners, exactly; those that are met within
  /// `hair` (model units) of each other are one meeting.
  [[nodiscard]] std::vector<Meeting> meetings(Vec3d from, Vec3d to, double hair) const;
  /// Whether triangles within `hair` of a place face both ways as seen along `way`, or edge-on: there rounding decides
  /// whether a line meets them.
  [[nodiscard]] bool is_outline(Vec3d place, Vec3d way, double hair) const;

  [[nodiscard]] std::size_t size() const noexcept { return triangles_.size(); }

 private:
  using Corners = std::array<Vec3d, 3>;
  /// Some triangles that follow each other.
  struct Group {
    Vec3d centre;
    double radius = 0;
    std::size_t first = 0, last = 0;
  };
  /// Calls visit(triangle) for those that may come within `hair` of the line.
  template <typename Visit>
  void each_near(Vec3d from, Vec3d way, double hair, Visit&& visit) const;

  std::vector<Corners> triangles_;
  std::vector<Group> groups_;
};

}  // namespace relief::testing
