// From a closed source to one on which a shell can stand.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/geometry/box_tree.h>
#include <relief/convert/geometry/shell.h>
#include <relief/convert/geometry/source_index.h>
#include <relief/convert/prepare/closed_source.h>
#include <relief/convert/prepare/defects.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace relief::detail {

/// Faces, or pairs of them, in which a source of so many may meet itself and is smoothed there: half a percent, and a
/// few of a small one. Where there are more, its outer skin is taken.
[[nodiscard]] constexpr std::size_t few_to_smooth(std::size_t faces) noexcept { return 200 + faces / 200; }

/// How much patches may replace: share of a source's area, and of its scanned faces where there are many.
inline constexpr double kMostReplaced = 0.03;

/// Lengths in lattice steps.
struct PrepareLimits {
  double longest = 0;    ///< fibre that the shell may have
  double farthest = 0;   ///< how far a source vertex may be moved; four times as far where sheets are pushed apart and
                         ///< less does not do
  double apart = 0;      ///< how far points that coincide are moved off each other at most
  bool creased = false;  ///< surfaces were cut where they cross: fibres stay longer in the sharp creases there
  double speck = 0;      ///< components no wider than this that have defects are named, and nothing is cut out of them
};

/// Holds what was changed. Lengths in lattice steps.
struct Repairs {
  std::size_t split_vertices = 0;    ///< with very many triangles around them, which rings divide now
  std::size_t truncated_spikes = 0;  ///< vertices whose faces no direction saw and whose edges are long
  std::size_t parted_points = 0;     ///< that lay on others and were moved off them; counted among the moved ones
  std::size_t moved_points = 0;
  double moved_most = 0;
  std::size_t replaced_faces = 0;       ///< that were scanned and were cut out; patches took their place
  double replaced_widest = 0;           ///< the widest hole that this made at once
  LatticePoint replaced_place;          ///< in the middle of it
  std::size_t vanished_components = 0;  ///< that were cut out as a whole
};

/// The finest shell, of one slab on every face, and the source in the order in which it stands there.
struct InitialStand {
  SourceIndex source;
  std::vector<Ends> ends;         ///< of the fibre through each point
  std::unique_ptr<BoxTree> tree;  ///< over the slabs
};

struct Prepared {
  ClosedSource source;                ///< the points given come first; of no use where nothing stands on it
  std::optional<InitialStand> stand;  ///< none with an obstacle or tiny components, and when cancelled
  Repairs repairs;
  std::vector<std::uint32_t> bad_faces;  ///< of those given, on which no shell stood at first
  std::optional<Obstacle> obstacle;      ///< why nothing stands
  std::vector<Obstacle> bad_components;  ///< what each has that nothing stood on at first; at most kMostBadComponents
  std::vector<Obstacle> specks;          ///< all components that stand in the way and are mere tiny components
};
inline constexpr std::size_t kMostBadComponents = 20;

/// Finds the defects of a source and gives them the cheapest remedy of their kinds that may still help, until a shell
/// with short fibres stands that satisfies C0 to C3 and C5 to C7 (docs/explanation/conversion.md). Remedies, the
/// cheapest first: move coincident points, smooth, cut out and patch small places, push sheets apart, cut out and
/// patch what is left, leave needles as they are, truncate spikes. High valences are split before. It stops where only
/// tiny components are in the way. Deterministic.
[[nodiscard]] Prepared prepare(ClosedSource source, const PrepareLimits& limits, const Progress& progress);

}  // namespace relief::detail
