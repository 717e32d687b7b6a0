#include <relief/base/free_memory.h>
#include <relief/base/try.h>
#include <relief/mesh/read/face_paint.h>
#include <relief/mesh/read/readers.h>

#include <optional>

namespace relief::detail {
namespace {

/// Holds what the letters before OFF say that a vertex has besides its place, which comes first; then in this order.
struct OffHeader {
  bool normals = false, colours = false, texture = false;
  bool weight = false;          ///< a fourth, homogeneous coordinate
  bool dimension = false;       ///< the number of coordinates stands before the counts
  std::size_t coordinates = 3;  ///< without the homogeneous one
  std::uint64_t vertices = 0, faces = 0;

  /// Returns the least numbers that a vertex has.
  [[nodiscard]] std::size_t least_numbers() const noexcept {
    return coordinates + (weight ? 1 : 0) + (normals ? 3 : 0);
  }
  [[nodiscard]] bool plain() const noexcept { return !normals && !colours && !texture; }
};

/// Returns the letters of a keyword such as STCNOFF, in whatever order; none when it is no such keyword.
std::optional<OffHeader> read_keyword(std::string_view& text) {
  OffHeader header;
  std::string_view rest = text;
  const auto take = [&](std::string_view letters, bool& flag) {
    if (flag || !rest.starts_with(letters)) return false;
    rest.remove_prefix(letters.size());
    return flag = true;
  };
  while (take("ST", header.texture) || take("C", header.colours) || take("N", header.normals) ||
         take("4", header.weight) || take("n", header.dimension)) {
  }
  if (!rest.starts_with("OFF")) return std::nullopt;
  text = rest.substr(3);
  return header;
}

std::unexpected<Error> wrong_dimension(const Source& source, std::int64_t dimension) {
  return source.error(Errc::UnsupportedFormat,
                      "is an OFF file of " + std::to_string(dimension) + " dimensions; a surface in three is needed");
}

Status check_counts(const Source& source, const OffHeader& header, std::size_t left) {
  const auto declares = [&](std::uint64_t count, std::string_view what, std::size_t most) {
    return source.corrupt("declares " + std::to_string(count) + " " + std::string(what) +
                          ", but the file has room for at most " + std::to_string(most));
  };
  const std::size_t vertex_size = 2 * header.least_numbers(), face_size = 2;  // a digit and a blank for each number
  if (header.vertices > left / vertex_size) return declares(header.vertices, "vertices", left / vertex_size);
  if (header.faces > left / face_size) return declares(header.faces, "faces", left / face_size);
  if (header.vertices > 0xfffffffeU) return source.error(Errc::UnsupportedFormat, "has more than 4294967294 vertices");
  return {};
}

/// Returns the place of a vertex from its coordinates, the last of which may be homogeneous.
Vec3d place_of(const std::array<double, 4>& values, const OffHeader& header) noexcept {
  const double weight = header.weight ? values[header.coordinates] : 1.0;
  Vec3d p;
  for (std::size_t k = 0; k < header.coordinates; ++k) p[k] = weight == 1.0 ? values[k] : values[k] / weight;
  return p;
}

/// Colours as a file has them. They stand as 0..255 in some files and as 0..1 in others; one value above 1 decides for
/// all that are kept together.
class OffColours {
 public:
  using Raw = std::array<float, 4>;
  static constexpr Raw kNone = {1.0F, 1.0F, 1.0F, -1.0F};  ///< white; no alpha counts as opaque

  void add(std::size_t item, std::span<const double> values) {
    Raw raw = kNone;
    for (std::size_t k = 0; k < values.size() && k < raw.size(); ++k) {
      raw[k] = static_cast<float>(values[k]);
      wide_ = wide_ || values[k] > 1.0;
    }
    given_.resize(std::max(given_.size(), item + 1), kNone);
    given_[item] = raw;
  }
  [[nodiscard]] bool empty() const noexcept { return given_.empty(); }
  [[nodiscard]] Rgba8 colour(std::size_t item) const noexcept {
    if (item >= given_.size() || given_[item] == kNone) return {};
    const Raw& raw = given_[item];
    const auto byte = [&](std::size_t k) { return unit_to_byte(double{raw[k]} * (wide_ ? 1.0 / 255.0 : 1.0)); };
    return {byte(0), byte(1), byte(2), raw[3] < 0.0F ? std::uint8_t{255} : byte(3)};
  }
  /// Returns whether what a plain file has behind its vertices can be colours: nothing below 0 or above 255, and not
  /// the directions of normals.
  [[nodiscard]] bool plausible() const noexcept {
    const bool in_range = std::ranges::all_of(given_, [](const Raw& c) {
      return std::ranges::all_of(c.begin(), c.begin() + 3, [](float x) { return x >= 0.0F && x <= 255.0F; });
    });
    return in_range && !are_normals();
  }
  /// Returns whether all have the length of one.
  [[nodiscard]] bool are_normals() const noexcept {
    return std::ranges::all_of(given_, [](const Raw& c) {
      return c[3] < 0.0F && std::abs(std::hypot(double{c[0]}, double{c[1]}, double{c[2]}) - 1.0) < 1e-3;
    });
  }

