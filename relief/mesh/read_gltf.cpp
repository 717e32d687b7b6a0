#include <relief/base/try.h>
#include <relief/mesh/colour_space.h>
#include <relief/mesh/images.h>
#include <relief/mesh/readers.h>
#include <relief/mesh/scene.h>

#include <nlohmann/json.hpp>

#include <map>
#include <optional>

namespace relief::detail {
namespace {

using Json = nlohmann::json;

const Json* member(const Json& object, const char* key) {
  if (!object.is_object()) return nullptr;
  const auto at = object.find(key);
  return at == object.end() ? nullptr : &*at;
}

/// A whole number that is not negative; `otherwise` when it is missing.
std::optional<std::uint64_t> whole(const Json& object, const char* key, std::optional<std::uint64_t> otherwise = {}) {
  const Json* value = member(object, key);
  if (value == nullptr) return otherwise;
  if (value->is_number_unsigned()) return value->get<std::uint64_t>();
  if (value->is_number_float()) {
    const double real = value->get<double>();
    if (real >= 0.0 && real < 9e15 && std::trunc(real) == real) return static_cast<std::uint64_t>(real);
  }
  return std::nullopt;
}

/// The element of a top-level array, or null.
const Json* element(const Json& root, const char* array, std::optional<std::uint64_t> index) {
  const Json* list = member(root, array);
  return list != nullptr && list->is_array() && index && *index < list->size() ? &(*list)[*index] : nullptr;
}

std::string text(const Json& object, const char* key) {
  const Json* value = member(object, key);
  return value != nullptr && value->is_string() ? value->get<std::string>() : std::string();
}

template <std::size_t kCount>
bool numbers(const Json& object, const char* key, std::array<double, kCount>& values) {
  const Json* list = member(object, key);
  if (list == nullptr) return true;
  if (!list->is_array() || list->size() != kCount) return false;
  for (std::size_t k = 0; k < kCount; ++k) {
    if (!(*list)[k].is_number()) return false;
    values[k] = (*list)[k].template get<double>();
  }
  return true;
}

std::optional<std::string> decode_base64(std::string_view code) {
  std::string out;
  out.reserve(code.size() / 4 * 3);
  std::uint32_t bits = 0;
  int held = 0;
  for (const char c : code) {
    std::uint32_t value = 0;
    if (c >= 'A' && c <= 'Z') {
      value = static_cast<std::uint32_t>(c - 'A');
    } else if (c >= 'a' && c <= 'z') {
      value = static_cast<std::uint32_t>(c - 'a') + 26;
    } else if (c >= '0' && c <= '9') {
      value = static_cast<std::uint32_t>(c - '0') + 52;
    } else if (c == '+' || c == '-') {
      value = 62;
    } else if (c == '/' || c == '_') {
      value = 63;
    } else if (c == '=') {
      break;
    } else {
      return std::nullopt;
    }
    bits = (bits << 6U) | value;
    held += 6;
    if (held >= 8) {
      held -= 8;
      out += static_cast<char>((bits >> static_cast<unsigned>(held)) & 0xffU);
    }
  }
  return out;
}

/// The bytes of data:...;base64,...
std::optional<std::string> decode_data_uri(std::string_view uri) {
  constexpr std::string_view kMark = ";base64,";
  const std::size_t comma = uri.find(kMark);
  if (comma == std::string_view::npos) return std::nullopt;
  return decode_base64(uri.substr(comma + kMark.size()));
}

std::string decode_percent(std::string_view uri) {
  std::string out;
  for (std::size_t k = 0; k < uri.size(); ++k) {
    unsigned value = 0;
    if (uri[k] == '%' && k + 2 < uri.size() &&
        std::from_chars(uri.data() + k + 1, uri.data() + k + 3, value, 16).ptr == uri.data() + k + 3) {
      out += static_cast<char>(value);
      k += 2;
    } else {
      out += uri[k];
    }
  }
  return out;
}

/// A view of typed values inside a buffer, checked against the buffer's end.
struct Accessor {
  const char* data = nullptr;  ///< null: all zero
  std::size_t count = 0;
  std::size_t stride = 0;
  std::uint64_t type = 0;  ///< glTF's number of the component type
  std::size_t components = 0;
  bool normalised = false;

