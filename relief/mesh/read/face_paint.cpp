#include <relief/base/free_memory.h>
#include <relief/mesh/read/face_paint.h>

namespace relief::detail {
namespace {

bool is_grey(Rgba8 c) noexcept { return c.r == c.g && c.g == c.b; }

/// One grey for all vertices is what programs write when they have no colour.
bool say_something(const std::vector<Rgba8>& colours) noexcept {
  if (colours.empty()) return false;
  const Rgba8 first = colours.front();
  return !is_grey(first) || std::ranges::any_of(colours, [&](const Rgba8& c) { return c != first; });
}

/// Sets mesh.uvs; returns how many corners with an image have no place in it.
std::size_t lay_images(TriangleMesh& mesh, const FaceSink& sink, std::span<const std::array<float, 2>> coordinates,
                       std::span<const UvPlace> places) {
  std::size_t missing = 0;
  mesh.uvs.resize(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t material = mesh.material_of[t];
    if (mesh.materials[material].image == nullptr) continue;
    const UvPlace place = places.empty() ? UvPlace{} : places[material];
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
  return missing;
}

}  // namespace

std::uint32_t Palette::number_of(Rgba8 colour) {
  colour.a = 255;
  if (colour == Rgba8{}) return 0;
  const auto [at, is_new] = numbers_.try_emplace(std::bit_cast<std::uint32_t>(colour), 0);
  if (is_new) {
    at->second = static_cast<std::uint32_t>(materials_.size());
    materials_.push_back({colour});
  }
  return at->second;
}

bool one_grey(std::span<const std::uint32_t> material_of, std::span<const Material> materials) noexcept {
  if (material_of.empty()) return false;
  const std::uint32_t first = material_of.front();
  return materials[first].image == nullptr && is_grey(materials[first].colour) &&
         std::ranges::all_of(material_of, [&](std::uint32_t m) { return m == first; });
}

void settle_paint(TriangleMesh& mesh, const FaceSink& sink, std::vector<Material> materials,
                  std::span<const std::array<float, 2>> coordinates, std::span<const UvPlace> places,
                  ImageStore& notes) {
  if (mesh.material_of.empty()) return;
  const bool image =
      std::ranges::any_of(mesh.material_of, [&](std::uint32_t m) { return materials[m].image != nullptr; });
  const bool vertices_speak = say_something(mesh.colours);
  if (vertices_speak && !image) {
    notes.note("its faces have colours, too; those of its vertices are used");
    free_memory(mesh.material_of);
    return;
  }
  if (vertices_speak) notes.note("its vertices have colours, too; those of its images are used");
  free_memory(mesh.colours);
  mesh.materials = std::move(materials);
  if (!image) return;
  if (const std::size_t missing = lay_images(mesh, sink, coordinates, places); missing > 0)
    notes.note(std::to_string(missing) + " corners have no place in the image of their material");
}

}  // namespace relief::detail
