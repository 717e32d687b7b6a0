// Ways over the tessellated surface: downhill on the distance to a goal, from triangle to triangle, never through one.
#pragma once

#include <relief/core/micro_triangles.h>

#include <limits>

namespace relief::detail {

inline constexpr double kAnywhere = std::numeric_limits<double>::infinity();
inline constexpr int kTries = 64;  ///< micro-triangles that one walk looks at

[[nodiscard]] inline double distance2(Vec3d a, Vec3d b) noexcept { return dot(a - b, a - b); }

/// Moves a place over the surface towards the goal, by `reach` at most (model units), triangle by triangle, as long as
/// each step comes nearer. In a triangle the way to its point nearest to the goal is straight and the distance falls
/// all along it; where all triangles that touch the place give the place itself, it is a minimum on the surface around.
/// Returns the way's length. `tries` counts the triangles that it looks at down to 0, where it stops.
double walk(MicroTriangles& surface, SurfacePlace& place, Vec3d goal, double reach, int& tries) noexcept;

/// Where a walk of any length from a place would come to rest.
struct Descent {
  SurfacePlace rest;
  double way = 0;      ///< length of the walk
  bool ended = false;  ///< it comes to rest at `rest`; else there was no time to see where
};
[[nodiscard]] Descent descend(MicroTriangles& surface, const SurfacePlace& from, Vec3d goal) noexcept;
/// Moves a place along a descent from it, by `reach` at most.
void follow(MicroTriangles& surface, SurfacePlace& place, const Descent& descent, Vec3d goal, double reach) noexcept;

/// A hair above a place and below it, on its fibre.
[[nodiscard]] Vec3d above(MicroTriangles& surface, const SurfacePlace& place) noexcept;
[[nodiscard]] Vec3d below(MicroTriangles& surface, const SurfacePlace& place) noexcept;
/// Whether the straight way from a place to the goal leads off the surface at once: into the air, or past an open edge.
[[nodiscard]] bool leads_into_air(MicroTriangles& surface, const SurfacePlace& place, Vec3d goal) noexcept;

}  // namespace relief::detail
