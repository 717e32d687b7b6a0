// Pictures as tests look at them.
#pragma once

#include "support/shells.h"

#include <relief/core/query.h>
#include <relief/render/frame.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <numbers>
#include <utility>
#include <vector>

namespace relief::testing {

/// A picture in studio light, as most cases ask for one.
struct DrawSettings {
  int width = 320, height = 180;
  int level = 0;
  int supersample = 2;
  int lights = 6;
  bool slab_wires = false;
  Look::Map map = Look::Map::None;
  bool ground = false;
  Vec3f base_colour = {0.72F, 0.66F, 0.60F};
  std::optional<HandOverlay> hand = std::nullopt;
  const std::atomic<bool>* cancel = nullptr;

  [[nodiscard]] Frame frame(const Camera& camera) const {
    Frame f;
    f.camera = camera;
    f.width = width;
    f.height = height;
    f.tau = 0;
    f.level = level;
    f.samples = supersample * supersample;
    f.look.light = Look::Light::Studio;
    f.look.lights = lights;
    f.look.slab_wires = slab_wires;
    f.look.map = map;
    f.look.ground = ground;
    f.look.base_colour = base_colour;
    f.hand = hand;
    return f;
  }
};
inline DrawSettings small_settings() { return {}; }

inline FrameRenderer make_renderer() {
  Result<FrameRenderer> made = FrameRenderer::create();
  if (!made) {
    ADD_FAILURE() << made.error().message;
    std::abort();
  }
  return *std::move(made);
}
/// One renderer for all cases of the program: making one costs more than a small picture.
inline FrameRenderer& renderer() {
  static FrameRenderer made = make_renderer();
  return made;
}

/// The size of small_frame().
inline constexpr int kWidth = 320, kHeight = 180;
/// A frame as a window asks for one.
inline Frame small_frame(const Camera& camera) {
  Frame frame;
  frame.camera = camera;
  frame.width = kWidth;
  frame.height = kHeight;
  return frame;
}
/// The pixels of a small frame, row by row.
using Words = std::vector<std::uint32_t>;

inline PixelRect shrunk(PixelRect r, int by) { return {r.x + by, r.y + by, r.width - 2 * by, r.height - 2 * by}; }
/// The old picture with a rectangle of the new one.
inline Words pasted(Words old, const Words& now, const PixelRect& r) {
  for (int y = r.y; y < r.y + r.height; ++y)
    for (int x = r.x; x < r.x + r.width; ++x) {
      const std::size_t k = static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(x);
      old[k] = now[k];
    }
  return old;
}

inline Result<Picture> try_draw(FrameRenderer& with, const Snapshot& model, const Camera& camera,
                                const DrawSettings& settings) {
  return with.picture(model, settings.frame(camera), settings.cancel);
}
inline Picture draw(const Snapshot& model, const Camera& camera, const DrawSettings& settings) {
  auto picture = try_draw(renderer(), model, camera, settings);
  if (!picture) {
    ADD_FAILURE() << picture.error().message;
    return Picture{1, 1, {0, 0, 0}};
  }
  return *std::move(picture);
}

using Pixel = std::array<int, 3>;
inline Pixel pixel(const Picture& p, int x, int y) {
  x = std::clamp(x, 0, p.width - 1);
  y = std::clamp(y, 0, p.height - 1);
  const std::uint8_t* at =
      p.rgb.data() +
      (static_cast<std::size_t>(y) * static_cast<std::size_t>(p.width) + static_cast<std::size_t>(x)) * 3;
  return {at[0], at[1], at[2]};
}
/// The largest difference of a channel.
inline int difference(Pixel a, Pixel b) {
  return std::max({std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2])});
}

/// Peak signal to noise ratio in decibel; 99 for equal pictures.
inline double psnr(const Picture& a, const Picture& b) {
  if (a.rgb.size() != b.rgb.size()) return 0;
  double sum = 0;
  for (std::size_t k = 0; k < a.rgb.size(); ++k) {
    const double d = double{static_cast<double>(a.rgb[k])} - static_cast<double>(b.rgb[k]);
    sum += d * d;
  }
  return sum == 0 ? 99 : 10 * std::log10(255.0 * 255.0 * static_cast<double>(a.rgb.size()) / sum);
}

/// Where a point appears, in pixels from the upper left corner; written apart from the renderer's own arithmetic.
struct Place {
  double x, y;
};
inline Place project(const Camera& camera, int width, int height, Vec3d p) {
  const Vec3d forward = normalized(camera.target - camera.eye), right = normalized(cross(forward, camera.up)),
              up = cross(right, forward), d = p - camera.eye;
  const double focal = 0.5 * height / std::tan(camera.field_of_view * std::numbers::pi / 360), away = dot(d, forward);
  return {0.5 * width + focal * dot(d, right) / away, 0.5 * height - focal * dot(d, up) / away};
}
inline Pixel pixel_at(const Picture& p, const Camera& camera, Vec3d point) {
  const Place at = project(camera, p.width, p.height, point);
  return pixel(p, static_cast<int>(std::floor(at.x)), static_cast<int>(std::floor(at.y)));
}

/// A ball of radius 1 to the precision of float, in a shell from 0.8 to 1.2, with `bump(direction)` added to its
/// radius.
template <typename Bump>
SnapshotPtr ball(int levels, int n, Bump&& bump, Vec3d centre = {}) {
  return displaced(sphere_shell(levels, n, 0.8, 1.2, centre), [&](Vec3d p) {
    const Vec3d q = p - centre;
    return std::clamp(((1 + bump(normalized(q))) / length(q) - 0.8) / 0.4, 0.0, 1.0);
  });
}
inline SnapshotPtr ball(int levels = 2, int n = 16, Vec3d centre = {}) {
  return ball(levels, n, [](Vec3d) { return 0.0; }, centre);
}

/// The model with colours that depend on the place, on a grid of m intervals.
template <typename Colour>
SnapshotPtr coloured(const SnapshotPtr& model, int m, Colour&& colour) {
  SnapshotDraft draft(model);
  draft.add_layer(Layer::Colour, m, 0.5F);
  const SlabMesh& mesh = model->slab_mesh();
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    Tile& tile = draft.edit(Layer::Colour, s);
    for (int j = 0; j <= m; ++j)
      for (int i = 0; i + j <= m; ++i) {
        const Vec3f c = colour(sample_position(mesh, s, m, {i, j}, 0.5));
        for (int k = 0; k < 3; ++k) tile.set(k, sample_index(m, {i, j}), c[static_cast<std::size_t>(k)]);
      }
  }
  return draft.finish();
}

inline Camera front(double aspect = 16.0 / 9.0, double azimuth = 0, double elevation = 0) {
  return framing({{-1, -1, -1}, {1, 1, 1}}, azimuth, elevation, aspect);
}

}  // namespace relief::testing
