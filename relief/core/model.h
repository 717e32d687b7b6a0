// A model as a whole: a snapshot and what is known about it.
#pragma once

#include <relief/base/unit.h>
#include <relief/core/snapshot.h>

#include <optional>
#include <string>
#include <string_view>

namespace relief {

/// What is claimed about the slabs. Preview: single slabs are sound and the triangles do not intersect. Tolerant: the
/// shell does not overlap; samples whose fibre does not meet the surface exactly once are flagged. Certified: proven,
/// every fibre once.
enum class Mode : std::uint8_t { Certified, Tolerant, Preview };

[[nodiscard]] constexpr std::string_view name(Mode mode) noexcept {
  return mode == Mode::Certified ? "certified" : mode == Mode::Tolerant ? "tolerant" : "preview";
}
[[nodiscard]] constexpr std::optional<Mode> mode_from_name(std::string_view text) noexcept {
  for (const Mode mode : {Mode::Certified, Mode::Tolerant, Mode::Preview})
    if (text == name(mode)) return mode;
  return std::nullopt;
}

/// Returns the conditions of the verifier that a mode claims to hold, those with the source among them.
[[nodiscard]] constexpr std::string_view claims(Mode mode) noexcept {
  return mode == Mode::Certified ? "C0 C1 C2 C3 C4 C5 C6 C7" : mode == Mode::Tolerant ? "C0 C1 C2 C3 C4" : "C0 C1 C3";
}

/// Holds what is known of a model beside its surface.
struct ModelInfo {
  Mode mode = Mode::Preview;     ///< how far it was proved
  Unit unit = Unit::Millimetre;  ///< what one model unit is
  std::string source;            ///< file name of the scan, without its folder
  double source_diagonal = 0;    ///< of the source's bounding box, model units
};

/// A model as it is made, before it has a file.
struct Model {
  ModelInfo info;    ///< what is known of it
  SnapshotPtr head;  ///< its surface
};

/// Of the source's box, or of the cage's where that is not known; model units.
[[nodiscard]] inline double source_diagonal(const Model& model) noexcept {
  return model.info.source_diagonal > 0 ? model.info.source_diagonal : diagonal(model.head->slab_mesh().bounds());
}

}  // namespace relief
