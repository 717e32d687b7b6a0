#include <relief/base/free_memory.h>
#include <relief/base/try.h>
#include <relief/mesh/read/colour_space.h>
#include <relief/mesh/read/face_paint.h>
#include <relief/mesh/read/readers.h>
#include <relief/mesh/read/scene.h>
#include <relief/mesh/read/zip.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>

namespace relief::detail {
namespace {

/// Steps through the tags of an XML text. Text between tags, comments and instructions are passed over; a document type
/// is refused, so entities cannot grow.
class XmlTags {
 public:
  /// A byte is a step.
  XmlTags(std::string_view text, Steps& steps) noexcept : text_(text), steps_(steps) {}

  /// To the next tag; false at the end, where the XML breaks (then broken() holds), or when the work is cancelled.
  bool next() {
    while (true) {
      if (!steps_.reached(at_)) return false;
      const std::size_t open = text_.find('<', at_);
      if (open == std::string_view::npos) {
        at_ = text_.size();
        return false;
      }
      at_ = open + 1;
      const std::string_view rest = text_.substr(at_);
      if (rest.starts_with("!--")) {
        if (!skip_past("-->")) return false;
      } else if (rest.starts_with("![CDATA[")) {
        if (!skip_past("]]>")) return false;
      } else if (rest.starts_with('?')) {
        if (!skip_past("?>")) return false;
      } else if (rest.starts_with('!')) {
        return fail_here();
      } else {
        return read_tag();
      }
    }
  }
  [[nodiscard]] bool broken() const noexcept { return broken_; }
  /// Returns the name without its namespace prefix.
  [[nodiscard]] std::string_view name() const noexcept { return name_; }
  [[nodiscard]] bool closing() const noexcept { return closing_; }
  /// <a/>: opens and closes at once.
  [[nodiscard]] bool single() const noexcept { return single_; }
  /// Returns the value of an attribute, by its name without prefix; empty when missing.
  [[nodiscard]] std::string_view attribute(std::string_view wanted) const noexcept {
    std::string_view rest = attributes_;
    while (true) {
      const std::size_t equals = rest.find('=');
      if (equals == std::string_view::npos) return {};
      const std::string_view key = trim(rest.substr(0, equals));
      const std::size_t quote = rest.find_first_of("\"'", equals);
      if (quote == std::string_view::npos) return {};
      const std::size_t end = rest.find(rest[quote], quote + 1);
      if (end == std::string_view::npos) return {};
      if (local(key) == wanted) return rest.substr(quote + 1, end - quote - 1);
      rest.remove_prefix(end + 1);
    }
  }

