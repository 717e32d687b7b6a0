#include "renderer.h"

#include "display_cache.h"
#include "gl_context.h"
#include "overlay.h"
#include "shaders.h"
#include "studio.h"

#include <relief/base/assert.h>
#include <relief/base/cpu_time.h>
#include <relief/base/try.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <numbers>
#include <string>

namespace relief {

using namespace detail;

namespace {

constexpr int kMaxEdge = 8192;
/// Sub-pixels held at once; larger pictures are drawn in parts, so that memory stays below 300 MB.
constexpr std::int64_t kPartSubPixels = 9'000'000;
constexpr int kPartEdge = 8192;
constexpr int kShadowEdge = 1024;
/// Texels along the floor map's edge.
constexpr int kFloorEdge = 320;
/// Edge of the square over which a pixel asks for shadow, in shadow texels.
constexpr double kShadowSpread = 4;
/// Half the floor's edge that receives shadows, in half diagonals of the model.
constexpr double kFloorReach = 2.6;
/// Above this the shadow maps are drawn a level coarser: a triangle is then far smaller than a shadow texel.
constexpr std::uint64_t kShadowTriangles = 1'500'000;
/// The same of a quick frame, chosen so that all of it together costs less than the surface.
constexpr int kQuickShadowEdge = 512, kQuickFloorEdge = 96, kQuickBackdropShare = 4;
constexpr double kQuickFloorReach = 1.9;
constexpr std::uint64_t kQuickShadowTriangles = 60'000;
/// Triangles of fewer pixels than this, as Renderer::State::quick_surface() reckons them, are lit at their corners.
constexpr double kQuickSmall = 64;
/// Sub-pixels lit between two questions whether the picture is cancelled: about 0.05 s on a software driver.
constexpr int kStripSubPixels = 200'000;

/// The uniform block of a batch of lights.
struct BatchBlock {
  std::array<std::array<std::array<float, 4>, 3>, kBatch> rows;
  std::array<std::array<float, 4>, kBatch> towards, colour;
};

std::array<float, 4> with(Vec3f v, float w) { return {v.x, v.y, v.z, w}; }

void set(GLuint program, GLint at, Vec3d v) {
  const Vec3f f = to_float(v);
  glProgramUniform3f(program, at, f.x, f.y, f.z);
}
void set(GLuint program, GLint at, Vec3f v) { glProgramUniform3f(program, at, v.x, v.y, v.z); }
void set(GLuint program, GLint at, const Matrix& m) { glProgramUniformMatrix4fv(program, at, 1, GL_FALSE, m.data()); }

Matrix shadow_matrix(const ShadowView& view) {
  Matrix m{};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 4; ++c) m[c * 4 + r] = 2 * view.rows[r][c] - (c == 3 ? 1.0F : 0.0F);
  m[15] = 1;
  return m;
}

Status check(const Camera& camera, const DrawSettings& settings) {
  const auto wrong = [](const std::string& text) { return fail(Errc::InvalidArgument, "cannot draw: " + text); };
  if (settings.width < 1 || settings.width > kMaxEdge || settings.height < 1 || settings.height > kMaxEdge)
    return wrong("the picture's width and height must be 1 to 8192 pixels, not " + std::to_string(settings.width) +
                 " x " + std::to_string(settings.height));
  if (settings.supersample < 1 || settings.supersample > 4) return wrong("supersample must be 1 to 4");
  if (settings.lights < 1 || settings.lights > 256) return wrong("the number of lights must be 1 to 256");
  if (settings.level < 0) return wrong("the level of detail must not be negative");
  if (!is_finite(camera.eye) || !is_finite(camera.target) || !is_finite(camera.up) || !(length(camera.up) > 0) ||
      !(length(camera.target - camera.eye) > 0))
    return wrong("the camera's eye and target must be finite and differ, and its up must have a length");
  if (!(camera.field_of_view >= 0.1 && camera.field_of_view <= 170))
    return wrong("the camera's field of view must be 0.1 to 170 degrees");
  if (settings.hand && (!is_finite(settings.hand->cursor) || !is_finite(settings.hand->contact_point) ||
                        !is_finite(settings.hand->force) || !std::isfinite(settings.hand->tool_radius)))
    return wrong("the hand's place and force must be finite");
  return {};
}

/// A rectangle of the picture in pixels from its lower left corner.
struct PixelPart {
  int x = 0, y = 0, width = 0, height = 0;
};

std::vector<PixelPart> parts_of(int width, int height, int supersample) {
  const int across = std::min(width, kPartEdge / supersample);
  const auto rows = static_cast<int>(kPartSubPixels / (std::int64_t{across} * supersample * supersample));
  const int down = std::clamp(rows, 1, std::min(height, kPartEdge / supersample));
  std::vector<PixelPart> parts;
  for (int y = 0; y < height; y += down)
    for (int x = 0; x < width; x += across)
      parts.push_back({x, y, std::min(across, width - x), std::min(down, height - y)});
  return parts;
}

/// A small picture that, stretched smoothly over a large one, lies behind it.
class Backdrop {
 public:
  /// `rgba` from the bottom, of the given size, at least 1 x 1.
  Backdrop(std::vector<std::uint8_t> rgba, int width, int height, const DrawSettings& settings)
      : rgba_(std::move(rgba)), width_(width), height_(height), over_height_(settings.height) {
    for (int x = 0; x < settings.width; ++x) columns_.push_back(place(x, width, settings.width));
    line_.resize(3 * static_cast<std::size_t>(width + 1));
  }

  /// Writes `count` pixels of RGB from `from`, RGBA with colours already weighted by their cover, which starts at
  /// pixel (x, y) from the lower left corner.
  void under(const std::uint8_t* from, std::uint8_t* to, int x, int y, int count) {
    const Place row = place(y, height_, over_height_);
    const std::size_t stride = 4 * static_cast<std::size_t>(width_), low = stride * row.at;
    const std::size_t high = row.at + 1 < static_cast<std::size_t>(height_) ? low + stride : low;
    for (std::size_t k = 0; k <= static_cast<std::size_t>(width_); ++k)
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t at = 4 * std::min(k, static_cast<std::size_t>(width_) - 1) + c;
        line_[3 * k + c] = rgba_[low + at] * (256 - row.beyond) + rgba_[high + at] * row.beyond;
      }
    for (int k = 0; k < count; ++k, from += 4, to += 3) {
      const int open = 255 - from[3];
      if (open == 0) {
        std::memcpy(to, from, 3);
        continue;
      }
      const Place column = columns_[static_cast<std::size_t>(x + k)];
      const int* behind = line_.data() + 3 * column.at;
      for (int c = 0; c < 3; ++c) {
        const int mixed = (behind[c] * (256 - column.beyond) + behind[c + 3] * column.beyond + (1 << 15)) >> 16;
        to[c] = static_cast<std::uint8_t>(open == 255 ? mixed : std::min(255, from[c] + (mixed * open + 127) / 255));
      }
    }
  }

