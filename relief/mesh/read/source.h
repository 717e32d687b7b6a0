// The bytes of a file and the small tools that the readers share.
#pragma once

#include <relief/base/error.h>
#include <relief/base/steps.h>
#include <relief/mesh/predicates.h>
#include <relief/mesh/triangle_mesh.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace relief::detail {

/// A whole regular file, read at once.
struct FileBytes {
  std::unique_ptr<char[]> data;
  std::size_t size = 0;
  [[nodiscard]] std::string_view view() const noexcept { return {data.get(), size}; }
};
/// Errors: NotFound, Io, Cancelled.
[[nodiscard]] Result<FileBytes> read_file(const std::filesystem::path& file, const Progress& progress);

/// The one phase of reading, and what of it is done once the file is read, unpacked, and gone through; then polygons
/// are cut.
inline constexpr std::string_view kImport = "import";
inline constexpr double kReadShare = 0.1, kUnpackedShare = 0.3, kParsedShare = 0.9;
inline constexpr std::string_view kReadingCancelled = "reading was cancelled";

/// Holds what a reader works on.
struct Source {
  std::filesystem::path path;
  std::string name;  ///< fit for messages
  std::string_view bytes;
  const Progress& progress;

  /// Returns what a reader's way through `count` bytes or items tells and asks.
  [[nodiscard]] Steps steps(std::uint64_t count) const noexcept {
    return {progress, kImport, count, kUnpackedShare, kParsedShare};
  }
  /// Returns a file that this one names. Errors: NotFound, Io, Cancelled.
  [[nodiscard]] Result<FileBytes> read_other(const std::filesystem::path& file) const {
    return read_file(file, {.report = {}, .cancel = progress.cancel});
  }
  [[nodiscard]] std::unexpected<Error> cancelled() const { return error(Errc::Cancelled, kReadingCancelled); }
  /// "NAME: what"
  [[nodiscard]] std::unexpected<Error> error(Errc code, std::string_view what) const {
    return fail(code, name + ": " + std::string(what));
  }
  [[nodiscard]] std::unexpected<Error> corrupt(std::string_view what) const { return error(Errc::Corrupt, what); }
  /// "NAME: line 12: what"
  [[nodiscard]] std::unexpected<Error> corrupt(std::string_view unit, std::size_t place, std::string_view what) const {
    return corrupt(std::string(unit) + " " + std::to_string(place) + ": " + std::string(what));
  }
};

/// Without the blanks at both ends.
[[nodiscard]] inline std::string_view trimmed(std::string_view text) noexcept {
  constexpr std::string_view kBlanks = " \t\v\f\r";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) + 1 - first);
}

/// Walks over text line by line and value by value. Lines end with \n, \r\n or \r.
class TextCursor {
 public:
  /// With `continued`, a backslash at the end of a line joins it with the next.
  explicit TextCursor(std::string_view text, bool continued = false, std::size_t first_line = 1) noexcept
      : at_(text.data()), end_(text.data() + text.size()), line_(first_line), continued_(continued) {}

  [[nodiscard]] std::size_t line() const noexcept { return line_; }
  [[nodiscard]] bool done() const noexcept { return at_ == end_; }
  [[nodiscard]] const char* position() const noexcept { return at_; }
  [[nodiscard]] std::size_t left() const noexcept { return static_cast<std::size_t>(end_ - at_); }

  void skip_blanks() noexcept {
    while (at_ != end_) {
      if (is_blank(*at_)) {
        ++at_;
      } else if (continued_ && *at_ == '\\' && at_ + 1 != end_ && is_end(at_[1])) {
        ++at_;
        take_line_end();
      } else {
        return;
      }
    }
  }
  /// True at the end of a line, of the text, or before a # comment.
  [[nodiscard]] bool at_line_end() noexcept {
    skip_blanks();
    return at_ == end_ || is_end(*at_) || *at_ == '#';
  }
  void next_line() noexcept {
    while (at_ != end_ && !is_end(*at_)) {
      if (continued_ && *at_ == '\\' && at_ + 1 != end_ && is_end(at_[1])) {
        ++at_;
        take_line_end();
      } else {
        ++at_;
      }
    }
    take_line_end();
  }
  /// To the next value, over line ends and # comments; false at the end of the text.
  [[nodiscard]] bool skip_to_value() noexcept {
    while (at_line_end()) {
      if (done()) return false;
      next_line();
    }
    return true;
  }
  /// Returns the characters up to the next blank or line end; empty at the end of a line.
  [[nodiscard]] std::string_view word() noexcept {
    skip_blanks();
    const char* from = at_;
    while (at_ != end_ && !is_blank(*at_) && !is_end(*at_)) ++at_;
    return {from, static_cast<std::size_t>(at_ - from)};
  }
  /// Returns the rest of the line.
  [[nodiscard]] std::string_view rest() noexcept {
    const char* from = at_;
    while (at_ != end_ && !is_end(*at_)) ++at_;
    return {from, static_cast<std::size_t>(at_ - from)};
  }
  /// Returns a number that ends where a value must end; too large becomes infinite, too small 0. The cursor stays on
  /// failure.
  [[nodiscard]] bool number(double& value) noexcept;
  /// Returns an integer; what follows it is the caller's matter (OBJ writes 1/2/3). Also reads "3.0" and "3e0" when
  /// `real` is set.
  [[nodiscard]] bool integer(std::int64_t& value, bool real = false) noexcept;
  [[nodiscard]] bool take(char c) noexcept {
    if (at_ == end_ || *at_ != c) return false;
    ++at_;
    return true;
  }
  /// Returns the next word, without moving, for a message.
  [[nodiscard]] std::string peek() const;