 private:
  static bool space(char c) noexcept { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
  static std::string_view trim(std::string_view s) noexcept {
    while (!s.empty() && space(s.front())) s.remove_prefix(1);
    while (!s.empty() && space(s.back())) s.remove_suffix(1);
    return s;
  }
  static std::string_view local(std::string_view name) noexcept {
    const std::size_t colon = name.rfind(':');
    return colon == std::string_view::npos ? name : name.substr(colon + 1);
  }
  bool fail_here() noexcept {
    broken_ = true;
    at_ = text_.size();
    return false;
  }
  bool skip_past(std::string_view end) noexcept {
    const std::size_t found = text_.find(end, at_);
    if (found == std::string_view::npos) return fail_here();
    at_ = found + end.size();
    return true;
  }
  bool read_tag() noexcept {
    // A > inside quotes does not end the tag.
    std::size_t end = at_;
    char quote = 0;
    for (; end < text_.size() && (quote != 0 || text_[end] != '>'); ++end) {
      const char c = text_[end];
      if (quote == 0 && (c == '"' || c == '\'')) {
        quote = c;
      } else if (c == quote) {
        quote = 0;
      } else if (c == '<') {
        return fail_here();
      }
    }
    if (end == text_.size()) return fail_here();
    std::string_view tag = text_.substr(at_, end - at_);
    at_ = end + 1;
    closing_ = tag.starts_with('/');
    if (closing_) tag.remove_prefix(1);
    single_ = tag.ends_with('/');
    if (single_) tag.remove_suffix(1);
    const std::size_t cut = tag.find_first_of(" \t\r\n");
    name_ = local(tag.substr(0, cut));
    attributes_ = cut == std::string_view::npos ? std::string_view() : tag.substr(cut);
    return true;
  }

  std::string_view text_, name_, attributes_;
  Steps& steps_;
  std::size_t at_ = 0;
  bool closing_ = false, single_ = false, broken_ = false;
};

bool to_number(std::string_view text, double& value) noexcept {
  TextCursor cursor(text);
  return cursor.number(value) && cursor.at_line_end();
}

std::optional<std::uint32_t> to_index(std::string_view text) noexcept {
  std::uint32_t value = 0;
  const auto [stop, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc() || stop != text.data() + text.size()) return std::nullopt;
  return value;
}

/// #RRGGBB or #RRGGBBAA.
std::optional<Rgba8> to_colour(std::string_view text) noexcept {
  if (!text.starts_with('#') || (text.size() != 7 && text.size() != 9)) return std::nullopt;
  std::uint32_t value = 0;
  const auto [stop, code] = std::from_chars(text.data() + 1, text.data() + text.size(), value, 16);
  if (code != std::errc() || stop != text.data() + text.size()) return std::nullopt;
  if (text.size() == 7) value = (value << 8U) | 0xffU;
  const auto byte = [&](unsigned shift) { return static_cast<std::uint8_t>((value >> shift) & 0xffU); };
  return Rgba8{byte(24), byte(16), byte(8), byte(0)};
}

/// "m00 m01 m02 m10 ... m32", rows of a matrix that row vectors are multiplied with.
bool to_placement(std::string_view text, Placement& place) noexcept {
  if (text.empty()) return true;
  std::array<double, 12> m{};
  TextCursor cursor(text);
  for (double& value : m)
    if (!cursor.skip_to_value() || !cursor.number(value)) return false;
  place.axes = {Vec3d{m[0], m[1], m[2]}, Vec3d{m[3], m[4], m[5]}, Vec3d{m[6], m[7], m[8]}};
  place.origin = {m[9], m[10], m[11]};
  return true;
}

std::string unescape(std::string_view text) {
  constexpr std::string_view kAmpersand = "&amp;";
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    out += text[at];
    at += text.substr(at).starts_with(kAmpersand) ? kAmpersand.size() : 1;
  }
  return out;
}

/// Holds what 3MF calls its units. Numbers in one that Relief does not have become millimetres: times `factor` over
/// `divisor` (0.001 itself is no double).
struct ModelUnit {
  std::string_view name;
  double factor, divisor;
  Unit unit;
};
constexpr std::array<ModelUnit, 6> kModelUnits = {{{"millimeter", 1.0, 1.0, Unit::Millimetre},
                                                   {"centimeter", 1.0, 1.0, Unit::Centimetre},
                                                   {"meter", 1.0, 1.0, Unit::Metre},
                                                   {"micron", 1.0, 1000.0, Unit::Millimetre},
                                                   {"inch", 1.0, 1.0, Unit::Inch},
                                                   {"foot", 304.8, 1.0, Unit::Millimetre}}};

struct Reference {
  std::string model;  ///< the part of the archive that holds the object
  std::uint32_t id = 0;
  Placement place;
};

/// Says how the surface looks at one corner: a colour, times that of an image when there is one.
struct Look {
  Rgba8 colour;
  std::uint32_t texture = 0;        ///< 0: none
  std::array<float, 2> place = {};  ///< in the image: to the right, down
  bool operator==(const Look&) const = default;
};
using CornerLooks = std::array<Look, 3>;

struct Texture {
  std::shared_ptr<const Image> image;
  Wrap wrap_u = Wrap::Repeat, wrap_v = Wrap::Repeat;
};

Wrap to_wrap(std::string_view style) noexcept {
  return style == "mirror" ? Wrap::Mirror : style == "clamp" || style == "none" ? Wrap::Clamp : Wrap::Repeat;
}

/// Calls `each` with the whole numbers of a list such as "0 1 7"; what is not a number ends it.
template <typename Each>
void for_each_index(std::string_view list, Each&& each) {
  TextCursor cursor(list);
  for (std::int64_t index = 0; !cursor.at_line_end() && cursor.integer(index, true) && index >= 0;)
    each(static_cast<std::size_t>(index));
}

/// A sum of colours in linear light.
class Light {
 public:
  void add(Rgba8 colour, double share) noexcept {
    sum_[0] += share * decode_srgb(colour.r / 255.0);
    sum_[1] += share * decode_srgb(colour.g / 255.0);
    sum_[2] += share * decode_srgb(colour.b / 255.0);
    all_ += share;
  }
  /// Returns the mean; white of nothing.
  [[nodiscard]] Rgba8 colour() const noexcept {
    if (!(all_ > 0.0)) return {};
    const auto byte = [&](double x) { return srgb_from_linear(x / all_); };
    return {byte(sum_[0]), byte(sum_[1]), byte(sum_[2])};
  }

