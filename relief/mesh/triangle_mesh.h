// A plain indexed triangle mesh: what scans are read into and models are written from.
#pragma once

#include <relief/base/unit.h>
#include <relief/base/vec.h>

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace relief {

using Triangle = std::array<std::uint32_t, 3>;

/// Positions in model units, in double so that scans far from the origin keep their detail. Triangles run
/// counter-clockwise seen from outside. `colours` is empty or has one entry per position.
struct TriangleMesh {
  std::vector<Vec3d> positions;
  std::vector<Triangle> triangles;
  std::vector<Rgba8> colours;
  std::optional<Unit> unit =
      std::nullopt;  ///< what one model unit is, where the file says so (glTF: metre, 3MF: its attribute)

  [[nodiscard]] bool empty() const noexcept { return triangles.empty(); }
};

/// The box of all positions.
[[nodiscard]] Box3d bounds(const TriangleMesh& mesh) noexcept;

/// Volume enclosed by a closed mesh, positive when its triangles look outwards; summed about the centre of its box.
[[nodiscard]] double signed_volume(const TriangleMesh& mesh) noexcept;

}  // namespace relief
