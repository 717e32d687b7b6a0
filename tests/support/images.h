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
