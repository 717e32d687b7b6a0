// What scene formats (glTF, 3MF) need: placed copies of parts, within a bound on what copying may cost.
#pragma once

#include <relief/mesh/read/source.h>

#include <array>

namespace relief::detail {

/// An affine map: the columns of the linear part, then the translation.
struct Placement {
  std::array<Vec3d, 3> axes = {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}};
  Vec3d origin;

  [[nodiscard]] Vec3d direction(Vec3d p) const noexcept { return axes[0] * p.x + axes[1] * p.y + axes[2] * p.z; }
  [[nodiscard]] Vec3d point(Vec3d p) const noexcept { return direction(p) + origin; }
  /// This after `inner`.
  [[nodiscard]] Placement operator*(const Placement& inner) const noexcept {
    return {{direction(inner.axes[0]), direction(inner.axes[1]), direction(inner.axes[2])}, point(inner.origin)};
  }
  [[nodiscard]] bool mirrors() const noexcept { return dot(axes[0], cross(axes[1], axes[2])) < 0.0; }
  [[nodiscard]] bool is_identity() const noexcept { return axes == Placement{}.axes && origin == Vec3d{}; }
};

/// Collects placed parts into one mesh; their material_of counts in one list that the caller keeps. Copies of a part
/// can make a small file large: past `limit` vertices and triangles `add` refuses.
class Scene {
 public:
  explicit Scene(std::size_t file_size) noexcept : limit_(1'000'000 + 16 * file_size) {}

  /// `inside_out`: the part's triangles run the wrong way.
  [[nodiscard]] bool add(const TriangleMesh& part, const Placement& placement, bool inside_out = false) {
    if (part.positions.size() + part.triangles.size() > limit_ - used_) return false;
    if (mesh.positions.size() + part.positions.size() > 0xfffffffeU) return false;
    used_ += part.positions.size() + part.triangles.size();
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    if (!part.colours.empty()) {
      mesh.colours.resize(first);
      mesh.colours.insert(mesh.colours.end(), part.colours.begin(), part.colours.end());
    }
    const std::size_t first_triangle = mesh.triangles.size();
    const bool stays = placement.is_identity();
    for (const Vec3d& p : part.positions) mesh.positions.push_back(stays ? p : placement.point(p));
    const bool turned = placement.mirrors() != inside_out;
    for (const auto& [a, b, c] : part.triangles) {
      mesh.triangles.push_back(turned ? Triangle{first + a, first + c, first + b}
                                      : Triangle{first + a, first + b, first + c});
    }
    if (!mesh.colours.empty()) mesh.colours.resize(mesh.positions.size());
    if (!part.material_of.empty()) {
      mesh.material_of.resize(first_triangle, 0);
      mesh.material_of.insert(mesh.material_of.end(), part.material_of.begin(), part.material_of.end());
    }
    if (!mesh.material_of.empty()) mesh.material_of.resize(mesh.triangles.size(), 0);
    if (!part.uvs.empty()) {
      mesh.uvs.resize(first_triangle);
      for (const TriangleUv& uv : part.uvs) mesh.uvs.push_back(turned ? TriangleUv{uv[0], uv[2], uv[1]} : uv);
    }
    if (!mesh.uvs.empty()) mesh.uvs.resize(mesh.triangles.size());
    return true;
  }

  TriangleMesh mesh;

 private:
  std::size_t limit_;
  std::size_t used_ = 0;
};

}  // namespace relief::detail
