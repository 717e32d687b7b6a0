#include "studio_painter.h"

#include "overlay.h"
#include "shaders.h"
#include "studio.h"

#include <relief/base/assert.h>
#include <relief/base/try.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>

namespace relief::detail {

namespace {

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

/// The eye's ray to a sub-pixel is ray[0] + x ray[1] + y ray[2]; its length along the eye's axis is 1.
void set_rays(GLuint program, GLint at, const Eye& eye, const Part& part, int width, int height) {
  const Vec3d x = eye.right * (2 * eye.tan_x), y = eye.up * (2 * eye.tan_y);
  set(program, at, eye.forward + x * (part.x0 - 0.5) + y * (part.y0 - 0.5));
  set(program, at + 1, x * ((part.x1 - part.x0) / width));
  set(program, at + 2, y * ((part.y1 - part.y0) / height));
}

Part part_of(const PixelPart& p, const StudioSettings& settings) {
  return {double(p.x) / settings.width, double(p.y) / settings.height, double(p.x + p.width) / settings.width,
          double(p.y + p.height) / settings.height};
}

float luminance(Vec3f c) { return 0.2126F * c.x + 0.7152F * c.y + 0.0722F * c.z; }

/// Lights and floor know perspective only: a parallel camera stands this many picture heights away.
constexpr double kAfar = 400;
Camera seen_from_afar(Camera camera, const Box3d& box) {
  if (!camera.parallel) return camera;
  const double away = kAfar * std::max(camera.view_height, 0.01 * diagonal(box));
  const Vec3d forward = normalized(camera.target - camera.eye);
  const Vec3d middle = camera.eye + forward * dot(box.centre() - camera.eye, forward);
  camera.eye = middle - forward * away;
  camera.target = middle;
  camera.field_of_view = 2 * std::atan(0.5 * camera.view_height / away) * 180 / std::numbers::pi;
  camera.parallel = false;
  return camera;
}

}  // namespace

struct StudioPainter::Passes {
  explicit Passes(DisplayCache& the_cache) : cache(the_cache) {}

  /// Holds what the model takes of the light on the floor.
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
  /// Holds what all parts of one picture share.
  struct Scene {
    Eye eye;
    FloorAxes floor;
    double floor_height = 0, floor_half = 1;
    Vec3d floor_middle;
    Studio studio;
    std::vector<ShadowView> shadows;
    Solids solids;
    std::array<float, 4> ring{};
    DrawnLevels surface_detail, shadow_detail;
    /// Empty when nobody can cancel the picture, which is then queued at once. Else waits until the driver has done
    /// what it was told, and says false from the first time that it sees the picture cancelled.
    std::function<bool()> go_on;
    [[nodiscard]] bool cancelled() const { return go_on && !go_on(); }
  };

  GlProgram surface, shadow, solid, solid_shadow, veil, ambient, light, floor, floor_blur, resolve;
  GlTexture shadow_maps;
  GlFramebuffer shadow_target;
  GlSampler compare_sampler, plain_sampler;
  GlBuffer batch, solid_vertices;
  GlVertexArray empty, solid_array;
  FloorMaps floor_maps;
  Targets targets;
  DisplayCache& cache;
  std::uint64_t triangles = 0;  ///< drawn in one geometry pass

