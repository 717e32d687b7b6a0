// Slabs that follow the creases of a source.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/shell/creases.h>
#include <relief/convert/shell/patch.h>

#include <cstddef>

namespace relief::detail {

/// Makes slabs follow the creases that their edges lie on. A wall is a ruled surface between two fibres: a straight
/// crease lies in it where it cuts both at the same share of their length. So the free fibres that creases join are
/// made to stand out by the same share, as far as the local checks allow. `tree`: of boxes around the source's
/// triangles. Returns how many edges of slabs lie on creases. Cost: a few tests per fibre there.
std::size_t level_creases(ShellPatch& patch, const Creases& creases, const BoxTree& tree, const Progress& progress);

}  // namespace relief::detail
