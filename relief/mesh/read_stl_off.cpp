#include <relief/base/try.h>
#include <relief/mesh/readers.h>

#include <cctype>
#include <optional>

namespace relief::detail {
namespace {

bool equals_word(std::string_view text, std::string_view word) noexcept {
  if (text.size() != word.size()) return false;
  for (std::size_t k = 0; k < text.size(); ++k)
    if (std::tolower(static_cast<unsigned char>(text[k])) != word[k]) return false;
  return true;
}

}  // namespace

Result<TriangleMesh> read_stl_text(const Source& source) {
  TriangleMesh mesh;
  TextCursor text(source.bytes);
  std::size_t in_loop = 0;
  bool open = false;  // between outer loop and endloop
  bool in_solid = false;
  for (; !text.done(); text.next_line()) {
    const std::size_t line = text.line();
    const std::string_view key = text.word();
    if (key.empty()) continue;
    if (equals_word(key, "vertex")) {
      if (!open) return source.corrupt("line", line, "a vertex stands outside a loop");
      Vec3d p;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!text.number(p[axis])) {
          return source.corrupt("line", line, "a vertex needs three numbers, but there is " + text.peek());
        }
      }
      text.skip_blanks();
      if (!text.at_line_end()) return source.corrupt("line", line, "a vertex has more than three numbers");
      mesh.positions.push_back(p);
      ++in_loop;
    } else if (equals_word(key, "outer")) {
      if (open) return source.corrupt("line", line, "a loop starts inside another");
      open = true;
      in_loop = 0;
    } else if (equals_word(key, "endloop")) {
      if (!open || in_loop != 3) {
        return source.corrupt("line", line, "a facet has " + std::to_string(in_loop) + " vertices instead of three");
      }
      if (mesh.positions.size() > 0xfffffffeU) return source.error(Errc::UnsupportedFormat, "has too many facets");
      const auto last = static_cast<std::uint32_t>(mesh.positions.size() - 1);
      mesh.triangles.push_back({last - 2, last - 1, last});
      open = false;
    } else if (equals_word(key, "solid")) {
      in_solid = true;
    } else if (equals_word(key, "endsolid") || equals_word(key, "end")) {
      in_solid = false;
    }
    // Anything else (facet normals, colours of some programs) is passed over.
  }
  if (open || in_solid) return source.corrupt("the file ends without endsolid; it is cut off");
  if (mesh.triangles.empty()) return source.error(Errc::UnsupportedFormat, "holds no facets");
  return mesh;
}

Result<TriangleMesh> read_stl_binary(const Source& source) {
  constexpr std::size_t kHead = 84;
  constexpr std::size_t kFacet = 50;
  const std::string_view bytes = source.bytes;
  if (bytes.size() < kHead) return source.corrupt("is neither a text STL nor long enough for a binary one");
  const std::size_t count = load_le<std::uint32_t>(bytes.data() + 80);
  const std::size_t room = (bytes.size() - kHead) / kFacet;
  if (count > room) {
    return source.corrupt("declares " + std::to_string(count) + " triangles as a binary STL, but has room for " +
                          std::to_string(room));
  }
  if (count == 0) return source.error(Errc::UnsupportedFormat, "holds no triangles");
  if (count > 0x55555554U) return source.error(Errc::UnsupportedFormat, "has too many triangles");
  TriangleMesh mesh;
  mesh.positions.reserve(count * 3);
  mesh.triangles.reserve(count);
  const char* at = bytes.data() + kHead;
  for (std::size_t k = 0; k < count; ++k, at += kFacet) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const char* p = at + 12 + 12 * corner;
      mesh.positions.push_back(to_double(Vec3f{load_le<float>(p), load_le<float>(p + 4), load_le<float>(p + 8)}));
    }
    const auto first = static_cast<std::uint32_t>(3 * k);
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

