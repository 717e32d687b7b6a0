#include "mesh_buffers.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace relief::detail {

void MeshBuffers::load(const MeshView& mesh) {
  Box3d box;
  for (const Vec3d& p : mesh.positions) box.add(p);
  centre = box.empty() ? Vec3d{} : box.centre();
  bounds = box.empty() ? Box3d{{}, {}} : Box3d{box.low - centre, box.high - centre};
  std::vector<Vertex> all(mesh.positions.size());
  std::vector<Vec3f> normals(all.size()), spreads(all.size());
  for (std::size_t k = 0; k < all.size(); ++k) all[k].position = to_float(mesh.positions[k] - centre);
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3f ab = all[b].position - all[a].position, ac = all[c].position - all[a].position, bc = ac - ab;
    const Vec3f area = cross(ab, ac);
    for (const std::uint32_t k : {a, b, c}) normals[k] += area;
    spreads[a] += ab + ac;
    spreads[b] += bc - ab;
    spreads[c] -= ac + bc;
  }
  const float scale = 0.0044F * static_cast<float>(diagonal(box));  // as of slabs, whose box is about 10 % larger
  for (std::size_t k = 0; k < all.size(); ++k) {
    const Vec3f n = normalized(normals[k]);
    const auto part = [](float v) { return static_cast<std::uint32_t>(std::lround(v * 511.0F)) & 1023U; };
    all[k].normal = part(n.x) | (part(n.y) << 10U) | (part(n.z) << 20U);
    const float area = length(normals[k]);
    float hollow = area > 0 ? dot(spreads[k], normals[k]) * 1.732F / (area * area) * scale : 0.0F;
    hollow /= 1 + std::abs(hollow);
    const Rgba8 colour = mesh.colours.empty() ? Rgba8{} : mesh.colours[k];
    all[k].colour = static_cast<std::uint32_t>(colour.r) | (static_cast<std::uint32_t>(colour.g) << 8U) |
                    (static_cast<std::uint32_t>(colour.b) << 16U) |
                    (static_cast<std::uint32_t>(std::lround((hollow * 0.5F + 0.5F) * 255)) << 24U);
  }
  const std::size_t index_bytes = mesh.triangles.size() * sizeof(mesh.triangles[0]);
  vertices = make_buffer(std::max<std::size_t>(all.size(), 1) * sizeof(Vertex), all.empty() ? nullptr : all.data());
  indices =
      make_buffer(std::max<std::size_t>(index_bytes, 1), mesh.triangles.empty() ? nullptr : mesh.triangles.data());
  array = make_vertex_array();
  glVertexArrayVertexBuffer(array, 0, vertices, 0, sizeof(Vertex));
  glVertexArrayElementBuffer(array, indices);
  for (GLuint k = 0; k < 3; ++k) {
    glEnableVertexArrayAttrib(array, k);
    glVertexArrayAttribBinding(array, k, 0);
  }
  glVertexArrayAttribFormat(array, 0, 3, GL_FLOAT, GL_FALSE, 0);
  glVertexArrayAttribFormat(array, 1, 4, GL_INT_2_10_10_10_REV, GL_TRUE, offsetof(Vertex, normal));
  glVertexArrayAttribFormat(array, 2, 4, GL_UNSIGNED_BYTE, GL_TRUE, offsetof(Vertex, colour));
  count = static_cast<GLsizei>(mesh.triangles.size() * 3);
  bytes = all.size() * sizeof(Vertex) + index_bytes;
  view = mesh;
}

}  // namespace relief::detail
