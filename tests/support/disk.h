// A disk that fails when it is told to, and that forgets what was not synced. Stands before the system's calls that
// write, in the whole test program, so exactly one source file of a program includes this.
#pragma once

#include <dlfcn.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relief::testing {

/// Watches one folder, as long as it lives. One at a time, and only while one thread works.
///
/// Power loss: a name is there once the folder was synced after it got it, and gone once the folder was synced after it
/// lost it; a file holds what it held when it was synced last. A real disk may keep more, none may keep less.
class Disk {
 public:
  explicit Disk(std::filesystem::path folder);
  Disk(const Disk&) = delete;
  Disk& operator=(const Disk&) = delete;
  ~Disk();

  enum class Failure : std::uint8_t { Once, FromThenOn };
  /// The call of this number from now, 1 being the next, fails with `error`.
  void fail_at(int call, int error, Failure failure = Failure::Once) {
    calls_ = 0;
    fail_at_ = call;
    error_ = error;
    failure_ = failure;
  }
  void work_again() { fail_at_ = 0; }
  /// Whether a call has failed since fail_at().
  [[nodiscard]] bool failed() const { return fail_at_ > 0 && calls_ >= fail_at_; }

  using Image = std::map<std::string, std::string>;  ///< contents by name
  /// What is left after a power loss now.
  [[nodiscard]] Image durable() const;
  /// What was left after each sync so far, were it the last.
  [[nodiscard]] const std::vector<Image>& moments() const { return moments_; }
  void forget_moments() { moments_.clear(); }

  // ---- For the calls

  /// The disk that watches, if it watches this; else null.
  [[nodiscard]] static Disk* of(int descriptor);
  [[nodiscard]] static Disk* of(const char* path);
  /// True: the call must fail; errno is set.
  [[nodiscard]] bool fails();
  void made(int descriptor);
  void synced(int descriptor);

 private:
  [[nodiscard]] std::map<std::string, ino_t> names() const;
  static std::string content(int descriptor);

  std::filesystem::path folder_;
  std::map<ino_t, std::string> contents_;  ///< when each was synced last
  std::map<std::string, ino_t> names_;     ///< when the folder was synced last
  std::vector<Image> moments_;
  int calls_ = 0, fail_at_ = 0, error_ = 0;
  Failure failure_ = Failure::Once;
};

namespace detail {
inline Disk* disk = nullptr;

template <typename Function>
Function* real(Function*& kept, const char* name) {
  if (kept == nullptr) kept = reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
  return kept;
}
}  // namespace detail

inline Disk::Disk(std::filesystem::path folder) : folder_(std::move(folder)) {
  // What lies there already is on the disk.
  for (const auto& [name, node] : names_ = names()) {
    std::ifstream in(folder_ / name, std::ios::binary);
    contents_[node] = {std::istreambuf_iterator<char>(in), {}};
  }
  EXPECT_EQ(detail::disk, nullptr);
  detail::disk = this;
}
inline Disk::~Disk() { detail::disk = nullptr; }

inline Disk::Image Disk::durable() const {
  Image image;
  for (const auto& [name, node] : names_) {
    const auto found = contents_.find(node);
    image[name] = found == contents_.end() ? "" : found->second;
  }
  return image;
}

inline Disk* Disk::of(const char* path) {
  return detail::disk != nullptr && std::string_view(path).starts_with(detail::disk->folder_.native()) ? detail::disk
                                                                                                       : nullptr;
}
inline Disk* Disk::of(int descriptor) {
  if (detail::disk == nullptr) return nullptr;
  std::array<char, 4096> path{};
  const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
  return ::readlink(link.c_str(), path.data(), path.size() - 1) > 0 ? of(path.data()) : nullptr;
}

inline bool Disk::fails() {
  ++calls_;
  const bool now = fail_at_ > 0 && (failure_ == Failure::Once ? calls_ == fail_at_ : calls_ >= fail_at_);
  if (now) errno = error_;
  return now;
}

inline void Disk::made(int descriptor) {
  struct stat status{};
  if (::fstat(descriptor, &status) == 0) contents_.erase(status.st_ino);  // a number may come a second time
}

inline void Disk::synced(int descriptor) {
  struct stat status{};
  if (::fstat(descriptor, &status) != 0) return;
  if (S_ISDIR(status.st_mode))
    names_ = names();
  else
    contents_[status.st_ino] = content(descriptor);
  moments_.push_back(durable());
}