  [[nodiscard]] double value(std::size_t item, std::size_t component) const noexcept {
    if (data == nullptr) return 0.0;
    const char* at = data + item * stride;
    switch (type) {
      case 5120: {
        const auto v = load_le<std::int8_t>(at + component);
        return normalised ? std::max(v / 127.0, -1.0) : v;
      }
      case 5121:
        return load_le<std::uint8_t>(at + component) * (normalised ? 1.0 / 255.0 : 1.0);
      case 5122: {
        const auto v = load_le<std::int16_t>(at + 2 * component);
        return normalised ? std::max(v / 32767.0, -1.0) : v;
      }
      case 5123:
        return load_le<std::uint16_t>(at + 2 * component) * (normalised ? 1.0 / 65535.0 : 1.0);
      case 5125:
        return load_le<std::uint32_t>(at + 4 * component);
      default:
        return double{load_le<float>(at + 4 * component)};
    }
  }
};

constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";

/// A node's or a copy's move, turn (a quaternion x, y, z, w) and scale.
struct Pose {
  std::array<double, 3> move{};
  std::array<double, 4> turn = {0, 0, 0, 1};
  std::array<double, 3> scale = {1, 1, 1};

  [[nodiscard]] Placement placement() const noexcept {
    Placement place;
    const auto [x, y, z, w] = turn;
    const double norm = x * x + y * y + z * z + w * w;
    const double s = norm > 0.0 ? 2.0 / norm : 0.0;
    place.axes = {Vec3d{1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y)} * scale[0],
                  Vec3d{s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x)} * scale[1],
                  Vec3d{s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y)} * scale[2]};
    place.origin = {move[0], move[1], move[2]};
    return place;
  }
};

class Reader {
 public:
  explicit Reader(const Source& source) : source_(source), materials_(1) {}

  Result<TriangleMesh> read() {
    std::string_view json = source_.bytes;
    if (json.starts_with("glTF")) {
      RELIEF_TRY(json, open_glb());
    }
    root_ = Json::parse(json.begin(), json.end(), nullptr, false);
    if (root_.is_discarded() || !root_.is_object()) return source_.corrupt("its JSON part cannot be parsed");
    if (const Json* asset = member(root_, "asset"); asset == nullptr || !text(*asset, "version").starts_with("2")) {
      return source_.error(Errc::UnsupportedFormat, "is not glTF version 2");
    }
    RELIEF_CHECK(check_extensions());
    RELIEF_CHECK(open_buffers());
    const Json* images = member(root_, "images");
    images_.emplace(source_, images != nullptr ? images->size() : 0);
    Scene scene(total_bytes());
    RELIEF_CHECK(walk(scene));
    if (scene.mesh.triangles.empty()) return source_.error(Errc::UnsupportedFormat, "its scene holds no triangles");
    scene.mesh.unit = Unit::Metre;  // glTF knows no other
    if (!scene.mesh.material_of.empty()) scene.mesh.materials = std::move(materials_);
    scene.mesh.notes = images_->take_notes();
    return std::move(scene.mesh);
  }

 private:
  Result<std::string_view> open_glb() {
    std::string_view rest = source_.bytes;
    if (rest.size() < 20) return source_.corrupt("the GLB header is cut off");
    if (load_le<std::uint32_t>(rest.data() + 4) != 2)
      return source_.error(Errc::UnsupportedFormat, "is not GLB version 2");
    const std::size_t total = load_le<std::uint32_t>(rest.data() + 8);
    if (total > rest.size()) {
      return source_.corrupt("declares " + std::to_string(total) + " bytes and has " + std::to_string(rest.size()) +
                             "; it is cut off");
    }
    rest = rest.substr(12, total < 12 ? 0 : total - 12);
    std::optional<std::string_view> json;
    while (rest.size() >= 8) {
      const std::size_t length = load_le<std::uint32_t>(rest.data());
      const auto kind = load_le<std::uint32_t>(rest.data() + 4);
      rest.remove_prefix(8);
      if (length > rest.size()) return source_.corrupt("a chunk is longer than the file");
      const std::string_view chunk = rest.substr(0, length);
      if (kind == 0x4e4f534aU && !json) json = chunk;
      if (kind == 0x004e4942U && !binary_chunk_) binary_chunk_ = chunk;
      rest.remove_prefix(length);
    }
    if (!json) return source_.corrupt("has no JSON chunk");
    return *json;
  }

