#include <relief/base/atomic_file.h>
#include <relief/base/try.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <utility>

namespace relief {

namespace {
constexpr std::size_t kBuffer = 1U << 16U;
}  // namespace

std::filesystem::path behind_links(std::filesystem::path file) {
  constexpr int kMost = 40;  // as Linux does
  std::error_code error;
  for (int k = 0; k < kMost && std::filesystem::is_symlink(file, error); ++k) {
    const std::filesystem::path next = std::filesystem::read_symlink(file, error);
    if (error) break;
    file = file.parent_path() / next;
  }
  return file;
}

Result<AtomicFile> AtomicFile::create(const std::filesystem::path& target) {
  std::error_code ignored;
  if (std::filesystem::is_directory(target, ignored)) return io_error(target.native(), "cannot be written", EISDIR);
  const std::filesystem::path real = behind_links(target);
  if (std::filesystem::exists(real, ignored) && !std::filesystem::is_regular_file(real, ignored)) {
    // A device or a pipe is written as it is; replacing it would destroy it.
    const int direct = ::open(real.c_str(), O_WRONLY | O_CLOEXEC);
    if (direct < 0) return io_error(target.native(), "cannot be written", errno);
    return AtomicFile(real, {}, direct, true);
  }
  // The rights that the target has, or that a new file would get.
  struct stat existing{};
  const mode_t mask = ::umask(0);
  ::umask(mask);
  const mode_t mode = ::stat(real.c_str(), &existing) == 0 ? existing.st_mode & 07777U : 0666U & ~mask;
  // A file without a name, where the file system has them: what a killed program leaves of it is nothing.
  const std::filesystem::path folder = real.has_parent_path() ? real.parent_path() : std::filesystem::path(".");
  std::string temporary;
  int descriptor = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (descriptor < 0) {
    temporary = real.string() + ".XXXXXX.part";
    descriptor = ::mkostemps(temporary.data(), 5, O_CLOEXEC);
  }
  if (descriptor < 0) return io_error(target.native(), "cannot be written", errno);
  static_cast<void>(::fchmod(descriptor, mode));
  return AtomicFile(real, temporary, descriptor, false);
}

AtomicFile::AtomicFile(std::filesystem::path target, std::filesystem::path temporary, int descriptor, bool direct)
    : target_(std::move(target)), temporary_(std::move(temporary)), descriptor_(descriptor), direct_(direct) {}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : target_(std::move(other.target_)),
      temporary_(std::move(other.temporary_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      direct_(other.direct_),
      buffer_(std::move(other.buffer_)) {}

AtomicFile::~AtomicFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

Status AtomicFile::flush() {
  std::string_view rest = buffer_;
  while (!rest.empty()) {
    const ssize_t written = ::write(descriptor_, rest.data(), rest.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return io_error(target_.native(), "cannot be written", errno);
    rest.remove_prefix(static_cast<std::size_t>(written));
  }
  buffer_.clear();
  return {};
}

Status AtomicFile::write(std::span<const std::byte> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  // Cut into pieces, so that the buffer never grows with what is written.
  for (std::size_t at = 0; at < text.size(); at += kBuffer) {
    buffer_ += text.substr(at, kBuffer);
    if (buffer_.size() >= kBuffer) RELIEF_CHECK(flush());
  }
  return {};
}

Status AtomicFile::give_name() {
  // A name is taken by trying: another program may be writing the same target.
  std::string here = "/proc/self/fd/";
  here += std::to_string(descriptor_);
  for (unsigned attempt = 0; attempt < 1000; ++attempt) {
    temporary_ = target_;
    for (const std::string& piece : {std::string("."), std::to_string(::getpid()), std::string("-"),
                                     std::to_string(attempt), std::string(".part")})
      temporary_ += piece;
    if (::linkat(AT_FDCWD, here.c_str(), AT_FDCWD, temporary_.c_str(), AT_SYMLINK_FOLLOW) == 0) return {};
    if (errno != EEXIST) break;
  }
  const int error = errno;
  temporary_.clear();
  return io_error(target_.native(), "cannot be written", error);
}

Status AtomicFile::commit() {
  RELIEF_CHECK(flush());
  if (direct_) return {};
  if (::fsync(descriptor_) != 0) return io_error(target_.native(), "cannot be written", errno);
  if (temporary_.empty()) RELIEF_CHECK(give_name());
  // From here on the destructor has only the name to remove.
  const int closed = ::close(std::exchange(descriptor_, -1));
  if (closed != 0 || ::rename(temporary_.c_str(), target_.c_str()) != 0) {
    const int error = errno;
    ::unlink(temporary_.c_str());
    return io_error(target_.native(), closed != 0 ? "cannot be written" : "cannot be replaced", error);
  }
  sync_folder_of(target_);
  return {};
}

void sync_folder_of(const std::filesystem::path& file) noexcept {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  static_cast<void>(::fsync(descriptor));
  ::close(descriptor);
}

}  // namespace relief
