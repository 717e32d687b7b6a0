#include <relief/base/try.h>
#include <relief/mesh/read/gltf_primitive.h>

namespace relief::detail {

Result<std::unique_ptr<GltfPrimitive>> GltfPrimitive::open(const Source& source, GltfBuffers& buffers,
                                                           const Json& json) {
  std::unique_ptr<GltfPrimitive> made(new GltfPrimitive(source, buffers, json));
  const auto mode = whole(json, "mode", kTriangles);
  if (!mode || *mode > kFan) return source.corrupt("a primitive has an unknown mode");
  made->mode_ = *mode;
  const Json* extensions = member(json, "extensions");
  const Json* draco = extensions != nullptr ? member(*extensions, kDracoCompression) : nullptr;
  if (draco == nullptr || !made->has_surface()) return made;

  RELIEF_TRY(const std::string_view packed, buffers.view(whole(*draco, "bufferView")));
  auto unpacked = decode_draco(packed);
  if (!unpacked) return source.error(unpacked.error().code, "its Draco data " + unpacked.error().message);
  made->unpacked_ = *std::move(unpacked);
  const Json* names = member(*draco, "attributes");
  if (names == nullptr || !names->is_object()) return source.corrupt("its Draco data have no list of attributes");
  for (const auto& [name, id] : names->items()) {
    const auto& have = made->unpacked_->attributes;
    const auto at = std::ranges::find_if(
        have, [&](const DracoAttribute& a) { return id.is_number_unsigned() && a.id == id.get<std::uint64_t>(); });
    if (at != have.end()) made->names_.emplace(name, static_cast<std::size_t>(at - have.begin()));
  }
  return made;
}

Result<std::optional<Accessor>> GltfPrimitive::attribute(const std::string& name) const {
  const Json* attributes = member(json_, "attributes");
  const Json* named = attributes != nullptr ? member(*attributes, name.c_str()) : nullptr;
  if (const auto at = names_.find(name); at != names_.end()) {
    Accessor out = unpacked_->attributes[at->second].values(unpacked_->points);
    // The accessor, which has no bytes of its own, says how whole numbers are meant.
    if (named != nullptr) out.normalised = buffers_.normalised(whole(*attributes, name.c_str()));
    return out;
  }
  if (named == nullptr) return std::optional<Accessor>();
  RELIEF_TRY(const Accessor out, buffers_.accessor(whole(*attributes, name.c_str())));
  return out;
}

std::unexpected<Error> GltfPrimitive::no_vertex(std::size_t triangle) const {
  return source_.corrupt("triangle " + std::to_string(triangle) + " names a vertex that its primitive does not have");
}

Result<std::vector<Triangle>> GltfPrimitive::triangles(std::size_t count) const {
  std::vector<Triangle> out;
  if (unpacked_) {
    for (const Triangle& t : unpacked_->triangles)
      if (std::max({t[0], t[1], t[2]}) >= count)
        return no_vertex(static_cast<std::size_t>(&t - unpacked_->triangles.data()));
    return unpacked_->triangles;
  }
  std::size_t corners = count;
  std::optional<Accessor> indices;
  if (member(json_, "indices") != nullptr) {
    RELIEF_TRY(indices, buffers_.accessor(whole(json_, "indices")));
    if (indices->components != 1 || indices->type == kFloat)
      return source_.corrupt("a primitive's indices are no whole numbers");
    corners = indices->count;
  }
  const auto corner = [&](std::size_t k) { return indices ? indices->value(k, 0) : static_cast<double>(k); };
  const std::size_t step = mode_ == kTriangles ? 3 : 1;
  out.reserve(corners / step);
  for (std::size_t k = 0; k + 3 <= corners; k += step) {
    std::array<double, 3> names = {corner(mode_ == kFan ? 0 : k), corner(k + 1), corner(k + 2)};
    if (mode_ == kStrip && k % 2 == 1) std::swap(names[0], names[1]);
    Triangle& triangle = out.emplace_back();
    for (std::size_t c = 0; c < 3; ++c) {
      if (!(names[c] >= 0.0 && names[c] < static_cast<double>(count))) return no_vertex(k / step);
      triangle[c] = static_cast<std::uint32_t>(names[c]);
    }
  }
  return out;
}

}  // namespace relief::detail
