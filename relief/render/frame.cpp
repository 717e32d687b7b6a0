#include "frame.h"

#include "background.h"
#include "coverage.h"
#include "display_cache.h"
#include "frame_shaders.h"
#include "gl_context.h"
#include "legend.h"
#include "matcaps.h"
#include "mesh_buffers.h"
#include "shaders.h"
#include "slab_view.h"
#include "studio.h"
#include "studio_painter.h"
#include "text.h"

#include <relief/base/assert.h>
#include <relief/base/cpu_time.h>
#include <relief/base/try.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <string>

namespace relief {

using namespace detail;

namespace {

constexpr int kMaxEdge = 8192;
/// Triangles of fewer pixels than this, as State::small_triangles() reckons them, get their colours at their corners.
constexpr double kSmallMoving = 6, kSmallFinal = 6;

void set(GLuint program, GLint at, Vec3f v) { glProgramUniform3f(program, at, v.x, v.y, v.z); }

float linear(float c) { return c * (c * (c * 0.3053F + 0.6822F) + 0.0125F); }  // as the shaders'
Vec3f linear(Vec3f c) { return {linear(c.x), linear(c.y), linear(c.z)}; }

Status check(const Frame& frame, std::size_t words, int stride) {
  const auto wrong = [](const std::string& text) { return fail(Errc::InvalidArgument, "cannot draw: " + text); };
  if (frame.width < 1 || frame.width > kMaxEdge || frame.height < 1 || frame.height > kMaxEdge)
    return wrong("the picture's width and height must be 1 to 8192 pixels, not " + std::to_string(frame.width) + " x " +
                 std::to_string(frame.height));
  if (stride < frame.width || words < static_cast<std::size_t>(stride) * static_cast<std::size_t>(frame.height - 1) +
                                          static_cast<std::size_t>(frame.width))
    return wrong("the caller's pixels must hold the whole picture");
  if (frame.samples != 1 && frame.samples != 4 && frame.samples != 9 && frame.samples != 16)
    return wrong("samples must be 1, 4, 9 or 16");
  if (frame.look.lights < 1 || frame.look.lights > 256) return wrong("the number of lights must be 1 to 256");
  if (frame.level < 0) return wrong("the level of detail must not be negative");
  if (frame.hand && (!is_finite(frame.hand->cursor) || !is_finite(frame.hand->contact_point) ||
                     !is_finite(frame.hand->force) || !std::isfinite(frame.hand->tool_radius)))
    return wrong("the hand's place and force must be finite");
  if (!(frame.tau >= 0 && frame.tau <= 1e6)) return wrong("tau must be 0 to 1e6 pixels");
  if (frame.look.matcap < 0 || static_cast<std::size_t>(frame.look.matcap) >= matcap_names().size())
    return wrong("there are " + std::to_string(matcap_names().size()) + " matcaps, numbered from 0");
  const Camera& camera = frame.camera;
  if (!is_finite(camera.eye) || !is_finite(camera.target) || !is_finite(camera.up) || !(length(camera.up) > 0) ||
      !(length(camera.target - camera.eye) > 0))
    return wrong("the camera's eye and target must be finite and differ, and its up must have a length");
  if (!camera.parallel && !(camera.field_of_view >= 0.1 && camera.field_of_view <= 170))
    return wrong("the camera's field of view must be 0.1 to 170 degrees");
  if (camera.parallel && !(camera.view_height > 0 && std::isfinite(camera.view_height)))
    return wrong("the camera's view height must be more than 0");
  return {};
}

/// Returns where in its pixel each sample of a frame lies, from the middle, in pixels: no two in one row or column.
Vec3f sample_place(int k, int samples) {
  if (samples == 1) return {};
  const int edge = samples == 4 ? 2 : samples == 9 ? 3 : 4, x = k % edge, y = k / edge;
  const auto share = 1.0F / static_cast<float>(samples);
  return {(static_cast<float>(x * edge + y) + 0.5F) * share - 0.5F,
          (static_cast<float>(y * edge + (edge - 1 - x)) + 0.5F) * share - 0.5F, 0};
}

/// Holds what an analysis map is measured against.
struct CageMeans {
  double fibre = 1;       ///< of the roots: length, model units
  double micro_area = 1;  ///< of a micro-triangle half way along the fibres
};

CageMeans cage_means(const SlabMesh& mesh) {
  double fibres = 0, area = 0, triangles = 0;
  for (const Fibre& f : mesh.root_fibres()) fibres += length(f.direction());
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const SlabCorners c = mesh.corners(s);
    const auto middle = [&](std::size_t k) { return (c.inner[k] + c.outer[k]) * 0.5; };
    area += 0.5 * length(cross(middle(1) - middle(0), middle(2) - middle(0)));
    triangles += double(mesh.intervals(s)) * mesh.intervals(s);
  }
  CageMeans means;
  if (fibres > 0) means.fibre = fibres / static_cast<double>(mesh.root_fibres().size());
  if (area > 0) means.micro_area = area / triangles;
  return means;
}

}  // namespace

