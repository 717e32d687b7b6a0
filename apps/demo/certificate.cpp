#include "certificate.h"

#include <relief/core/plain_cage.h>
#include <relief/verify/verify.h>

#include <algorithm>

namespace relief::demo {

std::size_t failed_conditions(const Conversion& made) {
  const PlainCage cage(made.model.head->slab_mesh());
  const std::vector<Vec3d>& corners = made.mended.positions;
  const verify::Source source = {{corners.empty() ? nullptr : &corners.front().x, corners.size(), sizeof(Vec3d)},
                                 made.mended.triangles,
                                 made.mended.phantom_from};
  const verify::Certificate found = verify::check({cage.inner, cage.outer, cage.triangles}, source);
  return static_cast<std::size_t>(std::ranges::count(found.holds, false));
}

}  // namespace relief::demo
