// The slabs that a change of a draft puts in place of others.
#pragma once

#include <relief/convert/shell/shell_draft.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace relief::detail {

/// An edge opposite the centre of a star, counter-clockwise seen from outside.
struct LinkEdge {
  Side side;
  Vec3d from, to;
};

/// Says how well shaped triangles are, by shape_of().
struct Quality {
  double least = 1, mean = 0;
};

/// New faces and those whose numbers they take. Where a fibre is moved or put in, it is corner 0 of each, and the faces
/// run once around it.
struct Star {
  std::vector<Face> faces;
  std::vector<std::uint32_t> slots;     ///< per face the number of the one that it replaces
  std::vector<std::uint32_t> vanished;  ///< further faces that go
  std::size_t fresh = 0;                ///< faces before this one stay as they are, and only count for the winding
  std::size_t second = 0;               ///< of an edge's star: where the faces of its second end begin
  std::uint32_t moved = kNone;          ///< the fibre in the middle; kNone: an edge is flipped

  /// The slabs around a fibre, as they are.
  void set_fibre(const LinkedDraft& draft, std::uint32_t v);
  /// The slabs around the fibre that an edge becomes, from its left far corner around the first end to the right one,
  /// and back around the second. LinkedDraft::link_allows() must hold.
  void set_edge(const LinkedDraft& draft, std::uint32_t h);
  /// The two slabs that an edge lies between, after LinkedDraft::flip().
  void set_flip(const LinkedDraft& draft, std::uint32_t h);

  /// Calls visit(f) for the faces that are replaced or go.
  template <typename Visit>
  void for_replaced(Visit&& visit) const {
    for (std::size_t k = fresh; k < slots.size(); ++k) visit(slots[k]);
    for (const std::uint32_t f : vanished) visit(f);
  }
  /// Returns the edges opposite the centre in the fresh faces, of both sides.
  [[nodiscard]] std::vector<LinkEdge> link(const LinkedDraft& draft) const;
  /// Of the fresh faces were the centre's place `at`; the mean counts others as 0.
  [[nodiscard]] Quality quality(const LinkedDraft& draft, Vec3d at) const noexcept;
  /// Returns the quality of the faces that keep their numbers, as they are now.
  [[nodiscard]] Quality quality_now(const LinkedDraft& draft) const noexcept;

 private:
  void clear() noexcept;
};

}  // namespace relief::detail
