#include "text.h"

#include <fontconfig/fontconfig.h>
#include <ft2build.h>
#include FT_FREETYPE_H

#include <algorithm>
#include <cmath>
#include <string>

namespace relief::detail {

namespace {

/// Returns the file of the best font, and the number of the face in it.
std::pair<std::string, int> find_font() {
  std::pair<std::string, int> found{"", 0};
  FcPattern* const wanted = FcNameParse(reinterpret_cast<const FcChar8*>("Inter,sans-serif:weight=100:slant=0"));
  FcConfigSubstitute(nullptr, wanted, FcMatchPattern);
  FcDefaultSubstitute(wanted);
  FcResult result = FcResultNoMatch;
  FcPattern* const match = FcFontMatch(nullptr, wanted, &result);
  if (match != nullptr) {
    FcChar8* file = nullptr;
    if (FcPatternGetString(match, FC_FILE, 0, &file) == FcResultMatch)
      found.first = reinterpret_cast<const char*>(file);
    FcPatternGetInteger(match, FC_INDEX, 0, &found.second);
    FcPatternDestroy(match);
  }
  FcPatternDestroy(wanted);
  return found;
}

/// Calls visit(code point) for the characters of UTF-8; a malformed byte stands for itself.
template <typename Visit>
void for_each_character(std::string_view line, Visit&& visit) {
  for (std::size_t k = 0; k < line.size();) {
    const auto first = static_cast<unsigned char>(line[k]);
    const std::size_t more = first >= 0xf0 ? 3 : first >= 0xe0 ? 2 : first >= 0xc0 ? 1 : 0;
    FT_ULong code = more == 0 ? first : first & (0x3fU >> more);
    for (std::size_t b = 1; b <= more && k + b < line.size(); ++b)
      code = (code << 6U) | (static_cast<unsigned char>(line[k + b]) & 0x3fU);
    k += 1 + more;
    visit(code);
  }
}

}  // namespace

struct Text::Face {
  FT_Library library = nullptr;
  FT_Face face = nullptr;
  Face() = default;
  Face(const Face&) = delete;
  Face& operator=(const Face&) = delete;
  ~Face() {
    FT_Done_Face(face);
    FT_Done_FreeType(library);
  }
  void set_size(double size) const {
    FT_Set_Char_Size(face, 0, static_cast<FT_F26Dot6>(std::lround(size * 64)), 72, 72);
  }
};

Text::Text(std::unique_ptr<Face> face) noexcept : face_(std::move(face)) {}
Text::Text(Text&&) noexcept = default;
Text& Text::operator=(Text&&) noexcept = default;
Text::~Text() = default;

Result<Text> Text::load() {
  auto made = std::make_unique<Face>();
  const auto [file, number] = find_font();
  if (file.empty() || FT_Init_FreeType(&made->library) != 0 ||
      FT_New_Face(made->library, file.c_str(), number, &made->face) != 0)
    return fail(Errc::Io, "cannot write into the picture: no font is installed; install the package fonts-inter");
  return Text(std::move(made));
}

double Text::width(std::string_view line, double size) const {
  face_->set_size(size);
  double total = 0;
  for_each_character(line, [&](FT_ULong code) {
    if (FT_Load_Char(face_->face, code, FT_LOAD_NO_HINTING) == 0)
      total += static_cast<double>(face_->face->glyph->linearHoriAdvance) / 65536;
  });
  return total;
}

void Text::write(const Pixels& pixels, double x, double baseline, double size, Vec3f colour,
                 std::string_view line) const {
  face_->set_size(size);
  for_each_character(line, [&](FT_ULong code) {
    // Letters start at quarters of a pixel.
    const double start = std::floor(x * 4) / 4;
    FT_Vector shift{static_cast<FT_Pos>(std::lround((start - std::floor(start)) * 64)), 0};
    FT_Set_Transform(face_->face, nullptr, &shift);
    if (FT_Load_Char(face_->face, code, FT_LOAD_NO_HINTING | FT_LOAD_RENDER) != 0) return;
    const FT_GlyphSlot glyph = face_->face->glyph;
    const int left = static_cast<int>(std::floor(start)) + glyph->bitmap_left;
    const int top = static_cast<int>(std::lround(baseline)) - glyph->bitmap_top;
    for (unsigned r = 0; r < glyph->bitmap.rows; ++r)
      for (unsigned c = 0; c < glyph->bitmap.width; ++c)
        mix_pixel(pixels, left + static_cast<int>(c), top + static_cast<int>(r), colour,
                  glyph->bitmap.buffer[r * static_cast<unsigned>(glyph->bitmap.pitch) + c]);
    x += static_cast<double>(glyph->linearHoriAdvance) / 65536;
  });
}

void mix_pixel(const Pixels& pixels, int x, int y, Vec3f colour, unsigned share) {
  const PixelRect& r = pixels.rect;
  if (x < r.x || y < r.y || x >= r.x + r.width || y >= r.y + r.height) return;
  std::uint32_t& word =
      pixels.first[static_cast<std::size_t>(y) * static_cast<std::size_t>(pixels.stride) + static_cast<std::size_t>(x)];
  std::uint32_t mixed = 0xff000000U;
  for (unsigned c = 0; c < 3; ++c) {
    const auto over = static_cast<unsigned>(std::lround(std::clamp(colour[2 - c], 0.0F, 1.0F) * 255));
    mixed |= ((((word >> (8 * c)) & 255U) * (255U - share) + over * share + 127U) / 255U) << (8 * c);
  }
  word = mixed;
}

}  // namespace relief::detail
