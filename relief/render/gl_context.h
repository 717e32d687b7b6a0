// An OpenGL 4.5 context without a surface, and owners for the few kinds of GL object that drawing needs.
#pragma once

#include <relief/base/error.h>

#include <epoxy/gl.h>

#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

namespace relief::detail {

/// Owns one EGL context. The display stays initialised for the life of the process: other contexts may share it.
class GlContext {
 public:
  /// Error: Io, naming the package that brings what is missing.
  [[nodiscard]] static Result<std::unique_ptr<GlContext>> create();
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;
  ~GlContext();

  [[nodiscard]] const std::string& device() const noexcept { return device_; }

  /// Makes the context current in this scope; what was current before is current again after it.
  class Scope {
   public:
    explicit Scope(const GlContext& context) noexcept;
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;
    ~Scope();
    [[nodiscard]] bool current() const noexcept { return current_; }

   private:
    void* own_display_;
    void *display_, *draw_, *read_, *context_;
    bool current_;
  };

 private:
  GlContext(void* display, void* context) noexcept : display_(display), context_(context) {}
  void *display_, *context_;
  std::string device_;
};

/// Says what the current context is: "llvmpipe (LLVM ...), OpenGL 4.5 ...". Error: Io, when there is none or it is too
/// old.
[[nodiscard]] Result<std::string> current_device();

/// Owns one GL name; destroyed while its context is current.
template <void (*kDelete)(GLuint)>
class GlName {
 public:
  GlName() = default;
  explicit GlName(GLuint name) noexcept : name_(name) {}
  GlName(GlName&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlName& operator=(GlName&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  ~GlName() {
    if (name_ != 0) kDelete(name_);
  }
  [[nodiscard]] operator GLuint() const noexcept { return name_; }  // NOLINT(google-explicit-constructor): a name

 private:
  GLuint name_ = 0;
};
void delete_buffer(GLuint name);
void delete_texture(GLuint name);
void delete_framebuffer(GLuint name);
void delete_program(GLuint name);
void delete_vertex_array(GLuint name);
void delete_sampler(GLuint name);
using GlBuffer = GlName<delete_buffer>;
using GlTexture = GlName<delete_texture>;
using GlFramebuffer = GlName<delete_framebuffer>;
using GlProgram = GlName<delete_program>;
using GlVertexArray = GlName<delete_vertex_array>;
using GlSampler = GlName<delete_sampler>;

/// Returns an immutable buffer; bytes may be null when `flags` allow later writing.
[[nodiscard]] GlBuffer make_buffer(std::size_t size, const void* bytes, GLbitfield flags = 0);
[[nodiscard]] GlTexture make_texture(GLenum format, int width, int height, GLenum filter = GL_NEAREST);
[[nodiscard]] GlFramebuffer make_framebuffer();
[[nodiscard]] GlVertexArray make_vertex_array();
/// Returns a texture that is that attachment of the framebuffer.
[[nodiscard]] GlTexture attached(GLuint framebuffer, GLenum attachment, GLenum format, int width, int height,
                                 GLenum filter = GL_NEAREST);
/// Error: Io, when the framebuffer cannot be drawn into.
[[nodiscard]] Status complete(GLuint framebuffer);
/// Error: Io, when the driver has reported an error since the last call.
[[nodiscard]] Status gl_status();
/// Compiles and links texts that follow one another; `fragment` may be empty. Error: Io with the first line of the
/// driver's complaint.
[[nodiscard]] Result<GlProgram> make_program(std::string_view name, std::initializer_list<std::string_view> vertex,
                                             std::initializer_list<std::string_view> fragment);

}  // namespace relief::detail
