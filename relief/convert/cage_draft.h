// Slabs while they are being made.
#pragma once

#include <relief/convert/ordered_source.h>
#include <relief/convert/quadric.h>
#include <relief/convert/thin_shell.h>

#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

/// A piece of the source that may meet a slab: a triangle or a whole block, by the source's order.
struct Entry {
  std::uint32_t code;
  [[nodiscard]] static constexpr Entry triangle(std::uint32_t t) noexcept { return {t << 1U}; }
  [[nodiscard]] static constexpr Entry block(std::uint32_t b) noexcept { return {((b * kBlock) << 1U) | 1U}; }
  [[nodiscard]] constexpr bool is_block() const noexcept { return (code & 1U) != 0; }
  [[nodiscard]] constexpr std::uint32_t first() const noexcept { return code >> 1U; }
  friend constexpr bool operator<(Entry a, Entry b) noexcept { return a.code < b.code; }
};

/// Slabs as triangles of fibres, and what collapsing their edges needs to know.
struct CageDraft {
  struct List {
    std::uint32_t begin = 0, count = 0;
  };
  std::vector<Face> faces;          ///< corners kNone: gone
  std::vector<std::uint32_t> part;  ///< per face: which connected part it belongs to; empty: there is one
  std::vector<Ends> ends;           ///< of each fibre
  std::vector<Vec3d> at;            ///< a place on each fibre: where the surface is thought to be
  std::vector<Quadric> quadrics;    ///< per fibre
  std::vector<List> lists;  ///< per face, in `pool`: all pieces of the source that meet the slab, but what was lost
  std::vector<Entry> pool;
  std::vector<std::uint32_t> from;  ///< per face: the source's triangle that it is, and then it has no list; else kNone

  [[nodiscard]] std::uint32_t part_of(std::uint32_t f) const noexcept { return part.empty() ? 0 : part[f]; }
  [[nodiscard]] bool alive(std::uint32_t f) const noexcept { return faces[f][0] != kNone; }
  [[nodiscard]] LatticeTriangle triangle(std::uint32_t f, Side side) const noexcept {
    return {ends[faces[f][0]][side], ends[faces[f][1]][side], ends[faces[f][2]][side]};
  }
  [[nodiscard]] std::span<const Entry> list(std::uint32_t f) const noexcept {
    return std::span(pool).subspan(lists[f].begin, lists[f].count);
  }
  [[nodiscard]] Box3d box(std::uint32_t f) const noexcept {
    Box3d box;
    for (const std::uint32_t v : faces[f])
      for (const LatticePoint p : ends[v]) box.add(to_double(p));
    return box;
  }
};

}  // namespace relief::detail