 private:
  /// Between small pixels `at` and `at` + 1, 1/256 of the way.
  struct Place {
    std::size_t at;
    int beyond;
  };
  static Place place(int pixel, int small, int large) {
    const double middle = std::clamp((pixel + 0.5) * small / large - 0.5, 0.0, small - 1.0);
    return {static_cast<std::size_t>(middle), static_cast<int>((middle - std::floor(middle)) * 256)};
  }

  std::vector<std::uint8_t> rgba_;
  int width_, height_, over_height_;
  std::vector<Place> columns_;
  std::vector<int> line_;  ///< of the row being written, times 256; the last pixel twice
};

Status gl_status() {
  Status status;
  for (GLenum error = glGetError(); error != GL_NO_ERROR; error = glGetError())
    if (status)
      status =
          error == GL_OUT_OF_MEMORY
              ? fail(Errc::Io,
                     "cannot draw: the graphics driver is out of memory; draw a smaller picture or a coarser level")
              : fail(Errc::Io, "cannot draw: the graphics driver reports error " + std::to_string(error));
  return status;
}

}  // namespace

struct Renderer::State {
  /// What the model takes of the light on the floor.
  struct FloorMaps {
    int edge = 0;
    GlTexture taken, radii, light;
    GlFramebuffer taken_target, radii_target, light_target;
  };
  /// Everything that one part of the picture is drawn into.
  struct Targets {
    int width = 0, height = 0;  ///< sub-pixels
    GlTexture base, normal, distance, depth, light;
    GlFramebuffer surface, lit;
  };
  /// What a quick frame is drawn into.
  struct QuickTargets {
    int width = 0, height = 0;
    GlTexture colour, depth;
    GlFramebuffer frame;
  };
  /// What all parts of one picture share.
  struct Scene {
    Eye eye;
    FloorAxes floor;
    double floor_height = 0, floor_half = 1;
    Vec3d floor_middle;
    Studio studio;
    std::vector<ShadowView> shadows;
    Solids solids;
    std::array<float, 4> ring{};
    int shadow_level = 0;
    /// Empty when nobody can cancel the picture, which is then queued at once. Else waits until the driver has done
    /// what it was told, and says false from the first time that it sees the picture cancelled.
    std::function<bool()> go_on;
    [[nodiscard]] bool cancelled() const { return go_on && !go_on(); }
  };

  std::unique_ptr<GlContext> context;
  GlProgram surface, coverage, shadow, solid, solid_shadow, veil, ambient, light, floor, floor_blur, resolve;
  GlTexture shadow_maps;
  GlFramebuffer shadow_target;
  GlSampler compare_sampler, plain_sampler;
  GlBuffer batch, solid_vertices;
  GlVertexArray empty, solid_array;
  FloorMaps floor_maps;
  Targets targets;
  std::map<std::string, GlProgram, std::less<>> quick_surfaces;  ///< by the features compiled in
  GlProgram quick_solid, quick_veil, quick_floor, quick_backdrop;
  GlTexture quick_shadow_map, quick_floor_map;
  GlFramebuffer quick_shadow_target, quick_floor_target;
  QuickTargets quick, quick_behind;  ///< the frame; floor and backdrop, small
  std::vector<std::uint8_t> quick_rows;
  DisplayCache cache;
  DrawStats stats;

  Status set_up();
  Status size_targets(int width, int height);
  Scene make_scene(const Camera& camera, const DrawSettings& settings, int shadow_edge, std::uint64_t shadow_triangles);
  void load_solids(const Solids& solids);
  Status draw_part(const Scene& scene, const DrawSettings& settings, const PixelPart& part, bool first,
                   Picture& picture);
  void draw_surface(const Scene& scene, const DrawSettings& settings, const Matrix& view);
  void draw_shadows(const Scene& scene, std::size_t first, std::size_t count);
  void take_from_floor(const Scene& scene, const FloorMaps& maps, std::size_t first, std::size_t count);
  void blur_floor(const FloorMaps& maps);
  void draw_veils(GLuint program, const Scene& scene, const Matrix& view);
  void draw_solids(GLuint program, std::size_t first, std::size_t count);
  void full_screen(GLuint program) const;
  void full_screen_in_strips(GLuint program, const Scene& scene, int width, int height) const;
  static Status cancelled();
  void set_floor(GLuint program, const Scene& scene);
  Status set_up_quick();
  static Status size_quick(QuickTargets& targets, int width, int height);
  Result<GLuint> quick_surface(const Scene& scene, const DrawSettings& settings);
  void draw_quick_shadow(const Scene& scene);
  Result<Backdrop> draw_quick_backdrop(const Scene& scene, const DrawSettings& settings);
  Status draw_quick_part(const Scene& scene, const DrawSettings& settings, const PixelPart& part, Backdrop& backdrop,
                         Picture& picture);
  Result<Picture> draw_quick(const Snapshot& model, const Camera& camera, const DrawSettings& settings);
  Result<Picture> draw(const Snapshot& model, const Camera& camera, const DrawSettings& settings);
};

