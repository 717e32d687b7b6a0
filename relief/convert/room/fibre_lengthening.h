// Fibres that reach further where solids want it, under the local checks of the shell.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/geometry/lattice.h>
#include <relief/convert/room.h>
#include <relief/convert/sample/sampled_model.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace relief::detail {

/// Share of the diagonal: the place of the surface is known only so well (the usual error), and a tool that keeps so
/// far away misses nothing.
inline constexpr double kNegligible = kUsualError;

/// Holds what was made of the fibres, and the lattice on which it was tested.
struct Lengthened {
  Lattice lattice;
  std::vector<MovedFibre> moved;  ///< ascending
  std::vector<RoomLack> before, after;
  std::size_t lengthened = 0, turned = 0;
  /// The widest overhang.
  struct Overhang {
    double wide = 0;  ///< as RoomMade::overhang_after
    Vec3d at;         ///< where the surface lies there
  };
  Overhang overhang_before, overhang_after;
  /// What is wanted below the surface and above it, and what lies between it and solids beside it: summed over places
  /// that are as dense as the samples, model units.
  double lack_before = 0, lack_after = 0;
  bool on_lattice = true;
  bool is_sound = true;  ///< false: the slabs around an untested fibre fail a check as they are
};
/// Fibres that may not do all, ascending.
struct Restrained {
  std::vector<FibreId> straight;  ///< may be made longer, but not turned
  std::vector<FibreId> staying;   ///< must stay as they are

  /// What has failed must not turn, and must stay when it fails once more.
  void add(std::span<const FibreId> failed);
};
/// Says what fibres do first.
enum class RoomWay : std::uint8_t {
  Grow,    ///< they grow, and turn where that does not do
  Shrink,  ///< they become as short as the surface lets them, so that they can turn; then they grow
};
/// `untested`: fibres that are new, ascending; the slabs around them are tested before all. Cancelled: of no use.
[[nodiscard]] Lengthened lengthen_for(const Snapshot& surface, const RoomWanted& wanted, const RoomGoals& goals,
                                      RoomWay way, const Restrained& restrained, std::span<const FibreId> untested,
                                      const Progress& progress);

/// Returns the exponent of the lowest bit that is set in an end of one of the fibres: they lie on multiples of that
/// power of two. Empty where all ends are the origin.
[[nodiscard]] std::optional<int> lowest_bit_of(std::span<const Fibre> fibres) noexcept;
/// Returns a lattice on which all ends of the cage's fibres lie, around a box and `room` more on all sides. Empty where
/// the box would have over 2^25 steps, or the cage 2^30.
[[nodiscard]] std::optional<Lattice> lattice_of(const SlabMesh& mesh, const Box3d& box, double room);

}  // namespace relief::detail
