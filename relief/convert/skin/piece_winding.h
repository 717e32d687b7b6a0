// Which pieces of an arrangement bound the solid.
#pragma once

#include <relief/base/progress.h>
#include <relief/convert/skin/face_arrangement.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace relief::detail {

/// A piece has two sides: 0 lies in front of its plane, 1 behind it. Half-edge 3 p + k of a piece runs from corner k to
/// the next; side 2 h + s is side s of its piece at half-edge h.
struct PieceWinding {
  std::vector<std::int32_t> in_front;  ///< per piece how often the faces wind around what lies in front of it
  /// Per side of a half-edge the side that bounds the same part of space there, kNone where there is none.
  std::vector<std::uint32_t> across;
  std::size_t open = 0;  ///< half-edges where the faces end
  /// Pieces of parts for which no place to count from was found; they count as inside.
  std::vector<std::uint32_t> undecided;

  [[nodiscard]] bool is_in_solid(const Piece& piece, std::size_t p, std::size_t side) const noexcept {
    return in_front[p] + (side == 1 ? piece.sheets : 0) > 0;
  }
};

/// Nothing when cancelled. O(n log n). Deterministic.
[[nodiscard]] std::optional<PieceWinding> find_winding(const FaceArrangement& arrangement, const FaceTree& tree,
                                                       const Progress& progress);

}  // namespace relief::detail
