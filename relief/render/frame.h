// Frames for a window: a snapshot, or the rectangle of it that changed, into the caller's pixels.
#pragma once

#include <relief/render/picture.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace relief {

/// Holds what the surface looks like. The studio and `relief render` fill it from these defaults.
struct Look {
  /// Matcap: light by the direction that the surface faces, for sculpting. Studio: many lights with shadows, which
  /// darken hollows too; a frame of it takes seconds, and is always drawn whole.
  enum class Light : std::uint8_t { Matcap, Studio };
  /// What colour shows instead of the surface's own, with a legend. Displacement: height above the middle of the fibre,
  /// a length. Depth: how much clay is left to the nearer end of the fibre, a length. Slabs: one colour each. Stretch:
  /// the area of a micro-triangle against the model's mean.
  enum class Map : std::uint8_t { None, Displacement, Depth, Slabs, Stretch };
  Light light = Light::Matcap;                ///< how it is lit
  int matcap = 0;                             ///< into matcaps()
  bool cavity = true;                         ///< hollows darker, ridges lighter
  bool colours = true;                        ///< the colour layer, where the model has one
  bool slab_wires = false;                    ///< edges of the roots, and fainter those of cuts
  bool mask = true;                           ///< the mask layer darkens
  Map map = Map::None;                        ///< which values are shown as colours
  bool legend = true;                         ///< of the map
  int legend_left = 0;                        ///< pixels beside the picture's left edge that the legend leaves free
  double mm_per_unit = 0;                     ///< of the legend's lengths; 0: they are told in model units
  Vec3f base_colour = {0.74F, 0.67F, 0.60F};  ///< sRGB; of matcap 0 and of the studio light without a colour layer
  int lights = 64;                            ///< of the studio light, 1 to 256
  bool ground = true;                         ///< of the studio light: floor and backdrop instead of the gradient
  /// background, sRGB
  Vec3f top = {0.205F, 0.220F, 0.244F}, bottom = {0.110F, 0.120F, 0.134F};
  friend bool operator==(const Look&, const Look&) = default;
};

/// Returns the names of the sculpting lights: "clay", "red wax", ...
[[nodiscard]] std::span<const std::string_view> matcaps() noexcept;

/// Pixels from the upper left corner.
struct PixelRect {
  /// its corner at the top left and its size, pixels
  int x = 0, y = 0, width = 0, height = 0;
  /// Returns whether it holds no pixel.
  [[nodiscard]] constexpr bool empty() const noexcept { return width <= 0 || height <= 0; }
  friend bool operator==(const PixelRect&, const PixelRect&) = default;
};

/// One picture that is asked for.
struct Frame {
  Camera camera = {};  ///< from where
  /// pixels, 1 to 8192
  int width = 0, height = 0;
  double tau = 1;   ///< pixels: slabs show the coarsest level whose rows of samples are so near; 0: all samples
  int samples = 1;  ///< per pixel: 1 while something moves, 4, 9, or 16 for a final frame
  int level = 0;    ///< every 2^level-th sample at least, as far as each n has it
  Look look = {};   ///< how it looks
  std::optional<HandOverlay> hand = std::nullopt;  ///< only with Look::Light::Studio
  friend bool operator==(const Frame&, const Frame&) = default;
};

/// Triangles counter-clockwise seen from outside, numbers into `positions`; colours empty or one per position.
struct MeshView {
  std::span<const Vec3d> positions;                         ///< corners, model units
  std::span<const std::array<std::uint32_t, 3>> triangles;  ///< three corners each
  std::span<const Rgba8> colours = {};                      ///< one per corner, or none
};

/// Holds what the last frame cost.
struct FrameStats {
  std::uint64_t triangles = 0;       ///< given to the driver, over all samples of a pixel
  std::uint32_t slabs_drawn = 0;     ///< in one pass
  std::uint32_t slabs_culled = 0;    ///< left out as they cannot be seen or do not touch the rectangle
  std::uint64_t tiles_uploaded = 0;  ///< tiles that went to the graphics card
  std::uint64_t gpu_bytes = 0;       ///< vertex, index, colour and record buffers of the model; not the pictures
  double cpu_seconds = 0;            ///< of the process
  double wall_seconds = 0;           ///< s, of the frame
  PixelRect drawn;                   ///< what was drawn again
  bool everything = false;           ///< the whole picture, not a rectangle of it
};

