#include <relief/base/try.h>
#include <relief/mesh/read/obj_materials.h>
#include <relief/mesh/read/readers.h>

namespace relief::detail {
namespace {

struct ColourText {
  float r = 1.0F, g = 1.0F, b = 1.0F;
};

/// Colours stand as 0..1 in most files and as 0..255 in some; one value above 1 decides for the whole file.
std::vector<Rgba8> to_bytes(const std::vector<ColourText>& colours) {
  float largest = 0.0F;
  for (const ColourText& c : colours) largest = std::max({largest, c.r, c.g, c.b});
  const double scale = largest > 1.0F ? 1.0 / 255.0 : 1.0;
  std::vector<Rgba8> bytes;
  bytes.reserve(colours.size());
  for (const ColourText& c : colours) {
    bytes.push_back(
        {unit_to_byte(double{c.r} * scale), unit_to_byte(double{c.g} * scale), unit_to_byte(double{c.b} * scale)});
  }
  return bytes;
}

}  // namespace

Result<TriangleMesh> read_obj(const Source& source) {
  TriangleMesh mesh;
  FaceSink sink(mesh);
  std::vector<ColourText> colours;  // as long as the positions, once one vertex has a colour
  std::vector<std::uint32_t> corners, uvs;
  std::vector<std::array<float, 2>> coordinates;
  ObjMaterials materials(source);
  std::uint32_t material = 0;
  bool has_curves = false;
  TextCursor text(source.bytes, true);
  Steps steps = source.steps(source.bytes.size());

  for (; !text.done(); text.next_line()) {
    if (!steps.reached(source.bytes.size() - text.left())) return source.cancelled();
    const std::string_view key = text.word();
    if (key == "v") {
      std::array<double, 7> values{};
      std::size_t count = 0;
      while (count < values.size() && !text.at_line_end()) {
        if (!text.number(values[count])) {
          return source.corrupt("line", text.line(), text.peek() + " is not a number");
        }
        ++count;
      }
      if (count < 3) return source.corrupt("line", text.line(), "a vertex needs three numbers");
      if (mesh.positions.size() == 0xfffffffeU)
        return source.error(Errc::UnsupportedFormat, "has more than 4294967294 vertices");
      mesh.positions.push_back({values[0], values[1], values[2]});
      if (count >= 6) {
        colours.resize(mesh.positions.size() - 1);
        colours.push_back(
            {static_cast<float>(values[3]), static_cast<float>(values[4]), static_cast<float>(values[5])});
      }
    } else if (key == "vt") {
      // Only colours depend on it: what is not a number counts as 0.
      double u = 0, v = 0;
      static_cast<void>(text.number(u) && !text.at_line_end() && text.number(v));
      coordinates.push_back({static_cast<float>(u), static_cast<float>(v)});
    } else if (key == "mtllib") {
      materials.load_libraries(text.rest());
    } else if (key == "usemtl") {
      material = materials.find(text.rest());
    } else if (key == "f") {
      const std::size_t line = text.line();
      const bool pictured = materials.has_image(material);
      corners.clear();
      uvs.clear();
      while (!text.at_line_end()) {
        std::int64_t corner = 0;
        if (!text.integer(corner)) return source.corrupt("line", text.line(), text.peek() + " is no face corner");
        std::int64_t uv = 0;
        for (int k = 0; k < 2 && text.take('/'); ++k) {
          // Texture and normal numbers, either of which may be left out.
          std::int64_t other = 0;
          const char* const before = text.position();
          if (before != source.bytes.data() + source.bytes.size() &&
              (*before == '-' || (*before >= '0' && *before <= '9')) && !text.integer(other)) {
            return source.corrupt("line", text.line(), text.peek() + " is no face corner");
          }
          if (k == 0) uv = other;
        }
        if (pictured) {
          if (uv < 0) uv += static_cast<std::int64_t>(coordinates.size()) + 1;
          uvs.push_back(uv > 0 && uv < FaceSink::kNoUv ? static_cast<std::uint32_t>(uv - 1) : FaceSink::kNoUv);
        }
        const auto have = static_cast<std::int64_t>(mesh.positions.size());
        if (corner == 0) return source.corrupt("line", line, "face corner 0; OBJ counts from 1");
        if (corner < -have || corner > 0xffffffffLL) {
          return source.corrupt("line", line,
                                "face corner " + std::to_string(corner) + " of " + std::to_string(have) + " vertices");
        }
        corners.push_back(static_cast<std::uint32_t>(corner > 0 ? corner - 1 : have + corner));
      }
      sink.add(corners, line, {material, uvs});
    } else if (key == "l" || key == "p") {
      sink.leave_out_line();
    } else if (key == "curv" || key == "curv2" || key == "surf") {
      has_curves = true;
    }
  }
  RELIEF_CHECK(sink.finish(source, "line", 1));
  if (!colours.empty()) {
    colours.resize(mesh.positions.size());
    mesh.colours = to_bytes(colours);
  }
  if (has_curves) materials.note("curves or curved surfaces were passed over; only polygons are read");
  materials.dress(mesh, sink, coordinates);
  return mesh;
}

}  // namespace relief::detail
