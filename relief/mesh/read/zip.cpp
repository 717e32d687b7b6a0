#include <relief/base/try.h>
#include <relief/mesh/read/inflate.h>
#include <relief/mesh/read/zip.h>

#include <zlib.h>

#include <cctype>
#include <limits>

namespace relief::detail {
namespace {

bool same_name(std::string_view a, std::string_view b) noexcept {
  while (a.starts_with('/')) a.remove_prefix(1);
  while (b.starts_with('/')) b.remove_prefix(1);
  return std::ranges::equal(a, b, [](char p, char q) {
    const auto fold = [](char c) { return c == '\\' ? '/' : std::tolower(static_cast<unsigned char>(c)); };
    return fold(p) == fold(q);
  });
}

struct Directory {
  std::uint64_t count = 0, offset = 0;
};

/// Returns where the end record, or its 64-bit twin, says that the list of members is.
Result<Directory> find_directory(const Source& source) {
  const std::string_view bytes = source.bytes;
  constexpr std::size_t kEnd = 22;
  if (bytes.size() < kEnd) return source.corrupt("the zip archive is cut off");
  const std::size_t first = bytes.size() > kEnd + 65535 ? bytes.size() - kEnd - 65535 : 0;
  const std::size_t at = bytes.rfind(std::string_view("PK\5\6", 4), bytes.size() - kEnd);
  if (at == std::string_view::npos || at < first)
    return source.corrupt("the zip archive has no list of members; it is cut off");
  Directory directory{load_le<std::uint16_t>(bytes.data() + at + 10), load_le<std::uint32_t>(bytes.data() + at + 16)};
  if ((directory.count == 0xffff || directory.offset == 0xffffffffU) && at >= 20 &&
      bytes.substr(at - 20, 4) == std::string_view("PK\6\7", 4)) {
    const auto twin = load_le<std::uint64_t>(bytes.data() + at - 12);
    if (bytes.size() < 56 || twin > bytes.size() - 56 || bytes.substr(twin, 4) != std::string_view("PK\6\6", 4)) {
      return source.corrupt("the zip archive's list of members is damaged");
    }
    directory = {load_le<std::uint64_t>(bytes.data() + twin + 32), load_le<std::uint64_t>(bytes.data() + twin + 48)};
  }
  return directory;
}

/// Takes 64-bit sizes from the extra field where the 32-bit ones are full.
void apply_extra(std::string_view extra, ZipMember& member) noexcept {
  while (extra.size() >= 4) {
    const auto id = load_le<std::uint16_t>(extra.data());
    const std::size_t length = load_le<std::uint16_t>(extra.data() + 2);
    extra.remove_prefix(4);
    if (length > extra.size()) return;
    if (id == 1) {
      std::string_view values = extra.substr(0, length);
      for (std::uint64_t* value : {&member.size, &member.packed_size, &member.offset}) {
        if (*value != 0xffffffffU || values.size() < 8) continue;
        *value = load_le<std::uint64_t>(values.data());
        values.remove_prefix(8);
      }
    }
    extra.remove_prefix(length);
  }
}

}  // namespace

Result<ZipArchive> ZipArchive::open(const Source& source) {
  RELIEF_TRY(const Directory directory, find_directory(source));
  const auto damaged = [&] { return source.corrupt("the zip archive's list of members is damaged"); };
  if (directory.offset > source.bytes.size()) return damaged();
  std::string_view rest = source.bytes.substr(directory.offset);
  constexpr std::size_t kEntry = 46;
  if (directory.count > rest.size() / kEntry) return damaged();
  ZipArchive archive;
  for (std::uint64_t k = 0; k < directory.count; ++k) {
    if (rest.size() < kEntry || !rest.starts_with(std::string_view("PK\1\2", 4))) return damaged();
    ZipMember member;
    member.flags = load_le<std::uint16_t>(rest.data() + 8);
    member.method = load_le<std::uint16_t>(rest.data() + 10);
    member.crc = load_le<std::uint32_t>(rest.data() + 16);
    member.packed_size = load_le<std::uint32_t>(rest.data() + 20);
    member.size = load_le<std::uint32_t>(rest.data() + 24);
    const std::size_t name = load_le<std::uint16_t>(rest.data() + 28);
    const std::size_t extra = load_le<std::uint16_t>(rest.data() + 30);
    const std::size_t comment = load_le<std::uint16_t>(rest.data() + 32);
    member.offset = load_le<std::uint32_t>(rest.data() + 42);
    if (name + extra + comment > rest.size() - kEntry) return damaged();
    member.name = rest.substr(kEntry, name);
    apply_extra(rest.substr(kEntry + name, extra), member);
    rest.remove_prefix(kEntry + name + extra + comment);
    archive.members_.push_back(std::move(member));
  }
  return archive;
}

const ZipMember* ZipArchive::find(std::string_view name) const noexcept {
  for (const ZipMember& member : members_)
    if (same_name(member.name, name)) return &member;
  return nullptr;
}

Result<std::string> ZipArchive::unpack(const Source& source, const ZipMember& member, Steps& steps) {
  const std::string_view bytes = source.bytes;
  const auto damaged = [&] { return source.corrupt("its part '" + printable(member.name, 80) + "' is damaged"); };
  if ((member.flags & 1U) != 0) return source.error(Errc::UnsupportedFormat, "is encrypted");
  if (member.method != 0 && member.method != 8) {
    return source.error(Errc::UnsupportedFormat, "is packed with zip method " + std::to_string(member.method));
  }
  constexpr std::size_t kLocal = 30;
  if (bytes.size() < kLocal || member.offset > bytes.size() - kLocal) return damaged();
  const char* local = bytes.data() + member.offset;
  if (std::string_view(local, 4) != std::string_view("PK\3\4", 4)) return damaged();
  const std::uint64_t start =
      member.offset + kLocal + load_le<std::uint16_t>(local + 26) + load_le<std::uint16_t>(local + 28);
  if (start > bytes.size() || member.packed_size > bytes.size() - start) return damaged();
  const std::string_view packed = bytes.substr(start, member.packed_size);
  const std::uint64_t limit = most_unpacked(bytes.size());
  const auto bomb = [&] {
    return source.error(Errc::UnsupportedFormat,
                        "its part '" + printable(member.name, 80) + "' unpacks to more than a hundred times the file");
  };

  std::string out;
  if (member.method == 0) {
    if (unpacked_ + packed.size() > limit) return bomb();
    out = packed;
  } else {
    switch (inflate_all(packed, Wrapper::None, limit - std::min(limit, unpacked_), out, steps)) {
      case Inflated::TooLarge:
        return bomb();
      case Inflated::Damaged:
        return damaged();
      case Inflated::Cancelled:
        return source.cancelled();
      case Inflated::Whole:
        break;
    }
  }
  uLong crc = crc32(0, nullptr, 0);
  for (std::size_t k = 0; k < out.size();) {
    const std::size_t step = std::min<std::size_t>(out.size() - k, 1U << 30U);
    crc = crc32(crc, reinterpret_cast<const Bytef*>(out.data() + k), static_cast<uInt>(step));
    k += step;
  }
  if (crc != member.crc) return damaged();
  unpacked_ += out.size();
  return out;
}

}  // namespace relief::detail
