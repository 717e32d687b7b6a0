// Slivers and crossings that cutting and rounding leave in a skin.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/geometry/half_edges.h>
#include <relief/convert/geometry/lattice.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace relief::detail {

/// A closed oriented manifold whose points were rounded.
struct SkinDraft {
  std::vector<LatticePoint> points;
  std::vector<Vec3d> exact;        ///< per point: where it lies without rounding
  std::vector<std::uint8_t> made;  ///< per point: by a cut; all others stay where they are
  std::vector<Face> faces;
  std::vector<std::uint32_t> from;  ///< per face: the given face whose plane it lies in
  std::vector<Vec3d> normals;       ///< per face: of that plane, outwards, unit length
  std::vector<std::uint8_t> piece;  ///< per face: it is not a whole one
};

struct SkinRepairs {
  std::size_t repaired = 0;  ///< points that were moved or joined to others, and edges that were flipped
  double moved_most = 0;     ///< lattice steps: how far the surface is from where it was without rounding
  std::size_t slivers = 0;   ///< connected parts so thin that they were left out
  std::size_t crossing = 0;  ///< pieces that still cross others
};

/// Reduces faces thinner than `thin`, and crossing and folded pieces, by joining points, flipping edges and moving made
/// points. The surface moves no farther than `farthest` lattice steps, given points 10 % of that; made points go
/// anywhere along the planes around them. Components thinner than `thin` go. Cost: the pieces, and a box tree over all
/// faces. Deterministic. Cancelled: as far as it got.
SkinRepairs repair_skin(SkinDraft& draft, double thin, double farthest, const Progress& progress);

}  // namespace relief::detail
