#include "picture_of.h"

#include <relief/base/try.h>

namespace relief::studio {

Result<Picture> draw_picture(const Snapshot& model, const Frame& frame) {
  RELIEF_TRY(FrameRenderer renderer, FrameRenderer::create());
  return renderer.picture(model, frame);
}

}  // namespace relief::studio
