#include <relief/base/free_memory.h>
#include <relief/mesh/read/obj_materials.h>

#include <cmath>

namespace relief::detail {
namespace {

/// Returns a path as a Windows program writes it, too.
std::string with_slashes(std::string_view text) {
  std::string path(text);
  std::ranges::replace(path, '\\', '/');
  return path;
}

/// Whether a line of a material names an image for something else than its colour.
bool names_other_image(std::string_view key) noexcept {
  constexpr std::array<std::string_view, 5> kWords = {"bump", "disp", "decal", "norm", "refl"};
  return (key.starts_with("map_") && key != "map_aat") || std::ranges::find(kWords, key) != kWords.end();
}

/// Reads the options of an image into `material` and `place`; returns its name.
std::string_view read_map(TextCursor& text, Material& material, UvPlace& place) {
  text.skip_blanks();
  while (!text.at_line_end() && *text.position() == '-') {
    const std::string_view option = text.word();
    if (option == "-o" || option == "-s" || option == "-t") {
      // One to three numbers; what is not a number up to a blank is the file's name.
      double value = 0;
      for (std::size_t k = 0; k < 3 && text.number(value); ++k)
        if (k < 2 && std::isfinite(value) && option != "-t") (option == "-s" ? place.scale : place.offset)[k] = value;
    } else if (option == "-clamp") {
      material.wrap_u = material.wrap_v = text.word() == "on" ? Wrap::Clamp : Wrap::Repeat;
    } else {
      static_cast<void>(text.word());
      if (option == "-mm") static_cast<void>(text.word());
    }
    text.skip_blanks();
  }
  return trimmed(text.rest());
}

}  // namespace

void ObjMaterials::load_libraries(std::string_view names) {
  names = trimmed(names);
  std::error_code ignored;
  if (const auto whole = beside(source_, with_slashes(names));
      whole && std::filesystem::is_regular_file(*whole, ignored)) {
    read_library(*whole);
    return;
  }
  while (!names.empty()) {
    const std::string_view name = names.substr(0, names.find_first_of(" \t"));
    if (const auto file = beside(source_, with_slashes(name)))
      read_library(*file);
    else
      note_missing("material library '" + printable(name, 120) + "' does not lie beside the mesh");
    names = trimmed(names.substr(name.size()));
  }
}

void ObjMaterials::note_missing(std::string library) {
  image_named_ = true;
  images_.note(std::move(library));
}

void ObjMaterials::read_library(const std::filesystem::path& file) {
  constexpr std::size_t kMostLibraries = 64;
  constexpr std::uintmax_t kMostBytes = 64U << 20U;
  if (read_.size() >= kMostLibraries || std::ranges::find(read_, file) != read_.end()) return;
  read_.push_back(file);
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  const auto bytes = !error && size <= kMostBytes ? source_.read_other(file) : Result<FileBytes>(fail(Errc::Io, {}));
  if (!bytes) {
    note_missing("material library '" + printable(file.filename().string(), 120) +
                 "' cannot be read; its colours are missing");
    return;
  }
  TextCursor text(bytes->view());
  for (; !text.done(); text.next_line()) {
    const std::string_view key = text.word();
    if (key == "newmtl") {
      text.skip_blanks();
      numbers_.insert_or_assign(std::string(trimmed(text.rest())), static_cast<std::uint32_t>(materials_.size()));
      materials_.emplace_back();
      places_.emplace_back();
      maps_.emplace_back();
    } else if (materials_.size() == 1) {
      continue;
    } else if (key == "Kd") {
      std::array<double, 3> values{};
      bool sound = true;
      for (double& value : values) sound = sound && text.number(value);
      Material& material = materials_.back();
      if (sound && material.image == nullptr)
        material.colour = {unit_to_byte(values[0]), unit_to_byte(values[1]), unit_to_byte(values[2])};
    } else if (key == "map_Kd") {
      read_colour_map(text);
    } else if (names_other_image(key)) {
      Material no_material;
      UvPlace no_place;
      if (const std::string_view name = read_map(text, no_material, no_place); !name.empty())
        maps_.back().others.emplace_back(key, name);
    }
  }
}

void ObjMaterials::read_colour_map(TextCursor& text) {
  Material& material = materials_.back();
  const std::string_view name = read_map(text, material, places_.back());
  if (name.empty()) return;
  image_named_ = true;
  maps_.back().colour = name;
  material.image = images_.file(name);
  // Programs write a grey Kd beside an image that is meant as it is.
  if (material.image != nullptr) material.colour = {};
}

std::uint32_t ObjMaterials::find(std::string_view name) {
  name = trimmed(name);
  if (const auto at = numbers_.find(name); at != numbers_.end()) {
    Maps& maps = maps_[at->second];
    for (const auto& [word, image] : maps.others)
      if (image != maps.colour) passed_over_.insert(word);
    maps.others.clear();  // once is enough
    return at->second;
  }
  if (!numbers_.empty()) images_.note("material '" + printable(name, 120) + "' is in no material library");
  return 0;
}

void ObjMaterials::dress(TriangleMesh& mesh, const FaceSink& sink, std::span<const std::array<float, 2>> coordinates) {
  if (one_grey(mesh.material_of, materials_)) free_memory(mesh.material_of);
  settle_paint(mesh, sink, materials_, coordinates, places_, images_);
  if (!coordinates.empty() && !image_named_ && !mesh.has_colour()) images_.note(std::string(kPlacesWithoutImage));
  images_.note_names(std::string(kOtherImages), {passed_over_.begin(), passed_over_.end()});
  if (sink.has_lines()) images_.note(std::string(kOnlyFaces));
  mesh.notes = images_.take_notes();
}

}  // namespace relief::detail
