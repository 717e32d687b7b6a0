#include <relief/base/assert.h>
#include <relief/base/steps.h>
#include <relief/base/try.h>
#include <relief/mesh/export.h>
#include <relief/mesh/out_file.h>
#include <relief/mesh/read/colour_space.h>

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <exception>
#include <new>
#include <utility>
#include <vector>

namespace relief {
namespace {

using detail::OutFile;

/// Returns whether every coordinate is the same number in single precision.
bool fits_float(const TriangleMesh& mesh) noexcept {
  return std::ranges::all_of(mesh.positions, [](const Vec3d& p) { return to_double(to_float(p)) == p; });
}

/// One coordinate as text: nine digits where single precision holds the whole mesh, else as many as the double needs.
void write_number(OutFile& out, double value, bool as_float) {
  if (as_float) {
    out.text(static_cast<float>(value));
  } else {
    out.text(value);
  }
}

void write_ply(OutFile& out, const TriangleMesh& mesh, bool doubles, Steps& steps) {
  const bool alpha = std::ranges::any_of(mesh.colours, [](Rgba8 c) { return c.a != 255; });
  std::string head = "ply\nformat binary_little_endian 1.0\ncomment made by Relief\n";
  if (mesh.phantom_from)
    head += "comment phantom_triangles " + std::to_string(mesh.triangles.size() - *mesh.phantom_from) + "\n";
  head += "element vertex " + std::to_string(mesh.positions.size()) + "\n";
  for (const char* axis : {"x", "y", "z"})
    head += std::string("property ") + (doubles ? "double " : "float ") + axis + "\n";
  if (!mesh.colours.empty()) {
    for (const char* channel : {"red", "green", "blue"}) head += std::string("property uchar ") + channel + "\n";
    if (alpha) head += "property uchar alpha\n";
  }
  head += "element face " + std::to_string(mesh.triangles.size()) +
          "\nproperty list uchar int vertex_indices\nend_header\n";
  out.write(head);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    if (!steps.next()) return;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (doubles) {
        out.value(mesh.positions[v][axis]);
      } else {
        out.value(static_cast<float>(mesh.positions[v][axis]));
      }
    }
    if (mesh.colours.empty()) continue;
    const Rgba8 c = mesh.colours[v];
    out.value(c.r);
    out.value(c.g);
    out.value(c.b);
    if (alpha) out.value(c.a);
  }
  for (const Triangle& t : mesh.triangles) {
    if (!steps.next()) return;
    out.value(std::uint8_t{3});
    for (const std::uint32_t corner : t) out.value(corner);
  }
}

void write_obj(OutFile& out, const TriangleMesh& mesh, Steps& steps) {
  const bool as_float = fits_float(mesh);
  out.write("# made by Relief\n");
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    if (!steps.next()) return;
    out.write("v");
    for (std::size_t axis = 0; axis < 3; ++axis) {
      out.write(" ");
      write_number(out, mesh.positions[v][axis], as_float);
    }
    if (!mesh.colours.empty()) {
      const Rgba8 c = mesh.colours[v];
      for (const std::uint8_t channel : {c.r, c.g, c.b}) {
        out.write(" ");
        out.text(static_cast<float>(channel) / 255.0F);
      }
    }
    out.write("\n");
  }
  for (const Triangle& t : mesh.triangles) {
    if (!steps.next()) return;
    out.write("f");
    for (const std::uint32_t corner : t) {
      out.write(" ");
      out.text(std::uint64_t{corner} + 1);
    }
    out.write("\n");
  }
}

void write_stl(OutFile& out, const TriangleMesh& mesh, Steps& steps) {
  std::array<char, 80> head{};
  constexpr std::string_view kHead = "binary STL made by Relief";
  std::ranges::copy(kHead, head.begin());
  out.write({head.data(), head.size()});
  out.value(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& [a, b, c] : mesh.triangles) {
    if (!steps.next()) return;
    const std::array<Vec3d, 3> corners = {mesh.positions[a], mesh.positions[b], mesh.positions[c]};
    Vec3d n = cross(corners[1] - corners[0], corners[2] - corners[0]);
    n = length(n) > 0.0 && std::isfinite(length(n)) ? normalized(n) : Vec3d{};
    for (const Vec3d& p : {n, corners[0], corners[1], corners[2]}) {
      for (std::size_t axis = 0; axis < 3; ++axis) out.value(static_cast<float>(p[axis]));
    }
    out.value(std::uint16_t{0});
  }
}

