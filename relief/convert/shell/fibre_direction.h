// In which direction a fibre points.
#pragma once

#include <relief/convert/geometry/visibility.h>
#include <relief/convert/shell/star.h>

#include <span>
#include <vector>

namespace relief::detail {

/// Says how a star sees the source in it.
struct SourceView {
  std::vector<Vec3d> normals;  ///< unit normals of the triangles that limit what is seen
  Direction best;              ///< the direction that sees them best

  /// Returns the least normal . d over them: the visibility of the direction d.
  [[nodiscard]] double visibility(Vec3d d) const noexcept;
};
/// Of at most 1,500 of the triangles, evenly chosen, those on the outside of the set of normals: 13 at most. A proposal
/// only; the local checks decide. O(triangles).
[[nodiscard]] SourceView view_of_source(const SourceIndex& source, std::span<const TriangleReference> references);

/// Returns the direction that best sees the triangles between a place and the edges of a link, of both sides: a fibre
/// there must have such a direction (C1), whatever the source is like. O(edges).
[[nodiscard]] Direction star_direction(std::span<const LinkEdge> link, Vec3d at);

/// Returns the place that, seen along the unit vector d, lies as far as possible to the left of all edges of the link,
/// nearly; `start` where there is none.
[[nodiscard]] Vec3d innermost(std::span<const LinkEdge> link, Vec3d start, Vec3d d);

/// Returns a place where star_direction() sees as much as can be found: by turns the best direction for a place, and
/// the innermost place for a direction. No worse than `start`.
[[nodiscard]] Vec3d seeing_place(std::span<const LinkEdge> link, Vec3d start);

}  // namespace relief::detail
