// Numbers and text into a file that appears whole or not at all.
#pragma once

#include <relief/base/atomic_file.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <concepts>
#include <cstdint>
#include <memory>
#include <string_view>
#include <utility>

namespace relief::detail {

/// Gathers small writes. The first failure is kept for commit(), so that writers need not look after each value;
/// nothing is written after it.
class OutFile {
 public:
  explicit OutFile(AtomicFile file)
      : file_(std::move(file)), buffer_(std::make_unique_for_overwrite<char[]>(kBuffer)) {}

  void write(std::string_view bytes) {
    while (!bytes.empty()) {
      if (used_ == kBuffer) flush();
      const std::size_t step = std::min(bytes.size(), kBuffer - used_);
      std::ranges::copy(bytes.substr(0, step), buffer_.get() + used_);
      used_ += step;
      bytes.remove_prefix(step);
    }
  }
  /// Returns a number, little-endian.
  template <typename T>
    requires std::integral<T> || std::floating_point<T>
  void value(T number) {
    auto raw = std::bit_cast<std::array<char, sizeof(T)>>(number);
    if constexpr (std::endian::native == std::endian::big) std::reverse(raw.begin(), raw.end());
    write({raw.data(), raw.size()});
  }
  /// The shortest text that reads back as the same value.
  template <typename T>
  void text(T number) {
    if (kBuffer - used_ < 40) flush();
    used_ = static_cast<std::size_t>(std::to_chars(buffer_.get() + used_, buffer_.get() + kBuffer, number).ptr -
                                     buffer_.get());
  }
  [[nodiscard]] std::uint64_t position() const noexcept { return flushed_ + used_; }
  [[nodiscard]] bool failed() const noexcept { return !status_.has_value(); }

  /// Makes the file durable under its name.
  [[nodiscard]] Status commit() {
    flush();
    if (!status_) return status_;
    return file_.commit();
  }

 private:
  static constexpr std::size_t kBuffer = std::size_t{1} << 16U;
  void flush() {
    if (status_) status_ = file_.write(std::string_view(buffer_.get(), used_));
    flushed_ += used_;
    used_ = 0;
  }

  AtomicFile file_;
  Status status_;
  std::uint64_t flushed_ = 0;
  std::size_t used_ = 0;
  std::unique_ptr<char[]> buffer_;
};

}  // namespace relief::detail
