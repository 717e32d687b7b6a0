// What colours the faces of one mesh, where its file has several things that could.
#pragma once

#include <relief/mesh/read/images.h>

#include <unordered_map>

namespace relief::detail {

/// Numbers for plain colours, each of which becomes a material the first time it is asked for. White is material 0,
/// which the list starts with.
class Palette {
 public:
  explicit Palette(std::vector<Material>& materials) noexcept : materials_(materials) {}
  [[nodiscard]] std::uint32_t number_of(Rgba8 colour);

 private:
  std::vector<Material>& materials_;
  std::unordered_map<std::uint32_t, std::uint32_t> numbers_;
};

/// The note of a file whose corners have places in an image and that names none.
inline constexpr std::string_view kPlacesWithoutImage =
    "it has places in an image (texture coordinates) and names no image; its surface is plain";

/// Returns whether all triangles have one material and that is a plain grey, white included: what programs write when
/// they have no colour.
[[nodiscard]] bool one_grey(std::span<const std::uint32_t> material_of, std::span<const Material> materials) noexcept;

/// From the coordinates of a file, v upwards, to places in an image: times `scale`, plus `offset`, then v is turned.
struct UvPlace {
  std::array<double, 2> scale = {1, 1}, offset = {0, 0};
};

/// Settles what colours a mesh whose faces `sink` gathered: images before colours of vertices, those before plain
/// colours of faces; one grey that all vertices have yields to both. Sets mesh.materials and mesh.uvs; what yields is
/// dropped, with a note where a user would miss it. `coordinates` are what the sink's numbers name; `places` has one
/// entry per material, or none.
void settle_paint(TriangleMesh& mesh, const FaceSink& sink, std::vector<Material> materials,
                  std::span<const std::array<float, 2>> coordinates, std::span<const UvPlace> places,
                  ImageStore& notes);

}  // namespace relief::detail
