#include <relief/base/try.h>
#include <relief/mesh/readers.h>
#include <relief/mesh/scene.h>
#include <relief/mesh/zip.h>

#include <map>
#include <optional>

namespace relief::detail {
namespace {

/// Steps through the tags of an XML text. Text between tags, comments and instructions are passed over; a document type
/// is refused, so entities cannot grow.
class XmlTags {
 public:
  explicit XmlTags(std::string_view text) noexcept : text_(text) {}

  /// To the next tag; false at the end or where the XML breaks (then broken() holds).
  bool next() noexcept {
    while (true) {
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
  /// The name without its namespace prefix.
  [[nodiscard]] std::string_view name() const noexcept { return name_; }
  [[nodiscard]] bool closing() const noexcept { return closing_; }
  /// <a/>: opens and closes at once.
  [[nodiscard]] bool single() const noexcept { return single_; }
  /// The value of an attribute, by its name without prefix; empty when missing.
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

/// What 3MF calls its units. Numbers in one that Relief does not have become millimetres: times `factor` over `divisor`
/// (0.001 itself is no double).
struct ModelUnit {
  std::string_view name;
  double factor, divisor;
  Unit unit;
};
constexpr std::array<ModelUnit, 6> kModelUnits = {{{"millimeter", 1.0, 1.0, Unit::Millimetre},
                                                   {"centimeter", 1.0, 1.0, Unit::Centimetre},
                                                   {"meter", 1.0, 1.0, Unit::Metre},
                                                   {"micron", 1.0, 1000.0, Unit::Millimetre},
                                                   {"inch", 25.4, 1.0, Unit::Millimetre},
                                                   {"foot", 304.8, 1.0, Unit::Millimetre}}};

struct Reference {
  std::string model;  ///< the part of the archive that holds the object
  std::uint32_t id = 0;
  Placement place;
};

struct Object {
  TriangleMesh mesh;
  std::vector<Reference> components;
  bool support = false;
};

class Reader {
 public:
  Reader(const Source& source, ZipArchive archive) : source_(source), archive_(std::move(archive)) {}

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
    return std::move(scene.mesh);
  }

 private:
  Result<std::string> root_model() {
    std::string name = "3D/3dmodel.model";
    if (const ZipMember* relations = archive_.find("_rels/.rels")) {
      RELIEF_TRY(const std::string text, archive_.unpack(source_, *relations));
      XmlTags tags(text);
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

  /// Reads one model part; only the root's build list and unit count.
  [[nodiscard]] Status read_model(const std::string& model, bool root) {
    if (std::ranges::find(read_models_, model) != read_models_.end()) return {};
    read_models_.push_back(model);
    const ZipMember* member = archive_.find(model);
    if (member == nullptr) return source_.corrupt("part '" + printable(model, 80) + "' is missing");
    RELIEF_TRY(const std::string text, archive_.unpack(source_, *member));
    unpacked_ += text.size();
    colours_.clear();
    XmlTags tags(text);
    while (tags.next()) {
      if (tags.closing()) continue;
      if (tags.name() == "model" && root) {
        read_unit(tags.attribute("unit"));
      } else if (tags.name() == "colorgroup" || tags.name() == "basematerials") {
        RELIEF_CHECK(read_colours(tags));
      } else if (tags.name() == "object") {
        RELIEF_CHECK(read_object(tags, model));
      } else if (tags.name() == "item" && root) {
        RELIEF_TRY(Reference item, reference(tags, model));
        items_.push_back(std::move(item));
      }
    }
    if (tags.broken()) return source_.corrupt("the XML of part '" + printable(model, 80) + "' is broken");
    return {};
  }

  /// Millimetres when the attribute is missing, as 3MF has it; a name that 3MF does not know leaves the unit open.
  void read_unit(std::string_view name) noexcept {
    if (name.empty()) name = "millimeter";
    const auto known = std::ranges::find(kModelUnits, name, &ModelUnit::name);
    unit_ = known == kModelUnits.end() ? nullptr : &*known;
  }

  [[nodiscard]] Status read_colours(XmlTags& tags) {
    const std::string group_name(tags.name());
    const auto id = to_index(tags.attribute("id"));
    if (!id) return source_.corrupt("a colour group has no number");
    std::vector<Rgba8>& group = colours_[*id];
    if (tags.single()) return {};
    while (tags.next() && !(tags.closing() && tags.name() == group_name)) {
      if (tags.closing() || (tags.name() != "color" && tags.name() != "base")) continue;
      const auto colour = to_colour(tags.attribute(tags.name() == "color" ? "color" : "displaycolor"));
      group.push_back(colour.value_or(Rgba8{}));
    }
    return {};
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
    std::vector<bool> painted;
    const auto colour_of = [&](std::optional<std::uint32_t> group_id,
                               std::optional<std::uint32_t> index) -> const Rgba8* {
      if (!group_id || !index) return nullptr;
      const auto found = colours_.find(*group_id);
      return found != colours_.end() && *index < found->second.size() ? &found->second[*index] : nullptr;
    };
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
        constexpr std::array<std::string_view, 3> kColours = {"p1", "p2", "p3"};
        for (std::size_t k = 0; k < 3; ++k) {
          const auto corner = to_index(tags.attribute(kCorners[k]));
          if (!corner || *corner >= mesh.positions.size()) {
            return source_.corrupt(where + "triangle " + std::to_string(mesh.triangles.size()) +
                                   " names a vertex that is missing");
          }
          triangle[k] = *corner;
        }
        mesh.triangles.push_back(triangle);
        if (colours_.empty()) continue;
        auto own_group = to_index(tags.attribute("pid"));
        auto own_index = to_index(tags.attribute("p1"));
        if (!own_group) own_group = group;
        if (!own_index) own_index = group_index;
        for (std::size_t k = 0; k < 3; ++k) {
          auto index = to_index(tags.attribute(kColours[k]));
          if (!index) index = own_index;
          const Rgba8* colour = colour_of(own_group, index);
          if (colour == nullptr) continue;
          // Corners that meet in one vertex may differ; the first one counts.
          painted.resize(mesh.positions.size());
          mesh.colours.resize(mesh.positions.size());
          if (painted[triangle[k]]) continue;
          painted[triangle[k]] = true;
          mesh.colours[triangle[k]] = *colour;
        }
      } else if (tags.name() == "component") {
        RELIEF_TRY(Reference component, reference(tags, model));
        object.components.push_back(std::move(component));
      }
    }
    if (!mesh.colours.empty()) mesh.colours.resize(mesh.positions.size());
    objects_.insert_or_assign(std::pair(model, *id), std::move(object));
    return {};
  }

  [[nodiscard]] Status place(const Reference& reference, const Placement& outer, int depth, Scene& scene) {
    if (depth > 32 || ++placed_ > 1'000'000) return source_.corrupt("its objects contain one another without end");
    if (!objects_.contains({reference.model, reference.id})) RELIEF_CHECK(read_model(reference.model, false));
    const auto found = objects_.find({reference.model, reference.id});
    if (found == objects_.end()) {
      return source_.corrupt("object " + std::to_string(reference.id) + " of part '" + printable(reference.model, 80) +
                             "' is missing");
    }
    const Object& object = found->second;
    if (object.support) return {};
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
  std::map<std::uint32_t, std::vector<Rgba8>> colours_;
  std::map<std::pair<std::string, std::uint32_t>, Object> objects_;
  std::vector<Reference> items_;
  const ModelUnit* unit_ = nullptr;  ///< null where the file names none that is known
  std::size_t unpacked_ = 0;
  std::size_t placed_ = 0;
};

}  // namespace

Result<TriangleMesh> read_3mf(const Source& source) {
  RELIEF_TRY(ZipArchive archive, ZipArchive::open(source));
  return Reader(source, std::move(archive)).read();
}

}  // namespace relief::detail
