#include <relief/base/try.h>
#include <relief/mesh/read/colour_space.h>
#include <relief/mesh/read/gltf_pose.h>
#include <relief/mesh/read/images.h>
#include <relief/mesh/read/readers.h>

#include <map>
#include <optional>
#include <set>

namespace relief::detail {
namespace {

constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";

/// Returns the required extensions that are read, or that change nothing here; others are refused by name.
bool is_known(std::string_view name) noexcept {
  constexpr std::array<std::string_view, 7> kNames = {
      "KHR_mesh_quantization", "KHR_lights_punctual", "KHR_animation_pointer", "KHR_xmp_json_ld", kInstancing,
      kMeshoptCompression,     kDracoCompression};
  return std::ranges::find(kNames, name) != kNames.end() || name.starts_with("KHR_materials_") ||
         name.starts_with("KHR_texture_") || name.starts_with("EXT_texture_");
}

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
    buffers_.emplace(source_, root_);
    RELIEF_CHECK(buffers_->open(binary_chunk_));
    nodes_.emplace(source_, root_);
    const Json* images = member(root_, "images");
    images_.emplace(source_, images != nullptr ? images->size() : 0);
    constexpr std::size_t kItem = 16;  // bytes: about what a vertex or a triangle takes
    steps_.emplace(source_.steps(buffers_->total_bytes() / kItem));
    Scene scene(buffers_->total_bytes());
    RELIEF_CHECK(walk(scene));
    if (scene.mesh.triangles.empty()) return source_.error(Errc::UnsupportedFormat, "its scene holds no triangles");
    scene.mesh.unit = Unit::Metre;  // glTF knows no other
    if (!scene.mesh.material_of.empty()) scene.mesh.materials = std::move(materials_);
    note_what_is_left();
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
    constexpr std::size_t kMostNamed = 4;
    std::string unknown;
    std::size_t count = 0;
    for (const Json& entry : *required) {
      const std::string name = entry.is_string() ? entry.get<std::string>() : std::string();
      if (is_known(name)) continue;
      if (++count <= kMostNamed) unknown += (count == 1 ? "" : ", ") + printable(name, 60);
    }
    if (count == 0) return {};
    if (count > kMostNamed) unknown += ", ...";
    return source_.error(Errc::UnsupportedFormat, "needs the glTF extension" + std::string(count == 1 ? " " : "s ") +
                                                      unknown + "; export it without " +
                                                      (count == 1 ? "that extension" : "these"));
  }

  /// All triangle primitives of a mesh, as they stand in it, and which vertices are whose.
  struct Part {
    TriangleMesh mesh;
    std::vector<PrimitiveVertices> primitives;
  };
  Result<const Part*> part(std::uint64_t index) {
    if (const auto known = parts_.find(index); known != parts_.end()) return &known->second;
    const Json* json = element(root_, "meshes", index);
    if (json == nullptr) return source_.corrupt("a node names mesh " + std::to_string(index) + ", which is missing");
    Part made;
    const Json* primitives = member(*json, "primitives");
    for (std::size_t k = 0; primitives != nullptr && primitives->is_array() && k < primitives->size(); ++k) {
      const std::size_t before = made.mesh.positions.size() + made.mesh.triangles.size();
      RELIEF_CHECK(add_primitive((*primitives)[k], made));
      read_ += made.mesh.positions.size() + made.mesh.triangles.size() - before;
      if (read_ > most_read())
        return source_.corrupt("mesh " + std::to_string(index) + " uses its buffers over and over");
    }
    return &parts_.emplace(index, std::move(made)).first->second;
  }

  /// Returns what may be made of buffers that are used over and over.
  [[nodiscard]] std::size_t most_read() const noexcept { return 1'000'000 + 16 * buffers_->total_bytes(); }

  [[nodiscard]] Status add_primitive(const Json& json, Part& part) {
    RELIEF_TRY(std::unique_ptr<GltfPrimitive> primitive, GltfPrimitive::open(source_, *buffers_, json));
    if (!primitive->has_surface()) {
      images_->note(std::string(kOnlyFaces));
      return {};
    }
    RELIEF_TRY(const std::optional<Accessor> positions, primitive->attribute("POSITION"));
    if (!positions) return {};
    if (positions->components != 3) return source_.corrupt("POSITION is no VEC3");
    TriangleMesh& mesh = part.mesh;
    const std::size_t first = mesh.positions.size(), first_triangle = mesh.triangles.size();
    if (first + positions->count > 0xfffffffeU)
      return source_.error(Errc::UnsupportedFormat, "has more than 4294967294 vertices");
    mesh.positions.reserve(first + positions->count);
    for (std::size_t k = 0; k < positions->count; ++k) {
      if (!steps_->next()) return source_.cancelled();
      mesh.positions.push_back(positions->vec3(k));
    }
    RELIEF_CHECK(add_colours(*primitive, first, mesh));
    RELIEF_TRY(const std::vector<Triangle> triangles, primitive->triangles(positions->count));
    const auto shift = static_cast<std::uint32_t>(first);
    for (const auto& [a, b, c] : triangles) {
      if (!steps_->next()) return source_.cancelled();
      mesh.triangles.push_back({a + shift, b + shift, c + shift});
    }
    RELIEF_CHECK(paint(*primitive, {first, positions->count, first_triangle}, mesh));
    part.primitives.push_back({std::move(primitive), first, positions->count});
    return {};
  }

