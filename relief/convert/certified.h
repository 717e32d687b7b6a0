// Certified slabs: a thin shell on the source itself, made coarse by steps of which each keeps every condition.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/decimate.h>
#include <relief/convert/lattice.h>
#include <relief/convert/shell.h>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace relief::detail {

struct CertifiedSettings {
  std::size_t target = 200;  ///< slabs; more remain where no step that keeps the conditions is left
  double longest = 0;        ///< longest fibre, lattice steps
  double farthest = 0;       ///< how far a source vertex may be moved to mend it, lattice steps
};

struct CertifiedShell {
  Shell shell;                       ///< empty when there is none
  std::vector<LatticePoint> points;  ///< the source as it was certified: some points are moved
  std::size_t moved_points = 0;
  double moved_most = 0;  ///< lattice steps
  std::string obstacle;   ///< why there is no shell; a clause that follows the place
  LatticePoint place;
};

/// For closed sources on the lattice. Vertices that no direction sees, and those around faces that meet others, are
/// smoothed within bounds; then K = S with short fibres is a shell that satisfies C0 to C3, C5, C6 and C7 of shell.md,
/// and edges are collapsed, ends moved and edges flipped as long as all of them stay (shell.md 11). Deterministic; one
/// thread. Cancelled: neither shell nor obstacle.
[[nodiscard]] CertifiedShell build_certified(std::vector<LatticePoint> points, std::span<const Face> faces,
                                             const CertifiedSettings& settings, const Progress& progress);

}  // namespace relief::detail
