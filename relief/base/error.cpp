#include <relief/base/error.h>

#include <array>
#include <cstring>

namespace relief {

std::string_view name(Errc code) noexcept {
  static constexpr std::array<std::string_view, 11> kNames = {
      "InvalidArgument",   "NotFound",     "Io",          "Corrupt",
      "UnsupportedFormat", "NewerVersion", "NotManifold", "Unfoldable",
      "DeviceUnavailable", "DeviceLost",   "Cancelled"};
  return kNames[std::to_underlying(code)];
}

namespace {

/// Length of the well-formed UTF-8 sequence at the start of `text`, 0 when there is none.
std::size_t utf8_length(std::string_view text) noexcept {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned char lead = byte(0);
  std::size_t length = 0;
  std::uint32_t value = 0;
  if (lead < 0x80) return 1;
  if ((lead & 0xe0U) == 0xc0) {
    length = 2;
    value = lead & 0x1fU;
  } else if ((lead & 0xf0U) == 0xe0) {
    length = 3;
    value = lead & 0x0fU;
  } else if ((lead & 0xf8U) == 0xf0) {
    length = 4;
    value = lead & 0x07U;
  } else {
    return 0;
  }
  if (text.size() < length) return 0;
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(k) & 0xc0U) != 0x80) return 0;
    value = (value << 6U) | (byte(k) & 0x3fU);
  }
  static constexpr std::array<std::uint32_t, 5> kLeast = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = value >= 0xd800 && value <= 0xdfff;
  const bool c1_control = value >= 0x80 && value < 0xa0;
  const bool line_break_or_bidi = value == 0x2028 || value == 0x2029 || (value >= 0x202a && value <= 0x202e) ||
                                  (value >= 0x2066 && value <= 0x2069);
  return value < kLeast[length] || value > 0x10ffff || surrogate || c1_control || line_break_or_bidi ? 0 : length;
}

}  // namespace

std::string printable(std::string_view text, std::size_t limit) {
  static constexpr std::string_view kHex = "0123456789abcdef";
  std::string out;
  while (!text.empty()) {
    const auto lead = static_cast<unsigned char>(text[0]);
    const std::size_t length = lead < 0x20 || lead == 0x7f ? 0 : utf8_length(text);
    const std::size_t cost = length == 0 ? 4 : length;
    if (out.size() + cost > limit) return out + "...";
    if (length == 0) {
      out += "\\x";
      out += kHex[lead >> 4U];
      out += kHex[lead & 15U];
      text.remove_prefix(1);
    } else {
      out += text.substr(0, length);
      text.remove_prefix(length);
    }
  }
  return out;
}

std::unexpected<Error> io_error(std::string_view file, std::string_view what, int error) {
  return fail(Errc::Io, printable(file).append(": ").append(what).append(": ").append(std::strerror(error)));
}

}  // namespace relief
