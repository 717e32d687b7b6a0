#include "mesh_buffers.h"

#include "sample_words.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace relief::detail {

namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

Vec3f facing(std::span<const MeshBuffers::Vertex> all, const std::array<std::uint32_t, 3>& triangle) {
  const auto& [a, b, c] = triangle;
  return cross(all[b].position - all[a].position, all[c].position - all[a].position);
}

/// What the triangles around each vertex give to it.
std::vector<Umbrella> umbrellas(std::span<const MeshBuffers::Vertex> all,
                                std::span<const std::array<std::uint32_t, 3>> triangles) {
  std::vector<Umbrella> sums(all.size());
  for (const auto& [a, b, c] : triangles) {
    const Vec3f ab = all[b].position - all[a].position, ac = all[c].position - all[a].position, bc = ac - ab;
    const Vec3f area = cross(ab, ac);
    for (const std::uint32_t k : {a, b, c}) sums[k].normal += area;
    sums[a].spread += ab + ac;
    sums[b].spread += bc - ab;
    sums[c].spread -= ac + bc;
  }
  return sums;
}

/// Corners of triangles at vertices that may lie on an edge: by vertex, then by triangle.
struct Corner {
  std::uint32_t vertex, triangle, which;
  Vec3f way;  ///< of the triangle
};
std::vector<Corner> corners_at_edges(std::span<const MeshBuffers::Vertex> all,
                                     std::span<const std::array<std::uint32_t, 3>> triangles,
                                     std::span<const Umbrella> sums) {
  // Two ways within 15 degrees of a third are within the 30 of meet_smoothly().
  constexpr float kHalf = 0.966F;
  std::vector<bool> at_edge(all.size());
  for (const auto& triangle : triangles) {
    const Vec3f way = facing(all, triangle);
    for (const std::uint32_t k : triangle) {
      const float along = dot(way, sums[k].normal);
      if (along < 0 || along * along < kHalf * kHalf * dot(way, way) * dot(sums[k].normal, sums[k].normal))
        at_edge[k] = true;
    }
  }
  std::vector<Corner> corners;
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (std::uint32_t k = 0; k < 3; ++k)
      if (at_edge[triangles[t][k]]) corners.push_back({triangles[t][k], t, k, facing(all, triangles[t])});
  std::ranges::stable_sort(corners, {}, &Corner::vertex);
  return corners;
}

/// Gives each vertex at an edge a copy for each group of triangles that meet smoothly, or through others that do.
/// Returns the triangles between the vertices that there are then; `from`: the vertex that each was.
Triangles split_at_edges(std::vector<Corner> corners, std::span<const std::array<std::uint32_t, 3>> triangles,
                         std::vector<MeshBuffers::Vertex>& all, std::vector<std::uint32_t>& from) {
  Triangles split(triangles.begin(), triangles.end());
  const auto meet = [&](std::size_t a, std::size_t b) { return meet_smoothly(corners[a].way, corners[b].way); };
  const auto exchange = [&](std::size_t a, std::size_t b) { std::swap(corners[a], corners[b]); };
  for (std::size_t begin = 0, end = 0; begin < corners.size(); begin = end) {
    const std::uint32_t vertex = corners[begin].vertex;
    while (end < corners.size() && corners[end].vertex == vertex) ++end;
    for (std::size_t first = begin, last = begin; first < end; first = last) {
      last = gather_group(first, end, meet, exchange);
      if (first == begin) continue;  // the first group keeps the vertex
      for (std::size_t k = first; k < last; ++k)
        split[corners[k].triangle][corners[k].which] = static_cast<std::uint32_t>(all.size());
      all.push_back(all[vertex]);
      from.push_back(vertex);
    }
  }
  return split;
}

}  // namespace

void MeshBuffers::load(const MeshView& mesh) {
  Box3d box;
  for (const Vec3d& p : mesh.positions) box.add(p);
  centre = box.empty() ? Vec3d{} : box.centre();
  bounds = box.empty() ? Box3d{{}, {}} : Box3d{box.low - centre, box.high - centre};
  std::vector<Vertex> all(mesh.positions.size());
  for (std::size_t k = 0; k < all.size(); ++k) all[k].position = to_float(mesh.positions[k] - centre);
  std::vector<Umbrella> sums = umbrellas(all, mesh.triangles);
  Triangles split;
  std::vector<std::uint32_t> from;  // of the vertices beyond the mesh's
  if (auto corners = corners_at_edges(all, mesh.triangles, sums); !corners.empty()) {
    split = split_at_edges(std::move(corners), mesh.triangles, all, from);
    sums = umbrellas(all, split);
  }
  const std::span<const std::array<std::uint32_t, 3>> triangles =
      split.empty() ? mesh.triangles : std::span<const std::array<std::uint32_t, 3>>(split);
  const float scale = 0.0044F * static_cast<float>(diagonal(box));  // as of slabs, whose box is about 10 % larger
  for (std::size_t k = 0; k < all.size(); ++k) {
    const auto& [normal, spread] = sums[k];
    const Vec3f n = normalized(normal);
    const auto part = [](float v) { return static_cast<std::uint32_t>(std::lround(v * 511.0F)) & 1023U; };
    all[k].normal = part(n.x) | (part(n.y) << 10U) | (part(n.z) << 20U);
    const float area = length(normal);
    float hollow = area > 0 ? dot(spread, normal) * 1.732F / (area * area) * scale : 0.0F;
    hollow /= 1 + std::abs(hollow);
    const Rgba8 colour = mesh.colours.empty()      ? Rgba8{}
                         : k < mesh.colours.size() ? mesh.colours[k]
                                                   : mesh.colours[from[k - mesh.positions.size()]];
    all[k].colour = static_cast<std::uint32_t>(colour.r) | (static_cast<std::uint32_t>(colour.g) << 8U) |
                    (static_cast<std::uint32_t>(colour.b) << 16U) |
                    (static_cast<std::uint32_t>(std::lround((hollow * 0.5F + 0.5F) * 255)) << 24U);
  }
  const std::size_t index_bytes = triangles.size() * sizeof(triangles[0]);
  vertices = make_buffer(std::max<std::size_t>(all.size(), 1) * sizeof(Vertex), all.empty() ? nullptr : all.data());
  indices = make_buffer(std::max<std::size_t>(index_bytes, 1), triangles.empty() ? nullptr : triangles.data());
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
  count = static_cast<GLsizei>(triangles.size() * 3);
  bytes = all.size() * sizeof(Vertex) + index_bytes;
  view = mesh;
}

}  // namespace relief::detail
