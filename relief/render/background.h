// The last step of a frame: samples become pixels, with the background behind them.
#pragma once

#include "frame.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace relief::detail {

/// A gradient from the upper to the lower edge of the picture, dithered so that no bands show: in each row eight words
/// that repeat.
class Background {
 public:
  Background(Vec3f top, Vec3f bottom, int height);
  static constexpr unsigned kPeriod = 8;
  [[nodiscard]] const std::array<std::uint32_t, kPeriod>& row(int y) const noexcept {
    return rows_[static_cast<std::size_t>(y)];
  }

 private:
  std::vector<std::array<std::uint32_t, kPeriod>> rows_;
};

/// A rectangle of the caller's picture.
struct Pixels {
  std::uint32_t* first;  ///< of the whole picture
  int stride;            ///< words
  PixelRect rect;
  [[nodiscard]] std::uint32_t* row(int y) const noexcept {
    return first + static_cast<std::size_t>(rect.y + y) * static_cast<std::size_t>(stride) + rect.x;
  }
};

/// One sample per pixel is in place already, its alpha 0 or 255: fills what is open.
void fill_behind(const Pixels& pixels, const Background& background);

/// Sums of several samples per pixel.
class SampleSums {
 public:
  void start(const PixelRect& rect);
  /// The words of one sample, in rows of the rectangle's width; alpha 0 or 255.
  void add(std::span<const std::uint32_t> words);
  /// Their means with the background where they are open.
  void write(const Pixels& pixels, int samples, const Background& background) const;

 private:
  std::vector<std::uint16_t> sums_;  ///< blue, green, red, cover
};

}  // namespace relief::detail
