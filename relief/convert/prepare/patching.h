// Faces that are cut out of a closed surface, and the patches that take their place.
#pragma once

#include <relief/convert/geometry/half_edges.h>
#include <relief/convert/geometry/source_index.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace relief::detail {

/// The faces to take out so that at each point of what stays at most one boundary loop passes, and no piece of it is
/// tiny or consists of patches alone.
class CutRegion {
 public:
  /// The bad faces with `around` rings around them, and as many more as the greatest `heat` of their corners says. All
  /// must outlive it. `patch`: per face, whether it was not scanned.
  CutRegion(const SourceIndex& source, const Rings& rings, std::span<const std::uint8_t> patch,
            std::span<const std::uint32_t> bad, std::size_t around, std::span<const std::uint8_t> heat);

  [[nodiscard]] const std::vector<std::uint32_t>& faces() const noexcept { return faces_; }
  [[nodiscard]] bool has(std::uint32_t f) const noexcept { return level_[f] != 0; }
  /// Half-edges of faces that stay, at faces that go; ascending.
  [[nodiscard]] std::vector<std::uint32_t> boundary() const;

  struct Piece {
    double diagonal = 0;  ///< of the box around it, lattice steps
    LatticePoint middle;  ///< of the box
  };
  /// Returns the connected piece of it with the largest box.
  [[nodiscard]] Piece widest() const;

 private:
  void mark_rings(std::span<const std::uint32_t> bad, std::size_t rings, std::span<const std::uint8_t> heat);
  bool cut_pinched();
  bool cut_crumbs();
  bool cut_bare();
  void cut(std::uint32_t f, std::uint8_t level);

  const SourceIndex& source_;
  const Rings& rings_;
  std::span<const std::uint8_t> patch_;
  std::vector<std::uint8_t> level_;   // per face: 0 stays; else one more than the rings to cut around it
  std::vector<std::uint32_t> faces_;  // with a level
};

/// Holds what closes a region that was cut out.
struct Patches {
  std::vector<std::vector<std::uint32_t>> loops;  ///< of points of the source, as the patches run along them
  std::vector<std::pair<std::uint32_t, std::uint32_t>>
      edges;                          ///< a point of a loop, and the half-edge beyond the
                                      ///< loop's edge from there; ascending, one for each point
  std::vector<std::uint32_t> beside;  ///< faces that stay and have a point of a loop, ascending
  std::vector<LatticePoint> points;   ///< new ones: their numbers come after those of the source's points
  std::vector<Face> faces;
  std::vector<std::size_t> begins;  ///< of each loop's faces, and their end

  [[nodiscard]] std::size_t edge_at(std::uint32_t v) const {
    return static_cast<std::size_t>(std::lower_bound(edges.begin(), edges.end(), std::pair(v, 0U)) - edges.begin());
  }
};
/// Nothing where a loop has fewer than three points.
[[nodiscard]] std::optional<Patches> close_with_patches(const SourceIndex& source, const Rings& rings,
                                                        const CutRegion& region);

}  // namespace relief::detail
