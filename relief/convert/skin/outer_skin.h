// Parts that overlap, touch or lie in each other, and parts that cross themselves, as one closed surface.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/prepare/source_editor.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace relief::detail {

/// Holds what there is for outer_skin() to do.
struct Overlaps {
  std::size_t between = 0;  ///< pairs of faces of different parts that meet beyond common corners and edges
  std::size_t within = 0;   ///< such pairs of one part
  std::size_t patched = 0;  ///< such pairs of which a face was made to close something; not among those above
  std::size_t nested = 0;   ///< parts that meet no other and lie in the solid of another
  std::uint32_t first = 0;  ///< a face of one of the pairs, where there are some
};
/// Nothing when cancelled. A box tree's pass over the faces.
[[nodiscard]] std::optional<Overlaps> find_overlaps(const ClosedSource& source, const Progress& progress);

/// The boundary of what the faces of a source wind around, the outer skin of the union of its parts.
struct OuterSkin {
  enum class Fault : std::uint8_t {
    None,
    Empty,  ///< the faces wind around nothing
    Open    ///< the faces have a rim that nothing closes
  };
  Fault fault = Fault::None;
  LatticePoint place;  ///< of the fault

  ClosedSource source;  ///< an oriented manifold, one fan to a point
  /// Per face the given one that it is or is cut from, or one of those that lie there; it has its patch and fill.
  std::vector<std::uint32_t> from;
  std::size_t turned = 0;      ///< parts that were inside out
  std::size_t cut = 0;         ///< faces given of which parts are left
  std::size_t dropped = 0;     ///< faces given of which nothing is left
  std::size_t coincident = 0;  ///< pieces of faces that lay on others
  std::size_t repaired = 0;    ///< points moved, besides rounding, where slivers and crossings had to go
  std::size_t slivers = 0;     ///< parts of the skin that were left out because they were too thin for that
  double moved_most = 0;       ///< lattice steps, from where the points are without rounding
  std::size_t crossing = 0;    ///< pairs of faces that still cross after that
  double undecided = 0;        ///< area, square lattice steps, that counts as inside because winding does not decide
                               ///< about it; without fill
  LatticePoint undecided_at;   ///< a corner of it, where there is some
};

/// Returns the source's own faces that have the solid on one side (winding number above one half) and nothing on the
/// other. Faces are cut where they meet, by exact predicates; all others stay. New points are rounded to the lattice.
/// Empty when cancelled. Deterministic.
[[nodiscard]] std::optional<OuterSkin> outer_skin(const ClosedSource& source, const Progress& progress);

}  // namespace relief::detail
