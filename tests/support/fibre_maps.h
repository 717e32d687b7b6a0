// Maps for mapped_shell(): where the ends of a round shell's fibres go.
#pragma once

#include <relief/base/vec.h>

#include <cmath>

namespace relief::testing {

/// Turns about z by `tangent` times the height over the unit sphere: so fibres at the equator lean by that tangent, and
/// the sphere stays.
inline auto leaning(double tangent) {
  return [tangent](Vec3d p) {
    const double turn = tangent * (length(p) - 1);
    return Vec3d{p.x * std::cos(turn) - p.y * std::sin(turn), p.x * std::sin(turn) + p.y * std::cos(turn), p.z};
  };
}

/// Turns all about an axis on which no fibre of an octahedron made round stands.
inline Vec3d turned_askew(Vec3d p) {
  const Vec3d q = {0.8 * p.x - 0.6 * p.y, 0.6 * p.x + 0.8 * p.y, p.z};
  return {q.x, 0.8 * q.y - 0.6 * q.z, 0.6 * q.y + 0.8 * q.z};
}

}  // namespace relief::testing
