// Certified slabs: a thin shell on the source itself, made coarse by steps of which each keeps every condition.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/decimate.h>
#include <relief/convert/lattice.h>
#include <relief/convert/mend.h>
#include <relief/convert/shell.h>
#include <relief/convert/slab_reducer.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace relief::detail {

struct CertifiedSettings {
  std::size_t target = 200;  ///< slabs; more remain where no step that keeps the conditions is left
  double longest = 0;        ///< longest fibre, lattice steps
  double farthest = 0;  ///< how far a source vertex may be moved to mend it, lattice steps; four times as far where
                        ///< sheets are pushed apart and less does not do
  double speck = 0;     ///< parts no wider than this that have no thin shell are named and nothing is cut out of them;
                        ///< lattice steps
  /// What may be given up, one after the other, as long as the target is not reached; all other conditions stay
  /// (shell.md 14). Where nothing is lost, each fibre still crosses the source once more to the front than to the back.
  std::span<const Tolerance> tolerances = {};
  double most_lost = 0;    ///< share of the source's area that may lie in no slab; where the target takes more, nothing
                           ///< is lost, and more slabs remain
  bool lay_aside = false;  ///< what is only needed in the end lies in a temporary file meanwhile
};

/// A connected part of the source, by its first face, that has no thin shell, and why: a clause.
struct PartObstacle {
  std::uint32_t part = 0;
  LatticePoint place;
  std::string reason;
};

struct CertifiedShell {
  Shell shell;            ///< empty when there is none
  bool tolerant = false;  ///< C6, and C5 where some was lost, do not hold throughout: a tolerance was made use of
  ClosedSource source;    ///< as it was certified, or as far as it was mended: the points given come first
  std::size_t divided_fans = 0;    ///< around vertices with very many triangles
  std::size_t blunted_points = 0;  ///< whose faces no direction saw and whose edges are long: their tips were cut off
  std::size_t moved_points = 0;
  double moved_most = 0;           ///< lattice steps
  std::size_t parted_points = 0;   ///< that lay on others and were moved off them; counted among the moved ones
  std::size_t replaced_faces = 0;  ///< where others met, hardly a direction saw them or they folded, and around there;
                                   ///< patches took their place
  double replaced_widest = 0;      ///< the widest hole that this made at once, lattice steps
  LatticePoint replaced_place;     ///< in the middle of it
  std::size_t vanished_parts = 0;  ///< that were cut out as a whole
  std::vector<std::uint32_t> bad_faces;  ///< of those given, where no thin shell stood at first
  std::string obstacle;                  ///< why there is no shell; a clause that follows the place
  LatticePoint place;
  std::vector<PartObstacle> bad_parts;  ///< the first of them, at most kMostBadParts
  std::vector<PartObstacle> specks;     ///< all parts that stand in the way and are mere specks; no shell then
};
inline constexpr std::size_t kMostBadParts = 20;

/// Mends the source: very large fans are divided, points that lie on others are moved off them, vertices that no
/// direction sees and those around faces that meet others are smoothed within bounds, and what still fails is cut out
/// and closed with patches, as long as that is a small share of the surface; but where specks are in the way, it stops
/// with these. Where that fails, sheets that meet are pushed apart instead, and less is cut out. Then K = S with short
/// fibres is a shell that satisfies C0 to C3, C5, C6 and C7 of shell.md, and edges are collapsed, ends moved and edges
/// flipped as long as all of them stay (shell.md 11). Deterministic. Cancelled: neither shell nor obstacle.
[[nodiscard]] CertifiedShell build_certified(ClosedSource source, const CertifiedSettings& settings,
                                             const Progress& progress);

}  // namespace relief::detail
