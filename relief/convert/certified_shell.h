// Certified slabs: a thin shell on the source itself, made coarse by steps of which each keeps every condition.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/geometry/shell.h>
#include <relief/convert/prepare/prepare.h>
#include <relief/convert/shell/coarsening.h>

#include <cstddef>
#include <span>

namespace relief::detail {

struct CertifiedSettings {
  std::size_t target = 200;   ///< slabs; more remain where no step that keeps the conditions is left
  PrepareLimits limits = {};  ///< its longest fibre is that of the slabs while they are made
  double longest = 0;         ///< fibre in the end, lattice steps
  /// What may be given up, one after the other, as long as the target is not reached; all other conditions stay
  /// (docs/explanation/conversion.md). Where nothing is lost, each fibre still crosses the source once more to the
  /// front than to the back.
  std::span<const Tolerance> tolerances = {};
  double most_lost = 0;  ///< share of the source's area that may lie in no slab; where the target takes more, nothing
                         ///< is lost, and more slabs remain
  bool pages = false;    ///< what is only needed in the end lies in a temporary file meanwhile
};

struct CertifiedShell {
  Shell shell;            ///< empty when there is none
  bool tolerant = false;  ///< C6, and C5 where some was lost, do not hold throughout: a tolerance was made use of
  Prepared prepared;      ///< what the shell stands on, or why there is none; its stand has become the shell
};

/// Prepares the source. Then K = S with short fibres is a shell that satisfies C0 to C3, C5, C6 and C7
/// (docs/explanation/conversion.md), and
/// edges are collapsed, ends moved and edges flipped as long as all of them stay. Deterministic.
/// Cancelled: neither shell nor obstacle.
[[nodiscard]] CertifiedShell build_certified(ClosedSource source, const CertifiedSettings& settings,
                                             const Progress& progress);

}  // namespace relief::detail