  [[nodiscard]] Status check_extensions() const {
    const Json* required = member(root_, "extensionsRequired");
    if (required == nullptr || !required->is_array()) return {};
    for (const Json& entry : *required) {
      const std::string name = entry.is_string() ? entry.get<std::string>() : std::string();
      const bool harmless = name == "KHR_mesh_quantization" || name.starts_with("KHR_materials_") ||
                            name.starts_with("KHR_texture_") || name.starts_with("EXT_texture_") ||
                            name == "KHR_lights_punctual" || name == kInstancing;
      if (!harmless) {
        const bool compression = name.find("compression") != std::string::npos;
        return source_.error(Errc::UnsupportedFormat, "needs the glTF extension " + printable(name, 60) +
                                                          "; export it without " +
                                                          (compression ? "compression" : "that extension"));
      }
    }
    return {};
  }

  [[nodiscard]] Status open_buffers() {
    const Json* list = member(root_, "buffers");
    if (list == nullptr || !list->is_array()) return {};
    loaded_.reserve(list->size());
    files_.reserve(list->size());
    for (std::size_t k = 0; k < list->size(); ++k) {
      const Json& buffer = (*list)[k];
      const std::string uri = text(buffer, "uri");
      if (uri.empty()) {
        buffers_.push_back(k == 0 && binary_chunk_ ? *binary_chunk_ : std::string_view());
      } else if (uri.starts_with("data:")) {
        std::optional<std::string> bytes = decode_data_uri(uri);
        if (!bytes) return source_.corrupt("buffer " + std::to_string(k) + " is no base64");
        loaded_.push_back(*std::move(bytes));
        buffers_.emplace_back(loaded_.back());
      } else {
        const auto file = beside(source_, decode_percent(uri));
        if (!file) {
          return source_.error(Errc::UnsupportedFormat,
                               "buffer '" + printable(uri, 60) + "' does not lie beside the file");
        }
        RELIEF_TRY(FileBytes bytes, read_file(*file));
        files_.push_back(std::move(bytes));
        buffers_.push_back(files_.back().view());
      }
      const auto declared = whole(buffer, "byteLength");
      if (!declared || *declared > buffers_.back().size()) {
        return source_.corrupt("buffer " + std::to_string(k) + " is shorter than it declares");
      }
    }
    return {};
  }

  /// `count` items of `item` bytes, `stride` apart (0: packed), in a buffer view from `offset`; null when they do not
  /// fit.
  [[nodiscard]] const char* in_view(std::optional<std::uint64_t> view_index, std::uint64_t offset, std::uint64_t count,
                                    std::size_t item, std::size_t& stride) const {
    const Json* view = element(root_, "bufferViews", view_index);
    if (view == nullptr) return nullptr;
    const auto buffer = whole(*view, "buffer");
    const auto start = whole(*view, "byteOffset", 0);
    const auto length = whole(*view, "byteLength");
    const auto step = whole(*view, "byteStride", 0);
    if (!buffer || *buffer >= buffers_.size() || !start || !length || !step || *step > 65535) return nullptr;
    const std::string_view bytes = buffers_[*buffer];
    if (*start > bytes.size() || *length > bytes.size() - *start || offset > *length) return nullptr;
    stride = *step == 0 ? item : static_cast<std::size_t>(*step);
    const std::uint64_t room = *length - offset;
    if (count != 0 && (item > room || (count - 1) > (room - item) / stride)) return nullptr;
    return bytes.data() + *start + offset;
  }

