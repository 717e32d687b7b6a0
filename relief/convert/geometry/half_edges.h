// Which triangles lie around a point or across an edge.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

using Face = std::array<std::uint32_t, 3>;

inline constexpr std::uint32_t kNone = 0xffffffffU;  ///< no point, no face, no half-edge

[[nodiscard]] inline bool share_a_corner(const Face& f, const Face& g) noexcept {
  bool shared = false;
  for (const std::uint32_t v : f) shared = shared || v == g[0] || v == g[1] || v == g[2];
  return shared;
}

// Half-edge 3 f + k runs from corner k of face f to the next.
constexpr std::uint32_t next_of(std::uint32_t h) noexcept { return h % 3 == 2 ? h - 2 : h + 1; }
constexpr std::uint32_t last_of(std::uint32_t h) noexcept { return h % 3 == 0 ? h + 2 : h - 1; }

/// Per half-edge the opposite one, kNone where there is none.
[[nodiscard]] std::vector<std::uint32_t> find_twins(std::span<const Face> faces, std::size_t point_count);

/// Per point the half-edges that leave it.
struct Stars {
  std::vector<std::uint32_t> begin, half_edges;

  Stars(std::span<const Face> faces, std::size_t point_count);
  [[nodiscard]] std::span<const std::uint32_t> of(std::uint32_t v) const noexcept {
    return std::span(half_edges).subspan(begin[v], begin[v + 1] - begin[v]);
  }
};

/// The triangles around each point of a closed surface. Faces with corners kNone are gone, and points may have none.
struct Rings {
  std::vector<std::uint32_t> twins;  ///< per half-edge
  std::vector<std::uint32_t> out;    ///< per point a half-edge that leaves it, kNone: none does

  Rings(std::span<const Face> faces, std::size_t point_count);
  /// Calls visit(h) for the half-edges that leave v.
  template <typename Visit>
  void around(std::uint32_t v, Visit&& visit) const {
    if (out[v] == kNone) return;
    std::uint32_t h = out[v];
    do {
      visit(h);
      h = twins[last_of(h)];
    } while (h != out[v]);
  }
};

}  // namespace relief::detail
