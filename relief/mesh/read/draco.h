// Meshes in the form of the Draco library: in files of their own, and inside glTF.
#pragma once

#include <relief/mesh/read/gltf_buffers.h>

namespace relief::detail {

/// Values at points, packed.
struct DracoAttribute {
  enum class Kind : std::uint8_t { Position, Colour, Place, Other };
  Kind kind = Kind::Other;
  std::uint32_t id = 0;  ///< by which others name it
  std::uint16_t type = kFloat;
  std::size_t components = 0;
  bool normalised = false;
  std::string bytes;

  /// Returns a view of them; there are as many as the mesh has points.
  [[nodiscard]] Accessor values(std::size_t points) const noexcept {
    return {bytes.data(), points,     components == 0 ? 0 : bytes.size() / std::max<std::size_t>(points, 1),
            type,         components, normalised};
  }
};

struct DracoMesh {
  std::size_t points = 0;
  std::vector<Triangle> triangles;
  std::vector<DracoAttribute> attributes;
};

/// Errors: UnsupportedFormat and Corrupt, with the words that complete "the data ...". Points, triangles and attributes
/// are bounded by the number of bytes before anything is allocated for them.
[[nodiscard]] Result<DracoMesh> decode_draco(std::string_view bytes);

}  // namespace relief::detail