struct FrameRenderer::State {
  std::unique_ptr<GlContext> context;  ///< null: the caller's
  std::string device;
  DisplayCache cache;
  std::optional<StudioPainter> painter;
  MeshBuffers mesh;
  std::map<std::string, GlProgram, std::less<>> programs;  ///< by their features
  GlTexture matcap_finished, matcap_light, map_texture;
  std::optional<std::pair<int, Vec3f>> matcap;  ///< which they show
  std::optional<Look::Map> map;
  std::optional<Text> text;
  GlTexture colour, depth;
  GlFramebuffer target;
  int width = 0, height = 0;
  // The last picture, and what it was drawn with.
  std::optional<Frame> last;
  bool last_mesh = false;
  Eye eye;
  SlabView view;
  DrawnLevels detail;
  MapScale scale;
  bool closed = false, small = false;  ///< see DisplayCache::closed(), small_triangles()
  CageMeans means;
  FrameStats stats;
  std::vector<std::uint32_t> pass;  ///< pixels of one sample
  SampleSums sums;

  /// Makes the context current while it lives, where it is not the caller's.
  Result<std::unique_ptr<GlContext::Scope>> enter() const;
  Status size(int w, int h);
  Status load_textures(const Look& look);
  [[nodiscard]] bool has_colours(const Look& look, bool slabs) const;
  [[nodiscard]] bool small_triangles(const Frame& frame) const;
  Result<GLuint> program(const Frame& frame, bool slabs);
  [[nodiscard]] MapScale map_scale(const Look& look) const;
  PixelRect plan(const Frame& frame, const std::optional<Snapshot>& before, const DisplayCache::Changes& changes,
                 bool same);
  [[nodiscard]] int widest_step(SlabId s) const;
  [[nodiscard]] DrawnLevels find_detail(const Frame& frame);
  PixelRect take_levels(const Frame& frame);
  PixelRect take_slabs(const Snapshot& before, const DisplayCache::Changes& changes);
  Status draw_pass(const Frame& frame, GLuint program, const PixelRect& rect, int sample, bool slabs,
                   const std::function<bool()>& go_on);
  void stands(const Frame& frame, bool of_mesh, const PixelRect& drawn, const Stopwatch& watch);
  Status draw_rect(const Frame& frame, const Pixels& pixels, bool slabs, const std::atomic<bool>* cancel);
  Status draw_studio(const Frame& frame, const Pixels& pixels, const std::atomic<bool>* cancel);
};

Result<std::unique_ptr<GlContext::Scope>> FrameRenderer::State::enter() const {
  std::unique_ptr<GlContext::Scope> scope;
  if (context) {
    scope = std::make_unique<GlContext::Scope>(*context);
    if (!scope->current())
      return fail(Errc::Io, "cannot draw: the graphics driver lost the context; make a new renderer");
  }
  return scope;
}

Status FrameRenderer::State::size(int w, int h) {
  if (width == w && height == h) return {};
  width = height = 0;
  target = make_framebuffer();
  colour = attached(target, GL_COLOR_ATTACHMENT0, GL_RGBA8, w, h);
  depth = attached(target, GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F, w, h);
  RELIEF_CHECK(gl_status());
  RELIEF_CHECK(complete(target));
  width = w;
  height = h;
  return {};
}

