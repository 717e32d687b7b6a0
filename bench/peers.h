// Other ways to answer "which point of the surface is nearest, on which side of it are we, and what is the normal
// there": all on the same triangles.
#pragma once

#include <relief/core/tessellate.h>

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace relief::bench {

struct Nearest {
  Vec3d point;
  Vec3d normal;         ///< unit, interpolated
  double distance = 0;  ///< negative inside
};

/// One library with what it built over the surface, which must outlive it.
class Peer {
 public:
  virtual ~Peer() = default;
  /// `coherent`: the last answer may help to find this one, as from one tick to the next.
  [[nodiscard]] virtual Nearest nearest(Vec3d p, bool coherent) = 0;
  std::string name;
  double build_seconds = 0;  ///< CPU, all threads
  std::size_t bytes = 0;     ///< beyond the triangles
};

/// Embree's point query, bounded by the last answer where that is coherent; OpenVDB's signed distance field with 256
/// voxels along the diagonal, read by trilinear interpolation; CGAL's tree of triangles, with the last answer as hint.
[[nodiscard]] std::vector<std::unique_ptr<Peer>> make_peers(const Tessellation& surface);

}  // namespace relief::bench
