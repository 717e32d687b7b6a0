// Preloaded into the studio, it makes the disk of model files full as long as the file that RELIEF_TEST_FULL names
// exists.
#include <dlfcn.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <string>
#include <string_view>

namespace {

/// Whether the descriptor is a model file, or the journal beside one, and the disk is full now.
bool is_full_for(int descriptor) {
  const char* flag = std::getenv("RELIEF_TEST_FULL");
  if (flag == nullptr || access(flag, F_OK) != 0) return false;
  std::array<char, 4096> path{};
  const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
  const ssize_t length = readlink(link.c_str(), path.data(), path.size());
  return length > 0 &&
         std::string_view(path.data(), static_cast<std::size_t>(length)).find(".relief") != std::string_view::npos;
}

template <typename Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

[[gnu::visibility("default")]] ssize_t write(int descriptor, const void* bytes, size_t size) {
  static auto* const real = next<ssize_t(int, const void*, size_t)>("write");
  if (!is_full_for(descriptor)) return real(descriptor, bytes, size);
  errno = ENOSPC;
  return -1;
}
[[gnu::visibility("default")]] ssize_t pwrite64(int descriptor, const void* bytes, size_t size, off64_t at) {
  static auto* const real = next<ssize_t(int, const void*, size_t, off64_t)>("pwrite64");
  if (!is_full_for(descriptor)) return real(descriptor, bytes, size, at);
  errno = ENOSPC;
  return -1;
}

}  // extern "C"