namespace {

struct OffHeader {
  bool texture = false, colours = false, normals = false, binary = false;
  std::uint64_t vertices = 0, faces = 0;
};

Status check_off_counts(const Source& source, const OffHeader& header, std::size_t left, std::size_t vertex_size,
                        std::size_t face_size) {
  const auto declares = [&](std::uint64_t count, std::string_view what, std::size_t most) {
    return source.corrupt("declares " + std::to_string(count) + " " + std::string(what) +
                          ", but the file has room for at most " + std::to_string(most));
  };
  if (header.vertices > left / vertex_size) return declares(header.vertices, "vertices", left / vertex_size);
  if (header.faces > left / face_size) return declares(header.faces, "faces", left / face_size);
  if (header.vertices > 0xfffffffeU) return source.error(Errc::UnsupportedFormat, "has more than 4294967294 vertices");
  return {};
}

/// The body of "OFF BINARY" in one byte order, with or without a count of colour values behind each face (Geomview
/// writes it, others do not). Empty when the body does not fit that reading.
std::optional<TriangleMesh> read_off_binary(const Source& source, const char* at, std::size_t size, OffHeader header,
                                            bool big_endian, bool face_colours, Status& status) {
  const bool swap = big_endian != (std::endian::native == std::endian::big);
  const char* const end = at + size;
  if (size < 12) return std::nullopt;
  header.vertices = load<std::uint32_t>(at, swap);
  header.faces = load<std::uint32_t>(at + 4, swap);
  at += 12;
  const std::size_t stride =
      std::size_t{4} * (3 + (header.normals ? 3U : 0U) + (header.colours ? 4U : 0U) + (header.texture ? 2U : 0U));
  const auto left = [&] { return static_cast<std::size_t>(end - at); };
  if (header.vertices > left() / stride || header.faces > (left() - header.vertices * stride) / 4) return std::nullopt;
  TriangleMesh mesh;
  mesh.positions.reserve(header.vertices);
  for (std::uint64_t k = 0; k < header.vertices; ++k, at += stride) {
    mesh.positions.push_back(
        to_double(Vec3f{load<float>(at, swap), load<float>(at + 4, swap), load<float>(at + 8, swap)}));
  }
  FaceSink sink(mesh);
  std::vector<std::uint32_t> corners;
  for (std::uint64_t face = 0; face < header.faces; ++face) {
    if (left() < 4) return std::nullopt;
    const std::size_t count = load<std::uint32_t>(at, swap);
    at += 4;
    if (count > left() / 4) return std::nullopt;
    corners.clear();
    for (std::size_t k = 0; k < count; ++k, at += 4) {
      corners.push_back(load<std::uint32_t>(at, swap));
      if (corners.back() >= header.vertices) return std::nullopt;
    }
    sink.add(corners, static_cast<std::size_t>(face));
    if (!face_colours) continue;
    if (left() < 4) return std::nullopt;
    const std::size_t values = load<std::uint32_t>(at, swap);
    at += 4;
    if (values > 4 || values > left() / 4) return std::nullopt;
    at += 4 * values;
  }
  status = sink.finish(source, "face");
  return mesh;
}

}  // namespace