 private:
  std::array<double, 3> sum_{};
  double all_ = 0.0;
};

Rgba8 product(Rgba8 a, Rgba8 b) noexcept {
  const auto channel = [](std::uint8_t x, std::uint8_t y) {
    return srgb_from_linear(decode_srgb(x / 255.0) * decode_srgb(y / 255.0));
  };
  return {channel(a.r, b.r), channel(a.g, b.g), channel(a.b, b.b)};
}

/// Two layers of a multi-property. Mixing takes the upper one as far as it is opaque; an image is, wholly.
Look blended(const Look& lower, const Look& upper, bool multiply) noexcept {
  if (multiply) {
    Look look = upper.texture != 0 ? upper : lower;
    look.colour = product(lower.colour, upper.colour);
    return look;
  }
  if (upper.texture != 0) return upper;
  // A veil over an image would need an image of its own: one that covers less than half is left out.
  const double opaque = upper.colour.a / 255.0;
  if (lower.texture != 0) return opaque < 0.5 ? lower : upper;
  Light mixed;
  mixed.add(lower.colour, 1.0 - opaque);
  mixed.add(upper.colour, opaque);
  return {mixed.colour()};
}

/// Returns whether two layers would need an image of their own, which blended() does not make.
bool need_new_image(const Look& lower, const Look& upper, bool multiply) noexcept {
  if (lower.texture == 0) return false;
  if (multiply) return upper.texture != 0;
  return upper.texture == 0 && upper.colour.a > 0 && upper.colour.a < 255;
}

struct Object {
  TriangleMesh mesh;
  std::vector<Reference> components;
  bool support = false, placed = false;
};

class Reader {
 public:
  Reader(const Source& source, ZipArchive archive)
      : source_(source), archive_(std::move(archive)), images_(source, 16), textures_(1), materials_(1) {}

  Result<TriangleMesh> read() {
    RELIEF_TRY(const std::string root, root_model());
    RELIEF_CHECK(read_model(root, true));
    if (items_.empty()) return source_.error(Errc::UnsupportedFormat, "has nothing in its build list");
    Scene scene(source_.bytes.size() + unpacked_);
    for (const Reference& item : items_) RELIEF_CHECK(place(item, Placement{}, 0, scene));
    if (scene.mesh.triangles.empty())
      return source_.error(Errc::UnsupportedFormat, "its build list holds no triangles");
    if (unit_ != nullptr) {
      scene.mesh.unit = unit_->unit;
      if (unit_->factor != unit_->divisor) {
        for (Vec3d& p : scene.mesh.positions)
          for (std::size_t axis = 0; axis < 3; ++axis) p[axis] = p[axis] * unit_->factor / unit_->divisor;
      }
    }
    if (one_grey(scene.mesh.material_of, materials_)) free_memory(scene.mesh.material_of);
    if (!scene.mesh.material_of.empty()) scene.mesh.materials = std::move(materials_);
    if (left_out_ > 0)
      images_.note(std::to_string(left_out_) + " objects that the file marks as support or other were left out");
    else
      note_unbuilt();
    images_.note_names(std::string(kOtherImages), {other_images_.begin(), other_images_.end()});
    scene.mesh.notes = images_.take_notes();
    return std::move(scene.mesh);
  }

 private:
  void note_unbuilt() {
    const auto unbuilt = std::ranges::count_if(objects_, [](const auto& entry) {
      return !entry.second.placed && !entry.second.support && !entry.second.mesh.triangles.empty();
    });
    if (unbuilt > 0)
      images_.note(std::to_string(unbuilt) + (unbuilt == 1 ? " object that is" : " objects that are") +
                   " not in its build list " + (unbuilt == 1 ? "was" : "were") + " left out");
  }

