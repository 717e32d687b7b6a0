#include "classic.h"

#include <relief/base/try.h>
#include <relief/core/query.h>
#include <relief/render/background.h>
#include <relief/render/frame_shaders.h>
#include <relief/render/gl_context.h>
#include <relief/render/matcaps.h>
#include <relief/render/studio.h>

#include <algorithm>
#include <vector>

namespace relief::bench {

using namespace detail;

namespace {

struct Vertex {
  Vec3f position, normal;
  float hollow;
};

constexpr std::string_view kVertex = R"(
layout(location = 0) in vec3 in_position;
layout(location = 1) in vec3 in_normal;
layout(location = 2) in float in_hollow;
layout(location = 0) uniform mat4 projection;
layout(location = 1) uniform vec3 axes[3];
out vec4 normal_shade;
out vec3 tint;
void main() {
  gl_Position = projection * vec4(in_position, 1.0);
  float shade = in_hollow > 0.0 ? 1.0 - 0.30 * in_hollow : 1.0 - 0.10 * in_hollow;
  normal_shade = vec4(dot(in_normal, axes[0]), dot(in_normal, axes[1]), dot(in_normal, axes[2]), shade);
  tint = vec3(1.0);
}
)";

}  // namespace

struct ClassicRenderer::State {
  struct Slab {
    GlBuffer vertices, indices;
    GlVertexArray array;
    GLsizei count = 0;
  };
  std::unique_ptr<GlContext> context;
  std::vector<Slab> slabs;
  GlProgram program;
  GlTexture matcap, colour, depth;
  GlFramebuffer target;
  int width = 0, height = 0;
  Vec3d centre;
  Box3d bounds;
  std::uint64_t bytes = 0;

  void add(const Snapshot& model, SlabId s);
};

void ClassicRenderer::State::add(const Snapshot& model, SlabId s) {
  const int n = model.slab_mesh().intervals(s);
  std::vector<Vertex> vertices;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i + j <= n; ++i) {
      const Vec3d p = sample_position(model, s, {i, j}) - centre;
      vertices.push_back({to_float(p), to_float(sample_normal(model, s, {i, j})), 0});
    }
  std::vector<std::uint16_t> indices;
  for_each_cell(n, [&](const std::array<GridPoint, 3>& cell) {
    for (const GridPoint p : cell) indices.push_back(static_cast<std::uint16_t>(sample_index(n, p)));
  });
  Slab slab;
  slab.vertices = make_buffer(vertices.size() * sizeof(Vertex), vertices.data());
  slab.indices = make_buffer(indices.size() * 2, indices.data());
  slab.count = static_cast<GLsizei>(indices.size());
  slab.array = make_vertex_array();
  glVertexArrayVertexBuffer(slab.array, 0, slab.vertices, 0, sizeof(Vertex));
  glVertexArrayElementBuffer(slab.array, slab.indices);
  for (GLuint k = 0; k < 3; ++k) {
    glEnableVertexArrayAttrib(slab.array, k);
    glVertexArrayAttribBinding(slab.array, k, 0);
    glVertexArrayAttribFormat(slab.array, k, k == 2 ? 1 : 3, GL_FLOAT, GL_FALSE,
                              k * static_cast<GLuint>(sizeof(Vec3f)));
  }
  bytes += vertices.size() * sizeof(Vertex) + indices.size() * 2;
  slabs.push_back(std::move(slab));
}

ClassicRenderer::ClassicRenderer(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
ClassicRenderer::ClassicRenderer(ClassicRenderer&&) noexcept = default;
ClassicRenderer& ClassicRenderer::operator=(ClassicRenderer&& other) noexcept {
  std::swap(state_, other.state_);
  return *this;
}
ClassicRenderer::~ClassicRenderer() {
  if (!state_) return;
  const std::unique_ptr<GlContext> context = std::move(state_->context);
  const GlContext::Scope scope(*context);
  state_.reset();
}

Result<ClassicRenderer> ClassicRenderer::create(const Snapshot& model) {
  RELIEF_TRY(auto context, GlContext::create());
  ClassicRenderer made(std::make_unique<State>());
  State& s = *made.state_;
  s.context = std::move(context);
  const GlContext::Scope scope(*s.context);
  s.centre = model.slab_mesh().bounds().centre();
  s.bounds = {model.slab_mesh().bounds().low - s.centre, model.slab_mesh().bounds().high - s.centre};
  for (SlabId slab = 0; slab < model.slab_mesh().slab_count(); ++slab) s.add(model, slab);
  constexpr std::string_view kFeatures = "#define BAKED\n#define CAVITY\n#define MESH\n";
  RELIEF_TRY(s.program,
             make_program("classic", {kFeatures, kVertex}, {kFeatures, kFrameLight, kFrameAlbedo, kMeshFragment}));
  const MatcapTables tables = make_matcap(0, Look{}.base_colour);
  s.matcap = make_texture(GL_RGBA8, kMatcapEdge, kMatcapEdge);
  glTextureSubImage2D(s.matcap, 0, 0, 0, kMatcapEdge, kMatcapEdge, GL_RGBA, GL_UNSIGNED_BYTE, tables.finished.data());
  RELIEF_CHECK(gl_status());
  return made;
}

Status ClassicRenderer::draw(const Frame& frame, std::span<std::uint32_t> pixels) {
  State& s = *state_;
  const GlContext::Scope scope(*s.context);
  if (s.width != frame.width || s.height != frame.height) {
    s.target = make_framebuffer();
    s.colour = attached(s.target, GL_COLOR_ATTACHMENT0, GL_RGBA8, frame.width, frame.height);
    s.depth = attached(s.target, GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F, frame.width, frame.height);
    s.width = frame.width;
    s.height = frame.height;
  }
  const Eye eye = make_eye(frame.camera, s.centre, double(frame.width) / frame.height, s.bounds);
  const Matrix view = projection(eye, {0, 1, 1, 0});
  glProgramUniformMatrix4fv(s.program, 0, 1, GL_FALSE, view.data());
  const std::array<Vec3f, 3> axes = {to_float(eye.right), to_float(eye.up), to_float(-eye.forward)};
  glProgramUniform3fv(s.program, 1, 3, &axes[0].x);
  glBindTextureUnit(0, s.matcap);
  glBindFramebuffer(GL_FRAMEBUFFER, s.target);
  glViewport(0, 0, frame.width, frame.height);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glEnable(GL_CULL_FACE);
  glFrontFace(GL_CW);
  constexpr std::array<float, 4> kNothing{};
  constexpr float kFar = 1;
  glClearBufferfv(GL_COLOR, 0, kNothing.data());
  glClearBufferfv(GL_DEPTH, 0, &kFar);
  glUseProgram(s.program);
  for (const State::Slab& slab : s.slabs) {
    glBindVertexArray(slab.array);
    glDrawElements(GL_TRIANGLES, slab.count, GL_UNSIGNED_SHORT, nullptr);
  }
  glReadPixels(0, 0, frame.width, frame.height, GL_BGRA, GL_UNSIGNED_INT_8_8_8_8_REV, pixels.data());
  fill_behind({pixels.data(), frame.width, {0, 0, frame.width, frame.height}},
              Background(frame.look.top, frame.look.bottom, frame.height));
  return gl_status();
}

std::uint64_t ClassicRenderer::gpu_bytes() const noexcept { return state_->bytes; }

}  // namespace relief::bench
