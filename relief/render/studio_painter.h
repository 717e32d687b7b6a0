// Pictures in studio light: many parallel lights with shadows, a floor, the hand.
#pragma once

#include "display_cache.h"
#include "frame.h"

#include <memory>

namespace relief::detail {

struct StudioSettings {
  int width = 1280, height = 720;
  int level = 0;        ///< every 2^level-th sample, as far as each n has it
  int supersample = 2;  ///< edge length of the sub-pixel grid, 1..4
  int lights = 64;      ///< 1..256; soft shadow, occlusion and diffuse light in one
  bool slab_wires = false, ground = true, cavity = true, colours = true, mask = true;
  Look::Map map = Look::Map::None;
  double map_low = 0, map_high = 1, micro_area = 1;
  GLuint map_texture = 0;
  Vec3f base_colour = {0.72F, 0.66F, 0.60F};  ///< sRGB, where the model has no colour layer
  std::optional<HandOverlay> hand = std::nullopt;
  const std::atomic<bool>* cancel = nullptr;  ///< asked between lights and parts
};

/// Draws what a display cache holds; the context is current at each call, and when this goes away.
class StudioPainter {
 public:
  /// The cache must outlive it. Error: Io.
  [[nodiscard]] static Result<StudioPainter> create(DisplayCache& cache);
  StudioPainter(StudioPainter&&) noexcept;
  StudioPainter& operator=(StudioPainter&&) noexcept;
  ~StudioPainter();

  /// Camera and settings must have been checked. Errors: Io; Cancelled, about 0.2 s after `settings.cancel` became
  /// true, and it can draw again.
  [[nodiscard]] Result<Picture> draw(const Camera& camera, const StudioSettings& settings);
  /// In one geometry pass of the last picture.
  [[nodiscard]] std::uint64_t triangles() const noexcept;

 private:
  struct Passes;
  explicit StudioPainter(std::unique_ptr<Passes> passes) noexcept;
  std::unique_ptr<Passes> passes_;
};

}  // namespace relief::detail
