// A frame as a picture that can be saved.
#pragma once

#include <relief/render/frame.h>

namespace relief::studio {

/// Draws one frame in a context of its own. Any thread; takes the time of a final frame and of making the renderer.
[[nodiscard]] Result<Picture> draw_picture(const Snapshot& model, const Frame& frame);
/// From the words of FrameRenderer::draw(), without gaps between rows.
[[nodiscard]] Picture to_picture(std::span<const std::uint32_t> pixels, int width, int height);

}  // namespace relief::studio
