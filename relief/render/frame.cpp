#include "frame.h"

#include "display_cache.h"
#include "frame_shaders.h"
#include "gl_context.h"
#include "matcaps.h"
#include "shaders.h"
#include "studio.h"

#include <relief/base/assert.h>
#include <relief/base/cpu_time.h>
#include <relief/base/try.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <string>

namespace relief {

using namespace detail;

namespace {

constexpr int kMaxEdge = 8192;

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
  if (frame.samples != 1 && frame.samples != 4 && frame.samples != 16) return wrong("samples must be 1, 4 or 16");
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

/// Where in its pixel each sample of a frame lies, from the middle, in pixels: no two in one row or column.
Vec3f sample_place(int k, int samples) {
  if (samples == 1) return {};
  const int edge = samples == 4 ? 2 : 4, x = k % edge, y = k / edge;
  const auto share = 1.0F / static_cast<float>(samples);
  return {(static_cast<float>(x * edge + y) + 0.5F) * share - 0.5F,
          (static_cast<float>(y * edge + (edge - 1 - x)) + 0.5F) * share - 0.5F, 0};
}

/// The background's words: in each row eight that repeat, dithered so that no bands show.
class Background {
 public:
  Background(const Look& look, int height) {
    rows_.resize(static_cast<std::size_t>(height));
    for (int y = 0; y < height; ++y) {
      const float t = (static_cast<float>(y) + 0.5F) / static_cast<float>(height);
      const Vec3f c = look.top * (1 - t) + look.bottom * t;
      for (unsigned x = 0; x < kPeriod; ++x) {
        const float threshold = (static_cast<float>(bayer(x, static_cast<unsigned>(y))) + 0.5F) / 64;
        const auto code = [&](float v) {
          return static_cast<std::uint32_t>(std::floor(std::clamp(v, 0.0F, 1.0F) * 255 + threshold));
        };
        rows_[static_cast<std::size_t>(y)][x] = 0xff000000U | (code(c.x) << 16U) | (code(c.y) << 8U) | code(c.z);
      }
    }
  }
  static constexpr unsigned kPeriod = 8;
  [[nodiscard]] const std::array<std::uint32_t, kPeriod>& row(int y) const {
    return rows_[static_cast<std::size_t>(y)];
  }

 private:
  /// The order in which an 8 x 8 square of pixels takes the next step of colour, 0..63.
  static unsigned bayer(unsigned x, unsigned y) {
    const unsigned d = x ^ y;
    return ((d & 1U) << 5U) | ((y & 1U) << 4U) | ((d & 2U) << 2U) | ((y & 2U) << 1U) | ((d & 4U) >> 1U) |
           ((y & 4U) >> 2U);
  }
  std::vector<std::array<std::uint32_t, kPeriod>> rows_;
};

Status gl_status() {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return {};
  while (glGetError() != GL_NO_ERROR) {
  }
  if (error == GL_OUT_OF_MEMORY)
    return fail(Errc::Io,
                "cannot draw: the graphics driver is out of memory; draw a smaller picture or a coarser level");
  return fail(Errc::Io, "cannot draw: the graphics driver reports error " + std::to_string(error));
}

/// Plain triangles as the driver holds them.
struct MeshBuffers {
  struct Vertex {
    Vec3f position;
    std::uint32_t normal = 0, colour = 0;
  };
  MeshView view;
  Vec3d centre;
  Box3d bounds;  ///< relative to the centre
  GlBuffer vertices, indices;
  GlVertexArray array;
  GLsizei count = 0;
  std::uint64_t bytes = 0;

