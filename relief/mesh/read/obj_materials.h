// The materials of an OBJ file: MTL files beside it, and the images that they name.
#pragma once

#include <relief/mesh/read/face_paint.h>

#include <set>

namespace relief::detail {

/// Material 0 is white, for faces without one.
class ObjMaterials {
 public:
  explicit ObjMaterials(const Source& source)
      : source_(source), images_(source, 16), materials_(1), places_(1), maps_(1) {}

  /// The rest of a mtllib line: one name, which may hold blanks, or several without.
  void load_libraries(std::string_view names);
  /// Returns the number of a material; 0 and a note when no library has it.
  [[nodiscard]] std::uint32_t find(std::string_view name);
  [[nodiscard]] bool has_image(std::uint32_t material) const noexcept { return materials_[material].image != nullptr; }

  void note(std::string text) { images_.note(std::move(text)); }

  /// Gives the mesh its materials and what `sink` gathered. `coordinates` are the vt lines. One grey for all is no
  /// colour; for the rest see settle_paint().
  void dress(TriangleMesh& mesh, const FaceSink& sink, std::span<const std::array<float, 2>> coordinates);

 private:
  /// The images that a material names, by its words for them.
  struct Maps {
    std::string colour;
    std::vector<std::pair<std::string, std::string>> others;
  };

  void read_library(const std::filesystem::path& file);
  void read_colour_map(TextCursor& text);
  void note_missing(std::string library);

  const Source& source_;
  ImageStore images_;
  std::vector<Material> materials_;
  std::vector<UvPlace> places_;
  std::vector<Maps> maps_;
  std::set<std::string> passed_over_;  ///< words for images of materials in use
  bool image_named_ = false;           ///< or a library that may name one is missing
  std::map<std::string, std::uint32_t, std::less<>> numbers_;
  std::vector<std::filesystem::path> read_;  ///< libraries
};

}  // namespace relief::detail
