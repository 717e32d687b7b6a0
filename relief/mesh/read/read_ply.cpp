#include <relief/base/try.h>
#include <relief/mesh/read/face_paint.h>
#include <relief/mesh/read/readers.h>

#include <limits>
#include <optional>
#include <utility>

namespace relief::detail {
namespace {

enum class Type : std::uint8_t { Int8, Uint8, Int16, Uint16, Int32, Uint32, Int64, Uint64, Float, Double };

std::optional<Type> type_from_name(std::string_view text) noexcept {
  // What C and its headers call them, besides what PLY does.
  static constexpr std::array<std::pair<std::string_view, Type>, 26> kNames = {
      {{"char", Type::Int8},           {"int8", Type::Int8},
       {"uchar", Type::Uint8},         {"uint8", Type::Uint8},
       {"short", Type::Int16},         {"int16", Type::Int16},
       {"ushort", Type::Uint16},       {"uint16", Type::Uint16},
       {"int", Type::Int32},           {"int32", Type::Int32},
       {"uint", Type::Uint32},         {"uint32", Type::Uint32},
       {"long", Type::Int64},          {"int64", Type::Int64},
       {"ulong", Type::Uint64},        {"uint64", Type::Uint64},
       {"float", Type::Float},         {"float32", Type::Float},
       {"double", Type::Double},       {"float64", Type::Double},
       {"unsigned_char", Type::Uint8}, {"unsigned_short", Type::Uint16},
       {"unsigned_int", Type::Uint32}, {"unsigned_long", Type::Uint64},
       {"longlong", Type::Int64},      {"real", Type::Float}}};
  if (text.ends_with("_t")) text.remove_suffix(2);
  for (const auto& [name, type] : kNames)
    if (text == name) return type;
  return std::nullopt;
}

constexpr bool is_real(Type type) noexcept { return type == Type::Float || type == Type::Double; }

constexpr std::size_t size_of(Type type) noexcept {
  constexpr std::array<std::size_t, 10> kSizes = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return kSizes[std::to_underlying(type)];
}

/// Returns a whole number as the body has it; one beyond 2^63 counts as the largest there is.
std::int64_t load_whole(const char* at, Type type, bool swap) noexcept {
  switch (type) {
    case Type::Int8:
      return load<std::int8_t>(at, swap);
    case Type::Uint8:
      return load<std::uint8_t>(at, swap);
    case Type::Int16:
      return load<std::int16_t>(at, swap);
    case Type::Uint16:
      return load<std::uint16_t>(at, swap);
    case Type::Int32:
      return load<std::int32_t>(at, swap);
    case Type::Uint32:
      return load<std::uint32_t>(at, swap);
    case Type::Int64:
      return load<std::int64_t>(at, swap);
    case Type::Uint64:
      return static_cast<std::int64_t>(
          std::min<std::uint64_t>(load<std::uint64_t>(at, swap), std::numeric_limits<std::int64_t>::max()));
    case Type::Float:
    case Type::Double:
      break;
  }
  return 0;
}

double load_number(const char* at, Type type, bool swap) noexcept {
  if (type == Type::Float) return static_cast<double>(load<float>(at, swap));
  if (type == Type::Double) return load<double>(at, swap);
  return static_cast<double>(load_whole(at, type, swap));
}

/// 0..255 from a colour property: integers by their full range (8 bits for signed ones), reals from 0..1.
std::uint8_t colour_byte(double value, Type type) noexcept {
  if (is_real(type)) return unit_to_byte(value);
  return unit_to_byte(value / (type == Type::Uint16 ? 65535.0 : 255.0));
}

struct Property {
  std::string name;
  Type type = Type::Float;
  std::optional<Type> count_type;  ///< set for a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;

