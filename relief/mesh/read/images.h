// Images that mesh files name or hold: decoding within bounds, and where a file beside the mesh lies.
#pragma once

#include <relief/mesh/read/source.h>

#include <map>
#include <memory>
#include <optional>

namespace relief::detail {

/// Pixels that the images of one mesh may have in memory together, and one of them alone; larger ones are kept at half
/// their size, a quarter, ...
inline constexpr std::uint64_t kMostPixels = std::uint64_t{1} << 26U;
inline constexpr std::uint64_t kMostPixelsOfOne = std::uint64_t{1} << 24U;

/// Decodes a PNG or a JPEG (with more than 2^26 pixels: one that need not be held whole, a baseline JPEG), halved until
/// it has at most `most` pixels. Transparency is left out. Its full size is taken from `work`, a bound in pixels.
/// Errors: UnsupportedFormat, Corrupt, both with the words that complete "image NAME ...".
[[nodiscard]] Result<Image> decode_image(std::string_view bytes, std::uint64_t most, std::uint64_t& work);

/// Returns the path of a file that a mesh file names, or none when it does not lie in the folder of the mesh file or
/// below it.
[[nodiscard]] std::optional<std::filesystem::path> beside(const Source& source, std::string_view relative);

/// Notes of several formats. Names of what they mean follow the first one.
inline constexpr std::string_view kOtherImages = "images of its materials other than colour were passed over";
inline constexpr std::string_view kOnlyFaces = "points or lines were passed over; only faces are read";
inline constexpr std::string_view kVertexValues = "values of its vertices that have no use here were passed over";
inline constexpr std::string_view kFaceValues = "values of its faces that have no use here were passed over";

/// The images of one mesh file. What is not available becomes a note, once, and a null image: a mesh without its
/// picture is still a mesh.
class ImageStore {
 public:
  ImageStore(const Source& source, std::size_t image_count) noexcept;

  /// Returns a file that the mesh file names. A path from another machine is looked for by its last part beside the
  /// mesh.
  [[nodiscard]] std::shared_ptr<const Image> file(std::string_view named);
  /// Returns an image inside the mesh file; `key` tells it from others.
  [[nodiscard]] std::shared_ptr<const Image> inside(std::string_view key, std::string_view bytes);
  void note(std::string text);
  /// "WHAT: a, b, c and 2 more"; nothing when there are no names.
  void note_names(std::string what, const std::vector<std::string>& names);
  /// Says that bytes stand behind all that a file declares, unless these are blanks or zeros.
  void note_rest(std::string_view rest);
  [[nodiscard]] std::vector<std::string> take_notes() noexcept { return std::move(notes_); }

 private:
  [[nodiscard]] std::shared_ptr<const Image> decoded(const std::string& key, std::string_view bytes);

  const Source& source_;
  std::uint64_t most_;         ///< pixels of one image
  std::size_t bytes_left_;     ///< of files to read
  std::uint64_t pixels_left_;  ///< to decode
  std::map<std::string, std::shared_ptr<const Image>, std::less<>> images_;
  std::vector<std::string> notes_;
};

}  // namespace relief::detail
