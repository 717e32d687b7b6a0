// A certified shell on the outer skin of a source that overlaps itself.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/certified_shell.h>
#include <relief/convert/convert.h>
#include <relief/convert/geometry/lattice.h>
#include <relief/convert/skin/outer_skin.h>
#include <relief/convert/stages.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace relief::detail {

/// Returns whether a source overlaps itself so that the outer skin is to take its place: a few faces of one part that
/// cross are smoothed instead, and patches that cross something get another shape first.
[[nodiscard]] bool asks_for_skin(const Overlaps& overlaps, std::size_t faces, bool is_last) noexcept;

/// Surface of a source of which winding does not decide whether it lies inside.
struct Undecided {
  double area = 0;  ///< square model units
  Vec3d near = {};  ///< a place of it, model units, where there is some
};

/// The outer skin in the place of a closed source, and which face and part of that its own were.
struct Skinned {
  ClosedSource source;
  std::vector<std::uint32_t> face_of, part_of;  ///< by face, and by part; no part where there is no skin
  std::optional<ConvertReport::Skin> report = {};
  Undecided undecided = {};
};

/// Returns the source itself where there is no skin, or when cancelled. `of_diagonal`: a lattice step, share of the
/// diagonal. `show`: who wants to see the skin.
[[nodiscard]] Skinned take_skin(ClosedSource&& given, const Lattice& lattice, double of_diagonal, const StageSink& show,
                                const Progress& progress);

/// As build_certified(), with its outer skin in the place of the source. What is said of faces and components is said
/// of the source's own. Tiny components of the skin are left out.
[[nodiscard]] CertifiedShell certify_skin(Skinned& skinned, CertifiedSettings settings, const Progress& progress);

}  // namespace relief::detail
