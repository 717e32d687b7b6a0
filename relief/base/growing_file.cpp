#include <relief/base/growing_file.h>

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <utility>

namespace relief {

namespace {
constexpr std::size_t kBuffer = 1U << 16U;
}  // namespace

Result<GrowingFile> GrowingFile::create(const std::filesystem::path& target) {
  const int descriptor = ::open(target.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) return io_error(target.native(), "cannot be written", errno);
  return GrowingFile(target, descriptor);
}

GrowingFile::GrowingFile(std::filesystem::path target, int descriptor)
    : target_(std::move(target)), descriptor_(descriptor) {}

GrowingFile::GrowingFile(GrowingFile&& other) noexcept
    : target_(std::move(other.target_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      buffer_(std::move(other.buffer_)),
      lines_(other.lines_),
      bytes_(other.bytes_),
      status_(std::move(other.status_)) {}

GrowingFile::~GrowingFile() {
  if (descriptor_ < 0) return;
  static_cast<void>(flush());
  ::close(descriptor_);
}

Status GrowingFile::failed(int error) {
  // What came of a line that did not fit goes again; a pipe or a device keeps it.
  static_cast<void>(::ftruncate(descriptor_, bytes_));
  buffer_.clear();
  return status_ = io_error(target_.native(), "cannot be written", error);
}

Status GrowingFile::write(std::string_view lines) {
  if (!status_) return status_;
  buffer_ += lines;
  return buffer_.size() < kBuffer ? Status{} : flush();
}

Status GrowingFile::flush() {
  std::size_t done = 0;
  int error = 0;
  while (status_ && error == 0 && done < buffer_.size()) {
    const ssize_t written = ::write(descriptor_, buffer_.data() + done, buffer_.size() - done);
    if (written > 0)
      done += static_cast<std::size_t>(written);
    else if (written == 0 || errno != EINTR)
      error = written < 0 ? errno : ENOSPC;
  }
  const std::string_view now = std::string_view(buffer_).substr(0, done);
  const std::string_view whole = now.substr(0, now.rfind('\n') + 1);  // none where there is no line
  lines_ += static_cast<std::uint64_t>(std::ranges::count(whole, '\n'));
  bytes_ += static_cast<std::int64_t>(whole.size());
  if (error != 0) return failed(error);
  buffer_.clear();
  return status_;
}

}  // namespace relief
