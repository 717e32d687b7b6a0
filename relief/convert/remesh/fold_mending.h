// Takes out the folds of a fitted mesh.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/remesh/contour_fit.h>
#include <relief/convert/remesh/source_skin.h>

namespace relief::detail {

/// Flips or collapses an edge of each triangle that lies on the skin and looks against it, where this leaves triangles
/// that look the skin's way and lie as near to it. Closed stays closed. Says whether it changed something; folds that
/// no single step takes out stay. O(triangles).
bool mend_folds(FittedMesh& mesh, const Skin& skin, const Progress& progress);

}  // namespace relief::detail