Status FrameRenderer::State::load_textures(const Look& look) {
  const auto load = [](GlTexture& texture, int w, int h, GLenum filter, const std::vector<std::uint32_t>& texels) {
    if (texture == 0) texture = make_texture(GL_RGBA8, w, h, filter);
    glTextureSubImage2D(texture, 0, 0, 0, w, h, GL_RGBA, GL_UNSIGNED_BYTE, texels.data());
  };
  if (matcap != std::pair{look.matcap, look.base_colour}) {
    const MatcapTables tables = make_matcap(static_cast<std::size_t>(look.matcap), look.base_colour);
    load(matcap_finished, kMatcapEdge, kMatcapEdge, GL_NEAREST, tables.finished);
    load(matcap_light, kMatcapEdge, kMatcapEdge, GL_NEAREST, tables.light);
    matcap = {look.matcap, look.base_colour};
  }
  if (look.map != Look::Map::None && map != look.map) {
    const auto colours = map_colours(look.map);
    load(map_texture, 256, 1, GL_LINEAR, {colours.begin(), colours.end()});
    map = look.map;
  }
  if (look.map != Look::Map::None && look.legend && !text) {
    RELIEF_TRY(text, Text::load());
  }
  return {};
}

bool FrameRenderer::State::has_colours(const Look& look, bool slabs) const {
  return look.colours && look.map == Look::Map::None && (slabs ? cache.has_colour() : !mesh.view.colours.empty());
}

/// Returns whether colours are found at the corners of triangles, which are so small that nothing is lost: a software
/// driver shades a small triangle's surroundings with it.
bool FrameRenderer::State::small_triangles(const Frame& frame) const {
  if (!cache.closed() || frame.look.map == Look::Map::Stretch) return false;
  // Pixels of the ball around the slabs, for each triangle in front.
  const Box3d box = cache.slab_bounds();
  const double away = eye.parallel ? 1 : std::max(dot(box.centre() - eye.at, eye.forward), eye.near);
  const double edge = 0.5 * diagonal(box) / (away * eye.tan_y) * frame.height;
  const double pixels = 0.5 * std::numbers::pi * edge * edge /
                        static_cast<double>(std::max<std::uint64_t>(1, cache.triangle_count(detail)));
  return pixels < (frame.samples == 1 ? kSmallMoving : kSmallFinal);
}

Result<GLuint> FrameRenderer::State::program(const Frame& frame, bool slabs) {
  const Look& look = frame.look;
  const bool mapped = slabs && look.map != Look::Map::None;
  std::string features;
  const auto feature = [&](bool wanted, std::string_view name) {
    if (wanted) features.append("#define ").append(name).append("\n");
  };
  feature(!slabs, "MESH");
  feature(has_colours(look, slabs), "COLOUR");
  feature(mapped, "MAP");
  feature(mapped && look.map == Look::Map::Stretch, "STRETCH");
  feature(!mapped && !has_colours(look, slabs), "BAKED");
  feature(look.cavity, "CAVITY");
  feature(slabs && look.mask && cache.has_mask(), "MASK");
  feature(slabs && look.slab_wires, "WIRES");
  feature(slabs && !cache.closed(), "TWO_SIDED");
  feature(slabs && small, "CORNERS");
  const auto known = programs.find(features);
  if (known != programs.end()) return GLuint{known->second};
  auto made =
      slabs ? make_program("frame", {features, kPlace, kFrameLight, kFrameAlbedo, kFrameVertex},
                           {features, kFrameLight, kFrameAlbedo, kSlabWires, kFrameFragment})
            : make_program("mesh frame", {features, kMeshVertex}, {features, kFrameLight, kFrameAlbedo, kMeshFragment});
  if (!made) return std::unexpected(std::move(made).error());
  return GLuint{programs.emplace(std::move(features), *std::move(made)).first->second};
}

MapScale FrameRenderer::State::map_scale(const Look& look) const {
  const double shown = look.mm_per_unit > 0 ? look.mm_per_unit : 1;
  const auto round = [&](double length) { return rounded_up(length * shown) / shown; };
  switch (look.map) {
    case Look::Map::Displacement: {
      const double most = std::max(std::abs(static_cast<double>(cache.min_alpha()) - 0.5),
                                   std::abs(static_cast<double>(cache.max_alpha()) - 0.5));
      const double half = round(most * means.fibre);
      return {-half, half};
    }
    case Look::Map::Depth:
      return {0, round(0.5 * means.fibre)};
    case Look::Map::Stretch:
      return {-2, 2};
    default:
      return {0, 1};
  }
}