  Result<Accessor> accessor(std::optional<std::uint64_t> index) {
    const Json* json = element(root_, "accessors", index);
    const auto bad = [&] {
      return source_.corrupt("accessor " + (index ? std::to_string(*index) : std::string("?")) +
                             " is missing or does not fit its buffer");
    };
    if (json == nullptr) return bad();
    Accessor out;
    const auto type = whole(*json, "componentType");
    const auto count = whole(*json, "count");
    const auto offset = whole(*json, "byteOffset", 0);
    const std::string shape = text(*json, "type");
    out.components = shape == "SCALAR" ? 1 : shape == "VEC2" ? 2 : shape == "VEC3" ? 3 : shape == "VEC4" ? 4 : 0;
    if (!type || !count || !offset || out.components == 0 || *type < 5120 || *type > 5126 || *type == 5124)
      return bad();
    constexpr std::array<std::size_t, 7> kSizes = {1, 1, 2, 2, 0, 4, 4};
    const std::size_t item = kSizes[*type - 5120] * out.components;
    out.type = *type;
    out.count = static_cast<std::size_t>(*count);
    out.stride = item;
    if (const Json* flag = member(*json, "normalized")) out.normalised = flag->is_boolean() && flag->get<bool>();
    if (member(*json, "bufferView") != nullptr) {
      out.data = in_view(whole(*json, "bufferView"), *offset, *count, item, out.stride);
      if (out.data == nullptr) return bad();
    } else if (*count > source_.bytes.size()) {
      return bad();  // zeros without any bytes behind them
    }
    const Json* sparse = member(*json, "sparse");
    if (sparse == nullptr) return out;

    const Json* where = member(*sparse, "indices");
    const Json* what = member(*sparse, "values");
    const auto changed = whole(*sparse, "count");
    if (where == nullptr || what == nullptr || !changed || *changed > *count) return bad();
    Accessor places;
    places.components = 1;
    places.type = whole(*where, "componentType", 0).value_or(0);
    if (places.type != 5121 && places.type != 5123 && places.type != 5125) return bad();
    const auto where_offset = whole(*where, "byteOffset", 0);
    const auto what_offset = whole(*what, "byteOffset", 0);
    std::size_t value_stride = 0;
    if (!where_offset || !what_offset) return bad();
    places.data =
        in_view(whole(*where, "bufferView"), *where_offset, *changed, kSizes[places.type - 5120], places.stride);
    const char* values = in_view(whole(*what, "bufferView"), *what_offset, *changed, item, value_stride);
    if (places.data == nullptr || values == nullptr) return bad();
    std::string dense(out.count * item, '\0');
    for (std::size_t k = 0; out.data != nullptr && k < out.count; ++k) {
      std::memcpy(dense.data() + k * item, out.data + k * out.stride, item);
    }
    for (std::size_t k = 0; k < *changed; ++k) {
      const auto place = static_cast<std::size_t>(places.value(k, 0));
      if (place >= out.count) return bad();
      std::memcpy(dense.data() + place * item, values + k * value_stride, item);
    }
    dense_.push_back(std::make_unique<std::string>(std::move(dense)));
    out.data = dense_.back()->data();
    out.stride = item;
    return out;
  }

  /// All triangle primitives of a mesh.
  Result<const TriangleMesh*> part(std::uint64_t index) {
    if (const auto known = parts_.find(index); known != parts_.end()) return &known->second;
    const Json* json = element(root_, "meshes", index);
    if (json == nullptr) return source_.corrupt("a node names mesh " + std::to_string(index) + ", which is missing");
    TriangleMesh mesh;
    const Json* primitives = member(*json, "primitives");
    for (std::size_t k = 0; primitives != nullptr && primitives->is_array() && k < primitives->size(); ++k) {
      const std::size_t before = mesh.positions.size() + mesh.triangles.size();
      RELIEF_CHECK(add_primitive((*primitives)[k], mesh));
      read_ += mesh.positions.size() + mesh.triangles.size() - before;
      if (read_ > most_read()) {
        return source_.corrupt("mesh " + std::to_string(index) + " uses its buffers over and over");
      }
    }
    return &parts_.emplace(index, std::move(mesh)).first->second;
  }

  /// What may be made of buffers that are used over and over.
  [[nodiscard]] std::size_t most_read() const noexcept { return 1'000'000 + 16 * total_bytes(); }
  [[nodiscard]] std::size_t total_bytes() const noexcept {
    std::size_t sum = source_.bytes.size();
    for (const std::string_view buffer : buffers_) sum += buffer.size();
    return sum;
  }

