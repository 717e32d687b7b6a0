// Draws what the viewport asks for, on a thread and in a context of its own.
#pragma once

#include <relief/core/snapshot.h>
#include <relief/mesh/triangle_mesh.h>
#include <relief/render/frame.h>

#include <QImage>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

namespace relief::studio {

/// What is to be seen: slabs, or the scan whose slabs are being made, or nothing.
struct Scene {
  SnapshotPtr model;
  std::shared_ptr<const TriangleMesh> mesh;
};

/// How good a picture is asked for: quick while something happens, then better, then as good as it gets.
enum class Stage : std::uint8_t { Quick, Better, Final };

struct DrawRequest {
  Scene scene;
  Stage stage = Stage::Quick;
  Frame frame;
  bool everything = false;  ///< a full redraw, whatever has changed
  qint64 input_ns = 0;      ///< when the oldest input that this picture answers came; 0: none
};

/// A part of the picture that was drawn anew.
struct Piece {
  QImage image;  ///< RGB32
  PixelRect rect;
  Stage stage = Stage::Quick;
  Frame frame;
  std::uint64_t revision = 0;  ///< number of the snapshot
  std::uint64_t cage = 0;      ///< that of its slabs, cuts apart
  bool full = false;           ///< all was drawn, whether or not all had changed
  bool given_up = false;       ///< another request came first: nothing was drawn
  double cpu_ms = 0;           ///< of the process
  double wall_ms = 0;
  std::uint64_t triangles = 0;
  qint64 input_ns = 0;
};

/// Of several requests that wait only the newest is drawn, with the oldest input time. One that refines a still picture
/// is given up as soon as another comes. Callbacks run on the render thread.
class RenderThread {
 public:
  struct Callbacks {
    std::function<void(Piece)> drawn;          ///< once per request that was begun; empty where nothing differed
    std::function<void(const Error&)> failed;  ///< to make the renderer, or to draw; the thread goes on
    std::function<void(const std::string&, bool software)> ready;  ///< the driver's name, before the first picture
  };
  explicit RenderThread(Callbacks callbacks);
  RenderThread(const RenderThread&) = delete;
  RenderThread& operator=(const RenderThread&) = delete;
  ~RenderThread();

  /// Any thread.
  void request(DrawRequest request);

 private:
  void run();
  void draw(FrameRenderer& renderer, const DrawRequest& request);

  Callbacks callbacks_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::optional<DrawRequest> next_;
  bool refining_ = false, stop_ = false;
  std::atomic<bool> cancel_{false};
  std::vector<std::uint32_t> pixels_;
  std::weak_ptr<const TriangleMesh> drawn_;  ///< the renderer knows meshes by their address, which another may get
  int width_ = 0, height_ = 0;
  std::thread thread_;
};

}  // namespace relief::studio