/// Grid steps from a sample of the slab to the farthest that a triangle joins it with.
int FrameRenderer::State::widest_step(SlabId s) const {
  const SlabMesh& slabs = cache.model()->slab_mesh();
  const auto drawn = [&](SlabId slab) { return slabs.intervals(slab) >> detail.levels[slab]; };
  return slabs.intervals(s) / std::ranges::min(slabs.edge_intervals(s, drawn));
}

DrawnLevels FrameRenderer::State::find_detail(const Frame& frame) {
  auto levels = choose_levels(cache.model()->slab_mesh(), cache.centre(), eye, frame.height, frame.tau);
  for (std::uint8_t& each : levels) each = static_cast<std::uint8_t>(std::max<int>(each, frame.level));
  return cache.detail(std::move(levels));
}

/// Takes in other levels, and index lists, and says where slabs had others.
PixelRect FrameRenderer::State::take_levels(const Frame& frame) {
  PixelRect rect;
  DrawnLevels next = find_detail(frame);
  for (SlabId s = 0; s < detail.pattern.size(); ++s)
    if (s >= next.pattern.size() || next.pattern[s] != detail.pattern[s]) rect = united(rect, view.pixels(s));
  detail = std::move(next);
  return rect;
}

/// Returns where changed slabs were and where they are, or those of their triangles that have a changed sample.
PixelRect FrameRenderer::State::take_slabs(const Snapshot& before, const DisplayCache::Changes& changes) {
  PixelRect rect;
  for (const auto& [s, window, reshaped] : changes.slabs) {
    const int step = widest_step(s);
    for (const Snapshot* model : {&before, &*cache.model()})
      if (!reshaped) rect = united(rect, view.pixels_of(cache.box_of(*model, s, window, step)));
    if (reshaped && s < view.slab_count()) rect = united(rect, view.pixels(s));
    view.update(cache, s);
    if (reshaped) rect = united(rect, view.pixels(s));
  }
  return rect;
}

/// Returns what must be drawn; `before` is the snapshot that the cache held. Leaves eye, view, detail and scale as they
/// are for it.
PixelRect FrameRenderer::State::plan(const Frame& frame, const std::optional<Snapshot>& before,
                                     const DisplayCache::Changes& changes, bool same) {
  const PixelRect all{0, 0, frame.width, frame.height};
  const double area = means.micro_area;
  if (changes.everything || changes.cage) means = cage_means(cache.model()->slab_mesh());
  const MapScale now = map_scale(frame.look);
  const bool stretched = frame.look.map == Look::Map::Stretch && means.micro_area != area;
  bool everything = !same || changes.everything || now != scale || stretched;
  scale = now;
  stats.everything = true;
  // What it does not take to tell the inside from the outside is left out, so all depends on whether there are holes.
  if (everything || cache.closed() != closed) {
    closed = cache.closed();
    eye = make_eye(frame.camera, cache.centre(), double(frame.width) / frame.height, cache.slab_bounds());
    view.look(cache, eye, frame.width, frame.height);
    detail = find_detail(frame);
    small = small_triangles(frame);
    return all;
  }
  PixelRect rect;
  // Holes come and go with their own triangles, and change the levels around them; another cage changes the stitching
  // beside its slabs.
  if (changes.cage || (!changes.slabs.empty() && cache.model()->has(Layer::Void))) {
    rect = take_levels(frame);
    if (std::exchange(small, small_triangles(frame)) != small) everything = true;
  }
  rect = united(rect, take_slabs(*before, changes));
  if (everything) return all;
  if (std::int64_t{rect.width} * rect.height * 2 > std::int64_t{all.width} * all.height) return all;
  stats.everything = false;
  return rect;
}

