// Other libraries that answer "which point of the surface is nearest, on which side of it are we, and what is the
// normal there": all on the same triangles.
#pragma once

#include "contestant.h"

#include <memory>
#include <vector>

namespace relief::bench {

/// Each in two rows: as a program uses it that follows the library's own example, and at its best.
/// Embree: point queries on triangles in single precision, in a tree of high build quality; best: no farther than the
/// last answer. OpenVDB: a signed distance field with 256 voxels along the diagonal, 6 voxels to either side; seven
/// trilinear samples; best: value and gradient from the eight voxels of one stencil, which stays while the cell is the
/// same. CGAL: a tree of triangles with its own tree of hints (accelerate_distance_queries); best: the last answer as
/// hint. The surface must outlive them.
[[nodiscard]] std::vector<std::unique_ptr<Contestant>> make_peers(const Tessellation& surface);

}  // namespace relief::bench
