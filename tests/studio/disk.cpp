// A disk in trouble, preloaded into the studio. As long as the file that RELIEF_TEST_FULL names exists, model files get
// no more room; as long as the one of RELIEF_TEST_SLOW exists, writing to them waits.
#include <dlfcn.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <string>
#include <string_view>
#include <thread>

namespace {

/// Whether the descriptor is a model file, or the journal beside one.
bool is_model(int descriptor) {
  std::array<char, 4096> path{};
  const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
  const ssize_t length = readlink(link.c_str(), path.data(), path.size());
  return length > 0 &&
         std::string_view(path.data(), static_cast<std::size_t>(length)).find(".relief") != std::string_view::npos;
}

/// Whether the file exists that a variable names.
bool is_set(const char* variable) {
  const char* file = std::getenv(variable);
  return file != nullptr && access(file, F_OK) == 0;
}

/// Writes with the C library's function of a name, as soon as the disk takes anything.
template <typename... Arguments>
ssize_t write_with(const char* name, int descriptor, Arguments... arguments) {
  const bool troubled = is_model(descriptor);
  while (troubled && is_set("RELIEF_TEST_SLOW")) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  if (troubled && is_set("RELIEF_TEST_FULL")) {
    errno = ENOSPC;
    return -1;
  }
  return reinterpret_cast<ssize_t (*)(int, Arguments...)>(dlsym(RTLD_NEXT, name))(descriptor, arguments...);
}

}  // namespace

extern "C" {

[[gnu::visibility("default")]] ssize_t write(int descriptor, const void* bytes, size_t size) {
  return write_with("write", descriptor, bytes, size);
}
[[gnu::visibility("default")]] ssize_t pwrite64(int descriptor, const void* bytes, size_t size, off64_t at) {
  return write_with("pwrite64", descriptor, bytes, size, at);
}

}  // extern "C"