Status FrameRenderer::State::draw_pass(const Frame& frame, GLuint prog, const PixelRect& rect, int sample, bool slabs,
                                       const std::function<bool()>& go_on) {
  const Vec3f at = sample_place(sample, frame.samples);
  const double dx = static_cast<double>(at.x) / frame.width, dy = static_cast<double>(at.y) / frame.height;
  // The picture is turned over so that its first row is its upper one.
  const Matrix matrix = projection(eye, {dx, 1 - dy, 1 + dx, -dy});
  glProgramUniformMatrix4fv(prog, 0, 1, GL_FALSE, matrix.data());
  constexpr std::array<float, 4> kNothing{};
  constexpr float kFar = 1;
  glClearBufferfv(GL_COLOR, 0, kNothing.data());
  glClearBufferfv(GL_DEPTH, 0, &kFar);
  glUseProgram(prog);
  if (!slabs) {
    glBindVertexArray(mesh.array);
    constexpr GLsizei kPortion = 150'000;
    for (GLsizei first = 0; first < mesh.count; first += kPortion) {
      glDrawElements(GL_TRIANGLES, std::min(kPortion, mesh.count - first), GL_UNSIGNED_INT,
                     reinterpret_cast<const void*>(static_cast<std::size_t>(first) * 4));
      if (go_on && !go_on()) break;
    }
    stats.triangles += static_cast<std::uint64_t>(mesh.count) / 3;
    return {};
  }
  stats.slabs_drawn = 0;
  const bool whole = rect.width == frame.width && rect.height == frame.height;
  stats.triangles += cache.draw(
      detail,
      [&](SlabId s) {
        const bool wanted = view.seen(s) && (whole || meet(view.pixels(s), rect));
        stats.slabs_drawn += wanted ? 1U : 0U;
        return wanted;
      },
      go_on);
  stats.slabs_culled = static_cast<std::uint32_t>(cache.slabs().size()) - stats.slabs_drawn;
  return {};
}

Status FrameRenderer::State::draw_rect(const Frame& frame, const Pixels& pixels, bool slabs,
                                       const std::atomic<bool>* cancel) {
  const auto cancelled = [&] { return cancel != nullptr && cancel->load(std::memory_order_relaxed); };
  const PixelRect& rect = pixels.rect;
  const Look& look = frame.look;
  RELIEF_CHECK(size(frame.width, frame.height));
  RELIEF_CHECK(load_textures(look));
  RELIEF_TRY(const GLuint prog, program(frame, slabs));
  const bool mapped = slabs && look.map != Look::Map::None;
  glBindTextureUnit(0, mapped || has_colours(look, slabs) ? matcap_light : matcap_finished);
  glBindSampler(0, 0);
  if (mapped) glBindTextureUnit(1, map_texture);
  glBindSampler(1, 0);
  const std::array<Vec3f, 3> axes = {to_float(eye.right), to_float(eye.up), to_float(-eye.forward)};
  glProgramUniform3fv(prog, 1, 3, &axes[0].x);
  set(prog, 5, linear(look.base_colour));
  const auto inverse_range = static_cast<float>(1 / (scale.high - scale.low));
  if (slabs) {
    set(prog, 4, {static_cast<float>(scale.low), inverse_range, static_cast<float>(look.map)});
    glProgramUniform1f(prog, 6, std::max(1.0F, static_cast<float>(frame.height) / 900.0F));
    glProgramUniform2f(prog, 7, static_cast<float>(1 / means.micro_area), inverse_range);
  }

  glBindFramebuffer(GL_FRAMEBUFFER, target);
  glViewport(0, 0, frame.width, frame.height);
  glEnable(GL_SCISSOR_TEST);
  glScissor(rect.x, rect.y, rect.width, rect.height);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  for (const GLenum each : {GL_BLEND, GL_STENCIL_TEST, GL_DITHER, GL_CULL_FACE, GL_POLYGON_OFFSET_FILL})
    glDisable(each);
  glFrontFace(GL_CW);
  if (slabs && cache.closed()) glEnable(GL_CULL_FACE);
  glPixelStorei(GL_PACK_ALIGNMENT, 4);

  const auto read = [&](int row_length, std::uint32_t* to) {
    glPixelStorei(GL_PACK_ROW_LENGTH, row_length);
    glReadPixels(rect.x, rect.y, rect.width, rect.height, GL_BGRA, GL_UNSIGNED_INT_8_8_8_8_REV, to);
    glPixelStorei(GL_PACK_ROW_LENGTH, 0);
  };
  std::function<bool()> go_on;
  if (cancel != nullptr)
    go_on = [&] {
      glFinish();
      return !cancelled();
    };
  if (frame.samples > 1) {
    pass.resize(static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height));
    sums.start(rect);
  }
  for (int k = 0; k < frame.samples; ++k) {
    RELIEF_CHECK(draw_pass(frame, prog, rect, k, slabs, go_on));
    if (cancelled()) break;
    if (frame.samples == 1) {
      read(pixels.stride, pixels.row(0));
    } else {
      read(0, pass.data());
      sums.add(pass);
    }
  }
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_CULL_FACE);
  if (cancelled()) {
    glFinish();
    return fail(Errc::Cancelled, "the picture was cancelled");
  }
  const Background background(look.top, look.bottom, frame.height);
  if (frame.samples == 1)
    fill_behind(pixels, background);
  else
    sums.write(pixels, frame.samples, background);
  if (mapped && look.legend) draw_legend(pixels, frame.height, look, scale, text ? &*text : nullptr);
  return gl_status();
}

