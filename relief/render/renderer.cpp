#include "renderer.h"

#include "display_cache.h"
#include "gl_context.h"
#include "overlay.h"
#include "shaders.h"
#include "studio.h"

#include <relief/base/assert.h>
#include <relief/base/try.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>

namespace relief {

using namespace detail;

namespace {

constexpr int kMaxEdge = 8192;
/// Sub-pixels held at once; larger pictures are drawn in parts, so that memory stays below 300 MB.
constexpr std::int64_t kPartSubPixels = 9'000'000;
constexpr int kPartEdge = 8192;
constexpr int kShadowEdge = 1024;
/// Texels along the floor map's edge, for a picture and for a quick frame.
constexpr int kFloorEdge = 320, kQuickFloorEdge = 96;
/// Edge of the square over which a pixel asks for shadow, in shadow texels.
constexpr double kShadowSpread = 4;
/// Half the floor's edge that receives shadows, in half diagonals of the model.
constexpr double kFloorReach = 2.6;
/// Above this the shadow maps are drawn a level coarser: a triangle is then far smaller than a shadow texel.
constexpr std::uint64_t kShadowTriangles = 1'500'000;

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

class Stopwatch {
 public:
  [[nodiscard]] double cpu() const { return static_cast<double>(std::clock() - cpu_) / CLOCKS_PER_SEC; }
  [[nodiscard]] double wall() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_).count();
  }

 private:
  std::clock_t cpu_ = std::clock();
  std::chrono::steady_clock::time_point wall_ = std::chrono::steady_clock::now();
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
  /// What all parts of one picture share.
  struct Scene {
    Eye eye;
    Frame floor;
    double floor_height = 0, floor_half = 1;
    Vec3d floor_middle;
    Studio studio;
    std::vector<ShadowView> shadows;
    Solids solids;
    std::array<float, 4> ring{};
    int shadow_level = 0;
  };

  std::unique_ptr<GlContext> context;
  GlProgram surface, coverage, shadow, solid, solid_shadow, veil, ambient, light, floor, floor_blur, resolve;
  GlTexture shadow_maps;
  GlFramebuffer shadow_target;
  GlSampler compare_sampler, plain_sampler;
  GlBuffer batch, solid_vertices;
  GlVertexArray empty, solid_array;
  FloorMaps floor_maps, quick_floor_maps;
  Targets targets;
  DisplayCache cache;
  DrawStats stats;