  [[nodiscard]] Status add_primitive(const Json& primitive, TriangleMesh& mesh) {
    const auto mode = whole(primitive, "mode", 4);
    if (!mode || *mode > 6) return source_.corrupt("a primitive has an unknown mode");
    if (*mode < 4) return {};  // points and lines
    if (const Json* extensions = member(primitive, "extensions");
        extensions != nullptr && member(*extensions, "KHR_draco_mesh_compression") != nullptr) {
      return source_.error(Errc::UnsupportedFormat, "is compressed with Draco; export it without compression");
    }
    const Json* attributes = member(primitive, "attributes");
    if (attributes == nullptr || member(*attributes, "POSITION") == nullptr) return {};
    RELIEF_TRY(const Accessor positions, accessor(whole(*attributes, "POSITION")));
    if (positions.components != 3) return source_.corrupt("POSITION is no VEC3");
    const std::size_t first = mesh.positions.size();
    if (first + positions.count > 0xfffffffeU)
      return source_.error(Errc::UnsupportedFormat, "has more than 4294967294 vertices");
    mesh.positions.reserve(first + positions.count);
    for (std::size_t k = 0; k < positions.count; ++k) {
      mesh.positions.push_back({positions.value(k, 0), positions.value(k, 1), positions.value(k, 2)});
    }
    if (member(*attributes, "COLOR_0") != nullptr) {
      RELIEF_TRY(const Accessor colours, accessor(whole(*attributes, "COLOR_0")));
      if (colours.components < 3 || colours.count != positions.count)
        return source_.corrupt("COLOR_0 does not fit POSITION");
      mesh.colours.resize(first);
      for (std::size_t k = 0; k < colours.count; ++k) {
        mesh.colours.push_back({srgb_from_linear(colours.value(k, 0)), srgb_from_linear(colours.value(k, 1)),
                                srgb_from_linear(colours.value(k, 2)),
                                colours.components == 4 ? unit_to_byte(colours.value(k, 3)) : std::uint8_t{255}});
      }
    }
    if (!mesh.colours.empty()) mesh.colours.resize(mesh.positions.size());

    const std::size_t first_triangle = mesh.triangles.size();
    std::size_t corners = positions.count;
    std::optional<Accessor> indices;
    if (member(primitive, "indices") != nullptr) {
      RELIEF_TRY(indices, accessor(whole(primitive, "indices")));
      if (indices->components != 1 || indices->type == 5126)
        return source_.corrupt("a primitive's indices are no whole numbers");
      corners = indices->count;
    }
    const auto corner = [&](std::size_t k) -> double {
      return indices ? indices->value(k, 0) : static_cast<double>(k);
    };
    const std::size_t step = *mode == 4 ? 3 : 1;
    for (std::size_t k = 0; k + 3 <= corners; k += step) {
      std::array<double, 3> names = {corner(*mode == 6 ? 0 : k), corner(k + 1), corner(k + 2)};
      if (*mode == 5 && k % 2 == 1) std::swap(names[0], names[1]);
      Triangle triangle;
      for (std::size_t c = 0; c < 3; ++c) {
        if (!(names[c] >= 0.0 && names[c] < static_cast<double>(positions.count))) {
          return source_.corrupt("triangle " + std::to_string(k / step) +
                                 " names a vertex that its primitive does not have");
        }
        triangle[c] = static_cast<std::uint32_t>(first) + static_cast<std::uint32_t>(names[c]);
      }
      mesh.triangles.push_back(triangle);
    }
    return paint(primitive, *attributes, {first, positions.count, first_triangle}, mesh);
  }

