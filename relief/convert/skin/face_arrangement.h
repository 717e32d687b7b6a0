// The faces of a source cut where they meet.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/geometry/exact_point.h>
#include <relief/convert/geometry/half_edges.h>
#include <relief/convert/skin/face_meetings.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace relief::detail {

/// A piece of surface without its rim: all pieces are disjoint and have only whole edges and corners in common.
struct Piece {
  Face corners;             ///< points of the arrangement
  std::uint32_t from = 0;   ///< the face given that it is, or is cut from; its plane and its sense
  std::int32_t sheets = 1;  ///< faces that lie here and look this way, less such as look the other way
};

/// Faces cut along all edges and points in which they meet, without rounding. Points at identical coordinates are one.
/// Faces without area are gone.
struct FaceArrangement {
  std::span<const LatticePoint> given;
  std::vector<ExactPoint> made;  ///< points, numbered on from those given
  std::vector<Piece> pieces;     ///< ascending by `from`
  std::size_t cut = 0;           ///< faces that are cut
  std::size_t coincident = 0;    ///< pieces on which others lie that are left out

  [[nodiscard]] bool is_given(std::uint32_t v) const noexcept { return v < given.size(); }
  [[nodiscard]] ExactPoint point(std::uint32_t v) const noexcept {
    return is_given(v) ? ExactPoint::at(given[v]) : made[v - given.size()];
  }
  [[nodiscard]] Vec3d approximate(std::uint32_t v) const noexcept {
    return is_given(v) ? to_double(given[v]) : made[v - given.size()].approximate();
  }
  /// Returns the area of a piece, square lattice steps.
  [[nodiscard]] double area(std::uint32_t p) const noexcept {
    const Face& t = pieces[p].corners;
    const Vec3d a = approximate(t[0]);
    return length(cross(approximate(t[1]) - a, approximate(t[2]) - a)) / 2;
  }
  [[nodiscard]] LatticePoint nearest(std::uint32_t v) const noexcept {
    return is_given(v) ? given[v] : made[v - given.size()].nearest();
  }
};

/// `meetings`: all of them. The points must outlive the result. Nothing when cancelled. Costs what the faces do that
/// meet, except for a pass over all. Deterministic, on all threads.
[[nodiscard]] std::optional<FaceArrangement> arrange(std::span<const LatticePoint> points, std::span<const Face> faces,
                                                     const FacePairs& meetings, const Progress& progress);

}  // namespace relief::detail