namespace {

GlTexture attached(GLuint framebuffer, GLenum attachment, GLenum format, int width, int height,
                   GLenum filter = GL_NEAREST) {
  GlTexture texture = make_texture(format, width, height, filter);
  glNamedFramebufferTexture(framebuffer, attachment, texture, 0);
  return texture;
}

Status complete(GLuint framebuffer) {
  if (glCheckNamedFramebufferStatus(framebuffer, GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return {};
  return fail(Errc::Io, "cannot draw: the graphics driver offers no picture of the kind needed; draw a smaller one");
}

/// The eye's ray to a sub-pixel is ray[0] + x ray[1] + y ray[2]; its length along the eye's axis is 1.
void set_rays(GLuint program, GLint at, const Eye& eye, const Part& part, int width, int height) {
  const Vec3d x = eye.right * (2 * eye.tan_x), y = eye.up * (2 * eye.tan_y);
  set(program, at, eye.forward + x * (part.x0 - 0.5) + y * (part.y0 - 0.5));
  set(program, at + 1, x * ((part.x1 - part.x0) / width));
  set(program, at + 2, y * ((part.y1 - part.y0) / height));
}

Part part_of(const PixelPart& p, const DrawSettings& settings) {
  return {double(p.x) / settings.width, double(p.y) / settings.height, double(p.x + p.width) / settings.width,
          double(p.y + p.height) / settings.height};
}

float luminance(Vec3f c) { return 0.2126F * c.x + 0.7152F * c.y + 0.0722F * c.z; }

}  // namespace

Status Renderer::State::set_up() {
  RELIEF_TRY(surface, make_program("surface", {kPlace, kSurfaceVertex}, {kSurfaceFragment}));
  RELIEF_TRY(coverage, make_program("coverage", {kPlace, kSurfaceVertex}, {kCoverageFragment}));
  RELIEF_TRY(shadow, make_program("shadow", {kPlace, kShadowVertex}, {}));
  RELIEF_TRY(solid, make_program("solid", {kSolidVertex}, {kSolidFragment}));
  RELIEF_TRY(solid_shadow, make_program("solid shadow", {kSolidVertex}, {}));
  RELIEF_TRY(veil, make_program("veil", {kSolidVertex}, {kVeilLight, kVeilFragment}));
  RELIEF_TRY(ambient, make_program("ambient", {kScreenVertex}, {kAmbientFragment}));
  RELIEF_TRY(light, make_program("light", {kScreenVertex}, {kLightFragment}));
  RELIEF_TRY(floor, make_program("floor", {kScreenVertex}, {kFloorFragment}));
  RELIEF_TRY(floor_blur, make_program("floor blur", {kScreenVertex}, {kFloorBlurFragment}));
  RELIEF_TRY(resolve, make_program("resolve", {kScreenVertex}, {kBackdrop, kResolveFragment}));

  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &name);
  shadow_maps = GlTexture(name);
  glTextureStorage3D(shadow_maps, 1, GL_DEPTH_COMPONENT32F, kShadowEdge, kShadowEdge, kBatch);
  shadow_target = make_framebuffer();
  glNamedFramebufferTextureLayer(shadow_target, GL_DEPTH_ATTACHMENT, shadow_maps, 0, 0);
  for (GlSampler* sampler : {&compare_sampler, &plain_sampler}) {
    glCreateSamplers(1, &name);
    *sampler = GlSampler(name);
    const bool compare = sampler == &compare_sampler;
    glSamplerParameteri(name, GL_TEXTURE_MIN_FILTER, compare ? GL_LINEAR : GL_NEAREST);
    glSamplerParameteri(name, GL_TEXTURE_MAG_FILTER, compare ? GL_LINEAR : GL_NEAREST);
    glSamplerParameteri(name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glSamplerParameteri(name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glSamplerParameteri(name, GL_TEXTURE_COMPARE_MODE, compare ? GL_COMPARE_REF_TO_TEXTURE : GL_NONE);
    glSamplerParameteri(name, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  }
  FloorMaps& maps = floor_maps;
  maps.edge = kFloorEdge;
  for (GlFramebuffer* target : {&maps.taken_target, &maps.radii_target, &maps.light_target})
    *target = make_framebuffer();
  maps.taken = attached(maps.taken_target, GL_COLOR_ATTACHMENT0, GL_RGBA32F, maps.edge, maps.edge, GL_LINEAR);
  maps.radii = attached(maps.radii_target, GL_COLOR_ATTACHMENT0, GL_RGBA16F, maps.edge, maps.edge, GL_LINEAR);
  maps.light = attached(maps.light_target, GL_COLOR_ATTACHMENT0, GL_RGBA16F, maps.edge, maps.edge, GL_LINEAR);
  RELIEF_CHECK(complete(maps.taken_target));
  RELIEF_CHECK(complete(maps.light_target));
  batch = make_buffer(sizeof(BatchBlock), nullptr, GL_DYNAMIC_STORAGE_BIT);
  empty = make_vertex_array();
  solid_array = make_vertex_array();
  for (GLuint k = 0; k < 3; ++k) {
    glEnableVertexArrayAttrib(solid_array, k);
    glVertexArrayAttribFormat(solid_array, k, 3, GL_FLOAT, GL_FALSE, k * static_cast<GLuint>(sizeof(Vec3f)));
    glVertexArrayAttribBinding(solid_array, k, 0);
  }
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glDisable(GL_DITHER);
  RELIEF_CHECK(complete(shadow_target));
  RELIEF_CHECK(set_up_quick());
  return gl_status();
}

Status Renderer::State::size_targets(int width, int height) {
  if (targets.width == width && targets.height == height) return {};
  targets = {};
  Targets t;
  t.surface = make_framebuffer();
  t.lit = make_framebuffer();
  t.base = attached(t.surface, GL_COLOR_ATTACHMENT0, GL_RGBA8, width, height);
  t.normal = attached(t.surface, GL_COLOR_ATTACHMENT1, GL_RG16, width, height);
  t.distance = attached(t.surface, GL_COLOR_ATTACHMENT2, GL_R32F, width, height);
  t.depth = attached(t.surface, GL_DEPTH_STENCIL_ATTACHMENT, GL_DEPTH24_STENCIL8, width, height);
  t.light = attached(t.lit, GL_COLOR_ATTACHMENT0, GL_RGBA16F, width, height);
  glNamedFramebufferTexture(t.lit, GL_DEPTH_STENCIL_ATTACHMENT, t.depth, 0);
  constexpr std::array<GLenum, 3> kAll = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1, GL_COLOR_ATTACHMENT2};
  glNamedFramebufferDrawBuffers(t.surface, static_cast<GLsizei>(kAll.size()), kAll.data());
  RELIEF_CHECK(gl_status());
  RELIEF_CHECK(complete(t.surface));
  RELIEF_CHECK(complete(t.lit));
  t.width = width;
  t.height = height;
  targets = std::move(t);
  return {};
}

Renderer::State::Scene Renderer::State::make_scene(const Camera& camera, const DrawSettings& settings, int shadow_edge,
                                                   std::uint64_t shadow_triangles) {
  Scene scene;
  const Vec3d centre = cache.centre();
  const double aspect = double(settings.width) / settings.height;
  Box3d seen = cache.bounds();
  scene.eye = make_eye(camera, centre, aspect, seen);
  if (settings.hand) {
    const HandOverlay& hand = *settings.hand;
    const double away = std::max(dot(hand.cursor - centre - scene.eye.at, scene.eye.forward), scene.eye.near);
    const double view_height = 2 * away * scene.eye.tan_y;
    scene.solids = make_solids(hand, centre, scene.eye, view_height);
    if (hand.contact)
      scene.ring = with(to_float(hand.contact_point - centre),
                        static_cast<float>(hand.tool_radius > 0 ? hand.tool_radius : 0.03 * view_height));
    seen.add(scene.solids.bounds);
    scene.eye = make_eye(camera, centre, aspect, seen);
  }
  scene.floor = floor_axes(scene.eye, camera.up);
  scene.floor_height = cache.lowest(scene.floor.up);
  const Vec3d middle = cache.bounds().centre();
  scene.floor_middle = middle + scene.floor.up * (scene.floor_height - dot(middle, scene.floor.up));
  scene.floor_half = kFloorReach * std::max(0.5 * diagonal(cache.bounds()), 1e-30);
  scene.studio = make_studio(settings.lights, scene.eye, camera.up);
  for (const Light& each : scene.studio.lights)
    scene.shadows.push_back(make_shadow_view(each.towards, seen, shadow_edge));
  while (cache.triangle_count(settings.level + scene.shadow_level) > shadow_triangles &&
         cache.triangle_count(settings.level + scene.shadow_level + 1) <
             cache.triangle_count(settings.level + scene.shadow_level))
    ++scene.shadow_level;
  scene.shadow_level += settings.level;
  return scene;
}

void Renderer::State::load_solids(const Solids& solids) {
  if (solids.opaque.empty()) return;
  std::vector<SolidVertex> all = solids.opaque;
  all.insert(all.end(), solids.translucent.begin(), solids.translucent.end());
  solid_vertices = make_buffer(all.size() * sizeof(SolidVertex), all.data());
  glVertexArrayVertexBuffer(solid_array, 0, solid_vertices, 0, sizeof(SolidVertex));
}

void Renderer::State::draw_solids(GLuint program, std::size_t first, std::size_t count) {
  if (count == 0) return;
  glUseProgram(program);
  glBindVertexArray(solid_array);
  glDrawArrays(GL_TRIANGLES, static_cast<GLint>(first), static_cast<GLsizei>(count));
}

void Renderer::State::full_screen(GLuint program) const {
  glUseProgram(program);
  glBindVertexArray(empty);
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

/// The same pixels, strip by strip where the picture may be cancelled; the rest is left out when it is.
void Renderer::State::full_screen_in_strips(GLuint program, const Scene& scene, int width, int height) const {
  if (!scene.go_on) return full_screen(program);
  const int rows = std::max(1, kStripSubPixels / width);
  glEnable(GL_SCISSOR_TEST);
  for (int y = 0; y < height && !scene.cancelled(); y += rows) {
    glScissor(0, y, width, std::min(rows, height - y));
    full_screen(program);
  }
  glDisable(GL_SCISSOR_TEST);
}

/// Leaves the context as a picture that is finished does.
Status Renderer::State::cancelled() {
  for (const GLenum each : {GL_BLEND, GL_CULL_FACE, GL_DEPTH_TEST, GL_STENCIL_TEST}) glDisable(each);
  glBindSampler(3, 0);
  return fail(Errc::Cancelled, "the picture was cancelled");
}

/// The surface and the solid overlays, without light. Stencil: 1 the model, 2 solids before it.
void Renderer::State::draw_surface(const Scene& scene, const DrawSettings& settings, const Matrix& view) {
  glBindFramebuffer(GL_FRAMEBUFFER, targets.surface);
  glViewport(0, 0, targets.width, targets.height);
  constexpr std::array<float, 4> kNothing{};
  for (GLint k = 0; k < 3; ++k) glClearNamedFramebufferfv(targets.surface, GL_COLOR, k, kNothing.data());
  glClearNamedFramebufferfi(targets.surface, GL_DEPTH_STENCIL, 0, 1.0F, 0);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glEnable(GL_STENCIL_TEST);
  glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
  glStencilFunc(GL_ALWAYS, 1, 0xff);
  if (cache.closed()) glEnable(GL_CULL_FACE);

  set(surface, 0, view);
  set(surface, 1, settings.base_colour);
  glProgramUniform4i(surface, 2, cache.has_colour() ? 1 : 0, settings.heat_map ? 1 : 0, settings.slab_wires ? 1 : 0,
                     cache.closed() ? 0 : 1);
  glProgramUniform4fv(surface, 3, 1, scene.ring.data());
  const float range = cache.max_alpha() - cache.min_alpha();
  glProgramUniform4f(
      surface, 4, cache.min_alpha(), range > 0 ? 1 / range : 0.0F,
      static_cast<float>(settings.supersample) * std::max(1.0F, static_cast<float>(settings.height) / 720.0F), 0);
  glProgramUniform3fv(surface, 5, static_cast<GLsizei>(kHeat.size()), &kHeat[0].x);
  glUseProgram(surface);
  stats.triangles = cache.draw(settings.level, scene.go_on);

  glEnable(GL_CULL_FACE);
  glStencilFunc(GL_ALWAYS, 2, 0xff);
  set(solid, 0, view);
  draw_solids(solid, 0, scene.solids.opaque.size());
  glDisable(GL_CULL_FACE);
  glDisable(GL_STENCIL_TEST);
  glDisable(GL_DEPTH_TEST);
}

void Renderer::State::draw_shadows(const Scene& scene, std::size_t first, std::size_t count) {
  BatchBlock block{};
  glBindFramebuffer(GL_FRAMEBUFFER, shadow_target);
  glViewport(0, 0, kShadowEdge, kShadowEdge);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(1.5F, 4.0F);
  if (cache.closed()) glEnable(GL_CULL_FACE);
  for (std::size_t k = 0; k < count && !scene.cancelled(); ++k) {
    const Light& each = scene.studio.lights[first + k];
    const ShadowView& view = scene.shadows[first + k];
    block.rows[k] = view.rows;
    block.towards[k] = with(to_float(each.towards), view.texel);
    block.colour[k] = with(each.colour, 0);
    glNamedFramebufferTextureLayer(shadow_target, GL_DEPTH_ATTACHMENT, shadow_maps, 0, static_cast<GLint>(k));
    constexpr float kFar = 1;
    glClearNamedFramebufferfv(shadow_target, GL_DEPTH, 0, &kFar);
    const Matrix matrix = shadow_matrix(view);
    set(shadow, 0, matrix);
    glUseProgram(shadow);
    cache.draw(scene.shadow_level, scene.go_on);
    set(solid_shadow, 0, matrix);
    draw_solids(solid_shadow, 0, scene.solids.opaque.size());
  }
  glDisable(GL_CULL_FACE);
  glDisable(GL_POLYGON_OFFSET_FILL);
  glDisable(GL_DEPTH_TEST);
  glNamedBufferSubData(batch, 0, sizeof(block), &block);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, batch);
}

void Renderer::State::take_from_floor(const Scene& scene, const FloorMaps& maps, std::size_t first, std::size_t count) {
  float total = 0;
  for (const Light& each : scene.studio.lights) {
    total += luminance(each.colour) * static_cast<float>(std::max(0.0, dot(each.towards, scene.floor.up)));
  }
  const double texel = 2 * scene.floor_half / maps.edge;
  std::array<std::array<float, 4>, kBatch> shares{};
  for (std::size_t k = 0; k < count; ++k) {
    const Light& each = scene.studio.lights[first + k];
    const auto above = static_cast<float>(std::max(0.0, dot(each.towards, scene.floor.up)));
    const float share = total > 0 ? luminance(each.colour) * above / total : 0;
    // Lights stand this far apart, so their shadows do at that distance from what casts them.
    const auto radius = static_cast<float>(each.apart * static_cast<double>(scene.shadows[first + k].depth) / texel);
    shares[k] = {each.soft_box ? share : 0, each.soft_box ? 0 : share, radius, 0};
  }
  const Vec3d right = scene.floor.right * texel, back = scene.floor.back * texel;
  set(floor, 0, scene.floor_middle - (right + back) * (0.5 * maps.edge));
  set(floor, 1, right);
  set(floor, 2, back);
  glProgramUniform4fv(floor, 3, kBatch, shares[0].data());
  glProgramUniform1i(floor, 11, static_cast<GLint>(count));
  glBindFramebuffer(GL_FRAMEBUFFER, maps.taken_target);
  glViewport(0, 0, maps.edge, maps.edge);
  glBindTextureUnit(3, shadow_maps);
  glBindSampler(3, plain_sampler);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE);
  full_screen(floor);
  glDisable(GL_BLEND);
}

void Renderer::State::blur_floor(const FloorMaps& maps) {
  glViewport(0, 0, maps.edge, maps.edge);
  glBindTextureUnit(0, maps.taken);
  glBindTextureUnit(1, maps.radii);
  glBindFramebuffer(GL_FRAMEBUFFER, maps.radii_target);
  glProgramUniform2i(floor_blur, 0, 0, maps.edge);
  full_screen(floor_blur);
  glBindFramebuffer(GL_FRAMEBUFFER, maps.light_target);
  glProgramUniform2i(floor_blur, 0, 1, maps.edge);
  full_screen(floor_blur);
}

/// Over the lit picture: solids behind the model, faint, and the tool sphere.
void Renderer::State::draw_veils(GLuint program, const Scene& scene, const Matrix& view) {
  const std::size_t opaque = scene.solids.opaque.size(), clear = scene.solids.translucent.size();
  if (opaque + clear == 0) return;
  set(program, 0, view);
  set(program, 1, scene.eye.at);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glEnable(GL_CULL_FACE);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_FALSE);
  glEnable(GL_STENCIL_TEST);
  // Only where the model is in front, and once per pixel.
  glDepthFunc(GL_GREATER);
  glStencilFunc(GL_EQUAL, 1, 0xff);
  glStencilOp(GL_KEEP, GL_KEEP, GL_INCR);
  glProgramUniform2f(program, 2, 0.28F, 0.28F);
  draw_solids(program, 0, opaque);
  glDisable(GL_STENCIL_TEST);
  glDepthFunc(GL_LESS);
  glProgramUniform2f(program, 2, 0.10F, 0.62F);
  draw_solids(program, opaque, clear);
  glDepthFunc(GL_GREATER);
  glProgramUniform2f(program, 2, 0.02F, 0.16F);
  draw_solids(program, opaque, clear);
  glDepthMask(GL_TRUE);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
}

/// For the programs with kBackdrop.
void Renderer::State::set_floor(GLuint program, const Scene& scene) {
  set(program, 0, scene.eye.at);
  const std::array<float, 4> plane = with(to_float(scene.floor.up), static_cast<float>(scene.floor_height));
  glProgramUniform4fv(program, 6, 1, plane.data());
  set(program, 7, scene.floor.right);
  set(program, 8, scene.floor.back);
  const std::array<float, 4> middle = with(to_float(scene.floor_middle), static_cast<float>(scene.floor_half));
  glProgramUniform4fv(program, 9, 1, middle.data());
}

Status Renderer::State::draw_part(const Scene& scene, const DrawSettings& settings, const PixelPart& part, bool first,
                                  Picture& picture) {
  RELIEF_CHECK(size_targets(part.width * settings.supersample, part.height * settings.supersample));
  const Part share = part_of(part, settings);
  const Matrix view = projection(scene.eye, share);
  draw_surface(scene, settings, view);
  if (scene.cancelled()) return cancelled();

  glBindFramebuffer(GL_FRAMEBUFFER, targets.lit);
  constexpr std::array<float, 4> kNothing{};
  glClearNamedFramebufferfv(targets.lit, GL_COLOR, 0, kNothing.data());
  const auto on_covered = [&] {
    glBindFramebuffer(GL_FRAMEBUFFER, targets.lit);
    glViewport(0, 0, targets.width, targets.height);
    glBindTextureUnit(0, targets.base);
    glBindTextureUnit(1, targets.normal);
    glBindTextureUnit(2, targets.distance);
    glEnable(GL_STENCIL_TEST);
    glStencilFunc(GL_NOTEQUAL, 0, 0xff);
    glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
  };
  on_covered();
  set(ambient, 0, scene.floor.up);
  set(ambient, 1, scene.studio.sky);
  set(ambient, 2, scene.studio.ground);
  full_screen_in_strips(ambient, scene, targets.width, targets.height);
  glDisable(GL_STENCIL_TEST);

  set(light, 0, scene.eye.at);
  set_rays(light, 1, scene.eye, share, targets.width, targets.height);
  glProgramUniform1f(
      light, 5,
      settings.supersample > 1 ? static_cast<float>(kShadowSpread * diagonal(cache.bounds()) / kShadowEdge) : 0.0F);
  const bool on_floor = first && settings.ground;
  const FloorMaps& maps = floor_maps;
  if (on_floor) glClearNamedFramebufferfv(maps.taken_target, GL_COLOR, 0, kNothing.data());
  for (std::size_t k = 0; k < scene.studio.lights.size(); k += kBatch) {
    const std::size_t count = std::min<std::size_t>(kBatch, scene.studio.lights.size() - k);
    draw_shadows(scene, k, count);
    if (scene.cancelled()) return cancelled();
    if (on_floor) take_from_floor(scene, maps, k, count);
    on_covered();
    glBindTextureUnit(3, shadow_maps);
    glBindSampler(3, compare_sampler);
    glProgramUniform1i(light, 4, static_cast<GLint>(count));
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE);
    full_screen_in_strips(light, scene, targets.width, targets.height);
    glDisable(GL_BLEND);
    glDisable(GL_STENCIL_TEST);
  }
  glBindSampler(3, 0);
  if (scene.cancelled()) return cancelled();
  if (on_floor) blur_floor(maps);