  Result<std::string> root_model() {
    std::string name = "3D/3dmodel.model";
    if (const ZipMember* relations = archive_.find("_rels/.rels")) {
      RELIEF_TRY(const std::string text, unpack(*relations));
      Steps steps(source_.progress, kImport, text.size(), kReadShare, kReadShare);
      XmlTags tags(text, steps);
      while (tags.next()) {
        if (tags.name() == "Relationship" && tags.attribute("Type").ends_with("/3dmodel")) {
          name = unescape(tags.attribute("Target"));
          break;
        }
      }
    }
    if (archive_.find(name) == nullptr) {
      return source_.error(Errc::UnsupportedFormat, "is a zip archive without a 3MF model inside");
    }
    return name;
  }

  [[nodiscard]] Result<std::string> unpack(const ZipMember& member) {
    Steps steps(source_.progress, kImport, member.packed_size, kReadShare, kUnpackedShare);
    return archive_.unpack(source_, member, steps);
  }

  /// Extensions that a part says are required: without them its shape is another.
  [[nodiscard]] Status check_required(const XmlTags& tags, const std::string& model) const {
    constexpr std::array<std::string_view, 3> kRead = {"/material/", "/production/", "/trianglesets/"};
    std::string_view rest = tags.attribute("requiredextensions");
    while (!rest.empty()) {
      const std::string_view prefix = rest.substr(0, rest.find(' '));
      rest.remove_prefix(std::min(rest.size(), prefix.size() + 1));
      const std::string_view space = prefix.empty() ? prefix : tags.attribute(prefix);  // by its xmlns
      const bool is_read =
          std::ranges::any_of(kRead, [&](std::string_view known) { return space.find(known) != space.npos; });
      if (!prefix.empty() && !is_read)
        return source_.error(Errc::UnsupportedFormat, "part '" + printable(model, 80) + "' requires the extension " +
                                                          printable(space.empty() ? prefix : space, 100) +
                                                          ", which is not read; export it as plain triangles");
    }
    return {};
  }

  /// Reads one model part; only the root's build list and unit count.
  [[nodiscard]] Status read_model(const std::string& model, bool root) {
    if (std::ranges::find(read_models_, model) != read_models_.end()) return {};
    read_models_.push_back(model);
    const ZipMember* member = archive_.find(model);
    if (member == nullptr) return source_.corrupt("part '" + printable(model, 80) + "' is missing");
    RELIEF_TRY(const std::string text, unpack(*member));
    unpacked_ += text.size();
    looks_.clear();
    texture_numbers_.clear();
    if (text.contains(" paint_color=\"") || text.contains(":mmu_segmentation=\""))
      images_.note("colours that were painted in a slicer (paint_color) are in a form of its own and were passed over");
    Steps steps = source_.steps(text.size());
    XmlTags tags(text, steps);
    while (tags.next()) {
      if (tags.closing()) continue;
      if (tags.name() == "model") {
        RELIEF_CHECK(check_required(tags, model));
        if (root) read_unit(tags.attribute("unit"));
      } else if (tags.name() == "texture2d") {
        read_texture(tags);
      } else if (is_group(tags.name())) {
        RELIEF_CHECK(read_group(tags));
      } else if (tags.name().starts_with("pb")) {
        for (const std::string_view image :
             {"metallictextureid", "roughnesstextureid", "speculartextureid", "glossinesstextureid"})
          if (!tags.attribute(image).empty()) other_images_.emplace(image);
      } else if (tags.name() == "object") {
        RELIEF_CHECK(read_object(tags, model));
      } else if (tags.name() == "item" && root) {
        RELIEF_TRY(Reference item, reference(tags, model));
        items_.push_back(std::move(item));
      }
    }
    if (steps.stopped()) return source_.cancelled();
    if (tags.broken()) return source_.corrupt("the XML of part '" + printable(model, 80) + "' is broken");
    return {};
  }

  /// Millimetres when the attribute is missing, as 3MF has it; a name that 3MF does not know leaves the unit open.
  void read_unit(std::string_view name) noexcept {
    if (name.empty()) name = "millimeter";
    const auto known = std::ranges::find(kModelUnits, name, &ModelUnit::name);
    unit_ = known == kModelUnits.end() ? nullptr : &*known;
  }

