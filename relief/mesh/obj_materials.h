// The materials of an OBJ file: MTL files beside it, and the images that they name.
#pragma once

#include <relief/mesh/images.h>

namespace relief::detail {

/// Material 0 is white, for faces without one.
class ObjMaterials {
 public:
  explicit ObjMaterials(const Source& source) : source_(source), images_(source, 16), materials_(1), places_(1) {}

  /// The rest of a mtllib line: one name, which may hold blanks, or several without.
  void load_libraries(std::string_view names);
  /// The number of a material; 0 and a note when no library has it.
  [[nodiscard]] std::uint32_t find(std::string_view name);
  [[nodiscard]] bool has_image(std::uint32_t material) const noexcept { return materials_[material].image != nullptr; }

  /// Gives the mesh its materials and what `sink` gathered. `coordinates` are the vt lines. Vertex colours yield to
  /// images, plain colours to vertex colours; one grey for all is no colour.
  void dress(TriangleMesh& mesh, const FaceSink& sink, std::span<const std::array<float, 2>> coordinates);

 private:
  /// From the file's coordinates to those of the image, before v is turned round.
  struct Place {
    std::array<double, 2> scale = {1, 1}, offset = {0, 0};
  };
  void read_library(const std::filesystem::path& file);
  void read_map(TextCursor& text);

  const Source& source_;
  ImageStore images_;
  std::vector<Material> materials_;
  std::vector<Place> places_;
  std::map<std::string, std::uint32_t, std::less<>> numbers_;
  std::vector<std::filesystem::path> read_;  ///< libraries
};

}  // namespace relief::detail
