// How often a mesh winds around a point, for meshes with holes, too.
#pragma once

#include <relief/base/vec.h>
#include <relief/mesh/triangle_mesh.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

/// The generalised winding number [Jacobson et al. 2013]: 1 inside a closed mesh that looks outwards, 0 outside,
/// between them across a hole. Far triangles count together as a dipole [Barill et al. 2018].
class WindingNumber {
 public:
  static constexpr double kError = 0.05;  ///< the error stays below about this
  static constexpr double kInside = 0.5;  ///< more of it counts as inside: halfway between what closed meshes have

  /// O(n log n). The points must outlive it.
  WindingNumber(std::span<const Vec3d> points, std::vector<Triangle> triangles);

  /// After points have moved; `moved` tells of each whether it has. Sums up again what they are part of: the triangles
  /// stay where they are in the tree, which serves as long as they do not move far. O(n), but much faster than again.
  void update(std::span<const std::uint8_t> moved);

  /// O(log n). May be called on many threads at once.
  [[nodiscard]] double at(Vec3d p) const noexcept;

 private:
  struct Node {
    Vec3d centre;  ///< mean of the triangles' centres by area
    Vec3d moment;  ///< sum of their area vectors
    double radius = 0;
    double area = 0;
    std::uint32_t first = 0, last = 0;  ///< triangles
    std::uint32_t right = 0;            ///< the left child comes next; 0: a leaf
    std::uint32_t box = 0;              ///< of a large node
    [[nodiscard]] bool is_large() const noexcept { return last - first > kExact; }
  };
  static constexpr std::uint32_t kExact = 256;  // triangles: of so many at most, the radius is the least one
  /// A triangle, and three times its centre.
  struct Place {
    std::array<float, 3> at;
    Triangle triangle;
  };
  void split(std::span<Place> places);
  void sum(std::uint32_t id);
  [[nodiscard]] Box3d box_of(const Node& node) const noexcept;

  std::span<const Vec3d> points_;
  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;   // each before its children
  std::vector<Box3d> boxes_;  // of the corners
};

}  // namespace relief::detail
