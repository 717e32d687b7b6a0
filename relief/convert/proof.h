// What the verifier finds of a model, and what it may therefore be called.
#pragma once

#include <relief/convert/convert.h>
#include <relief/core/model.h>
#include <relief/core/plain_cage.h>
#include <relief/verify/verify.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace relief {

/// Returns a cage as the verifier reads it; a view.
[[nodiscard]] verify::Shell view(const PlainCage& cage) noexcept;

/// A source as the verifier reads it. Vertices at the same place are one, for formats that repeat them.
struct PlainSource {
  std::vector<Vec3d> positions;                         ///< model units
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< three vertices each
  std::optional<std::size_t> phantom_from;              ///< the first of the triangles that fill openings

  explicit PlainSource(TriangleMesh&& mesh);
  [[nodiscard]] verify::Source view() const;
};

/// What the verifier finds in the tiles that lie on each slab's own grid.
struct TileFaults {
  std::string first;                 ///< a sentence; empty where all hold
  std::vector<std::uint32_t> slabs;  ///< of the same layer, all that fail
};
/// Returns the faults of a model's tiles; none where C0 fails, or when cancelled.
[[nodiscard]] TileFaults faults_of_tiles(const Snapshot& head, const verify::Certificate& certificate,
                                         const Progress& progress = {});

/// Returns whether a mode claims a condition.
[[nodiscard]] bool claims(Mode mode, verify::Condition condition);
/// Returns how many conditions are claimed of a shell: those with the source only where it is as it was made.
[[nodiscard]] std::size_t claimed(const verify::Certificate& certificate, bool as_made = true) noexcept;
/// Returns whether all holds that a mode claims.
[[nodiscard]] bool claim_holds(Mode mode, const verify::Certificate& certificate, bool as_made = true);
/// Returns the first sentence about something that a mode claims and that does not hold.
[[nodiscard]] std::string first_reason(Mode mode, const verify::Certificate& certificate, bool as_made = true);

/// Has the verifier judge what convert() made, against its mended source, of which only the triangles are needed and
/// which is taken away. Where it is not what it claims but holds what a lesser mode does, it gets that mode and says
/// why, unless `asked` names the mode; where it holds more, that of what holds. Unfoldable where no mode holds, or a
/// tile is wrong; Cancelled. Any thread; about a tenth of the time of the conversion.
[[nodiscard]] Result<verify::Certificate> prove(Conversion& made, const std::optional<Mode>& asked, bool is_remeshed,
                                                const Progress& progress = {});

}  // namespace relief
