// Where the eye and the lights stand: pure arithmetic, no OpenGL.
#pragma once

#include "picture.h"

#include <relief/base/vec.h>

#include <array>
#include <vector>

namespace relief::detail {

/// Column-major, as OpenGL takes it.
using Matrix = std::array<float, 16>;

/// The camera's axes and lens; positions relative to the display cache's centre.
struct Eye {
  Vec3d at, right, up, forward;  ///< unit, orthogonal
  double tan_x = 1, tan_y = 1;   ///< half the picture at distance 1; at every distance for a parallel one
  double near = 0.1, far = 10;   ///< along `forward`; a parallel one also sees what lies behind `at`
  bool parallel = false;
};
/// Returns an eye whose depth range just holds the box (relative to centre, as the eye).
[[nodiscard]] Eye make_eye(const Camera& camera, Vec3d centre, double aspect, const Box3d& seen);

/// The part of the picture between (x0, y0) and (x1, y1), in shares of its width and height from the lower left corner.
struct Part {
  double x0 = 0, y0 = 0, x1 = 1, y1 = 1;
};
[[nodiscard]] Matrix projection(const Eye& eye, const Part& part);

/// One parallel light. An unshadowed surface that faces it reflects albedo * colour.
struct Light {
  Vec3d towards;  ///< unit, from the surface to the light
  Vec3f colour;
  bool soft_box;  ///< else of the sky
  double apart;   ///< angle to its neighbours, radians
};
/// The studio: a warm soft box to the left of the eye, a cool fill to its right, a rim from behind and a sky, cut into
/// `count` parallel lights; what they leave out when they are few is in the ambient.
struct Studio {
  std::vector<Light> lights;
  Vec3f sky, ground;  ///< unshadowed, for surfaces that face up or down
};
[[nodiscard]] Studio make_studio(int count, const Eye& eye, Vec3d up);

/// Axes of the floor: up, and two directions in it.
struct FloorAxes {
  Vec3d right, up, back;
};
/// right points to the eye's right, back towards the eye.
[[nodiscard]] FloorAxes floor_axes(const Eye& eye, Vec3d up);

/// Parallel projection along a light that just holds the box: rows of a 3x4 matrix that gives (u, v, depth) in 0..1.
struct ShadowView {
  std::array<std::array<float, 4>, 3> rows;
  float texel = 0;  ///< edge length of a shadow texel, model units
  float depth = 1;  ///< model units from depth 0 to depth 1
};
[[nodiscard]] ShadowView make_shadow_view(Vec3d towards, const Box3d& box, int resolution);

}  // namespace relief::detail
