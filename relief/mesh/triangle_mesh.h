// A plain indexed triangle mesh: what scans are read into and models are written from.
#pragma once

#include <relief/base/unit.h>
#include <relief/base/vec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace relief {

using Triangle = std::array<std::uint32_t, 3>;

/// A picture that colours triangles: rows from the top, values sRGB-encoded as its file has them.
struct Image {
  /// at least 1 each
  std::uint32_t width = 0, height = 0;
  std::vector<Rgba8> pixels;  ///< width * height
};

/// What happens to an image beyond its rim.
enum class Wrap : std::uint8_t { Repeat, Mirror, Clamp };

/// The colour of some triangles: that of the image, times `colour`, times the colours of the corners.
struct Material {
  Rgba8 colour;                             ///< sRGB-encoded
  std::shared_ptr<const Image> image = {};  ///< may be null
  /// what lies beyond its edges
  Wrap wrap_u = Wrap::Repeat, wrap_v = Wrap::Repeat;
};

/// Where the corners of a triangle lie in the image of its material: u to the right, v down, 0..1 across the image.
using TriangleUv = std::array<std::array<float, 2>, 3>;

/// Positions in model units, in double so that scans far from the origin keep their detail. Triangles run
/// counter-clockwise seen from outside. `colours` is empty or has one entry per position.
struct TriangleMesh {
  std::vector<Vec3d> positions;     ///< corners, model units
  std::vector<Triangle> triangles;  ///< three corners each, counter-clockwise from outside
  std::vector<Rgba8> colours;       ///< one per corner, or none
  std::optional<Unit> unit =
      std::nullopt;  ///< what one model unit is, where the file says so (glTF: metre, 3MF: its attribute)
  std::vector<Material> materials = {};         ///< what `material_of` names
  std::vector<std::uint32_t> material_of = {};  ///< empty, or one entry of `materials` per triangle
  std::vector<TriangleUv> uvs = {};             ///< empty where no material has an image, else one per triangle
  /// The triangles from here on were not scanned: they close openings. Nothing where nobody said so; what convert mends
  /// says it, also as PLY.
  std::optional<std::size_t> phantom_from = std::nullopt;
  std::vector<std::string> notes = {};  ///< what the file names and could not be had, such as an image; sentences

  /// Returns whether there is no triangle.
  [[nodiscard]] bool empty() const noexcept { return triangles.empty(); }
  /// Returns whether corners or materials have colours.
  [[nodiscard]] bool has_colour() const noexcept { return !colours.empty() || !material_of.empty(); }
};

/// Returns the colour at a place of a triangle, sRGB-encoded, 0..1; white where the mesh has none. `weights` are those
/// of the corners. Images are read between their pixels (bilinear, in the encoded values); products are taken in linear
/// light.
[[nodiscard]] Vec3f colour_at(const TriangleMesh& mesh, std::size_t triangle,
                              const std::array<double, 3>& weights) noexcept;

/// Returns the box of all positions.
[[nodiscard]] Box3d bounds(const TriangleMesh& mesh) noexcept;

/// Returns the sum of the triangles' areas, square model units.
[[nodiscard]] double surface_area(const TriangleMesh& mesh) noexcept;

/// Volume enclosed by a closed mesh, positive when its triangles look outwards; summed about the centre of its box.
[[nodiscard]] double signed_volume(const TriangleMesh& mesh) noexcept;

}  // namespace relief