  void read_texture(const XmlTags& tags) {
    const auto id = to_index(tags.attribute("id"));
    const std::string path = unescape(tags.attribute("path"));
    std::shared_ptr<const Image> image;
    if (const ZipMember* member = archive_.find(path); member != nullptr) {
      if (const auto bytes = unpack(*member))
        image = images_.inside(path, *bytes);
      else
        images_.note("image '" + printable(path, 120) + "' is damaged; its surface is plain");
    } else {
      images_.note("image '" + printable(path, 120) + "' is not in the file; its surface is plain");
    }
    if (!id || image == nullptr) return;
    texture_numbers_[*id] = static_cast<std::uint32_t>(textures_.size());
    textures_.push_back(
        {std::move(image), to_wrap(tags.attribute("tilestyleu")), to_wrap(tags.attribute("tilestylev"))});
  }

  static bool is_group(std::string_view name) noexcept {
    return name == "colorgroup" || name == "basematerials" || name == "texture2dgroup" ||
           name == "compositematerials" || name == "multiproperties";
  }

  /// Returns a list of looks that triangles name by number.
  [[nodiscard]] Status read_group(XmlTags& tags) {
    const std::string group_name(tags.name());
    const auto id = to_index(tags.attribute("id"));
    if (!id) return source_.corrupt("a group of colours has no number");
    std::vector<Look> group;
    const auto texture = texture_numbers_.find(to_index(tags.attribute("texid")).value_or(0));
    std::vector<const std::vector<Look>*> layers;  // of a multi-property, from below
    std::vector<std::size_t> parts;                // of a composite, in the list of base materials
    for_each_index(tags.attribute("pids"), [&](std::size_t layer) { layers.push_back(looks(layer)); });
    const std::vector<Look>* bases = looks(to_index(tags.attribute("matid")).value_or(0));
    for_each_index(tags.attribute("matindices"), [&](std::size_t part) { parts.push_back(part); });
    const std::string methods(tags.attribute("blendmethods"));
    if (tags.single()) return {};
    while (tags.next() && !(tags.closing() && tags.name() == group_name)) {
      if (tags.closing()) continue;
      if (tags.name() == "color") {
        group.push_back({to_colour(tags.attribute("color")).value_or(Rgba8{})});
      } else if (tags.name() == "base") {
        group.push_back({to_colour(tags.attribute("displaycolor")).value_or(Rgba8{})});
      } else if (tags.name() == "tex2coord") {
        double u = 0.0, v = 0.0;
        static_cast<void>(to_number(tags.attribute("u"), u) && to_number(tags.attribute("v"), v));
        Look& look = group.emplace_back();
        look.place = {static_cast<float>(u), static_cast<float>(1.0 - v)};
        look.texture = texture == texture_numbers_.end() ? 0 : texture->second;
      } else if (tags.name() == "composite") {
        group.push_back(composite(bases, parts, tags.attribute("values")));
      } else if (tags.name() == "multi") {
        group.push_back(multi(layers, methods, tags.attribute("pindices")));
      }
    }
    looks_.insert_or_assign(*id, std::move(group));
    return {};
  }

  [[nodiscard]] const std::vector<Look>* looks(std::size_t group) const noexcept {
    const auto found = looks_.find(static_cast<std::uint32_t>(group));
    return found == looks_.end() ? nullptr : &found->second;
  }

  /// Returns the mean of base materials by their shares.
  static Look composite(const std::vector<Look>* bases, const std::vector<std::size_t>& parts,
                        std::string_view values) {
    Light mixed;
    double share = 0.0;
    TextCursor cursor(values);
    for (const std::size_t part : parts) {
      if (bases == nullptr || part >= bases->size() || cursor.at_line_end() || !cursor.number(share)) break;
      if (share > 0.0 && std::isfinite(share)) mixed.add((*bases)[part].colour, share);
    }
    return {mixed.colour()};
  }

  /// Returns one look of each layer, laid over one another; a layer that is not there is passed over.
  Look multi(std::span<const std::vector<Look>* const> layers, std::string_view methods, std::string_view indices) {
    Look sum;
    std::size_t layer = 0;
    TextCursor words(methods);
    for_each_index(indices, [&](std::size_t index) {
      const bool multiply = layer > 0 && !words.at_line_end() && words.word() == "multiply";
      const std::vector<Look>* const group = layer < layers.size() ? layers[layer] : nullptr;
      if (group != nullptr && index < group->size()) {
        const Look& upper = (*group)[index];
        if (layer > 0 && need_new_image(sum, upper, multiply))
          images_.note("layers over an image could not be mixed with it; only one of them shows");
        sum = layer == 0 ? upper : blended(sum, upper, multiply);
      }
      ++layer;
    });
    return sum;
  }

