// The peer of frames: one vertex buffer and one draw for each slab, as renderers of meshes have it.
#pragma once

#include <relief/render/frame.h>

#include <cstdint>
#include <memory>
#include <span>

namespace relief::bench {

/// Positions and normals as floats and the same hollows, 28 bytes a vertex; indices of 16 bits, each slab its own.
/// Everything else is as in frames: the same light at every pixel, target, read-back and background.
class ClassicRenderer {
 public:
  /// Error: Io.
  static Result<ClassicRenderer> create(const Snapshot& model);
  ClassicRenderer(ClassicRenderer&&) noexcept;
  ClassicRenderer& operator=(ClassicRenderer&&) noexcept;
  ~ClassicRenderer();

  /// Draws all of it. Error: Io.
  Status draw(const Frame& frame, std::span<std::uint32_t> pixels);
  /// Of vertices and indices.
  [[nodiscard]] std::uint64_t gpu_bytes() const noexcept;

 private:
  struct State;
  explicit ClassicRenderer(std::unique_ptr<State> state) noexcept;
  std::unique_ptr<State> state_;
};

}  // namespace relief::bench
