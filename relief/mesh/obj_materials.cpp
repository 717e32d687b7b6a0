#include <relief/base/free_memory.h>
#include <relief/mesh/obj_materials.h>

#include <cmath>

namespace relief::detail {
namespace {

std::string_view trimmed(std::string_view text) noexcept {
  constexpr std::string_view kBlanks = " \t\v\f\r";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) + 1 - first);
}

/// A path as a Windows program writes it, too.
std::string with_slashes(std::string_view text) {
  std::string path(text);
  std::ranges::replace(path, '\\', '/');
  return path;
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
      images_.note("material library '" + printable(name, 120) + "' does not lie beside the mesh");
    names = trimmed(names.substr(name.size()));
  }
}

void ObjMaterials::read_library(const std::filesystem::path& file) {
  constexpr std::size_t kMostLibraries = 64;
  constexpr std::uintmax_t kMostBytes = 64U << 20U;
  if (read_.size() >= kMostLibraries || std::ranges::find(read_, file) != read_.end()) return;
  read_.push_back(file);
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  const auto bytes = !error && size <= kMostBytes ? read_file(file) : Result<FileBytes>(fail(Errc::Io, {}));
  if (!bytes) {
    images_.note("material library '" + printable(file.filename().string(), 120) +
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
      read_map(text);
    }
  }
}

void ObjMaterials::read_map(TextCursor& text) {
  Material& material = materials_.back();
  Place& place = places_.back();
  text.skip_blanks();
  while (!text.at_line_end() && *text.position() == '-') {
    const std::string_view option = text.word();
    if (option == "-o" || option == "-s" || option == "-t") {
      // One to three numbers; what is no number up to a blank is the file's name.
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
  const std::string_view name = trimmed(text.rest());
  if (name.empty()) return;
  material.image = images_.file(name);
  // Programs write a grey Kd beside an image that is meant as it is.
  if (material.image != nullptr) material.colour = {};
}

std::uint32_t ObjMaterials::find(std::string_view name) {
  name = trimmed(name);
  if (const auto at = numbers_.find(name); at != numbers_.end()) return at->second;
  if (!numbers_.empty()) images_.note("material '" + printable(name, 120) + "' is in no material library");
  return 0;
}

void ObjMaterials::dress(TriangleMesh& mesh, const FaceSink& sink, std::span<const std::array<float, 2>> coordinates) {
  mesh.notes = images_.take_notes();
  if (mesh.material_of.empty()) return;
  const std::uint32_t first = mesh.material_of.front();
  const Material& only = materials_[first];
  const bool one_grey = only.image == nullptr && only.colour.r == only.colour.g && only.colour.g == only.colour.b &&
                        std::ranges::all_of(mesh.material_of, [&](std::uint32_t m) { return m == first; });
  const bool image = std::ranges::any_of(mesh.material_of, [&](std::uint32_t m) { return has_image(m); });
  if (one_grey || (!image && !mesh.colours.empty())) {
    free_memory(mesh.material_of);
    return;
  }
  mesh.materials = materials_;
  if (!image) return;
  free_memory(mesh.colours);
  mesh.uvs.resize(mesh.triangles.size());
  std::size_t missing = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!has_image(mesh.material_of[t])) continue;
    const Place& place = places_[mesh.material_of[t]];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t uv = sink.uvs().empty() ? FaceSink::kNoUv : sink.uvs()[t][k];
      if (uv >= coordinates.size()) {
        ++missing;
        continue;
      }
      const auto [u, v] = coordinates[uv];
      mesh.uvs[t][k] = {static_cast<float>(double{u} * place.scale[0] + place.offset[0]),
                        static_cast<float>(1.0 - (double{v} * place.scale[1] + place.offset[1]))};
    }
  }
  if (missing > 0)
    mesh.notes.push_back(std::to_string(missing) + " corners have no place in the image of their material");
}

}  // namespace relief::detail
