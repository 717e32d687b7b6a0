#include <relief/file/cut_database.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <utility>

namespace relief::detail {

namespace {

using Bytes = std::span<const std::byte>;

constexpr std::size_t kHeader = 100;  // bytes before the first page's own
constexpr std::string_view kMagic{"SQLite format 3\0", 16};
constexpr std::byte kTableLeaf{0x0d};
constexpr std::size_t kLeafHeader = 8;    // bytes of a leaf before the places of its cells
constexpr std::size_t kMostColumns = 64;  // as Database allows

std::uint64_t big_endian(Bytes bytes) noexcept {
  std::uint64_t value = 0;
  for (const std::byte b : bytes) value = value << 8U | std::to_integer<std::uint64_t>(b);
  return value;
}

/// Takes a number of one to nine bytes off the front; false where they are not there.
bool take_varint(Bytes& from, std::uint64_t& value) noexcept {
  value = 0;
  for (std::size_t k = 0; k < 9 && k < from.size(); ++k) {
    const auto byte = std::to_integer<std::uint64_t>(from[k]);
    value = k == 8 ? value << 8U | byte : value << 7U | (byte & 0x7fU);
    if (k < 8 && byte >= 0x80U) continue;
    from = from.subspan(k + 1);
    return true;
  }
  return false;
}

bool read_fully(int descriptor, std::uint64_t at, std::span<std::byte> to) noexcept {
  for (std::size_t done = 0; done < to.size();) {
    const ssize_t now = ::pread(descriptor, to.data() + done, to.size() - done, static_cast<off_t>(at + done));
    if (now < 0 && errno == EINTR) continue;
    if (now <= 0) return false;
    done += static_cast<std::size_t>(now);
  }
  return true;
}

}  // namespace

CutDatabase::CutDatabase(int descriptor, std::uint64_t bytes, std::uint64_t whole_bytes, std::size_t page_size,
                         std::size_t usable)
    : descriptor_(descriptor),
      bytes_(bytes),
      whole_bytes_(whole_bytes),
      page_size_(page_size),
      usable_(usable),
      page_(page_size),
      overflow_(page_size) {}

CutDatabase::CutDatabase(CutDatabase&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      bytes_(other.bytes_),
      whole_bytes_(other.whole_bytes_),
      page_size_(other.page_size_),
      usable_(other.usable_),
      loaded_(std::exchange(other.loaded_, 0U)),
      page_(std::move(other.page_)),
      overflow_(std::move(other.overflow_)),
      payload_(std::move(other.payload_)) {}

CutDatabase::~CutDatabase() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<std::optional<CutDatabase>> CutDatabase::open(const std::filesystem::path& file, const FileKind& kind) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return fail(Errc::Io, printable(file.string()) + ": cannot be read: " + std::strerror(errno));
  const auto none = [descriptor] {
    ::close(descriptor);
    return std::optional<CutDatabase>();
  };
  struct stat status{};
  std::array<std::byte, kHeader> header{};
  if (::fstat(descriptor, &status) != 0 || !read_fully(descriptor, 0, header)) return none();
  const auto number = [&](std::size_t at, std::size_t size) { return big_endian(Bytes(header).subspan(at, size)); };
  const std::uint64_t stated = number(16, 2), page_size = stated == 1 ? 65536 : stated, reserved = number(20, 1);
  const auto bytes = static_cast<std::uint64_t>(status.st_size), whole = number(28, 4) * page_size;
  const bool ours = std::memcmp(header.data(), kMagic.data(), kMagic.size()) == 0 && std::has_single_bit(page_size) &&
                    page_size >= 512 && page_size - reserved >= 480 &&
                    number(68, 4) == static_cast<std::uint64_t>(kind.application_id);
  if (!ours || bytes >= whole) return none();
  return CutDatabase(descriptor, bytes, whole, page_size, page_size - reserved);
}

bool CutDatabase::load(std::uint32_t page) {
  if (loaded_ == page) return true;
  loaded_ = 0;
  const std::uint64_t at = std::uint64_t{page - 1} * page_size_;
  if (page == 0 || at + page_size_ > bytes_ || !read_fully(descriptor_, at, page_)) return false;
  loaded_ = page;
  return true;
}

std::uint32_t CutDatabase::cells() const noexcept {
  const std::size_t head = loaded_ == 1 ? kHeader : 0;
  if (page_[head] != kTableLeaf) return 0;
  const auto count = static_cast<std::size_t>(big_endian(Bytes(page_).subspan(head + 3, 2)));
  return static_cast<std::uint32_t>(std::min(count, (usable_ - head - kLeafHeader) / 2));
}

bool CutDatabase::gather(std::uint32_t cell, std::int64_t& number) {
  const std::size_t head = loaded_ == 1 ? kHeader : 0;
  const std::uint64_t at = big_endian(Bytes(page_).subspan(head + kLeafHeader + 2 * std::size_t{cell}, 2));
  if (at >= usable_) return false;
  Bytes rest = Bytes(page_).first(usable_).subspan(at);
  std::uint64_t size = 0, key = 0;
  if (!take_varint(rest, size) || !take_varint(rest, key) || size > bytes_) return false;
  number = std::bit_cast<std::int64_t>(key);
  // How much of the payload lies in the cell, and how much in a chain of pages.
  const std::uint64_t most = usable_ - 35, least = (usable_ - 12) * 32 / 255 - 23;
  const std::uint64_t even = least + (size > least ? (size - least) % (usable_ - 4) : 0);
  const std::uint64_t local = size <= most ? size : even <= most ? even : least;
  if (local + (size > local ? 4 : 0) > rest.size()) return false;
  payload_.assign(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(local));
  std::uint64_t next = size > local ? big_endian(rest.subspan(local, 4)) : 0;
  while (payload_.size() < size) {
    const std::uint64_t place = (next - 1) * page_size_;
    if (next == 0 || next > bytes_ / page_size_ || !read_fully(descriptor_, place, overflow_)) return false;
    next = big_endian(Bytes(overflow_).first(4));
    const Bytes more = Bytes(overflow_).subspan(4, std::min<std::size_t>(usable_ - 4, size - payload_.size()));
    payload_.insert(payload_.end(), more.begin(), more.end());
  }
  return true;
}

bool CutDatabase::parse(std::vector<Value>& values) const {
  values.clear();
  Bytes types = payload_;
  std::uint64_t head = 0;
  if (!take_varint(types, head) || head > payload_.size() || head < payload_.size() - types.size()) return false;
  types = types.first(head - (payload_.size() - types.size()));
  Bytes rest = Bytes(payload_).subspan(head);
  while (!types.empty()) {
    std::uint64_t type = 0;
    if (!take_varint(types, type) || values.size() == kMostColumns) return false;
    constexpr std::array<std::size_t, 12> kSizes = {0, 1, 2, 3, 4, 6, 8, 8, 0, 0, 0, 0};
    const std::uint64_t size = type < kSizes.size() ? kSizes[type] : (type - 12) / 2;
    if (size > rest.size()) return false;
    const Bytes bytes = rest.first(size);
    rest = rest.subspan(size);
    Value& value = values.emplace_back();
    if (type >= 12) {
      value.type = type % 2 == 0 ? Statement::Type::Blob : Statement::Type::Text;
      value.bytes = bytes;
    } else if (type == 7) {
      value.type = Statement::Type::Real;
    } else if (type == 8 || type == 9) {
      value.type = Statement::Type::Integer;
      value.integer = type == 9 ? 1 : 0;
    } else if (type >= 1 && type <= 6) {
      value.type = Statement::Type::Integer;
      const auto shift = static_cast<unsigned>(64 - 8 * size);  // the sign is in the first bit
      value.integer = std::bit_cast<std::int64_t>(big_endian(bytes) << shift) >> shift;
    }
  }
  return true;
}

bool CutDatabase::read(Place place, Row& row) {
  row.place = place;
  return load(place.page) && place.cell < cells() && gather(place.cell, row.number) && parse(row.values);
}

bool CutDatabase::next(Place& from, Row& row) {
  for (; load(from.page); from = {from.page + 1, 0}) {
    const std::uint32_t count = cells();
    while (from.cell < count) {
      const Place here = from;
      ++from.cell;
      if (read(here, row)) return true;
    }
  }
  return false;
}

}  // namespace relief::detail
