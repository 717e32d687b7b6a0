// Ways of the cursor over a surface, and what is right on them.
#pragma once

#include <relief/core/tessellate.h>
#include <relief/render/picture.h>

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace relief::bench {

/// The surface of a model, which must outlive it.
struct Surface {
  const Snapshot& model;
  Box3d box = surface_bounds(model);
  double size = diagonal(box);  ///< the diagonal, to which shares refer
};

/// The answer to "which point of the surface is nearest, on which side of it are we, and what is the normal there".
struct Nearest {
  Vec3d point;
  Vec3d normal;         ///< unit, interpolated
  bool inside = false;  ///< below the surface
  [[nodiscard]] double distance_from(Vec3d p) const noexcept { return length(p - point); }
};

/// The answer whose nearest point lies on this triangle of the surface.
[[nodiscard]] Nearest nearest_on(const Tessellation& surface, const std::array<std::uint32_t, 3>& triangle, Vec3d p);

/// Cursors, one per frame.
struct Way {
  /// The nearest point of the tessellation to one of the cursors.
  struct Truth {
    std::size_t frame;
    Nearest nearest;
  };
  std::string name;
  bool coherent = true;  ///< from frame to frame the cursor moves as a hand does
  std::vector<Vec3d> cursors;
  std::size_t section = 0;         ///< so many frames are one section; the next one begins elsewhere
  std::vector<Vec3d> ups;          ///< the surface's unit normal where each section begins
  std::vector<Truth> truths = {};  ///< by frame

  [[nodiscard]] bool begins_at(std::size_t frame) const noexcept { return frame % section == 0; }
};

/// A way `depth` below the surface, at `step` per frame, shares of the model's diagonal: along the places below a great
/// turn around the model, again and again.
[[nodiscard]] Way slide(const Surface& surface, double depth, double step, int count);

/// Four ways of so many frames. Slide: 0.5 % of the diagonal deep, 1e-4 of the diagonal per frame, which at 1 kHz is
/// 0.1 diagonals a second. Tap: in to 1 % and out again in a tenth of a second, each time elsewhere. Press: 1 % deep,
/// leaning to and fro, each tenth of a second elsewhere. Jump: within 0.5 % of the surface, each frame elsewhere.
[[nodiscard]] std::vector<Way> make_ways(const Surface& surface, int frames);
/// The ways that a hand can go.
inline constexpr std::size_t kHandWays = 3;

/// Finds the nearest points to some `each` cursors of each way among all triangles of the surface, one after the other.
void find_truths(const Tessellation& surface, std::size_t each, std::vector<Way>& ways);

}  // namespace relief::bench
