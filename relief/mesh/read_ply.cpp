#include <relief/base/try.h>
#include <relief/mesh/readers.h>

#include <optional>
#include <utility>

namespace relief::detail {
namespace {

enum class Type : std::uint8_t { Int8, Uint8, Int16, Uint16, Int32, Uint32, Float, Double };

std::optional<Type> type_from_name(std::string_view text) noexcept {
  static constexpr std::array<std::pair<std::string_view, Type>, 20> kNames = {
      {{"char", Type::Int8},           {"int8", Type::Int8},           {"uchar", Type::Uint8},
       {"uint8", Type::Uint8},         {"short", Type::Int16},         {"int16", Type::Int16},
       {"ushort", Type::Uint16},       {"uint16", Type::Uint16},       {"int", Type::Int32},
       {"int32", Type::Int32},         {"uint", Type::Uint32},         {"uint32", Type::Uint32},
       {"float", Type::Float},         {"float32", Type::Float},       {"double", Type::Double},
       {"float64", Type::Double},      {"unsigned_char", Type::Uint8}, {"unsigned_short", Type::Uint16},
       {"unsigned_int", Type::Uint32}, {"real", Type::Float}}};
  for (const auto& [name, type] : kNames)
    if (text == name) return type;
  return std::nullopt;
}

constexpr std::size_t size_of(Type type) noexcept {
  constexpr std::array<std::size_t, 8> kSizes = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[std::to_underlying(type)];
}

double load_number(const char* at, Type type, bool swap) noexcept {
  switch (type) {
    case Type::Int8:
      return static_cast<double>(load<std::int8_t>(at, swap));
    case Type::Uint8:
      return static_cast<double>(load<std::uint8_t>(at, swap));
    case Type::Int16:
      return static_cast<double>(load<std::int16_t>(at, swap));
    case Type::Uint16:
      return static_cast<double>(load<std::uint16_t>(at, swap));
    case Type::Int32:
      return static_cast<double>(load<std::int32_t>(at, swap));
    case Type::Uint32:
      return static_cast<double>(load<std::uint32_t>(at, swap));
    case Type::Float:
      return static_cast<double>(load<float>(at, swap));
    case Type::Double:
      return load<double>(at, swap);
  }
  return 0.0;
}

/// 0..255 from a colour property: integers by their full range (8 bits for signed ones), reals from 0..1.
std::uint8_t colour_byte(double value, Type type) noexcept {
  switch (type) {
    case Type::Float:
    case Type::Double:
      return unit_to_byte(value);
    case Type::Uint16:
      return unit_to_byte(value / 65535.0);
    default:
      return unit_to_byte(value / 255.0);
  }
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
  std::optional<std::uint64_t> phantoms;  ///< how many triangles, the last ones, close openings; in files of ours
  std::size_t body = 0;                   ///< where it starts
  std::size_t body_line = 0;              ///< the line number there
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
        if (!property.count_type || *property.count_type == Type::Float || *property.count_type == Type::Double) {
          return source.corrupt("line", number, "'" + printable(count_type, 40) + "' cannot count a list");
        }
        type = words.word();
      }
      const std::optional<Type> known = type_from_name(type);
      if (!known) return source.corrupt("line", number, "unknown type '" + printable(type, 40) + "'");
      property.type = *known;
      property.name = words.word();
      header.elements.back().properties.push_back(std::move(property));
    } else if (key == "comment" && words.word() == "phantom_triangles") {
      if (std::int64_t count = 0; words.integer(count) && count >= 0)
        header.phantoms = static_cast<std::uint64_t>(count);
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
  void end_row() noexcept { cursor_.next_line(); }
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
};

/// Where the values of a vertex go.
enum class Use : std::uint8_t { None, X, Y, Z, Red, Green, Blue, Alpha };

Use use_of(std::string_view name) noexcept {
  if (name == "x") return Use::X;
  if (name == "y") return Use::Y;
  if (name == "z") return Use::Z;
  if (name.starts_with("diffuse_")) name.remove_prefix(8);
  if (name == "red" || name == "r") return Use::Red;
  if (name == "green" || name == "g") return Use::Green;
  if (name == "blue" || name == "b") return Use::Blue;
  if (name == "alpha" || name == "a") return Use::Alpha;
  return Use::None;
}

template <typename Rows>
class Reader {
 public:
  Reader(const Source& source, const Header& header)
      : source_(source), header_(header), rows_(source, header), sink_(mesh_) {}

  Result<TriangleMesh> read() {
    bool surface = false;
    for (const Element& element : header_.elements) {
      if (element.properties.empty()) continue;
      RELIEF_CHECK(check_size(element));
      const bool strips = element.name == "tristrips";
      if (element.name == "vertex") {
        RELIEF_CHECK(read_vertices(element));
      } else if (element.name == "face" || strips) {
        RELIEF_CHECK(read_faces(element, strips));
        surface = true;
      } else if (is_last_use(element)) {
        break;
      } else {
        RELIEF_CHECK(skip(element));
      }
    }
    if (!surface && std::ranges::any_of(header_.elements, [](const Element& e) { return e.name == "range_grid"; })) {
      return source_.error(Errc::UnsupportedFormat,
                           "holds the raw range grid of a scanner and no faces; mesh it first");
    }
    RELIEF_CHECK(sink_.finish(source_, Rows::kUnit));
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
  /// Nothing is allocated by a count that the rest of the file cannot hold.
  [[nodiscard]] Status check_size(const Element& element) const {
    const std::size_t least = header_.text ? element.least_size(true) * 2 : element.least_size(false);
    const std::uint64_t most = (rows_.left() + (header_.text ? 1 : 0)) / least;
    if (element.count <= most) return {};
    return source_.corrupt("declares " + std::to_string(element.count) + " rows of element '" +
                           printable(element.name, 40) + "', but the file has room for at most " +
                           std::to_string(most));
  }
  /// Whether neither vertices nor faces come after this element.
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
      if (!rows_.begin_row()) return bad_row(element, row);
      for (const Property& property : element.properties)
        if (!skip_property(property)) return bad_row(element, row);
      rows_.end_row();
    }
    return {};
  }

