// Ways over the tessellated surface: downhill on the distance to a goal, from triangle to triangle, never through one.
#pragma once

#include <relief/core/micro_triangles.h>
#include <relief/haptics/contact/principle.h>

#include <array>
#include <limits>

namespace relief::detail {

inline constexpr double kAnywhere = std::numeric_limits<double>::infinity();
/// Micro-triangles that one walk looks at: four times the most in 160,000 ticks of slides over scans.
inline constexpr int kTries = 64;

/// Returns a place's weights such that what is all but on an edge or at a sample is there, to the bit: so it is seen
/// that the triangles beside it touch it, too.
[[nodiscard]] std::array<double, 3> on_edges(std::array<double, 3> weights) noexcept;

/// Moves a place over the surface towards the goal, triangle by triangle, by `reach` at most (model units), while each
/// step comes nearer: the way on which the distance falls fastest, straight in each triangle. It ends at a
/// minimum: the triangles around give the place itself. Returns the length of the path. `tries` counts the triangles
/// down; the walk stops at 0.
double walk(MicroTriangles& surface, SurfacePlace& place, Vec3d goal, double reach, int& tries) noexcept;

/// Says where a walk of any length from a place would come to rest.
struct Descent {
  SurfacePlace rest;
  double way = 0;      ///< length of the walk
  bool ended = false;  ///< it comes to rest at `rest`; else there was no time to see where
};
[[nodiscard]] Descent descend(MicroTriangles& surface, const SurfacePlace& from, Vec3d goal) noexcept;
/// Moves a place along a descent from it, by `reach` at most.
void follow(MicroTriangles& surface, SurfacePlace& place, const Descent& descent, Vec3d goal, double reach) noexcept;

/// Returns a hair above a place and below it, on its fibre.
[[nodiscard]] Vec3d above(MicroTriangles& surface, const SurfacePlace& place) noexcept;
[[nodiscard]] Vec3d below(MicroTriangles& surface, const SurfacePlace& place) noexcept;
/// Returns whether the straight segment from a place to the goal leads off the surface at once: into the air, or past
/// an open edge.
[[nodiscard]] bool leads_into_air(MicroTriangles& surface, const SurfacePlace& place, Vec3d goal) noexcept;

}  // namespace relief::detail