  glBindFramebuffer(GL_FRAMEBUFFER, targets.lit);
  glViewport(0, 0, targets.width, targets.height);
  draw_veils(veil, scene, view);

  const GlFramebuffer out = make_framebuffer();
  const GlTexture pixels = attached(out, GL_COLOR_ATTACHMENT0, GL_RGBA8, part.width, part.height);
  glBindFramebuffer(GL_FRAMEBUFFER, out);
  glViewport(0, 0, part.width, part.height);
  glBindTextureUnit(0, targets.light);
  glBindTextureUnit(1, maps.light);
  set_rays(resolve, 1, scene.eye, share, part.width, part.height);
  glProgramUniform4i(resolve, 4, settings.supersample, settings.ground ? 1 : 0, part.x, part.y);
  glProgramUniform4f(resolve, 5, static_cast<float>(settings.width), static_cast<float>(settings.height), 0, 0);
  set_floor(resolve, scene);
  full_screen_in_strips(resolve, scene, part.width, part.height);
  if (scene.cancelled()) return cancelled();

  std::vector<std::uint8_t> rows(static_cast<std::size_t>(part.width) * static_cast<std::size_t>(part.height) * 3);
  glReadPixels(0, 0, part.width, part.height, GL_RGB, GL_UNSIGNED_BYTE, rows.data());
  const std::size_t line = static_cast<std::size_t>(part.width) * 3;
  for (int y = 0; y < part.height; ++y) {
    const auto row = static_cast<std::size_t>(picture.height - 1 - part.y - y);
    std::copy_n(
        rows.data() + static_cast<std::size_t>(y) * line, line,
        picture.rgb.data() + (row * static_cast<std::size_t>(picture.width) + static_cast<std::size_t>(part.x)) * 3);
  }
  return gl_status();
}

