// How much of what can be seen of a source a surface has.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/convert.h>
#include <relief/convert/geometry/lattice.h>
#include <relief/convert/sample/source_rays.h>
#include <relief/mesh/triangle_mesh.h>

#include <cstddef>
#include <functional>
#include <vector>

namespace relief::detail {

/// A piece of a source's surface.
struct SourcePlace {
  Vec3d at, normal;  ///< model units; unit length, zero where its triangle has no area
};

inline constexpr std::size_t kPlaces = 12'000;  ///< tells shares of 1e-3 to a third of that

/// kPlaces places, spread evenly over the area.
[[nodiscard]] std::vector<SourcePlace> places_of(const TriangleMesh& source);

/// Returns the corners of its triangles, each a little inside of one of them: there it has a side.
[[nodiscard]] std::vector<SourcePlace> corners_of(const TriangleMesh& source);

/// What places are held against.
struct CoveredBy {
  const TriangleMesh& solid;  ///< the closed surface that slabs stand on
  const SourceRays& rays;     ///< its triangles
  const Lattice& lattice;
  double diagonal;  ///< of the source, model units
  /// Whether a place is missing, told also how far it lies from the solid, share of the diagonal. On all threads.
  std::function<bool(const SourcePlace&, double away)> is_missing;
};

/// Says which places are missing. A place that lies off the solid and inside of it is not asked for: nobody sees it
/// there. It is inside where the generalised winding number is above one half on both sides. `farthest` is from the
/// solid. Runs on all threads.
[[nodiscard]] ConvertReport::Coverage measure_coverage(const std::vector<SourcePlace>& places, const CoveredBy& by,
                                                       const Progress& progress);

}  // namespace relief::detail
