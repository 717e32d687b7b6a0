#include <relief/base/atomic_file.h>
#include <relief/base/try.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace relief {

namespace {
constexpr std::size_t kBuffer = 1U << 16U;

std::unexpected<Error> io_error(const std::filesystem::path& target, const char* what, int error) {
  return fail(Errc::Io, printable(target.string()) + ": " + what + ": " + std::strerror(error));
}
}  // namespace

Result<AtomicFile> AtomicFile::create(const std::filesystem::path& target) {
  std::error_code ignored;
  if (std::filesystem::is_directory(target, ignored)) return io_error(target, "cannot be written", EISDIR);
  // A link is followed, so that the file it names is replaced and the link stays.
  std::filesystem::path real = target;
  if (std::filesystem::is_symlink(target, ignored)) {
    const auto resolved = std::filesystem::weakly_canonical(target, ignored);
    if (!ignored) real = resolved;
  }
  if (std::filesystem::exists(real, ignored) && !std::filesystem::is_regular_file(real, ignored)) {
    // A device or a pipe is written as it is; replacing it would destroy it.
    const int direct = ::open(real.c_str(), O_WRONLY | O_CLOEXEC);
    if (direct < 0) return io_error(target, "cannot be written", errno);
    return AtomicFile(real, {}, direct);
  }
  std::string pattern = real.string() + ".XXXXXX.part";
  const int descriptor = ::mkostemps(pattern.data(), 5, O_CLOEXEC);
  if (descriptor < 0) return io_error(target, "cannot be written", errno);
  // mkstemp makes a private file; give it the rights that the target has, or that a new file would get.
  struct stat existing{};
  const mode_t mask = ::umask(0);
  ::umask(mask);
  const mode_t mode = ::stat(real.c_str(), &existing) == 0 ? existing.st_mode & 07777U : 0666U & ~mask;
  static_cast<void>(::fchmod(descriptor, mode));
  return AtomicFile(real, pattern, descriptor);
}

AtomicFile::AtomicFile(std::filesystem::path target, std::filesystem::path temporary, int descriptor)
    : target_(std::move(target)), temporary_(std::move(temporary)), descriptor_(descriptor) {}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : target_(std::move(other.target_)),
      temporary_(std::move(other.temporary_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
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
    if (written < 0) return io_error(target_, "cannot be written", errno);
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

Status AtomicFile::commit() {
  RELIEF_CHECK(flush());
  if (temporary_.empty()) return {};
  if (::fsync(descriptor_) != 0) return io_error(target_, "cannot be written", errno);
  if (::close(std::exchange(descriptor_, -1)) != 0) {
    const int error = errno;
    ::unlink(temporary_.c_str());
    return io_error(target_, "cannot be written", error);
  }
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) {
    const int error = errno;
    ::unlink(temporary_.c_str());
    return io_error(target_, "cannot be replaced", error);
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
