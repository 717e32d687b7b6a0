#include "picture_of.h"

#include <relief/base/try.h>

namespace relief::studio {

Result<Picture> draw_picture(const Snapshot& model, const Frame& frame) {
  RELIEF_TRY(FrameRenderer renderer, FrameRenderer::create());
  std::vector<std::uint32_t> pixels(static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height));
  RELIEF_TRY(const PixelRect drawn, renderer.draw(model, frame, pixels, frame.width));
  (void)drawn;
  return to_picture(pixels, frame.width, frame.height);
}

Picture to_picture(std::span<const std::uint32_t> pixels, int width, int height) {
  Picture picture;
  picture.width = width;
  picture.height = height;
  picture.rgb.reserve(3 * pixels.size());
  for (const std::uint32_t word : pixels)
    for (const unsigned shift : {16U, 8U, 0U}) picture.rgb.push_back(static_cast<std::uint8_t>(word >> shift));
  return picture;
}

}  // namespace relief::studio
