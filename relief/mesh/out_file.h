// A file that appears whole or not at all.
#pragma once

#include <relief/base/error.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace relief::detail {

/// Writes beside the target under a name of its own and renames in commit(); without commit nothing is left. Small writes are
/// gathered. The first failure is kept and returned by commit(), so writers need not look after each value.
class OutFile {
 public:
  [[nodiscard]] static Result<OutFile> create(const std::filesystem::path& target);
  OutFile(OutFile&& other) noexcept;
  OutFile(const OutFile&) = delete;
  OutFile& operator=(const OutFile&) = delete;
  OutFile& operator=(OutFile&&) = delete;
  ~OutFile();

  void write(std::string_view bytes);
  /// A number in the machine's byte order; on big-endian machines turned to little-endian.
  template <typename T>
    requires std::integral<T> || std::floating_point<T>
  void value(T number) {
    std::array<char, sizeof(T)> raw = std::bit_cast<std::array<char, sizeof(T)>>(number);
    if constexpr (std::endian::native == std::endian::big) std::reverse(raw.begin(), raw.end());
    write({raw.data(), raw.size()});
  }
  /// The shortest text that reads back as the same value.
  template <typename T>
  void text(T number) {
    if (kBuffer - used_ < 40) flush();
    const auto [stop, code] = std::to_chars(buffer_.get() + used_, buffer_.get() + kBuffer, number);
    used_ = static_cast<std::size_t>(stop - buffer_.get());
  }
  [[nodiscard]] std::uint64_t position() const noexcept { return flushed_ + used_; }
  /// Replaces bytes that were written before.
  void patch(std::uint64_t position, std::string_view bytes);
  [[nodiscard]] bool failed() const noexcept { return error_ != 0; }

  /// Flushes to the disk and takes the target's place.
  [[nodiscard]] Status commit();

 private:
  static constexpr std::size_t kBuffer = std::size_t{1} << 18U;
  OutFile() = default;
  void flush();
  [[nodiscard]] std::unexpected<Error> io_error(int code) const;

  std::filesystem::path target_, scratch_;
  int descriptor_ = -1;
  int error_ = 0;
  std::uint64_t flushed_ = 0;
  std::size_t used_ = 0;
  std::unique_ptr<char[]> buffer_;
};

}  // namespace relief::detail
