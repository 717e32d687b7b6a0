#include <relief/base/paged_memory.h>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
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

/// A new file without a name, or -1.
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

/// Lengthens the file by bytes that the disk has: where one ran out later, to write to a page would end the program.
bool grow(int file, std::size_t from, std::size_t size) {
  rlimit most{};
  if (::getrlimit(RLIMIT_FSIZE, &most) == 0 && most.rlim_cur < from + size) return false;
  for (;;) {
    const int error = ::posix_fallocate(file, static_cast<off_t>(from), static_cast<off_t>(size));
    if (error != EINTR) return error == 0;
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
  const bool in_file = left_ < size && lengthen_file(size);
  left_ -= std::min(left_, size);
  const int flags = in_file ? MAP_SHARED : MAP_PRIVATE | MAP_ANONYMOUS;
  const std::size_t from = file_bytes();
  void* const at = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, flags, in_file ? file_ : -1,
                          static_cast<off_t>(in_file ? from : 0));
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
