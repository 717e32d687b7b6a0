// Gives the vertices of a dual contour their places on the skin.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/remesh/dual_contouring.h>

#include <cstdint>
#include <vector>

namespace relief::detail {

/// A closed triangle mesh in voxel coordinates, with what is known of its vertices.
struct FittedMesh {
  /// Where a vertex lies: across a hole; off the skin, where it would have folded the surface; or on the skin, in a
  /// face, an edge or a corner.
  enum class Fit : std::uint8_t { Hole, Moved, OnFace, OnEdge, OnCorner };
  std::vector<Vec3d> positions;
  std::vector<Vec3f> normals;  ///< unit, of the skin; at an edge or in a corner that of one of the faces
  std::vector<Fit> fits;
  /// By vertex: which passes over the mesh have to look at it again. A pass that changes something sets all, and its
  /// own as well, around what it changed.
  static constexpr std::uint8_t kSeekCreases = 1, kSeekFolds = 2, kSeekAll = 3;
  std::vector<std::uint8_t> pending;
  std::vector<Triangle> triangles;
};

/// What a surface made again follows.
enum class Follow : std::uint8_t {
  Skin,   ///< vertices lie on the source's skin, in its corners and on its sharp edges
  Middle  ///< vertices lie in the middle of where the grid's edges cross the skin: smooth, so that a shell stands on it
};

/// Moves each vertex to the corner or edge that the planes of the skin at its crossings share, where that lies in its
/// cell and on the skin. Others go to the place of the skin nearest to the middle of their crossings; where that folds
/// the surface, towards this middle. Cuts quadrilaterals along the diagonal on the skin. Empty when cancelled. About 25
/// microseconds per vertex.
[[nodiscard]] FittedMesh fit(const DualContour& contour, const HermiteGrid& grid, const Skin& skin, Follow follow,
                             const Progress& progress);

}  // namespace relief::detail
