// What each mode may give up, and what it stands on then.
#pragma once

#include <relief/base/error.h>
#include <relief/base/progress.h>
#include <relief/convert/convert.h>
#include <relief/convert/geometry/lattice.h>
#include <relief/convert/remesh/remesh.h>
#include <relief/convert/support/paged.h>
#include <relief/core/slab_mesh.h>
#include <relief/mesh/triangle_mesh.h>

#include <cstddef>
#include <functional>
#include <memory>

namespace relief::detail {

/// The surface that slabs stand on: the repaired source, or closed and mended for its shell.
struct Ground {
  Paged<TriangleMesh> mesh;      ///< fill triangles come last
  std::size_t phantom_from = 0;  ///< the first of them
  Lattice lattice;
  double scanned_area = 0;  ///< of the source as scanned: repaired, without fill, not remeshed; square model units
  bool tolerant = false;    ///< the shell may fold in a small share of the area
};

/// Takes down what winding leaves open (its `area`, and a place of it), as a share of the source's `scanned` area.
/// Less than ConvertReport::Undecided::kTold is not taken down, nor what is less than there is already.
void add_undecided(ConvertReport& report, double area, Vec3d near, double scanned);

/// Of the longest fibre: so long they may be while slabs are made, and so far the lattice reaches beyond the source.
/// Longer ones stand in each other's way where a body is thin, and neither error nor count gains.
inline constexpr double kWhileMade = 0.5;

/// Gives the repaired source once more, made again as a solid or not, where that was requested: it is not kept beside
/// what is worked on.
using RepairedAgain = std::function<Result<TriangleMesh>(bool remeshed)>;

/// Puts a solid made again in the place of the repaired source. `share`: the edge of a voxel of its diagonal, 0:
/// chosen.
Status remesh_source(TriangleMesh& mended, double share, Follow follow, const StageSink& show, ConvertReport& report,
                     const Progress& progress);

/// Returns the cage in certified mode and the source that it is certified against, in place of the repaired one.
/// Without a certificate both stay, and the report has the reason (a clause); cancelled, there is no reason.
/// `most_lost`: share of the source's area that a tolerant shell may leave out.
[[nodiscard]] std::shared_ptr<const SlabMesh> certify(Ground& ground, const ConvertSettings& settings, double diagonal,
                                                      double most_lost, ConvertReport& report,
                                                      const Progress& progress);

/// Returns the cage in tolerant mode, with no more slabs than the target. Where slabs on the source cannot be as few,
/// they stand on a solid whose voxels grow until they are. The last solid may miss more of the source. Where none is
/// small enough, the slabs on the source stay, or those on the first solid.
[[nodiscard]] std::shared_ptr<const SlabMesh> tolerate(Ground& ground, const RepairedAgain& repaired,
                                                       const ConvertSettings& settings, double diagonal,
                                                       ConvertReport& report, const Progress& progress);

/// Returns the cage on the finest smooth solid that has a certificate, with as many slabs as that takes. For a source
/// without a certificate when no mode was requested.
[[nodiscard]] std::shared_ptr<const SlabMesh> stand_on_a_solid(Ground& ground, const RepairedAgain& repaired,
                                                               const ConvertSettings& settings, double diagonal,
                                                               ConvertReport& report, const Progress& progress);

}  // namespace relief::detail