  /// The vertices and triangles that a primitive added.
  struct Added {
    std::size_t first_vertex, vertex_count, first_triangle;
  };
  /// Gives the triangles of a primitive their material and their places in its image.
  [[nodiscard]] Status paint(const Json& primitive, const Json& attributes, const Added& added, TriangleMesh& mesh) {
    const DressedMaterial dressed = material(whole(primitive, "material"));
    if (dressed.number != 0 || !mesh.material_of.empty()) {
      mesh.material_of.resize(added.first_triangle, 0);
      mesh.material_of.resize(mesh.triangles.size(), dressed.number);
    }
    const std::string key = "TEXCOORD_" + std::to_string(dressed.coordinates);
    if (materials_[dressed.number].image != nullptr && member(attributes, key.c_str()) != nullptr) {
      RELIEF_TRY(const Accessor places, accessor(whole(attributes, key.c_str())));
      if (places.components != 2 || places.count != added.vertex_count)
        return source_.corrupt(key + " does not fit POSITION");
      mesh.uvs.resize(added.first_triangle);
      for (std::size_t t = added.first_triangle; t < mesh.triangles.size(); ++t) {
        TriangleUv& uv = mesh.uvs.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) {
          const std::size_t vertex = mesh.triangles[t][k] - added.first_vertex;
          uv[k] = dressed.placed(places.value(vertex, 0), places.value(vertex, 1));
        }
      }
    } else if (materials_[dressed.number].image != nullptr) {
      images_->note("a part with an image has no " + key);
    }
    if (!mesh.uvs.empty()) mesh.uvs.resize(mesh.triangles.size());
    return {};
  }

  /// A material and how it is laid on: which TEXCOORD it uses, and the transform of KHR_texture_transform.
  struct DressedMaterial {
    std::uint32_t number = 0;
    std::uint64_t coordinates = 0;
    std::array<double, 2> offset = {0, 0}, scale = {1, 1};
    double turn = 0;

    [[nodiscard]] std::array<float, 2> placed(double u, double v) const noexcept {
      const double x = u * scale[0], y = v * scale[1], c = std::cos(turn), s = std::sin(turn);
      return {static_cast<float>(offset[0] + c * x + s * y), static_cast<float>(offset[1] - s * x + c * y)};
    }
  };

  /// Material 0 is white; one that changes nothing is material 0, too.
  DressedMaterial material(std::optional<std::uint64_t> index) {
    const Json* json = element(root_, "materials", index);
    if (json == nullptr) return {};
    if (const auto known = dressed_.find(*index); known != dressed_.end()) return known->second;
    const Json* base = member(*json, "pbrMetallicRoughness");
    const char* factor_key = "baseColorFactor";
    const char* texture_key = "baseColorTexture";
    if (const Json* extensions = member(*json, "extensions"); extensions != nullptr) {
      if (const Json* glossy = member(*extensions, "KHR_materials_pbrSpecularGlossiness");
          glossy != nullptr && (base == nullptr || member(*base, texture_key) == nullptr)) {
        base = glossy;
        factor_key = "diffuseFactor";
        texture_key = "diffuseTexture";
      }
    }
    DressedMaterial dressed;
    Material made;
    if (base != nullptr) {
      std::array<double, 4> factor = {1, 1, 1, 1};
      if (numbers(*base, factor_key, factor))
        made.colour = {srgb_from_linear(factor[0]), srgb_from_linear(factor[1]), srgb_from_linear(factor[2])};
      if (const Json* texture = member(*base, texture_key); texture != nullptr) lay_image(*texture, made, dressed);
    }
    if (made.image != nullptr || made.colour != Rgba8{}) {
      dressed.number = static_cast<std::uint32_t>(materials_.size());
      materials_.push_back(std::move(made));
    }
    return dressed_.emplace(*index, dressed).first->second;
  }

  void lay_image(const Json& info, Material& made, DressedMaterial& dressed) {
    const Json* texture = element(root_, "textures", whole(info, "index"));
    if (texture == nullptr) return;
    made.image = image(whole(*texture, "source"));
    dressed.coordinates = whole(info, "texCoord", 0).value_or(0);
    if (const Json* extensions = member(info, "extensions"); extensions != nullptr) {
      if (const Json* transform = member(*extensions, "KHR_texture_transform"); transform != nullptr) {
        if (!numbers(*transform, "offset", dressed.offset) || !numbers(*transform, "scale", dressed.scale))
          images_->note("a texture transform is malformed");
        if (const Json* turn = member(*transform, "rotation"); turn != nullptr && turn->is_number())
          dressed.turn = turn->get<double>();
        dressed.coordinates = whole(*transform, "texCoord", dressed.coordinates).value_or(0);
      }
    }
    const Json* sampler = element(root_, "samplers", whole(*texture, "sampler"));
    const auto wrap = [&](const char* key) {
      const std::uint64_t code = sampler == nullptr ? 10497 : whole(*sampler, key, 10497).value_or(10497);
      return code == 33071 ? Wrap::Clamp : code == 33648 ? Wrap::Mirror : Wrap::Repeat;
    };
    made.wrap_u = wrap("wrapS");
    made.wrap_v = wrap("wrapT");
  }

  std::shared_ptr<const Image> image(std::optional<std::uint64_t> index) {
    const Json* json = element(root_, "images", index);
    if (json == nullptr) {
      images_->note("a texture names no image that can be read");
      return nullptr;
    }
    const std::string key = std::to_string(*index);
    if (member(*json, "bufferView") != nullptr) {
      const auto view = whole(*json, "bufferView");
      const Json* held = element(root_, "bufferViews", view);
      const auto length = held != nullptr ? whole(*held, "byteLength") : std::nullopt;
      std::size_t stride = 0;
      const char* bytes =
          length && *length > 0 ? in_view(view, 0, 1, static_cast<std::size_t>(*length), stride) : nullptr;
      return images_->inside(
          key, bytes != nullptr ? std::string_view(bytes, static_cast<std::size_t>(*length)) : std::string_view());
    }
    const std::string uri = text(*json, "uri");
    if (!uri.starts_with("data:")) return images_->file(decode_percent(uri));
    return images_->inside(key, decode_data_uri(uri).value_or(std::string()));
  }

  [[nodiscard]] Result<Placement> placement(const Json& node) const {
    const auto bad = [&] { return source_.corrupt("a node's transform is malformed"); };
    Placement place;
    if (member(node, "matrix") != nullptr) {
      std::array<double, 16> m{};
      if (!numbers(node, "matrix", m)) return bad();
      place.axes = {Vec3d{m[0], m[1], m[2]}, Vec3d{m[4], m[5], m[6]}, Vec3d{m[8], m[9], m[10]}};
      place.origin = {m[12], m[13], m[14]};
      return place;
    }
    Pose pose;
    if (!numbers(node, "translation", pose.move) || !numbers(node, "rotation", pose.turn) ||
        !numbers(node, "scale", pose.scale))
      return bad();
    return pose.placement();
  }

  /// Adds a node's mesh where it stands; where EXT_mesh_gpu_instancing makes copies of it, each of these.
  [[nodiscard]] Status add_copies(const Json& node, const TriangleMesh& mesh, const Placement& place, Scene& scene) {
    const Json* extensions = member(node, "extensions");
    const Json* instancing = extensions != nullptr ? member(*extensions, kInstancing) : nullptr;
    const Json* attributes = instancing != nullptr ? member(*instancing, "attributes") : nullptr;
    if (attributes == nullptr || !attributes->is_object() || attributes->empty()) {
      if (!scene.add(mesh, place)) return too_large();
      return {};
    }
    RELIEF_TRY(const Accessor any, accessor(whole(*attributes, attributes->begin().key().c_str())));
    if (any.count > most_read() - read_) return too_large();
    read_ += any.count;
    constexpr std::array<const char*, 3> kKeys = {"TRANSLATION", "ROTATION", "SCALE"};
    std::array<std::optional<Accessor>, 3> given;
    for (std::size_t k = 0; k < kKeys.size(); ++k) {
      if (member(*attributes, kKeys[k]) == nullptr) continue;
      RELIEF_TRY(given[k], accessor(whole(*attributes, kKeys[k])));
      if (given[k]->count != any.count || given[k]->components != (k == 1 ? 4 : 3))
        return source_.corrupt(std::string(kKeys[k]) + " does not fit the copies of a node's mesh");
    }
    const auto fill = [&](std::size_t k, std::size_t copy, auto& values) {
      for (std::size_t c = 0; given[k] && c < values.size(); ++c) values[c] = given[k]->value(copy, c);
    };
    for (std::size_t copy = 0; copy < any.count; ++copy) {
      Pose pose;
      fill(0, copy, pose.move);
      fill(1, copy, pose.turn);
      fill(2, copy, pose.scale);
      if (!scene.add(mesh, place * pose.placement())) return too_large();
    }
    return {};
  }

  [[nodiscard]] Status walk(Scene& scene) {
    struct Visit {
      std::uint64_t node;
      Placement place;
    };
    std::vector<Visit> stack;
    const Json* nodes = member(root_, "nodes");
    const std::size_t node_count = nodes != nullptr && nodes->is_array() ? nodes->size() : 0;
    std::vector<bool> seen(node_count, false);
    const auto push_all = [&](const Json& parent, const char* key, const Placement& place) {
      const Json* list = member(parent, key);
      if (list == nullptr || !list->is_array()) return true;
      for (std::size_t k = list->size(); k-- > 0;) {
        if (!(*list)[k].is_number_unsigned()) return false;
        stack.push_back({(*list)[k].get<std::uint64_t>(), place});
      }
      return true;
    };
    bool sound = true;
    if (const Json* chosen = element(root_, "scenes", whole(root_, "scene", 0)); chosen != nullptr) {
      sound = push_all(*chosen, "nodes", {});
    } else {
      std::vector<bool> child(node_count, false);
      for (std::size_t k = 0; k < node_count; ++k) {
        const Json* list = member((*nodes)[k], "children");
        for (std::size_t c = 0; list != nullptr && list->is_array() && c < list->size(); ++c) {
          if ((*list)[c].is_number_unsigned() && (*list)[c].get<std::uint64_t>() < node_count)
            child[(*list)[c].get<std::uint64_t>()] = true;
        }
      }
      for (std::size_t k = node_count; k-- > 0;)
        if (!child[k]) stack.push_back({k, {}});
      // A file without a scene may still hold meshes.
      if (node_count == 0) {
        const Json* meshes = member(root_, "meshes");
        for (std::size_t k = 0; meshes != nullptr && meshes->is_array() && k < meshes->size(); ++k) {
          RELIEF_TRY(const TriangleMesh* mesh, part(k));
          if (!scene.add(*mesh, {})) return too_large();
        }
      }
    }
    while (sound && !stack.empty()) {
      const Visit visit = stack.back();
      stack.pop_back();
      if (visit.node >= node_count || seen[visit.node]) {
        return source_.corrupt("node " + std::to_string(visit.node) + " is missing or stands twice in the scene");
      }
      seen[visit.node] = true;
      const Json& node = (*nodes)[visit.node];
      RELIEF_TRY(const Placement own, placement(node));
      const Placement place = visit.place * own;
      if (member(node, "mesh") != nullptr) {
        const auto index = whole(node, "mesh");
        if (!index) return source_.corrupt("node " + std::to_string(visit.node) + " names no mesh");
        RELIEF_TRY(const TriangleMesh* mesh, part(*index));
        RELIEF_CHECK(add_copies(node, *mesh, place, scene));
      }
      sound = push_all(node, "children", place);
    }
    if (!sound) return source_.corrupt("a list of nodes is malformed");
    return {};
  }

  [[nodiscard]] std::unexpected<Error> too_large() const {
    return source_.error(Errc::UnsupportedFormat, "its scene repeats parts until it is too large");
  }

  const Source& source_;
  std::optional<std::string_view> binary_chunk_;
  Json root_;
  std::vector<std::string> loaded_;
  std::vector<FileBytes> files_;
  std::vector<std::string_view> buffers_;
  std::vector<std::unique_ptr<std::string>> dense_;
  std::map<std::uint64_t, TriangleMesh> parts_;
  std::optional<ImageStore> images_;
  std::vector<Material> materials_;
  std::map<std::uint64_t, DressedMaterial> dressed_;  ///< by number in the file
  std::size_t read_ = 0;                              ///< vertices and triangles in parts_
};

}  // namespace

Result<TriangleMesh> read_gltf(const Source& source) { return Reader(source).read(); }

}  // namespace relief::detail
