// A plain triangle mesh as the graphics driver holds it.
#pragma once

#include "frame.h"
#include "gl_context.h"

namespace relief::detail {

/// Positions are held relative to the centre.
struct MeshBuffers {
  struct Vertex {
    Vec3f position;
    std::uint32_t normal = 0, colour = 0;
  };
  MeshView view;
  Vec3d centre;
  Box3d bounds;  ///< relative to the centre
  GlBuffer vertices, indices;
  GlVertexArray array;
  GLsizei count = 0;
  std::uint64_t bytes = 0;

  /// Returns whether these very spans were loaded last.
  [[nodiscard]] bool holds(const MeshView& mesh) const {
    return count > 0 && mesh.positions.data() == view.positions.data() &&
           mesh.positions.size() == view.positions.size() && mesh.triangles.data() == view.triangles.data() &&
           mesh.triangles.size() == view.triangles.size() && mesh.colours.data() == view.colours.data();
  }
  /// Uploads it, with the curvature at each vertex and a normal that is smooth up to edges of 30 degrees. Context
  /// current.
  void load(const MeshView& mesh);
};

}  // namespace relief::detail
