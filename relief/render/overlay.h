// What is drawn over the model: the hand as small solids, the scale of the heat map as pixels.
#pragma once

#include "picture.h"
#include "studio.h"

#include <relief/base/vec.h>

#include <array>
#include <vector>

namespace relief::detail {

/// Returns the way from the stylus's tip to its end, unit, for a surface that faces `out`: 50 degrees off it, so
/// outside a solid that is not hollow there, like the hand of a right-handed user, and in the picture clear of an arrow
/// along `out`. `to_eye` is the direction from the tip to the eye; both unit.
[[nodiscard]] Vec3d stylus_lean(Vec3d out, const Eye& eye, Vec3d to_eye);

/// A corner of a solid; position relative to the display cache's centre.
struct SolidVertex {
  Vec3f position, normal, colour;
};
/// Triangles, counter-clockwise from outside.
struct Solids {
  std::vector<SolidVertex> opaque;       ///< cursor, stylus, force arrow
  std::vector<SolidVertex> translucent;  ///< tool sphere
  Box3d bounds;
};
/// Sizes follow the picture: `view_height` is the height of what the camera sees at the cursor, model units. A force of
/// 3.3 N or more gives an arrow of a fifth of it, a weak one of a twenty-fifth, so that it is seen beside the tip.
[[nodiscard]] Solids make_solids(const HandOverlay& hand, Vec3d centre, const Eye& eye, double view_height);

}  // namespace relief::detail
