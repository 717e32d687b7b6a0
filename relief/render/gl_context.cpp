#include "gl_context.h"

#include <relief/base/try.h>

#include <dlfcn.h>
#include <epoxy/egl.h>

#include <array>

namespace relief::detail {

namespace {

constexpr const char* kEglPackage = "; install the package libegl1";
constexpr const char* kDriverPackage = "; install the package libgl1-mesa-dri, or a graphics driver with OpenGL 4.5";

/// libepoxy ends the program when a library is missing, so each is tried first. The handle is kept: it is loaded
/// anyway.
bool library_present(const char* name) { return dlopen(name, RTLD_LAZY | RTLD_LOCAL) != nullptr; }

std::string text_of(GLenum what) {
  const auto* text = reinterpret_cast<const char*>(glGetString(what));
  return text != nullptr ? printable(text) : std::string("unknown");
}

EGLDisplay open_display() {
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless")) {
    const EGLDisplay display = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    if (display != EGL_NO_DISPLAY && eglInitialize(display, nullptr, nullptr) == EGL_TRUE) return display;
  }
  if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_device") &&
      epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_enumeration")) {
    std::array<EGLDeviceEXT, 16> devices{};
    EGLint count = 0;
    if (eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count) != EGL_TRUE) count = 0;
    for (EGLint k = 0; k < count; ++k) {
      const EGLDisplay display =
          eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[static_cast<std::size_t>(k)], nullptr);
      if (display != EGL_NO_DISPLAY && eglInitialize(display, nullptr, nullptr) == EGL_TRUE) return display;
    }
  }
  return EGL_NO_DISPLAY;
}

}  // namespace

Result<std::unique_ptr<GlContext>> GlContext::create() {
  if (!library_present("libEGL.so.1"))
    return fail(Errc::Io, std::string("cannot draw: the library libEGL.so.1 is missing") + kEglPackage);
  if (!library_present("libOpenGL.so.0") && !library_present("libGL.so.1"))
    return fail(Errc::Io, "cannot draw: the library libGL.so.1 is missing; install the package libgl1");
  const EGLDisplay display = open_display();
  if (display == EGL_NO_DISPLAY)
    return fail(Errc::Io, std::string("cannot draw: EGL finds no driver that draws without a screen") + kDriverPackage);
  const EGLenum api_before = eglQueryAPI();
  const std::array<EGLint, 7> wanted = {
      EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 5, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  EGLContext context = EGL_NO_CONTEXT;
  if (eglBindAPI(EGL_OPENGL_API) == EGL_TRUE)
    context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, wanted.data());
  if (api_before != EGL_NONE) eglBindAPI(api_before);
  if (context == EGL_NO_CONTEXT)
    return fail(Errc::Io, std::string("cannot draw: the driver has no OpenGL 4.5") + kDriverPackage);
  std::unique_ptr<GlContext> made(new GlContext(display, context));
  const Scope scope(*made);
  if (!scope.current() || epoxy_gl_version() < 45)
    return fail(Errc::Io,
                std::string("cannot draw: the driver offers no OpenGL 4.5 without a surface") + kDriverPackage);
  RELIEF_TRY(made->device_, current_device());
  return made;
}

Result<std::string> current_device() {
  // libepoxy ends the program when it is asked for a function without a context.
  auto* const glx = reinterpret_cast<void* (*)()>(dlsym(RTLD_DEFAULT, "glXGetCurrentContext"));
  const bool by_egl = library_present("libEGL.so.1") && eglGetCurrentContext() != EGL_NO_CONTEXT;
  if (!by_egl && (glx == nullptr || glx() == nullptr))
    return fail(Errc::Io, "cannot draw: no OpenGL context is current on this thread");
  if (epoxy_gl_version() < 45) return fail(Errc::Io, "cannot draw: the current context is older than OpenGL 4.5");
  return text_of(GL_RENDERER) + ", OpenGL " + text_of(GL_VERSION);
}

GlContext::~GlContext() { eglDestroyContext(display_, context_); }

