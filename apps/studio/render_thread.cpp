#include "render_thread.h"

#include <cstring>
#include <utility>

namespace relief::studio {

RenderThread::RenderThread(Callbacks callbacks) : callbacks_(std::move(callbacks)), thread_([this] { run(); }) {}

RenderThread::~RenderThread() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
    cancel_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void RenderThread::request(DrawRequest request) {
  {
    const std::lock_guard lock(mutex_);
    if (next_) {
      if (next_->input_ns != 0) request.input_ns = next_->input_ns;
      request.everything = request.everything || next_->everything;
    }
    next_ = std::move(request);
    if (refining_) cancel_ = true;
  }
  wake_.notify_one();
}

void RenderThread::run() {
  auto renderer = FrameRenderer::create();
  if (!renderer) {
    callbacks_.failed(renderer.error());
    return;
  }
  callbacks_.ready(renderer->device(), renderer->software());
  while (true) {
    DrawRequest request;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return stop_ || next_; });
      if (stop_) return;
      request = *std::exchange(next_, std::nullopt);
      refining_ = request.stage != Stage::Quick;
      cancel_ = false;
    }
    draw(*renderer, request);
    const std::lock_guard lock(mutex_);
    refining_ = false;
  }
}

void RenderThread::draw(FrameRenderer& renderer, const DrawRequest& request) {
  const Frame& frame = request.frame;
  const auto stride = static_cast<std::size_t>(frame.width);
  bool everything = request.everything;
  if (frame.width != width_ || frame.height != height_) {
    width_ = frame.width;
    height_ = frame.height;
    pixels_.assign(stride * static_cast<std::size_t>(frame.height), 0);
    everything = true;
  }
  const Scene& scene = request.scene;
  Result<PixelRect> drawn = PixelRect{};
  if (scene.model) {
    drawn = renderer.draw(*scene.model, frame, pixels_, frame.width, &cancel_, everything);
  } else if (scene.mesh) {
    everything = everything || drawn_.lock() != scene.mesh;
    drawn_ = scene.mesh;
    drawn = renderer.draw({scene.mesh->positions, scene.mesh->triangles, scene.mesh->colours}, frame, pixels_,
                          frame.width, &cancel_, everything);
  }
  Piece piece;
  piece.frame = frame;
  piece.stage = request.stage;
  piece.revision = scene.model ? scene.model->number() : 0;
  piece.cage = scene.model ? scene.model->slab_mesh().roots_number() : 0;
  piece.input_ns = request.input_ns;
  if (!drawn) {
    if (drawn.error().code != Errc::Cancelled) callbacks_.failed(drawn.error());
    piece.given_up = true;
    callbacks_.drawn(std::move(piece));
    return;
  }
  const PixelRect& r = piece.rect = *drawn;
  if (r.width > 0 && r.height > 0) {
    piece.image = QImage(r.width, r.height, QImage::Format_RGB32);
    for (int y = 0; y < r.height; ++y)
      std::memcpy(piece.image.scanLine(y),
                  pixels_.data() + static_cast<std::size_t>(r.y + y) * stride + static_cast<std::size_t>(r.x),
                  static_cast<std::size_t>(r.width) * 4);
  }
  const FrameStats& stats = renderer.stats();
  piece.full = stats.everything;
  piece.cpu_ms = 1e3 * stats.cpu_seconds;
  piece.wall_ms = 1e3 * stats.wall_seconds;
  piece.triangles = stats.triangles;
  callbacks_.drawn(std::move(piece));
}

}  // namespace relief::studio