Status FrameRenderer::State::draw_studio(const Frame& frame, const Pixels& pixels, const std::atomic<bool>* cancel) {
  if (!painter) {
    RELIEF_TRY(painter, StudioPainter::create(cache));
  }
  RELIEF_CHECK(load_textures(frame.look));
  const Look& look = frame.look;
  StudioSettings settings;
  settings.width = frame.width;
  settings.height = frame.height;
  settings.level = frame.level;
  settings.supersample = static_cast<int>(std::lround(std::sqrt(frame.samples)));
  settings.lights = look.lights;
  settings.slab_wires = look.slab_wires;
  settings.ground = look.ground;
  settings.cavity = look.cavity;
  settings.colours = look.colours;
  settings.mask = look.mask;
  settings.map = look.map;
  settings.map_low = scale.low;
  settings.map_high = scale.high;
  settings.micro_area = means.micro_area;
  settings.map_texture = map_texture;
  settings.base_colour = look.base_colour;
  settings.hand = frame.hand;
  settings.cancel = cancel;
  RELIEF_TRY(const Picture picture, painter->draw(frame.camera, settings));
  stats.triangles = painter->triangles();
  stats.slabs_drawn = static_cast<std::uint32_t>(cache.slabs().size());
  const std::uint8_t* from = picture.rgb.data();
  for (int y = 0; y < picture.height; ++y) {
    std::uint32_t* const to = pixels.row(y);
    for (int x = 0; x < picture.width; ++x, from += 3)
      to[x] = 0xff000000U | (static_cast<std::uint32_t>(from[0]) << 16U) | (static_cast<std::uint32_t>(from[1]) << 8U) |
              from[2];
  }
  if (frame.look.map != Look::Map::None && frame.look.legend)
    draw_legend(pixels, frame.height, frame.look, scale, text ? &*text : nullptr);
  return {};
}

