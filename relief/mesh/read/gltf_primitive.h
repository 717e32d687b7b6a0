// One primitive of a glTF mesh: its attributes and corners, from accessors or out of a Draco stream.
#pragma once

#include <relief/mesh/read/draco.h>
#include <relief/mesh/read/gltf_buffers.h>

namespace relief::detail {

inline constexpr const char* kDracoCompression = "KHR_draco_mesh_compression";

class GltfPrimitive {
 public:
  /// Decodes what is compressed. Corrupt when it is damaged.
  [[nodiscard]] static Result<std::unique_ptr<GltfPrimitive>> open(const Source& source, GltfBuffers& buffers,
                                                                   const Json& json);

  [[nodiscard]] const Json& json() const noexcept { return json_; }
  /// Nothing when the primitive has none of that name.
  [[nodiscard]] Result<std::optional<Accessor>> attribute(const std::string& name) const;
  /// Returns the triangles; `count` is that of its vertices. Corrupt when one names another vertex.
  [[nodiscard]] Result<std::vector<Triangle>> triangles(std::size_t count) const;
  /// Returns whether it has triangles at all: points and lines have none.
  [[nodiscard]] bool has_surface() const noexcept { return mode_ >= kTriangles; }

 private:
  enum Mode : std::uint64_t { kTriangles = 4, kStrip = 5, kFan = 6 };

  GltfPrimitive(const Source& source, GltfBuffers& buffers, const Json& json)
      : source_(source), buffers_(buffers), json_(json) {}
  [[nodiscard]] std::unexpected<Error> no_vertex(std::size_t triangle) const;

  const Source& source_;
  GltfBuffers& buffers_;
  const Json& json_;
  std::uint64_t mode_ = kTriangles;
  std::optional<DracoMesh> unpacked_;
  std::map<std::string, std::size_t> names_;  ///< of attributes of `unpacked_`, and where they are there
};

}  // namespace relief::detail
