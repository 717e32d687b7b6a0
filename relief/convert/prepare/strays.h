// What lies so far off that it alone would set the scale.
#pragma once

#include <relief/convert/convert.h>
#include <relief/mesh/triangle_mesh.h>

namespace relief::detail {

/// Leaves out components farther than ten diagonals from the box of the main ones: they would make the lattice and all
/// tolerances too coarse. The main ones are the largest that together have 99.9 % of the area. Where all lie near, the
/// mesh stays. O(n log n).
ConvertReport::Strays leave_out_strays(TriangleMesh& mesh);

}  // namespace relief::detail