FrameRenderer::FrameRenderer(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
FrameRenderer::FrameRenderer(FrameRenderer&&) noexcept = default;
FrameRenderer& FrameRenderer::operator=(FrameRenderer&& other) noexcept {
  std::swap(state_, other.state_);
  return *this;
}
FrameRenderer::~FrameRenderer() {
  if (!state_ || !state_->context) return;
  // The objects go while their context is current, then the context itself.
  const std::unique_ptr<GlContext> context = std::move(state_->context);
  const GlContext::Scope scope(*context);
  state_.reset();
}

Result<FrameRenderer> FrameRenderer::create() {
  RELIEF_TRY(auto context, GlContext::create());
  FrameRenderer made(std::make_unique<State>());
  made.state_->device = context->device();
  made.state_->context = std::move(context);
  return made;
}

Result<FrameRenderer> FrameRenderer::adopt() {
  RELIEF_TRY(std::string device, current_device());
  FrameRenderer made(std::make_unique<State>());
  made.state_->device = std::move(device);
  return made;
}

/// The picture is this one now.
void FrameRenderer::State::stands(const Frame& frame, bool of_mesh, const PixelRect& drawn, const Stopwatch& watch) {
  last = frame;
  last_mesh = of_mesh;
  stats.drawn = drawn;
  stats.cpu_seconds = watch.cpu();
  stats.wall_seconds = watch.wall();
}

Result<PixelRect> FrameRenderer::draw(const Snapshot& model, const Frame& frame, std::span<std::uint32_t> pixels,
                                      int stride, const std::atomic<bool>* cancel, bool everything) {
  RELIEF_CHECK(check(frame, pixels.size(), stride));
  State& s = *state_;
  RELIEF_TRY(const auto scope, s.enter());
  const Stopwatch watch;
  s.stats = {};
  const bool same = s.last == frame && !s.last_mesh && !everything;
  // Until this one stands, the caller's pixels are nobody's.
  s.last.reset();
  const std::optional<Snapshot> before = s.cache.model();
  const auto changes = s.cache.update(model, cancel);
  if (!changes) return fail(Errc::Cancelled, "the picture was cancelled");
  RELIEF_CHECK(gl_status());
  s.stats.tiles_uploaded = changes->tiles;
  PixelRect rect = s.plan(frame, before, *changes, same);
  const bool studio = frame.look.light == Look::Light::Studio;
  // A shadow may come from what is not seen itself.
  if (studio && (!rect.empty() || changes->tiles > 0)) {
    rect = {0, 0, frame.width, frame.height};
    s.stats.everything = true;
    RELIEF_CHECK(s.draw_studio(frame, {pixels.data(), stride, rect}, cancel));
  } else if (!rect.empty()) {
    RELIEF_CHECK(s.draw_rect(frame, {pixels.data(), stride, rect}, true, cancel));
  }
  s.stats.gpu_bytes = s.cache.gpu_bytes();
  s.stands(frame, false, rect, watch);
  return rect;
}

Result<PixelRect> FrameRenderer::draw(const MeshView& mesh, const Frame& frame, std::span<std::uint32_t> pixels,
                                      int stride, const std::atomic<bool>* cancel, bool everything) {
  RELIEF_CHECK(check(frame, pixels.size(), stride));
  State& s = *state_;
  RELIEF_TRY(const auto scope, s.enter());
  const Stopwatch watch;
  s.stats = {};
  const bool held = s.mesh.holds(mesh) && !everything;
  const bool same = s.last == frame && s.last_mesh && held;
  s.last.reset();
  if (!held) s.mesh.load(mesh);
  RELIEF_CHECK(gl_status());
  PixelRect rect;
  if (!same) {
    rect = {0, 0, frame.width, frame.height};
    s.eye = make_eye(frame.camera, s.mesh.centre, double(frame.width) / frame.height, s.mesh.bounds);
    RELIEF_CHECK(s.draw_rect(frame, {pixels.data(), stride, rect}, false, cancel));
    s.stats.everything = true;
  }
  s.stats.gpu_bytes = s.mesh.bytes;
  s.stands(frame, true, rect, watch);
  return rect;
}

Status FrameRenderer::draw_to(const Snapshot& model, const Frame& frame, unsigned framebuffer,
                              const std::atomic<bool>* cancel) {
  std::vector<std::uint32_t> pixels(static_cast<std::size_t>(std::max(frame.width, 0)) *
                                    static_cast<std::size_t>(std::max(frame.height, 0)));
  RELIEF_CHECK(draw(model, frame, pixels, frame.width, cancel, true));
  RELIEF_TRY(const auto scope, state_->enter());
  const GlFramebuffer from = make_framebuffer();
  const GlTexture picture = attached(from, GL_COLOR_ATTACHMENT0, GL_RGBA8, frame.width, frame.height);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glTextureSubImage2D(picture, 0, 0, 0, frame.width, frame.height, GL_BGRA, GL_UNSIGNED_INT_8_8_8_8_REV, pixels.data());
  glBlitNamedFramebuffer(from, framebuffer, 0, 0, frame.width, frame.height, 0, frame.height, frame.width, 0,
                         GL_COLOR_BUFFER_BIT, GL_NEAREST);
  return gl_status();
}

namespace {

/// Any of the renderer's subjects, drawn into a picture of its own.
template <typename Subject>
Result<Picture> draw_picture(FrameRenderer& renderer, const Subject& subject, const Frame& frame,
                             const std::atomic<bool>* cancel) {
  std::vector<std::uint32_t> pixels(static_cast<std::size_t>(std::clamp(frame.width, 0, kMaxEdge)) *
                                    static_cast<std::size_t>(std::clamp(frame.height, 0, kMaxEdge)));
  RELIEF_CHECK(renderer.draw(subject, frame, pixels, frame.width, cancel, true));
  Picture picture{frame.width, frame.height, {}};
  picture.rgb.reserve(3 * pixels.size());
  for (const std::uint32_t word : pixels)
    for (const unsigned shift : {16U, 8U, 0U}) picture.rgb.push_back(static_cast<std::uint8_t>(word >> shift));
  return picture;
}

}  // namespace

Result<Picture> FrameRenderer::picture(const Snapshot& model, const Frame& frame, const std::atomic<bool>* cancel) {
  return draw_picture(*this, model, frame, cancel);
}
Result<Picture> FrameRenderer::picture(const MeshView& mesh, const Frame& frame, const std::atomic<bool>* cancel) {
  return draw_picture(*this, mesh, frame, cancel);
}

Result<FrameRenderer::Coverage> FrameRenderer::coverage(const Snapshot& model, const Frame& frame) {
  RELIEF_CHECK(check(frame, std::numeric_limits<std::size_t>::max(), frame.width));
  State& s = *state_;
  RELIEF_TRY(const auto scope, s.enter());
  s.last.reset();
  const auto changes = s.cache.update(model);
  s.stats = {};
  s.plan(frame, std::nullopt, *changes, false);
  RELIEF_TRY(const SignedCoverage sums, signed_coverage(s.cache, s.detail, frame.camera, frame.width, frame.height));
  s.stats.triangles = s.cache.triangle_count(s.detail);
  return Coverage{sums.covered, sums.cracks};
}

std::optional<Vec3d> FrameRenderer::pick(double x, double y) const {
  const State& s = *state_;
  if (!s.last || (s.last->look.light == Look::Light::Studio && !s.last_mesh) ||
      !(x >= 0 && x < s.width && y >= 0 && y < s.height))
    return std::nullopt;
  const auto scope = s.enter();
  if (!scope) return std::nullopt;
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  float depth = 1;
  glBindFramebuffer(GL_READ_FRAMEBUFFER, s.target);
  glReadPixels(column, row, 1, 1, GL_DEPTH_COMPONENT, GL_FLOAT, &depth);
  if (!(depth < 1)) return std::nullopt;
  const Eye& e = s.eye;
  const double z = 2 * static_cast<double>(depth) - 1;
  const double away = e.parallel ? 0.5 * (e.far + e.near + z * (e.far - e.near))
                                 : 2 * e.far * e.near / (e.far + e.near - z * (e.far - e.near));
  // The depth is that of the last sample in the pixel.
  const Vec3f at = sample_place(s.last->samples - 1, s.last->samples);
  const Ray3d ray = pixel_ray(s.last->camera, s.width, s.height, column + 0.5 + static_cast<double>(at.x),
                              row + 0.5 + static_cast<double>(at.y));
  return ray.origin + ray.direction * (away / dot(ray.direction, e.forward));
}

const FrameStats& FrameRenderer::stats() const noexcept { return state_->stats; }
const std::string& FrameRenderer::device() const noexcept { return state_->device; }
bool FrameRenderer::software() const noexcept {
  return device().find("llvmpipe") != std::string::npos || device().find("softpipe") != std::string::npos ||
         device().find("SWR") != std::string::npos;
}

std::span<const std::string_view> matcaps() noexcept { return matcap_names(); }

Ray3d pixel_ray(const Camera& camera, int width, int height, double x, double y) {
  const Eye eye = make_eye(camera, camera.eye, double(width) / height, Box3d{{-1, -1, -1}, {1, 1, 1}});
  const Vec3d aside = eye.right * ((2 * x / width - 1) * eye.tan_x) + eye.up * ((1 - 2 * y / height) * eye.tan_y);
  if (camera.parallel) return {camera.eye + aside, eye.forward};
  return {camera.eye, normalized(eye.forward + aside)};
}

}  // namespace relief