 private:
  std::vector<Raw> given_;
  bool wide_ = false;
};

/// The mesh as it grows, and what its file says of colours.
class OffMesh {
 public:
  OffMesh(const Source& source, const OffHeader& header) : header_(header), images_(source, 0), sink_(mesh_) {
    mesh_.positions.reserve(header.vertices);
    mesh_.triangles.reserve(header.faces);
  }

  /// `rest` is what stands behind the vertex's place and its normal.
  void add_vertex(Vec3d place, std::span<const double> rest) {
    const std::size_t vertex = mesh_.positions.size();
    mesh_.positions.push_back(place);
    if (header_.texture) rest = rest.first(rest.size() - std::min<std::size_t>(rest.size(), 2));
    const bool can_be = header_.colours || (header_.plain() && (rest.size() == 3 || rest.size() == 4));
    if (can_be && rest.size() >= 3) vertices_.add(vertex, rest);
    vertex_values_left = vertex_values_left || rest.size() > 4 || (!rest.empty() && (!can_be || rest.size() < 3));
  }
  /// `rest` is what stands behind the corners. `place` is the line or face number for messages.
  void add_face(std::span<const std::uint32_t> corners, std::size_t place, std::span<const double> rest) {
    FacePaint paint;
    if (rest.size() == 3 || rest.size() == 4) {
      faces_.add(coloured_faces_, rest);
      paint.material = static_cast<std::uint32_t>(++coloured_faces_);
    } else if (rest.size() == 1) {
      mapped_ = true;
    } else if (!rest.empty()) {
      face_values_left = true;
    }
    sink_.add(corners, place, paint);
  }
  /// `rest` is what stands behind the last face.
  Result<TriangleMesh> finish(const Source& source, std::string_view unit, std::string_view rest) {
    RELIEF_CHECK(sink_.finish(source, unit));
    if (!vertices_.empty() && (header_.colours || vertices_.plausible())) {
      for (std::size_t k = 0; k < mesh_.positions.size(); ++k) mesh_.colours.push_back(vertices_.colour(k));
    } else if (!vertices_.are_normals()) {
      vertex_values_left = true;
    }
    paint_faces();
    if (mapped_ && !mesh_.has_colour())
      images_.note("its faces have numbers of a colour map, which is in another file; its surface is plain");
    if (header_.texture && !mesh_.has_colour()) images_.note(std::string(kPlacesWithoutImage));
    if (vertex_values_left) images_.note(std::string(kVertexValues));
    if (face_values_left) images_.note(std::string(kFaceValues));
    if (sink_.has_lines()) images_.note(std::string(kOnlyFaces));
    images_.note_rest(rest);
    mesh_.notes = images_.take_notes();
    return std::move(mesh_);
  }

  bool vertex_values_left = false, face_values_left = false;  ///< some that have no use

 private:
  /// From the numbers of coloured faces to materials.
  void paint_faces() {
    std::vector<Material> materials(1);
    Palette palette(materials);
    for (std::uint32_t& material : mesh_.material_of)
      if (material != 0) material = palette.number_of(faces_.colour(material - 1));
    if (materials.size() == 1) free_memory(mesh_.material_of);
    settle_paint(mesh_, sink_, std::move(materials), {}, {}, images_);
  }

