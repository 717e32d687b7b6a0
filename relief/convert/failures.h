// What fails in a conversion, a remesh, a refinement and a room: a kind and its facts go in, a finished error comes
// out.
#pragma once

#include <relief/base/error.h>
#include <relief/convert/convert.h>
#include <relief/core/snapshot.h>
#include <relief/verify/verify.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

namespace relief::detail {

/// Says what of the settings has a range.
enum class Setting : std::uint8_t { Slabs, Intervals, Error, ColourIntervals, Voxel, Thickness };
/// From the least to the most that a setting may be.
struct Range {
  double least, most;
  [[nodiscard]] bool holds(double value) const noexcept { return value >= least && value <= most; }
};
/// A setting lies outside its range. Intervals and voxels may be 0, too, which need not lie in it. InvalidArgument.
[[nodiscard]] std::unexpected<Error> outside_range(Setting setting, double value, Range range);

/// Says what was going on when somebody cancelled.
enum class Work : std::uint8_t { Conversion, Remesh, Room, Other };
/// Somebody cancelled. Cancelled.
[[nodiscard]] std::unexpected<Error> cancelled(Work work);

/// Preview is a mode of old files only. InvalidArgument.
[[nodiscard]] std::unexpected<Error> no_mode_to_convert_to();
/// Memory does not suffice. InvalidArgument.
[[nodiscard]] std::unexpected<Error> not_enough_memory(std::size_t triangles, int slabs);
/// The triangles of a source are no larger than what doubles tell apart where it lies. `farthest` from the origin,
/// triangles so far `across`, model units. Corrupt.
[[nodiscard]] std::unexpected<Error> too_far_from_the_origin(double farthest, double across);
/// Doubles cannot hold the eighth power of a source's diagonal. `across`: the diagonal; `range`: what it may be; model
/// units. Corrupt.
[[nodiscard]] std::unexpected<Error> size_out_of_bounds(double across, Range range);
/// What was certified is not the source, and nothing less was allowed. Unfoldable.
[[nodiscard]] std::unexpected<Error> certified_something_else(const ConvertReport& report);

/// Voxels of a remesh would be too many; `least`: the smallest that the source can take, share of its diagonal.
/// InvalidArgument.
[[nodiscard]] std::unexpected<Error> voxels_too_small(double least);
/// No part of a source is as large as the voxels of a remesh. Corrupt.
[[nodiscard]] std::unexpected<Error> nothing_as_large_as_voxels();

/// Says what a room does not fit.
enum class NoRoom : std::uint8_t {
  OtherCage,   ///< Corrupt
  OtherModel,  ///< Corrupt
  NoNumbers    ///< what wants it, or its goals, are no usable numbers; InvalidArgument
};
[[nodiscard]] std::unexpected<Error> no_room(NoRoom why);

/// Why the verifier took the certificate away; a clause. `reason`: its own.
[[nodiscard]] std::string why_not_proved(const std::string& reason);
/// A condition that a mode claims could not be tested; a clause.
[[nodiscard]] std::string why_not_tested(verify::Condition condition);
/// A condition fails that the verifier says nothing of; a clause.
[[nodiscard]] std::string no_reason();
/// What the verifier found of the tiles of a layer; a clause.
[[nodiscard]] std::string fault_of_tiles(Layer layer, const std::string& what);
/// Somebody cancelled before a file was written. Cancelled.
[[nodiscard]] std::unexpected<Error> not_written(const std::filesystem::path& file);
/// The verifier refuses what the mode claims. `next`: the mode that what helps is told for. Unfoldable.
[[nodiscard]] std::unexpected<Error> slabs_refused(const std::string& reason, Mode next, bool is_remeshed);
/// The verifier refuses the tiles. Unfoldable.
[[nodiscard]] std::unexpected<Error> samples_refused(const std::string& reason);

}  // namespace relief::detail
