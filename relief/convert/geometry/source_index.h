// The source of a certified shell, in an order that keeps neighbours together, with what is asked of it again and
// again.
#pragma once

#include <relief/convert/geometry/half_edges.h>
#include <relief/convert/geometry/lattice.h>
#include <relief/convert/geometry/slab_test.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

inline constexpr std::uint32_t kClusterSize = 16;  ///< triangles
inline constexpr std::size_t kLarge = 500'000;     ///< triangles: from there what is tried for fewer slabs takes long

/// Triangles in Morton order, points in the order in which these first name them.
struct SourceIndex {
  std::vector<LatticePoint> points;
  std::vector<Face> faces;
  std::vector<std::uint32_t> point_of, face_of;  ///< numbers in the caller's source, kNone: not there
  std::vector<std::array<float, 4>> normals;     ///< unit normals, each with the slack of SourceTriangle
  std::vector<float> most_slack;                 ///< per point: of its triangles, where hardly a direction sees them
  std::vector<SourceCluster> clusters;

  SourceIndex(std::span<const LatticePoint> given, std::span<const Face> given_faces);
  /// After points have moved.
  void update();
  /// The normal of one triangle; a gone one has none.
  void update_normal(std::uint32_t t);
  [[nodiscard]] bool alive(std::uint32_t t) const noexcept { return faces[t][0] != kNone; }
  /// Returns the tip of a needle, or on a knife edge: hardly a direction sees the triangles there.
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
  /// Calls visit(t, crossed_by_all) for triangles that floats cannot separate from a slab. The flag says that all
  /// fibres cross what of the triangle may be there; without it, ask the shape.
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
