// Words in a picture, in the system's own font.
#pragma once

#include "background.h"

#include <relief/base/error.h>

#include <memory>
#include <string_view>

namespace relief::detail {

/// One face: Inter where it is installed, else what fontconfig calls sans-serif. One thread.
class Text {
 public:
  /// Error: Io, naming the package that brings a font.
  [[nodiscard]] static Result<Text> load();
  Text(Text&&) noexcept;
  Text& operator=(Text&&) noexcept;
  ~Text();

  /// Pixels from the start to the end of a line of UTF-8 in letters of `size` pixels.
  [[nodiscard]] double width(std::string_view line, double size) const;
  /// Writes the line from (x, baseline) of the picture, only within the rectangle; the same bits whatever that is.
  void write(const Pixels& pixels, double x, double baseline, double size, Vec3f colour, std::string_view line) const;

 private:
  struct Face;
  explicit Text(std::unique_ptr<Face> face) noexcept;
  std::unique_ptr<Face> face_;
};

/// Mixes a colour into a pixel of the picture; nothing outside the rectangle. `share`: 0..255.
void mix_pixel(const Pixels& pixels, int x, int y, Vec3f colour, unsigned share);

}  // namespace relief::detail