GlContext::Scope::Scope(const GlContext& context) noexcept
    : own_display_(context.display_),
      display_(eglGetCurrentDisplay()),
      draw_(eglGetCurrentSurface(EGL_DRAW)),
      read_(eglGetCurrentSurface(EGL_READ)),
      context_(eglGetCurrentContext()),
      current_(eglBindAPI(EGL_OPENGL_API) == EGL_TRUE &&
               eglMakeCurrent(context.display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context.context_) == EGL_TRUE) {}

GlContext::Scope::~Scope() {
  if (context_ != EGL_NO_CONTEXT)
    eglMakeCurrent(display_, draw_, read_, context_);
  else
    eglMakeCurrent(own_display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
}

void delete_buffer(GLuint name) { glDeleteBuffers(1, &name); }
void delete_texture(GLuint name) { glDeleteTextures(1, &name); }
void delete_framebuffer(GLuint name) { glDeleteFramebuffers(1, &name); }
void delete_program(GLuint name) { glDeleteProgram(name); }
void delete_vertex_array(GLuint name) { glDeleteVertexArrays(1, &name); }
void delete_sampler(GLuint name) { glDeleteSamplers(1, &name); }

GlBuffer make_buffer(std::size_t size, const void* bytes, GLbitfield flags) {
  GLuint name = 0;
  glCreateBuffers(1, &name);
  glNamedBufferStorage(name, static_cast<GLsizeiptr>(size), bytes, flags);
  return GlBuffer(name);
}

GlTexture make_texture(GLenum format, int width, int height, GLenum filter) {
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_2D, 1, &name);
  glTextureStorage2D(name, 1, format, width, height);
  glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, static_cast<GLint>(filter));
  glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, static_cast<GLint>(filter));
  glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return GlTexture(name);
}

GlFramebuffer make_framebuffer() {
  GLuint name = 0;
  glCreateFramebuffers(1, &name);
  return GlFramebuffer(name);
}

GlVertexArray make_vertex_array() {
  GLuint name = 0;
  glCreateVertexArrays(1, &name);
  return GlVertexArray(name);
}

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

GlTexture attached(GLuint framebuffer, GLenum attachment, GLenum format, int width, int height, GLenum filter) {
  GlTexture texture = make_texture(format, width, height, filter);
  glNamedFramebufferTexture(framebuffer, attachment, texture, 0);
  return texture;
}

Status complete(GLuint framebuffer) {
  if (glCheckNamedFramebufferStatus(framebuffer, GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE) return {};
  return fail(Errc::Io, "cannot draw: the graphics driver offers no picture of the kind needed; draw a smaller one");
}

Result<GlProgram> make_program(std::string_view name, std::initializer_list<std::string_view> vertex,
                               std::initializer_list<std::string_view> fragment) {
  const auto complaint = [&](std::string_view text) {
    return fail(Errc::Io, "the graphics driver refuses the program '" + std::string(name) +
                              "': " + printable(text.substr(0, text.find('\n'))));
  };
  GlProgram program(glCreateProgram());
  for (const auto& [stage, parts] : {std::pair{GL_VERTEX_SHADER, vertex}, std::pair{GL_FRAGMENT_SHADER, fragment}}) {
    if (parts.size() == 0) continue;
    std::string source = "#version 450\n";
    for (const std::string_view part : parts) source += part;
    const GLuint shader = glCreateShader(static_cast<GLenum>(stage));
    const char* text = source.data();
    const auto size = static_cast<GLint>(source.size());
    glShaderSource(shader, 1, &text, &size);
    glCompileShader(shader);
    GLint good = GL_FALSE;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
    std::array<char, 1024> log{};
    if (good != GL_TRUE) glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
    glAttachShader(program, shader);
    glDeleteShader(shader);
    if (good != GL_TRUE) return complaint(log.data());
  }
  glLinkProgram(program);
  GLint good = GL_FALSE;
  glGetProgramiv(program, GL_LINK_STATUS, &good);
  if (good != GL_TRUE) {
    std::array<char, 1024> log{};
    glGetProgramInfoLog(program, static_cast<GLsizei>(log.size()), nullptr, log.data());
    return complaint(log.data());
  }
  return program;
}

}  // namespace relief::detail
