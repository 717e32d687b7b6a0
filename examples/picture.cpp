// A picture of a model, without a screen.
#include <relief/convert/convert.h>
#include <relief/mesh/samples.h>
#include <relief/render/frame.h>

#include <cstdio>

int main() {
  const auto mesh = relief::make_sample("torus", 20'000);
  if (!mesh) return 1;
  const auto made = relief::convert(*mesh, {.slabs = 100, .intervals = 16});
  if (!made) return 1;
  const relief::SnapshotPtr& model = made->model.head;

  // region draw
  auto renderer = relief::FrameRenderer::create();
  if (!renderer) {
    std::fprintf(stderr, "%s\n", renderer.error().message.c_str());  // what is missing, and the package that brings it
    return 1;
  }
  relief::Frame frame;
  frame.camera = relief::framing(*model, 20, 15, 16.0 / 9);
  frame.width = 480;
  frame.height = 270;
  frame.samples = 16;
  frame.look.slab_wires = true;
  const auto picture = renderer->picture(*model, frame);
  if (!picture || !relief::save_png(*picture, "torus.png")) return 1;
  // end draw
  return 0;
}
