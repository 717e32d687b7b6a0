// A file that appears whole and at once, or not at all.
#pragma once

#include <relief/base/error.h>

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace relief {

/// Returns the file that a name stands for: a link is followed, also where it leads to a file that is not there yet, so
/// that what is written under the name leaves the link.
[[nodiscard]] std::filesystem::path behind_links(std::filesystem::path file);

/// Bytes go to a new file in the target's folder, without a name where the file system can; commit() makes them durable
/// and renames it over the target. Without commit() the new file is removed and the target stays as it was. A target
/// that is a device or a pipe is written directly. Errors name the target: Io.
class AtomicFile {
 public:
  [[nodiscard]] static Result<AtomicFile> create(const std::filesystem::path& target);
  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&&) = delete;
  ~AtomicFile();

  /// Buffered; large blocks go straight through.
  [[nodiscard]] Status write(std::span<const std::byte> bytes);
  [[nodiscard]] Status write(std::string_view text) { return write(std::as_bytes(std::span(text))); }
  [[nodiscard]] Status commit();

 private:
  AtomicFile(std::filesystem::path target, std::filesystem::path temporary, int descriptor, bool direct);
  [[nodiscard]] Status flush();
  [[nodiscard]] Status give_name();
  std::filesystem::path target_;
  std::filesystem::path temporary_;  ///< empty while the new file has no name
  int descriptor_;
  bool direct_;
  std::string buffer_;
};

/// Makes a rename inside the folder durable. A folder that cannot be synchronised is no error.
void sync_folder_of(const std::filesystem::path& file) noexcept;

}  // namespace relief
