// Pictures of a model, drawn with OpenGL 4.5, without a screen.
#pragma once

#include <relief/base/error.h>
#include <relief/core/snapshot.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace relief {

/// A perspective camera, or a parallel one; right-handed, y up unless `up` says otherwise. Model units, degrees.
struct Camera {
  Vec3d eye = {0, 0, 1};
  Vec3d target;
  Vec3d up = {0, 1, 0};
  double field_of_view = 30;  ///< vertical
  bool parallel = false;      ///< all rays along target - eye, also those that start behind the surface
  double view_height = 1;     ///< model units from the lower to the upper edge of a parallel picture
  friend bool operator==(const Camera&, const Camera&) = default;
};
/// A camera that sees the whole box: looking from the given azimuth (0 from +z, 90 from +x) and elevation.
[[nodiscard]] Camera framing(const Box3d& box, double azimuth, double elevation, double aspect, Vec3d up = {0, 1, 0});
/// The same, fitted to the displaced surface itself, which then fills the picture's height or width but for 8 %.
/// Looks at every 4th sample; O(samples), so keep the camera while the model is worked on.
[[nodiscard]] Camera framing(const Snapshot& model, double azimuth, double elevation, double aspect,
                             Vec3d up = {0, 1, 0});

/// A camera that looks at a point, with `width` model units, more than 0, from one side of the picture to the other at
/// the point's distance. Its eye is outside the box, so that nothing is cut away: where the usual field of view would
/// have it inside, the field of view is narrower.
[[nodiscard]] Camera looking_at(Vec3d point, double width, const Box3d& box, double azimuth, double elevation,
                                double aspect, Vec3d up = {0, 1, 0});

/// The box of the displaced surface, tighter than that of the slabs; O(samples).
[[nodiscard]] Box3d surface_bounds(const Snapshot& model);

/// An 8-bit sRGB picture, rows from the top.
struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};
/// Errors: Io; Cancelled at once when `cancel` became true, and no file is left.
[[nodiscard]] Status save_png(const Picture& picture, const std::filesystem::path& file,
                              const std::atomic<bool>* cancel = nullptr);

/// The hand as the picture shows it; lengths in model units.
struct HandOverlay {
  Vec3d cursor;
  Vec3d contact_point;
  Vec3d force;  ///< N
  double tool_radius = 0;
  bool contact = false;
  friend bool operator==(const HandOverlay&, const HandOverlay&) = default;
};

struct DrawSettings {
  int width = 1280, height = 720;
  int level = 0;        ///< level of detail: every 2^level-th sample, limited to what each n has
  int supersample = 2;  ///< edge length of the sub-pixel grid, 1..4
  int lights = 64;      ///< shadow-mapped environment lights, 1..256; soft shadow, occlusion and diffuse light in one
  bool slab_wires = false;
  bool heat_map = false;                      ///< displacement as colour, with a legend
  bool ground = true;                         ///< soft floor and background
  Vec3f base_colour = {0.72F, 0.66F, 0.60F};  ///< sRGB, where the model has no colour layer
  std::optional<HandOverlay> hand = std::nullopt;
  const std::atomic<bool>* cancel = nullptr;  ///< asked between lights and parts; draw() then returns Errc::Cancelled
};

/// What the last draw() cost.
struct DrawStats {
  std::uint64_t triangles = 0;  ///< drawn in one geometry pass
  double cpu_seconds = 0;       ///< of the process
  double wall_seconds = 0;
  std::uint64_t tiles_uploaded = 0;
};

/// Owns an EGL context without a surface; used from the thread that made it. Keeps a display cache of tiles and uploads
/// only those that differ from the last snapshot drawn.
class Renderer {
 public:
  /// Error: Io, saying what of EGL or OpenGL 4.5 is missing and which package brings it.
  [[nodiscard]] static Result<Renderer> create();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;
  ~Renderer();

  /// Full quality. Errors: InvalidArgument, Io; Cancelled, about 0.2 s after `settings.cancel` became true, and the
  /// renderer can draw again.
  [[nodiscard]] Result<Picture> draw(const Snapshot& model, const Camera& camera, const DrawSettings& settings);
  /// One quick frame for interactive use: the same geometry in one pass, one light with a shadow, no supersampling;
  /// `lights` and `supersample` have no effect. Where triangles are few pixels large, light and colour are found at
  /// their corners.
  [[nodiscard]] Result<Picture> draw_quick(const Snapshot& model, const Camera& camera, const DrawSettings& settings);
  /// Signed coverage per pixel: front faces +1, back faces -1, depth test off; 0 everywhere on a closed model without
  /// cracks. The count of pixels that differ from 0, and of pixels covered.
  struct Coverage {
    std::uint64_t covered = 0, cracks = 0;
  };
  [[nodiscard]] Result<Coverage> coverage(const Snapshot& model, const Camera& camera, const DrawSettings& settings);

  [[nodiscard]] const DrawStats& stats() const noexcept;
  /// "llvmpipe (LLVM ...), OpenGL 4.5 ..."
  [[nodiscard]] const std::string& device() const noexcept;

 private:
  struct State;
  explicit Renderer(std::unique_ptr<State> state) noexcept;
  std::unique_ptr<State> state_;
};

}  // namespace relief
