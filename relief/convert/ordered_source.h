// The source of a certified shell, in an order that keeps neighbours together, with what is asked of it again and
// again.
#pragma once

#include <relief/convert/decimate.h>
#include <relief/convert/lattice.h>
#include <relief/convert/section.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

inline constexpr std::uint32_t kNone = 0xffffffffU;
inline constexpr std::uint32_t kBlock = 16;     ///< triangles
inline constexpr std::size_t kLarge = 500'000;  ///< triangles: from there what is tried for fewer slabs takes long

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

/// Triangles in Morton order, points in the order in which these first name them.
struct OrderedSource {
  std::vector<LatticePoint> points;
  std::vector<Face> faces;
  std::vector<std::uint32_t> point_of, face_of;  ///< numbers in the caller's source, kNone: not there
  std::vector<std::array<float, 4>> normals;     ///< unit normals, each with the slack of SourceTriangle
  std::vector<float> most_slack;                 ///< per point: of its triangles, where hardly a direction sees them
  std::vector<SourceBlock> blocks;

  OrderedSource(std::span<const LatticePoint> given, std::span<const Face> given_faces);
  /// After points have moved.
  void update();
  /// The normal of one triangle; a gone one has none.
  void update_normal(std::uint32_t t);
  [[nodiscard]] bool alive(std::uint32_t t) const noexcept { return faces[t][0] != kNone; }
  /// The tip of a needle, or on a knife edge: hardly a direction sees the triangles there.
  [[nodiscard]] bool is_needle(std::uint32_t v) const noexcept { return most_slack[v] < 1; }
  [[nodiscard]] Vec3d normal(std::uint32_t t) const noexcept {
    return {double(normals[t][0]), double(normals[t][1]), double(normals[t][2])};
  }
  [[nodiscard]] LatticeTriangle corners(std::uint32_t t) const noexcept {
    return {points[faces[t][0]], points[faces[t][1]], points[faces[t][2]]};
  }
  [[nodiscard]] SourceTriangle triangle(std::uint32_t t) const noexcept {
    const Face& f = faces[t];
    return {to_double(points[f[0]]), to_double(points[f[1]]), to_double(points[f[2]]), normal(t),
            double(normals[t][3])};
  }
  [[nodiscard]] Vec3d cross_of(std::uint32_t t) const noexcept {
    const Vec3d a = to_double(points[faces[t][0]]);
    return cross(to_double(points[faces[t][1]]) - a, to_double(points[faces[t][2]]) - a);
  }
  /// Puts `count` triangles, one to four, side by side; `number`(k) is that of the k-th.
  template <typename Number>
  void set_four(FourTriangles& four, std::size_t count, LatticePoint origin, Number&& number) const noexcept {
    const std::array<std::uint32_t, 4> t = {number(std::size_t{0}), number(std::min<std::size_t>(1, count - 1)),
                                            number(std::min<std::size_t>(2, count - 1)), number(count - 1)};
    four.set({corners(t[0]), corners(t[1]), corners(t[2]), corners(t[3])},
             {normals[t[0]], normals[t[1]], normals[t[2]], normals[t[3]]}, count, origin);
  }
  /// Calls visit(t, is_section) for those of some triangles that are not apart from a slab as far as floats tell, with
  /// whether these tell that what of it may be there is crossed by all fibres: else the shape is to be asked.
  template <typename Visit>
  void for_near(const SlabShape& shape, std::span<const std::uint32_t> some, Visit&& visit) const {
    const LatticePoint origin = shape.triangle(0)[0];
    const QuickShape quick(shape, origin);
    FourTriangles four;
    while (!some.empty()) {
      const std::size_t count = std::min<std::size_t>(4, some.size());
      set_four(four, count, origin, [&](std::size_t lane) { return some[lane]; });
      const QuickShape::Verdict verdict = quick.meet(four);
      for (unsigned left = verdict.near; left != 0; left &= left - 1) {
        const auto lane = static_cast<std::size_t>(std::countr_zero(left));
        visit(some[lane], (verdict.section >> lane & 1U) != 0);
      }
      some = some.subspan(count);
    }
  }
};

}  // namespace relief::detail
