// The independent check of a shell and of the source inside it: exact, on plain arrays, sharing no code with the
// builder.
#pragma once

#include <relief/base/progress.h>
#include <relief/base/triples.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace relief::verify {

/// A shell as plain numbers: fibre i runs from inner[i] to outer[i]; each triangle names three fibres,
/// counter-clockwise seen from outside.
struct Shell {
  /// ends of the fibres, model units
  Triples<double> inner, outer;
  Triples<std::uint32_t> triangles;  ///< the slabs, as three fibres each
};

/// The surface that the slabs are to hold: the mended source, or a clean original. Triangles counter-clockwise seen
/// from outside; positions that no triangle names are ignored.
struct Source {
  Triples<double> positions;         ///< corners, model units
  Triples<std::uint32_t> triangles;  ///< three corners each
  /// The triangles from here on close openings of what was scanned; nothing where that is not known.
  std::optional<std::size_t> phantom_from = std::nullopt;
};

/// The conditions. Without a source, C0: an oriented manifold complex, no repeated triangle, inner != outer. C1: the
/// Jacobian is positive in every closed slab. C2: the inner triangles around each fibre, seen along it, wind exactly
/// once. C3: inner and outer triangles are pairwise disjoint unless they share a corner. C4: no part contains another.
/// With a source, C5: its triangles keep a distance of two lattice steps from every inner and outer triangle. C6: every
/// fibre that meets it leaves through its front, and its triangles wind once around each of its vertices. C7: it is
/// closed, one fibre of each part of the shell meets it exactly once, and each part of it is met by exactly one of
/// these fibres. All eight together: every fibre meets the source exactly once, and nothing of the source is missed.
enum class Condition : std::uint8_t { C0, C1, C2, C3, C4, C5, C6, C7 };
inline constexpr std::size_t kConditionCount = 8;
inline constexpr std::size_t kShellConditionCount = 5;  ///< C0 to C4
[[nodiscard]] std::string_view name(Condition condition) noexcept;

inline constexpr std::uint32_t kNothing = 0xffffffffU;

/// Says where a condition fails. C0, C1, C3, C4: a and b are slabs, b = a where there is only one, both kNothing where
/// no slab is to blame. C2: a is the fibre. C5, C6: a is the slab, or kNothing where the source itself is at fault; b
/// is the source triangle. C7: a is a slab of the part and b is kNothing, or a is kNothing and b a triangle of the
/// source.
struct Failure {
  Condition condition;  ///< which of C0 to C7
  /// the slabs or fibres that break it
  std::uint32_t a = 0, b = 0;
  std::string what;  ///< one sentence
};

/// Holds what was found of each condition.
struct Certificate {
  std::array<bool, kConditionCount> holds{};  ///< by condition; false also when it could not be tested (below)
  std::array<std::size_t, kConditionCount> failure_count{};  ///< failures per condition
  std::array<bool, kConditionCount> at_least{};  ///< there may be more than were counted: C3, C5, C6 beyond 10 000
  std::vector<Failure> failures;                 ///< the first 100 of each condition
  std::vector<std::uint8_t> failed;              ///< by slab: bit k says that condition k fails there; see failing()
  bool on_lattice = false;                       ///< coordinates were exact lattice points, so the verdict is exact
  bool with_source = false;                      ///< C5 to C7 were asked for
  double lattice_step = 0;                       ///< model units; of the lattice on which shell and source were judged
  double source_moved = 0;       ///< model units; how far the furthest source vertex lay from that lattice
  std::size_t source_parts = 0;  ///< components of the source

  /// Returns how many of the conditions were asked for: 5 or 8.
  [[nodiscard]] std::size_t asked() const noexcept { return with_source ? kConditionCount : kShellConditionCount; }
  /// Returns whether every condition holds.
  [[nodiscard]] bool all() const noexcept {
    for (std::size_t k = 0; k < asked(); ++k)
      if (!holds[k]) return false;
    return true;
  }
  /// Returns whether a slab fails a condition.
  [[nodiscard]] bool fails(Condition condition, std::size_t slab) const noexcept {
    return (failed[slab] >> static_cast<unsigned>(condition) & 1U) != 0;
  }
  /// Returns all slabs in which a condition fails, in rising order, however many failures are listed. C2: those around
  /// the fibre. The volumes of C3, C4, C7: all slabs of the parts. What only the source is at fault for is in no slab.
  [[nodiscard]] std::vector<std::uint32_t> failing(Condition condition) const;
};

/// Exact where all coordinates are multiples of one power of two that spans at most 2^30 steps (what convert writes);
/// other shells fail C0 with a sentence saying so. Errors of the shell are findings, never exceptions. O(slabs log
/// slabs). Nothing else is tested where C0 fails, C2 not at fibres of slabs that fail C1, C3 not for triangles without
/// area, C4 not where C3 fails. At open edges the curved walls of the boundary are not tested: C3 speaks of the
/// triangles only. Cancelled: what could not be tested any more does not hold.
[[nodiscard]] Certificate check(const Shell& shell, const Progress& progress = {});

