// How far the fibres of a finished shell reach: the clay that tools find below the surface and the room above it.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/shell/patch.h>

namespace relief::detail {

/// Lengthens the free fibres of a patch towards a goal on each side, the one that lacks most first. Those that fall
/// short are turned and moved with their neighbours, and lengthened again. The rest of ShellPatch::longest() goes to
/// whatever can use it. All local checks hold throughout. Cost: about 20 tests per free fibre, and a tree over the
/// source. False when cancelled; what was done stays.
bool lengthen_to_goals(ShellPatch& patch, const Progress& progress);

}  // namespace relief::detail