  [[nodiscard]] bool holds(const MeshView& mesh) const {
    return count > 0 && mesh.positions.data() == view.positions.data() &&
           mesh.positions.size() == view.positions.size() && mesh.triangles.data() == view.triangles.data() &&
           mesh.triangles.size() == view.triangles.size() && mesh.colours.data() == view.colours.data();
  }
  void load(const MeshView& mesh);
};

void MeshBuffers::load(const MeshView& mesh) {
  Box3d box;
  for (const Vec3d& p : mesh.positions) box.add(p);
  centre = box.empty() ? Vec3d{} : box.centre();
  bounds = box.empty() ? Box3d{{}, {}} : Box3d{box.low - centre, box.high - centre};
  std::vector<Vertex> all(mesh.positions.size());
  std::vector<Vec3f> normals(all.size()), spreads(all.size());
  for (std::size_t k = 0; k < all.size(); ++k) all[k].position = to_float(mesh.positions[k] - centre);
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3f ab = all[b].position - all[a].position, ac = all[c].position - all[a].position, bc = ac - ab;
    const Vec3f area = cross(ab, ac);
    for (const std::uint32_t k : {a, b, c}) normals[k] += area;
    spreads[a] += ab + ac;
    spreads[b] += bc - ab;
    spreads[c] -= ac + bc;
  }
  const float scale = 0.0044F * static_cast<float>(diagonal(box));  // as of slabs, whose box is about a tenth larger
  for (std::size_t k = 0; k < all.size(); ++k) {
    const Vec3f n = normalized(normals[k]);
    const auto part = [](float v) { return static_cast<std::uint32_t>(std::lround(v * 511.0F)) & 1023U; };
    all[k].normal = part(n.x) | (part(n.y) << 10U) | (part(n.z) << 20U);
    const float area = length(normals[k]);
    float hollow = area > 0 ? dot(spreads[k], normals[k]) * 1.732F / (area * area) * scale : 0.0F;
    hollow /= 1 + std::abs(hollow);
    const Rgba8 colour = mesh.colours.empty() ? Rgba8{} : mesh.colours[k];
    all[k].colour = static_cast<std::uint32_t>(colour.r) | (static_cast<std::uint32_t>(colour.g) << 8U) |
                    (static_cast<std::uint32_t>(colour.b) << 16U) |
                    (static_cast<std::uint32_t>(std::lround((hollow * 0.5F + 0.5F) * 255)) << 24U);
  }
  const std::size_t index_bytes = mesh.triangles.size() * sizeof(mesh.triangles[0]);
  vertices = make_buffer(std::max<std::size_t>(all.size(), 1) * sizeof(Vertex), all.empty() ? nullptr : all.data());
  indices =
      make_buffer(std::max<std::size_t>(index_bytes, 1), mesh.triangles.empty() ? nullptr : mesh.triangles.data());
  array = make_vertex_array();
  glVertexArrayVertexBuffer(array, 0, vertices, 0, sizeof(Vertex));
  glVertexArrayElementBuffer(array, indices);
  for (GLuint k = 0; k < 3; ++k) {
    glEnableVertexArrayAttrib(array, k);
    glVertexArrayAttribBinding(array, k, 0);
  }
  glVertexArrayAttribFormat(array, 0, 3, GL_FLOAT, GL_FALSE, 0);
  glVertexArrayAttribFormat(array, 1, 4, GL_INT_2_10_10_10_REV, GL_TRUE, offsetof(Vertex, normal));
  glVertexArrayAttribFormat(array, 2, 4, GL_UNSIGNED_BYTE, GL_TRUE, offsetof(Vertex, colour));
  count = static_cast<GLsizei>(mesh.triangles.size() * 3);
  bytes = all.size() * sizeof(Vertex) + index_bytes;
  view = mesh;
}

}  // namespace

struct FrameRenderer::State {
  std::unique_ptr<GlContext> context;  ///< null: the caller's
  std::string device;
  DisplayCache cache;
  MeshBuffers mesh;
  std::map<std::string, GlProgram, std::less<>> programs;  ///< by their features
  GlTexture matcap_finished, matcap_light;
  std::optional<std::pair<int, Vec3f>> matcap;  ///< which they show
  GlTexture colour, depth;
  GlFramebuffer target;
  int width = 0, height = 0;
  // The last picture.
  std::optional<Frame> last;
  bool last_mesh = false;
  Eye eye;
  Vec3d centre;
  FrameStats stats;
  std::vector<std::uint32_t> pass;  ///< pixels of one sample
  std::vector<std::uint16_t> sums;  ///< blue, green, red, cover over the samples

  Result<PixelRect> draw_frame(const Frame& frame, std::span<std::uint32_t> pixels, int stride,
                               const std::atomic<bool>* cancel, const PixelRect& rect, bool slabs);
  Status size(int w, int h);
  Result<GLuint> program(const Frame& frame, bool slabs);
  void load_matcap(const Look& look);
};