Result<Picture> Renderer::State::draw(const Snapshot& model, const Camera& camera, const DrawSettings& settings) {
  RELIEF_CHECK(check(camera, settings));
  const GlContext::Scope scope(*context);
  if (!scope.current()) return fail(Errc::Io, "cannot draw: the graphics driver lost the context; make a new renderer");
  const Stopwatch watch;
  stats = {};
  const std::optional<std::uint64_t> uploaded = cache.update(model, settings.cancel);
  RELIEF_CHECK(gl_status());
  if (!uploaded) return std::unexpected(cancelled().error());
  stats.tiles_uploaded = *uploaded;
  Scene scene = make_scene(camera, settings, kShadowEdge, kShadowTriangles);
  if (settings.cancel != nullptr)
    scene.go_on = [cancel = settings.cancel, on = true]() mutable {
      glFinish();
      on = on && !cancel->load(std::memory_order_relaxed);
      return on;
    };
  load_solids(scene.solids);
  Picture picture;
  picture.width = settings.width;
  picture.height = settings.height;
  picture.rgb.resize(static_cast<std::size_t>(settings.width) * static_cast<std::size_t>(settings.height) * 3);
  bool first = true;
  for (const PixelPart& part : parts_of(settings.width, settings.height, settings.supersample)) {
    RELIEF_CHECK(draw_part(scene, settings, part, first, picture));
    first = false;
  }
  if (settings.heat_map) draw_legend(picture, cache.min_alpha(), cache.max_alpha());
  stats.cpu_seconds = watch.cpu();
  stats.wall_seconds = watch.wall();
  return picture;
}

