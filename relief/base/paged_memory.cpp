#include <relief/base/paged_memory.h>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <string>

namespace relief {

namespace {
constexpr std::size_t kMiB = std::size_t{1} << 20;
constexpr std::size_t kChunk = 4 * kMiB;
constexpr std::size_t kResident = 8 * kMiB;
/// A page that is read brings in those around it.
constexpr std::size_t kAround = std::size_t{1} << 16;

/// Returns a new file without a name, or -1.
int temporary_file() {
  const char* chosen = std::getenv("TMPDIR");
  for (const char* folder : {chosen, "/var/tmp", "/tmp"}) {
    if (folder == nullptr || *folder == '\0') continue;
    int file = ::open(folder, O_TMPFILE | O_RDWR | O_EXCL | O_CLOEXEC, 0600);
    if (file < 0) {
      std::string name = std::string(folder) + "/relief.XXXXXX";
      file = ::mkostemp(name.data(), O_CLOEXEC);
      if (file >= 0) ::unlink(name.c_str());
    }
    if (file >= 0) return file;
  }
  return -1;
}

/// Lengthens the file by bytes that the disk has: where one ran out later, to write to a page would end the program. As
/// much again is left to others, what is made of all this among them.
bool grow(int file, std::size_t from, std::size_t size) {
  constexpr std::size_t kLeast = 64 * kMiB;
  rlimit most{};
  if (::getrlimit(RLIMIT_FSIZE, &most) == 0 && most.rlim_cur < from + size) return false;
  struct statvfs disk{};
  if (::fstatvfs(file, &disk) != 0 || disk.f_bavail < (size + std::max(from + size, kLeast)) / disk.f_frsize)
    return false;
  for (;;) {
    const int error = ::posix_fallocate(file, static_cast<off_t>(from), static_cast<off_t>(size));
    if (error == 0) return true;
    if (error == EINTR) continue;
    // What it has got of them goes back; where that fails, with the file.
    [[maybe_unused]] const int ignored = ::ftruncate(file, static_cast<off_t>(from));
    return false;
  }
}
}  // namespace

PagedMemory::~PagedMemory() {
  for (const Chunk& chunk : chunks_) ::munmap(chunk.begin, chunk.size);
  if (file_ >= 0) ::close(file_);
}

void PagedMemory::rest(std::size_t bytes, std::size_t pieces) noexcept { touched(pieces * (bytes + kAround)); }

void PagedMemory::rest_at(const void* piece, std::size_t bytes) noexcept {
  if (file_bytes() == 0) return;
  const std::size_t around = reinterpret_cast<std::uintptr_t>(piece) / kAround;
  const bool again = last_around_.exchange(around, std::memory_order_relaxed) == around;
  touched(bytes + (again ? 0 : kAround));
}

void PagedMemory::touched(std::size_t bytes) noexcept {
  if (file_bytes() == 0) return;
  if (touched_.fetch_add(bytes, std::memory_order_relaxed) + bytes < kResident) return;
  rest_all();
}

void PagedMemory::rest_all() noexcept {
  touched_.store(0, std::memory_order_relaxed);
  const std::scoped_lock lock(mutex_);
  for (const Chunk& chunk : chunks_)
    if (chunk.in_file) ::madvise(chunk.begin, chunk.size, MADV_DONTNEED);
}

void* PagedMemory::do_allocate(std::size_t bytes, std::size_t alignment) {
  const std::scoped_lock lock(mutex_);
  const auto begin = [&] { return (used_ + alignment - 1) / alignment * alignment; };
  if (chunks_.empty() || begin() + bytes > chunks_.back().size) add_chunk(bytes);
  void* const p = chunks_.back().begin + begin();
  used_ = begin() + bytes;
  return p;
}

void PagedMemory::add_chunk(std::size_t least) {
  chunks_.reserve(chunks_.size() + 1);
  const std::size_t size = (std::max(kChunk, least) + kMiB - 1) / kMiB * kMiB;
  bool in_file = left_ < size && lengthen_file(size);
  left_ -= std::min(left_, size);
  const std::size_t from = file_bytes();
  const auto map = [&](int flags, int file, std::size_t at) {
    return ::mmap(nullptr, size, PROT_READ | PROT_WRITE, flags, file, static_cast<off_t>(at));
  };
  void* at = in_file ? map(MAP_SHARED, file_, from) : MAP_FAILED;
  if (in_file && at == MAP_FAILED) {  // some file systems share no pages
    file_failed_ = true;
    in_file = false;
  }
  if (!in_file) at = map(MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (at == MAP_FAILED) throw std::bad_alloc();
  chunks_.push_back({static_cast<std::byte*>(at), size, in_file});
  used_ = 0;
  if (in_file) file_bytes_.store(from + size, std::memory_order_relaxed);
}

bool PagedMemory::lengthen_file(std::size_t size) {
  if (file_failed_) return false;
  if (file_ < 0) file_ = temporary_file();
  file_failed_ = file_ < 0 || !grow(file_, file_bytes(), size);
  return !file_failed_;
}

}  // namespace relief
