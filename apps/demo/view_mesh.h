// A model as the page's 3D view reads it, and the view itself.
#pragma once

#include <relief/core/snapshot.h>

#include <cstddef>
#include <string>
#include <string_view>

namespace relief::demo {

[[nodiscard]] std::string base64(std::string_view bytes);

/// A model at the finest level that the page can hold.
struct ViewMesh {
  std::string json;           ///< an object of viewer.js; empty where even the coarsest level has too many vertices
  std::size_t triangles = 0;  ///< of the level
};
/// Places are rounded to 1/65535 of the box, normals and colours to 8 bits. Without colours the surface is light grey.
/// At most 65 535 vertices, which 16 bits can number, and `bytes` of JSON.
[[nodiscard]] ViewMesh view_mesh(const Snapshot& model, const Box3d& box, std::size_t bytes);

/// The script of the 3D view; see viewer.js.
[[nodiscard]] std::string_view viewer_script() noexcept;

}  // namespace relief::demo
