// A text file that is there from the start and grows line by line.
#pragma once

#include <relief/base/error.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace relief {

/// Lines go to the target itself, which is emptied first; what was flushed is there whatever ends the program. Where
/// the disk is full the file ends with the last whole line that fits. Errors name the target: Io.
class GrowingFile {
 public:
  [[nodiscard]] static Result<GrowingFile> create(const std::filesystem::path& target);
  GrowingFile(GrowingFile&& other) noexcept;
  GrowingFile& operator=(GrowingFile&&) = delete;
  ~GrowingFile();

  /// Whole lines. Buffered; now and then it flushes. Nothing more is written after an error, which is given again.
  [[nodiscard]] Status write(std::string_view lines);
  [[nodiscard]] Status flush();
  /// Lines that are in the file.
  [[nodiscard]] std::uint64_t lines() const noexcept { return lines_; }

 private:
  GrowingFile(std::filesystem::path target, int descriptor);
  [[nodiscard]] Status failed(int error);
  std::filesystem::path target_;
  int descriptor_;
  std::string buffer_;
  std::uint64_t lines_ = 0;
  std::int64_t bytes_ = 0;  ///< up to the end of the last whole line
  Status status_;
};

}  // namespace relief
