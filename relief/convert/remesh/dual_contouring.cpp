#include <relief/convert/remesh/dual_contouring.h>
#include <relief/convert/support/parallel.h>

#include <algorithm>

namespace relief::detail {
namespace {

constexpr std::uint8_t kNoSheet = 0xff;

/// Numbers the edges of a cell by their axis and place among the four along it. Bit 0: the upper one along the next
/// axis. Bit 1: along the one after that.
constexpr unsigned edge_number(unsigned axis, unsigned beside, unsigned above) noexcept {
  return axis * 4 + beside + 2 * above;
}
constexpr unsigned lower_corner(unsigned edge) noexcept {
  const unsigned axis = edge / 4;
  return (edge & 1U) << (axis + 1) % 3 | (edge >> 1U & 1U) << (axis + 2) % 3;
}

/// A face of a cell, seen along its axis: corner (p, q) is the upper one along the next axis and the one after it.
struct CellFace {
  unsigned axis, side;
  [[nodiscard]] constexpr unsigned number() const noexcept { return axis * 2 + side; }
  [[nodiscard]] constexpr unsigned corner(unsigned p, unsigned q) const noexcept {
    return side << axis | p << (axis + 1) % 3 | q << (axis + 2) % 3;
  }
  /// Returns the two edges of the face at that corner.
  [[nodiscard]] constexpr unsigned edge_along(unsigned q) const noexcept {
    return edge_number((axis + 1) % 3, q, side);
  }
  [[nodiscard]] constexpr unsigned edge_across(unsigned p) const noexcept {
    return edge_number((axis + 2) % 3, side, p);
  }
};

bool has(unsigned mask, unsigned bit) noexcept { return (mask >> bit & 1U) != 0; }

bool is_ambiguous(unsigned inside, const CellFace& face) noexcept {
  const bool first = has(inside, face.corner(0, 0)), second = has(inside, face.corner(1, 0));
  return first != second && has(inside, face.corner(1, 1)) == first && has(inside, face.corner(0, 1)) == second;
}

/// Says which sheet passes each edge of a cell, and how many sheets there are.
struct Sheets {
  std::array<std::uint8_t, 12> of_edge{};
  unsigned count = 0;
};

/// `joined` says of the ambiguous faces whether the corners inside hang together.
Sheets sheets_of(unsigned inside, unsigned joined) noexcept {
  std::array<std::uint8_t, 12> set{};
  for (unsigned e = 0; e < 12; ++e) {
    const unsigned low = lower_corner(e);
    set[e] = has(inside, low) != has(inside, low | 1U << e / 4) ? static_cast<std::uint8_t>(e) : kNoSheet;
  }
  const auto join = [&](unsigned a, unsigned b) {
    const std::uint8_t from = std::max(set[a], set[b]), to = std::min(set[a], set[b]);
    for (std::uint8_t& s : set)
      if (s == from) s = to;
  };
  for (unsigned axis = 0; axis < 3; ++axis)
    for (const unsigned side : {0U, 1U}) {
      const CellFace face{axis, side};
      if (is_ambiguous(inside, face)) {
        // The surface runs around the corners that are alone.
        for (const unsigned p : {0U, 1U})
          for (const unsigned q : {0U, 1U})
            if (has(inside, face.corner(p, q)) != has(joined, face.number()))
              join(face.edge_along(q), face.edge_across(p));
        continue;
      }
      unsigned first = 12;
      for (const unsigned e : {face.edge_along(0), face.edge_along(1), face.edge_across(0), face.edge_across(1)}) {
        if (set[e] == kNoSheet) continue;
        if (first == 12)
          first = e;
        else
          join(first, e);
      }
    }
  Sheets sheets;
  for (unsigned e = 0; e < 12; ++e) {
    if (set[e] == kNoSheet)
      sheets.of_edge[e] = kNoSheet;
    else
      sheets.of_edge[e] = set[e] == e ? static_cast<std::uint8_t>(sheets.count++) : sheets.of_edge[set[e]];
  }
  return sheets;
}

class Contouring {
 public:
  Contouring(const HermiteGrid& grid, const Skin& skin) : grid_(grid), joined_(grid.cells().size(), 0) {
    for_ambiguous([&](std::size_t cell, std::size_t other, const CellFace& face) {
      Vec3d middle = place_of(grid.cells()[cell]) + Vec3d{0.5, 0.5, 0.5};
      middle[face.axis] += 0.5;
      if (skin.is_inside(middle)) flip(cell, other, face);
    });
    // Two edges between the same two sheets: parting the corners the other way parts both sheets, too. Sheets are only
    // ever parted here, so this makes no new such pair.
    for_ambiguous([&](std::size_t cell, std::size_t other, const CellFace& face) {
      const auto is_one = [&](std::size_t c, const CellFace& f) {
        const Sheets sheets = sheets_of(grid_.inside_of(c), joined_[c]);
        return sheets.of_edge[f.edge_along(0)] == sheets.of_edge[f.edge_along(1)];
      };
      if (is_one(cell, face) && is_one(other, {face.axis, 0})) flip(cell, other, face);
    });
  }

