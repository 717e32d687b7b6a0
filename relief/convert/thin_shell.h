// The finest shell of all: one slab on every triangle of the source.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/box_tree.h>
#include <relief/convert/ordered_source.h>
#include <relief/convert/shell.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace relief::detail {

using Ends = std::array<LatticePoint, 2>;  ///< of a fibre, by Side

/// The least fibre half that the thin shell may have, lattice steps.
inline constexpr double kLeastHeight = 12;

struct ThinShell {
  std::vector<Ends> ends;             ///< per point of the source
  std::vector<std::uint32_t> faults;  ///< faces of the source that cannot be made valid, ascending
  std::optional<BoxTree> tree;        ///< over boxes that hold the slabs, in the order of the source's faces
};

/// Each fibre runs through its vertex in the direction that sees all the faces there, so C2, C6 and C7 hold by
/// construction; heights are halved where C1, C3 or C5 fail. Runs on all threads; the result does not depend on their
/// number. Without ends when cancelled.
[[nodiscard]] ThinShell make_thin_shell(const OrderedSource& source, double longest, const Progress& progress);

}  // namespace relief::detail