Status FrameRenderer::State::size(int w, int h) {
  if (width == w && height == h) return {};
  width = height = 0;
  colour = make_texture(GL_RGBA8, w, h);
  depth = make_texture(GL_DEPTH_COMPONENT32F, w, h);
  target = make_framebuffer();
  glNamedFramebufferTexture(target, GL_COLOR_ATTACHMENT0, colour, 0);
  glNamedFramebufferTexture(target, GL_DEPTH_ATTACHMENT, depth, 0);
  RELIEF_CHECK(gl_status());
  if (glCheckNamedFramebufferStatus(target, GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    return fail(Errc::Io, "cannot draw: the graphics driver offers no picture of the kind needed; draw a smaller one");
  width = w;
  height = h;
  return {};
}

void FrameRenderer::State::load_matcap(const Look& look) {
  if (matcap == std::pair{look.matcap, look.base_colour}) return;
  const MatcapTables tables = make_matcap(static_cast<std::size_t>(look.matcap), look.base_colour);
  for (const auto& [texture, texels] :
       {std::pair{&matcap_finished, &tables.finished}, std::pair{&matcap_light, &tables.light}}) {
    if (*texture == 0) *texture = make_texture(GL_RGBA8, kMatcapEdge, kMatcapEdge);
    glTextureSubImage2D(*texture, 0, 0, 0, kMatcapEdge, kMatcapEdge, GL_RGBA, GL_UNSIGNED_BYTE, texels->data());
  }
  matcap = {look.matcap, look.base_colour};
}

Result<GLuint> FrameRenderer::State::program(const Frame& frame, bool slabs) {
  const Look& look = frame.look;
  std::string features;
  const auto feature = [&](bool wanted, std::string_view name) {
    if (wanted) features.append("#define ").append(name).append("\n");
  };
  const bool colours =
      look.colours && (slabs ? cache.has_colour() : !mesh.view.colours.empty()) && look.map == Look::Map::None;
  feature(!slabs, "MESH");
  feature(colours, "COLOUR");
  feature(!colours && (look.map == Look::Map::None || !slabs), "BAKED");
  feature(look.cavity, "CAVITY");
  feature(slabs && look.slab_wires, "WIRES");
  feature(slabs && !cache.closed(), "TWO_SIDED");
  const auto known = programs.find(features);
  if (known != programs.end()) return GLuint{known->second};
  GlProgram made;
  if (slabs) {
    RELIEF_TRY(made, make_program("frame", {features, kPlace, kFrameLight, kFrameAlbedo, kFrameVertex},
                                  {features, kFrameLight, kFrameAlbedo, kFrameFragment}));
  } else {
    RELIEF_TRY(made, make_program("mesh frame", {features, kMeshVertex},
                                  {features, kFrameLight, kFrameAlbedo, kMeshFragment}));
  }
  return GLuint{programs.emplace(features, std::move(made)).first->second};
}

Result<PixelRect> FrameRenderer::State::draw_frame(const Frame& frame, std::span<std::uint32_t> pixels, int stride,
                                                   const std::atomic<bool>* cancel, const PixelRect& rect, bool slabs) {
  const auto cancelled = [&] { return cancel != nullptr && cancel->load(std::memory_order_relaxed); };
  RELIEF_CHECK(size(frame.width, frame.height));
  load_matcap(frame.look);
  RELIEF_TRY(const GLuint prog, program(frame, slabs));
  const bool baked = !(frame.look.colours && (slabs ? cache.has_colour() : !mesh.view.colours.empty()));
  glBindTextureUnit(0, baked ? matcap_finished : matcap_light);
  const std::array<Vec3f, 3> axes = {to_float(eye.right), to_float(eye.up), to_float(-eye.forward)};
  glProgramUniform3fv(prog, 1, 3, &axes[0].x);
  set(prog, 5, linear(frame.look.base_colour));
  glProgramUniform1f(prog, 6, std::max(1.0F, static_cast<float>(frame.height) / 900.0F));

  glBindFramebuffer(GL_FRAMEBUFFER, target);
  glViewport(0, 0, frame.width, frame.height);
  glEnable(GL_SCISSOR_TEST);
  glScissor(rect.x, rect.y, rect.width, rect.height);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  glDisable(GL_BLEND);
  glDisable(GL_STENCIL_TEST);
  // The picture is turned over so that its first row is its upper one.
  glFrontFace(GL_CW);
  if (slabs && cache.closed())
    glEnable(GL_CULL_FACE);
  else
    glDisable(GL_CULL_FACE);

  const Background background(frame.look, frame.height);
  const std::size_t count = static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height);
  if (frame.samples > 1) {
    pass.resize(count);
    sums.assign(4 * count, 0);
  }
  stats.triangles = 0;
  for (int k = 0; k < frame.samples; ++k) {
    if (cancelled()) return fail(Errc::Cancelled, "the picture was cancelled");
    const Vec3f at = sample_place(k, frame.samples);
    const double dx = static_cast<double>(at.x) / frame.width, dy = static_cast<double>(at.y) / frame.height;
    const Matrix view = projection(eye, {dx, 1 - dy, 1 + dx, -dy});
    glProgramUniformMatrix4fv(prog, 0, 1, GL_FALSE, view.data());
    constexpr std::array<float, 4> kNothing{};
    constexpr float kFar = 1;
    glClearBufferfv(GL_COLOR, 0, kNothing.data());
    glClearBufferfv(GL_DEPTH, 0, &kFar);
    glUseProgram(prog);
    if (slabs) {
      stats.triangles += cache.draw(0);
    } else {
      glBindVertexArray(mesh.array);
      glDrawElements(GL_TRIANGLES, mesh.count, GL_UNSIGNED_INT, nullptr);
      stats.triangles += static_cast<std::uint64_t>(mesh.count) / 3;
    }
    if (frame.samples > 1) {
      glPixelStorei(GL_PACK_ROW_LENGTH, 0);
      glReadPixels(rect.x, rect.y, rect.width, rect.height, GL_BGRA, GL_UNSIGNED_INT_8_8_8_8_REV, pass.data());
      const auto* bytes = reinterpret_cast<const std::uint8_t*>(pass.data());
      for (std::size_t i = 0; i < 4 * count; ++i) sums[i] = static_cast<std::uint16_t>(sums[i] + bytes[i]);
    }
  }
  std::uint32_t* first = pixels.data() + static_cast<std::size_t>(rect.y) * static_cast<std::size_t>(stride) +
                         static_cast<std::size_t>(rect.x);
  if (frame.samples == 1) {
    glPixelStorei(GL_PACK_ROW_LENGTH, stride);
    glReadPixels(rect.x, rect.y, rect.width, rect.height, GL_BGRA, GL_UNSIGNED_INT_8_8_8_8_REV, first);
    glPixelStorei(GL_PACK_ROW_LENGTH, 0);
  }
  const auto samples = static_cast<unsigned>(frame.samples);
  for (int y = 0; y < rect.height; ++y) {
    std::uint32_t* to = first + static_cast<std::size_t>(y) * static_cast<std::size_t>(stride);
    const auto& behind = background.row(rect.y + y);
    if (samples == 1) {
      for (int x = 0; x < rect.width; ++x) {
        const std::uint32_t back = behind[static_cast<unsigned>(rect.x + x) % Background::kPeriod];
        to[x] = (to[x] >> 24U) != 0 ? to[x] : back;
      }
      continue;
    }
    const std::uint16_t* sum = sums.data() + 4 * static_cast<std::size_t>(y) * static_cast<std::size_t>(rect.width);
    for (int x = 0; x < rect.width; ++x, sum += 4) {
      const std::uint32_t back = behind[static_cast<unsigned>(rect.x + x) % Background::kPeriod];
      const unsigned open = samples - sum[3] / 255U;
      std::uint32_t word = 0xff000000U;
      for (unsigned c = 0; c < 3; ++c)
        word |= ((sum[c] + open * ((back >> (8 * c)) & 255U) + samples / 2) / samples) << (8 * c);
      to[x] = word;
    }
  }
  RELIEF_CHECK(gl_status());
  return rect;
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

Result<PixelRect> FrameRenderer::draw(const Snapshot& model, const Frame& frame, std::span<std::uint32_t> pixels,
                                      int stride, const std::atomic<bool>* cancel, bool everything) {
  RELIEF_CHECK(check(frame, pixels.size(), stride));
  State& s = *state_;
  std::optional<GlContext::Scope> scope;
  if (s.context) {
    scope.emplace(*s.context);
    if (!scope->current())
      return fail(Errc::Io, "cannot draw: the graphics driver lost the context; make a new renderer");
  }
  const Stopwatch watch;
  s.stats = {};
  const bool same = s.last == frame && !s.last_mesh && !everything;
  s.last.reset();
  const auto uploaded = s.cache.update(model, cancel);
  if (!uploaded) return fail(Errc::Cancelled, "the picture was cancelled");
  s.stats.tiles_uploaded = *uploaded;
  PixelRect rect{0, 0, frame.width, frame.height};
  if (same && *uploaded == 0) {
    rect = {};
  } else {
    s.centre = s.cache.centre();
    s.eye = make_eye(frame.camera, s.centre, double(frame.width) / frame.height, s.cache.bounds());
    RELIEF_TRY(rect, s.draw_frame(frame, pixels, stride, cancel, rect, true));
    s.stats.everything = true;
  }
  s.stats.drawn = rect;
  s.last = frame;
  s.last_mesh = false;
  s.stats.cpu_seconds = watch.cpu();
  s.stats.wall_seconds = watch.wall();
  return rect;
}

Result<PixelRect> FrameRenderer::draw(const MeshView& mesh, const Frame& frame, std::span<std::uint32_t> pixels,
                                      int stride, const std::atomic<bool>* cancel, bool everything) {
  RELIEF_CHECK(check(frame, pixels.size(), stride));
  State& s = *state_;
  std::optional<GlContext::Scope> scope;
  if (s.context) {
    scope.emplace(*s.context);
    if (!scope->current())
      return fail(Errc::Io, "cannot draw: the graphics driver lost the context; make a new renderer");
  }
  const Stopwatch watch;
  s.stats = {};
  const bool held = s.mesh.holds(mesh) && !everything;
  const bool same = s.last == frame && s.last_mesh && held;
  s.last.reset();
  if (!held) s.mesh.load(mesh);
  PixelRect rect{0, 0, frame.width, frame.height};
  if (same) {
    rect = {};
  } else {
    s.centre = s.mesh.centre;
    s.eye = make_eye(frame.camera, s.centre, double(frame.width) / frame.height, s.mesh.bounds);
    RELIEF_TRY(rect, s.draw_frame(frame, pixels, stride, cancel, rect, false));
    s.stats.everything = true;
  }
  s.stats.drawn = rect;
  s.last = frame;
  s.last_mesh = true;
  s.stats.cpu_seconds = watch.cpu();
  s.stats.wall_seconds = watch.wall();
  return rect;
}

Status FrameRenderer::draw_to(const Snapshot& model, const Frame& frame, unsigned framebuffer,
                              const std::atomic<bool>* cancel) {
  std::vector<std::uint32_t> pixels(static_cast<std::size_t>(std::max(frame.width, 0)) *
                                    static_cast<std::size_t>(std::max(frame.height, 0)));
  RELIEF_CHECK(draw(model, frame, pixels, frame.width, cancel, true));
  const GlTexture picture = make_texture(GL_RGBA8, frame.width, frame.height);
  const GlFramebuffer from = make_framebuffer();
  glNamedFramebufferTexture(from, GL_COLOR_ATTACHMENT0, picture, 0);
  glTextureSubImage2D(picture, 0, 0, 0, frame.width, frame.height, GL_BGRA, GL_UNSIGNED_INT_8_8_8_8_REV, pixels.data());
  glDisable(GL_SCISSOR_TEST);
  glBlitNamedFramebuffer(from, framebuffer, 0, 0, frame.width, frame.height, 0, frame.height, frame.width, 0,
                         GL_COLOR_BUFFER_BIT, GL_NEAREST);
  return gl_status();
}

std::optional<Vec3d> FrameRenderer::pick(double x, double y) const {
  const State& s = *state_;
  if (!s.last || !(x >= 0 && x < s.width && y >= 0 && y < s.height)) return std::nullopt;
  std::optional<GlContext::Scope> scope;
  if (s.context) scope.emplace(*s.context);
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  float depth = 1;
  glBindFramebuffer(GL_FRAMEBUFFER, s.target);
  glReadPixels(column, row, 1, 1, GL_DEPTH_COMPONENT, GL_FLOAT, &depth);
  if (!(depth < 1)) return std::nullopt;
  const Eye& e = s.eye;
  const double z = 2 * static_cast<double>(depth) - 1;
  const double away = e.parallel ? 0.5 * (e.far + e.near + z * (e.far - e.near))
                                 : 2 * e.far * e.near / (e.far + e.near - z * (e.far - e.near));
  // The depth is that of the last sample; a step of at most half a pixel to the place asked for is left out.
  const Ray3d ray = pixel_ray(s.last->camera, s.width, s.height, x, y);
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