  const OffHeader& header_;
  ImageStore images_;
  TriangleMesh mesh_;
  FaceSink sink_;
  OffColours vertices_, faces_;
  std::size_t coloured_faces_ = 0;
  bool mapped_ = false;
};

/// Returns the body of "OFF BINARY" in one byte order, with or without a count of colour values behind each face
/// (Geomview writes it, others do not). Empty when the body does not fit that reading.
std::optional<Result<TriangleMesh>> read_binary(const Source& source, std::string_view body, OffHeader header,
                                                bool swap, bool face_colours) {
  const char* at = body.data();
  const char* const end = at + body.size();
  const auto left = [&] { return static_cast<std::size_t>(end - at); };
  const auto count = [&] {
    const auto value = load<std::uint32_t>(at, swap);
    at += 4;
    return value;
  };
  if (left() < 16) return std::nullopt;
  if (header.dimension) header.coordinates = count();
  if (header.coordinates == 0 || header.coordinates > 3) return std::nullopt;
  header.vertices = count();
  header.faces = count();
  at += 4;  // the edges
  const std::size_t place_numbers = header.coordinates + (header.weight ? 1U : 0U);
  const std::size_t numbers = header.least_numbers() + (header.colours ? 4U : 0U) + (header.texture ? 2U : 0U);
  if (header.vertices > left() / (4 * numbers)) return std::nullopt;
  if (header.faces > (left() - header.vertices * 4 * numbers) / 4) return std::nullopt;
  OffMesh mesh(source, header);
  Steps steps = source.steps(header.vertices + header.faces);
  std::array<double, 13> values{};
  for (std::uint64_t k = 0; k < header.vertices; ++k) {
    if (!steps.next()) return source.cancelled();
    for (std::size_t n = 0; n < numbers; ++n, at += 4) values[n] = static_cast<double>(load<float>(at, swap));
    std::array<double, 4> place{};
    std::copy_n(values.begin(), place_numbers, place.begin());
    mesh.add_vertex(place_of(place, header),
                    std::span(values).subspan(header.least_numbers(), numbers - header.least_numbers()));
  }
  std::vector<std::uint32_t> corners;
  for (std::uint64_t face = 0; face < header.faces; ++face) {
    if (!steps.next()) return source.cancelled();
    if (left() < 4) return std::nullopt;
    const std::size_t size = count();
    if (size > left() / 4) return std::nullopt;
    corners.clear();
    for (std::size_t k = 0; k < size; ++k) {
      corners.push_back(count());
      if (corners.back() >= header.vertices) return std::nullopt;
    }
    std::size_t behind = 0;
    if (face_colours) {
      if (left() < 4) return std::nullopt;
      behind = count();
      if (behind > 4 || behind > left() / 4) return std::nullopt;
      for (std::size_t n = 0; n < behind; ++n, at += 4) values[n] = static_cast<double>(load<float>(at, swap));
    }
    mesh.add_face(corners, static_cast<std::size_t>(face), std::span(values).first(behind));
  }
  return mesh.finish(source, "face", {at, left()});
}

Result<TriangleMesh> read_any_binary(const Source& source, std::string_view body, const OffHeader& header) {
  for (const bool face_colours : {true, false}) {
    for (const bool big_endian : {true, false}) {
      const bool swap = big_endian != (std::endian::native == std::endian::big);
      if (auto mesh = read_binary(source, body, header, swap, face_colours)) return *std::move(mesh);
    }
  }
  return source.corrupt("the binary OFF body does not hold the vertices and faces that it declares");
}

class TextReader {
 public:
  TextReader(const Source& source, TextCursor text, const OffHeader& header)
      : source_(source), text_(text), header_(header) {}

  Result<TriangleMesh> read() {
    RELIEF_CHECK(read_counts());
    OffMesh mesh(source_, header_);
    Steps steps = source_.steps(header_.vertices + header_.faces);
    for (std::uint64_t k = 0; k < header_.vertices; ++k) {
      if (!steps.next()) return source_.cancelled();
      RELIEF_CHECK(read_vertex(k, mesh));
    }
    for (std::uint64_t k = 0; k < header_.faces; ++k) {
      if (!steps.next()) return source_.cancelled();
      RELIEF_CHECK(read_face(k, mesh));
    }
    (void)text_.skip_to_value();
    return mesh.finish(source_, "line", {text_.position(), text_.left()});
  }

 private:
  [[nodiscard]] std::unexpected<Error> bad(std::string_view what) const {
    return source_.corrupt("line", text_.line(), what);
  }
  [[nodiscard]] std::unexpected<Error> ends_after(std::uint64_t have, std::uint64_t all, std::string_view what) const {
    return bad("the file ends after " + std::to_string(have) + " of " + std::to_string(all) + " " + std::string(what));
  }

