// Other fibres for the same surface: what tools ask of whoever makes cages, and what they get.
#pragma once

#include <relief/base/error.h>
#include <relief/base/progress.h>
#include <relief/core/snapshot.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <ranges>
#include <vector>

namespace relief {

/// All within `radius` of the segment from a to b; model units.
struct Capsule {
  /// its ends, model units
  Vec3d a, b;
  double radius = 0;  ///< its radius, model units
  /// Unit, from the surface towards where the tool comes from: slabs whose fibres point away from it stay as they are,
  /// as the tools leave them. Zero: a slab is meant where its surface lies in the capsule.
  Vec3d axis = {};
};

/// Holds what a stroke takes away and what it fills: fibres are to reach beyond both.
struct RoomWanted {
  /// where material will be taken away, and where it will be added
  std::vector<Capsule> cut, fill;
  /// Returns whether nothing is asked for.
  [[nodiscard]] bool empty() const noexcept { return cut.empty() && fill.empty(); }
};

/// Says what stands in a stroke's way, where the stroke goes deepest into that. Lines from the surface tell, along the
/// stroke's axis as a rule, for twice as far as it wants to go and some 10 % more: each side has about half of what
/// lies between, and fades out over the last of it.
enum class RoomBar : std::uint8_t {
  None,       ///< nothing is lacking
  FarSide,    ///< of a cut: the line leaves the form; slabs cannot have holes
  OtherPart,  ///< of a filling: the line enters the form again, in another part or beyond a hollow
  Fibres,     ///< no line meets anything: the fibres there have no space, or would meet the surface twice
};

/// A slab whose samples were taken anew, on fibres that have moved. Samples stand between fibres of its root: bit k of
/// a number is that at its corner k.
struct SampledAnew {
  SlabId slab = kNoSlab;   ///< which slab
  std::uint8_t moved = 7;  ///< the fibres that have moved: samples between others stay as they were
  /// How many fibres of samples meet the surface several times, or just beyond an end, by what they stand between; of
  /// samples that slabs share, the first has it.
  std::array<std::size_t, 8> folded = {};

  /// Takes over from an earlier time what stayed.
  void come_after(const SampledAnew& earlier) noexcept {
    for (std::size_t between = 0; between < folded.size(); ++between)
      if ((between & moved) == 0) folded[between] = earlier.folded[between];
  }
};

/// Returns the folded samples of all slabs of a range.
template <std::ranges::input_range Slabs>
[[nodiscard]] std::size_t folded_in(Slabs&& slabs) noexcept {
  std::size_t sum = 0;
  for (const SampledAnew& slab : slabs)
    for (const std::size_t samples : slab.folded) sum += samples;
  return sum;
}

/// Roots of a cage that were halved so that fibres between them can move, and what that does to the numbers of slabs: a
/// half keeps that of its root, the others follow the last root, and what was cut from roots comes after them.
struct HalvedRoots {
  SlabId first = 0;             ///< number of the first root that is new
  SlabId added = 0;             ///< how many are; 0: none was halved
  std::vector<SlabId> numbers;  ///< of those that were halved, ascending

  /// Returns the number that a slab of before has now; kNoSlab where it was halved.
  [[nodiscard]] SlabId now(SlabId before) const noexcept {
    if (std::ranges::binary_search(numbers, before)) return kNoSlab;
    return before >= first ? before + added : before;
  }
};

/// The same surface on a cage whose fibres were moved, certified again. Slabs keep their numbers but for `halved`,
/// those beside which no fibre was moved their tiles, too.
struct Room {
  SnapshotPtr model = {};       ///< null where no fibre could be moved
  std::size_t fibres = 0;       ///< that were moved
  std::size_t lacking = 0;      ///< that still do not reach as far as was wanted
  double surface_moved = 0;     ///< the farthest that the surface moved, model units
  RoomBar bar = RoomBar::None;  ///< why those do not
  double bar_distance = 0;      ///< from bar_at along RoomBar's line to what it meets, model units; 0 for Fibres
  /// The surface where that line begins, model units; for Fibres where most is lacking. Zero where nothing bars the
  /// way.
  Vec3d bar_at = {};
  /// An undercut, which slabs cannot hold: how far beside the surface the stroke goes under it, model units. Tools cut
  /// all that is between. 0 where it is below kLeastOverhang.
  double overhang = 0;
  Vec3d overhang_at = {};                         ///< the surface at the undercut, model units; zero without one
  std::vector<SampledAnew> sampled = {};          ///< all slabs beside a moved fibre
  HalvedRoots halved = {};                        ///< the roots that had to be, for fibres to move
  static constexpr double kLeastOverhang = 1e-3;  ///< of the diagonal: what a place may miss the tool by untold
};

/// Makes room. Called on a thread of its own or on that of the edits, never on a servo's; takes 0.1 s and
/// more. Errors: Cancelled, and what its maker says.
using RoomMaker = std::function<Result<Room>(const SnapshotPtr& surface, const RoomWanted& wanted, const Progress&)>;

}  // namespace relief