namespace {

/// sRGB to linear.
float linear(float c) { return c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F); }
Vec3f linear(Vec3f c) {
  const auto each = [](float x) { return linear(std::clamp(x, 0.0F, 1.0F)); };
  return {each(c.x), each(c.y), each(c.z)};
}

void set_rows(GLuint program, GLint at, const ShadowView& view) {
  glProgramUniform4fv(program, at, 3, view.rows[0].data());
}

/// For the programs with kQuickLight.
void set_quick_lights(GLuint program, const Studio& studio, const Eye& eye, Vec3d up) {
  const Vec3d key = studio.lights[0].towards, half_way = normalized(key - eye.forward);
  const double lh = std::clamp(dot(half_way, key), 0.0, 1.0), fresnel = 0.04 + 0.36 * std::pow(1 - lh, 5);
  constexpr double kSpread = 0.08;  // square of the width of the highlight: 1 minus the shader's factor
  const double gloss = fresnel * kSpread / (4 * std::max(lh * lh, 0.1) * 0.9);
  std::array<std::array<float, 4>, 3> towards{};
  std::array<Vec3f, 3> strength{};
  for (std::size_t k = 0; k < 3; ++k) {
    towards[k] = with(to_float(studio.lights[k].towards), 0);
    strength[k] = studio.lights[k].colour;
  }
  glProgramUniform4fv(program, 16, 3, towards[0].data());
  glProgramUniform3fv(program, 19, 3, &strength[0].x);
  set(program, 22, normalized(up));
  set(program, 23, (studio.sky + studio.ground) * 0.5F);
  set(program, 24, (studio.sky - studio.ground) * 0.5F);
  const std::array<float, 4> between = with(to_float(half_way), static_cast<float>(gloss));
  glProgramUniform4fv(program, 25, 1, between.data());
}

}  // namespace

Status Renderer::State::set_up_quick() {
  RELIEF_TRY(quick_solid, make_program("quick solid", {kSolidVertex}, {kQuickLight, kQuickSolidFragment}));
  RELIEF_TRY(quick_veil, make_program("quick veil", {kSolidVertex}, {kQuickLight, kVeilFragment}));
  RELIEF_TRY(quick_floor, make_program("quick floor", {kScreenVertex}, {kQuickFloorFragment}));
  RELIEF_TRY(quick_backdrop, make_program("quick backdrop", {kScreenVertex}, {kBackdrop, kQuickBackdropFragment}));
  quick_shadow_target = make_framebuffer();
  quick_shadow_map =
      attached(quick_shadow_target, GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F, kQuickShadowEdge, kQuickShadowEdge);
  quick_floor_target = make_framebuffer();
  quick_floor_map =
      attached(quick_floor_target, GL_COLOR_ATTACHMENT0, GL_RGBA8, kQuickFloorEdge, kQuickFloorEdge, GL_LINEAR);
  RELIEF_CHECK(complete(quick_shadow_target));
  return complete(quick_floor_target);
}

Status Renderer::State::size_quick(QuickTargets& targets, int width, int height) {
  if (targets.width == width && targets.height == height) return {};
  targets = {};
  QuickTargets t;
  t.frame = make_framebuffer();
  t.colour = attached(t.frame, GL_COLOR_ATTACHMENT0, GL_RGBA8, width, height);
  t.depth = attached(t.frame, GL_DEPTH_STENCIL_ATTACHMENT, GL_DEPTH24_STENCIL8, width, height);
  RELIEF_CHECK(gl_status());
  RELIEF_CHECK(complete(t.frame));
  t.width = width;
  t.height = height;
  targets = std::move(t);
  return {};
}