  [[nodiscard]] Status read_counts() {
    std::int64_t value = 0;
    if (header_.dimension) {
      if (!text_.skip_to_value() || !text_.integer(value, true) || value < 1)
        return bad(text_.peek() + " is no number of dimensions");
      if (value > 3) return wrong_dimension(source_, value);
      header_.coordinates = static_cast<std::size_t>(value);
    }
    for (std::uint64_t* count : {&header_.vertices, &header_.faces}) {
      if (!text_.skip_to_value() || !text_.integer(value, true) || value < 0)
        return bad(text_.peek() + " is no count of vertices or faces");
      *count = static_cast<std::uint64_t>(value);
    }
    // The edge count says nothing. It may be missing; on a line of its own it stands alone, as no vertex does.
    TextCursor ahead = text_;
    if (double edges = 0.0; text_.at_line_end() && ahead.skip_to_value() && ahead.number(edges) && ahead.at_line_end())
      text_ = ahead;
    text_.next_line();
    return check_counts(source_, header_, text_.left() + 1);
  }

  [[nodiscard]] Status read_vertex(std::uint64_t k, OffMesh& mesh) {
    if (!text_.skip_to_value()) return ends_after(k, header_.vertices, "vertices");
    std::array<double, 4> place{};
    const std::size_t count = header_.coordinates + (header_.weight ? 1U : 0U);
    for (std::size_t n = 0; n < count; ++n) {
      if (!text_.number(place[n]))
        return bad("a vertex needs " + std::string(count == 3 ? "three" : std::to_string(count)) +
                   " numbers, but there is " + text_.peek());
    }
    double ignored = 0.0;
    for (int n = 0; header_.normals && n < 3; ++n)
      if (!text_.number(ignored)) return bad("a normal needs three numbers, but there is " + text_.peek());
    mesh.add_vertex(place_of(place, header_), rest_of_line(mesh.vertex_values_left));
    return {};
  }

  [[nodiscard]] Status read_face(std::uint64_t k, OffMesh& mesh) {
    if (!text_.skip_to_value()) return ends_after(k, header_.faces, "faces");
    const std::size_t line = text_.line();
    std::int64_t count = 0;
    if (!text_.integer(count, true) || count < 0 || static_cast<std::uint64_t>(count) > text_.left())
      return bad(text_.peek() + " is no count of corners");
    corners_.clear();
    for (std::int64_t c = 0; c < count; ++c) {
      std::int64_t corner = 0;
      if (!text_.skip_to_value() || !text_.integer(corner, true)) return bad(text_.peek() + " is no face corner");
      if (corner < 0 || static_cast<std::uint64_t>(corner) >= header_.vertices) {
        return bad("face corner " + std::to_string(corner) + " (counted from 0) of " +
                   std::to_string(header_.vertices) + " vertices");
      }
      corners_.push_back(static_cast<std::uint32_t>(corner));
    }
    mesh.add_face(corners_, line, rest_of_line(mesh.face_values_left));
    return {};
  }

  /// Returns the numbers up to the end of the line, and goes to the next; none when there are more than a colour with
  /// places in an image has. `left` becomes true when some are not returned.
  [[nodiscard]] std::span<const double> rest_of_line(bool& left) {
    std::size_t count = 0;
    double value = 0.0;
    while (!text_.at_line_end() && text_.number(value))
      if (count++ < rest_.size()) rest_[count - 1] = value;
    left = left || count > rest_.size() || !text_.at_line_end();
    text_.next_line();
    return std::span(rest_).first(count > rest_.size() ? 0 : count);
  }

  const Source& source_;
  TextCursor text_;
  OffHeader header_;
  std::array<double, 6> rest_{};
  std::vector<std::uint32_t> corners_;
};

}  // namespace

Result<TriangleMesh> read_off(const Source& source) {
  TextCursor text(source.bytes);
  if (!text.skip_to_value()) return source.corrupt("holds no OFF header");
  // The keyword may stand against the first count, and may be left out.
  std::string_view rest = source.bytes.substr(static_cast<std::size_t>(text.position() - source.bytes.data()));
  const std::size_t before = rest.size();
  const std::optional<OffHeader> header = read_keyword(rest);
  if (!header) return TextReader(source, text, {}).read();
  for (std::size_t k = 0; k < before - rest.size(); ++k)
    (void)text.take(source.bytes[source.bytes.size() - before + k]);
  TextCursor ahead = text;
  if (!ahead.at_line_end() && ahead.word() == "BINARY") {
    ahead.next_line();
    return read_any_binary(source, {ahead.position(), ahead.left()}, *header);
  }
  return TextReader(source, text, *header).read();
}

}  // namespace relief::detail
