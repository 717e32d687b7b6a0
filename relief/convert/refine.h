// Finer grids and new slabs for a model that was sculpted.
#pragma once

#include <relief/base/error.h>
#include <relief/base/progress.h>
#include <relief/core/model.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace relief {

/// Where a model gets them.
enum class RefineWhere : std::uint8_t {
  /// where the surface stands at the end of its fibres: these are lengthened, and turned where that fails; and where
  /// they lean by over 65 degrees: finer grids, more intervals first, then slabs that are cut in four
  Saturated,
  All,    ///< twice as many samples along every edge; the surface stays
  Model,  ///< new slabs for everything, converted from the surface as it is
};
[[nodiscard]] std::string_view name(RefineWhere where) noexcept;
[[nodiscard]] std::optional<RefineWhere> refine_where_from_name(std::string_view text) noexcept;

/// Holds what refine() did.
struct Refined {
  Model model;  ///< its head is null where there was nothing to do
  /// samples so near an end of their fibre as tools come that fade out there, copies counted each
  std::size_t saturated_before = 0, saturated_after = 0;
  /// Saturated, and what follows
  std::size_t fibres_moved = 0, fibres_lacking = 0;
  std::size_t slabs_leaning = 0;  ///< over 5 % of whose micro-triangles fibres lean by over 65 degrees
  std::size_t slabs_finer = 0;    ///< of these, that got finer grids; the others have them
  /// Between the two surfaces, from up to 32 rows of samples per slab of each to the other; model units
  double moved_rms = 0, moved_max = 0;
};

/// Returns what was done. The diagonal is that of the source (ModelInfo::source_diagonal), or of the cage where that is
/// not known. `as_made` is the surface as it was when its slabs were new, null where nobody has it any more. Samples
/// that tools have moved by less than is left of their fibre are not saturated: conversion put them there, as in thin
/// walls. Layers come along: on Model those beside the colour from the nearest place of the old surface. Slabs that
/// were not touched keep their samples bit for bit, but on Model; there is nothing to do there where the model is as it
/// was made. Errors: Cancelled; on Model those of convert() in the model's mode.
[[nodiscard]] Result<Refined> refine(const Model& model, RefineWhere where, const SnapshotPtr& as_made = {},
                                     const Progress& progress = {});

}  // namespace relief
