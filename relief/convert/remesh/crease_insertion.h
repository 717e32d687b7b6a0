// Puts vertices on the edges and corners of the skin that the triangles of a fitted mesh cut off.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/remesh/contour_fit.h>
#include <relief/convert/remesh/source_skin.h>

namespace relief::detail {

/// Puts creases of the skin into the mesh: an edge that leads from one face of the skin to another is split at their
/// edge or corner, or its end moves there. Creases count above 25 degrees where they are cut off by more than rounding
/// between flat faces, or by more than 5 % of a voxel. Closed stays closed. Skin within the solid is skipped. False
/// when cancelled.
[[nodiscard]] bool insert_creases(FittedMesh& mesh, const HermiteGrid& grid, const Skin& skin,
                                  const Progress& progress);

}  // namespace relief::detail
