#include "background.h"

#include <algorithm>
#include <cmath>

namespace relief::detail {

namespace {

/// Returns the order in which an 8 x 8 square of pixels takes the next step of colour, 0..63.
unsigned bayer(unsigned x, unsigned y) {
  const unsigned d = x ^ y;
  return ((d & 1U) << 5U) | ((y & 1U) << 4U) | ((d & 2U) << 2U) | ((y & 2U) << 1U) | ((d & 4U) >> 1U) |
         ((y & 4U) >> 2U);
}

}  // namespace

Background::Background(Vec3f top, Vec3f bottom, int height) : rows_(static_cast<std::size_t>(height)) {
  for (int y = 0; y < height; ++y) {
    const float t = (static_cast<float>(y) + 0.5F) / static_cast<float>(height);
    const Vec3f c = top * (1 - t) + bottom * t;
    for (unsigned x = 0; x < kPeriod; ++x) {
      const float threshold = (static_cast<float>(bayer(x, static_cast<unsigned>(y))) + 0.5F) / 64;
      const auto code = [&](float v) {
        return static_cast<std::uint32_t>(std::floor(std::clamp(v, 0.0F, 1.0F) * 255 + threshold));
      };
      rows_[static_cast<std::size_t>(y)][x] = 0xff000000U | (code(c.x) << 16U) | (code(c.y) << 8U) | code(c.z);
    }
  }
}

void fill_behind(const Pixels& pixels, const Background& background) {
  for (int y = 0; y < pixels.rect.height; ++y) {
    // The pattern, turned so that it starts at the rectangle's first column.
    std::array<std::uint32_t, Background::kPeriod> behind{};
    for (unsigned k = 0; k < Background::kPeriod; ++k)
      behind[k] = background.row(pixels.rect.y + y)[(static_cast<unsigned>(pixels.rect.x) + k) % Background::kPeriod];
    std::uint32_t* const to = pixels.row(y);
    int x = 0;
    for (; x + 8 <= pixels.rect.width; x += 8)
      for (int k = 0; k < 8; ++k) to[x + k] = to[x + k] >= 0xff000000U ? to[x + k] : behind[static_cast<unsigned>(k)];
    for (; x < pixels.rect.width; ++x) to[x] = to[x] >= 0xff000000U ? to[x] : behind[static_cast<unsigned>(x) % 8];
  }
}

void SampleSums::start(const PixelRect& rect) {
  sums_.assign(4 * static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height), 0);
}

void SampleSums::add(std::span<const std::uint32_t> words) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(words.data());
  std::uint16_t* const to = sums_.data();
  for (std::size_t k = 0; k < sums_.size(); ++k) to[k] = static_cast<std::uint16_t>(to[k] + bytes[k]);
}

void SampleSums::write(const Pixels& pixels, int samples, const Background& background) const {
  const auto count = static_cast<std::uint32_t>(samples);
  // A sum of up to 16 bytes and its rounding, divided: exact, as it is less than 2^15.
  const std::uint32_t share = (65536 + count - 1) / count;
  const std::uint16_t* sum = sums_.data();
  std::array<std::uint16_t, 4 * Background::kPeriod> behind{};
  for (int y = 0; y < pixels.rect.height; ++y) {
    const auto& row = background.row(pixels.rect.y + y);
    for (unsigned k = 0; k < behind.size(); ++k)
      behind[k] = static_cast<std::uint16_t>(
          (row[(static_cast<unsigned>(pixels.rect.x) + k / 4) % Background::kPeriod] >> (8 * (k % 4))) & 255U);
    auto* to = reinterpret_cast<std::uint8_t*>(pixels.row(y));
    for (int x = 0; x < pixels.rect.width; ++x, sum += 4, to += 4) {
      const std::uint16_t* const back = behind.data() + 4 * (static_cast<unsigned>(x) % Background::kPeriod);
      const std::uint32_t open = count - sum[3] / 255U;  // each sample covers with 255 or not at all
      for (unsigned c = 0; c < 4; ++c)
        to[c] = static_cast<std::uint8_t>((sum[c] + open * back[c] + count / 2) * share >> 16U);
    }
  }
}

}  // namespace relief::detail