  [[nodiscard]] Result<Reference> reference(const XmlTags& tags, const std::string& model) const {
    Reference out;
    const auto id = to_index(tags.attribute("objectid"));
    if (!id || !to_placement(tags.attribute("transform"), out.place)) {
      return source_.corrupt("a reference to an object is malformed");
    }
    out.id = *id;
    const std::string_view path = tags.attribute("path");
    out.model = path.empty() ? model : unescape(path);
    return out;
  }

  [[nodiscard]] Status read_object(XmlTags& tags, const std::string& model) {
    const auto id = to_index(tags.attribute("id"));
    if (!id) return source_.corrupt("an object has no number");
    const std::string_view type = tags.attribute("type");
    Object object;
    object.support = type == "support" || type == "other";
    const auto group = to_index(tags.attribute("pid"));
    const auto group_index = to_index(tags.attribute("pindex"));
    const std::string where = "object " + std::to_string(*id) + ": ";
    TriangleMesh& mesh = object.mesh;
    std::vector<CornerLooks> looks_of;  // as far as any triangle has one
    const bool hollow = tags.single();
    while (!hollow && tags.next() && !(tags.closing() && tags.name() == "object")) {
      if (tags.closing()) continue;
      if (tags.name() == "vertex") {
        Vec3d p;
        if (!to_number(tags.attribute("x"), p.x) || !to_number(tags.attribute("y"), p.y) ||
            !to_number(tags.attribute("z"), p.z)) {
          return source_.corrupt(where + "vertex " + std::to_string(mesh.positions.size()) + " lacks three numbers");
        }
        mesh.positions.push_back(p);
      } else if (tags.name() == "triangle") {
        Triangle triangle{};
        constexpr std::array<std::string_view, 3> kCorners = {"v1", "v2", "v3"};
        constexpr std::array<std::string_view, 3> kLooks = {"p1", "p2", "p3"};
        for (std::size_t k = 0; k < 3; ++k) {
          const auto corner = to_index(tags.attribute(kCorners[k]));
          if (!corner || *corner >= mesh.positions.size()) {
            return source_.corrupt(where + "triangle " + std::to_string(mesh.triangles.size()) +
                                   " names a vertex that is missing");
          }
          triangle[k] = *corner;
        }
        mesh.triangles.push_back(triangle);
        if (looks_.empty()) continue;
        auto own_index = to_index(tags.attribute("p1"));
        if (!own_index) own_index = group_index;
        auto own_group = to_index(tags.attribute("pid"));
        if (!own_group) own_group = group;
        const std::vector<Look>* const list = own_group ? looks(*own_group) : nullptr;
        if (list == nullptr) continue;
        looks_of.resize(mesh.triangles.size());
        for (std::size_t k = 0; k < 3; ++k) {
          auto index = to_index(tags.attribute(kLooks[k]));
          if (!index) index = own_index;
          if (index && *index < list->size()) looks_of.back()[k] = (*list)[*index];
        }
      } else if (tags.name() == "component") {
        RELIEF_TRY(Reference component, reference(tags, model));
        object.components.push_back(std::move(component));
      } else if (tags.name() == "beamlattice") {
        images_.note("beams of a lattice were passed over; only its triangles are read");
      }
    }
    if (source_.progress.cancelled()) return source_.cancelled();
    if (!looks_of.empty()) paint(mesh, std::move(looks_of));
    objects_.insert_or_assign(std::pair(model, *id), std::move(object));
    return {};
  }

