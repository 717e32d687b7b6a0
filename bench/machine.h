// The machine that is measured on: its processor, its caches, how busy it is.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace relief::bench {

struct Machine {
  std::string processor;             ///< as the system names it
  unsigned cores = 1;                ///< that this process may use
  std::size_t core_cache = 0;        ///< bytes of the largest cache of one core's own; 0: the system does not say
  std::size_t last_level_cache = 0;  ///< bytes; 0: the system does not say
};
[[nodiscard]] Machine this_machine();

/// Threads that ran or waited for a core, mean of the last minute.
[[nodiscard]] double load_average();

/// Pushes everything out of the caches.
class Eviction {
 public:
  /// A buffer of one and a half times the last level of cache, or of 64 MiB where the system does not say how large
  /// that is. Its pages are of the usual size, so the translations of addresses go as well.
  explicit Eviction(const Machine& machine);
  /// Reads and changes each line of the buffer: what was there before is in no cache any more, the core's own included.
  void operator()() noexcept;
  [[nodiscard]] std::size_t bytes() const noexcept { return buffer_.size(); }

 private:
  std::vector<unsigned char> buffer_;
};

}  // namespace relief::bench