template <typename T>
std::string number_text(T value) {
  std::array<char, 40> raw{};
  return {raw.data(), std::to_chars(raw.data(), raw.data() + raw.size(), value).ptr};
}

Status write_glb(OutFile& out, const TriangleMesh& mesh, Unit unit, const std::string& name, Steps& steps) {
  // Single precision is all that glTF has. Where it is too little, positions are stored about the centre of the box and
  // a node moves them back.
  const Vec3d centre = fits_float(mesh) ? Vec3d{} : bounds(mesh).centre();
  const double scale = metres(unit);
  Vec3f low = to_float(mesh.positions[0] - centre);
  Vec3f high = low;
  for (const Vec3d& position : mesh.positions) {
    const Vec3f p = to_float(position - centre);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  }
  const auto triple = [](auto v) {
    std::string text;
    for (const auto value : {v.x, v.y, v.z}) {
      text += text.empty() ? '[' : ',';
      text += number_text(value);
    }
    text += ']';
    return text;
  };
  const std::uint64_t vertices = mesh.positions.size();
  const std::uint64_t position_bytes = vertices * 12;
  const std::uint64_t colour_bytes = mesh.colours.empty() ? 0 : vertices * 8;
  const std::uint64_t index_bytes = std::uint64_t{mesh.triangles.size()} * 12;
  const std::uint64_t body = position_bytes + colour_bytes + index_bytes;
  const auto view = [](std::uint64_t offset, std::uint64_t size, int target) {
    std::string text = "{\"buffer\":0,\"byteOffset\":";
    text += std::to_string(offset) + ",\"byteLength\":" + std::to_string(size) +
            ",\"target\":" + std::to_string(target) + "}";
    return text;
  };
  std::string json =
      R"({"asset":{"version":"2.0","generator":"Relief"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0)";
  if (centre != Vec3d{}) json.append(",\"translation\":").append(triple(centre * scale));
  if (scale != 1.0) json.append(",\"scale\":").append(triple(Vec3d{scale, scale, scale}));
  json += R"(}],"meshes":[{"primitives":[{"mode":4,"material":0,"attributes":{"POSITION":0)";
  if (colour_bytes != 0) json += R"(,"COLOR_0":2)";
  json += R"(},"indices":1}]}],"materials":[{"pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":0.8}}],)";
  json += R"("accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":)" + std::to_string(vertices) +
          ",\"min\":" + triple(low) + ",\"max\":" + triple(high) + "}";
  json += R"(,{"bufferView":1,"componentType":5125,"type":"SCALAR","count":)" +
          std::to_string(mesh.triangles.size() * 3) + "}";
  if (colour_bytes != 0) {
    json += R"(,{"bufferView":2,"componentType":5123,"normalized":true,"type":"VEC4","count":)" +
            std::to_string(vertices) + "}";
  }
  json.append("],\"bufferViews\":[").append(view(0, position_bytes, 34962));
  json.append(",").append(view(position_bytes + colour_bytes, index_bytes, 34963));
  if (colour_bytes != 0) json.append(",").append(view(position_bytes, colour_bytes, 34962));
  json.append("],\"buffers\":[{\"byteLength\":").append(std::to_string(body)).append("}]}");
  while (json.size() % 4 != 0) json += ' ';
  const std::uint64_t total = 12 + 8 + json.size() + 8 + body;
  if (total > 0xffffffffU) {
    return fail(Errc::UnsupportedFormat, name + ": would be larger than the 4 GiB that GLB allows; export PLY instead");
  }
  out.write("glTF");
  out.value(std::uint32_t{2});
  out.value(static_cast<std::uint32_t>(total));
  out.value(static_cast<std::uint32_t>(json.size()));
  out.write("JSON");
  out.write(json);
  out.value(static_cast<std::uint32_t>(body));
  out.write(std::string_view("BIN\0", 4));
  for (const Vec3d& position : mesh.positions) {
    if (!steps.next()) return {};
    const Vec3f p = to_float(position - centre);
    out.value(p.x);
    out.value(p.y);
    out.value(p.z);
  }
  if (colour_bytes != 0) {
    std::array<std::uint16_t, 256> linear{};
    for (std::size_t k = 0; k < linear.size(); ++k) linear[k] = detail::linear_from_srgb(static_cast<std::uint8_t>(k));
    for (const Rgba8 c : mesh.colours) {
      for (const std::uint8_t channel : {c.r, c.g, c.b}) out.value(linear[channel]);
      out.value(static_cast<std::uint16_t>(c.a * 257));
    }
  }
  for (const Triangle& t : mesh.triangles) {
    if (!steps.next()) return {};
    for (const std::uint32_t corner : t) out.value(corner);
  }
  return {};
}