  [[nodiscard]] Status add_colours(const GltfPrimitive& primitive, std::size_t first, TriangleMesh& mesh) {
    RELIEF_TRY(const std::optional<Accessor> colours, primitive.attribute("COLOR_0"));
    if (colours) {
      if (colours->components < 3 || colours->components > 4 || colours->count != mesh.positions.size() - first)
        return source_.corrupt("COLOR_0 does not fit POSITION");
      mesh.colours.resize(first);
      for (std::size_t k = 0; k < colours->count; ++k) {
        if (source_.progress.cancelled()) return source_.cancelled();
        mesh.colours.push_back({srgb_from_linear(colours->value(k, 0)), srgb_from_linear(colours->value(k, 1)),
                                srgb_from_linear(colours->value(k, 2)),
                                colours->components == 4 ? unit_to_byte(colours->value(k, 3)) : std::uint8_t{255}});
      }
    }
    if (!mesh.colours.empty()) mesh.colours.resize(mesh.positions.size());
    return {};
  }

  /// The vertices and triangles that a primitive added.
  struct Added {
    std::size_t first_vertex, vertex_count, first_triangle;
  };
  /// Gives the triangles of a primitive their material and their places in its image.
  [[nodiscard]] Status paint(const GltfPrimitive& primitive, const Added& added, TriangleMesh& mesh) {
    const DressedMaterial dressed = material(whole(primitive.json(), "material"));
    if (dressed.number != 0 || !mesh.material_of.empty()) {
      mesh.material_of.resize(added.first_triangle, 0);
      mesh.material_of.resize(mesh.triangles.size(), dressed.number);
    }
    const bool pictured = materials_[dressed.number].image != nullptr;
    const std::string key = std::string("TEXCOORD_").append(std::to_string(dressed.coordinates));
    std::optional<Accessor> places;
    if (pictured) {
      RELIEF_TRY(places, primitive.attribute(key));
    }
    if (places) {
      if (places->components != 2 || places->count != added.vertex_count)
        return source_.corrupt(key + " does not fit POSITION");
      mesh.uvs.resize(added.first_triangle);
      for (std::size_t t = added.first_triangle; t < mesh.triangles.size(); ++t) {
        if (source_.progress.cancelled()) return source_.cancelled();
        TriangleUv& uv = mesh.uvs.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) {
          const std::size_t vertex = mesh.triangles[t][k] - added.first_vertex;
          uv[k] = dressed.placed(places->value(vertex, 0), places->value(vertex, 1));
        }
      }
    } else if (pictured) {
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
    find_other_images(*json);
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

  /// Gathers which images a material has besides those of colour.
  void find_other_images(const Json& material) {
    const auto look_in = [&](const Json& part) {
      for (const auto& [key, value] : part.items())
        if (key.ends_with("Texture") && key != "baseColorTexture" && key != "diffuseTexture") other_images_.insert(key);
    };
    look_in(material);
    if (const Json* base = member(material, "pbrMetallicRoughness"); base != nullptr) look_in(*base);
    if (const Json* extensions = member(material, "extensions"); extensions != nullptr)
      for (const Json& extension : *extensions) look_in(extension);
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
      return images_->inside(key, buffers_->view(whole(*json, "bufferView")).value_or(std::string_view()));
    }
    const std::string uri = text(*json, "uri");
    if (!uri.starts_with("data:")) return images_->file(decode_percent(uri));
    return images_->inside(key, decode_data_uri(uri).value_or(std::string()));
  }

  /// Adds a node's mesh: bent by its morph targets, then where its skin takes it or where the node stands.
  [[nodiscard]] Status add_mesh(std::uint64_t index, const Json& node, const Placement& place, Scene& scene) {
    const auto mesh = whole(node, "mesh");
    if (!mesh) return source_.corrupt("node " + std::to_string(index) + " names no mesh");
    RELIEF_TRY(const Part* const part, this->part(*mesh));
    RELIEF_TRY(const std::vector<double> weights, morph_weights(node, *mesh));
    const bool skinned = member(node, "skin") != nullptr;
    if (!skinned && weights.empty()) return add_copies(node, part->mesh, place, scene);
    TriangleMesh bent = part->mesh;
    std::size_t work = most_read() - std::min(read_, most_read());
    const std::size_t before = work;
    for (const PrimitiveVertices& vertices : part->primitives)
      RELIEF_CHECK(apply_morphs(source_, *buffers_, vertices, weights, bent.positions, work));
    std::size_t mirrored = 0;
    if (skinned) {
      RELIEF_TRY(const Skin skin, Skin::open(source_, *buffers_, *nodes_, root_, whole(node, "skin")));
      for (const PrimitiveVertices& vertices : part->primitives)
        RELIEF_CHECK(skin.apply(source_, vertices, bent.positions, mirrored, work));
    }
    read_ += before - work;
    if (!skinned) return add_copies(node, bent, place, scene);
    // The joints stand in the scene themselves: the node's own transform says nothing.
    if (!scene.add(bent, {}, 2 * mirrored > bent.positions.size())) return too_large();
    return {};
  }

