// Pictures as bytes of a file, for tests that need images.
#pragma once

#include <relief/mesh/triangle_mesh.h>

#include <jpeglib.h>
#include <png.h>

#include <cstdio>  // before jpeglib.h, which needs FILE
#include <cstdlib>
#include <string>

namespace relief::testing {

template <typename ColourOf>
Image image_of(std::uint32_t width, std::uint32_t height, ColourOf&& colour_of) {
  Image image{width, height, {}};
  for (std::uint32_t y = 0; y < height; ++y)
    for (std::uint32_t x = 0; x < width; ++x) image.pixels.push_back(colour_of(x, y));
  return image;
}

inline std::string png_bytes(const Image& image) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = image.width;
  header.height = image.height;
  header.format = PNG_FORMAT_RGBA;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(header);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&header, bytes.data(), &size, 0, image.pixels.data(), 0, nullptr) == 0) std::abort();
  bytes.resize(size);
  return bytes;
}

/// What a PNG file may say and Image cannot: its depth, kind and colour space.
struct PngForm {
  int depth = 8;
  int kind = PNG_COLOR_TYPE_RGB;
  int gamma = 0;  ///< of a gAMA chunk, times 100,000; 0: none
  bool srgb = false;
};
/// The bytes of such a file. A channel of 16 bits is 257 times that of 8; alpha is half.
inline std::string png_bytes(const Image& image, const PngForm& form) {
  std::string bytes;
  png_structp writer = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(writer);
  png_set_write_fn(
      writer, &bytes,
      [](png_structp to, png_bytep from, png_size_t count) {
        static_cast<std::string*>(png_get_io_ptr(to))->append(reinterpret_cast<const char*>(from), count);
      },
      [](png_structp) {});
  png_set_IHDR(writer, info, image.width, image.height, form.depth, form.kind, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  std::vector<png_color> palette;
  if (form.kind == PNG_COLOR_TYPE_PALETTE) {
    for (const Rgba8 c : image.pixels) palette.push_back({c.r, c.g, c.b});
    png_set_PLTE(writer, info, palette.data(), static_cast<int>(palette.size()));
  }
  if (form.srgb) png_set_sRGB(writer, info, PNG_sRGB_INTENT_PERCEPTUAL);
  if (form.gamma > 0) png_set_gAMA_fixed(writer, info, form.gamma);
  png_write_info(writer, info);
  std::vector<png_byte> row;
  const auto put = [&](unsigned value) {
    row.insert(row.end(), form.depth == 16 ? 2U : 1U, static_cast<png_byte>(value));
  };
  for (std::size_t k = 0; k < image.pixels.size(); ++k) {
    const Rgba8 c = image.pixels[k];
    if (form.kind == PNG_COLOR_TYPE_PALETTE) {
      put(static_cast<unsigned>(k));
    } else {
      put(c.r);
      if ((form.kind & PNG_COLOR_MASK_COLOR) != 0) put(c.g), put(c.b);
      if ((form.kind & PNG_COLOR_MASK_ALPHA) != 0) put(128);
    }
    if ((k + 1) % image.width != 0) continue;
    png_write_row(writer, row.data());
    row.clear();
  }
  png_write_end(writer, info);
  png_destroy_write_struct(&writer, &info);
  return bytes;
}

inline std::string jpeg_bytes(const Image& image, bool progressive = false) {
  jpeg_compress_struct writer{};
  jpeg_error_mgr errors{};
  writer.err = jpeg_std_error(&errors);
  jpeg_create_compress(&writer);
  unsigned char* memory = nullptr;
  unsigned long size = 0;  // NOLINT(google-runtime-int): libjpeg's type
  jpeg_mem_dest(&writer, &memory, &size);
  writer.image_width = image.width;
  writer.image_height = image.height;
  writer.input_components = 4;
  writer.in_color_space = JCS_EXT_RGBA;
  jpeg_set_defaults(&writer);
  jpeg_set_quality(&writer, 95, TRUE);
  if (progressive) jpeg_simple_progression(&writer);
  jpeg_start_compress(&writer, TRUE);
  std::vector<Rgba8> row(image.width);
  for (std::uint32_t y = 0; y < image.height; ++y) {
    const auto start = image.pixels.begin() + std::ptrdiff_t{y} * image.width;
    row.assign(start, start + image.width);
    auto* line = reinterpret_cast<JSAMPROW>(row.data());
    jpeg_write_scanlines(&writer, &line, 1);
  }
  jpeg_finish_compress(&writer);
  std::string bytes(reinterpret_cast<const char*>(memory), size);
  jpeg_destroy_compress(&writer);
  std::free(memory);
  return bytes;
}

}  // namespace relief::testing