/// The program with what these settings need and nothing else: on a software driver all branches cost, taken or not.
Result<GLuint> Renderer::State::quick_surface(const Scene& scene, const DrawSettings& settings) {
  std::string features;
  const auto feature = [&](bool wanted, std::string_view name) {
    if (wanted) features.append("#define ").append(name).append("\n");
  };
  feature(settings.heat_map, "HEAT");
  feature(cache.has_colour() && !settings.heat_map, "COLOUR");
  feature(settings.slab_wires, "WIRES");
  feature(scene.ring[3] > 0, "RING");
  feature(!cache.closed(), "TWO_SIDED");
  // Pixels of the ball around the model, for each triangle in front.
  const double radius = 0.5 * diagonal(cache.bounds());
  const double away = std::max(dot(cache.bounds().centre() - scene.eye.at, scene.eye.forward), scene.eye.near);
  const double edge = radius / (away * scene.eye.tan_y) * settings.height;
  const double pixels = 0.5 * std::numbers::pi * edge * edge /
                        static_cast<double>(std::max<std::uint64_t>(1, cache.triangle_count(settings.level)));
  feature(cache.closed() && pixels < kQuickSmall, "SMALL");
  const auto known = quick_surfaces.find(features);
  if (known != quick_surfaces.end()) return GLuint{known->second};
  RELIEF_TRY(GlProgram made, make_program("quick surface", {features, kPlace, kQuickLight, kQuickColour, kQuickVertex},
                                          {features, kQuickLight, kQuickColour, kQuickFragment}));
  return GLuint{quick_surfaces.emplace(features, std::move(made)).first->second};
}

void Renderer::State::draw_quick_shadow(const Scene& scene) {
  glBindFramebuffer(GL_FRAMEBUFFER, quick_shadow_target);
  glViewport(0, 0, kQuickShadowEdge, kQuickShadowEdge);
  constexpr float kFar = 1;
  glClearNamedFramebufferfv(quick_shadow_target, GL_DEPTH, 0, &kFar);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(1.5F, 4.0F);
  if (cache.closed()) glEnable(GL_CULL_FACE);
  const Matrix matrix = shadow_matrix(scene.shadows[0]);
  set(shadow, 0, matrix);
  glUseProgram(shadow);
  cache.draw(scene.shadow_level);
  set(solid_shadow, 0, matrix);
  draw_solids(solid_shadow, 0, scene.solids.opaque.size());
  glDisable(GL_CULL_FACE);
  glDisable(GL_POLYGON_OFFSET_FILL);
  glDisable(GL_DEPTH_TEST);
}