  [[nodiscard]] bool has_list() const noexcept {
    return std::ranges::any_of(properties, [](const Property& p) { return p.count_type.has_value(); });
  }
  /// Bytes of the shortest row in a binary body, or values in a text body.
  [[nodiscard]] std::size_t least_size(bool text) const noexcept {
    std::size_t sum = 0;
    for (const Property& p : properties) sum += text ? 1 : size_of(p.count_type.value_or(p.type));
    return sum;
  }
};

struct Header {
  bool text = false;
  bool swap = false;  ///< the body's byte order is not this machine's
  std::vector<Element> elements;
  std::vector<std::string_view> textures;  ///< the images that it names
  std::optional<std::uint64_t> phantoms;   ///< how many triangles, the last ones, close openings; in files of ours
  std::size_t body = 0;                    ///< where it starts
  std::size_t body_line = 0;               ///< the line number there
};

/// Takes the next line of the header off `rest`. Files of old systems end lines with \r alone; then a \n after the last
/// of them is the first byte of the body.
std::string_view header_line(std::string_view& rest, bool lone_returns) noexcept {
  const std::size_t end = rest.find(lone_returns ? '\r' : '\n');
  std::string_view line = rest.substr(0, end);
  rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

/// The comments that say something about the mesh.
void read_comment(TextCursor& words, Header& header) {
  const std::string_view key = words.word();
  if (key == "phantom_triangles") {
    if (std::int64_t count = 0; words.integer(count) && count >= 0) header.phantoms = static_cast<std::uint64_t>(count);
  } else if (key == "TextureFile") {
    if (const std::string_view name = trimmed(words.rest()); !name.empty()) header.textures.push_back(name);
  }
}

Result<Header> read_header(const Source& source) {
  Header header;
  std::string_view rest = source.bytes;
  const std::size_t first_end = rest.find_first_of("\r\n");
  const bool lone_returns = first_end != std::string_view::npos && rest[first_end] == '\r' &&
                            (first_end + 1 == rest.size() || rest[first_end + 1] != '\n');
  std::size_t number = 1;
  bool has_format = false;
  (void)header_line(rest, lone_returns);
  while (true) {
    if (rest.empty()) return source.corrupt("the header has no end_header line; the file is cut off");
    ++number;
    const std::string_view line = header_line(rest, lone_returns);
    TextCursor words(line);
    const std::string_view key = words.word();
    if (key == "end_header") break;
    if (key == "format") {
      const std::string_view format = words.word();
      header.text = format == "ascii";
      if (!header.text && format != "binary_little_endian" && format != "binary_big_endian") {
        return source.corrupt("line", number, "unknown format '" + printable(format, 40) + "'");
      }
      header.swap = !header.text && (format == "binary_big_endian") != (std::endian::native == std::endian::big);
      has_format = true;
    } else if (key == "element") {
      Element element;
      element.name = words.word();
      const std::string_view count = words.word();
      const auto [stop, code] = std::from_chars(count.data(), count.data() + count.size(), element.count);
      if (code != std::errc() || stop != count.data() + count.size()) {
        return source.corrupt("line", number, "'" + printable(count, 40) + "' is no count of elements");
      }
      header.elements.push_back(std::move(element));
    } else if (key == "property") {
      if (header.elements.empty()) return source.corrupt("line", number, "a property stands before the first element");
      Property property;
      std::string_view type = words.word();
      if (type == "list") {
        const std::string_view count_type = words.word();
        property.count_type = type_from_name(count_type);
        if (!property.count_type || is_real(*property.count_type)) {
          return source.corrupt("line", number, "'" + printable(count_type, 40) + "' cannot count a list");
        }
        type = words.word();
      }
      const std::optional<Type> known = type_from_name(type);
      if (!known) return source.corrupt("line", number, "unknown type '" + printable(type, 40) + "'");
      property.type = *known;
      property.name = words.word();
      header.elements.back().properties.push_back(std::move(property));
    } else if (key == "comment") {
      read_comment(words, header);
    }
    // Other comments, obj_info and words from newer writers carry no structure.
  }
  if (!has_format) return source.corrupt("the header has no format line");
  header.body = source.bytes.size() - rest.size();
  header.body_line = number + 1;
  return header;
}

/// Rows of a binary body.
class BinaryRows {
 public:
  static constexpr std::string_view kUnit = "row";
  BinaryRows(const Source& source, const Header& header) noexcept
      : at_(source.bytes.data() + header.body), end_(source.bytes.data() + source.bytes.size()), swap_(header.swap) {}

  [[nodiscard]] std::size_t left() const noexcept { return static_cast<std::size_t>(end_ - at_); }
  [[nodiscard]] std::size_t place(std::uint64_t row) const noexcept { return static_cast<std::size_t>(row); }
  [[nodiscard]] bool begin_row() const noexcept { return true; }
  void end_row() const noexcept {}
  [[nodiscard]] bool more_than_declared() const noexcept { return false; }
  [[nodiscard]] std::string_view rest() const noexcept { return {at_, left()}; }
  [[nodiscard]] bool number(Type type, double& value) noexcept {
    if (left() < size_of(type)) return false;
    value = load_number(at_, type, swap_);
    at_ += size_of(type);
    return true;
  }
  [[nodiscard]] bool integer(Type type, std::int64_t& value) noexcept {
    if (type == Type::Int32 && left() >= 4) {
      value = load<std::int32_t>(at_, swap_);
      at_ += 4;
      return true;
    }
    if (!is_real(type)) {
      if (left() < size_of(type)) return false;
      value = load_whole(at_, type, swap_);
      at_ += size_of(type);
      return true;
    }
    double real = 0.0;
    if (!number(type, real) || !(std::abs(real) < 9e15)) return false;
    value = static_cast<std::int64_t>(real);
    return true;
  }
  [[nodiscard]] bool skip(Type type, std::uint64_t count) noexcept {
    if (count > left() / size_of(type)) return false;
    at_ += count * size_of(type);
    return true;
  }

 private:
  const char* at_;
  const char* end_;
  bool swap_;
};

/// Rows of a text body, one per line. Values that the header does not declare, at the end of a line, are passed over.
class TextRows {
 public:
  static constexpr std::string_view kUnit = "line";
  TextRows(const Source& source, const Header& header) noexcept
      : cursor_(source.bytes.substr(header.body), false, header.body_line) {}

  [[nodiscard]] std::size_t left() const noexcept { return cursor_.left(); }
  [[nodiscard]] std::size_t place(std::uint64_t) const noexcept { return cursor_.line(); }
  [[nodiscard]] bool begin_row() noexcept { return cursor_.skip_to_value(); }
  void end_row() noexcept {
    more_ = more_ || !cursor_.at_line_end();
    cursor_.next_line();
  }
  /// Returns whether a line had more values than the header declares.
  [[nodiscard]] bool more_than_declared() const noexcept { return more_; }
  [[nodiscard]] std::string_view rest() noexcept {
    (void)cursor_.skip_to_value();
    return {cursor_.position(), cursor_.left()};
  }
  [[nodiscard]] bool number(Type, double& value) noexcept { return cursor_.number(value); }
  [[nodiscard]] bool integer(Type, std::int64_t& value) noexcept { return cursor_.integer(value, true); }
  [[nodiscard]] bool skip(Type, std::uint64_t count) noexcept {
    double value = 0.0;
    for (std::uint64_t k = 0; k < count; ++k)
      if (!cursor_.number(value)) return false;
    return true;
  }

 private:
  TextCursor cursor_;
  bool more_ = false;
};

/// Where a single value of a vertex or a face goes. S and T are a place in an image, Texture the number of the image.
enum class Use : std::uint8_t { None, X, Y, Z, Red, Green, Blue, Alpha, S, T, Texture };
constexpr std::size_t kUses = 11;

Use use_of(std::string_view name) noexcept {
  static constexpr std::array<std::pair<std::string_view, Use>, 25> kNames = {
      {{"x", Use::X},          {"y", Use::Y},         {"z", Use::Z},         {"red", Use::Red},
       {"r", Use::Red},        {"green", Use::Green}, {"g", Use::Green},     {"blue", Use::Blue},
       {"b", Use::Blue},       {"alpha", Use::Alpha}, {"a", Use::Alpha},     {"s", Use::S},
       {"t", Use::T},          {"u", Use::S},         {"v", Use::T},         {"texture_u", Use::S},
       {"texture_v", Use::T},  {"texture_s", Use::S}, {"texture_t", Use::T}, {"s0", Use::S},
       {"t0", Use::T},         {"u0", Use::S},        {"v0", Use::T},        {"texnumber", Use::Texture},
       {"texid", Use::Texture}}};
  if (name.starts_with("diffuse_")) name.remove_prefix(8);
  for (const auto& [known, use] : kNames)
    if (name == known) return use;
  return Use::None;
}

/// The uses of an element's properties, and the values of one row.
class Row {
 public:
  explicit Row(const Element& element) {
    for (const Property& property : element.properties) {
      uses_.push_back(property.count_type ? Use::None : use_of(property.name));
      types_[std::to_underlying(uses_.back())] = property.type;
      present_[std::to_underlying(uses_.back())] = true;
    }
  }
  [[nodiscard]] Use use(std::size_t property) const noexcept { return uses_[property]; }
  [[nodiscard]] bool has(std::initializer_list<Use> uses) const noexcept {
    return std::ranges::all_of(uses, [&](Use use) { return present_[std::to_underlying(use)]; });
  }
  [[nodiscard]] bool coloured() const noexcept { return has({Use::Red, Use::Green, Use::Blue}); }
  void set(Use use, double value) noexcept { values_[std::to_underlying(use)] = value; }
  [[nodiscard]] double value(Use use) const noexcept { return values_[std::to_underlying(use)]; }
  [[nodiscard]] Rgba8 colour() const noexcept {
    const auto byte = [&](Use use) { return colour_byte(value(use), types_[std::to_underlying(use)]); };
    return {byte(Use::Red), byte(Use::Green), byte(Use::Blue),
            has({Use::Alpha}) ? byte(Use::Alpha) : std::uint8_t{255}};
  }
  /// Returns the number of the image, 0 where there is none or it makes no sense.
  [[nodiscard]] std::uint32_t texture() const noexcept {
    const double number = value(Use::Texture);
    return number >= 0.0 && number < 65536.0 ? static_cast<std::uint32_t>(number) : 0;
  }

 private:
  std::vector<Use> uses_;
  std::array<Type, kUses> types_{};
  std::array<bool, kUses> present_{};
  std::array<double, kUses> values_{};
};

template <typename Rows>
class Reader {
 public:
  Reader(const Source& source, const Header& header)
      : source_(source),
        header_(header),
        rows_(source, header),
        steps_(source.steps(source.bytes.size())),
        sink_(mesh_),
        images_(source, header.textures.size()),
        materials_(1),
        palette_(materials_) {
    for (const std::string_view name : header.textures) {
      auto image = images_.file(name);
      textures_.push_back(image != nullptr ? static_cast<std::uint32_t>(materials_.size()) : 0);
      if (image != nullptr) materials_.push_back({{}, std::move(image)});
    }
  }

  Result<TriangleMesh> read() {
    bool surface = false, is_read = false;  // all that is of use
    std::vector<std::string> others;
    for (const Element& element : header_.elements) {
      if (element.properties.empty()) continue;
      if (is_read) {
        if (element.count > 0) others.push_back(element.name);
        continue;
      }
      RELIEF_CHECK(check_size(element));
      const bool strips = element.name == "tristrips";
      if (element.name == "vertex") {
        RELIEF_CHECK(read_vertices(element));
        note_unused(element, kVertexValues);
      } else if (element.name == "face" || strips) {
        RELIEF_CHECK(read_faces(element, strips));
        note_unused(element, kFaceValues);
        surface = true;
      } else if (element.count > 0) {
        others.push_back(element.name);
        is_read = is_last_use(element);
        if (!is_read) RELIEF_CHECK(skip(element));
      }
    }
    if (!surface && std::ranges::any_of(header_.elements, [](const Element& e) { return e.name == "range_grid"; })) {
      return source_.error(Errc::UnsupportedFormat,
                           "holds the raw range grid of a scanner and no faces; mesh it first");
    }
    RELIEF_CHECK(sink_.finish(source_, Rows::kUnit));
    settle_paint(mesh_, sink_, std::move(materials_), coordinates_, {}, images_);
    if (header_.textures.empty() && has_places_ && !mesh_.has_colour()) images_.note(std::string(kPlacesWithoutImage));
    if (!has_places_ && std::ranges::any_of(textures_, [](std::uint32_t material) { return material != 0; }))
      images_.note("its images were passed over, as no face or vertex has a place in one (texture coordinates)");
    images_.note_names("parts of it that have no use here were passed over", others);
    if (sink_.has_lines()) images_.note(std::string(kOnlyFaces));
    if (rows_.more_than_declared())
      images_.note("its lines hold more values than its header declares; these were passed over");
    if (!is_read) images_.note_rest(rows_.rest());
    mesh_.notes = images_.take_notes();
    if (header_.phantoms && *header_.phantoms <= mesh_.triangles.size())
      mesh_.phantom_from = mesh_.triangles.size() - *header_.phantoms;
    return std::move(mesh_);
  }

 private:
  using Unexpected = std::unexpected<Error>;

  [[nodiscard]] Unexpected bad_row(const Element& element, std::uint64_t row) const {
    return source_.corrupt(Rows::kUnit, rows_.place(row),
                           rows_.left() == 0
                               ? "the file ends inside element '" + printable(element.name, 40) + "'"
                               : "row " + std::to_string(row) + " of element '" + printable(element.name, 40) +
                                     "' has a value that is missing or no number");
  }
  /// Says which properties were passed over. Normals are not among them: these follow from the faces.
  void note_unused(const Element& element, std::string_view what) {
    constexpr std::array<std::string_view, 8> kKnown = {"nx",           "ny",       "nz",        "vertex_indices",
                                                        "vertex_index", "texcoord", "texcoords", "flags"};
    std::vector<std::string> names;
    for (const Property& property : element.properties) {
      const bool is_used = !property.count_type && use_of(property.name) != Use::None;
      if (is_used || std::ranges::find(kKnown, property.name) != kKnown.end()) continue;
      names.push_back(property.name);
    }
    if (element.count > 0) images_.note_names(std::string(what), names);
  }
  [[nodiscard]] bool goes_on() { return steps_.reached(source_.bytes.size() - rows_.left()); }
  /// Nothing is allocated by a count that the rest of the file cannot hold.
  [[nodiscard]] Status check_size(const Element& element) const {
    const std::size_t least = header_.text ? element.least_size(true) * 2 : element.least_size(false);
    const std::uint64_t most = (rows_.left() + (header_.text ? 1 : 0)) / least;
    if (element.count <= most) return {};
    return source_.corrupt("declares " + std::to_string(element.count) + " rows of element '" +
                           printable(element.name, 40) + "', but the file has room for at most " +
                           std::to_string(most));
  }
  /// Returns whether neither vertices nor faces come after this element.
  [[nodiscard]] bool is_last_use(const Element& element) const noexcept {
    for (const Element* e = &element + 1; e < header_.elements.data() + header_.elements.size(); ++e)
      if (e->name == "vertex" || e->name == "face" || e->name == "tristrips") return false;
    return true;
  }
  [[nodiscard]] bool skip_property(const Property& property) {
    std::uint64_t count = 1;
    if (property.count_type) {
      std::int64_t declared = 0;
      if (!rows_.integer(*property.count_type, declared) || declared < 0) return false;
      count = static_cast<std::uint64_t>(declared);
    }
    return rows_.skip(property.type, count);
  }
  [[nodiscard]] Status skip(const Element& element) {
    for (std::uint64_t row = 0; row < element.count; ++row) {
      if (!goes_on()) return source_.cancelled();
      if (!rows_.begin_row()) return bad_row(element, row);
      for (const Property& property : element.properties)
        if (!skip_property(property)) return bad_row(element, row);
      rows_.end_row();
    }
    return {};
  }

  [[nodiscard]] Status read_vertices(const Element& element) {
    Row values(element);
    if (!values.has({Use::X, Use::Y, Use::Z})) return source_.corrupt("element 'vertex' lacks x, y or z");
    if (!mesh_.positions.empty()) return source_.corrupt("has two elements 'vertex'");
    if (element.count > 0xfffffffeU) return source_.error(Errc::UnsupportedFormat, "has more than 4294967294 vertices");
    const bool coloured = values.coloured();
    const bool placed = values.has({Use::S, Use::T});
    has_places_ = has_places_ || placed;
    vertices_have_places_ = placed && !textures_.empty();
    const bool numbered = vertices_have_places_ && values.has({Use::Texture}) && textures_.size() > 1;
    mesh_.positions.reserve(element.count);
    if (coloured) mesh_.colours.reserve(element.count);
    if (vertices_have_places_) coordinates_.reserve(element.count);

    for (std::uint64_t row = 0; row < element.count; ++row) {
      if (!goes_on()) return source_.cancelled();
      if (!rows_.begin_row()) return bad_row(element, row);
      for (std::size_t k = 0; k < element.properties.size(); ++k)
        if (!read_value(element.properties[k], values.use(k), values)) return bad_row(element, row);
      mesh_.positions.push_back({values.value(Use::X), values.value(Use::Y), values.value(Use::Z)});
      if (coloured) mesh_.colours.push_back(values.colour());
      if (vertices_have_places_)
        coordinates_.push_back({static_cast<float>(values.value(Use::S)), static_cast<float>(values.value(Use::T))});
      if (numbered) texture_of_vertex_.push_back(values.texture());
      rows_.end_row();
    }
    return {};
  }

  [[nodiscard]] bool read_value(const Property& property, Use use, Row& values) {
    if (use == Use::None) return skip_property(property);
    double value = 0.0;
    if (!rows_.number(property.type, value)) return false;
    values.set(use, value);
    return true;
  }

  [[nodiscard]] Status read_faces(const Element& element, bool strips) {
    const std::size_t none = element.properties.size();
    std::size_t indices = none, wedges = none;
    for (std::size_t k = 0; k < none; ++k) {
      const Property& property = element.properties[k];
      if (property.count_type && (property.name == "vertex_indices" || property.name == "vertex_index")) indices = k;
      if (property.count_type && !strips && (property.name == "texcoord" || property.name == "texcoords")) wedges = k;
    }
    if (indices == none) {
      if (element.count == 0) return {};
      return source_.corrupt("element '" + element.name + "' lacks the list vertex_indices");
    }
    has_places_ = has_places_ || wedges != none;
    if (textures_.empty()) wedges = none;
    Row values(element);
    const bool coloured = values.coloured();
    if (!strips) mesh_.triangles.reserve(std::min<std::uint64_t>(element.count, rows_.left() / 4));
    std::vector<std::uint32_t> corners;
    std::vector<float> places;
    for (std::uint64_t row = 0; row < element.count; ++row) {
      if (!goes_on()) return source_.cancelled();
      if (!rows_.begin_row()) return bad_row(element, row);
      const std::size_t line = rows_.place(row);
      places.clear();
      for (std::size_t k = 0; k < none; ++k) {
        const Property& property = element.properties[k];
        if (k == indices) {
          RELIEF_CHECK(read_corners(element, row, property, strips, corners));
        } else if (k == wedges) {
          if (!read_places(property, places)) return bad_row(element, row);
        } else if (!read_value(property, values.use(k), values)) {
          return bad_row(element, row);
        }
      }
      const std::uint32_t plain = coloured ? palette_.number_of(values.colour()) : 0;
      strips ? add_strips(corners, plain, line) : add_face(corners, {places, values.texture(), plain}, line);
      rows_.end_row();
    }
    return {};
  }

  /// Returns a length that the rest of the file can hold.
  [[nodiscard]] bool read_count(const Property& property, std::int64_t& count) {
    return rows_.integer(*property.count_type, count) && count >= 0 &&
           static_cast<std::uint64_t>(count) <= rows_.left() / (header_.text ? 1 : size_of(property.type)) + 1;
  }
  /// Returns the corners of a face, or of several strips with kStripEnd between them.
  [[nodiscard]] Status read_corners(const Element& element, std::uint64_t row, const Property& property, bool strips,
                                    std::vector<std::uint32_t>& corners) {
    corners.clear();
    std::int64_t count = 0;
    if (!read_count(property, count)) return bad_row(element, row);
    for (std::int64_t c = 0; c < count; ++c) {
      std::int64_t corner = 0;
      if (!rows_.integer(property.type, corner)) return bad_row(element, row);
      if (strips && corner == -1)
        corner = kStripEnd;
      else if (corner < 0 || corner > 0xfffffffeLL)
        return source_.corrupt(Rows::kUnit, rows_.place(row), "a face names vertex " + std::to_string(corner));
      corners.push_back(static_cast<std::uint32_t>(corner));
    }
    return {};
  }
  [[nodiscard]] bool read_places(const Property& property, std::vector<float>& places) {
    std::int64_t count = 0;
    if (!read_count(property, count)) return false;
    for (std::int64_t k = 0; k < count; ++k) {
      double value = 0.0;
      if (!rows_.number(property.type, value)) return false;
      places.push_back(static_cast<float>(value));
    }
    return true;
  }

  /// Holds what a row says of a face's colour.
  struct FaceColour {
    std::span<const float> places;  ///< of its corners in the image, two each; or none
    std::uint32_t texture;
    std::uint32_t plain;  ///< the material of its own colour
  };
  void add_face(std::span<const std::uint32_t> corners, const FaceColour& colour, std::size_t line) {
    uvs_.clear();
    std::uint32_t texture = colour.texture;
    if (!corners.empty() && colour.places.size() == 2 * corners.size() &&
        coordinates_.size() + corners.size() < FaceSink::kNoUv) {
      for (std::size_t k = 0; k < corners.size(); ++k) {
        uvs_.push_back(static_cast<std::uint32_t>(coordinates_.size()));
        coordinates_.push_back({colour.places[2 * k], colour.places[2 * k + 1]});
      }
    } else if (vertices_have_places_) {
      uvs_.assign(corners.begin(), corners.end());
      if (!corners.empty() && corners[0] < texture_of_vertex_.size()) texture = texture_of_vertex_[corners[0]];
    }
    const std::uint32_t pictured = !uvs_.empty() && texture < textures_.size() ? textures_[texture] : 0;
    sink_.add(corners, line, pictured != 0 ? FacePaint{pictured, uvs_} : FacePaint{colour.plain});
  }

  void add_strips(std::span<const std::uint32_t> strips, std::uint32_t plain, std::size_t line) {
    std::size_t first = 0;  // of the strip
    for (std::size_t k = 0; k < strips.size(); ++k) {
      if (strips[k] == kStripEnd) {
        first = k + 1;
        continue;
      }
      if (k < first + 2) continue;
      const std::uint32_t a = strips[k - 2], b = strips[k - 1], c = strips[k];
      if (a == b || b == c || c == a) continue;  // stitches between strips
      add_face((k - first) % 2 == 0 ? std::array{a, b, c} : std::array{b, a, c}, {{}, 0, plain}, line);
    }
  }

  static constexpr std::uint32_t kStripEnd = 0xffffffffU;

  const Source& source_;
  const Header& header_;
  Rows rows_;
  Steps steps_;
  TriangleMesh mesh_;
  FaceSink sink_;
  ImageStore images_;
  std::vector<Material> materials_;
  Palette palette_;
  std::vector<std::uint32_t> textures_;  ///< the material of each image, 0 where it is not available
  std::vector<std::array<float, 2>> coordinates_;
  std::vector<std::uint32_t> texture_of_vertex_;  ///< empty where all have the first
  std::vector<std::uint32_t> uvs_;                ///< of one face
  bool vertices_have_places_ = false;             ///< the first coordinates are theirs
  bool has_places_ = false;
};

}  // namespace

Result<TriangleMesh> read_ply(const Source& source) {
  RELIEF_TRY(const Header header, read_header(source));
  return header.text ? Reader<TextRows>(source, header).read() : Reader<BinaryRows>(source, header).read();
}

}  // namespace relief::detail
