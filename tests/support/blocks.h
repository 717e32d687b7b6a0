// Solids of unit cubes side by side in a grid, which share faces, edges and corners.
#pragma once

#include <relief/mesh/triangle_mesh.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

namespace relief::testing {

/// A grid of size x size x size cubes, each empty (0) or of one of a few solids; every solid has its whole surface, cut
/// into triangles either way at random, so that a face between two solids is there twice. All of them share vertices.
struct Blocks {
  TriangleMesh mesh;
  std::size_t cubes = 0;         ///< not empty
  std::size_t shared_faces = 0;  ///< between cubes of different solids
};

inline constexpr int kEachItsOwn = 0;  ///< solids: every cube is one

inline Blocks random_blocks(int size, int solids, std::mt19937& random, const std::function<Vec3d(Vec3d)>& place) {
  Blocks blocks;
  const auto points = static_cast<std::uint32_t>(size + 1);
  for (std::uint32_t k = 0; k < points * points * points; ++k)
    blocks.mesh.positions.push_back(
        place({double(k % points), double(k / points % points), double(k / points / points)}));
  std::vector<int> solid;
  for (int k = 0; k < size * size * size; ++k)
    solid.push_back(solids == kEachItsOwn ? static_cast<int>(random() % 2) * (k + 1)
                                          : static_cast<int>(random() % static_cast<unsigned>(solids + 1)));
  using Cell = std::array<int, 3>;
  const auto solid_at = [&](const Cell& c) {
    for (const int x : c)
      if (x < 0 || x >= size) return 0;
    return solid[static_cast<std::size_t>((c[2] * size + c[1]) * size + c[0])];
  };
  for (int k = 0; k < size * size * size; ++k) {
    const Cell cell = {k % size, k / size % size, k / size / size};
    if (solid_at(cell) == 0) continue;
    ++blocks.cubes;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const int side : {0, 1}) {
        Cell beyond = cell;
        beyond[axis] += 2 * side - 1;
        if (solid_at(beyond) == solid_at(cell)) continue;
        if (side == 1 && solid_at(beyond) != 0) ++blocks.shared_faces;
        // Counter-clockwise seen from beyond.
        std::array<std::uint32_t, 4> ring{};
        for (std::size_t corner = 0; corner < 4; ++corner) {
          Cell at = cell;
          at[axis] += side;
          at[(axis + 1) % 3] += corner == 1 || corner == 2 ? 1 : 0;
          at[(axis + 2) % 3] += corner >= 2 ? 1 : 0;
          ring[side == 1 ? corner : 3 - corner] =
              (static_cast<std::uint32_t>(at[2]) * points + static_cast<std::uint32_t>(at[1])) * points +
              static_cast<std::uint32_t>(at[0]);
        }
        const std::size_t turn = random() % 2;
        const auto at = [&](std::size_t corner) { return ring[(corner + turn) % 4]; };
        blocks.mesh.triangles.push_back({at(0), at(1), at(2)});
        blocks.mesh.triangles.push_back({at(0), at(2), at(3)});
      }
  }
  return blocks;
}

}  // namespace relief::testing
