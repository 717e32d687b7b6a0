// Where the parts of a glTF scene stand, and what bends them: transforms of nodes, morph targets, skins.
#pragma once

#include <relief/mesh/read/gltf_primitive.h>
#include <relief/mesh/read/scene.h>

namespace relief::detail {

/// A node's or a copy's move, turn (a quaternion x, y, z, w) and scale.
struct Pose {
  std::array<double, 3> move{};
  std::array<double, 4> turn = {0, 0, 0, 1};
  std::array<double, 3> scale = {1, 1, 1};

  [[nodiscard]] Placement placement() const noexcept;
};

/// The transforms of a file's nodes.
class NodeTree {
 public:
  NodeTree(const Source& source, const Json& root);

  [[nodiscard]] std::size_t size() const noexcept { return parents_.size(); }
  /// From the node to its parent. Corrupt when it is missing or malformed.
  [[nodiscard]] Result<Placement> local(std::uint64_t node) const;
  /// From the node to the scene. Corrupt also when the node is its own ancestor.
  [[nodiscard]] Result<Placement> global(std::uint64_t node);

 private:
  static constexpr std::uint32_t kNone = 0xffffffffU;

  const Source& source_;
  const Json& root_;
  std::vector<std::uint32_t> parents_;
  std::map<std::uint64_t, Placement> globals_;
};

/// The vertices of a mesh that one of its primitives made.
struct PrimitiveVertices {
  std::unique_ptr<GltfPrimitive> primitive;
  std::size_t first, count;
};

/// Moves vertices by the morph targets of their primitive, each by its weight. `work` bounds how many values are read.
[[nodiscard]] Status apply_morphs(const Source& source, GltfBuffers& buffers, const PrimitiveVertices& vertices,
                                  std::span<const double> weights, std::span<Vec3d> positions, std::size_t& work);

/// The joints of a skin where they stand in the scene.
class Skin {
 public:
  [[nodiscard]] static Result<Skin> open(const Source& source, GltfBuffers& buffers, NodeTree& nodes, const Json& root,
                                         std::optional<std::uint64_t> index);

  /// Puts vertices where their joints take them; each weighs as its WEIGHTS_n say, their sum taken as one. A vertex
  /// without any stays. Counts those that are mirrored on the way. `work` bounds how many values are read.
  [[nodiscard]] Status apply(const Source& source, const PrimitiveVertices& vertices, std::span<Vec3d> positions,
                             std::size_t& mirrored, std::size_t& work) const;

 private:
  std::vector<Placement> joints_;  ///< from where a vertex was bound to where the joint takes it
};

}  // namespace relief::detail