  [[nodiscard]] DualContour run(const Progress& progress) const {
    DualContour result;
    const std::size_t cells = grid_.cells().size();
    std::vector<std::uint32_t> first_vertex(cells + 1, 0);
    for (std::size_t c = 0; c < cells; ++c)
      first_vertex[c + 1] = first_vertex[c] + sheets_of(grid_.inside_of(c), joined_[c]).count;
    result.cell_of.resize(first_vertex[cells]);
    result.first.assign(first_vertex[cells] + 1, 0);
    result.quads.resize(grid_.crossings().size());
    result.crossings.resize(4 * result.quads.size());
    for (std::uint32_t c = 0; c < cells; ++c)
      for (std::uint32_t v = first_vertex[c]; v < first_vertex[c + 1]; ++v) result.cell_of[v] = c;
    for (std::size_t c = 0; c < cells; ++c)
      for (const std::uint8_t s : sheets_of(grid_.inside_of(c), joined_[c]).of_edge)
        if (s != kNoSheet) ++result.first[first_vertex[c] + s + 1];
    for (std::size_t v = 0; v + 1 < result.first.size(); ++v) result.first[v + 1] += result.first[v];
    for_all(cells, 256, progress, [&](std::size_t c) {
      const Sheets sheets = sheets_of(grid_.inside_of(c), joined_[c]);
      std::array<std::uint32_t, 4> fill{};
      for (unsigned e = 0; e < 12; ++e) {
        if (sheets.of_edge[e] == kNoSheet) continue;
        const std::uint32_t v = first_vertex[c] + sheets.of_edge[e];
        const std::uint32_t crossing = grid_.crossing_at(corner_of(grid_.cells()[c], lower_corner(e)), e / 4);
        result.crossings[result.first[v] + fill[sheets.of_edge[e]]++] = crossing;
        // Counter-clockwise seen from above, when the lower end of the edge is inside.
        constexpr std::array<unsigned, 4> kTurn = {0, 1, 3, 2};
        const unsigned corner = kTurn[e & 3U];
        result.quads[crossing][grid_.crossings()[crossing].low_inside ? corner : 3 - corner] = v;
      }
    });
    return progress.cancelled() ? DualContour{} : result;
  }

 private:
  /// Calls visit(cell, the cell beyond, face) for each ambiguous face, which is the upper one of the first cell.
  template <typename Visit>
  void for_ambiguous(Visit&& visit) const {
    for (std::size_t c = 0; c < joined_.size(); ++c)
      for (unsigned axis = 0; axis < 3; ++axis) {
        const CellFace face{axis, 1};
        if (!is_ambiguous(grid_.inside_of(c), face)) continue;
        Voxel other = grid_.cells()[c];
        ++other[axis];
        visit(c, std::size_t{grid_.cell_at(other)}, face);
      }
  }
  void flip(std::size_t cell, std::size_t other, const CellFace& face) noexcept {
    joined_[cell] = static_cast<std::uint8_t>(joined_[cell] ^ 1U << face.number());
    joined_[other] = static_cast<std::uint8_t>(joined_[other] ^ 1U << CellFace{face.axis, 0}.number());
  }

  const HermiteGrid& grid_;
  std::vector<std::uint8_t> joined_;  // by cell: bits of its ambiguous faces whose corners inside hang together
};

}  // namespace

DualContour contour(const HermiteGrid& grid, const Skin& skin, const Progress& progress) {
  return Contouring(grid, skin).run(progress);
}

}  // namespace relief::detail
