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

/// Bytes of memory that are more than all caches hold: one and a half times the last level, or 64 MiB where the system
/// does not say how large that is.
[[nodiscard]] std::size_t more_than_all_caches(const Machine& machine) noexcept;

/// Pushes what was used before out of the caches of the core that calls it, and, where it is large, of all.
class Eviction {
 public:
  /// A buffer of so many bytes. Its pages are of the usual size, so the translations of addresses go as well.
  explicit Eviction(std::size_t bytes) : buffer_(bytes) {}
  /// Reads and changes each line of the buffer, so that all must be written back before their room is used again.
  void operator()() noexcept;
  [[nodiscard]] std::size_t bytes() const noexcept { return buffer_.size(); }

 private:
  std::vector<unsigned char> buffer_;
};

}  // namespace relief::bench