/// Returns the ray through a place of the picture, in pixels from its upper left corner (the middle of the first pixel
/// is
/// 0.5, 0.5): from the eye, or from the eye's plane for a parallel camera; the direction is unit.
[[nodiscard]] Ray3d pixel_ray(const Camera& camera, int width, int height, double x, double y);

/// Draws frames in an OpenGL 4.5 context. It and every call belong to the thread that made it.
class FrameRenderer {
 public:
  /// With a context of its own, which needs no screen. Error: Io, saying what is missing and which package brings it.
  [[nodiscard]] static Result<FrameRenderer> create();
  /// In the context that is current, here and at each call and when this goes away. Changes its state: bindings,
  /// viewport, tests, pixel store. Error: Io, when it is not OpenGL 4.5 or none is current.
  [[nodiscard]] static Result<FrameRenderer> adopt();
  /// Takes over; the other one may only be destroyed or assigned to.
  FrameRenderer(FrameRenderer&&) noexcept;
  /// Takes over; the other one may only be destroyed or assigned to.
  FrameRenderer& operator=(FrameRenderer&&) noexcept;
  ~FrameRenderer();

  /// Draws what differs from the last picture: everything when the frame differs in anything, when the box of the
  /// slabs, most of them or the range of a map do, or when `everything` says so; else the rectangle that holds what
  /// changed between the snapshots, slabs that were cut, put together again or moved among it. Both give the same bits.
  /// `pixels` must hold the last picture; only the rectangle returned is written, an empty one when nothing differs.
  /// Words are 0xffRRGGBB, rows from the top, `stride` words apart. Errors: InvalidArgument; Io; Cancelled within about
  /// 20 ms of `cancel` becoming true (a light of Look::Light::Studio may take longer), after which the next call draws
  /// everything.
  [[nodiscard]] Result<PixelRect> draw(const Snapshot& model, const Frame& frame, std::span<std::uint32_t> pixels,
                                       int stride, const std::atomic<bool>* cancel = nullptr, bool everything = false);
  /// Returns the same for plain triangles, smooth up to edges of 30 degrees. They are uploaded when the spans differ
  /// from the last ones given; who changes what they point to says `everything`.
  [[nodiscard]] Result<PixelRect> draw(const MeshView& mesh, const Frame& frame, std::span<std::uint32_t> pixels,
                                       int stride, const std::atomic<bool>* cancel = nullptr, bool everything = false);
  /// Into the colour of a framebuffer of the context in use, whose lower left width x height pixels become those of
  /// draw(); always all of them.
  [[nodiscard]] Status draw_to(const Snapshot& model, const Frame& frame, unsigned framebuffer,
                               const std::atomic<bool>* cancel = nullptr);

  /// draw() into a picture of its own.
  [[nodiscard]] Result<Picture> picture(const Snapshot& model, const Frame& frame,
                                        const std::atomic<bool>* cancel = nullptr);
  /// Returns a mesh as a picture. Errors: Io, InvalidArgument.
  [[nodiscard]] Result<Picture> picture(const MeshView& mesh, const Frame& frame,
                                        const std::atomic<bool>* cancel = nullptr);

  /// Signed coverage per pixel: front faces +1, back faces -1, no depth test; 0 everywhere on a closed model without
  /// cracks. The count of pixels covered, and of those that differ from 0.
  struct Coverage {
    /// pixels that the surface covers, and those among them through which the background shows
    std::uint64_t covered = 0, cracks = 0;
  };
  /// Counts the pixels of a frame. Errors: Io.
  [[nodiscard]] Result<Coverage> coverage(const Snapshot& model, const Frame& frame);

  /// Returns the surface point seen at a pixel of the last picture, at one of its samples, to about 1e-6 of the model's
  /// depth; empty beside the model, and after a frame of Look::Light::Studio.
  [[nodiscard]] std::optional<Vec3d> pick(double x, double y) const;

  /// Of the last frame.
  [[nodiscard]] const FrameStats& stats() const noexcept;
  /// "llvmpipe (LLVM ...), OpenGL 4.5 ..."
  [[nodiscard]] const std::string& device() const noexcept;
  /// Returns whether the driver draws with the CPU.
  [[nodiscard]] bool software() const noexcept;

 private:
  struct State;
  explicit FrameRenderer(std::unique_ptr<State> state) noexcept;
  std::unique_ptr<State> state_;
};

}  // namespace relief