  /// Gives the triangles of an object their materials, and where a triangle's corners have different colours, its
  /// vertices theirs. A vertex that needs several becomes several.
  void paint(TriangleMesh& mesh, std::vector<CornerLooks> looks_of) {
    looks_of.resize(mesh.triangles.size());
    const bool shaded = std::ranges::any_of(looks_of, [](const CornerLooks& looks) {
      return looks[0].colour != looks[1].colour || looks[0].colour != looks[2].colour;
    });
    if (shaded) colour_vertices(mesh, looks_of);
    mesh.material_of.reserve(mesh.triangles.size());
    for (const CornerLooks& looks : looks_of)
      mesh.material_of.push_back(material(looks[0].texture, shaded ? Rgba8{} : looks[0].colour));
    if (std::ranges::all_of(mesh.material_of, [](std::uint32_t m) { return m == 0; })) free_memory(mesh.material_of);
    if (std::ranges::all_of(looks_of, [](const CornerLooks& looks) { return looks[0].texture == 0; })) return;
    mesh.uvs.reserve(mesh.triangles.size());
    for (const CornerLooks& looks : looks_of) mesh.uvs.push_back({looks[0].place, looks[1].place, looks[2].place});
  }

  static void colour_vertices(TriangleMesh& mesh, std::span<const CornerLooks> looks_of) {
    std::vector<bool> taken(mesh.positions.size(), false);
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> doubles;  // by vertex and colour
    mesh.colours.resize(mesh.positions.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        std::uint32_t& vertex = mesh.triangles[t][k];
        const Rgba8 colour = looks_of[t][k].colour;
        if (!taken[vertex]) {
          taken[vertex] = true;
          mesh.colours[vertex] = colour;
        } else if (mesh.colours[vertex] != colour) {
          const auto fresh = static_cast<std::uint32_t>(mesh.positions.size());
          const auto [at, is_new] = doubles.try_emplace({vertex, std::bit_cast<std::uint32_t>(colour)}, fresh);
          if (is_new) {
            mesh.positions.push_back(Vec3d(mesh.positions[vertex]));
            mesh.colours.push_back(colour);
            taken.push_back(true);
          }
          vertex = at->second;
        }
      }
    }
  }

  [[nodiscard]] std::uint32_t material(std::uint32_t texture, Rgba8 colour) {
    if (texture == 0 && colour == Rgba8{}) return 0;
    const auto fresh = static_cast<std::uint32_t>(materials_.size());
    const auto [at, is_new] = numbers_.try_emplace({texture, std::bit_cast<std::uint32_t>(colour)}, fresh);
    const Texture& laid = textures_[texture];
    if (is_new) materials_.push_back({colour, laid.image, laid.wrap_u, laid.wrap_v});
    return at->second;
  }

  [[nodiscard]] Status place(const Reference& reference, const Placement& outer, int depth, Scene& scene) {
    if (depth > 32 || ++placed_ > 1'000'000) return source_.corrupt("its objects contain one another without end");
    if (!objects_.contains({reference.model, reference.id})) RELIEF_CHECK(read_model(reference.model, false));
    const auto found = objects_.find({reference.model, reference.id});
    if (found == objects_.end()) {
      return source_.corrupt("object " + std::to_string(reference.id) + " of part '" + printable(reference.model, 80) +
                             "' is missing");
    }
    Object& object = found->second;
    object.placed = true;
    if (object.support) {
      ++left_out_;
      return {};
    }
    if (source_.progress.cancelled()) return source_.cancelled();
    const Placement own = outer * reference.place;
    if (!scene.add(object.mesh, own)) {
      return source_.error(Errc::UnsupportedFormat, "its scene repeats parts until it is too large");
    }
    for (const Reference& component : object.components) RELIEF_CHECK(place(component, own, depth + 1, scene));
    return {};
  }

  const Source& source_;
  ZipArchive archive_;
  std::vector<std::string> read_models_;
  ImageStore images_;
  std::vector<Texture> textures_;                           ///< the first is none
  std::map<std::uint32_t, std::uint32_t> texture_numbers_;  ///< by id, of the model being read
  std::map<std::uint32_t, std::vector<Look>> looks_;        ///< by id of the group, of the model being read
  std::vector<Material> materials_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> numbers_;  ///< of materials, by texture and colour
  std::map<std::pair<std::string, std::uint32_t>, Object> objects_;
  std::vector<Reference> items_;
  const ModelUnit* unit_ = nullptr;  ///< null where the file names none that is known
  std::size_t unpacked_ = 0;
  std::size_t placed_ = 0;
  std::size_t left_out_ = 0;
  std::set<std::string> other_images_;  ///< attributes of materials
};

}  // namespace

Result<TriangleMesh> read_3mf(const Source& source) {
  RELIEF_TRY(ZipArchive archive, ZipArchive::open(source));
  return Reader(source, std::move(archive)).read();
}

}  // namespace relief::detail
