#include "machine.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

namespace relief::bench {

namespace {

constexpr std::size_t kLine = 64;                              // bytes of a line of the cache
constexpr std::size_t kUnknownCache = std::size_t{64} << 20U;  // bytes: larger than most last levels

std::string first_line(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

std::string processor_name() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unknown";
}

/// "1024K" as bytes.
std::size_t size_in(const std::string& text) {
  char* unit = nullptr;
  const std::size_t number = std::strtoull(text.c_str(), &unit, 10);
  return *unit == 'K' ? number << 10U : *unit == 'M' ? number << 20U : number;
}

}  // namespace

Machine this_machine() {
  Machine machine = {.processor = processor_name(), .cores = std::max(1U, std::thread::hardware_concurrency())};
  const std::filesystem::path caches = "/sys/devices/system/cpu/cpu0/cache";
  int last = 0;
  for (int k = 0; std::filesystem::exists(caches / ("index" + std::to_string(k))); ++k) {
    const std::filesystem::path cache = caches / ("index" + std::to_string(k));
    const int level = std::atoi(first_line(cache / "level").c_str());
    const std::size_t bytes = size_in(first_line(cache / "size"));
    if (level == 2) machine.core_cache = bytes;
    if (level < last || first_line(cache / "type") == "Instruction") continue;
    last = level;
    machine.last_level_cache = bytes;
  }
  return machine;
}

double load_average() {
  std::ifstream in("/proc/loadavg");
  double load = 0;
  in >> load;
  return load;
}

std::size_t more_than_all_caches(const Machine& machine) noexcept {
  return machine.last_level_cache > 0 ? machine.last_level_cache + machine.last_level_cache / 2 : kUnknownCache;
}

void Eviction::operator()() noexcept {
  for (std::size_t i = 0; i < buffer_.size(); i += kLine) ++buffer_[i];
}

}  // namespace relief::bench
