// A triangle cut along segments in its plane, without rounding.
#pragma once

#include <relief/convert/geometry/exact_point.h>
#include <relief/convert/geometry/half_edges.h>
#include <relief/convert/geometry/lattice.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace relief::detail {

/// A triangulation of a triangle with area whose edges hold given points and segments. It is Delaunay besides as far as
/// doubles tell. About 2 us a point and 10 us a segment where they are few.
class TriangleCut {
 public:
  explicit TriangleCut(const LatticeTriangle& triangle);

  /// Returns the number of a point of the triangle, which is added where it is not there yet. The corners are 0, 1, 2.
  std::uint32_t add(const ExactPoint& p);
  /// Makes the segment between two points edges. It lies in a plane which crosses the triangle's; where it crosses an
  /// earlier segment, a point is added.
  void add_segment(std::uint32_t a, std::uint32_t b, const LatticePlane& plane);
  /// Makes the segment between two points an edge, which crosses no segment and holds no point. None may be added after
  /// it.
  void add_edge(std::uint32_t a, std::uint32_t b);

  [[nodiscard]] const std::vector<ExactPoint>& points() const noexcept { return points_; }
  /// Returns the faces as points, counter-clockwise like the triangle; at first its corners in their order.
  [[nodiscard]] std::vector<Face> faces() const;
  /// Returns the axis against which predicates look at the triangle.
  [[nodiscard]] std::size_t axis() const noexcept { return axis_; }
  [[nodiscard]] bool is_whole() const noexcept { return points_.size() == 3; }

 private:
  static constexpr std::uint32_t kFree = kNone, kFixed = kNone - 1;  // in place of the number of a plane
  struct Part {
    Face corners;
    std::array<std::uint32_t, 3> beyond{kNone, kNone, kNone};  // per edge
    std::array<std::uint32_t, 3> wall{kFree, kFree, kFree};    // per edge: its plane
  };
  using EndPairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
  struct Edge {
    std::uint32_t part;
    std::size_t k;
  };
  [[nodiscard]] int turn_of(std::uint32_t a, std::uint32_t b, const ExactPoint& p) const noexcept;
  [[nodiscard]] int turn_of(std::uint32_t a, std::uint32_t b, std::uint32_t c) const noexcept {
    return turn_of(a, b, points_[c]);
  }
  [[nodiscard]] bool is_ahead(std::uint32_t a, std::uint32_t b, std::uint32_t c) const noexcept;
  [[nodiscard]] std::uint32_t find(const ExactPoint& p) const;
  [[nodiscard]] std::array<int, 3> turns_in(std::uint32_t part, const ExactPoint& p) const noexcept;
  [[nodiscard]] Edge find_edge(std::uint32_t a, std::uint32_t b) const;
  template <typename Visit>
  void around(std::uint32_t v, Visit&& visit) const;  // until it returns false
  std::uint32_t new_point(const ExactPoint& p);
  std::uint32_t split_part(std::uint32_t part, const ExactPoint& p);
  std::uint32_t split_edge(Edge edge, const ExactPoint& p);
  void set(std::uint32_t part, const Part& to);
  void point_back(std::uint32_t from, std::uint32_t part, std::size_t edge);
  void set_wall(Edge edge, std::uint32_t wall);
  void flip(Edge edge);
  [[nodiscard]] bool can_flip(Edge edge) const noexcept;
  [[nodiscard]] bool should_flip(Edge edge) const noexcept;
  void improve(EndPairs& edges);
  void make_edge(std::uint32_t a, std::uint32_t b, std::uint32_t wall);
  std::uint32_t first_on_way(std::uint32_t a, std::uint32_t b, std::uint32_t wall);
  void clear_way(std::uint32_t a, std::uint32_t b, std::uint32_t wall, const EndPairs& crossed);

  LatticePlane plane_;
  std::size_t axis_;
  int sense_;  // of the triangle seen against the axis
  Vec3d origin_, across_, up_;
  std::vector<ExactPoint> points_;
  std::vector<std::array<double, 2>> flat_;  // the points in the plane
  std::vector<std::uint32_t> part_at_;       // per point a part around it
  std::vector<Part> parts_;
  std::vector<LatticePlane> walls_;
  std::uint32_t latest_ = 0;  // part
};

}  // namespace relief::detail
