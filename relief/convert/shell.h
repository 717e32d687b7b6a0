// Depths along the fibres at which a base mesh becomes a valid shell.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/decimate.h>
#include <relief/convert/lattice.h>

#include <array>
#include <cstddef>
#include <vector>

namespace relief::detail {

/// Which end of a fibre, or which of a slab's two triangles.
using Side = std::size_t;
inline constexpr Side kInner = 0, kOuter = 1;

/// What the depths are to be, in lattice steps, and along which unit direction, per base point.
struct Fibres {
  std::vector<Vec3d> directions;
  std::array<std::vector<double>, 2> wanted;  ///< by Side
};

/// A shell that satisfies, exactly, C1 (positive Jacobian), C2 (one turn around each fibre), C3 (inner and outer
/// triangles disjoint, volumes of one sign) and C4 (no part within the shell of another) of shell.md.
struct Shell {
  std::array<std::vector<LatticePoint>, 2> ends;  ///< by Side, per fibre
  std::vector<Face> faces;
  std::vector<std::uint32_t> from;     ///< per slab, its base face
  std::vector<std::uint32_t> dropped;  ///< base faces left out because they meet others or cannot be thickened
};

/// Starts from the wanted depths, shrinks them where a condition fails until all hold, then grows what was shrunk too
/// far. Base faces that fail at the least depth (they meet one another) are left out, so closed parts are opened there
/// only. Deterministic. Empty when cancelled or when nothing remains.
[[nodiscard]] Shell build_shell(const BaseMesh& base, const Fibres& fibres, const Progress& progress);

/// Per base point: max-min direction over its faces.
[[nodiscard]] std::vector<Vec3d> vertex_directions(const BaseMesh& base);

/// Per face the number of its connected part (parts joined by a vertex count as one), and how many parts there are.
/// Faces whose corners are no points are gone; their number is 0.
struct Parts {
  std::vector<std::uint32_t> of_face;
  std::uint32_t count = 0;
};
[[nodiscard]] Parts find_parts(std::size_t point_count, const std::vector<Face>& faces);

}  // namespace relief::detail
