// What this process has in memory.
#pragma once

#include <cstddef>
#include <fstream>
#include <string>

namespace relief::testing {

/// Pages of files that are resident, on a disk or in a file system that is memory, bytes.
inline std::size_t resident_of_files() {
  std::ifstream status("/proc/self/status");
  std::size_t sum = 0;
  for (std::string word; status >> word;)
    if (std::size_t kib = 0; word == "RssFile:" || word == "RssShmem:") {
      status >> kib;
      sum += kib * 1024;
    }
  return sum;
}

}  // namespace relief::testing