/// Writes the members of a zip archive one after another, deflated on the way. Dates are fixed, so equal meshes give
/// equal files.
class ZipWriter {
 public:
  explicit ZipWriter(OutFile& out) : out_(out) {}
  ZipWriter(const ZipWriter&) = delete;
  ZipWriter& operator=(const ZipWriter&) = delete;
  ~ZipWriter() {
    if (open_) deflateEnd(&stream_);
  }

  void begin(std::string name) {
    stream_ = {};
    open_ = deflateInit2(&stream_, 1, Z_DEFLATED, -15, 8, Z_DEFAULT_STRATEGY) == Z_OK;
    members_.push_back({std::move(name), out_.position()});
    crc_ = crc32(0, nullptr, 0);
    size_ = 0;
    header(members_.back(), 0x04034b50U, false);
    start_ = out_.position();
  }
  void write(std::string_view text) {
    held_ += text;
    if (held_.size() >= kHold) pack(Z_NO_FLUSH);
  }
  template <typename T>
  void number(T value) {
    std::array<char, 40> raw{};
    const auto [stop, code] = std::to_chars(raw.data(), raw.data() + raw.size(), value);
    write({raw.data(), static_cast<std::size_t>(stop - raw.data())});
  }
  void end() {
    pack(Z_FINISH);
    if (open_) deflateEnd(&stream_);
    open_ = false;
    Member& member = members_.back();
    member.crc = static_cast<std::uint32_t>(crc_);
    member.packed = out_.position() - start_;
    member.size = size_;
    sound_ = sound_ && member.packed <= 0xfffffffeU && member.size <= 0xfffffffeU;
    out_.value(std::uint32_t{0x08074b50U});  // CRC and sizes follow the data, since they were not known before
    out_.value(member.crc);
    out_.value(static_cast<std::uint32_t>(member.packed));
    out_.value(static_cast<std::uint32_t>(member.size));
  }
  /// Writes the list of members; false when the archive is larger than the format or the memory allows.
  [[nodiscard]] bool finish() {
    const std::uint64_t start = out_.position();
    for (const Member& member : members_) header(member, 0x02014b50U, true);
    const std::uint64_t size = out_.position() - start;
    sound_ = sound_ && out_.position() <= 0xfffffffeU;
    out_.value(std::uint32_t{0x06054b50U});
    out_.value(std::uint32_t{0});
    out_.value(static_cast<std::uint16_t>(members_.size()));
    out_.value(static_cast<std::uint16_t>(members_.size()));
    out_.value(static_cast<std::uint32_t>(size));
    out_.value(static_cast<std::uint32_t>(start));
    out_.value(std::uint16_t{0});
    return sound_;
  }

 private:
  static constexpr std::size_t kHold = std::size_t{1} << 16U;
  struct Member {
    std::string name;
    std::uint64_t offset = 0, packed = 0, size = 0;
    std::uint32_t crc = 0;
  };