/// Floor and backdrop of the whole picture, drawn small: nothing in them is sharp.
Result<Backdrop> Renderer::State::draw_quick_backdrop(const Scene& scene, const DrawSettings& settings) {
  // The full picture's plain background.
  if (!settings.ground) return Backdrop({101, 103, 106, 255}, 1, 1, settings);
  const auto small = [](int edge) { return (edge + kQuickBackdropShare - 1) / kQuickBackdropShare; };
  const int width = small(settings.width), height = small(settings.height);
  RELIEF_CHECK(size_quick(quick_behind, width, height));
  const ShadowView& view = scene.shadows[0];
  const double texel = 2 * scene.floor_half * (kQuickFloorReach / kFloorReach) / kQuickFloorEdge;
  const Vec3d right = scene.floor.right * texel, back = scene.floor.back * texel;
  set(quick_floor, 0, scene.floor_middle - (right + back) * (0.5 * kQuickFloorEdge));
  set(quick_floor, 1, right);
  set(quick_floor, 2, back);
  set_rows(quick_floor, 3, view);
  const double across = static_cast<double>(view.texel) * kQuickShadowEdge;
  glProgramUniform1f(quick_floor, 6,
                     static_cast<float>(scene.studio.lights[0].apart * static_cast<double>(view.depth) / across));
  const Vec3d extent = cache.bounds().high - cache.bounds().low;
  const auto half = [&](Vec3d axis) {
    const double along = std::abs(axis.x) * extent.x + std::abs(axis.y) * extent.y + std::abs(axis.z) * extent.z;
    return static_cast<float>(std::max(0.5 * along / texel, 1.0));
  };
  constexpr float kMiddle = 0.5F * kQuickFloorEdge;
  glProgramUniform4f(quick_floor, 7, kMiddle, kMiddle, half(scene.floor.right), half(scene.floor.back));
  glBindFramebuffer(GL_FRAMEBUFFER, quick_floor_target);
  glViewport(0, 0, kQuickFloorEdge, kQuickFloorEdge);
  glBindTextureUnit(3, quick_shadow_map);
  glBindSampler(3, plain_sampler);
  full_screen(quick_floor);

  set_floor(quick_backdrop, scene);
  set(quick_backdrop, 7, scene.floor.right * (kFloorReach / kQuickFloorReach));
  set(quick_backdrop, 8, scene.floor.back * (kFloorReach / kQuickFloorReach));
  set_rays(quick_backdrop, 1, scene.eye, {}, width, height);
  glProgramUniform4i(quick_backdrop, 4, 1, 1, 0, 0);
  glProgramUniform4f(quick_backdrop, 5, static_cast<float>(width), static_cast<float>(height), 0, 0);
  glBindFramebuffer(GL_FRAMEBUFFER, quick_behind.frame);
  glViewport(0, 0, width, height);
  glBindTextureUnit(1, quick_floor_map);
  full_screen(quick_backdrop);
  std::vector<std::uint8_t> rgba(4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
  return Backdrop(std::move(rgba), width, height, settings);
}

Status Renderer::State::draw_quick_part(const Scene& scene, const DrawSettings& settings, const PixelPart& part,
                                        Backdrop& backdrop, Picture& picture) {
  RELIEF_CHECK(size_quick(quick, part.width, part.height));
  const Matrix view = projection(scene.eye, part_of(part, settings));
  const bool hand = !scene.solids.opaque.empty();
  RELIEF_TRY(const GLuint program, quick_surface(scene, settings));
  glBindFramebuffer(GL_FRAMEBUFFER, quick.frame);
  glViewport(0, 0, part.width, part.height);
  constexpr std::array<float, 4> kNothing{};
  glClearNamedFramebufferfv(quick.frame, GL_COLOR, 0, kNothing.data());
  glClearNamedFramebufferfi(quick.frame, GL_DEPTH_STENCIL, 0, 1.0F, 0);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  if (hand) {
    glEnable(GL_STENCIL_TEST);
    glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
    glStencilFunc(GL_ALWAYS, 1, 0xff);
  }
  if (cache.closed()) glEnable(GL_CULL_FACE);
  const Vec3d up = scene.floor.up;
  set(program, 0, view);
  set_rows(program, 8, scene.shadows[0]);
  glProgramUniform1f(program, 11, scene.shadows[0].texel);
  set_quick_lights(program, scene.studio, scene.eye, up);
  set(program, 1, linear(settings.base_colour));
  glProgramUniform4fv(program, 3, 1, scene.ring.data());
  glProgramUniform1f(program, 2, std::max(1.0F, static_cast<float>(settings.height) / 720.0F));
  if (settings.heat_map) {
    const float range = cache.max_alpha() - cache.min_alpha();
    glProgramUniform4f(program, 4, cache.min_alpha(), range > 0 ? 1 / range : 0.0F, 0, 0);
    std::array<Vec3f, kHeat.size()> heat = kHeat;
    for (Vec3f& each : heat) each = linear(each);
    glProgramUniform3fv(program, 30, static_cast<GLsizei>(heat.size()), &heat[0].x);
  }
  glBindTextureUnit(3, quick_shadow_map);
  glBindSampler(3, compare_sampler);
  glUseProgram(program);
  stats.triangles = cache.draw(settings.level);
  glBindSampler(3, 0);
  if (hand) {
    glEnable(GL_CULL_FACE);
    glStencilFunc(GL_ALWAYS, 2, 0xff);
    set(quick_solid, 0, view);
    set_quick_lights(quick_solid, scene.studio, scene.eye, up);
    draw_solids(quick_solid, 0, scene.solids.opaque.size());
    glDisable(GL_STENCIL_TEST);
  }
  glDisable(GL_CULL_FACE);
  glDisable(GL_DEPTH_TEST);
  draw_veils(quick_veil, scene, view);

  const std::size_t line = static_cast<std::size_t>(part.width) * 4;
  quick_rows.resize(line * static_cast<std::size_t>(part.height));
  glReadPixels(0, 0, part.width, part.height, GL_RGBA, GL_UNSIGNED_BYTE, quick_rows.data());
  for (int y = 0; y < part.height; ++y) {
    const auto row = static_cast<std::size_t>(picture.height - 1 - part.y - y);
    const std::size_t to = row * static_cast<std::size_t>(picture.width) + static_cast<std::size_t>(part.x);
    backdrop.under(quick_rows.data() + static_cast<std::size_t>(y) * line, picture.rgb.data() + to * 3, part.x,
                   part.y + y, part.width);
  }
  return gl_status();
}

Result<Picture> Renderer::State::draw_quick(const Snapshot& model, const Camera& camera, const DrawSettings& settings) {
  RELIEF_CHECK(check(camera, settings));
  const GlContext::Scope scope(*context);
  if (!scope.current()) return fail(Errc::Io, "cannot draw: the graphics driver lost the context; make a new renderer");
  const Stopwatch watch;
  stats = {};
  stats.tiles_uploaded = cache.update(model).value_or(0);
  RELIEF_CHECK(gl_status());
  DrawSettings three = settings;
  three.supersample = 1;
  three.lights = 3;
  const Scene scene = make_scene(camera, three, kQuickShadowEdge, kQuickShadowTriangles);
  load_solids(scene.solids);
  Picture picture;
  picture.width = settings.width;
  picture.height = settings.height;
  picture.rgb.resize(static_cast<std::size_t>(settings.width) * static_cast<std::size_t>(settings.height) * 3);
  draw_quick_shadow(scene);
  RELIEF_TRY(Backdrop backdrop, draw_quick_backdrop(scene, three));
  for (const PixelPart& part : parts_of(settings.width, settings.height, 1))
    RELIEF_CHECK(draw_quick_part(scene, three, part, backdrop, picture));
  if (settings.heat_map) draw_legend(picture, cache.min_alpha(), cache.max_alpha());
  stats.cpu_seconds = watch.cpu();
  stats.wall_seconds = watch.wall();
  return picture;
}

Renderer::Renderer(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&& other) noexcept {
  std::swap(state_, other.state_);
  return *this;
}
Renderer::~Renderer() {
  if (!state_) return;
  // The objects go while their context is current, then the context itself.
  const std::unique_ptr<GlContext> context = std::move(state_->context);
  const GlContext::Scope scope(*context);
  state_.reset();
}

Result<Renderer> Renderer::create() {
  RELIEF_TRY(auto context, GlContext::create());
  Renderer made(std::make_unique<State>());
  made.state_->context = std::move(context);
  const GlContext::Scope scope(*made.state_->context);
  if (!scope.current()) return fail(Errc::Io, "cannot draw: the graphics driver gives no context");
  RELIEF_CHECK(made.state_->set_up());
  return made;
}

Result<Picture> Renderer::draw(const Snapshot& model, const Camera& camera, const DrawSettings& settings) {
  return state_->draw(model, camera, settings);
}

Result<Picture> Renderer::draw_quick(const Snapshot& model, const Camera& camera, const DrawSettings& settings) {
  return state_->draw_quick(model, camera, settings);
}

Result<Renderer::Coverage> Renderer::coverage(const Snapshot& model, const Camera& camera,
                                              const DrawSettings& settings) {
  RELIEF_CHECK(check(camera, settings));
  State& state = *state_;
  const GlContext::Scope scope(*state.context);
  if (!scope.current()) return fail(Errc::Io, "cannot draw: the graphics driver lost the context; make a new renderer");
  const Stopwatch watch;
  state.stats = {};
  state.stats.tiles_uploaded = state.cache.update(model).value_or(0);
  const Eye eye =
      make_eye(camera, state.cache.centre(), double(settings.width) / settings.height, state.cache.bounds());
  Coverage total;
  for (const PixelPart& part : parts_of(settings.width, settings.height, 1)) {
    const GlFramebuffer out = make_framebuffer();
    const GlTexture sums = attached(out, GL_COLOR_ATTACHMENT0, GL_RG32F, part.width, part.height);
    RELIEF_CHECK(complete(out));
    glBindFramebuffer(GL_FRAMEBUFFER, out);
    glViewport(0, 0, part.width, part.height);
    constexpr std::array<float, 4> kNothing{};
    glClearNamedFramebufferfv(out, GL_COLOR, 0, kNothing.data());
    set(state.coverage, 0, projection(eye, part_of(part, settings)));
    glUseProgram(state.coverage);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE);
    state.stats.triangles = state.cache.draw(settings.level);
    glDisable(GL_BLEND);
    std::vector<float> pixels(static_cast<std::size_t>(part.width) * static_cast<std::size_t>(part.height) * 2);
    glReadPixels(0, 0, part.width, part.height, GL_RG, GL_FLOAT, pixels.data());
    for (std::size_t k = 0; k < pixels.size(); k += 2) {
      total.cracks += pixels[k] != 0 ? 1 : 0;
      total.covered += pixels[k + 1] != 0 ? 1 : 0;
    }
  }
  RELIEF_CHECK(gl_status());
  state.stats.cpu_seconds = watch.cpu();
  state.stats.wall_seconds = watch.wall();
  return total;
}

const DrawStats& Renderer::stats() const noexcept { return state_->stats; }
const std::string& Renderer::device() const noexcept { return state_->context->device(); }

}  // namespace relief