inline std::map<std::string, ino_t> Disk::names() const {
  std::map<std::string, ino_t> found;
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
    struct stat status{};
    if (::stat(entry.path().c_str(), &status) == 0) found[entry.path().filename()] = status.st_ino;
  }
  return found;
}

inline std::string Disk::content(int descriptor) {
  std::string bytes;
  std::array<char, 65536> block{};
  for (;;) {
    const ssize_t read = ::pread(descriptor, block.data(), block.size(), static_cast<off_t>(bytes.size()));
    if (read <= 0) return bytes;
    bytes.append(block.data(), static_cast<std::size_t>(read));
  }
}

}  // namespace relief::testing

// ---- The calls

// NOLINTBEGIN(cppcoreguidelines-pro-type-vararg)
extern "C" {

[[gnu::visibility("default")]] inline int relief_open(const char* name, const char* path, int flags, mode_t mode) {
  using relief::testing::Disk;
  static int (*kept)(const char*, int, ...) = nullptr;
  Disk* disk = Disk::of(path);
  const bool is_new = (flags & O_CREAT) != 0 && ::access(path, F_OK) != 0;
  if (disk != nullptr && disk->fails()) return -1;
  const int descriptor = relief::testing::detail::real(kept, name)(path, flags, mode);
  if (disk != nullptr && is_new && descriptor >= 0) disk->made(descriptor);
  return descriptor;
}
[[gnu::visibility("default")]] int open(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(more, mode_t) : 0;
  va_end(more);
  return relief_open("open", path, flags, mode);
}
[[gnu::visibility("default")]] int open64(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(more, mode_t) : 0;
  va_end(more);
  return relief_open("open64", path, flags, mode);
}
[[gnu::visibility("default")]] ssize_t write(int descriptor, const void* bytes, size_t size) {
  static ssize_t (*kept)(int, const void*, size_t) = nullptr;
  if (auto* disk = relief::testing::Disk::of(descriptor); disk != nullptr && disk->fails()) return -1;
  return relief::testing::detail::real(kept, "write")(descriptor, bytes, size);
}
[[gnu::visibility("default")]] ssize_t pwrite64(int descriptor, const void* bytes, size_t size, off64_t at) {
  static ssize_t (*kept)(int, const void*, size_t, off64_t) = nullptr;
  if (auto* disk = relief::testing::Disk::of(descriptor); disk != nullptr && disk->fails()) return -1;
  return relief::testing::detail::real(kept, "pwrite64")(descriptor, bytes, size, at);
}
[[gnu::visibility("default")]] int ftruncate64(int descriptor, off64_t size) noexcept {
  static int (*kept)(int, off64_t) = nullptr;
  if (auto* disk = relief::testing::Disk::of(descriptor); disk != nullptr && disk->fails()) return -1;
  return relief::testing::detail::real(kept, "ftruncate64")(descriptor, size);
}
[[gnu::visibility("default")]] int fsync(int descriptor) {
  static int (*kept)(int) = nullptr;
  auto* disk = relief::testing::Disk::of(descriptor);
  if (disk != nullptr && disk->fails()) return -1;
  const int result = relief::testing::detail::real(kept, "fsync")(descriptor);
  if (disk != nullptr && result == 0) disk->synced(descriptor);
  return result;
}
[[gnu::visibility("default")]] int fdatasync(int descriptor) {
  static int (*kept)(int) = nullptr;
  auto* disk = relief::testing::Disk::of(descriptor);
  if (disk != nullptr && disk->fails()) return -1;
  const int result = relief::testing::detail::real(kept, "fdatasync")(descriptor);
  if (disk != nullptr && result == 0) disk->synced(descriptor);
  return result;
}
[[gnu::visibility("default")]] int unlink(const char* path) noexcept {
  static int (*kept)(const char*) = nullptr;
  if (auto* disk = relief::testing::Disk::of(path); disk != nullptr && disk->fails()) return -1;
  return relief::testing::detail::real(kept, "unlink")(path);
}
[[gnu::visibility("default")]] int rename(const char* from, const char* to) noexcept {
  static int (*kept)(const char*, const char*) = nullptr;
  if (auto* disk = relief::testing::Disk::of(to); disk != nullptr && disk->fails()) return -1;
  return relief::testing::detail::real(kept, "rename")(from, to);
}

}  // extern "C"
// NOLINTEND(cppcoreguidelines-pro-type-vararg)