  void header(const Member& member, std::uint32_t mark, bool central) {
    out_.value(mark);
    if (central) out_.value(std::uint16_t{20});  // made by
    out_.value(std::uint16_t{20});               // needed to read
    out_.value(std::uint16_t{8});                // flags: CRC and sizes follow the data
    out_.value(std::uint16_t{8});                // deflate
    out_.value(std::uint16_t{0});                // time
    out_.value(std::uint16_t{0x21});             // 1 January 1980
    out_.value(member.crc);
    out_.value(static_cast<std::uint32_t>(member.packed));
    out_.value(static_cast<std::uint32_t>(member.size));
    out_.value(static_cast<std::uint16_t>(member.name.size()));
    out_.value(std::uint16_t{0});  // extra
    if (central) {
      for (int k = 0; k < 3; ++k) out_.value(std::uint16_t{0});  // comment, disk, internal attributes
      out_.value(std::uint32_t{0});                              // external attributes
      out_.value(static_cast<std::uint32_t>(member.offset));
    }
    out_.write(member.name);
  }
  void pack(int mode) {
    crc_ = crc32(crc_, reinterpret_cast<const Bytef*>(held_.data()), static_cast<uInt>(held_.size()));
    size_ += held_.size();
    sound_ = sound_ && open_;
    std::array<char, kHold> packed;
    stream_.next_in = reinterpret_cast<Bytef*>(held_.data());
    stream_.avail_in = static_cast<uInt>(held_.size());
    do {
      if (!sound_) break;
      stream_.next_out = reinterpret_cast<Bytef*>(packed.data());
      stream_.avail_out = static_cast<uInt>(packed.size());
      sound_ = deflate(&stream_, mode) != Z_STREAM_ERROR;
      out_.write({packed.data(), packed.size() - stream_.avail_out});
    } while (stream_.avail_out == 0);
    held_.clear();
  }

  OutFile& out_;
  z_stream stream_{};
  bool open_ = false;
  bool sound_ = true;
  std::string held_;
  uLong crc_ = 0;
  std::uint64_t size_ = 0, start_ = 0;
  std::vector<Member> members_;
};

Status write_3mf(OutFile& out, const TriangleMesh& mesh, Unit unit, const std::string& name, Steps& steps) {
  constexpr std::string_view kXml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
  ZipWriter zip(out);
  zip.begin("[Content_Types].xml");
  zip.write(kXml);
  zip.write(
      "<Types xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\">"
      "<Default Extension=\"rels\" ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/>"
      "<Default Extension=\"model\" ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/></Types>");
  zip.end();
  zip.begin("_rels/.rels");
  zip.write(kXml);
  zip.write(
      "<Relationships xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\">"
      "<Relationship Target=\"/3D/3dmodel.model\" Id=\"rel0\" "
      "Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/></Relationships>");
  zip.end();

  zip.begin("3D/3dmodel.model");
  zip.write(kXml);
  zip.write("<model unit=\"");
  zip.write(unit == Unit::Millimetre   ? "millimeter"
            : unit == Unit::Centimetre ? "centimeter"
            : unit == Unit::Inch       ? "inch"
                                       : "meter");
  zip.write(
      "\" xml:lang=\"en-US\" xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" "
      "xmlns:m=\"http://schemas.microsoft.com/3dmanufacturing/material/2015/02\">\n<resources>\n");
  const auto packed = [](Rgba8 c) {
    return std::uint32_t{c.r} << 24U | std::uint32_t{c.g} << 16U | std::uint32_t{c.b} << 8U | std::uint32_t{c.a};
  };
  std::vector<std::uint32_t> palette;
  palette.reserve(mesh.colours.size());
  for (const Rgba8 c : mesh.colours) palette.push_back(packed(c));
  std::ranges::sort(palette);
  palette.erase(std::ranges::unique(palette).begin(), palette.end());
  if (!palette.empty()) {
    zip.write("<m:colorgroup id=\"2\">\n");
    for (const std::uint32_t c : palette) {
      constexpr std::string_view kHex = "0123456789ABCDEF";
      zip.write("<m:color color=\"#");
      for (unsigned shift = 32; shift > 0; shift -= 4) zip.write(kHex.substr((c >> (shift - 4)) & 15U, 1));
      zip.write("\"/>\n");
    }
    zip.write("</m:colorgroup>\n");
  }
  zip.write("<object id=\"1\" type=\"model\"");
  if (!palette.empty()) zip.write(" pid=\"2\" pindex=\"0\"");
  zip.write("><mesh>\n<vertices>\n");
  const bool as_float = fits_float(mesh);
  const auto coordinate = [&](double value) {
    if (as_float) {
      zip.number(static_cast<float>(value));
    } else {
      zip.number(value);
    }
  };
  for (const Vec3d& p : mesh.positions) {
    if (!steps.next()) return {};
    zip.write("<vertex x=\"");
    coordinate(p.x);
    zip.write("\" y=\"");
    coordinate(p.y);
    zip.write("\" z=\"");
    coordinate(p.z);
    zip.write("\"/>\n");
  }
  zip.write("</vertices>\n<triangles>\n");
  const auto swatch = [&](std::uint32_t vertex) {
    return std::ranges::lower_bound(palette, packed(mesh.colours[vertex])) - palette.begin();
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    if (!steps.next()) return {};
    zip.write("<triangle v1=\"");
    zip.number(a);
    zip.write("\" v2=\"");
    zip.number(b);
    zip.write("\" v3=\"");
    zip.number(c);
    if (!palette.empty()) {
      zip.write("\" pid=\"2\" p1=\"");
      zip.number(swatch(a));
      zip.write("\" p2=\"");
      zip.number(swatch(b));
      zip.write("\" p3=\"");
      zip.number(swatch(c));
    }
    zip.write("\"/>\n");
    if (out.failed()) break;
  }
  zip.write("</triangles>\n</mesh></object>\n</resources>\n<build><item objectid=\"1\"/></build>\n</model>\n");
  zip.end();
  if (zip.finish()) return {};
  return fail(Errc::UnsupportedFormat,
              name + ": would be larger than the 4 GiB that its zip archive allows; export PLY instead");
}

