// From a triangle soup to an oriented manifold, with a report of what was done.
#pragma once

#include <relief/base/error.h>
#include <relief/base/progress.h>
#include <relief/mesh/triangle_mesh.h>

#include <cstddef>
#include <string>

namespace relief {

/// Holds what repair() found and did, in counts.
struct RepairReport {
  std::size_t welded_vertices = 0;  ///< vertices merged with one at the same position
  std::size_t sewn_vertices = 0;    ///< of open edges, merged with such of edges that lie along them all but exactly
  double sewn_most = 0;             ///< how far these were moved at most, share of the diagonal
  std::size_t unused_vertices = 0;  ///< vertices dropped because no triangle names them
  std::size_t degenerate_triangles = 0;  ///< dropped: repeated corner, or no area
  std::size_t duplicate_triangles = 0;   ///< dropped: the same three corners as another; a face that solids share
                                         ///< stays, once for each of them
  std::size_t flipped_triangles = 0;     ///< no area, but closing a gap: its longest edge was flipped, so nothing opens
  std::size_t nonfinite_triangles = 0;   ///< dropped: a corner is infinite or not a number
  std::size_t turned_triangles = 0;      ///< turned round so that neighbours agree
  std::size_t turned_parts = 0;          ///< closed parts turned because they were inside out
  std::size_t split_edges = 0;           ///< edges with more than two triangles, cut apart
  std::size_t split_vertices = 0;        ///< vertices with more than one fan, duplicated
  std::size_t cut_seams = 0;             ///< edges cut because the part could not be oriented (Moebius strip)
  std::size_t parts = 0;                 ///< connected components of the result
  std::size_t boundary_loops = 0;        ///< open rims of the result
  std::size_t corners_on_edges = 0;  ///< vertices of rims that lie on other edges of rims, between their ends, where
                                     ///< sheets lie along each other without common corners
};

/// A mesh after its repair.
struct Repaired {
  TriangleMesh
      mesh;  ///< every edge in one or two triangles that run through it in opposite directions; one fan per vertex
  RepairReport report;  ///< what was done
};

/// Welds equal positions, and open edges to those that lie along them within 1e-6 of the diagonal and 10 % of the
/// shortest edge around, one to one, drops what has no area, makes the mesh manifold by splitting, orients every part
/// (closed ones outwards, nested shells of a solid keep the cavity sense), keeps colours of vertices and the unit, not
/// materials. Deterministic. O(n log n). Closed parts inside others keep their sense: one that looks into the solid
/// around it is a cavity and stays so, unless that solid itself was inside out; then all inside it turns with it.
/// Coinciding vertices take the colour of the first. Errors: Corrupt when no triangle with area is left; Cancelled.
[[nodiscard]] Result<Repaired> repair(const TriangleMesh& soup, const Progress& progress = {});

/// Returns one line per kind of repair that was made; empty for a clean mesh.
[[nodiscard]] std::string to_string(const RepairReport& report);

}  // namespace relief