 private:
  static bool is_blank(char c) noexcept { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
  static bool is_end(char c) noexcept { return c == '\n' || c == '\r'; }
  void take_line_end() noexcept {
    if (at_ == end_) return;
    if (*at_ == '\r' && at_ + 1 != end_ && at_[1] == '\n') ++at_;
    ++at_;
    ++line_;
  }

  const char* at_;
  const char* end_;
  std::size_t line_;
  bool continued_;
};

/// Returns an unaligned value in the byte order of the file.
template <typename T>
[[nodiscard]] T load(const char* from, bool swap) noexcept {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), from, sizeof(T));
  if (swap) std::reverse(raw.begin(), raw.end());
  return std::bit_cast<T>(raw);
}
template <typename T>
[[nodiscard]] T load_le(const char* from) noexcept {
  return load<T>(from, std::endian::native == std::endian::big);
}

/// [0, 1] -> 0..255; what is outside, or not a number, is clamped.
[[nodiscard]] inline std::uint8_t unit_to_byte(double value) noexcept {
  return value > 0.0 ? static_cast<std::uint8_t>(std::lround(std::min(value, 1.0) * 255.0)) : std::uint8_t{0};
}

/// Holds what colours a face: its material, and (none, or one per corner) the numbers of places in the image.
struct FacePaint {
  std::uint32_t material = 0;
  std::span<const std::uint32_t> uvs = {};
};

/// Gathers faces, cuts polygons into triangles, and checks in the end that every corner exists. Corners may come before
/// the positions they name. Faces of fewer than three corners are points and lines and are left out.
class FaceSink {
 public:
  explicit FaceSink(TriangleMesh& mesh) noexcept : mesh_(mesh) {}

  static constexpr std::uint32_t kNoUv = 0xffffffffU;

  /// `place` is the line or face number for messages.
  void add(std::span<const std::uint32_t> corners, std::size_t place, const FacePaint& paint = {});
  void leave_out_line() noexcept { has_lines_ = true; }
  /// Returns whether points or lines were left out.
  [[nodiscard]] bool has_lines() const noexcept { return has_lines_; }
  /// Corrupt when a corner names no position (`unit` is "line" or "face", `first` what the format calls the first
  /// vertex), UnsupportedFormat when polygons take too much work or when there is not one triangle.
  [[nodiscard]] Status finish(const Source& source, std::string_view unit, std::uint32_t first = 0);
  /// After finish(): per triangle the numbers of its corners' places in the image, kNoUv where the face had none; empty
  /// when no face had any. mesh.material_of is set, or empty when all faces have material 0.
  [[nodiscard]] const std::vector<Triangle>& uvs() const noexcept { return uvs_; }

 private:
  TriangleMesh& mesh_;
  std::vector<Triangle> uvs_;
  std::vector<std::uint32_t> polygon_uvs_;  ///< beside polygons_, as far as it goes
  std::uint32_t highest_ = 0;
  std::size_t highest_place_ = 0;
  bool has_lines_ = false;
  std::vector<std::uint32_t> polygons_;  ///< waiting: place-less runs of count, material, corners...
};

/// Cuts polygons into triangles by clipping ears in the polygon's plane; every corner stays in use, so that neighbours
/// still fit. Deterministic. A polygon that crosses itself is cut somehow.
class PolygonCutter {
 public:
  /// `budget` bounds the work over all polygons, in point-in-triangle tests.
  explicit PolygonCutter(std::size_t budget) noexcept : budget_(budget) {}
  /// Appends at most corners - 2 triangles of places in `polygon`; false when the budget is used up, or cancelled.
  [[nodiscard]] bool cut(std::span<const std::uint32_t> polygon, std::span<const Vec3d> positions,
                         std::vector<Triangle>& out, const Progress& progress = {});

 private:
  struct Corner {
    Point2 at;
    std::uint32_t place, before, after;
    bool reflex;
  };
  void spend(std::size_t work) noexcept { budget_ -= std::min(budget_, work); }
  [[nodiscard]] bool is_ear(const Corner& corner) noexcept;
  [[nodiscard]] int turn(const Corner& corner) const noexcept;

  std::size_t budget_;
  std::vector<Corner> ring_;
  std::vector<std::uint32_t> reflex_;  ///< places in ring_ that can lie inside an ear; some may have been cut off since
};

}  // namespace relief::detail