/// Formats that hold single precision only cannot hold every double.
Status check(const TriangleMesh& mesh, const std::string& name, bool as_float) {
  RELIEF_ASSERT(mesh.colours.empty() || mesh.colours.size() == mesh.positions.size());
  if (mesh.empty()) return fail(Errc::InvalidArgument, name + ": there is no triangle to write");
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const Vec3d p = mesh.positions[v];
    if (!is_finite(p) || (as_float && !is_finite(to_float(p)))) {
      return fail(Errc::InvalidArgument,
                  name + ": vertex " + std::to_string(v) + " is not finite or too far out for the format");
    }
  }
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t corner : t) RELIEF_ASSERT(corner < mesh.positions.size());
  return {};
}

Status write_any(const TriangleMesh& mesh, const std::filesystem::path& file, const ExportSettings& settings,
                 const std::string& name, const Progress& progress) {
  const auto cancelled = [&] { return fail(Errc::Cancelled, name + ": not written, as the export was cancelled"); };
  if (progress.cancelled()) return cancelled();  // the mesh may be one that was not finished
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  constexpr std::array<std::string_view, 5> kKnown = {".ply", ".obj", ".stl", ".glb", ".3mf"};
  if (std::ranges::find(kKnown, extension) == kKnown.end()) {
    return fail(Errc::UnsupportedFormat, name + ": its extension must be ply, obj, stl, glb or 3mf");
  }
  const bool as_float =
      extension == ".stl" || extension == ".glb" || (extension == ".ply" && !settings.double_positions);
  RELIEF_CHECK(check(mesh, name, as_float));
  if (extension == ".ply" && mesh.positions.size() > 0x7fffffffU) {
    return fail(Errc::UnsupportedFormat, name + ": PLY counts vertices up to 2147483647");
  }
  RELIEF_TRY(AtomicFile atomic, AtomicFile::create(file));
  OutFile out(std::move(atomic));
  Steps steps(progress, "export", mesh.positions.size() + mesh.triangles.size());
  if (extension == ".ply") {
    write_ply(out, mesh, settings.double_positions, steps);
  } else if (extension == ".obj") {
    write_obj(out, mesh, steps);
  } else if (extension == ".stl") {
    write_stl(out, mesh, steps);
  } else if (extension == ".glb") {
    RELIEF_CHECK(write_glb(out, mesh, settings.unit, name, steps));
  } else {
    RELIEF_CHECK(write_3mf(out, mesh, settings.unit, name, steps));
  }
  if (steps.stopped() || progress.cancelled()) return cancelled();
  return out.commit();
}

}  // namespace

Status export_mesh(const TriangleMesh& mesh, const std::filesystem::path& file, const ExportSettings& settings,
                   const Progress& progress) {
  std::string name = "the mesh file";
  try {
    name = printable(file.string());
    return write_any(mesh, file, settings, name, progress);
  } catch (const std::bad_alloc&) {
    return fail(Errc::Io, name + ": needs more memory than there is");
  } catch (const std::exception& problem) {
    return fail(Errc::Io, name + ": cannot be written: " + printable(problem.what(), 120));
  }
}

}  // namespace relief
