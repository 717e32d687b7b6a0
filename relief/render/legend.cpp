#include "legend.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace relief::detail {

namespace {

/// Cividis (Nunez, Anderton and Renslow 2018) at ten even steps, sRGB.
constexpr std::array<std::uint32_t, 10> kCividis = {0x00224e, 0x123570, 0x3b496c, 0x575d6d, 0x707173,
                                                    0x8a8678, 0xa59c74, 0xc3b369, 0xe1cc55, 0xfee838};
constexpr std::array<std::uint32_t, 7> kTwoSided = {0x0b3c7d, 0x3a78b5, 0x93bfdd, 0xf5f5f2,
                                                    0xf2b87c, 0xd5742c, 0x8a3f06};

bool two_sided(Look::Map map) { return map == Look::Map::Displacement || map == Look::Map::Stretch; }

Vec3f colour_of(std::uint32_t rgb) {
  const auto part = [&](unsigned shift) { return static_cast<float>((rgb >> shift) & 255U) / 255; };
  return {part(16), part(8), part(0)};
}

template <std::size_t Count>
Vec3f along(const std::array<std::uint32_t, Count>& steps, double t) {
  const double at = std::clamp(t, 0.0, 1.0) * (Count - 1);
  const auto k = std::min(static_cast<std::size_t>(at), Count - 2);
  const auto f = static_cast<float>(at - static_cast<double>(k));
  return colour_of(steps[k]) * (1 - f) + colour_of(steps[k + 1]) * f;
}

/// With two digits behind the point at most, and none that say nothing.
std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g", value);
  // A true minus sign is as wide as a plus.
  return value < 0 ? "\xe2\x88\x92" + std::string(text.data() + 1) : std::string(text.data());
}

std::string label(const Look& look, double value) {
  if (look.map == Look::Map::Stretch) return number(std::exp2(value)) + "\xc3\x97";
  const std::string sign = look.map == Look::Map::Displacement && value > 0 ? "+" : "";
  return look.mm_per_unit > 0 ? sign + number(value * look.mm_per_unit) + " mm" : sign + number(value);
}

std::string_view title(Look::Map map) {
  switch (map) {
    case Look::Map::Displacement:
      return "Height from the middle";
    case Look::Map::Depth:
      return "Clay left";
    case Look::Map::Stretch:
      return "Area per sample";
    default:
      return "";
  }
}

}  // namespace

Vec3f map_colour(Look::Map map, double t) { return two_sided(map) ? along(kTwoSided, t) : along(kCividis, t); }

std::array<std::uint32_t, 256> map_colours(Look::Map map) {
  std::array<std::uint32_t, 256> all{};
  for (std::size_t k = 0; k < all.size(); ++k) {
    const Vec3f c = map_colour(map, static_cast<double>(k) / 255);
    const auto code = [](float v) { return static_cast<std::uint32_t>(std::lround(v * 255)); };
    all[k] = code(c.x) | (code(c.y) << 8U) | (code(c.z) << 16U) | 0xff000000U;
  }
  return all;
}

double rounded_up(double value) noexcept {
  if (!(value > 0) || !std::isfinite(value)) return 1;
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  for (const double step : {1.0, 2.0, 5.0})
    if (value <= step * power * (1 + 1e-9)) return step * power;
  return 10 * power;
}

void draw_legend(const Pixels& pixels, int height, const Look& look, const MapScale& scale, const Text* text) {
  if (look.map == Look::Map::None || look.map == Look::Map::Slabs) return;
  const double size = std::clamp(height / 60.0, 11.0, 40.0);
  const int bar_height = std::min(static_cast<int>(size * 12), height * 2 / 5),
            bar_width = static_cast<int>(size * 0.9);
  const int left = look.legend_left + static_cast<int>(size * 1.6), bottom = height - static_cast<int>(size * 1.8),
            top = bottom - bar_height;
  constexpr std::array<double, 5> kMarks = {0, 0.25, 0.5, 0.75, 1};
  double widest = 0;
  if (text != nullptr) {
    for (const double t : kMarks)
      widest = std::max(widest, text->width(label(look, scale.low + (scale.high - scale.low) * t), size));
    widest = std::max(widest + bar_width + size * 0.7, text->width(title(look.map), size));
  }
  // A panel, so that the words can be read over everything.
  constexpr Vec3f kPanel = {0.09F, 0.10F, 0.115F}, kInk = {0.875F, 0.886F, 0.906F}, kDim = {0.58F, 0.61F, 0.65F};
  const int right = left + static_cast<int>(std::max(widest, static_cast<double>(bar_width)) + size * 0.8);
  for (int y = top - static_cast<int>(size * 2.4); y < bottom + static_cast<int>(size * 0.9); ++y)
    for (int x = left - static_cast<int>(size * 0.8); x < right; ++x) mix_pixel(pixels, x, y, kPanel, 205);
  for (int y = top; y < bottom; ++y) {
    const Vec3f colour = map_colour(look.map, (bottom - y - 0.5) / bar_height);
    for (int x = left; x < left + bar_width; ++x) mix_pixel(pixels, x, y, colour, 255);
  }
  if (text == nullptr) return;
  text->write(pixels, left, top - size * 1.1, size, kDim, title(look.map));
  for (const double t : kMarks) {
    const double y = bottom - bar_height * t;
    text->write(pixels, left + bar_width + size * 0.7, y + size * 0.36, size, kInk,
                label(look, scale.low + (scale.high - scale.low) * t));
  }
}

}  // namespace relief::detail