  Status set_up();
  Status size_targets(int width, int height);
  Scene make_scene(const Camera& camera, const DrawSettings& settings);
  Status draw_part(const Scene& scene, const DrawSettings& settings, const PixelPart& part, bool first,
                   Picture& picture);
  void draw_surface(const Scene& scene, const DrawSettings& settings, const Matrix& view);
  void draw_shadows(const Scene& scene, std::size_t first, std::size_t count);
  void take_from_floor(const Scene& scene, const FloorMaps& maps, std::size_t first, std::size_t count);
  void blur_floor(const FloorMaps& maps);
  void draw_veils(const Scene& scene, const Matrix& view);
  void draw_solids(GLuint program, std::size_t first, std::size_t count);
  void full_screen(GLuint program) const;
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
  RELIEF_TRY(surface, make_program("surface", kSurfaceVertex, kSurfaceFragment));
  RELIEF_TRY(coverage, make_program("coverage", kSurfaceVertex, kCoverageFragment));
  RELIEF_TRY(shadow, make_program("shadow", kSurfaceVertex, {}));
  RELIEF_TRY(solid, make_program("solid", kSolidVertex, kSolidFragment));
  RELIEF_TRY(solid_shadow, make_program("solid shadow", kSolidVertex, {}));
  RELIEF_TRY(veil, make_program("veil", kSolidVertex, kVeilFragment));
  RELIEF_TRY(ambient, make_program("ambient", kScreenVertex, kAmbientFragment));
  RELIEF_TRY(light, make_program("light", kScreenVertex, kLightFragment));
  RELIEF_TRY(floor, make_program("floor", kScreenVertex, kFloorFragment));
  RELIEF_TRY(floor_blur, make_program("floor blur", kScreenVertex, kFloorBlurFragment));
  RELIEF_TRY(resolve, make_program("resolve", kScreenVertex, kResolveFragment));

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
  for (FloorMaps* maps : {&floor_maps, &quick_floor_maps}) {
    maps->edge = maps == &floor_maps ? kFloorEdge : kQuickFloorEdge;
    for (GlFramebuffer* target : {&maps->taken_target, &maps->radii_target, &maps->light_target})
      *target = make_framebuffer();
    maps->taken = attached(maps->taken_target, GL_COLOR_ATTACHMENT0, GL_RGBA32F, maps->edge, maps->edge, GL_LINEAR);
    maps->radii = attached(maps->radii_target, GL_COLOR_ATTACHMENT0, GL_RGBA16F, maps->edge, maps->edge, GL_LINEAR);
    maps->light = attached(maps->light_target, GL_COLOR_ATTACHMENT0, GL_RGBA16F, maps->edge, maps->edge, GL_LINEAR);
    RELIEF_CHECK(complete(maps->taken_target));
    RELIEF_CHECK(complete(maps->light_target));
  }
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

Renderer::State::Scene Renderer::State::make_scene(const Camera& camera, const DrawSettings& settings) {
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
  scene.floor = floor_frame(scene.eye, camera.up);
  scene.floor_height = cache.lowest(scene.floor.up);
  const Vec3d middle = cache.bounds().centre();
  scene.floor_middle = middle + scene.floor.up * (scene.floor_height - dot(middle, scene.floor.up));
  scene.floor_half = kFloorReach * std::max(0.5 * diagonal(cache.bounds()), 1e-30);
  scene.studio = make_studio(settings.lights, scene.eye, camera.up);
  for (const Light& each : scene.studio.lights)
    scene.shadows.push_back(make_shadow_view(each.towards, seen, kShadowEdge));
  while (cache.triangle_count(settings.level + scene.shadow_level) > kShadowTriangles &&
         cache.triangle_count(settings.level + scene.shadow_level + 1) <
             cache.triangle_count(settings.level + scene.shadow_level))
    ++scene.shadow_level;
  scene.shadow_level += settings.level;
  return scene;
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
  stats.triangles = cache.draw(settings.level);

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
  for (std::size_t k = 0; k < count; ++k) {
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
    cache.draw(scene.shadow_level);
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
void Renderer::State::draw_veils(const Scene& scene, const Matrix& view) {
  const std::size_t opaque = scene.solids.opaque.size(), clear = scene.solids.translucent.size();
  if (opaque + clear == 0) return;
  set(veil, 0, view);
  set(veil, 1, scene.eye.at);
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
  glProgramUniform2f(veil, 2, 0.28F, 0.28F);
  draw_solids(veil, 0, opaque);
  glDisable(GL_STENCIL_TEST);
  glDepthFunc(GL_LESS);
  glProgramUniform2f(veil, 2, 0.10F, 0.62F);
  draw_solids(veil, opaque, clear);
  glDepthFunc(GL_GREATER);
  glProgramUniform2f(veil, 2, 0.02F, 0.16F);
  draw_solids(veil, opaque, clear);
  glDepthMask(GL_TRUE);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
}

Status Renderer::State::draw_part(const Scene& scene, const DrawSettings& settings, const PixelPart& part, bool first,
                                  Picture& picture) {
  RELIEF_CHECK(size_targets(part.width * settings.supersample, part.height * settings.supersample));
  const Part share = part_of(part, settings);
  const Matrix view = projection(scene.eye, share);
  draw_surface(scene, settings, view);

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
  full_screen(ambient);
  glDisable(GL_STENCIL_TEST);

  set(light, 0, scene.eye.at);
  set_rays(light, 1, scene.eye, share, targets.width, targets.height);
  glProgramUniform1f(
      light, 5,
      settings.supersample > 1 ? static_cast<float>(kShadowSpread * diagonal(cache.bounds()) / kShadowEdge) : 0.0F);
  const bool on_floor = first && settings.ground;
  const FloorMaps& maps = settings.lights > 1 ? floor_maps : quick_floor_maps;
  if (on_floor) glClearNamedFramebufferfv(maps.taken_target, GL_COLOR, 0, kNothing.data());
  for (std::size_t k = 0; k < scene.studio.lights.size(); k += kBatch) {
    const std::size_t count = std::min<std::size_t>(kBatch, scene.studio.lights.size() - k);
    draw_shadows(scene, k, count);
    if (on_floor) take_from_floor(scene, maps, k, count);
    on_covered();
    glBindTextureUnit(3, shadow_maps);
    glBindSampler(3, compare_sampler);
    glProgramUniform1i(light, 4, static_cast<GLint>(count));
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE);
    full_screen(light);
    glDisable(GL_BLEND);
    glDisable(GL_STENCIL_TEST);
  }
  glBindSampler(3, 0);
  if (on_floor) blur_floor(maps);

  glBindFramebuffer(GL_FRAMEBUFFER, targets.lit);
  glViewport(0, 0, targets.width, targets.height);
  draw_veils(scene, view);

  const GlFramebuffer out = make_framebuffer();
  const GlTexture pixels = attached(out, GL_COLOR_ATTACHMENT0, GL_RGBA8, part.width, part.height);
  glBindFramebuffer(GL_FRAMEBUFFER, out);
  glViewport(0, 0, part.width, part.height);
  glBindTextureUnit(0, targets.light);
  glBindTextureUnit(1, maps.light);
  set(resolve, 0, scene.eye.at);
  set_rays(resolve, 1, scene.eye, share, part.width, part.height);
  glProgramUniform4i(resolve, 4, settings.supersample, settings.ground ? 1 : 0, part.x, part.y);
  glProgramUniform4f(resolve, 5, static_cast<float>(settings.width), static_cast<float>(settings.height), 0, 0);
  const std::array<float, 4> plane = with(to_float(scene.floor.up), static_cast<float>(scene.floor_height));
  glProgramUniform4fv(resolve, 6, 1, plane.data());
  set(resolve, 7, scene.floor.right);
  set(resolve, 8, scene.floor.back);
  const std::array<float, 4> middle = with(to_float(scene.floor_middle), static_cast<float>(scene.floor_half));
  glProgramUniform4fv(resolve, 9, 1, middle.data());
  full_screen(resolve);

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
  stats.tiles_uploaded = cache.update(model);
  RELIEF_CHECK(gl_status());
  const Scene scene = make_scene(camera, settings);
  const Solids& solids = scene.solids;
  if (!solids.opaque.empty()) {
    std::vector<SolidVertex> all = solids.opaque;
    all.insert(all.end(), solids.translucent.begin(), solids.translucent.end());
    solid_vertices = make_buffer(all.size() * sizeof(SolidVertex), all.data());
    glVertexArrayVertexBuffer(solid_array, 0, solid_vertices, 0, sizeof(SolidVertex));
  }
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
  DrawSettings quick = settings;
  quick.supersample = 1;
  quick.lights = 1;
  return state_->draw(model, camera, quick);
}

Result<Renderer::Coverage> Renderer::coverage(const Snapshot& model, const Camera& camera,
                                              const DrawSettings& settings) {
  RELIEF_CHECK(check(camera, settings));
  State& state = *state_;
  const GlContext::Scope scope(*state.context);
  if (!scope.current()) return fail(Errc::Io, "cannot draw: the graphics driver lost the context; make a new renderer");
  const Stopwatch watch;
  state.stats = {};
  state.stats.tiles_uploaded = state.cache.update(model);
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
