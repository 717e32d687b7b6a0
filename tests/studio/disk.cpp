// Disks in trouble, preloaded into the studio. As long as the file that RELIEF_TEST_FULL names exists, model files in
// its folder get no more room; as long as the one of RELIEF_TEST_SLOW exists, writing to any model file waits.
#include <dlfcn.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>

namespace {

/// The file behind a descriptor where that is a model, or the journal beside one; empty where it is not.
std::string model_of(int descriptor) {
  std::string path(4096, '\0');
  const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
  const ssize_t length = readlink(link.c_str(), path.data(), path.size());
  path.resize(length > 0 ? static_cast<std::size_t>(length) : 0);
  return path.find(".relief") != std::string::npos ? path : std::string();
}

/// The file that a variable names, where it exists; else empty.
std::string flag(const char* variable) {
  const char* file = std::getenv(variable);
  return file != nullptr && access(file, F_OK) == 0 ? file : std::string();
}

std::string folder_of(const std::string& file) { return file.substr(0, file.rfind('/') + 1); }

/// Writes with the C library's function of a name, as soon as the disk takes anything.
template <typename... Arguments>
ssize_t write_with(const char* name, int descriptor, Arguments... arguments) {
  const std::string model = model_of(descriptor);
  while (!model.empty() && !flag("RELIEF_TEST_SLOW").empty()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  if (const std::string full = flag("RELIEF_TEST_FULL");
      !model.empty() && !full.empty() && folder_of(model) == folder_of(full)) {
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