  [[nodiscard]] Status read_vertices(const Element& element) {
    std::vector<Use> uses;
    std::array<bool, 8> present{};
    for (const Property& property : element.properties) {
      uses.push_back(property.count_type ? Use::None : use_of(property.name));
      present[std::to_underlying(uses.back())] = true;
    }
    if (!present[1] || !present[2] || !present[3]) return source_.corrupt("element 'vertex' lacks x, y or z");
    const bool coloured = present[4] && present[5] && present[6];
    if (!mesh_.positions.empty()) return source_.corrupt("has two elements 'vertex'");
    if (element.count > 0xfffffffeU) return source_.error(Errc::UnsupportedFormat, "has more than 4294967294 vertices");
    mesh_.positions.reserve(element.count);
    if (coloured) mesh_.colours.reserve(element.count);

    for (std::uint64_t row = 0; row < element.count; ++row) {
      if (!rows_.begin_row()) return bad_row(element, row);
      Vec3d p;
      Rgba8 colour;
      for (std::size_t k = 0; k < uses.size(); ++k) {
        const Property& property = element.properties[k];
        if (uses[k] == Use::None) {
          if (!skip_property(property)) return bad_row(element, row);
          continue;
        }
        double value = 0.0;
        if (!rows_.number(property.type, value)) return bad_row(element, row);
        switch (uses[k]) {
          case Use::X:
            p.x = value;
            break;
          case Use::Y:
            p.y = value;
            break;
          case Use::Z:
            p.z = value;
            break;
          case Use::Red:
            colour.r = colour_byte(value, property.type);
            break;
          case Use::Green:
            colour.g = colour_byte(value, property.type);
            break;
          case Use::Blue:
            colour.b = colour_byte(value, property.type);
            break;
          case Use::Alpha:
            colour.a = colour_byte(value, property.type);
            break;
          case Use::None:
            break;
        }
      }
      mesh_.positions.push_back(p);
      if (coloured) mesh_.colours.push_back(colour);
      rows_.end_row();
    }
    return {};
  }

  [[nodiscard]] Status read_faces(const Element& element, bool strips) {
    std::size_t indices = element.properties.size();
    for (std::size_t k = 0; k < element.properties.size(); ++k) {
      const Property& property = element.properties[k];
      if (property.count_type && (property.name == "vertex_indices" || property.name == "vertex_index")) indices = k;
    }
    if (indices == element.properties.size()) {
      if (element.count == 0) return {};
      return source_.corrupt("element '" + element.name + "' lacks the list vertex_indices");
    }
    if (!strips) mesh_.triangles.reserve(std::min<std::uint64_t>(element.count, rows_.left() / 4));
    std::vector<std::uint32_t> corners;
    for (std::uint64_t row = 0; row < element.count; ++row) {
      if (!rows_.begin_row()) return bad_row(element, row);
      const std::size_t place = rows_.place(row);
      for (std::size_t k = 0; k < element.properties.size(); ++k) {
        const Property& property = element.properties[k];
        if (k != indices) {
          if (!skip_property(property)) return bad_row(element, row);
          continue;
        }
        std::int64_t count = 0;
        if (!rows_.integer(*property.count_type, count) || count < 0 ||
            static_cast<std::uint64_t>(count) > rows_.left() / (header_.text ? 1 : size_of(property.type)) + 1) {
          return bad_row(element, row);
        }
        corners.clear();
        for (std::int64_t c = 0; c < count; ++c) {
          std::int64_t corner = 0;
          if (!rows_.integer(property.type, corner)) return bad_row(element, row);
          if (strips && corner == -1) {
            add_strip(corners, place);
            corners.clear();
            continue;
          }
          if (corner < 0 || corner > 0xfffffffeLL) {
            return source_.corrupt(Rows::kUnit, place, "a face names vertex " + std::to_string(corner));
          }
          corners.push_back(static_cast<std::uint32_t>(corner));
        }
        strips ? add_strip(corners, place) : sink_.add(corners, place);
      }
      rows_.end_row();
    }
    return {};
  }

  void add_strip(std::span<const std::uint32_t> strip, std::size_t place) {
    for (std::size_t k = 2; k < strip.size(); ++k) {
      const std::uint32_t a = strip[k - 2], b = strip[k - 1], c = strip[k];
      if (a == b || b == c || c == a) continue;  // stitches between strips
      sink_.add(k % 2 == 0 ? std::array{a, b, c} : std::array{b, a, c}, place);
    }
  }

  const Source& source_;
  const Header& header_;
  Rows rows_;
  TriangleMesh mesh_;
  FaceSink sink_;
};

}  // namespace

Result<TriangleMesh> read_ply(const Source& source) {
  RELIEF_TRY(const Header header, read_header(source));
  return header.text ? Reader<TextRows>(source, header).read() : Reader<BinaryRows>(source, header).read();
}

}  // namespace relief::detail