  Status set_up();
  Status size_targets(int width, int height);
  Scene make_scene(const Camera& camera, const StudioSettings& settings);
  void load_solids(const Solids& solids);
  Status draw_part(const Scene& scene, const StudioSettings& settings, const PixelPart& part, bool first,
                   Picture& picture);
  void draw_surface(const Scene& scene, const StudioSettings& settings, const Matrix& view);
  void draw_shadows(const Scene& scene, std::size_t first, std::size_t count);
  void take_from_floor(const Scene& scene, const FloorMaps& maps, std::size_t first, std::size_t count);
  void blur_floor(const FloorMaps& maps);
  void draw_veils(GLuint program, const Scene& scene, const Matrix& view);
  void draw_solids(GLuint program, std::size_t first, std::size_t count);
  void full_screen(GLuint program) const;
  void full_screen_in_strips(GLuint program, const Scene& scene, int width, int height) const;
  static Status cancelled();
  void set_floor(GLuint program, const Scene& scene);
  Result<Picture> draw(const Camera& camera, const StudioSettings& settings);
};

Status StudioPainter::Passes::set_up() {
  RELIEF_TRY(surface, make_program("surface", {kPlace, kSurfaceVertex}, {kSlabWires, kSurfaceFragment}));
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
  RELIEF_CHECK(complete(shadow_target));
  return gl_status();
}

Status StudioPainter::Passes::size_targets(int width, int height) {
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

StudioPainter::Passes::Scene StudioPainter::Passes::make_scene(const Camera& camera, const StudioSettings& settings) {
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
    scene.shadows.push_back(make_shadow_view(each.towards, seen, kShadowEdge));
  scene.surface_detail = cache.detail(settings.level);
  scene.shadow_detail = scene.surface_detail;
  for (int level = settings.level + 1; cache.triangle_count(scene.shadow_detail) > kShadowTriangles; ++level) {
    DrawnLevels coarser = cache.detail(level);
    if (cache.triangle_count(coarser) >= cache.triangle_count(scene.shadow_detail)) break;
    scene.shadow_detail = std::move(coarser);
  }
  return scene;
}

void StudioPainter::Passes::load_solids(const Solids& solids) {
  if (solids.opaque.empty()) return;
  std::vector<SolidVertex> all = solids.opaque;
  all.insert(all.end(), solids.translucent.begin(), solids.translucent.end());
  solid_vertices = make_buffer(all.size() * sizeof(SolidVertex), all.data());
  glVertexArrayVertexBuffer(solid_array, 0, solid_vertices, 0, sizeof(SolidVertex));
}

void StudioPainter::Passes::draw_solids(GLuint program, std::size_t first, std::size_t count) {
  if (count == 0) return;
  glUseProgram(program);
  glBindVertexArray(solid_array);
  glDrawArrays(GL_TRIANGLES, static_cast<GLint>(first), static_cast<GLsizei>(count));
}

void StudioPainter::Passes::full_screen(GLuint program) const {
  glUseProgram(program);
  glBindVertexArray(empty);
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

/// Returns the same pixels, strip by strip where the picture may be cancelled; the rest is left out when it is.
void StudioPainter::Passes::full_screen_in_strips(GLuint program, const Scene& scene, int width, int height) const {
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
Status StudioPainter::Passes::cancelled() {
  for (const GLenum each : {GL_BLEND, GL_CULL_FACE, GL_DEPTH_TEST, GL_STENCIL_TEST}) glDisable(each);
  glBindSampler(3, 0);
  return fail(Errc::Cancelled, "the picture was cancelled");
}

/// Returns the surface and the solid overlays, without light. Stencil: 1 the model, 2 solids before it.
void StudioPainter::Passes::draw_surface(const Scene& scene, const StudioSettings& settings, const Matrix& view) {
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
  glProgramUniform4i(surface, 2, settings.colours && cache.has_colour() ? 1 : 0, static_cast<GLint>(settings.map),
                     settings.slab_wires ? 1 : 0, cache.closed() ? 0 : 1);
  glProgramUniform4fv(surface, 3, 1, scene.ring.data());
  const auto inverse_range = static_cast<float>(1 / (settings.map_high - settings.map_low));
  glProgramUniform4f(
      surface, 4, static_cast<float>(settings.map_low), inverse_range,
      static_cast<float>(settings.supersample) * std::max(1.0F, static_cast<float>(settings.height) / 720.0F),
      static_cast<float>(1 / settings.micro_area));
  glProgramUniform2f(surface, 5, settings.cavity ? 1.0F : 0.0F, settings.mask && cache.has_mask() ? 1.0F : 0.0F);
  glBindTextureUnit(4, settings.map_texture);
  glBindSampler(4, 0);
  glUseProgram(surface);
  triangles = cache.draw(scene.surface_detail, {}, scene.go_on);

  glEnable(GL_CULL_FACE);
  glStencilFunc(GL_ALWAYS, 2, 0xff);
  set(solid, 0, view);
  draw_solids(solid, 0, scene.solids.opaque.size());
  glDisable(GL_CULL_FACE);
  glDisable(GL_STENCIL_TEST);
  glDisable(GL_DEPTH_TEST);
}

void StudioPainter::Passes::draw_shadows(const Scene& scene, std::size_t first, std::size_t count) {
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
    cache.draw(scene.shadow_detail, {}, scene.go_on);
    set(solid_shadow, 0, matrix);
    draw_solids(solid_shadow, 0, scene.solids.opaque.size());
  }
  glDisable(GL_CULL_FACE);
  glDisable(GL_POLYGON_OFFSET_FILL);
  glDisable(GL_DEPTH_TEST);
  glNamedBufferSubData(batch, 0, sizeof(block), &block);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, batch);
}

void StudioPainter::Passes::take_from_floor(const Scene& scene, const FloorMaps& maps, std::size_t first,
                                            std::size_t count) {
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

void StudioPainter::Passes::blur_floor(const FloorMaps& maps) {
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
void StudioPainter::Passes::draw_veils(GLuint program, const Scene& scene, const Matrix& view) {
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
void StudioPainter::Passes::set_floor(GLuint program, const Scene& scene) {
  set(program, 0, scene.eye.at);
  const std::array<float, 4> plane = with(to_float(scene.floor.up), static_cast<float>(scene.floor_height));
  glProgramUniform4fv(program, 6, 1, plane.data());
  set(program, 7, scene.floor.right);
  set(program, 8, scene.floor.back);
  const std::array<float, 4> middle = with(to_float(scene.floor_middle), static_cast<float>(scene.floor_half));
  glProgramUniform4fv(program, 9, 1, middle.data());
}

Status StudioPainter::Passes::draw_part(const Scene& scene, const StudioSettings& settings, const PixelPart& part,
                                        bool first, Picture& picture) {
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

Result<Picture> StudioPainter::Passes::draw(const Camera& asked, const StudioSettings& settings) {
  const Camera camera =
      seen_from_afar(asked, {cache.bounds().low + cache.centre(), cache.bounds().high + cache.centre()});
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glPixelStorei(GL_PACK_ROW_LENGTH, 0);
  glFrontFace(GL_CCW);
  glDepthMask(GL_TRUE);
  glDisable(GL_DITHER);
  for (const GLenum each : {GL_SCISSOR_TEST, GL_BLEND, GL_CULL_FACE, GL_DEPTH_TEST, GL_STENCIL_TEST}) glDisable(each);
  Scene scene = make_scene(camera, settings);
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
  return picture;
}

StudioPainter::StudioPainter(std::unique_ptr<Passes> passes) noexcept : passes_(std::move(passes)) {}
StudioPainter::StudioPainter(StudioPainter&&) noexcept = default;
StudioPainter& StudioPainter::operator=(StudioPainter&&) noexcept = default;
StudioPainter::~StudioPainter() = default;

Result<StudioPainter> StudioPainter::create(DisplayCache& cache) {
  StudioPainter made(std::make_unique<Passes>(cache));
  RELIEF_CHECK(made.passes_->set_up());
  return made;
}

Result<Picture> StudioPainter::draw(const Camera& camera, const StudioSettings& settings) {
  return passes_->draw(camera, settings);
}

std::uint64_t StudioPainter::triangles() const noexcept { return passes_->triangles; }

}  // namespace relief::detail
