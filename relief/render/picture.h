// Cameras, and pictures as files.
#pragma once

#include <relief/base/error.h>
#include <relief/core/snapshot.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace relief {

/// A perspective camera, or a parallel one; right-handed, y up unless `up` says otherwise. Model units, degrees.
struct Camera {
  Vec3d eye = {0, 0, 1};      ///< where it stands, model units
  Vec3d target;               ///< what it looks at, model units
  Vec3d up = {0, 1, 0};       ///< what is up in the picture
  double field_of_view = 30;  ///< vertical
  bool parallel = false;      ///< all rays along target - eye, also those that start behind the surface
  double view_height = 1;     ///< model units from the lower to the upper edge of a parallel picture
  friend bool operator==(const Camera&, const Camera&) = default;
};
/// Returns a camera that sees the whole box: looking from the given azimuth (0 from +z, 90 from +x) and elevation.
[[nodiscard]] Camera framing(const Box3d& box, double azimuth, double elevation, double aspect, Vec3d up = {0, 1, 0});
/// Returns the same, fitted to the displaced surface itself, which then fills the picture's height or width except for
/// 8 %. Looks at every 4th sample; O(samples), so keep the camera while the model is worked on.
[[nodiscard]] Camera framing(const Snapshot& model, double azimuth, double elevation, double aspect,
                             Vec3d up = {0, 1, 0});

/// Returns a camera that looks at a point, with `width` model units, more than 0, from one side of the picture to the
/// other at the point's distance. Its eye is outside the box, so that nothing is cut away: where the usual field of
/// view would have it inside, the field of view is narrower.
[[nodiscard]] Camera looking_at(Vec3d point, double width, const Box3d& box, double azimuth, double elevation,
                                double aspect, Vec3d up = {0, 1, 0});

/// Returns the box of the displaced surface, tighter than that of the slabs; O(samples).
[[nodiscard]] Box3d surface_bounds(const Snapshot& model);

/// An 8-bit sRGB picture, rows from the top.
struct Picture {
  /// pixels
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  ///< three bytes per pixel, sRGB, from the top left
};
/// Errors: Io; Cancelled at once when `cancel` became true, and no file is left.
[[nodiscard]] Status save_png(const Picture& picture, const std::filesystem::path& file,
                              const std::atomic<bool>* cancel = nullptr);

/// The hand as the picture shows it; lengths in model units.
struct HandOverlay {
  Vec3d cursor;            ///< the hand's place, model units
  Vec3d contact_point;     ///< the contact point, model units
  Vec3d force;             ///< N
  double tool_radius = 0;  ///< radius of a ball, model units; 0 for a point
  bool contact = false;    ///< whether it touches
  friend bool operator==(const HandOverlay&, const HandOverlay&) = default;
};

}  // namespace relief