Result<TriangleMesh> read_off(const Source& source) {
  TextCursor text(source.bytes);
  OffHeader header;
  if (!text.skip_to_value()) return source.corrupt("holds no OFF header");
  // The keyword may stand against the first count, and may be left out.
  std::string_view key = source.bytes.substr(static_cast<std::size_t>(text.position() - source.bytes.data()));
  std::size_t length = 0;
  const auto prefix = [&](std::string_view letters) {
    const bool found = key.substr(length).starts_with(letters);
    if (found) length += letters.size();
    return found;
  };
  header.texture = prefix("ST");
  header.colours = prefix("C");
  header.normals = prefix("N");
  const bool four = prefix("4");
  const bool any = prefix("n");
  if (prefix("OFF")) {
    if (four || any) return source.error(Errc::UnsupportedFormat, "is an OFF file of another dimension than three");
    for (std::size_t k = 0; k < length; ++k) (void)text.take(key[k]);
    if (!text.at_line_end()) {
      TextCursor ahead = text;
      header.binary = ahead.word() == "BINARY";
    }
  } else {
    header = {};
  }
  if (header.binary) {
    text.next_line();
    for (const bool face_colours : {true, false}) {
      for (const bool big_endian : {true, false}) {
        Status status;
        auto mesh = read_off_binary(source, text.position(), text.left(), header, big_endian, face_colours, status);
        if (!mesh) continue;
        if (!status) return std::unexpected(status.error());
        return *std::move(mesh);
      }
    }
    return source.corrupt("the binary OFF body does not hold the vertices and faces that it declares");
  }

  for (std::uint64_t* count : {&header.vertices, &header.faces}) {
    std::int64_t value = 0;
    if (!text.skip_to_value() || !text.integer(value, true) || value < 0) {
      return source.corrupt("line", text.line(), text.peek() + " is no count of vertices or faces");
    }
    *count = static_cast<std::uint64_t>(value);
  }
  text.next_line();  // the edge count says nothing
  RELIEF_CHECK(check_off_counts(source, header, text.left() + 1, 6, 2));

  TriangleMesh mesh;
  mesh.positions.reserve(header.vertices);
  if (header.colours) mesh.colours.reserve(header.vertices);
  std::array<double, 4> colour{};
  bool wide_colours = false;  // 0..255 instead of 0..1
  std::vector<std::array<float, 4>> colours;
  for (std::uint64_t k = 0; k < header.vertices; ++k) {
    Vec3d p;
    if (!text.skip_to_value()) {
      return source.corrupt(
          "line", text.line(),
          "the file ends after " + std::to_string(k) + " of " + std::to_string(header.vertices) + " vertices");
    }
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (!text.number(p[axis]))
        return source.corrupt("line", text.line(), "a vertex needs three numbers, but there is " + text.peek());
    mesh.positions.push_back(p);
    if (header.colours) {
      double ignored = 0.0;
      for (int n = 0; header.normals && n < 3; ++n)
        if (!text.number(ignored)) return source.corrupt("line", text.line(), "a normal needs three numbers");
      colour = {1.0, 1.0, 1.0, -1.0};
      std::size_t count = 0;
      while (count < (header.texture ? 3U : 4U) && text.number(colour[count])) ++count;
      for (std::size_t c = 0; c < count; ++c) wide_colours = wide_colours || colour[c] > 1.0;
      colours.push_back({static_cast<float>(colour[0]), static_cast<float>(colour[1]), static_cast<float>(colour[2]),
                         static_cast<float>(colour[3])});
    }
    text.next_line();
  }
  for (const auto& c : colours) {
    const double scale = wide_colours ? 1.0 / 255.0 : 1.0;
    mesh.colours.push_back({unit_to_byte(double{c[0]} * scale), unit_to_byte(double{c[1]} * scale),
                            unit_to_byte(double{c[2]} * scale),
                            c[3] < 0.0F ? std::uint8_t{255} : unit_to_byte(double{c[3]} * scale)});
  }

  FaceSink sink(mesh);
  std::vector<std::uint32_t> corners;
  mesh.triangles.reserve(header.faces);
  for (std::uint64_t face = 0; face < header.faces; ++face) {
    if (!text.skip_to_value()) {
      return source.corrupt(
          "line", text.line(),
          "the file ends after " + std::to_string(face) + " of " + std::to_string(header.faces) + " faces");
    }
    const std::size_t line = text.line();
    std::int64_t count = 0;
    if (!text.integer(count, true) || count < 0 || static_cast<std::uint64_t>(count) > text.left()) {
      return source.corrupt("line", line, text.peek() + " is no count of corners");
    }
    corners.clear();
    for (std::int64_t k = 0; k < count; ++k) {
      std::int64_t corner = 0;
      if (!text.skip_to_value() || !text.integer(corner, true)) {
        return source.corrupt("line", text.line(), text.peek() + " is no face corner");
      }
      if (corner < 0 || static_cast<std::uint64_t>(corner) >= header.vertices) {
        return source.corrupt("line", text.line(),
                              "face corner " + std::to_string(corner) + " (counted from 0) of " +
                                  std::to_string(header.vertices) + " vertices");
      }
      corners.push_back(static_cast<std::uint32_t>(corner));
    }
    sink.add(corners, line);
    text.next_line();  // the face's colour
  }
  RELIEF_CHECK(sink.finish(source, "line"));
  return mesh;
}

}  // namespace relief::detail