  /// Returns the node's, else the mesh's; none when all are zero.
  [[nodiscard]] Result<std::vector<double>> morph_weights(const Json& node, std::uint64_t mesh) const {
    const Json* list = member(node, "weights");
    if (list == nullptr) list = member(*element(root_, "meshes", mesh), "weights");
    std::vector<double> weights;
    if (list == nullptr) return weights;
    const bool sound = list->is_array() && std::ranges::all_of(*list, [](const Json& w) { return w.is_number(); });
    if (!sound) return source_.corrupt("the weights of mesh " + std::to_string(mesh) + " are malformed");
    for (const Json& weight : *list) weights.push_back(weight.get<double>());
    if (std::ranges::all_of(weights, [](double w) { return w == 0.0; })) weights.clear();
    return weights;
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
    RELIEF_TRY(const Accessor any, buffers_->accessor(whole(*attributes, attributes->begin().key().c_str())));
    if (any.count > most_read() - read_) return too_large();
    read_ += any.count;
    constexpr std::array<const char*, 3> kKeys = {"TRANSLATION", "ROTATION", "SCALE"};
    std::array<std::optional<Accessor>, 3> given;
    for (std::size_t k = 0; k < kKeys.size(); ++k) {
      if (member(*attributes, kKeys[k]) == nullptr) continue;
      RELIEF_TRY(given[k], buffers_->accessor(whole(*attributes, kKeys[k])));
      if (given[k]->count != any.count || given[k]->components != (k == 1 ? 4 : 3))
        return source_.corrupt(std::string(kKeys[k]) + " does not fit the copies of a node's mesh");
    }
    const auto fill = [&](std::size_t k, std::size_t copy, auto& values) {
      for (std::size_t c = 0; given[k] && c < values.size(); ++c) values[c] = given[k]->value(copy, c);
    };
    for (std::size_t copy = 0; copy < any.count; ++copy) {
      if (source_.progress.cancelled()) return source_.cancelled();
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
    const std::size_t node_count = nodes_->size();
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
          RELIEF_TRY(const Part* const alone, part(k));
          if (!scene.add(alone->mesh, {})) return too_large();
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
      if (source_.progress.cancelled()) return source_.cancelled();
      const Json& node = (*nodes)[visit.node];
      RELIEF_TRY(const Placement own, nodes_->local(visit.node));
      const Placement place = visit.place * own;
      if (member(node, "mesh") != nullptr) RELIEF_CHECK(add_mesh(visit.node, node, place, scene));
      sound = push_all(node, "children", place);
    }
    if (!sound) return source_.corrupt("a list of nodes is malformed");
    return {};
  }

  /// What a user would miss of a file that is read otherwise.
  void note_what_is_left() {
    const auto has = [&](const char* list) {
      const Json* json = member(root_, list);
      return json != nullptr && json->is_array() && !json->empty();
    };
    if (has("animations")) images_->note("its animations were passed over; it stands in the pose of its nodes");
    images_->note_names(std::string(kOtherImages), {other_images_.begin(), other_images_.end()});
    const Json* extensions = member(root_, "extensions");
    if (has("cameras") || (extensions != nullptr && member(*extensions, "KHR_lights_punctual") != nullptr))
      images_->note("cameras or lights were passed over");
    const std::size_t hidden = has("meshes") ? member(root_, "meshes")->size() - parts_.size() : 0;
    if (hidden > 0)
      images_->note(std::to_string(hidden) + (hidden == 1 ? " mesh" : " meshes") + " outside its scene " +
                    (hidden == 1 ? "was" : "were") + " left out");
  }

  [[nodiscard]] std::unexpected<Error> too_large() const {
    return source_.error(Errc::UnsupportedFormat, "its scene repeats parts until it is too large");
  }

  const Source& source_;
  std::optional<std::string_view> binary_chunk_;
  Json root_;
  std::optional<GltfBuffers> buffers_;
  std::optional<NodeTree> nodes_;
  std::optional<Steps> steps_;  ///< by vertices and triangles
  std::map<std::uint64_t, Part> parts_;
  std::optional<ImageStore> images_;
  std::vector<Material> materials_;
  std::map<std::uint64_t, DressedMaterial> dressed_;  ///< by number in the file
  std::size_t read_ = 0;                              ///< vertices and triangles in parts_, and what bent them
  std::set<std::string> other_images_;                ///< keys in the materials
};

}  // namespace

Result<TriangleMesh> read_gltf(const Source& source) { return Reader(source).read(); }

}  // namespace relief::detail
