#include <relief/mesh/out_file.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

namespace relief::detail {

std::unexpected<Error> OutFile::io_error(int code) const {
  return fail(code == ENOENT ? Errc::NotFound : Errc::Io,
              printable(target_.string()) + ": cannot be written: " + std::generic_category().message(code));
}

Result<OutFile> OutFile::create(const std::filesystem::path& target) {
  OutFile file;
  file.target_ = target;
  struct stat status {};
  if (::stat(target.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) return fail(Errc::Io, printable(target.string()) + ": is a folder");
    if (!S_ISREG(status.st_mode)) return fail(Errc::Io, printable(target.string()) + ": is not a regular file");
    // Through a link the file behind it is replaced, not the link.
    std::error_code code;
    const std::filesystem::path real = std::filesystem::canonical(target, code);
    if (!code) file.target_ = real;
  }
  static std::atomic<unsigned> counter{0};
  for (int attempt = 0; attempt < 100; ++attempt) {
    file.scratch_ = file.target_.parent_path() /
                    (".relief-" + std::to_string(::getpid()) + "-" + std::to_string(counter.fetch_add(1)) + ".part");
    file.descriptor_ = ::open(file.scratch_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file.descriptor_ >= 0 || errno != EEXIST) break;
  }
  if (file.descriptor_ < 0) return file.io_error(errno);
  file.buffer_ = std::make_unique_for_overwrite<char[]>(kBuffer);
  return file;
}

OutFile::OutFile(OutFile&& other) noexcept
    : target_(std::move(other.target_)),
      scratch_(std::move(other.scratch_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      error_(other.error_),
      flushed_(other.flushed_),
      used_(other.used_),
      buffer_(std::move(other.buffer_)) {}

OutFile::~OutFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  ::unlink(scratch_.c_str());
}

void OutFile::flush() {
  std::size_t done = 0;
  while (done < used_ && error_ == 0) {
    const ssize_t put = ::write(descriptor_, buffer_.get() + done, used_ - done);
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) {
      error_ = errno;
    } else {
      done += static_cast<std::size_t>(put);
    }
  }
  flushed_ += used_;
  used_ = 0;
}

void OutFile::write(std::string_view bytes) {
  while (!bytes.empty()) {
    if (used_ == kBuffer) flush();
    const std::size_t step = std::min(bytes.size(), kBuffer - used_);
    std::memcpy(buffer_.get() + used_, bytes.data(), step);
    used_ += step;
    bytes.remove_prefix(step);
  }
}

void OutFile::patch(std::uint64_t position, std::string_view bytes) {
  flush();
  while (!bytes.empty() && error_ == 0) {
    const ssize_t put = ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(position));
    if (put < 0 && errno == EINTR) continue;
    if (put < 0) {
      error_ = errno;
    } else {
      bytes.remove_prefix(static_cast<std::size_t>(put));
      position += static_cast<std::uint64_t>(put);
    }
  }
}

Status OutFile::commit() {
  flush();
  if (error_ == 0 && ::fsync(descriptor_) != 0) error_ = errno;
  if (error_ != 0) return io_error(error_);
  const int closed = ::close(std::exchange(descriptor_, -1));
  if (closed != 0 || std::rename(scratch_.c_str(), target_.c_str()) != 0) {
    const int code = errno;
    ::unlink(scratch_.c_str());
    return io_error(code);
  }
  // The new name should outlive a power cut too; a folder that cannot be opened for this is no failure of the file.
  const std::filesystem::path folder = target_.has_parent_path() ? target_.parent_path() : std::filesystem::path(".");
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor >= 0) {
    ::fsync(descriptor);
    ::close(descriptor);
  }
  return {};
}

}  // namespace relief::detail