/// C0 to C4 as above, then C5 to C7. Shell and source are judged on the coarsest lattice of 2^20 steps or more that
/// holds both. A source that fits none of at most 2^30 steps is moved to the nearest points of the finest that holds
/// the shell, by less than a step per coordinate: C5's margin covers this, and C6 is then shown for every surface
/// within that reach, so that the verdict holds for the source as it is. C6 never passes what is wrong; it may refuse
/// what is right where a triangle leans away from some fibres of a slab and lies in the convex hull of a quarter of
/// their length, or within 2^-7 steps of it. Nothing of this is tested where C0 fails. Parts of the shell with open
/// edges fail C7: what passes through their walls is not looked at.
/// About 1 microsecond per source triangle. Cancelled: what could not be tested any more does not hold.
[[nodiscard]] Certificate check(const Shell& shell, const Source& source, const Progress& progress = {});

/// The displacement of one slab: (n+1)(n+2)/2 values, row by row, row j holding the samples (0..n-j, j), which lie at
/// the barycentric weights (n-i-j, i, j)/n. Without values, but with its n: not to be looked at.
struct SampleTile {
  int intervals = 0;              ///< n, along each edge
  std::span<const float> values;  ///< the samples
};

/// What a slab's samples on an edge must be where the slab beyond it is coarser and lacks them: linear between the two
/// that it has, in double and rounded once to float, or the value of the nearer, of two alike the first, counted from
/// corner k+1 to corner k+2 along the edge opposite corner k.
enum class Between : std::uint8_t { Linear, Nearer };

/// Says how the tiles fit each other.
struct TileFailure {
  std::uint32_t slab = 0, sample = 0;  ///< the number in its tile; kNothing where the tile as a whole is at fault
  std::string what;                    ///< one sentence
};
/// Holds what was found of the tiles.
struct TileCheck {
  std::size_t failure_count = 0;      ///< samples that are not what they must be
  std::vector<TileFailure> failures;  ///< the first 100
  std::vector<std::uint32_t> slabs;   ///< all that fail, in rising order
};

/// Told of each slab whose values were read, so that its caller may take them out of memory until they are read again.
using WasRead = std::function<void(std::uint32_t slab)>;

/// Tests that all values lie in 0..1, that slabs which share an edge differ in n by a power of two only, that the
/// copies of shared samples are equal to the last bit, and that samples between them are what they must be. The shell
/// must pass C0. Copies are not tested where a tile has the wrong size or a value out of range.
[[nodiscard]] TileCheck check_tiles(const Shell& shell, std::span<const SampleTile> tiles, Between between,
                                    const WasRead& was_read = {});

/// Returns the same of slabs that were cut: the tiles are those of `pieces`, whose edges may hang in the middle of
/// others. A piece with two across an edge has an even n, at most twice theirs. Where no edge of the roots is open,
/// none of the pieces may be. The roots must pass C0; whether the pieces are theirs is not asked.
[[nodiscard]] TileCheck check_tiles(const Shell& roots, const Shell& pieces, std::span<const SampleTile> tiles,
                                    Between between, const WasRead& was_read = {});

/// Says how the samples fit the source. Copies of shared samples count each.
struct SampleCheck {
  std::size_t tested = 0;  ///< fibres that were tested
  std::size_t off = 0;     ///< not where the fibre meets it, or wrongly marked
  /// how often the fibres meet the source
  std::size_t single = 0, none = 0, several = 0;
  bool at_least = false;  ///< beyond 10 000 that are off, a slab was left at its first: all numbers may be higher
  double worst = 0;       ///< model units; greatest distance of a sample from where its fibre meets the source
  std::vector<Failure> failures;     ///< the first 100 that are off: a is the slab, b the number in its tile
  std::vector<std::uint32_t> slabs;  ///< all that have one that is off, in rising order
};

/// Holds what samples say of themselves beside where they are, as tiles like theirs: above 1/2 where it is so. Without
/// tiles none does.
struct SampleMarks {
  std::span<const SampleTile> voids;   ///< there is no surface: an opening was closed
  std::span<const SampleTile> folded;  ///< the fibre does not meet the source exactly once
};

/// Compares each sample with the places where its fibre meets the source, within `tolerance` (model units, along the
/// fibre), except for those on edges that a coarser neighbour lacks (see Between). In doubles. The shell must pass C0;
/// tiles of the wrong size and values out of 0..1 are off.
///
/// Samples may be those of the source with its vertices rounded to the lattice of the shell, that is moved by at most
/// half a step per coordinate. Along a fibre that grazes a triangle this is any distance, so where the source is not on
/// that lattice, a sample also counts as right within sqrt(3)/2 steps of the source (and the rounding of a float along
/// its fibre), in whatever direction.
///
/// With marks, a void sample must lie on a triangle that closes an opening, any other on one that does not; where its
/// fibre passes within 2^-8 lattice steps of the rim between them, or meets both within the tolerance, it may be
/// either. Where the source does not say which triangles close openings, all samples on one triangle must agree, and a
/// void one may meet nothing. A folded sample's fibre must meet the source twice or more, or nowhere leave it, and then
/// the sample may lie anywhere; that of any other must not both enter and leave it at places further apart than the
/// tolerance. Cancelled: the samples that are left are not tested.
[[nodiscard]] SampleCheck check_samples(const Shell& shell, const Source& source, std::span<const SampleTile> tiles,
                                        double tolerance, const std::optional<SampleMarks>& marks = std::nullopt,
                                        const Progress& progress = {});

}  // namespace relief::verify
