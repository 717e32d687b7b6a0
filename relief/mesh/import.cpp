#include <relief/base/try.h>
#include <relief/mesh/import.h>
#include <relief/mesh/read/inflate.h>
#include <relief/mesh/read/readers.h>

#include <algorithm>
#include <cctype>
#include <exception>
#include <new>

namespace relief {
namespace {

using detail::Source;

/// Returns the one that tells the format: that before .gz, where there is one.
std::string lower_extension(const std::filesystem::path& file) {
  std::string text = file.extension().string();
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text == ".gz" ? lower_extension(file.stem()) : text;
}

/// UTF-16 text with a byte order mark, cut down to ASCII: what lies above carries no geometry.
std::string ascii_from_utf16(std::string_view bytes) {
  const bool big_endian = static_cast<unsigned char>(bytes[0]) == 0xfe;
  std::string text;
  text.reserve(bytes.size() / 2);
  for (std::size_t k = 2; k + 1 < bytes.size(); k += 2) {
    const auto high = static_cast<unsigned char>(bytes[big_endian ? k : k + 1]);
    const auto low = static_cast<unsigned char>(bytes[big_endian ? k + 1 : k]);
    text += high == 0 && low < 0x80 ? static_cast<char>(low) : '?';
  }
  return text;
}

std::string_view without_leading_blanks(std::string_view text) noexcept {
  const std::size_t at = text.find_first_not_of(" \t\r\n");
  return at == std::string_view::npos ? std::string_view() : text.substr(at);
}

bool is_binary_stl(std::string_view bytes) noexcept {
  if (bytes.size() < 84) return false;
  const std::size_t count = detail::load_le<std::uint32_t>(bytes.data() + 80);
  return count > 0 && bytes.size() == 84 + 50 * count;
}

/// Starts with "solid" or a facet (blanks before it allowed), speaks of facets or ends at once, and has no zeros, as
/// text does.
bool is_text_stl(std::string_view bytes) {
  const std::string_view text = without_leading_blanks(bytes);
  std::string head(text.substr(0, 4096));
  for (char& c : head) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return (head.starts_with("solid") || head.starts_with("facet")) && !head.contains('\0') &&
         (head.contains("facet") || head.contains("endsolid") || head.contains("end solid"));
}

/// Returns the OFF keyword with its optional prefixes, after comments.
bool is_off(std::string_view text) noexcept {
  text = without_leading_blanks(text);
  while (text.starts_with('#')) {
    const std::size_t end = text.find_first_of("\r\n");
    if (end == std::string_view::npos) return false;
    text = without_leading_blanks(text.substr(end));
  }
  // ST, C, N, 4 and n in whatever order.
  return text.substr(std::min(text.find_first_not_of("STCN4n"), text.size())).starts_with("OFF");
}

/// Returns whether one of the first lines is a vertex or a face as OBJ writes them.
bool looks_like_obj(std::string_view text) noexcept {
  text = text.substr(0, 65536);
  while (!text.empty()) {
    if ((text.starts_with("v ") || text.starts_with("f ")) && text.size() > 2 &&
        std::string_view("0123456789+-. ").find(text[2]) != std::string_view::npos) {
      return true;
    }
    const std::size_t end = text.find_first_of("\r\n");
    if (end == std::string_view::npos) return false;
    text = without_leading_blanks(text.substr(end));
  }
  return false;
}

constexpr std::string_view kGzip = "\x1f\x8b";

/// Puts what a gzip file holds in its place.
Status unpack_gzip(const std::string& name, detail::FileBytes& bytes, std::string& unpacked, const Progress& progress) {
  const auto refused = [&](Errc code, std::string_view what) { return fail(code, name + ": " + std::string(what)); };
  Steps steps(progress, detail::kImport, bytes.size, detail::kReadShare, detail::kUnpackedShare);
  switch (
      detail::inflate_all(bytes.view(), detail::Wrapper::Gzip, detail::most_unpacked(bytes.size), unpacked, steps)) {
    case detail::Inflated::Cancelled:
      return refused(Errc::Cancelled, detail::kReadingCancelled);
    case detail::Inflated::TooLarge:
      return refused(Errc::UnsupportedFormat, "unpacks to more than a hundred times its size; unpack it with gzip");
    case detail::Inflated::Damaged:
      return refused(Errc::Corrupt, "its gzip data are damaged or cut off");
    case detail::Inflated::Whole:
      break;
  }
  bytes = {};
  return {};
}

Result<TriangleMesh> read_any(Source source) {
  constexpr std::string_view kKnown = "PLY, OBJ, STL, OFF, glTF, GLB, 3MF and DRC can be read";
  if (source.bytes.empty()) return source.corrupt("is empty; export it again");
  std::string decoded;
  if (source.bytes.starts_with("\xfe\xff") || source.bytes.starts_with("\xff\xfe")) {
    decoded = ascii_from_utf16(source.bytes);
    source.bytes = decoded;
  } else if (source.bytes.starts_with("\xef\xbb\xbf")) {
    source.bytes.remove_prefix(3);
  }
  const std::string_view bytes = source.bytes;
  const std::string extension = lower_extension(source.path);

  const auto packed = [&](std::string_view with) {
    return source.error(Errc::UnsupportedFormat, "is compressed with " + std::string(with) + "; unpack it first");
  };
  if (bytes.starts_with(kGzip)) return packed("gzip, twice");
  if (bytes.starts_with("BZh")) return packed("bzip2");
  if (bytes.starts_with(std::string_view("\xfd"
                                         "7zXZ",
                                         5)))
    return packed("xz");
  if (bytes.starts_with("\x28\xb5\x2f\xfd")) return packed("zstd");
  if (bytes.starts_with("version https://git-lfs")) {
    return source.error(Errc::UnsupportedFormat,
                        "is a Git LFS pointer and not the file itself; fetch it with 'git lfs pull'");
  }
  if (bytes.starts_with(std::string_view("PK\3\4", 4)) || bytes.starts_with(std::string_view("PK\5\6", 4))) {
    return detail::read_3mf(source);
  }
  if (bytes.starts_with("glTF")) return detail::read_gltf(source);
  if (bytes.starts_with("DRACO")) return detail::read_draco(source);
  if (bytes.size() > 3 && bytes.starts_with("ply") && (bytes[3] == '\n' || bytes[3] == '\r' || bytes[3] == ' ')) {
    return detail::read_ply(source);
  }
  if (extension == ".gltf" || (extension != ".obj" && without_leading_blanks(bytes).starts_with('{') &&
                               bytes.substr(0, 65536).find("\"asset\"") != std::string_view::npos)) {
    return detail::read_gltf(source);
  }
  if (is_binary_stl(bytes)) return detail::read_stl_binary(source);
  if (is_off(bytes)) return detail::read_off(source);
  if (extension != ".obj" && is_text_stl(bytes)) return detail::read_stl_text(source);
  if (extension == ".obj") return detail::read_obj(source);
  if (extension == ".stl") return detail::read_stl_binary(source);
  if (extension == ".off") return detail::read_off(source);
  for (const std::string_view other : {".ply", ".glb", ".3mf", ".drc"}) {
    if (extension == other) return source.corrupt("does not start as a " + std::string(other.substr(1)) + " file does");
  }
  if (looks_like_obj(bytes)) return detail::read_obj(source);
  return source.error(Errc::UnsupportedFormat, "is in no known mesh format; " + std::string(kKnown));
}

}  // namespace

Result<TriangleMesh> import_mesh(const std::filesystem::path& file, const Progress& progress) {
  std::string name = "the mesh file";
  try {
    name = printable(file.string());
    progress(detail::kImport, 0);
    RELIEF_TRY(detail::FileBytes bytes, detail::read_file(file, progress));
    std::string unpacked;
    const auto read = [&](std::string_view content) -> Result<TriangleMesh> {
      RELIEF_TRY(TriangleMesh mesh, read_any({.path = file, .name = name, .bytes = content, .progress = progress}));
      progress(detail::kImport, 1);
      // What a cancelled image left out is no note.
      if (progress.cancelled()) return fail(Errc::Cancelled, name + ": " + std::string(detail::kReadingCancelled));
      return mesh;
    };
    if (!bytes.view().starts_with(kGzip)) return read(bytes.view());
    RELIEF_CHECK(unpack_gzip(name, bytes, unpacked, progress));
    return read(unpacked);
  } catch (const std::bad_alloc&) {
    return fail(Errc::Io, name + ": needs more memory than there is");
  } catch (const std::exception& problem) {
    return fail(Errc::Corrupt, name + ": cannot be read: " + printable(problem.what(), 120));
  }
}

}  // namespace relief
