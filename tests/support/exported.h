// The displaced surface of a model as the program exports it.
#pragma once

#include "support/bare_triangles.h"

#include <relief/core/tessellate.h>

namespace relief::testing {

[[nodiscard]] inline BareTriangles bare_triangles(const Snapshot& model) {
  const Tessellation surface = tessellate(model);
  return {surface.positions, surface.triangles};
}

}  // namespace relief::testing
